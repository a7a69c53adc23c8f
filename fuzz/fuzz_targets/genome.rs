//! A genome file: an error, or a genome that can be built, run, written and read again.
#![no_main]

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use tropism_neat::{Genome, Network, StepNetwork};

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    tropism_fuzz::mutate_json(data, size, max_size, seed)
});

fuzz_target!(|text: &str| {
    let Ok(genome) = Genome::from_json(text) else { return };
    assert!(Genome::from_json(&genome.to_json()).unwrap() == genome, "written and read again");
    let inputs = vec![0.5; genome.inputs()];
    let mut network = Network::new(&genome);
    let mut fast = StepNetwork::<2>::new(&genome);
    for _ in 0..3 {
        let output = network.activate(&inputs)[0] > 0.5;
        if let Some(fast) = &mut fast {
            assert_eq!(fast.activate([0.5, 0.5]), output);
        }
    }
});
