//! The noise-free bean once more, by another integrator and another hand: the equations as they are published in
//! docs/explanation/virtual-bean.md, with plain vectors, integrated by the classical Runge-Kutta method of fourth order.

use std::f64::consts::{PI, TAU};

use tropism::math::vector::Vec3;
use tropism::math::{cos, exp, pow, sin};
use tropism_bean::Individual;
use tropism_bean::view::WALL;

/// A piece of the stem: length, curvature at rest, curvature, two stages of light memory, gravity memory.
type Segment = [f64; 11];

/// The stem, base first, the segment with the leaves, and the time in h.
#[derive(Clone)]
pub(crate) struct Stem {
    segments: Vec<Segment>,
    leaf: usize,
    time_h: f64,
    age_h: f64,
    /// Share of elongation that is missing at the start and comes within 8 h.
    lack: f64,
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross([a, b, c]: Vec3, [x, y, z]: Vec3) -> Vec3 {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn sum(a: Vec3, b: Vec3, times: f64) -> Vec3 {
    core::array::from_fn(|axis| a[axis] + times * b[axis])
}

/// `vector`, turned about `axis` by the axis' length (Rodrigues).
fn turned(vector: Vec3, axis: Vec3) -> Vec3 {
    let angle = dot(axis, axis).sqrt();
    if angle < 1e-12 {
        return vector;
    }
    let unit = axis.map(|part| part / angle);
    let along = (1.0 - cos(angle)) * dot(unit, vector);
    let across = cross(unit, vector);
    sum(sum(vector.map(|part| cos(angle) * part), across, sin(angle)), unit, along)
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}

/// The paper's lamps, left and right, in cm (section 2.1).
const LAMPS: [Vec3; 2] = [[-35.0, 30.0, -8.0], [35.0, 30.0, -8.0]];

/// The irradiance over the reference, compressed: from where the light comes, and how strongly it is felt.
fn felt(plant: &Individual, lamps: [f64; 2], at: Vec3) -> Vec3 {
    let mut light = [0.0; 3];
    for (lamp, power) in LAMPS.into_iter().zip(lamps) {
        let way = sum(lamp, at, -1.0);
        let far = dot(way, way).sqrt();
        light = sum(light, way, power * (35.0 / far) * (35.0 / far) / far);
    }
    let strength = dot(light, light).sqrt();
    if strength == 0.0 {
        return light;
    }
    light.map(|part| part / strength * pow(strength, plant.tropism.light_exponent).min(2.5))
}

impl Stem {
    pub(crate) fn seedling(plant: &Individual) -> Self {
        let mut segment = [0.0; 11];
        segment[0] = plant.growth.start / 8.0;
        Self { segments: vec![segment; 8], leaf: 6, time_h: 0.0, age_h: 0.0, lack: 0.0 }
    }

    /// The seedling of the reference run: less sensitive to light, and slow in its first hours.
    pub(crate) fn of_reference(plant: &Individual) -> (Self, Individual) {
        let mut plant = plant.clone();
        plant.tropism.light = 0.135;
        (Self { lack: 0.4, ..Self::seedling(&plant) }, plant)
    }

    /// The frame (d1, d2, t) and the place at the middle of each segment, and the apex.
    fn shape(&self) -> (Vec<([Vec3; 3], Vec3)>, Vec3) {
        let mut frame: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
        let mut at = [0.0; 3];
        let mut middles = Vec::new();
        for &[length, _, _, k1, k2, ..] in &self.segments {
            let bend = |frame: [Vec3; 3]| {
                let axis = sum(frame[1].map(|part| k1 * part), frame[0], -k2).map(|part| 0.5 * length * part);
                frame.map(|vector| turned(vector, axis))
            };
            frame = bend(frame);
            middles.push((frame, sum(at, frame[2], 0.5 * length)));
            at = sum(at, frame[2], length);
            frame = bend(frame);
        }
        (middles, at)
    }

    pub(crate) fn apex(&self) -> Vec3 {
        self.shape().1
    }

    pub(crate) fn length(&self) -> f64 {
        self.segments.iter().map(|segment| segment[0]).sum()
    }

    /// How everything changes, per h.
    fn change(&self, plant: &Individual, lamps: [f64; 2]) -> Vec<Segment> {
        let Individual { growth, motility, tropism, nutation, stem, leaves, .. } = plant;
        // Age changes a plant slowly: its growth, motility and motile zone are those of the last full five minutes.
        let t = self.age_h;
        let old = logistic((growth.slows_h - t) / growth.slowing_h);
        let young = 1.0 - self.lack * exp(-t / 8.0);
        let elongation = 12.0 * growth.rate * (growth.late + (1.13 - growth.late) * young * old);
        let gain =
            motility.late + (1.0 - motility.late) * logistic((motility.mature_h - t) / motility.maturing_h);
        let zone = motility.zone_young
            + (motility.zone - motility.zone_young) * logistic((t - motility.zone_h) / 4.0);
        let straightening = (tropism.light + tropism.gravity) * zone / tropism.balance;
        let turn = TAU * self.time_h / nutation.period_h;
        let (wide, narrow) = (cos(turn), nutation.roundness * nutation.hand * sin(turn));
        let size = nutation.curvature * TAU / nutation.period_h;
        let (s, c) = (sin(nutation.azimuth), cos(nutation.azimuth));
        let steady = [
            size * (c * wide - s * narrow) + tropism.bias_x,
            size * (s * wide + c * narrow) - tropism.bias_z,
        ];

        let (middles, apex) = self.shape();
        let at_apex = felt(plant, lamps, apex);
        let n = self.segments.len();
        let mut below = vec![0.0; n];
        let mut above = 0.0;
        for i in (0..n).rev() {
            below[i] = above + 0.5 * self.segments[i][0];
            above += self.segments[i][0];
        }
        let radius =
            |below: f64| stem.radius_apex + (stem.radius_base - stem.radius_apex) * (below / 15.0).min(1.0);
        let growing = |i: usize| self.segments[i][0] * logistic(growth.zone - below[i]);
        let all: f64 = (0..n).map(growing).sum();

        // What hangs on the stem: where, and the force in dyn.
        let weight = |grams: f64| [0.0, -981.0 * grams, 0.0];
        let share = 0.18 * 0.18;
        let mut loads = vec![
            (apex, weight(stem.tip_g), n),
            (middles[self.leaf].1, weight(2.0 * leaves.mass_g * share), self.leaf),
        ];
        for (i, (_, middle)) in middles.iter().enumerate() {
            let own = weight(0.95 * PI * radius(below[i]).powi(2) * self.segments[i][0]);
            let push = 300.0 * (WALL + 0.5 - middle[2]).max(0.0);
            loads.push((*middle, sum(own, [0.0, 0.0, 1.0], push), i));
        }
        (0..n)
            .map(|i| {
                let ([d1, d2, _], middle) = middles[i];
                let [_, r1, r2, k1, k2, f1, f2, m1, m2, g1, g2] = self.segments[i];
                let signal = sum(
                    felt(plant, lamps, middle).map(|part| (1.0 - tropism.apical) * part),
                    at_apex,
                    tropism.apical,
                );
                let motile = gain * logistic((zone - below[i]) / motility.edge);
                let moment =
                    loads.iter().filter(|load| load.2 > i).fold([0.0; 3], |moment, (at, force, _)| {
                        sum(moment, cross(sum(*at, middle, -1.0), *force), 1.0)
                    });
                let modulus =
                    (stem.modulus_mpa * exp(below[i] / stem.modulus_length)).min(stem.modulus_mature_mpa);
                let stiffness = 1e7 * modulus * PI / 4.0 * radius(below[i]).powi(4);
                let bent = |rest: f64, memory: f64, gravity: f64, k: f64, steady: f64, loaded: f64| {
                    let wanted =
                        tropism.light * memory + tropism.gravity * gravity - straightening * k + steady;
                    [motile * wanted, (rest + loaded - k) / stem.lag_h]
                };
                let [r1, k1] = bent(r1, m1, g1, k1, steady[0], dot(moment, d2) / stiffness);
                let [r2, k2] = bent(r2, m2, g2, k2, steady[1], -dot(moment, d1) / stiffness);
                let light = tropism.light_memory_h;
                let gravity = tropism.gravity_memory_h;
                [
                    elongation * growing(i) / all,
                    r1,
                    r2,
                    k1,
                    k2,
                    (dot(signal, d1) - f1) / light,
                    (dot(signal, d2) - f2) / light,
                    (f1 - m1) / light,
                    (f2 - m2) / light,
                    (d1[1] - g1) / gravity,
                    (d2[1] - g2) / gravity,
                ]
            })
            .collect()
    }

    fn moved(&self, change: &[Segment], hours: f64) -> Self {
        let mut moved = self.clone();
        for (segment, change) in moved.segments.iter_mut().zip(change) {
            *segment = core::array::from_fn(|part| segment[part] + hours * change[part]);
        }
        moved.time_h += hours;
        moved
    }

    /// Lives on for `hours`, one step of the method.
    pub(crate) fn step(&mut self, plant: &Individual, lamps: [f64; 2], hours: f64) {
        self.age_h = (12.0 * self.time_h + 1e-6).floor() / 12.0;
        let first = self.change(plant, lamps);
        let second = self.moved(&first, 0.5 * hours).change(plant, lamps);
        let third = self.moved(&second, 0.5 * hours).change(plant, lamps);
        let fourth = self.moved(&third, hours).change(plant, lamps);
        let mean: Vec<Segment> = (0..first.len())
            .map(|i| {
                core::array::from_fn(|part| {
                    (first[i][part] + 2.0 * second[i][part] + 2.0 * third[i][part] + fourth[i][part]) / 6.0
                })
            })
            .collect();
        *self = self.moved(&mean, hours);
        let mut i = 0;
        while i < self.segments.len() {
            if self.segments[i][0] > 0.75 {
                self.segments[i][0] *= 0.5;
                self.segments.insert(i, self.segments[i]);
                self.leaf += usize::from(self.leaf > i);
                i += 1;
            }
            i += 1;
        }
    }
}
