//! How well `tropism::measure` recovers the constants of simulated plants, and how often its 90 % intervals hold them.
//!
//! `cargo run --release -p tropism --example measure_accuracy [plants a case, 100 by default] [case ...]`
//!
//! The plants are rods of other code than that of the fit: pieces of tissue that carry their curvature (Lagrangian), 100 of them,
//! in steps of half a minute. Each circumnutates by 5 degrees (100 minutes, 13 % between plants, a phase that wanders) and drifts at
//! random.

#![allow(clippy::disallowed_methods, reason = "other code than that of the fit")]

use tropism::geometry::{Point, STEM_POINTS};
use tropism::measure::group;
use tropism::measure::{Law, Measurement, Options, Status, StemRecord, Stimulus, measure};
use tropism::parallel;
use tropism::random::{self, Purpose};

/// A simulated experiment.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    law: Law,
    tilt_deg: f64,
    start_tip_deg: f64,
    hours: f64,
    frames: usize,
    beta: f64,
    gamma: f64,
    zone: f64,
    edge: f64,
    is_bell: bool,
    growth: f64,
    noise: f64,
    /// Circumnutation and drift, as a multiple of the usual.
    forcing: f64,
    delay_h: f64,
    /// Spread of beta, gamma and zone between plants.
    spread: f64,
    /// Response to lamps at the sides, and its memory in h.
    nu: f64,
    tau: f64,
    /// When the lamps change sides, in h.
    changes: &'static [f64],
}

const USUAL: Case = Case {
    name: "nutation + drift, 145 frames",
    law: Law::Ac,
    tilt_deg: 69.0,
    start_tip_deg: 69.0,
    hours: 12.0,
    frames: 145,
    beta: 0.3,
    gamma: 0.5,
    zone: 5.0,
    edge: 0.3,
    is_bell: false,
    growth: 0.1,
    noise: 0.02,
    forcing: 1.0,
    delay_h: 0.0,
    spread: 0.0,
    nu: 0.0,
    tau: 0.5,
    changes: &[],
};

/// An upright plant whose lamps change sides at irregular times.
const LIT: Case = Case {
    name: "lamps, 6 changes",
    tilt_deg: 0.0,
    start_tip_deg: 0.0,
    nu: 0.4,
    changes: &[1.0, 2.5, 5.5, 7.0, 8.0, 10.5],
    ..USUAL
};

const CASES: [Case; 24] = [
    Case { name: "no forcing, 0.005 cm", forcing: 0.0, noise: 0.005, ..USUAL },
    USUAL,
    Case { name: "25 frames", frames: 25, ..USUAL },
    Case { name: "edge 2 cm", edge: 2.0, ..USUAL },
    Case { name: "bell-shaped zone", is_bell: true, ..USUAL },
    Case { name: "bell-shaped zone, tilt 20", is_bell: true, tilt_deg: 20.0, start_tip_deg: 20.0, ..USUAL },
    Case { name: "bell-shaped zone, 25 frames", is_bell: true, frames: 25, ..USUAL },
    Case { name: "3 h", hours: 3.0, frames: 37, ..USUAL },
    Case { name: "24 h", hours: 24.0, frames: 289, ..USUAL },
    Case { name: "B = 1", beta: 0.1, ..USUAL },
    Case { name: "B = 8", beta: 0.8, ..USUAL },
    Case { name: "tilt 20", tilt_deg: 20.0, start_tip_deg: 20.0, ..USUAL },
    Case { name: "upright, bent start", tilt_deg: 0.0, start_tip_deg: 50.0, ..USUAL },
    Case { name: "15 min delay", delay_h: 0.25, ..USUAL },
    Case { name: "G 0.4 cm/h", growth: 0.4, ..USUAL },
    Case { name: "ACE, G 0.4 cm/h", law: Law::Ace, growth: 0.4, ..USUAL },
    Case { name: "quiet (a fifth of the forcing)", forcing: 0.2, ..USUAL },
    Case { name: "15 % between plants", spread: 0.15, ..USUAL },
    LIT,
    Case { name: "lamps, memory of 10 min", tau: 1.0 / 6.0, ..LIT },
    Case { name: "lamps, half the response", nu: 0.2, ..LIT },
    Case {
        name: "lamps, 24 h",
        hours: 24.0,
        frames: 289,
        changes: &[1.0, 2.5, 5.5, 7.0, 8.0, 10.5, 13.0, 17.0, 19.0, 22.0],
        ..LIT
    },
    Case { name: "lamps, 4 changes in 6 h", hours: 6.0, frames: 73, changes: &[0.75, 2.0, 3.0, 4.75], ..LIT },
    Case { name: "no response", beta: 0.0, gamma: 0.05, ..USUAL },
];

/// A piece of tissue.
#[derive(Clone, Copy)]
struct Piece {
    length: f64,
    curvature: f64,
}

impl Case {
    /// Beta, gamma and the zone of a plant.
    fn constants(&self, seed: u64) -> [f64; 3] {
        let mut draws = random::stream(seed, Purpose::Individual, 0);
        [self.beta, self.gamma, self.zone]
            .map(|value| value * (self.spread * random::normal(&mut draws)).exp())
    }

    /// The constants by the definitions of `tropism::measure`: the zone ends where sensitivity has fallen to half of its greatest
    /// value, and the rates are means over it.
    fn truth(&self, seed: u64) -> Vec<(&'static str, f64)> {
        let [beta, gamma, zone] = self.constants(seed);
        let reach = if self.is_bell { 0.5 + 0.125_f64.sqrt() } else { 1.0 };
        let [beta, gamma, zone] = [beta / reach, gamma / reach, zone * reach];
        let (lc, balance) = (gamma / beta, beta * zone / gamma);
        let mut truth = vec![("beta", beta), ("gamma", gamma), ("Lc", lc), ("B", balance), ("Lgz", zone)];
        if self.nu != 0.0 {
            truth.extend([("nu", self.nu / reach), ("tau", self.tau)]);
        }
        truth
    }

    fn zone_at(&self, zone: f64, from_apex: f64) -> f64 {
        if self.is_bell {
            // A parabola with the area of a sharp zone: the integral of z is Lgz.
            let share = (from_apex / zone).clamp(0.0, 1.0);
            6.0 * share * (1.0 - share)
        } else {
            1.0 / (1.0 + ((from_apex - zone) / self.edge).exp())
        }
    }

    fn record(&self, seed: u64) -> StemRecord {
        const STEP_H: f64 = 0.5 / 60.0;
        const START_CM: f64 = 8.0;
        const PIECES: usize = 100;
        let [beta, gamma, zone] = self.constants(seed);
        let mut draws = random::stream(seed, Purpose::SegmentNoise, 0);
        let mut of_camera = random::stream(seed, Purpose::Camera, 0);
        let mut noise = || random::normal(&mut of_camera);
        let base = self.tilt_deg.to_radians();
        let start = (self.start_tip_deg.to_radians() - base) / START_CM;
        let mut pieces = vec![Piece { length: START_CM / PIECES as f64, curvature: start }; PIECES];
        let period = 100.0 / 60.0 * (0.13 * random::normal(&mut draws)).exp();
        let turning = std::f64::consts::TAU / period;
        let relaxing = gamma + 0.5 * beta * zone;
        let swing = self.forcing * 5_f64.to_radians() * turning.hypot(relaxing) / zone;
        let mut phase = std::f64::consts::TAU * random::uniform(&mut draws);
        let sd = 0.03 * self.forcing;
        let mut drift = sd * random::normal(&mut draws);
        let keep = (-STEP_H / 1.0_f64).exp();
        let every = self.hours / (self.frames - 1) as f64;
        let (mut frames, mut time, mut light) = (Vec::new(), 0.0, 0.0);
        let lamp = |time: f64| match self.changes.iter().filter(|change| **change <= time + 1e-9).count() {
            _ if self.nu == 0.0 => 0.0,
            changes if changes % 2 == 0 => 1.0,
            _ => -1.0,
        };
        let mut past = Vec::new();
        loop {
            while frames.len() < self.frames && every * frames.len() as f64 <= time + 1e-9 {
                let at = every * frames.len() as f64;
                frames.push((at, self.seen(&pieces, base, &mut noise), lamp(at)));
            }
            if frames.len() == self.frames {
                return StemRecord::of_frames(frames, self.frames).expect("all frames have stems");
            }
            let force = swing * phase.cos() + drift;
            let length: f64 = pieces.iter().map(|piece| piece.length).sum();
            light += (lamp(time) - light) * (1.0 - (-STEP_H / self.tau).exp());
            let (mut angle, mut along) = (base, 0.0);
            let (mut sines, mut cosines) = (Vec::new(), Vec::new());
            for piece in &pieces {
                let middle = angle + 0.5 * piece.curvature * piece.length;
                sines.push(middle.sin());
                cosines.push(middle.cos());
                angle += piece.curvature * piece.length;
            }
            past.push(sines.clone());
            let delayed = &past[past.len() - 1 - ((self.delay_h / STEP_H) as usize).min(past.len() - 1)];
            let total: f64 = pieces
                .iter()
                .map(|piece| {
                    along += piece.length;
                    piece.length * self.zone_at(zone, length - along + 0.5 * piece.length)
                })
                .sum();
            along = 0.0;
            let last = pieces.len() - 1;
            for (number, piece) in pieces.iter_mut().enumerate() {
                along += piece.length;
                let share = self.zone_at(zone, length - along + 0.5 * piece.length);
                let sin = delayed[number.min(delayed.len() - 1)];
                let turning = force - beta * sin + self.nu * light * cosines[number];
                piece.curvature += STEP_H * share * (turning - gamma * piece.curvature);
                match self.law {
                    Law::Ace => piece.length *= 1.0 + STEP_H * self.growth * share / total,
                    Law::Ac if number == last => piece.length += STEP_H * self.growth,
                    Law::Ac => {}
                }
            }
            if pieces[last].length > 0.15 {
                pieces[last].length *= 0.5;
                pieces.push(pieces[last]);
            }
            let wander = 0.1 * (STEP_H * 12.0_f64).sqrt();
            phase += turning * STEP_H + wander * random::normal(&mut draws);
            drift = keep * drift + sd * (1.0 - keep * keep).sqrt() * random::normal(&mut draws);
            time += STEP_H;
        }
    }

    /// Ten points with noise.
    fn seen(&self, pieces: &[Piece], base: f64, noise: &mut impl FnMut() -> f64) -> [Point; STEM_POINTS] {
        let (mut angle, mut at) = (base, Point::new(0.0, 0.0));
        let mut path = vec![at];
        for piece in pieces {
            let middle = angle + 0.5 * piece.curvature * piece.length;
            angle += piece.curvature * piece.length;
            at = Point::new(at.x + piece.length * middle.sin(), at.y + piece.length * middle.cos());
            path.push(at);
        }
        let points = tropism::geometry::path::resampled(&path, STEM_POINTS);
        std::array::from_fn(|k| {
            let sd = if k == 0 { 0.0 } else { self.noise };
            Point::new(points[k].x + sd * noise(), points[k].y + sd * noise())
        })
    }
}

/// Groups that are drawn of one pool of plants, so that they share its error.
const GROUPS: usize = 400;

/// How often the 90 % intervals of groups hold the constants of the species, and half their width.
fn groups(case: &Case, results: &[Measurement]) {
    let truth = Case { spread: 0.0, ..*case }.truth(0);
    for size in [3, 6, 12].into_iter().filter(|size| *size <= results.len()) {
        let mut line = format!("  groups of {size:<20}");
        for &(symbol, truth) in &truth {
            let of_plant = |result: &Measurement| {
                result
                    .estimate(symbol)
                    .filter(|found| found.status == Status::Measured)
                    .map(|found| found.value)
            };
            let (mut holds, mut halves) = (0, Vec::new());
            for number in 0..GROUPS {
                let mut draws = random::stream(number as u64, Purpose::Bootstrap, size as u64);
                let mut places: Vec<usize> = (0..results.len()).collect();
                for at in 0..size {
                    let left = (places.len() - at) as f64;
                    let other = at + (random::uniform(&mut draws) * left) as usize;
                    places.swap(at, other);
                }
                let values: Vec<f64> =
                    places[..size].iter().filter_map(|&plant| of_plant(&results[plant])).collect();
                let mean = group::geometric_mean(symbol, &values);
                // Too few of its plants are measured.
                if mean.status == Status::NotIdentified {
                    continue;
                }
                holds += usize::from((mean.interval[0]..=mean.interval[1]).contains(&truth));
                halves.push((mean.interval[1] / mean.interval[0]).sqrt() - 1.0);
            }
            let half = tropism::math::statistics::median(&halves);
            line += &format!(
                "{:>22}",
                format!(
                    "{:.0} % hold, \u{b1}{:.0} %",
                    100.0 * holds as f64 / halves.len() as f64,
                    100.0 * half
                )
            );
        }
        println!("{line}");
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let plants: usize = arguments.first().map_or(1, |count| count.parse().expect("a number of plants"));
    let wanted = |case: &Case| {
        arguments.len() < 2 || arguments[1..].iter().any(|name| case.name.contains(name.as_str()))
    };
    println!(
        "median bias / rmse in %, then % of the 90 % intervals of measured and of provisional numbers that hold the truth; of {plants} plants"
    );
    println!("{:<32}{:>30}{:>30}{:>30}{:>30}{:>30}", "case", "beta", "gamma", "Lc", "B", "Lgz");
    for case in CASES.iter().filter(|case| wanted(case)) {
        let start = std::time::Instant::now();
        let results: Vec<Measurement> = parallel::map(plants, |plant| {
            let stimulus = match case {
                Case { nu, .. } if *nu != 0.0 => Stimulus::Lamps,
                Case { tilt_deg, .. } if *tilt_deg > 0.0 => Stimulus::Tilt(*tilt_deg),
                _ => Stimulus::None,
            };
            measure(&case.record(plant as u64), &Options { law: case.law, stimulus, ..Options::default() })
        });
        let mut line = format!("{:<32}", case.name);
        for quantity in 0..case.truth(0).len() {
            let (mut errors, mut counts) = (Vec::new(), [[0_u32; 2]; 2]);
            for (plant, result) in results.iter().enumerate() {
                let (symbol, truth) = case.truth(plant as u64)[quantity];
                let found = result.estimate(symbol).expect("each constant has an estimate");
                errors.push(found.value / truth - 1.0);
                let kind = match found.status {
                    Status::Measured => 0,
                    Status::Provisional => 1,
                    Status::Bounded | Status::NotIdentified => continue,
                };
                counts[kind][0] += 1;
                counts[kind][1] += u32::from((found.interval[0]..=found.interval[1]).contains(&truth));
            }
            let bias = tropism::math::statistics::median(&errors);
            let rmse = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
            let share = |[all, holds]: [u32; 2]| match all {
                0 => "-".to_owned(),
                _ => format!("{:.0} of {all}", 100.0 * f64::from(holds) / f64::from(all)),
            };
            line += &format!(
                "{:>30}",
                format!(
                    "{:+.0}/{:.0}, {}, {}",
                    100.0 * bias,
                    100.0 * rmse,
                    share(counts[0]),
                    share(counts[1])
                )
            );
        }
        let of_plants = |of: fn(&Measurement) -> f64| {
            tropism::math::statistics::median(&results.iter().map(of).collect::<Vec<_>>())
        };
        let misfits: Vec<f64> = results.iter().map(|result| result.misfit).collect();
        let misfit = tropism::math::statistics::quantile_linear(&misfits, 0.95);
        let rise = of_plants(|result| result.estimate("D").map_or(f64::NAN, |found| found.value));
        println!(
            "{line}   95 % point of the misfit {misfit:.2}, D {rise:.2} cm, {:.2} s a plant",
            start.elapsed().as_secs_f64() / plants as f64
        );
        if case.spread > 0.0 {
            groups(case, &results);
        }
    }
}
