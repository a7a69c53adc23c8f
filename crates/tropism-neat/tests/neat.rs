//! Runs of NEAT through the public interface: rules of a generation, presets, checkpoints, and invalid input.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use tropism_neat::{
    Activation, CheckpointError, Config, Evaluation, Generation, Genome, Neat, NeatError, Network, evolve,
    random_genome,
};

/// A score that rewards a network whose output follows a fixed sequence: the number of steps, of 60, on which it agrees.
fn agreement(genome: &Genome) -> f64 {
    let mut network = Network::new(genome);
    let output = |network: &mut Network, step: i32| {
        network.activate(&[f64::from(step % 7) - 3.0, f64::from(step) / 30.0])[0]
    };
    let wanted = |step: i32| f64::from(u8::from(step % 7 > 3) ^ u8::from(step > 20));
    let errors = (0..60).filter(|&step| output(&mut network, step) != wanted(step)).count();
    60.0 - errors as f64
}

/// Advances a run by `count` generations.
fn advance(neat: &mut Neat, count: u32) -> Vec<Generation> {
    let next = |_| {
        let scores: Vec<f64> = neat.ask().iter().map(agreement).collect();
        neat.tell(&scores).unwrap()
    };
    (0..count).map(next).collect()
}

#[test]
fn an_initial_population_is_one_species_of_random_genomes() {
    let config = Config::wahby2016();
    let neat = Neat::new(config.clone(), 2, 1, 5).unwrap();
    assert_eq!(neat.ask().len(), 50);
    assert_eq!(neat.species().len(), 1);
    for (index, genome) in (0..).zip(neat.ask()) {
        assert_eq!(genome, &random_genome(&config, 2, 1, 5, index));
    }
}

#[test]
fn the_threshold_falls_with_few_species_and_rises_with_many() {
    for seed in 0..8 {
        let mut neat = Neat::new(Config::wahby2016(), 2, 1, seed).unwrap();
        let path = advance(&mut neat, 30);
        assert_eq!((path[0].threshold, path[0].species), (5.0, 1));
        for pair in path.windows(2) {
            let wanted = match pair[0].species {
                0..5 => (pair[0].threshold - 0.3).max(0.2),
                5..=25 => pair[0].threshold,
                _ => pair[0].threshold + 0.3,
            };
            assert_eq!(pair[1].threshold, wanted, "generation {}", pair[1].generation);
        }
        // From 5.0 by 0.3 per generation: there are five species long before the threshold reaches its minimum of 0.2.
        let first = path.iter().find(|generation| generation.species >= 5).unwrap();
        assert!((5..=16).contains(&first.generation), "{first:?}");
        assert!((0.8..3.5).contains(&first.threshold), "{first:?}");
    }
}

#[test]
fn a_new_threshold_applies_to_the_children_of_the_same_generation() {
    // From 5 to the minimum in one step: hardly any two children are then compatible.
    let config = Config { compat_threshold_modifier: 5.0, ..Config::wahby2016() };
    let mut neat = Neat::new(config, 2, 1, 1).unwrap();
    advance(&mut neat, 1);
    assert!(neat.species().len() > 10, "{}", neat.species().len());
}

/// The checkpoint of a run, which shows its private state.
fn checkpoint(neat: &Neat) -> serde_json::Value {
    let mut file: serde_json::Value = serde_json::from_str(&neat.to_json()).unwrap();
    file["run"].take()
}

#[test]
fn copies_fill_a_population_that_rounding_left_too_small() {
    let mut filled = 0;
    for seed in 0..4 {
        let mut neat = Neat::new(Config { population: 10, ..Config::wahby2016() }, 2, 1, seed).unwrap();
        for _ in 0..50 {
            advance(&mut neat, 1);
            let run = checkpoint(&neat);
            let ids = run["ids"].as_array().unwrap();
            let first = neat.species()[0].members()[0] as usize;
            let copies: Vec<usize> =
                (0..ids.len()).filter(|&index| ids[..index].contains(&ids[index])).collect();
            for &copy in &copies {
                assert_eq!((&ids[copy], &neat.ask()[copy]), (&ids[first], &neat.ask()[first]));
                assert!(neat.species()[0].members().contains(&(copy as u32)));
            }
            assert!(copies.is_empty() || ids.len() == 10, "{copies:?} of {}", ids.len());
            filled += usize::from(!copies.is_empty());
        }
    }
    assert!(filled > 10, "{filled}");
}

#[test]
fn the_first_member_is_the_representative() {
    let mut neat = Neat::new(Config::wahby2016(), 2, 1, 1).unwrap();
    advance(&mut neat, 40);
    let run = checkpoint(&neat);
    for species in run["species"].as_array().unwrap() {
        let first = species["members"][0].as_u64().unwrap() as usize;
        assert_eq!(species["representative"], run["population"][first]);
    }
}

#[test]
fn an_innovation_number_identifies_a_link_throughout_a_run() {
    let (mut numbers, mut links) = (BTreeMap::new(), BTreeMap::new());
    let mut neat = Neat::new(Config::wahby2016(), 2, 1, 1).unwrap();
    for _ in 0..150 {
        advance(&mut neat, 1);
        for link in neat.ask().iter().flat_map(Genome::links) {
            let ends = (link.from, link.to);
            assert_eq!(*links.entry(link.innovation).or_insert(ends), ends);
            assert_eq!(*numbers.entry(ends).or_insert(link.innovation), link.innovation);
        }
    }
    // Links are split repeatedly, but only a genome that has the recorded neuron gets a new one.
    let run = checkpoint(&neat);
    let splits = run["innovations"]["splits"].as_array().unwrap();
    let ends: BTreeSet<_> =
        splits.iter().map(|split| (split["from"].as_u64(), split["to"].as_u64())).collect();
    assert!(
        splits.len() > 20 && ends.len() as f64 > 0.8 * splits.len() as f64,
        "{} {}",
        splits.len(),
        ends.len()
    );
}

#[test]
fn populations_grow_by_a_few_and_species_stay_between_their_bounds() {
    let mut species = Vec::new();
    for seed in 0..4 {
        let mut neat = Neat::new(Config::wahby2016(), 2, 1, seed).unwrap();
        let path = advance(&mut neat, 300);
        let largest = path.iter().map(|generation| generation.population).max().unwrap();
        assert!(path.iter().all(|generation| generation.population >= 50));
        assert!((51..=60).contains(&largest), "{largest}");
        let evaluations: usize = path.iter().map(|generation| generation.population).sum();
        assert_eq!(neat.evaluations(), evaluations as u64);
        species.extend(path[100..].iter().map(|generation| generation.species));
    }
    species.sort_unstable();
    let median = species[species.len() / 2];
    assert!((8..=26).contains(&median), "{median}");
}

#[test]
fn the_best_score_never_falls_and_is_that_of_the_champion() {
    let mut neat = Neat::new(Config::wahby2016(), 2, 1, 3).unwrap();
    let path = advance(&mut neat, 150);
    assert!(path.windows(2).all(|pair| pair[0].best_ever <= pair[1].best_ever));
    // The elite is copied unchanged, and the task has no randomness.
    assert!(path.windows(2).all(|pair| pair[0].best <= pair[1].best));
    let champion = neat.champion().unwrap();
    assert_eq!(champion.fitness, path[149].best_ever);
    assert_eq!(agreement(&champion.genome), champion.fitness);
    assert_eq!(path[champion.generation as usize].best, champion.fitness);
    assert!(path[149].best > path[0].best);
}

#[test]
fn networks_grow_unless_their_size_is_controlled() {
    let links = |config: &Config| {
        let last = |seed| {
            let mut neat = Neat::new(config.clone(), 2, 1, seed).unwrap();
            let path = advance(&mut neat, 300);
            assert_eq!(path[0].links_mean, 3.0);
            path[299].links_mean
        };
        (0..4).map(last).sum::<f64>() / 4.0
    };
    let uncontrolled = links(&Config::wahby2016());
    let pruned = links(&Config { mutate_rem_link_prob: 0.05, ..Config::wahby2016() });
    let penalised = links(&Config { complexity_penalty: 2.0, ..Config::wahby2016() });
    assert!((10.0..40.0).contains(&uncontrolled), "{uncontrolled}");
    assert!(
        pruned < 0.7 * uncontrolled && penalised < 0.7 * uncontrolled,
        "{uncontrolled}, {pruned}, {penalised}"
    );
}

#[test]
fn runs_depend_on_their_seed_alone() {
    let run = |seed| {
        let mut neat = Neat::new(Config::ball_keeper(), 2, 1, seed).unwrap();
        (advance(&mut neat, 60), neat.to_json())
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
}

/// FNV-1a, a hash that is the same on every machine.
fn digest(text: &str) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    text.bytes().fold(0xcbf2_9ce4_8422_2325, step)
}

/// A change of these digests breaks the continuation of saved runs and the repetition of published ones.
#[test]
fn runs_have_their_recorded_digests() {
    let sigmoids = Config {
        feed_forward: true,
        output_activation: Activation::UnsignedSigmoid,
        hidden_activation: Activation::Tanh,
        mutate_rem_link_prob: 0.1,
        mutate_rem_neuron_prob: 0.1,
        interspecies_crossover_rate: 0.2,
        ..Config::wahby2016()
    };
    for (config, recorded) in [
        (Config::wahby2016(), 0xc544_e7e4_fb4c_e094),
        (Config::ball_keeper(), 0xd132_8d07_af29_dde1),
        (sigmoids, 0xf64a_8238_18fe_2587),
    ] {
        let mut neat = Neat::new(config, 2, 1, 1).unwrap();
        advance(&mut neat, 100);
        let found = digest(&neat.to_json());
        assert_eq!(found, recorded, "{found:#x}");
    }
}

#[test]
#[cfg(feature = "rayon")]
fn results_do_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let score = |genome: &Genome, _: Evaluation| agreement(genome);
        let runs =
            pool.install(|| evolve(&Config::wahby2016(), (2, 1), 0..4, 20, score, |_, _| false).unwrap());
        let json: Vec<_> = runs.iter().map(Neat::to_json).collect();
        (json, pool.install(|| runs[0].evaluate(score)))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn runs_stop_as_soon_as_they_are_solved() {
    let score =
        |_: &Genome, evaluation: Evaluation| f64::from(evaluation.generation) + evaluation.seed as f64;
    let runs = evolve(&Config::wahby2016(), (1, 1), 0..3, 50, score, |_, generation| generation.best >= 5.0)
        .unwrap();
    assert_eq!(runs.iter().map(Neat::generation).collect::<Vec<_>>(), [6, 5, 4]);
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    let mut neat = Neat::new(Config::wahby2016(), 2, 1, 8).unwrap();
    advance(&mut neat, 40);
    let json = neat.to_json();
    let mut restored = Neat::from_json(&json).unwrap();
    assert_eq!(restored.to_json(), json);
    assert_eq!(advance(&mut neat, 40), advance(&mut restored, 40));
    assert_eq!(neat.to_json(), restored.to_json());
    let through_serde: Neat = serde_json::from_str(&serde_json::to_string(&neat).unwrap()).unwrap();
    assert_eq!(through_serde.to_json(), neat.to_json());
}

const XOR: [([f64; 2], f64); 4] =
    [([0.0, 0.0], 0.0), ([0.0, 1.0], 1.0), ([1.0, 0.0], 1.0), ([1.0, 1.0], 0.0)];

fn xor_error(genome: &Genome) -> f64 {
    let mut network = Network::new(genome);
    XOR.map(|(inputs, target)| (network.run(&inputs)[0] - target).abs()).iter().sum()
}

/// Solved means an error below one half in each case.
fn solves_xor(genome: &Genome) -> bool {
    let mut network = Network::new(genome);
    XOR.iter().all(|(inputs, target)| (network.run(inputs)[0] - target).abs() < 0.5)
}

#[test]
fn every_preset_solves_xor() {
    let presets = [
        ("multineat", Config::multineat()),
        ("stanley2002", Config::stanley2002()),
        ("wahby2016", Config::wahby2016()),
        ("ball_keeper", Config::ball_keeper()),
    ];
    for (name, preset) in presets {
        // Steep sigmoids everywhere: with step neurons, XOR has hardly any gradient.
        let config = Config {
            feed_forward: true,
            output_activation: Activation::UnsignedSigmoid,
            hidden_activation: Activation::UnsignedSigmoid,
            activation_a: 4.9,
            ..preset
        };
        let score = |genome: &Genome, _| (4.0 - xor_error(genome)).powi(2);
        let is_solved = |neat: &Neat, _: &Generation| solves_xor(&neat.champion().unwrap().genome);
        let runs = evolve(&config, (2, 1), 0..3, 400, score, is_solved).unwrap();
        let solved = runs.iter().filter(|neat| solves_xor(&neat.champion().unwrap().genome)).count();
        assert!(solved > 0, "{name}");
    }
}

#[test]
fn all_options_run() {
    let removing = Config { mutate_rem_link_prob: 0.1, mutate_rem_neuron_prob: 0.1, ..Config::wahby2016() };
    let eager =
        Config { interspecies_crossover_rate: 0.5, mutate_add_neuron_prob: 0.3, ..Config::wahby2016() };
    let normalized = Config { normalize_genome_size: true, compat_threshold: 1.0, ..Config::wahby2016() };
    let feed_forward =
        Config { feed_forward: true, hidden_activation: Activation::Tanh, ..Config::wahby2016() };
    for config in [Config::ball_keeper(), removing, eager, normalized, feed_forward] {
        let mut neat = Neat::new(config, 2, 1, 1).unwrap();
        advance(&mut neat, 60);
        assert!(neat.ask().iter().all(|genome| genome.check().is_ok()));
        assert!(Neat::from_json(&neat.to_json()).is_ok());
    }
}

#[test]
fn the_smallest_population_survives() {
    let mut neat = Neat::new(Config { population: 2, ..Config::wahby2016() }, 2, 1, 1).unwrap();
    advance(&mut neat, 100);
    assert!((2..=4).contains(&neat.ask().len()));
}

#[test]
fn equal_negative_and_huge_scores_are_legal() {
    for score in [0.0, -1e150, 1e150, 5e-324] {
        let mut neat = Neat::new(Config::wahby2016(), 2, 1, 1).unwrap();
        for _ in 0..80 {
            let report = neat.tell(&vec![score; neat.ask().len()]).unwrap();
            assert!(report.population <= 75, "{report:?}");
            assert_eq!((report.best, report.median), (score, score));
        }
    }
}

#[test]
fn invalid_scores_are_refused_with_index_and_value_and_change_nothing() {
    let mut neat = Neat::new(Config::wahby2016(), 2, 1, 1).unwrap();
    let before = neat.to_json();
    let mut scores = vec![1.0; 50];
    for (score, wanted) in [
        (f64::NAN, "found score 7 = NaN"),
        (f64::INFINITY, "found score 7 = inf"),
        (-1e200, "found score 7 = -1000"),
    ] {
        scores[7] = score;
        let error = neat.tell(&scores).unwrap_err();
        assert!(error.to_string().starts_with(wanted), "{error}");
    }
    let error = neat.tell(&[1.0; 49]).unwrap_err().to_string();
    assert_eq!(error, "found 49 scores, wanted 50, one for each individual");
    assert_eq!(neat.to_json(), before);
}

#[test]
fn invalid_runs_are_refused() {
    let refusal = |config, inputs, outputs| Neat::new(config, inputs, outputs, 1).unwrap_err().to_string();
    assert_eq!(
        refusal(Config { population: 1, ..Config::wahby2016() }, 2, 1),
        "found population = 1, wanted 2 to 1000000"
    );
    assert!(
        refusal(Config::wahby2016(), 0, 1)
            .starts_with("found 0 inputs and 1 outputs, wanted at least 1 of each")
    );
    assert!(refusal(Config::wahby2016(), 1, 0).starts_with("found 1 inputs and 0 outputs"));
    assert!(
        refusal(Config::wahby2016(), usize::MAX, usize::MAX)
            .contains("wanted at least 1 of each and at most")
    );
    let error = Neat::new(Config { max_weight: f64::NAN, ..Config::wahby2016() }, 2, 1, 1).unwrap_err();
    assert!(matches!(error, NeatError::Config(_)));
}

#[test]
fn invalid_checkpoints_are_refused() {
    let mut neat = Neat::new(Config::wahby2016(), 2, 1, 1).unwrap();
    advance(&mut neat, 30);
    let json = neat.to_json();
    let refusal = |json: &str| Neat::from_json(json).unwrap_err().to_string();
    let with = |path: &str, value: serde_json::Value| {
        let mut tree: serde_json::Value = serde_json::from_str(&json).unwrap();
        *tree.pointer_mut(path).unwrap() = value;
        refusal(&tree.to_string())
    };
    assert!(refusal(&json[..json.len() - 100]).starts_with("not a saved run: EOF"));
    assert_eq!(
        with("/schema", "tropism.neat/0".into()),
        "found schema \"tropism.neat/0\", wanted \"tropism.neat/1\""
    );
    assert_eq!(with("/run/config/population", 1.into()), "found population = 1, wanted 2 to 1000000");
    let contradiction = |what: &str| format!("the saved run contradicts itself: {what}");
    let table = [
        (with("/run/config/population", 500.into()), "the population is too small"),
        (with("/run/config/population", 20.into()), "the population is too large"),
        (with("/run/ids/0", u64::MAX.into()), "an individual's id is above the last one assigned"),
        (
            with("/run/species/0/members/0", 1_000_000.into()),
            "not every individual is a member of exactly one species",
        ),
        (with("/run/innovations/links/0/from", 2.into()), "a link is recorded twice"),
        (
            with("/run/innovations/splits/0/neuron", 4.into()),
            "the split that made neuron 4 does not match its links",
        ),
        (
            with("/run/innovations/next_innovation", 3.into()),
            "recorded link 3 is above the last number assigned",
        ),
        (with("/run/threshold", (-1).into()), "the threshold is out of range"),
        (with("/run/outputs", 2.into()), "an individual's shape is not the run's"),
    ];
    for (found, wanted) in table {
        assert_eq!(found, contradiction(wanted));
    }
    let error = Neat::from_json("{\"schema\": \"tropism.neat/1\", \"run\": {}}").unwrap_err();
    assert!(matches!(error, CheckpointError::Json(_)));
}

#[test]
fn a_truncated_file_is_refused() {
    let mut neat = Neat::new(Config { population: 4, ..Config::wahby2016() }, 2, 1, 1).unwrap();
    advance(&mut neat, 10);
    let (run, genome) = (neat.to_json(), neat.champion().unwrap().genome.to_json());
    for end in (0..run.len()).step_by(13) {
        let error = Neat::from_json(&run[..end]).unwrap_err().to_string();
        assert!(error.starts_with("not a saved run: "), "{end}: {error}");
    }
    for end in 0..genome.trim_end().len() {
        let error = Genome::from_json(&genome[..end]).unwrap_err().to_string();
        assert!(error.starts_with("not a genome file: "), "{end}: {error}");
    }
}

#[test]
fn a_genome_with_a_cycle_at_equal_depth_is_legal_and_runs() {
    let neuron = |id, kind, depth| {
        format!(r#"{{"id":{id},"kind":"{kind}","depth":{depth},"activation":"linear","a":1.0,"b":0.0}}"#)
    };
    let link = |innovation, from, to, weight| {
        format!(
            r#"{{"innovation":{innovation},"from":{from},"to":{to},"weight":{weight},"recurrent":false}}"#
        )
    };
    let file = |neurons: &[String], links: &[String]| {
        let (neurons, links) = (neurons.join(","), links.join(","));
        format!(
            r#"{{"schema":"tropism.genome/1","inputs":1,"outputs":1,"neurons":[{neurons}],"links":[{links}]}}"#
        )
    };
    let neurons = [
        neuron(1, "input", 0.0),
        neuron(2, "bias", 0.0),
        neuron(3, "output", 1.0),
        neuron(4, "hidden", 0.5),
        neuron(5, "hidden", 0.5),
    ];
    let cycle =
        |weight| [link(1, 1, 4, 1.0), link(2, 4, 5, weight), link(3, 5, 4, weight), link(4, 5, 3, 1.0)];
    let genome = Genome::from_json(&file(&neurons, &cycle(2.0))).unwrap();
    let mut network = Network::new(&genome);
    let outputs: Vec<f64> = (0..7).map(|_| network.activate(&[1.0])[0]).collect();
    assert_eq!(outputs, [0.0, 0.0, 2.0, 2.0, 10.0, 10.0, 42.0]);
    // The activations overflow in the end. Such outputs are not finite, and `tell` refuses them as scores.
    let mut network = Network::new(&Genome::from_json(&file(&neurons, &cycle(1e6))).unwrap());
    for _ in 0..200 {
        network.activate_feed_forward(&[1.0]);
    }
    assert!(!network.output()[0].is_finite());
    // Ids must ascend, whatever the depths.
    let mut swapped = neurons.clone();
    swapped.swap(3, 4);
    let error = Genome::from_json(&file(&swapped, &cycle(1.0))).unwrap_err().to_string();
    assert!(error.starts_with("found neuron id 4 after 5, wanted"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_damaged_checkpoint_is_refused_or_continues(index: prop::sample::Index, digit in b'0'..=b'9') {
        let mut neat = Neat::new(Config { population: 6, ..Config::wahby2016() }, 2, 1, 1).unwrap();
        advance(&mut neat, 30);
        let mut json = neat.to_json().into_bytes();
        let digits: Vec<usize> = (0..json.len()).filter(|&index| json[index].is_ascii_digit()).collect();
        json[*index.get(&digits)] = digit;
        if let Ok(mut neat) = Neat::from_json(&String::from_utf8(json).unwrap()) {
            advance(&mut neat, 5);
            prop_assert!(neat.ask().iter().all(|genome| genome.check().is_ok()));
        }
    }
}
