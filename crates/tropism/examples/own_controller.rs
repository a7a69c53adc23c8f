//! A controller of one's own: implement [`Controller`], and it steers simulated, virtual and real plants alike.
//!
//! `cargo run --release -p tropism --example own_controller`
//!
//! The controller here predicts: it lights the lamp on the side of the next target as seen from where the tip will be an
//! hour from now if it keeps its speed. Judged on virtual beans beside the greedy rule.

use tropism::prelude::*;
use tropism_bean::{Species, grow};

/// Greedy from where the tip will be `ahead` steps from now.
struct Predicting {
    targets: Vec<Point>,
    ahead: f64,
    last: Option<Point>,
    /// Running mean of the tip's shift, in cm a step.
    speed: f64,
}

impl Controller for Predicting {
    fn decide(&mut self, seen: &Observation) -> Light {
        let shift = self.last.map_or(0.0, |last| seen.tip.x - last.x);
        self.speed += 0.25 * (shift - self.speed);
        self.last = Some(seen.tip);
        let next = self.targets.iter().find(|target| seen.tip.y < target.y).or(self.targets.last());
        let predicted = seen.tip.x + self.ahead * self.speed;
        if next.is_some_and(|target| predicted < target.x) { Light::RIGHT } else { Light::LEFT }
    }
}

fn main() {
    let (task, layout, species) = (Task::default(), Layout::default(), Species::default());
    let mut fitness = [0.0, 0.0];
    const PLANTS: u64 = 12;
    for seed in 1..=PLANTS {
        let mut predicting =
            Predicting { targets: task.targets.clone(), ahead: 12.0, last: None, speed: 0.0 };
        let mut greedy = Greedy::new(&task, &layout);
        let controllers: [&mut dyn Controller; 2] = [&mut predicting, &mut greedy];
        for (controller, sum) in controllers.into_iter().zip(&mut fitness) {
            let track = grow(&species, seed, 1.0, controller, &task, &mut unwatched);
            *sum += task.fitness(&track) / PLANTS as f64;
        }
    }
    println!(
        "mean fitness on {PLANTS} virtual beans: predicting {:.2} cm, greedy {:.2} cm",
        fitness[0], fitness[1]
    );
}
