//! How the settings of work that is there differ from those of work that is asked for, key by key.

use std::fmt::Write;

use serde_json::Value;

use crate::files::shortened;

/// The most keys that are named; chosen: a line of a terminal or two.
const MOST: usize = 3;

/// Each setting of `found` that is another one in `wanted`, as ``: `seed` = 1, wanted 2; `task.max_steps` = 5, wanted none``.
/// Empty without such settings.
pub(crate) fn differences(found: &Value, wanted: &Value) -> String {
    let mut all = Vec::new();
    collect(String::new(), Some(found), Some(wanted), &mut all);
    let more = all.len().saturating_sub(MOST);
    let mut text = if all.is_empty() { String::new() } else { ": ".to_owned() };
    text += &all[..all.len() - more].join("; ");
    if more > 0 {
        let _ = write!(text, "; and {more} more");
    }
    text
}

/// Adds what differs at `key` or below it. Lists of one length are compared item by item, others as a whole.
fn collect(key: String, found: Option<&Value>, wanted: Option<&Value>, all: &mut Vec<String>) {
    match (found, wanted) {
        (found, wanted) if found == wanted => {}
        (Some(Value::Object(found)), Some(Value::Object(wanted))) => {
            let further = wanted.keys().filter(|key| !found.contains_key(*key));
            for name in found.keys().chain(further) {
                let below = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                collect(below, found.get(name), wanted.get(name), all);
            }
        }
        (Some(Value::Array(found)), Some(Value::Array(wanted))) if found.len() == wanted.len() => {
            for (place, (found, wanted)) in found.iter().zip(wanted).enumerate() {
                collect(format!("{key}[{place}]"), Some(found), Some(wanted), all);
            }
        }
        (found, wanted) => {
            let text = |value: Option<&Value>| match value {
                None | Some(Value::Null) => "none".to_owned(),
                Some(value) => shortened(&value.to_string()),
            };
            all.push(format!("`{key}` = {}, wanted {}", text(found), text(wanted)));
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn keys_are_named_with_both_values() {
        let found = json!({ "seed": 1, "task": { "targets": [[3.0, 6.0]], "max_steps": 5 }, "same": [1, 2] });
        let wanted = json!({ "seed": 2, "task": { "targets": [[3.0, 7.0]] }, "same": [1, 2] });
        let all = ": `seed` = 1, wanted 2; `task.max_steps` = 5, wanted none; `task.targets[0][1]` = 6.0, wanted 7.0";
        assert_eq!(differences(&found, &wanted), all);
        assert_eq!(differences(&found, &found), "");
        let [few, many] = [json!({ "a": [1] }), json!({ "a": [1, 2], "b": 1, "c": "x", "d": 2 })];
        let all = ": `a` = [1], wanted [1,2]; `b` = none, wanted 1; `c` = none, wanted \"x\"; and 1 more";
        assert_eq!(differences(&few, &many), all);
    }
}
