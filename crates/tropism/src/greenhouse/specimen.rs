//! A virtual bean without photographs: what statistics by the thousand are made of.

use std::convert::Infallible;

use rand_chacha::ChaCha8Rng;

use super::bean::{Bean, Species};
use super::detector;
use crate::environment::Environment;
use crate::light::Light;
use crate::observation::Observation;
use crate::random::{self, Purpose};
use crate::track::{PERIOD_MIN, Track};

/// A bean whose highest point is read off its pose as the paper's detector would place it: projected, leaves included,
/// on its grid and with its noise.
#[derive(Clone)]
pub struct Specimen {
    bean: Bean,
    noise: ChaCha8Rng,
    truth: Vec<[f64; 4]>,
}

impl Specimen {
    /// The bean of `seed`, with `scale` times the variation between real plants.
    #[must_use]
    pub fn new(species: &Species, seed: u64, scale: f64) -> Self {
        Self::of(Bean::new(species.draw(seed, scale), seed), seed)
    }

    /// A given bean, with the detector's noise of `seed`.
    #[must_use]
    pub fn of(bean: Bean, seed: u64) -> Self {
        Self { bean, noise: random::stream(seed, Purpose::Camera, 0), truth: Vec::new() }
    }

    /// The living bean.
    #[must_use]
    pub const fn bean(&self) -> &Bean {
        &self.bean
    }

    /// Adds the true apex (x, y, z) and the length of the stem, in cm, at each observation so far to the bean's track.
    ///
    /// # Panics
    /// If the track is not as long as there were observations.
    pub fn add_truth(&self, track: &mut Track) {
        assert_eq!(track.samples.len(), self.truth.len(), "a track of this specimen");
        for (column, name) in ["apex_x_cm", "apex_y_cm", "apex_z_cm", "length_cm"].into_iter().enumerate() {
            track.add_numbers(name, 5, self.truth.iter().map(|row| row[column]));
        }
    }
}

impl Environment for Specimen {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        let pose = self.bean.pose();
        let [x, y, z] = pose.apex();
        self.truth.push([x, y, z, self.bean.length()]);
        Ok(Observation::simulated(detector::detect(&pose, &mut self.noise)))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        let power = |lamp| if lamp == light { 1.0 } else { 0.0 };
        self.bean.advance(Light::BOTH.map(power), PERIOD_MIN);
        Ok(())
    }
}
