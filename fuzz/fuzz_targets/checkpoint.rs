//! A checkpoint of evolution: an error, or a population that goes on evolving.
#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use tropism_neat::Neat;

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    tropism_fuzz::mutate_json(data, size, max_size, seed)
});

fuzz_target!(|text: &str| {
    let Ok(mut neat) = Neat::from_json(text) else { return };
    for _ in 0..3 {
        let scores: Vec<f64> = neat.ask().iter().map(|genome| genome.links().len() as f64).collect();
        // A population of thousands is allowed, but slow: what it would do, smaller ones show.
        if scores.len() > 200 || neat.tell(&scores).is_err() {
            return;
        }
    }
    let again = neat.to_json();
    assert_eq!(Neat::from_json(&again).unwrap().to_json(), again, "written and read again");
});
