//! A made-up track, for the tests of the memory model beside its code and through its public items.

use super::{Layout, Light, Point, Purpose, Quality, Sample, Track, random};

/// A plant that answers the light of 15 to 30 minutes ago by `gain` cm a step, under a lamp that changes every 30 steps.
pub(super) fn track(seed: u64, gain: f64, period_min: f64) -> Track {
    let mut rng = random::stream(seed, Purpose::Growth, 0);
    let mut tip = Point::new(0.0, 4.0);
    let mut sides: Vec<f64> = Vec::new();
    let samples = (0..400).map(|step| {
        let light = if step / 30 % 2 == 0 { Light::RIGHT } else { Light::LEFT };
        let sample = Sample {
            step,
            time_s: f64::from(step) * 60.0 * period_min,
            tip,
            stem: None,
            depth: None,
            light: (step < 399).then_some(light),
            quality: Quality::Measured,
        };
        sides.push(Layout::default().side(light));
        let back = |steps: usize| sides.len().checked_sub(steps).map_or(0.0, |at| sides[at]);
        let answer = gain * (back(4) + back(5) + back(6)) / 3.0;
        let pull = -0.02 * tip.x;
        tip = Point::new(
            tip.x + answer + pull + 0.01 * random::normal(&mut rng),
            tip.y + 0.025 + 0.005 * random::normal(&mut rng),
        );
        sample
    });
    let samples = samples.collect();
    Track { period_min, ..Track::of(samples) }
}
