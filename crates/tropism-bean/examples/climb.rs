//! Virtual climbing beans (`beans/climber.toml`) on supports of 0.8 cm:
//!
//! - `upright`: turns round an upright pole, in the dark;
//! - `settings`: the same with other distances of the rigid part from the apex, other sub-steps, and the thin stem that was
//!   measured on a pole bean (Ohad, Porat, Meroz 2026);
//! - `leaning`: turns round bars that lean, in the dark;
//! - `fork`: the arm that is taken where a pole forks into two arms at 45 degrees, in the dark and with a lamp at either arm.
//!
//! `cargo run --release -p tropism-bean --example climb [DAYS [PLANTS [SCENE [SUBSTEP_S]]]]`; two days, two plants, all
//! scenes and sub-steps of 30 s by default.

use std::env;

use tropism::lamps::{Lamp, Layout};
use tropism::math::sin_cos;
use tropism::math::statistics::{mean, wilson_interval};
use tropism::math::vector::{Vec3, along, dot, sub};
use tropism::obstacle::{Bar, Solid};
use tropism_bean::{Bean, Species, Stem};

/// Radius of all supports, in cm.
const RADIUS_CM: f64 = 0.4;
/// Sub-step by default, in s: twice that of a bean among solids.
const SUBSTEP_S: f64 = 30.0;
/// Height of the fork, length of its arms, and distance of a lamp beyond the end of its arm, in cm.
const FORK_CM: [f64; 3] = [25.0, 40.0, 3.0];
/// Angle of the arms to the vertical.
const ARM_DEG: f64 = 45.0;
/// Power of a lit lamp: that of a node of `tasks/wall.toml`.
const POWER: f64 = 0.05;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let days: f64 = arguments.first().map_or(Ok(2.0), |days| days.parse())?;
    let plants: u64 = arguments.get(1).map_or(Ok(2), |plants| plants.parse())?;
    let is_asked = |name: &str| arguments.get(2).is_none_or(|scene| scene == name);
    let substep_s: f64 = arguments.get(3).map_or(Ok(SUBSTEP_S), |seconds| seconds.parse())?;
    let species: Species = toml::from_str(include_str!("../../../beans/climber.toml"))?;
    let scene = Scene { species, days, plants, substep_s };
    println!("{plants} virtual plants, {days} days");
    if is_asked("upright") {
        scene.wind(0.0, true);
    }
    if is_asked("settings") {
        for (rigid_cm, substep_s) in [(18.0, 15.0), (18.0, 30.0), (18.0, 60.0), (20.0, 30.0), (25.0, 30.0)] {
            let mut scene = scene.clone();
            (scene.species.typical.stem.rigid_cm, scene.substep_s) = (Some(rigid_cm), substep_s);
            let turns = mean(scene.turns());
            println!("rigid_cm = {rigid_cm}, sub-step of {substep_s} s: {turns:.2} turns a plant");
        }
        let mut thin = scene.clone();
        let stem = &mut thin.species.typical.stem;
        *stem = Stem { modulus_mpa: 3.0, radius_apex: 0.04, radius_base: 0.055, tip_g: 0.02, ..stem.clone() };
        println!("stem of a pole bean: {:.2} turns a plant", mean(thin.turns()));
    }
    if is_asked("leaning") {
        [0.0, 10.0, 20.0, 30.0, 45.0, 60.0].into_iter().for_each(|lean_deg| scene.wind(lean_deg, false));
    }
    if is_asked("fork") {
        [None, Some(0), Some(1)].into_iter().for_each(|lit| scene.fork(lit));
    }
    Ok(())
}

/// Plants that grow for some days.
#[derive(Clone)]
struct Scene {
    species: Species,
    days: f64,
    plants: u64,
    substep_s: f64,
}

/// A bar from `from` on that leans to the right.
fn bar(from: Vec3, lean_deg: f64, length: f64) -> Bar {
    let (sin, cos) = sin_cos(lean_deg.to_radians());
    Bar { ends: [from, along(from, [sin, cos, 0.0], length)], radius_cm: RADIUS_CM }
}

/// Places of the stem from the root up, in cm.
fn stem(bean: &Bean) -> Vec<Vec3> {
    bean.pose().stem.iter().map(|node| node.at).collect()
}

/// A share of plants, in words.
fn share(of: usize, all: u64) -> String {
    let [low, high] = wilson_interval(of as f64, all as f64).map(|share| 100.0 * share);
    format!("{of} of {all} ({low:.0} to {high:.0} %)")
}

impl Scene {
    fn grow(&self, bean: &mut Bean, powers: &[f64]) {
        (0..(self.days * 288.0) as u32).for_each(|_| bean.advance(powers, 5.0));
    }

    fn seedling(&self, seed: u64, solids: &[Solid]) -> Bean {
        Bean::new(self.species.draw(seed, 1.0), seed).among(solids).with_substep(self.substep_s)
    }

    /// A seedling, and a bar that passes 1.5 cm before it at a height of 8 cm.
    fn beside_a_bar(&self, seed: u64, lean_deg: f64) -> (Bar, Bean) {
        let (sin, cos) = sin_cos(lean_deg.to_radians());
        let bar = bar([-8.0 * sin / cos, 0.0, 1.5], lean_deg, 1000.0);
        (bar, self.seedling(seed, &[bar.into()]))
    }

    /// Turns of each plant round an upright bar.
    fn turns(&self) -> impl Iterator<Item = f64> {
        (1..=self.plants).map(|seed| {
            let (bar, mut bean) = self.beside_a_bar(seed, 0.0);
            self.grow(&mut bean, &[]);
            bar.turns_of(&stem(&bean))
        })
    }

    /// Grows plants beside a bar that leans; prints each plant, or all in a line.
    fn wind(&self, lean_deg: f64, is_each_printed: bool) {
        let (mut turns, mut wound, mut within) = (Vec::new(), 0, 0);
        for seed in 1..=self.plants {
            let (bar, mut bean) = self.beside_a_bar(seed, lean_deg);
            self.grow(&mut bean, &[]);
            let stem = stem(&bean);
            let way = sub(bar.ends[1], bar.ends[0]).map(|axis| axis / 1000.0);
            let up = |place: Vec3| dot(sub(place, bar.ends[0]), way);
            let first = (2..=stem.len()).find(|&count| bar.turns_of(&stem[..count]).abs() >= 1.0);
            let first = first.map(|count| up(stem[count - 1]));
            let all = bar.turns_of(&stem);
            if is_each_printed {
                let first = first.map_or("none".to_owned(), |first| format!("{first:.1} cm"));
                let (length, up) = (bean.length(), up(bean.apex()));
                println!(
                    "plant {seed}: {length:.1} cm of stem, {up:.1} cm up, {all:.2} turns, the first by {first}"
                );
            }
            turns.push(all);
            wound += usize::from(all >= 3.0);
            within += usize::from(first.is_some_and(|first| first <= 20.0));
        }
        println!(
            "{lean_deg} degrees, dark: {:.2} turns a plant; one within 20 cm: {}; three: {}",
            mean(turns.iter().copied()),
            share(within, self.plants),
            share(wound, self.plants)
        );
    }

    /// Grows plants on a pole that forks, and counts the arms that they wind round.
    fn fork(&self, lit: Option<usize>) {
        let [height, length, beyond] = FORK_CM;
        let (root, knot) = ([0.0, 0.0, 1.5], [0.0, height, 1.5]);
        let arms = [-ARM_DEG, ARM_DEG].map(|lean_deg| bar(knot, lean_deg, length));
        let solids = [bar(root, 0.0, height), arms[0], arms[1]].map(Solid::from);
        let end = |lean_deg| bar(knot, lean_deg, length + beyond).ends[1];
        let lamps = vec![Lamp::new("left", end(-ARM_DEG)), Lamp::new("right", end(ARM_DEG))];
        let layout = Layout::new(lamps).expect("two lamps");
        let mut powers = [0.0; 2];
        if let Some(lamp) = lit {
            powers[lamp] = POWER;
        }
        let mut taken = [0; 2];
        for seed in 1..=self.plants {
            let mut bean = self.seedling(seed, &solids).under(&layout);
            self.grow(&mut bean, &powers);
            let mut above = stem(&bean);
            above.retain(|place| place[1] > height);
            for (taken, arm) in taken.iter_mut().zip(arms) {
                *taken += usize::from(arm.turns_of(&above).abs() >= 1.0);
            }
        }
        let lit = lit.map_or("dark", |lamp| ["left lamp", "right lamp"][lamp]);
        let [left, right] = taken.map(|taken| share(taken, self.plants));
        println!("fork, {lit}: wound round the left arm {left}, the right arm {right}");
    }
}
