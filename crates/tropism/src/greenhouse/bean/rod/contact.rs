//! Contact of the rod with solids: the forces that keep it out, and Coulomb friction.
//!
//! In: the rod within a sub-step, before it relaxes. Out: how the forces of all contacts change its curvatures in this sub-step.
//! The idea: the elastic relaxation of a sub-step is linear in the forces, so the least forces that leave no point of
//! contact inside a solid are the solution of a complementarity problem (Signorini's condition),
//!
//! `0 <= f_n,  0 <= gap + J dk(f),  f_n (gap + J dk(f)) = 0,  |f_t| <= friction f_n`
//!
//! with the gap, which a dent makes negative, and the Jacobian `J` of the places of contact over the curvatures. Projected Gauss-Seidel solves it, and starts from the
//! forces of the sub-step before. So a contact is as stiff as tissue and yet stable at any sub-step: the force is implicit.
//!
//! # References
//! Jean 1999, doi:10.1016/S0045-7825(98)00383-1: contact and Coulomb friction by an implicit step and projected Gauss-Seidel.

use super::{MAX_NODES, MEGAPASCAL, PerSegment, Segments, radius};
use crate::greenhouse::bean::rod::Forcing;
use crate::greenhouse::bean::{ContactPoint, Individual};
use crate::greenhouse::solid;
use crate::math::vector::{Vec3, add, cross, dot, normalize_or, scale, sub};
use crate::obstacle::Solid;

/// Coefficient of friction between a stem and a solid. Chosen by hand: dry wood on wood has 0.25 to 0.5.
pub(super) const FRICTION: f64 = 0.4;
/// Stiffness of a contact, in dyn/cm. Chosen by hand: the most that a bean presses, a tenth of a newton,
/// makes a dent of some hundredths of a millimetre.
const STIFFNESS: f64 = 5e6;
/// Speed at which a contact creeps that sticks, in cm/h for each dyn. It regularises Coulomb's law. Chosen by hand: with the
/// forces of a bean (a hundredth of a newton) below 0.03 cm/h.
const CREEP: f64 = 2.4e-5;
/// Gap below which a contact is computed, in cm. Chosen by hand: farther than most stems move in a sub-step; the fastest moves
/// 0.12 cm and may make a dent of the rest.
const REACH_CM: f64 = 0.08;
/// Turgor, in dyn/cm^2: growth bends no stem with more, so it gives way to a greater moment. Textbooks: 0.3 to 1 MPa.
const TURGOR: f64 = 0.6 * MEGAPASCAL;
/// How far a sub-step takes back a dent deeper than its force makes, in cm. Chosen by hand: it keeps the step within the linear
/// range.
const CORRECTION_CM: f64 = 0.02;
/// Speed above any of a stem, in cm/h: so long is a far solid not looked at. Chosen by hand: a half more than that of the
/// fastest apex (28 cm/h).
const FASTEST: f64 = 42.0;
/// Share of the distance from a solid that is left when the search along the stem looks again. Chosen by hand: a smaller one
/// looks at fewer points, a greater one lets more sub-steps pass.
const LEFT: f64 = 0.65;
/// How much faster than one moves the distance from a solid may change: perspective bends the flanks of obstacles.
const SLACK: f64 = 1.3;
/// Most sweeps of the solver, and the change of all gaps in cm below which it ends. Chosen by measurement: more change the
/// forces in the fourth digit.
const SWEEPS: (usize, f64) = (40, 1e-6);
/// Halvings of a segment in the search for its point nearest to a solid. Chosen by hand: then one of the secant errs by
/// micrometres.
const HALVINGS: u32 = 3;

/// Solids around a rod, and its contacts with them.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    solids: Vec<Solid>,
    pub(super) friction: f64,
    /// Sub-steps in which no point of the rod can come near each solid.
    waits: Vec<u32>,
    /// Contacts of the last sub-step.
    touches: Vec<Touch>,
    /// How the contacts bend each segment in this sub-step.
    bent: Box<[Bending; MAX_NODES]>,
    work: Work,
}

/// Changes of the curvatures of a segment in a sub-step, towards d1 and d2, in 1/cm.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bending {
    pub(super) actual: [f64; 2],
    pub(super) rest: [f64; 2],
}

/// A point of the rod near a solid.
#[derive(Clone, Copy, Debug)]
struct Touch {
    /// Number of the solid.
    solid: usize,
    segment: usize,
    /// Where in the segment, from 0 at its lower end to 1.
    share: f64,
    /// Its place, in cm.
    at: Vec3,
    /// Distance of the surfaces, in cm; below 0 for a dent.
    gap: f64,
    /// The normal of the solid, and two tangents.
    axes: [Vec3; 3],
    /// Force on the rod along each of them, in dyn.
    force: [f64; 3],
}

impl Touch {
    /// Force on the rod in space, in dyn.
    fn pull(&self) -> Vec3 {
        let [normal, along, across] = core::array::from_fn(|axis| scale(self.axes[axis], self.force[axis]));
        add(normal, add(along, across))
    }

    /// Place along the stem, counted in segments.
    fn place(&self) -> f64 {
        self.segment as f64 + self.share
    }
}

/// A row of the Jacobian: how a place moves along an axis by both curvatures of each segment, scaled so that the product of two
/// rows is the compliance of one place to a force at the other.
type JacobianRow = [f64; 2 * MAX_NODES];

/// Working memory of a sub-step.
#[derive(Clone, Debug)]
struct Work {
    before: Vec<Touch>,
    /// Direction of each segment.
    along: Vec<Vec3>,
    /// How far growth moves the lower end of each segment in this sub-step, in cm.
    grown: Vec<Vec3>,
    /// Square root of the bending of each segment by a unit moment in this sub-step.
    soft: Vec<f64>,
    /// Bending of each segment without contacts, in units of `soft`.
    free: Vec<f64>,
    rows: Vec<JacobianRow>,
    matrix: Vec<f64>,
    /// Movement along each axis without contacts; along a normal the gap is added.
    moved: Vec<f64>,
}

impl Contact {
    pub(super) fn new(solids: &[Solid], friction: f64) -> Self {
        Self {
            solids: solids.to_vec(),
            friction,
            waits: vec![0; solids.len()],
            touches: Vec::new(),
            bent: Box::new([Bending::default(); MAX_NODES]),
            work: Work {
                before: Vec::new(),
                along: Vec::new(),
                grown: Vec::new(),
                soft: Vec::new(),
                free: Vec::new(),
                rows: Vec::new(),
                matrix: Vec::new(),
                moved: Vec::new(),
            },
        }
    }

    /// Contacts that bear a force.
    pub(super) fn points(&self) -> impl Iterator<Item = ContactPoint> {
        let pressed = self.touches.iter().filter(|touch| touch.force[0] > 0.0);
        pressed.map(|touch| ContactPoint { solid: touch.solid, at: touch.at, force: touch.pull() })
    }

    /// A segment is halved.
    pub(super) fn split(&mut self, segment: usize) {
        for touch in &mut self.touches {
            if touch.segment > segment || (touch.segment == segment && touch.share >= 0.5) {
                touch.segment += 1;
            }
            if touch.segment == segment {
                touch.share *= 2.0;
            } else if touch.segment == segment + 1 && touch.share >= 0.5 {
                touch.share = 2.0 * touch.share - 1.0;
            }
        }
    }

    /// Whether the rod must be looked at in this sub-step; else a sub-step passes without.
    pub(super) fn is_due(&mut self) -> bool {
        if self.waits.contains(&0) {
            return true;
        }
        self.waits.iter_mut().for_each(|wait| *wait -= 1);
        self.touches.clear();
        false
    }

    /// Finds the contacts of a rod of `n` segments and their forces. Returns whether there are any; then [`Self::bending`]
    /// says how they bend it.
    ///
    /// Frames, places and moments of `segments` are those of this sub-step.
    pub(super) fn solve(
        &mut self,
        n: usize,
        segments: &Segments,
        plant: &Individual,
        forcing: &Forcing,
    ) -> bool {
        std::mem::swap(&mut self.work.before, &mut self.touches);
        self.touches.clear();
        let tangent = |i: usize| cross(frame(&segments.d1, i), frame(&segments.d2, i));
        self.work.along.clear();
        self.work.along.extend((0..n).map(tangent));
        self.find(n, segments, plant, forcing);
        if self.touches.is_empty() {
            return false;
        }
        self.start_from_before();
        self.linearize(n, segments, plant, forcing);
        let is_near =
            |(number, touch): (usize, &Touch)| touch.force[0] > 0.0 || self.work.moved[3 * number] < 0.0;
        if !self.touches.iter().enumerate().any(is_near) {
            return false;
        }
        self.relax_forces(forcing);
        self.curve(n, segments, plant);
        true
    }

    /// How the contacts bend the segments.
    pub(super) fn bending(&self) -> &[Bending] {
        &self.bent[..]
    }

    /// Finds the points of the rod that are near solids.
    fn find(&mut self, n: usize, segments: &Segments, plant: &Individual, forcing: &Forcing) {
        let thickest = plant.stem.radius_apex.max(plant.stem.radius_base);
        for number in 0..self.solids.len() {
            if self.waits[number] > 0 {
                self.waits[number] -= 1;
                continue;
            }
            // The length of stem ahead of which no point is near, as the last one looked at is far.
            let (mut safe, mut nearest) = (0.0, f64::INFINITY);
            for i in 0..n {
                let length = segments.length[i];
                if safe >= length {
                    safe -= length;
                    continue;
                }
                let half = 0.5 * length;
                let gap = solid::distance(&self.solids[number], frame(&segments.middle, i)).0 - thickest;
                let clear = (gap - REACH_CM).min((1.0 - LEFT) * gap) / SLACK;
                nearest = f64::min(nearest, gap - SLACK * clear.max(half));
                safe = (clear - half).max(0.0);
                if gap - SLACK * half < REACH_CM {
                    self.touch(number, i, n, segments, plant);
                }
            }
            // As an integer it saturates.
            self.waits[number] = ((nearest - REACH_CM) / (FASTEST * forcing.dt)).max(0.0) as u32;
        }
    }

    /// Adds the point of a segment that is nearest to a solid, if it is near. A shared end belongs to the upper segment.
    fn touch(&mut self, number: usize, i: usize, n: usize, segments: &Segments, plant: &Individual) {
        let (along, length) = (self.work.along[i], segments.length[i]);
        let middle = frame(&segments.middle, i);
        let at = |share: f64| add(middle, scale(along, (share - 0.5) * length));
        // A distance from a convex body is convex along a line: its slope changes sign once.
        let look = |share: f64| {
            let (distance, normal) = solid::distance(&self.solids[number], at(share));
            (distance, normal, dot(normal, along))
        };
        let (mut low, mut high) = ((0.0, look(0.0).2), (1.0, look(1.0).2));
        let share = if low.1 >= 0.0 {
            0.0
        } else if high.1 <= 0.0 {
            1.0
        } else {
            for _ in 0..HALVINGS {
                let share = 0.5 * (low.0 + high.0);
                let slope = look(share).2;
                *if slope < 0.0 { &mut low } else { &mut high } = (share, slope);
            }
            low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1)
        };
        if (share == 1.0 && i + 1 < n) || (share == 0.0 && i == 0) {
            return;
        }
        let (distance, normal, slope) = look(share);
        let from_apex = (segments.from_apex[i] - (share - 0.5) * length).max(0.0);
        let gap = distance - radius(plant, from_apex);
        if gap < REACH_CM {
            let other = if normal[2].abs() < 0.7 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
            let sideways = sub(other, scale(normal, dot(other, normal)));
            let tangent = normalize_or(sub(along, scale(normal, slope)), normalize_or(sideways, other));
            let axes = [normal, tangent, cross(normal, tangent)];
            let force = [0.0; 3];
            self.touches.push(Touch { solid: number, segment: i, share, at: at(share), gap, axes, force });
        }
    }

    /// Gives each contact the force of the nearest one of the sub-step before.
    fn start_from_before(&mut self) {
        for touch in &mut self.touches {
            let apart = |other: &Touch| (other.place() - touch.place()).abs();
            let same = self.work.before.iter_mut().filter(|other| other.solid == touch.solid);
            let nearest = same.min_by(|one, other| apart(one).total_cmp(&apart(other)));
            if let Some(nearest) = nearest.filter(|other| apart(other) < 1.0) {
                let pull = nearest.pull();
                touch.force = touch.axes.map(|axis| dot(axis, pull));
                touch.force[0] = touch.force[0].max(0.0);
                nearest.force = [0.0; 3];
            }
        }
    }

    /// Computes the Jacobian, the compliances, and how the contacts would move without their forces.
    fn linearize(&mut self, n: usize, segments: &Segments, plant: &Individual, forcing: &Forcing) {
        let Work { along, grown, soft, free, rows, matrix, moved, .. } = &mut self.work;
        soft.clear();
        free.clear();
        grown.clear();
        let growing = |i: usize| segments.length[i] / (1.0 + segments.growth_exp[i]);
        let rate = forcing.dt * forcing.growth / (0..n).map(growing).sum::<f64>();
        let mut end = [0.0; 3];
        for (i, &ahead) in along.iter().enumerate() {
            let (length, share) = (segments.length[i], forcing.relaxed_share);
            let compliance = segments.compliance(i, plant);
            let root = (share * compliance * length).sqrt();
            let moment = frame(&segments.moment, i);
            let [bending1, bending2] = [&segments.d2, &segments.d1].map(|axis| dot(moment, frame(axis, i)));
            let bent1 = share * (segments.rest1[i] + compliance * bending1 - segments.k1[i]);
            let bent2 = share * (segments.rest2[i] - compliance * bending2 - segments.k2[i]);
            soft.push(root);
            free.extend([bent1 * length / root, -bent2 * length / root]);
            grown.push(end);
            end = add(end, scale(ahead, rate * growing(i)));
        }
        rows.resize(3 * self.touches.len(), [0.0; 2 * MAX_NODES]);
        moved.clear();
        for (touch, rows) in self.touches.iter().zip(rows.chunks_exact_mut(3)) {
            let own = touch.segment;
            for j in 0..=own {
                // A segment bends by halves at both of its ends.
                let arm = if j < own {
                    sub(touch.at, frame(&segments.middle, j))
                } else {
                    scale(along[j], 0.5 * touch.share * segments.length[j])
                };
                let by1 = scale(cross(frame(&segments.d2, j), arm), soft[j]);
                let by2 = scale(cross(frame(&segments.d1, j), arm), soft[j]);
                for (row, &axis) in rows.iter_mut().zip(&touch.axes) {
                    (row[2 * j], row[2 * j + 1]) = (dot(axis, by1), dot(axis, by2));
                }
            }
            let grown = add(grown[own], scale(along[own], touch.share * rate * growing(own)));
            for (row, &axis) in rows.iter().zip(&touch.axes) {
                moved.push(product(row, free, own) + dot(axis, grown));
            }
            let normal = moved.len() - 3;
            moved[normal] += touch.gap.max(-CORRECTION_CM - touch.force[0] / STIFFNESS);
        }
        let size = moved.len();
        matrix.clear();
        matrix.resize(size * size, 0.0);
        for one in 0..size {
            for other in 0..=one {
                let shared = self.touches[one / 3].segment.min(self.touches[other / 3].segment);
                let compliance = product(&rows[one], &rows[other], shared);
                (matrix[one * size + other], matrix[other * size + one]) = (compliance, compliance);
            }
        }
    }

    /// Projected Gauss-Seidel: brings all forces to balance.
    fn relax_forces(&mut self, forcing: &Forcing) {
        let Work { matrix, moved, .. } = &self.work;
        let size = moved.len();
        let creep = CREEP * forcing.dt;
        for _ in 0..SWEEPS.0 {
            let mut changed = 0.0_f64;
            for number in 0..self.touches.len() {
                let row = 3 * number;
                let movement = |touches: &[Touch], axis: usize| {
                    let compliances = &matrix[(row + axis) * size..(row + axis + 1) * size];
                    let forces = touches.iter().flat_map(|touch| touch.force);
                    moved[row + axis]
                        + compliances.iter().zip(forces).map(|(one, force)| one * force).sum::<f64>()
                };
                let own = |axis: usize| matrix[(row + axis) * size + row + axis];
                let [normal, along, across] = self.touches[number].force;
                let stiff = own(0) + 1.0 / STIFFNESS;
                let residue = movement(&self.touches, 0) + normal / STIFFNESS;
                let pressed = (normal - residue / stiff).max(0.0);
                self.touches[number].force[0] = pressed;
                changed = changed.max((pressed - normal).abs() * stiff);

                let stiff = own(1).max(own(2)) + creep;
                let mut sliding = [(1, along), (2, across)]
                    .map(|(axis, force)| force - (movement(&self.touches, axis) + creep * force) / stiff);
                // Coulomb: friction holds up to a share of the pressure.
                let (most, wanted) =
                    (self.friction * pressed, (sliding[0] * sliding[0] + sliding[1] * sliding[1]).sqrt());
                if wanted > most {
                    sliding = sliding.map(|force| force * most / wanted);
                }
                changed = changed.max((sliding[0] - along).abs().max((sliding[1] - across).abs()) * stiff);
                self.touches[number].force = [pressed, sliding[0], sliding[1]];
            }
            if changed < SWEEPS.1 {
                break;
            }
        }
    }

    /// The bending of each segment by the forces. Where they exceed what turgor can, growth gives way: the rest curvature
    /// follows the actual one.
    fn curve(&mut self, n: usize, segments: &Segments, plant: &Individual) {
        for (i, bent) in self.bent[..n].iter_mut().enumerate() {
            let mut moment = [0.0; 2];
            for (touch, rows) in self.touches.iter().zip(self.work.rows.chunks_exact(3)) {
                if i <= touch.segment {
                    for (row, force) in rows.iter().zip(touch.force) {
                        moment[0] += force * row[2 * i];
                        moment[1] -= force * row[2 * i + 1];
                    }
                }
            }
            let soft = self.work.soft[i];
            let radius = radius(plant, segments.from_apex[i]);
            // One half of a cross-section that is pressed by turgor, and another that is pulled by it.
            let most = soft * 4.0 / 3.0 * TURGOR * radius * radius * radius;
            let found = (moment[0] * moment[0] + moment[1] * moment[1]).sqrt();
            let yielding = if found > most { 1.0 - most / found } else { 0.0 };
            let actual = moment.map(|moment| moment * soft / segments.length[i]);
            *bent = Bending { actual, rest: actual.map(|actual| yielding * actual) };
        }
    }
}

/// The product of two rows up to a segment, in four sums that the processor takes side by side.
fn product(one: &[f64], other: &[f64], last: usize) -> f64 {
    let (one, other) = (&one[..2 * last + 2], &other[..2 * last + 2]);
    let mut sums = [0.0; 4];
    let (ones, others) = (one.chunks_exact(4), other.chunks_exact(4));
    let rest: f64 = ones.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in ones.zip(others) {
        for part in 0..4 {
            sums[part] += a[part] * b[part];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// A vector of a segment.
fn frame(values: &[PerSegment; 3], i: usize) -> Vec3 {
    [values[0][i], values[1][i], values[2][i]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::greenhouse::bean::{Bean, Species};
    use crate::obstacle::{Obstacle, Pole};

    /// The place of a point of the rod.
    fn place(bean: &Bean, segment: usize, share: f64) -> Vec3 {
        let mut ends = Vec::new();
        bean.rod.for_each_section(|section| ends.push(section.at));
        add(ends[segment], scale(sub(ends[segment + 1], ends[segment]), share))
    }

    /// Work of all contacts on a bean under changing light, in erg: what solids took, and what they gave.
    fn work(solid: Solid, friction: f64, seed: u64) -> (f64, f64) {
        let bean = Bean::new(Species::default().draw(seed, 1.0), seed);
        let mut bean = bean.among(&[solid]).with_friction(friction);
        let (mut taken, mut given) = (0.0, 0.0);
        for substep in 0..9000 {
            let before = bean.clone();
            let powers = if substep / 1440 % 3 == 2 { [1.0, 0.0] } else { [0.0, 1.0] };
            bean.advance(&powers, 0.25);
            if bean.rod.count() != before.rod.count() {
                continue;
            }
            let Some(contact) = &bean.rod.contact else { continue };
            for touch in &contact.touches {
                let [from, to] = [&before, &bean].map(|bean| place(bean, touch.segment, touch.share));
                let work = dot(touch.pull(), sub(to, from));
                *if work < 0.0 { &mut taken } else { &mut given } += work.abs();
            }
        }
        (taken, given)
    }

    #[test]
    fn solids_do_no_work_on_balance() {
        for solid in [
            Obstacle::Disc { centre: Point::new(2.5, 9.0), radius_cm: 1.0 }.into(),
            Obstacle::Line { ends: [Point::new(0.5, 8.0), Point::new(6.0, 9.0)] }.into(),
            Pole { at: [2.0, -0.5], radius_cm: 0.3, height_cm: 30.0 }.into(),
        ] {
            for seed in 0..3 {
                let (taken, given) = work(solid, FRICTION, seed);
                let smooth = work(solid, 0.0, seed);
                println!("{solid:?}: {taken:.0} erg taken, {given:.0} given; smooth: {smooth:.0?}");
                assert!(taken > 100.0 && given < 0.25 * taken, "{taken} {given}");
                // Without friction a dent gives back what it takes, but for the curvature of a sub-step's way.
                assert!(smooth.1 < smooth.0 + 0.1 * taken, "{smooth:?}");
            }
        }
    }
}
