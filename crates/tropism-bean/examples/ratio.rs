//! Does dimming beat switching? The paper's task on virtual beans, steered by three rules that look at the tip alone:
//!
//! - `switch` lights the lamp on the side of the next target at full power, as [`Greedy`] does;
//! - `level` dims that lamp: its level grows with the distance to the side;
//! - `ratio` shares the light of one lamp between both: evenly at the target's side, all of it far from there.
//!
//! The gain of the last two is chosen on one half of the plants; both halves are printed. Intervals are 95 %, of means of
//! differences plant by plant. All plants are virtual.
//!
//! `cargo run -p tropism-bean --example ratio [PLANTS OF EACH HALF]`

use std::ops::ControlFlow;

use tropism::lighting::FULL;
use tropism::prelude::*;
use tropism_bean::{Species, Trial};

/// Gains that are tried, per cm. At 1 `ratio` gives all light to one side from half a centimetre on, and `level` full
/// power from one centimetre on.
const GAINS: [f64; 7] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2];

/// Distance of a target whose height was never reached, in cm.
const NEVER_CM: f64 = 10.0;

#[derive(Clone, Copy, PartialEq)]
enum Rule {
    Switch,
    Level(f64),
    Ratio(f64),
}

struct Steering<'t> {
    rule: Rule,
    task: &'t Task,
}

impl Controller for Steering<'_> {
    fn decide(&mut self, seen: &Observation) -> Light {
        self.lighting(seen).brightest().unwrap_or(Light::LEFT)
    }

    fn lighting(&mut self, seen: &Observation) -> Lighting {
        let targets = &self.task.targets;
        let next = targets.iter().find(|target| seen.tip.y < target.y).or(targets.last());
        let aside = next.map_or(0.0, |target| target.x - seen.tip.x);
        let side = if aside > 0.0 { Light::RIGHT } else { Light::LEFT };
        let level = |share: f64| (share.clamp(0.0, 1.0) * f64::from(FULL)).round() as u8;
        match self.rule {
            Rule::Switch => Lighting::only(side),
            Rule::Level(gain) => Lighting::DARK.with(side, level(gain * aside.abs()).max(1)),
            Rule::Ratio(gain) => {
                let right = level(0.5 + gain * aside);
                Lighting::DARK.with(Light::LEFT, FULL - right).with(Light::RIGHT, right)
            }
        }
    }
}

/// Of one plant: fitness by eq. (9), and the sum of the distances to the targets when their heights are crossed, in cm.
fn measure(task: &Task, track: &Track) -> [f64; 2] {
    let distance = |target: &Point| {
        let crossing = track.samples.iter().find(|sample| sample.tip.y >= target.y);
        crossing.map_or(NEVER_CM, |sample| (sample.tip.x - target.x).abs())
    };
    [task.fitness(track), task.targets.iter().map(distance).sum()]
}

/// Mean and half of its 95 % interval.
fn mean(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, 1.96 * (variance / count).sqrt())
}

fn main() {
    let plants: u64 = std::env::args().nth(1).map_or(120, |count| count.parse().expect("a number of plants"));
    let (species, task) = (Species::default(), Task::default());
    let trial = Trial::new(&species);
    let grow = |rule, seeds: std::ops::Range<u64>| -> Vec<[f64; 2]> {
        let seeds: Vec<u64> = seeds.collect();
        let steering = |_| Steering { rule, task: &task };
        let tracks = trial.grow_all(&seeds, steering, &task, &mut |_, _| ControlFlow::Continue(()));
        tracks.iter().map(|track| measure(&task, track)).collect()
    };
    let halves = [5_400_000..5_400_000 + plants, 5_500_000..5_500_000 + plants];
    let fitness = |runs: &[[f64; 2]]| mean(runs.iter().map(|run| run[0])).0;
    let mut best = Vec::new();
    println!("gain (per cm)    fitness of level    of ratio    {plants} virtual beans of the first half");
    for gain in GAINS {
        let rules = [Rule::Level(gain), Rule::Ratio(gain)];
        let found = rules.map(|rule| fitness(&grow(rule, halves[0].clone())));
        println!("{gain:<13}    {:<16.2}    {:.2}", found[0], found[1]);
        best.push((found, gain));
    }
    let choose = |kind: usize| {
        best.iter().max_by(|(a, _), (b, _)| a[kind].total_cmp(&b[kind])).map_or(GAINS[0], |(_, gain)| *gain)
    };
    let rules =
        [("switch", Rule::Switch), ("level", Rule::Level(choose(0))), ("ratio", Rule::Ratio(choose(1)))];
    for (name, seeds) in ["chosen on", "unseen"].into_iter().zip(halves) {
        println!("\n{plants} virtual beans, {name}");
        println!("rule      gain    fitness    over switch             sum of distances, cm    over switch");
        let switched = grow(Rule::Switch, seeds.clone());
        for (word, rule) in rules {
            let runs = grow(rule, seeds.clone());
            let over = |of: usize| {
                let (mean, half) = mean(runs.iter().zip(&switched).map(|(run, switch)| run[of] - switch[of]));
                if rule == Rule::Switch {
                    String::new()
                } else {
                    format!("{mean:+.2} ({:+.2} to {:+.2})", mean - half, mean + half)
                }
            };
            let gain = match rule {
                Rule::Switch => String::new(),
                Rule::Level(gain) | Rule::Ratio(gain) => gain.to_string(),
            };
            let distance = mean(runs.iter().map(|run| run[1])).0;
            println!("{word:<10}{gain:<8}{:<11.2}{:<24}{distance:<24.2}{}", fitness(&runs), over(0), over(1));
        }
    }
}
