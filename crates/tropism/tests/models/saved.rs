//! Saved runs of evolution.

use tropism::control::{Sensor, Sensors};
use tropism::evolve::{Evolution, EvolutionConfig, EvolutionRun, Method, Search, Start, trial_of_genome};
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::task::Task;
use tropism::track::Track;
use tropism_neat::{Config, Genome};

/// A model of one plant that leans after a lamp, and a task so short that a generation takes a moment.
fn world() -> (TipModel, Task) {
    let rows: String = (0..60)
        .map(|step: i32| {
            let is_left = step / 20 % 2 == 0;
            let x = 0.2 * f64::from(20 - (step % 40 - 20).abs());
            format!("{x},{},{}\n", 4.0 + 0.05 * f64::from(step), if is_left { "right" } else { "left" })
        })
        .collect();
    let track = Track::read_csv(format!("tip_x_cm,tip_y_cm,light\n{rows}").as_bytes()).unwrap();
    let model = TipModel::fit([&track], TipModelConfig::default()).unwrap();
    (model, Task { max_steps: 60, ..Task::default() })
}

fn short() -> EvolutionConfig {
    EvolutionConfig { generations: 8, ..EvolutionConfig::default() }
}

fn begun(generations: u32) -> EvolutionRun {
    let (model, task) = world();
    let evolution = Evolution::new(&model, &task, short(), 7).unwrap();
    let mut run = evolution.begin(2).unwrap();
    for _ in 0..generations {
        evolution.advance(&mut run);
    }
    run
}

#[test]
fn a_saved_run_resumes_to_the_same_bits() {
    let (model, task) = world();
    let evolution = Evolution::new(&model, &task, short(), 7).unwrap();
    let mut saved = evolution.resume(2, &begun(3).to_json()).unwrap();
    let flow = evolution.finish(&mut saved, &mut |_| std::ops::ControlFlow::Continue(()));
    assert!(flow.is_continue());
    assert_eq!(saved.to_json(), begun(8).to_json());
}

#[test]
fn an_evolution_from_greedy_resumes_and_never_ends_below_it() {
    let (model, task) = world();
    let sensors = Sensors::new(vec![Sensor::Tip, Sensor::ToTarget { ahead: 0 }]).unwrap();
    let config = EvolutionConfig { sensors, start: Start::Greedy, ..short() };
    let evolution = Evolution::new(&model, &task, config, 7).unwrap();
    let mut run = evolution.begin(0).unwrap();
    let (greedy, judges) = (run.search.ask()[0].clone(), std::slice::from_ref(&model));
    evolution.advance(&mut run);
    let mut saved = evolution.resume(0, &run.to_json()).unwrap();
    for run in [&mut run, &mut saved] {
        assert!(evolution.finish(run, &mut |_| std::ops::ControlFlow::Continue(())).is_continue());
    }
    assert_eq!(saved.to_json(), run.to_json());
    let candidates = evolution.candidates(&run);
    assert_eq!((candidates[1], evolution.start()), (&greedy, Some(&greedy)));
    let trial = |genome| trial_of_genome(judges, &task, evolution.config().interface(), genome, 7, 20).mean;
    let (champion, found) = evolution.champion_of(&run, judges, 20);
    assert_eq!(found.mean, trial(champion));
    assert_eq!(found.mean, f64::max(trial(candidates[0]), trial(candidates[1])));
    assert_eq!(evolution.choose(&[run.clone()], judges, 20).trials, [found]);
}

#[test]
fn a_search_of_weights_resumes_and_keeps_its_topology() {
    let (model, task) = world();
    let sensors = Sensors::new(vec![Sensor::Tip, Sensor::ToTarget { ahead: 0 }]).unwrap();
    let neat = Config { population: 8, ..Config::wahby2016() };
    let config = EvolutionConfig { sensors, method: Method::CmaEs, start: Start::Greedy, neat, ..short() };
    let evolution = Evolution::new(&model, &task, config.clone(), 7).unwrap();
    let mut run = evolution.begin(0).unwrap();
    evolution.advance(&mut run);
    let mut saved = evolution.resume(0, &run.to_json()).unwrap();
    for run in [&mut run, &mut saved] {
        assert!(evolution.finish(run, &mut |_| std::ops::ControlFlow::Continue(())).is_continue());
    }
    assert_eq!(saved.to_json(), run.to_json());
    assert_eq!((run.search.evaluations(), run.history.len()), (64, 8));
    let candidates = evolution.candidates(&run);
    assert!(candidates.iter().all(|genome| genome.links().len() == 5), "{candidates:?}");
    let greedy = &evolution.begin(1).unwrap().search;
    assert!(matches!(greedy, Search::Weights(search) if search.centres() == [candidates[2].clone()]));
    let json = run.to_json();
    let refusal = |config| EvolutionRun::from_json(&json, &config, 7, 0).unwrap_err().to_string();
    assert!(refusal(EvolutionConfig { method: Method::Neat, ..config }).contains("the evolution's settings"));
}

#[test]
fn an_evolution_starts_from_the_champion_of_another() {
    let (model, task) = world();
    let champion = begun(8).champion().unwrap().0.clone();
    let neat = Config { population: 8, ..Config::wahby2016() };
    let start = Start::Network(champion.clone().into());
    let config = EvolutionConfig { method: Method::CmaEs, start, neat, ..short() };
    let json = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<EvolutionConfig>(&json).unwrap(), config);
    let evolution = Evolution::new(&model, &task, config.clone(), 8).unwrap();
    let mut run = evolution.begin(0).unwrap();
    evolution.advance(&mut run);
    let candidates = evolution.candidates(&run);
    assert_eq!(candidates.last(), Some(&&champion));
    let links = |genome: &Genome| genome.links().iter().map(|link| (link.from, link.to)).collect::<Vec<_>>();
    assert!(candidates.iter().all(|genome| links(genome) == links(&champion)), "{candidates:?}");
    let refusal = |config| Evolution::new(&model, &task, config, 8).unwrap_err().to_string();
    let seeing = Sensors::new(vec![Sensor::Tip, Sensor::LastShift]).unwrap();
    assert_eq!(
        refusal(EvolutionConfig { sensors: seeing, ..config }),
        "start = { network }: found 2, wanted 4 inputs, as the sensors give"
    );
}

#[test]
fn every_cut_and_every_changed_digit_is_refused() {
    let json = begun(2).to_json();
    let refusal = |json: &str| EvolutionRun::from_json(json, &short(), 7, 2).unwrap_err().to_string();
    for tenth in 0..10 {
        assert!(refusal(&json[..json.len() * tenth / 10]).starts_with("not a saved run: "), "{tenth}");
    }
    let changed = |from: &str, to: &str| {
        assert!(json.contains(from), "{from}");
        refusal(&json.replacen(from, to, 1))
    };
    assert!(changed("\"best_ever\":", "\"best_ever\":1").contains("changed or damaged"));
    assert!(changed("evolution-run/1", "evolution-run/2").contains("wanted \"tropism.evolution-run/1\""));
    assert!(changed("\"history\"", "\"story\"").contains("unknown field `story`"));
    assert!(changed("\"weight\":", "\"weight\":1e308,\"wait\":").starts_with("not a saved run"));
}

#[test]
fn the_run_of_another_evolution_is_refused() {
    let json = begun(1).to_json();
    let refusal = |config: &EvolutionConfig, seed, index| {
        EvolutionRun::from_json(&json, config, seed, index).unwrap_err().to_string()
    };
    assert!(refusal(&short(), 7, 3).contains("found a run with seed"));
    assert!(refusal(&short(), 8, 2).contains("found a run with seed"));
    let mut other = short();
    other.neat.survival_rate = 0.5;
    assert!(refusal(&other, 7, 2).contains("the evolution's settings"));
}

#[test]
fn history_and_population_must_agree() {
    let mut run = begun(2);
    run.history.pop();
    let error = EvolutionRun::from_json(&run.to_json(), &short(), 7, 2).unwrap_err().to_string();
    assert_eq!(error, "found 1 generations in its history, wanted 2");
}
