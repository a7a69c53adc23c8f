//! The rod that bends: gravity, straightening, light and a forcing of its own turn into curvature.
//!
//! A is the angle to the vertical, kappa = dA/ds the curvature, s the distance from the base, a that from the apex. In the zone
//! that bends, `z(a) = (1 - exp(-a / D)) / (1 + exp((a - Lgz) / W)) / n`, the curvature of a piece of tissue changes by
//!
//! `D kappa / Dt = z(a) (-beta sin A - gamma kappa + nu m cos A + f(t))`
//!
//! where n is the mean of 1 - exp(-a / D) over Lgz, so that beta and gamma are means over the zone: sensitivity rises from the
//! apex over the depth D and ends at an edge of width W. m is the lamp (-1 left, 1 right) behind a low-pass filter of time constant tau, and f the forcing (circumnutation, slow
//! drift). In [`Law::Ace`] tissue is carried from the apex by elongation, which has the profile of z; in [`Law::Ac`] all
//! elongation is at the very apex. Stretch does not change kappa in either: a curved piece that elongates keeps its curvature.
//!
//! # References
//! AC: Bastien, Bohr, Moulia, Douady 2013, doi:10.1073/pnas.1214301109. ACE: Bastien, Douady, Moulia 2014,
//! doi:10.3389/fpls.2014.00136. Light: Bastien, Douady, Moulia 2015, doi:10.1371/journal.pcbi.1004037.

#![allow(clippy::needless_range_loop, reason = "a segment indexes several arrays, and so do equations")]

use serde::{Deserialize, Serialize};

use super::record::StemRecord;
use crate::geometry::STEM_POINTS;
use crate::math::{self, Lanes, Real};
use crate::simd::{Kernel, dispatch};

/// Points of a stem above its base.
pub(super) const FREE_POINTS: usize = STEM_POINTS - 1;
/// Places of the numbers of the rod in a vector of unknowns.
pub(super) const LN_BETA: usize = 0;
pub(super) const LN_GAMMA: usize = 1;
pub(super) const LN_ZONE: usize = 2;
/// The width of the edge as a share of the zone.
pub(super) const LN_EDGE: usize = 3;
/// The depth over which sensitivity rises from the apex, as a share of the zone.
pub(super) const LN_RISE: usize = 4;
pub(super) const BASE: usize = 5;
pub(super) const CURVATURE: usize = 6;
pub(super) const NU: usize = 7;
pub(super) const LN_TAU: usize = 8;
/// Numbers of the rod without and with light.
pub(super) const IN_THE_DARK: usize = 7;
pub(super) const IN_LIGHT: usize = 9;

/// Segments of the rod in a fit: a multiple of [`FREE_POINTS`], so that the points of a stem are nodes.
pub(super) const SEGMENTS: usize = 27;
/// Segments of a virtual plant.
const FINE_SEGMENTS: usize = 54;
/// Longest step of the integration (Heun): this share of the record, and at most these hours. A virtual plant is integrated in a
/// third of them.
const MAX_STEP: f64 = 0.01;
const MAX_STEP_H: f64 = 0.1;
/// Width of the sharpest edge, in segments. Chosen: a third, where the logistic still falls within one segment.
const LEAST_EDGE: f64 = 0.33;
/// Vectors of unknowns that are simulated together: the seven numbers without light take one pass.
const LANES: usize = 8;

/// How elongation carries curvature along the stem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Law {
    /// Elongation at the apex only: curvature stays at its distance from the base.
    Ac,
    /// Elongation in the zone that bends: curvature is carried with the tissue.
    #[default]
    Ace,
}

/// A rod over the frames of a record.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    pub(super) law: Law,
    /// Time and length at each frame.
    times_h: Vec<f64>,
    length_cm: Vec<f64>,
    lamps: Vec<f64>,
    pub(super) is_lit: bool,
    /// Number of knots of the forcing and the time between them, in h.
    pub(super) knots: usize,
    pub(super) knot_h: f64,
    max_step_h: f64,
}

impl Rod {
    pub(super) fn new(record: &StemRecord, law: Law, is_lit: bool, knots: usize) -> Self {
        let duration = record.duration_h();
        Self {
            law,
            times_h: record.times_h.clone(),
            length_cm: record.length_cm.clone(),
            lamps: record.lamps.clone(),
            is_lit,
            knots,
            knot_h: duration / (knots.max(2) - 1) as f64,
            max_step_h: MAX_STEP_H.min(duration * MAX_STEP),
        }
    }

    /// Number of unknowns of the rod itself.
    pub(super) const fn rod_unknowns(&self) -> usize {
        if self.is_lit { IN_LIGHT } else { IN_THE_DARK }
    }

    /// Number of unknowns with those of the forcing.
    pub(super) const fn unknowns(&self) -> usize {
        self.rod_unknowns() + self.knots
    }

    /// Coordinates of the free points of all frames: frame by frame, x and y of each point.
    pub(super) fn places(&self, unknowns: &[f64]) -> Vec<f64> {
        run::<f64, SEGMENTS>(self, unknowns, |_| {}, |_| {})
    }

    /// [`Self::places`] of a virtual plant: finer segments and steps than those of the fit.
    pub(super) fn fine_places(&self, unknowns: &[f64]) -> Vec<f64> {
        let fine = Self { max_step_h: self.max_step_h / 3.0, ..self.clone() };
        run::<f64, FINE_SEGMENTS>(&fine, unknowns, |_| {}, |_| {})
    }

    /// [`Self::places`] for several vectors of unknowns.
    pub(super) fn places_of_all(&self, all: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of_chunk = |chunk: &[Vec<f64>]| {
            let together: Vec<Lanes<LANES>> = (0..self.unknowns())
                .map(|at| Lanes::from_fn(|lane| chunk[lane.min(chunk.len() - 1)][at]))
                .collect();
            let places = dispatch(Together { rod: self, unknowns: &together });
            let of_lane = |lane| places.iter().map(|value: &Lanes<LANES>| value.lane(lane)).collect();
            (0..chunk.len()).map(of_lane).collect::<Vec<_>>()
        };
        all.chunks(LANES).flat_map(of_chunk).collect()
    }

    /// The derivatives of [`Self::places`] with respect to the forcing at each knot, by the tangent linear model: the exact
    /// derivative of the integration, several times as fast as differences.
    pub(super) fn forcing_derivatives(&self, unknowns: &[f64]) -> Vec<Vec<f64>> {
        let (mut steps, mut poses) = (Vec::new(), Vec::new());
        run::<f64, SEGMENTS>(self, unknowns, |step| steps.push(step), |pose| poses.push(pose));
        let gamma = math::exp(unknowns[LN_GAMMA]);
        let of_batch = |first: usize| {
            let tangent = Tangent { rod: self, steps: &steps, poses: &poses, gamma, first };
            let places: Vec<Lanes<LANES>> = dispatch(tangent);
            let knots = LANES.min(self.knots - first);
            let of_lane = |lane| places.iter().map(|value| value.lane(lane)).collect();
            (0..knots).map(of_lane).collect::<Vec<Vec<f64>>>()
        };
        (0..self.knots).step_by(LANES).flat_map(of_batch).collect()
    }
}

struct Together<'a> {
    rod: &'a Rod,
    unknowns: &'a [Lanes<LANES>],
}

impl Kernel for Together<'_> {
    type Result = Vec<Lanes<LANES>>;

    #[inline(always)]
    fn run(self) -> Self::Result {
        run::<Lanes<LANES>, SEGMENTS>(self.rod, self.unknowns, |_| {}, |_| {})
    }
}

/// What the tangent of a step needs.
struct Step<R, const N: usize> {
    zone: [R; N],
    drift: [R; N],
    /// What turns back a change of the angle, at both stages.
    pull: [[R; N]; 2],
    piece: f64,
    dt: f64,
    /// The middle of the step, in h.
    time_h: f64,
}

/// What the tangent of an observation needs: sine and cosine of the angle of each segment, and its length.
struct Pose<R, const N: usize> {
    sin: [R; N],
    cos: [R; N],
    piece: f64,
    /// The steps so far.
    steps: usize,
}

/// The tangent linear model for the knots from `first` on.
struct Tangent<'a> {
    rod: &'a Rod,
    steps: &'a [Step<f64, SEGMENTS>],
    poses: &'a [Pose<f64, SEGMENTS>],
    gamma: f64,
    first: usize,
}

impl Kernel for Tangent<'_> {
    type Result = Vec<Lanes<LANES>>;

    #[inline(always)]
    fn run(self) -> Self::Result {
        let none = Lanes::<LANES>::splat(0.0);
        let mut curvature = [none; SEGMENTS];
        let mut places = Vec::with_capacity(self.poses.len() * FREE_POINTS * 2);
        let mut done = 0;
        // Before the knot ahead of the first nothing has moved.
        let begin = (self.first as f64 - 1.0) * self.rod.knot_h;
        for pose in self.poses {
            for step in &self.steps[done..pose.steps] {
                if step.time_h < begin {
                    continue;
                }
                let place = step.time_h / self.rod.knot_h;
                let force =
                    Lanes::from_fn(|lane| (1.0 - (place - (self.first + lane) as f64).abs()).max(0.0));
                let slopes = |curvature: &[Lanes<LANES>; SEGMENTS], stage: usize| {
                    let mut slopes = [none; SEGMENTS];
                    let mut angle = none;
                    for segment in 0..SEGMENTS {
                        let bend = curvature[segment] * step.piece;
                        let turned = angle + bend * 0.5;
                        angle += bend;
                        slopes[segment] =
                            (force - turned * step.pull[stage][segment] - curvature[segment] * self.gamma)
                                * step.zone[segment]
                                - gradient(curvature, segment, step.piece) * step.drift[segment];
                    }
                    slopes
                };
                let first = slopes(&curvature, 0);
                let mut ahead = curvature;
                for segment in 0..SEGMENTS {
                    ahead[segment] += first[segment] * step.dt;
                }
                let second = slopes(&ahead, 1);
                for segment in 0..SEGMENTS {
                    curvature[segment] += (first[segment] + second[segment]) * (0.5 * step.dt);
                }
            }
            done = pose.steps;
            let (mut angle, mut x, mut y) = (none, none, none);
            for segment in 0..SEGMENTS {
                let bend = curvature[segment] * pose.piece;
                let turned = angle + bend * 0.5;
                angle += bend;
                x += turned * (pose.cos[segment] * pose.piece);
                y -= turned * (pose.sin[segment] * pose.piece);
                if (segment + 1) % (SEGMENTS / FREE_POINTS) == 0 {
                    places.push(x);
                    places.push(y);
                }
            }
        }
        places
    }
}

/// The constants of a rod, not as logarithms.
struct Constants<R> {
    beta: R,
    gamma: R,
    zone: R,
    edge: R,
    rise: R,
    base: R,
    nu: R,
    tau: R,
}

#[inline(always)]
fn run<R: Real, const N: usize>(
    rod: &Rod,
    unknowns: &[R],
    mut on_step: impl FnMut(Step<R, N>),
    mut on_pose: impl FnMut(Pose<R, N>),
) -> Vec<R> {
    let (none, ln) = (R::splat(0.0), |at: usize| math::exp(unknowns[at]));
    let constants = Constants {
        beta: ln(LN_BETA),
        gamma: ln(LN_GAMMA),
        zone: ln(LN_ZONE),
        edge: ln(LN_EDGE) * ln(LN_ZONE),
        rise: ln(LN_RISE) * ln(LN_ZONE),
        base: unknowns[BASE],
        nu: if rod.is_lit { unknowns[NU] } else { none },
        tau: if rod.is_lit { ln(LN_TAU) } else { R::splat(1.0) },
    };
    let forcing = &unknowns[rod.rod_unknowns()..];
    let mut curvature = [unknowns[CURVATURE]; N];
    let mut light = none;
    let mut places = Vec::with_capacity(rod.times_h.len() * FREE_POINTS * 2);
    let mut done = 0;
    for frame in 0..rod.times_h.len() {
        let length = rod.length_cm[frame];
        on_pose(observe(&curvature, constants.base, length, done, &mut places));
        let Some(&end) = rod.times_h.get(frame + 1) else { break };
        let (start, grown) = (rod.times_h[frame], rod.length_cm[frame + 1] - length);
        let steps = ((end - start) / rod.max_step_h).ceil().max(1.0) as usize;
        let dt = (end - start) / steps as f64;
        let speed = grown / (end - start);
        done += steps;
        for step in 0..steps {
            let middle = (step as f64 + 0.5) / steps as f64;
            let (length, time_h) = (length + grown * middle, start + (end - start) * middle);
            let force = forcing_at(forcing, rod.knot_h, time_h);
            let mut turning = R::splat(0.0);
            if rod.is_lit {
                let lamp = R::splat(rod.lamps[frame]);
                let half_step = math::exp(R::splat(-0.5 * dt) / constants.tau);
                // What is remembered in the middle of the step is what acts.
                light = lamp + (light - lamp) * half_step;
                turning = constants.nu * light;
                light = lamp + (light - lamp) * half_step;
            }
            on_step(Step {
                time_h,
                ..advance(rod.law, &mut curvature, &constants, [length, speed, dt], [force, turning])
            });
        }
    }
    places
}

/// The forcing between two of its knots.
#[inline(always)]
fn forcing_at<R: Real>(knots: &[R], knot_h: f64, time_h: f64) -> R {
    let Some(last) = knots.len().checked_sub(2) else { return knots.first().copied().unwrap_or_default() };
    let place = (time_h / knot_h).max(0.0);
    let knot = (place as usize).min(last);
    let share = place - knot as f64;
    knots[knot] * (1.0 - share) + knots[knot + 1] * share
}

/// One step of Heun's method, of a rod of `length` that elongates at `speed`, over `dt`.
#[inline(always)]
fn advance<R: Real, const N: usize>(
    law: Law,
    curvature: &mut [R; N],
    constants: &Constants<R>,
    [length, speed, dt]: [f64; 3],
    forces: [R; 2],
) -> Step<R, N> {
    let piece = length / N as f64;
    let (mut zone, mut drift) = ([R::splat(0.0); N], [R::splat(0.0); N]);
    // An edge that is much sharper than the segments would make the likelihood a staircase.
    let sharpest = LEAST_EDGE * piece;
    let per_edge = R::splat(1.0) / (constants.edge * constants.edge + sharpest * sharpest).sqrt();
    let one = R::splat(1.0);
    let per_rise = one / constants.rise;
    let per_mean =
        one / (one - constants.rise / constants.zone * (one - math::exp(constants.zone * per_rise * -1.0)));
    let mut sum = R::splat(0.0);
    for segment in 0..N {
        let from_apex = length - (segment as f64 + 0.5) * piece;
        let risen = (one - math::exp(per_rise * -from_apex)) * per_mean;
        zone[segment] = math::logistic((constants.zone - from_apex) * per_edge) * risen;
        sum += zone[segment];
    }
    // Velocity of tissue less that of the segment, which stays at its share of the length; at most 0.
    let mut below = R::splat(0.0);
    for segment in 0..N {
        let carried = match law {
            Law::Ac => R::splat(0.0),
            Law::Ace => (below + zone[segment] * 0.5) / sum * speed,
        };
        below += zone[segment];
        drift[segment] = carried - speed * ((segment as f64 + 0.5) / N as f64);
    }
    let (first, pull) = slopes(curvature, constants, &zone, &drift, piece, forces);
    let mut ahead = *curvature;
    for segment in 0..N {
        ahead[segment] += first[segment] * dt;
    }
    let (second, pull_ahead) = slopes(&ahead, constants, &zone, &drift, piece, forces);
    for segment in 0..N {
        curvature[segment] += (first[segment] + second[segment]) * (0.5 * dt);
    }
    Step { zone, drift, pull: [pull, pull_ahead], piece, dt, time_h: 0.0 }
}

/// Rate of change of the curvature of each segment, and what turns back a change of its angle.
#[inline(always)]
fn slopes<R: Real, const N: usize>(
    curvature: &[R; N],
    constants: &Constants<R>,
    zone: &[R; N],
    drift: &[R; N],
    piece: f64,
    [force, turning]: [R; 2],
) -> ([R; N], [R; N]) {
    let (mut slopes, mut pull) = ([R::splat(0.0); N], [R::splat(0.0); N]);
    let mut angle = constants.base;
    for segment in 0..N {
        let bend = curvature[segment] * piece;
        let (sin, cos) = math::sin_cos(angle + bend * 0.5);
        angle += bend;
        pull[segment] = constants.beta * cos + turning * sin;
        slopes[segment] = zone[segment]
            * (turning * cos - constants.beta * sin - constants.gamma * curvature[segment] + force)
            - drift[segment] * gradient(curvature, segment, piece);
    }
    (slopes, pull)
}

/// The gradient of the curvature along the stem. What drifts comes from the apex's side: upwind differences of second order.
#[inline(always)]
fn gradient<R: Real, const N: usize>(curvature: &[R; N], segment: usize, piece: f64) -> R {
    let above = |by: usize| curvature[(segment + by).min(N - 1)];
    (above(1) * 4.0 - above(2) - curvature[segment] * 3.0) * (0.5 / piece)
}

/// Appends x and y of the free points.
#[inline(always)]
fn observe<R: Real, const N: usize>(
    curvature: &[R; N],
    base: R,
    length: f64,
    steps: usize,
    places: &mut Vec<R>,
) -> Pose<R, N> {
    let piece = length / N as f64;
    let (mut angle, mut x, mut y) = (base, R::splat(0.0), R::splat(0.0));
    let mut pose = Pose { sin: [angle; N], cos: [angle; N], piece, steps };
    for segment in 0..N {
        let bend = curvature[segment] * piece;
        let (sin, cos) = math::sin_cos(angle + bend * 0.5);
        angle += bend;
        x += sin * piece;
        y += cos * piece;
        (pose.sin[segment], pose.cos[segment]) = (sin, cos);
        if (segment + 1) % (N / FREE_POINTS) == 0 {
            places.push(x);
            places.push(y);
        }
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// A stem of 8 cm that lies at an angle and grows, over 6 h.
    fn rod(law: Law) -> (Rod, Vec<f64>) {
        let stem = core::array::from_fn(|k| Point::new(k as f64 * 0.8, k as f64 * 0.4));
        let frames = (0..37).map(|frame| (f64::from(frame) / 6.0, stem, 1.0)).collect();
        let mut record = StemRecord::of_frames(frames, 37).unwrap();
        record.length_cm.iter_mut().zip(&record.times_h).for_each(|(length, time)| *length += 0.3 * time);
        let rod = Rod::new(&record, law, true, 12);
        let mut unknowns = vec![0.3, 0.5, 5.0, 0.2, 0.1].into_iter().map(math::ln).collect::<Vec<f64>>();
        unknowns.extend([1.1, 0.02, 0.1, -0.7]);
        unknowns.extend((0..12).map(|knot| 0.05 * f64::from(knot % 3 - 1)));
        (rod, unknowns)
    }

    #[test]
    fn the_tangent_is_the_derivative() {
        for law in [Law::Ac, Law::Ace] {
            let (rod, unknowns) = rod(law);
            let tangents = rod.forcing_derivatives(&unknowns);
            assert_eq!(tangents.len(), 12);
            for (knot, tangent) in tangents.iter().enumerate() {
                let moved = |by: f64| {
                    let mut moved = unknowns.clone();
                    moved[rod.rod_unknowns() + knot] += by;
                    rod.places(&moved)
                };
                for ((more, less), tangent) in moved(1e-4).iter().zip(moved(-1e-4)).zip(tangent) {
                    let difference = (more - less) / 2e-4;
                    assert!((difference - tangent).abs() < 1e-4, "knot {knot}: {difference} {tangent}");
                }
            }
        }
    }

    #[test]
    fn a_mirrored_rod_bends_the_mirrored_way() {
        let (mut rod, unknowns) = rod(Law::Ace);
        let places = rod.places(&unknowns);
        rod.lamps.iter_mut().for_each(|lamp| *lamp = -*lamp);
        let mut mirrored = unknowns;
        mirrored[BASE..=CURVATURE].iter_mut().for_each(|value| *value = -*value);
        mirrored[IN_LIGHT..].iter_mut().for_each(|value| *value = -*value);
        for (one, other) in places.chunks(2).zip(rod.places(&mirrored).chunks(2)) {
            assert!((one[0] + other[0]).abs() < 1e-12 && (one[1] - other[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn at_rest_the_angle_falls_with_the_convergence_length() {
        // Bastien et al. 2013: A(s) = A0 exp(-s / Lc) for small angles, in a zone that is the whole stem.
        let (mut rod, mut unknowns) = rod(Law::Ac);
        rod.times_h.iter_mut().for_each(|time| *time *= 20.0);
        rod.length_cm.fill(8.0);
        rod.max_step_h = 0.05;
        unknowns.truncate(IN_LIGHT);
        unknowns.resize(rod.unknowns(), 0.0);
        (unknowns[LN_ZONE], unknowns[BASE], unknowns[NU]) = (math::ln(50.0), 0.1, 0.0);
        unknowns[LN_RISE] = math::ln(crate::measure::fit::NO_RISE);
        let places = rod.fine_places(&unknowns);
        let last = &places[places.len() - 2 * FREE_POINTS..];
        let angle = |k: usize| math::atan2(last[2 * k + 2] - last[2 * k], last[2 * k + 3] - last[2 * k + 1]);
        let (convergence, apart) = (0.5 / 0.3, 8.0 / 9.0);
        for k in 0..4 {
            let ratio = angle(k + 1) / angle(k);
            assert!((ratio - math::exp(-apart / convergence)).abs() < 0.02, "{ratio}");
        }
    }
}
