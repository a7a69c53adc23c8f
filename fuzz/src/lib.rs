//! What the targets share: mutations of JSON that stay JSON, for bytes flipped at random seldom get past the parser,
//! and folders in memory.

use std::path::PathBuf;

use libfuzzer_sys::fuzzer_mutate;
use serde_json::{Value, json};

/// A new folder for this process, in memory where the system has such.
pub fn scratch(name: &str) -> PathBuf {
    let shared = PathBuf::from("/dev/shm");
    let root = if shared.is_dir() { shared } else { std::env::temp_dir() };
    let folder = root.join(format!("tropism-fuzz-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// Mutates `data[..size]`: mostly a value somewhere in the document, sometimes bytes. Returns the new size.
pub fn mutate_json(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let document = serde_json::from_slice::<Value>(&data[..size]);
    let Ok(mut document) =
        document.map_err(drop).and_then(|value| if seed % 8 == 0 { Err(()) } else { Ok(value) })
    else {
        return fuzzer_mutate(data, size, max_size);
    };
    let mut rng = Rng(u64::from(seed) << 1 | 1);
    let nodes = count(&document);
    for _ in 0..=rng.below(3) {
        let mut left = rng.below(nodes);
        change(&mut document, &mut left, &mut rng);
    }
    let text = document.to_string();
    if text.len() > max_size {
        return fuzzer_mutate(data, size, max_size);
    }
    data[..text.len()].copy_from_slice(text.as_bytes());
    text.len()
}

struct Rng(u64);

impl Rng {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }
}

fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(values) => values.iter().map(count).sum(),
        Value::Object(entries) => entries.values().map(count).sum(),
        _ => 0,
    }
}

/// Changes the node that is `left` steps away in reading order; true when that is done.
fn change(value: &mut Value, left: &mut usize, rng: &mut Rng) -> bool {
    if *left == 0 {
        replace(value, rng);
        return true;
    }
    *left -= 1;
    match value {
        Value::Array(values) => values.iter_mut().any(|value| change(value, left, rng)),
        Value::Object(entries) => entries.values_mut().any(|value| change(value, left, rng)),
        _ => false,
    }
}

fn replace(value: &mut Value, rng: &mut Rng) {
    match value {
        Value::Array(values) if !values.is_empty() && rng.below(8) > 0 => {
            let (from, to) = (rng.below(values.len()), rng.below(values.len()));
            match rng.below(4) {
                0 => drop(values.remove(from)),
                1 => values.insert(to, values[from].clone()),
                2 => values.swap(from, to),
                _ => values.truncate(from),
            }
        }
        Value::Object(entries) if !entries.is_empty() && rng.below(8) > 0 => {
            let key = entries.keys().nth(rng.below(entries.len())).expect("one of them").clone();
            let taken = entries.remove(&key).expect("it is there");
            if rng.below(2) == 0 {
                entries.insert(key + "_", taken);
            }
        }
        Value::Number(number) if rng.below(4) > 0 => {
            let near = number.as_f64().unwrap_or(0.0);
            *value = match rng.below(8) {
                0 => json!(near + 1.0),
                1 => json!(near - 1.0),
                2 => json!(number.as_u64().map_or(0, |whole| whole.wrapping_add(1))),
                3 => json!(number.as_u64().map_or(0, |whole| whole.saturating_sub(1))),
                4 => json!(-near),
                5 => json!([1e308, -1e308, 1e-320, 0.0, 0.5][rng.below(5)]),
                6 => json!([0_u64, 1, 255, 65_536, u64::from(u32::MAX), 1 << 53, u64::MAX][rng.below(7)]),
                _ => json!(rng.below(12)),
            };
        }
        _ => {
            *value = [Value::Null, json!(true), json!([]), json!({}), json!(""), json!(1), json!(-1)]
                [rng.below(7)]
            .clone()
        }
    }
}
