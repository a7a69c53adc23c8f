//! How far virtual beans of a species get to the side.

use core::ops::ControlFlow;
use std::collections::BTreeMap;
use std::sync::OnceLock;

use tropism::control::Controller;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::math::atan2;
use tropism::observation::Observation;
use tropism::task::{OpenLoop, Reach};
use tropism::track::Sample;

use super::{Species, Trial};

/// Plants that lean to the side after each delay. Chosen by hand.
const BEANS: u64 = 4;

/// Steps of an experiment: two days.
const STEPS: u32 = 600;

/// Steps between two delays, three hours, and steps that a plant has to lean at least.
const DELAY: u32 = 36;
const LEANING: u32 = 60;

/// Height from which on a plant has a form to speak of, in cm: twice that of a seedling.
const GROWN_CM: f64 = 8.0;

/// The highest tip whose stem is looked at, in cm: higher ones hang.
const HIGHEST_CM: f64 = 17.0;

/// A controller that keeps the plant upright and then leans it to the right for good.
struct Lean {
    upright: u32,
    step: u32,
}

impl Controller for Lean {
    fn decide(&mut self, seen: &Observation) -> Light {
        self.step += 1;
        if self.step > self.upright || seen.tip.x < 0.0 { Light::RIGHT } else { Light::LEFT }
    }
}

/// Farthest distances by height, in half centimetres.
#[derive(Default)]
struct Farthest(BTreeMap<i32, f64>);

impl Farthest {
    fn add(&mut self, point: &Point) {
        let at = self.0.entry((2.0 * point.y).floor() as i32).or_insert(0.0);
        *at = at.max(point.x);
    }

    /// What a low plant reaches, a high one reaches too: between the delays that were tried there are others.
    fn rows(self) -> Vec<[f64; 2]> {
        let mut so_far = 0.0_f64;
        let row = |(half, x): (i32, f64)| {
            so_far = so_far.max(x);
            [f64::from(half) / 2.0, (10.0 * so_far).round() / 10.0]
        };
        self.0.into_iter().map(row).collect()
    }
}

impl Species {
    /// [`Self::reach`] of the common bean, which is computed once.
    #[must_use]
    pub fn common_reach() -> &'static Reach {
        static COMMON: OnceLock<Reach> = OnceLock::new();
        COMMON.get_or_init(|| Self::default().reach())
    }

    /// What four virtual beans of this species reach between the paper's lamps: each leans to the side early or late, 15 times.
    /// Distances are rounded to mm.
    #[must_use]
    pub fn reach(&self) -> Reach {
        let delays: Vec<u32> = (0..STEPS - LEANING).step_by(DELAY as usize).collect();
        let plants: Vec<(u64, u32)> =
            delays.iter().flat_map(|&delay| (1..=BEANS).map(move |seed| (seed, delay))).collect();
        let seeds: Vec<u64> = plants.iter().map(|(seed, _)| *seed).collect();
        let task = OpenLoop { steps: STEPS, ..OpenLoop::default() };
        let (mut tips, mut stems) = (Farthest::default(), Farthest::default());
        let mut highest = vec![f64::NEG_INFINITY; seeds.len()];
        let mut lean_deg = 0.0_f64;
        let mut watch = |place: usize, sample: &Sample| {
            if sample.tip.y <= highest[place] {
                return ControlFlow::Continue(());
            }
            highest[place] = sample.tip.y;
            tips.add(&sample.tip);
            if let Some(stem) = sample.stem.as_ref().filter(|_| sample.tip.y <= HIGHEST_CM) {
                stem.0.iter().filter(|point| point.y >= 0.0).for_each(|point| stems.add(point));
                if sample.tip.y >= GROWN_CM {
                    lean_deg = lean_deg.max(lean_of(&stem.0));
                }
            }
            ControlFlow::Continue(())
        };
        let lean = |place: usize| Lean { upright: plants[place].1, step: 0 };
        Trial::new(self).grow_all(&seeds, lean, &task, &mut watch);
        Reach { tips: tips.rows(), stems: stems.rows(), lean_deg: lean_deg.round() }
    }
}

/// The angle of the upper third of a stem to the vertical, in degrees; 0 of no stem.
fn lean_of(stem: &[Point]) -> f64 {
    let Some((tip, rest)) = stem.split_last() else { return 0.0 };
    let from = rest[2 * rest.len() / 3..].first().copied().unwrap_or_default();
    atan2((tip.x - from.x).abs(), tip.y - from.y).to_degrees()
}
