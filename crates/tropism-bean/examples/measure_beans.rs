//! How well `tropism::measure` recovers the constants of virtual beans, another rod than its own, and how often the 90 % intervals of
//! single plants hold them.
//!
//! `cargo run --release -p tropism-bean --example measure_beans [plants, 16 by default] [variation, 1] [seed, 1]`
//!
//! Beans of 10 cm without phototropism are tipped by 60 degrees in the dark. Their gains wander, gravity is remembered, the zone
//! lengthens, they nutate and sag. Each plant is compared with its own constants.

use std::ops::ControlFlow;

use tropism::control::Periodic;
use tropism::math::statistics::{median, quantile_linear};
use tropism::measure::{Measurement, Options, Status, StemRecord, Stimulus, measure};
use tropism::parallel;
use tropism::random::{Purpose, derive};
use tropism::task::Task;
use tropism_bean::{Species, Trial};

const TILT_DEG: f64 = 60.0;
/// Steps of five minutes: 12 h.
const STEPS: u32 = 144;

fn main() {
    let arguments: Vec<f64> =
        std::env::args().skip(1).map(|word| word.parse().expect("wanted numbers")).collect();
    let number = |at: usize, usual: f64| arguments.get(at).copied().unwrap_or(usual);
    let (plants, scale, seed) = (number(0, 16.0) as u64, number(1, 1.0), number(2, 1.0) as u64);
    let mut species = Species::default();
    species.typical.tropism.light = 0.0;
    species.typical.tropism.gravity = 0.18;
    species.typical.tropism.balance = 3.0;
    species.typical.growth.start = 10.0;
    let trial = Trial { tilt_deg: TILT_DEG, is_dark: true, scale, ..Trial::new(&species) };
    let task = Task::open_loop(STEPS);
    let seeds: Vec<u64> = (0..plants).map(|plant| derive(seed, Purpose::Plant, plant)).collect();
    let dark = |_| Periodic::new(STEPS, &trial.layout);
    let tracks = trial.grow_all(&seeds, dark, &task, &mut |_, _| ControlFlow::Continue(()));
    let results: Vec<Measurement> = parallel::map(tracks.len(), |plant| {
        let record = StemRecord::of(&tracks[plant]).expect("virtual beans have stems");
        measure(&record, &Options { stimulus: Stimulus::Tilt(TILT_DEG), ..Options::default() })
    });
    let responding = results.iter().filter(|result| result.responds).count();
    let misfit = median(&results.iter().map(|result| result.misfit).collect::<Vec<_>>());
    println!(
        "{plants} virtual beans, spread {scale} of the species: {responding} respond, misfit {misfit:.2}"
    );
    println!(
        "{:<6} {:>12} {:>8} {:>22} {:>22}   factor of intervals that would hold 90 %",
        "symbol", "median bias", "rmse", "measured, hold", "others, hold"
    );
    for symbol in ["beta", "gamma", "Lc", "B", "Lgz"] {
        let (mut errors, mut counts, mut factors) = (Vec::new(), [[0; 2]; 2], Vec::new());
        for (seed, result) in seeds.iter().zip(&results) {
            let plant = species.draw(*seed, scale);
            let (beta, balance, zone) =
                (plant.tropism.gravity, plant.tropism.balance, plant.motility.zone_young);
            let truth = match symbol {
                "beta" => beta,
                "gamma" => beta * zone / balance,
                "Lc" => zone / balance,
                "B" => balance,
                _ => zone,
            };
            let found = result.estimate(symbol).expect("each constant has an estimate");
            if !found.status.has_value() {
                continue;
            }
            errors.push(found.value / truth - 1.0);
            let half = 0.5 * tropism::math::ln(found.factor());
            factors.push(tropism::math::ln(found.value / truth).abs() / half);
            let of = &mut counts[usize::from(found.status != Status::Measured)];
            of[0] += 1;
            of[1] += usize::from((found.interval[0]..=found.interval[1]).contains(&truth));
        }
        let rmse = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
        let share = |[count, holds]: [usize; 2]| format!("{count}, {holds}");
        println!(
            "{symbol:<6} {:>+10.0} % {:>6.0} % {:>22} {:>22}   {:.2}",
            100.0 * median(&errors),
            100.0 * rmse,
            share(counts[0]),
            share(counts[1]),
            quantile_linear(&factors, 0.9)
        );
    }
}
