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
use crate::simd::{Kernel, dispatch};

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
    bent: Vec<Bending>,
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
    /// Whether it bears a force in this sub-step or may do so. Of the others the Jacobian has the normal alone.
    is_active: bool,
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

/// [`Contact::solve`] as a kernel.
struct Solve<'a> {
    contact: &'a mut Contact,
    last: usize,
    segments: &'a Segments,
    weight: f64,
    plant: &'a Individual,
    forcing: &'a Forcing,
}

impl Kernel for Solve<'_> {
    type Result = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { contact, last, segments, weight, plant, forcing } = self;
        assert!(last < MAX_NODES);
        contact.start_from_before();
        contact.relax_freely(last, segments, weight, plant, forcing);
        let is_near = |(touch, moved): (&Touch, &[f64])| touch.force[0] > 0.0 || moved[0] < 0.0;
        let mut near = contact.touches.iter().zip(contact.work.moved.chunks_exact(3)).map(is_near);
        let count = near.len();
        let Some(first) = near.position(|is_near| is_near) else { return false };
        contact.work.matrix.resize(9 * count * count, 0.0);
        for number in first..count {
            if is_near((&contact.touches[number], &contact.work.moved[3 * number..])) {
                contact.activate(number, segments);
            }
        }
        let mut active = (0..count).filter(|&number| contact.touches[number].is_active);
        let is_solved = match [active.next(), active.next(), active.next()] {
            [Some(one), None, None] => contact.relax_forces_of([one], forcing),
            [Some(one), Some(other), None] => contact.relax_forces_of([one, other], forcing),
            _ => false,
        };
        if !is_solved {
            contact.relax_forces(segments, forcing);
        }
        contact.curve(last, segments, plant);
        true
    }
}

/// A row of the Jacobian: how a place moves along an axis by both curvatures of each segment, scaled so that the product of two
/// rows is the compliance of one place to a force at the other.
type JacobianRow = [f64; 2 * MAX_NODES];

/// Working memory of a sub-step.
#[derive(Clone, Debug, Default)]
struct Work {
    before: Vec<Touch>,
    /// How far growth moves the lower end of each segment in this sub-step, in cm.
    grown: Vec<Vec3>,
    /// Growth of this sub-step over [`Segments::growing`].
    rate: f64,
    /// Square root of the bending of each segment by a unit moment in this sub-step.
    soft: Vec<f64>,
    /// Bending of each segment without contacts, in units of `soft`.
    free: Vec<f64>,
    rows: Vec<JacobianRow>,
    matrix: Vec<f64>,
    /// Movement along each axis without contacts; along a normal the gap is added.
    moved: Vec<f64>,
    /// Bending of each segment by the contacts, in units of `soft`.
    bent: Vec<f64>,
}

/// What the search for contacts reads of the segments of a rod.
pub(super) trait Shape {
    /// Length, in cm.
    fn length(&self, i: usize) -> f64;
    /// Middle, in cm.
    fn middle(&self, i: usize) -> Vec3;
    /// Direction.
    fn along(&self, i: usize) -> Vec3;
    /// Distance of the middle from the apex, in cm.
    fn apex_distance(&self, i: usize) -> f64;
}

impl Shape for Segments {
    fn length(&self, i: usize) -> f64 {
        self.length[i]
    }

    fn middle(&self, i: usize) -> Vec3 {
        frame(&self.middle, i)
    }

    #[inline(always)]
    fn along(&self, i: usize) -> Vec3 {
        cross(frame(&self.d1, i), frame(&self.d2, i))
    }

    fn apex_distance(&self, i: usize) -> f64 {
        self.from_apex[i]
    }
}

impl Contact {
    pub(super) fn new(solids: &[Solid], friction: f64) -> Self {
        Self {
            solids: solids.to_vec(),
            friction,
            waits: vec![0; solids.len()],
            touches: Vec::new(),
            bent: Vec::new(),
            work: Work::default(),
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

    /// Finds the points at which a rod of `n` segments is near solids. Returns the last segment that has one.
    pub(super) fn find(
        &mut self,
        n: usize,
        rod: &impl Shape,
        plant: &Individual,
        forcing: &Forcing,
    ) -> Option<usize> {
        std::mem::swap(&mut self.work.before, &mut self.touches);
        self.touches.clear();
        for number in 0..self.solids.len() {
            self.find_of(number, n, rod, plant, forcing);
        }
        self.touches.iter().map(|touch| touch.segment).max()
    }

    /// Finds the forces at the points of [`Self::find`]. Returns whether there are any; then [`Self::bending`] says how they
    /// bend the rod.
    ///
    /// Values of `segments` up to `last` are those of this sub-step; `weight` is the sum of [`Segments::growing`].
    pub(super) fn solve(
        &mut self,
        last: usize,
        segments: &Segments,
        weight: f64,
        plant: &Individual,
        forcing: &Forcing,
    ) -> bool {
        dispatch(Solve { contact: self, last, segments, weight, plant, forcing })
    }

    /// How the contacts bend the segments; not those beyond the last contact.
    pub(super) fn bending(&self) -> &[Bending] {
        &self.bent
    }

    /// Finds the points of the rod that are near one solid.
    fn find_of(&mut self, number: usize, n: usize, rod: &impl Shape, plant: &Individual, forcing: &Forcing) {
        if self.waits[number] > 0 {
            self.waits[number] -= 1;
            return;
        }
        let thickest = plant.stem.radius_apex.max(plant.stem.radius_base);
        // Beside a solid that it touched the rod is looked at in each sub-step.
        let left = if self.work.before.iter().any(|touch| touch.solid == number) { 0.0 } else { LEFT };
        // The length of stem ahead of which no point is near, as the last one looked at is far.
        let (mut safe, mut nearest) = (0.0, f64::INFINITY);
        for i in 0..n {
            let length = rod.length(i);
            if safe >= length {
                safe -= length;
                continue;
            }
            let half = 0.5 * length;
            let gap = solid::distance(&self.solids[number], rod.middle(i)).0 - thickest;
            let clear = (gap - REACH_CM).min((1.0 - left) * gap) / SLACK;
            nearest = f64::min(nearest, gap - SLACK * clear.max(half));
            safe = (clear - half).max(0.0);
            if gap - SLACK * half < REACH_CM {
                self.touch(number, i, n, rod, plant);
            }
        }
        // As an integer it saturates.
        self.waits[number] = ((nearest - REACH_CM) / (FASTEST * forcing.dt)).max(0.0) as u32;
    }

    /// Adds the point of a segment that is nearest to a solid, if it is near. A shared end belongs to the upper segment.
    fn touch(&mut self, number: usize, i: usize, n: usize, rod: &impl Shape, plant: &Individual) {
        let (along, length) = (rod.along(i), rod.length(i));
        let middle = rod.middle(i);
        let at = |share: f64| add(middle, scale(along, (share - 0.5) * length));
        // A distance from a convex body is convex along a line: its slope changes sign once.
        let look = |share: f64| {
            let (distance, normal) = solid::distance(&self.solids[number], at(share));
            (distance, normal, dot(normal, along))
        };
        let (distance, _, slope) = look(0.5);
        // So is no point of the segment nearer, as perspective changes the slope little.
        let thickest = plant.stem.radius_apex.max(plant.stem.radius_base);
        if distance - (slope.abs() + SLACK - 1.0) * 0.5 * length - thickest >= REACH_CM {
            return;
        }
        let beyond = if slope < 0.0 { 1.0 } else { 0.0 };
        let end = look(beyond);
        let (share, (distance, normal, slope)) = if slope < 0.0 && end.2 <= 0.0 {
            if i + 1 < n {
                return;
            }
            (1.0, end)
        } else if slope >= 0.0 && end.2 >= 0.0 {
            if i == 0 {
                return;
            }
            (0.0, end)
        } else {
            let (mut low, mut high) = ((0.5, slope), (beyond, end.2));
            if slope >= 0.0 {
                (low, high) = (high, low);
            }
            for _ in 1..HALVINGS {
                let share = 0.5 * (low.0 + high.0);
                let slope = look(share).2;
                *if slope < 0.0 { &mut low } else { &mut high } = (share, slope);
            }
            let share = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
            (share, look(share))
        };
        let from_apex = (rod.apex_distance(i) - (share - 0.5) * length).max(0.0);
        let gap = distance - radius(plant, from_apex);
        if gap < REACH_CM {
            let other = if normal[2].abs() < 0.7 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
            let sideways = sub(other, scale(normal, dot(other, normal)));
            let tangent = normalize_or(sub(along, scale(normal, slope)), normalize_or(sideways, other));
            let axes = [normal, tangent, cross(normal, tangent)];
            let (at, force) = (at(share), [0.0; 3]);
            self.touches.push(Touch {
                solid: number,
                segment: i,
                share,
                at,
                gap,
                axes,
                force,
                is_active: false,
            });
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

    /// Computes how the points near solids would move along the normals without forces.
    #[inline(always)]
    fn relax_freely(
        &mut self,
        last: usize,
        segments: &Segments,
        weight: f64,
        plant: &Individual,
        forcing: &Forcing,
    ) {
        let Work { grown, soft, free, rate, rows, moved, .. } = &mut self.work;
        *rate = forcing.dt * forcing.growth / weight;
        grown.resize(last + 1, [0.0; 3]);
        soft.resize(last + 1, 0.0);
        free.resize(2 * last + 2, 0.0);
        let values = soft.iter_mut().zip(free.chunks_exact_mut(2));
        for (i, (soft, free)) in values.enumerate() {
            let (length, share) = (segments.length[i], forcing.relaxed_share);
            let compliance = segments.compliance(i, plant);
            let root = (share * compliance * length).sqrt();
            let moment = frame(&segments.moment, i);
            let [bending1, bending2] = [&segments.d2, &segments.d1].map(|axis| dot(moment, frame(axis, i)));
            let bent1 = share * (segments.rest1[i] + compliance * bending1 - segments.k1[i]);
            let bent2 = share * (segments.rest2[i] - compliance * bending2 - segments.k2[i]);
            *soft = root;
            free.copy_from_slice(&[bent1 * length / root, -bent2 * length / root]);
        }
        let mut end = [0.0; 3];
        for (i, grown) in grown.iter_mut().enumerate() {
            *grown = end;
            end = add(end, scale(segments.along(i), *rate * segments.growing[i]));
        }
        let size = 3 * self.touches.len();
        if rows.len() < size {
            rows.resize(size, [0.0; 2 * MAX_NODES]);
        }
        moved.clear();
        moved.resize(size, 0.0);
        for number in 0..self.touches.len() {
            self.fill(number, 0, segments);
            let touch = &self.touches[number];
            self.work.moved[3 * number] += touch.gap.max(-CORRECTION_CM - touch.force[0] / STIFFNESS);
        }
    }

    /// Computes the row of the Jacobian of an axis of a contact, and the movement along it without forces.
    #[inline(always)]
    fn fill(&mut self, number: usize, axis: usize, segments: &Segments) {
        let Work { grown, soft, free, rate, rows, moved, .. } = &mut self.work;
        let place = 3 * number + axis;
        let (touch, row) = (&self.touches[number], &mut rows[place]);
        let (own, at, axis) = (touch.segment, touch.at, touch.axes[axis]);
        {
            let [middle, d1, d2] = [&segments.middle, &segments.d1, &segments.d2]
                .map(|values| values.each_ref().map(|values| &values[..own]));
            let soft = &soft[..own];
            for (j, row) in row[..2 * own].chunks_exact_mut(2).enumerate() {
                let of = |values: &[&[f64]; 3]| [values[0][j], values[1][j], values[2][j]];
                let arm = sub(at, of(&middle));
                row[0] = dot(axis, scale(cross(of(&d2), arm), soft[j]));
                row[1] = dot(axis, scale(cross(of(&d1), arm), soft[j]));
            }
        }
        // A segment bends by halves at both of its ends.
        let along = segments.along(own);
        let arm = scale(along, 0.5 * touch.share * segments.length[own]);
        row[2 * own] = dot(axis, scale(cross(frame(&segments.d2, own), arm), soft[own]));
        row[2 * own + 1] = dot(axis, scale(cross(frame(&segments.d1, own), arm), soft[own]));
        let grown = add(grown[own], scale(along, touch.share * *rate * segments.growing[own]));
        moved[place] = product(row, free, own) + dot(axis, grown);
    }

    /// Lets a contact bear a force: computes the rest of its Jacobian, and its compliances.
    #[inline(always)]
    fn activate(&mut self, number: usize, segments: &Segments) {
        self.touches[number].is_active = true;
        self.fill(number, 1, segments);
        self.fill(number, 2, segments);
        let Work { rows, matrix, .. } = &mut self.work;
        let size = 3 * self.touches.len();
        for (place, other) in self.touches.iter().enumerate() {
            let last = self.touches[number].segment.min(other.segment);
            for axis in 0..if other.is_active { 3 } else { 1 } {
                for own in 0..if place == number { axis + 1 } else { 3 } {
                    let (one, other) = (3 * number + own, 3 * place + axis);
                    let compliance = product(&rows[one], &rows[other], last);
                    (matrix[one * size + other], matrix[other * size + one]) = (compliance, compliance);
                }
            }
        }
    }

    /// [`Self::relax_forces`] for `N` contacts that alone are active: the same bits, sooner. Returns whether they alone stay so;
    /// else nothing has changed.
    #[inline(always)]
    fn relax_forces_of<const N: usize>(&mut self, numbers: [usize; N], forcing: &Forcing) -> bool {
        let size = 3 * self.touches.len();
        let compliances = |row: usize| {
            let row = &self.work.matrix[row * size..(row + 1) * size];
            let mut compliances = [[0.0; 3]; N];
            for (compliances, number) in compliances.iter_mut().zip(numbers) {
                compliances.copy_from_slice(&row[3 * number..3 * number + 3]);
            }
            compliances
        };
        let movement = |moved: f64, compliances: &[Vec3; N], forces: &[Vec3; N]| {
            let mut sum = 0.0;
            for (compliances, forces) in compliances.iter().zip(forces) {
                for axis in 0..3 {
                    sum += compliances[axis] * forces[axis];
                }
            }
            moved + sum
        };
        let moved = &self.work.moved[..];
        let rows = numbers.map(|number| [0, 1, 2].map(|axis| compliances(3 * number + axis)));
        let freely = numbers.map(|number| [0, 1, 2].map(|axis| moved[3 * number + axis]));
        let mut forces = numbers.map(|number| self.touches[number].force);
        let goes_in = |forces: &[Vec3; N]| {
            (0..self.touches.len()).any(|other| {
                let row = 3 * other;
                !self.touches[other].is_active && movement(moved[row], &compliances(row), forces) < 0.0
            })
        };
        if goes_in(&forces) {
            return false;
        }
        let creep = CREEP * forcing.dt;
        for _ in 0..SWEEPS.0 {
            let mut changed = 0.0_f64;
            for place in 0..N {
                let (rows, freely) = (&rows[place], &freely[place]);
                let [normal, along, across] = forces[place];
                let stiff = rows[0][place][0] + 1.0 / STIFFNESS;
                let residue = movement(freely[0], &rows[0], &forces) + normal / STIFFNESS;
                let pressed = (normal - residue / stiff).max(0.0);
                forces[place][0] = pressed;
                changed = changed.max((pressed - normal).abs() * stiff);

                let stiff = rows[1][place][1].max(rows[2][place][2]) + creep;
                let aside = |axis: usize, force: f64| {
                    force - (movement(freely[axis], &rows[axis], &forces) + creep * force) / stiff
                };
                let aside = [aside(1, along), aside(2, across)];
                let [along_now, across_now] = self.held_by_friction(pressed, aside);
                changed = changed.max((along_now - along).abs().max((across_now - across).abs()) * stiff);
                forces[place] = [pressed, along_now, across_now];
                if goes_in(&forces) {
                    return false;
                }
            }
            if changed < SWEEPS.1 {
                break;
            }
        }
        for (number, force) in numbers.into_iter().zip(forces) {
            self.touches[number].force = force;
        }
        true
    }

    /// Coulomb: friction holds up to a share of the pressure.
    #[inline(always)]
    fn held_by_friction(&self, pressed: f64, aside: [f64; 2]) -> [f64; 2] {
        let (most, wanted) = (self.friction * pressed, (aside[0] * aside[0] + aside[1] * aside[1]).sqrt());
        if wanted > most { [aside[0] * most / wanted, aside[1] * most / wanted] } else { aside }
    }

    /// Projected Gauss-Seidel: brings all forces to balance.
    fn relax_forces(&mut self, segments: &Segments, forcing: &Forcing) {
        let size = 3 * self.touches.len();
        let creep = CREEP * forcing.dt;
        for _ in 0..SWEEPS.0 {
            let mut changed = 0.0_f64;
            for number in 0..self.touches.len() {
                let row = 3 * number;
                let [normal, along, across] = self.touches[number].force;
                let residue = self.movement(row) + normal / STIFFNESS;
                if !self.touches[number].is_active {
                    if residue >= 0.0 {
                        continue;
                    }
                    self.activate(number, segments);
                }
                let own = |axis: usize| self.work.matrix[(row + axis) * size + row + axis];
                let stiff = own(0) + 1.0 / STIFFNESS;
                let pressed = (normal - residue / stiff).max(0.0);
                changed = changed.max((pressed - normal).abs() * stiff);

                let stiff = own(1).max(own(2)) + creep;
                self.touches[number].force[0] = pressed;
                let aside = [(1, along), (2, across)]
                    .map(|(axis, force)| force - (self.movement(row + axis) + creep * force) / stiff);
                let [along_now, across_now] = self.held_by_friction(pressed, aside);
                changed = changed.max((along_now - along).abs().max((across_now - across).abs()) * stiff);
                self.touches[number].force = [pressed, along_now, across_now];
            }
            if changed < SWEEPS.1 {
                break;
            }
        }
    }

    /// Movement along an axis of a contact under the forces, in cm.
    #[inline]
    fn movement(&self, row: usize) -> f64 {
        let size = 3 * self.touches.len();
        let compliances = self.work.matrix[row * size..(row + 1) * size].chunks_exact(3);
        let mut sum = 0.0;
        for (touch, compliances) in self.touches.iter().zip(compliances) {
            if touch.is_active {
                for (compliance, force) in compliances.iter().zip(touch.force) {
                    sum += compliance * force;
                }
            }
        }
        self.work.moved[row] + sum
    }

    /// The bending of each segment by the forces. Where they exceed what turgor can, growth gives way: the rest curvature
    /// follows the actual one.
    #[inline(always)]
    fn curve(&mut self, last: usize, segments: &Segments, plant: &Individual) {
        let Work { rows, soft, bent, .. } = &mut self.work;
        bent.clear();
        bent.resize(2 * last + 2, 0.0);
        for (touch, rows) in self.touches.iter().zip(rows.chunks_exact(3)) {
            if touch.is_active {
                let bent = &mut bent[..2 * touch.segment + 2];
                for (row, force) in rows.iter().zip(touch.force) {
                    for (bent, row) in bent.iter_mut().zip(row) {
                        *bent += force * row;
                    }
                }
            }
        }
        self.bent.clear();
        for (i, bent) in bent.chunks_exact(2).enumerate() {
            let soft = soft[i];
            let radius = radius(plant, segments.from_apex[i]);
            // One half of a cross-section that is pressed by turgor, and another that is pulled by it.
            let most = soft * 4.0 / 3.0 * TURGOR * radius * radius * radius;
            let found = (bent[0] * bent[0] + bent[1] * bent[1]).sqrt();
            let yielding = if found > most { 1.0 - most / found } else { 0.0 };
            let actual = [bent[0], -bent[1]].map(|bent| bent * soft / segments.length[i]);
            self.bent.push(Bending { actual, rest: actual.map(|actual| yielding * actual) });
        }
    }
}

/// The product of two rows up to a segment, in four sums that the processor takes side by side.
#[inline(always)]
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
#[inline(always)]
fn frame(values: &[PerSegment; 3], i: usize) -> Vec3 {
    [values[0][i], values[1][i], values[2][i]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::greenhouse::bean::{Bean, Species};
    use crate::lamps::MAX_LAMPS;
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
            for seed in 0..2 {
                let (taken, given) = work(solid, FRICTION, seed);
                let smooth = work(solid, 0.0, seed);
                println!("{solid:?}: {taken:.0} erg taken, {given:.0} given; smooth: {smooth:.0?}");
                assert!(taken > 100.0 && given < 0.25 * taken, "{taken} {given}");
                // Without friction a dent gives back what it takes, but for the curvature of a sub-step's way.
                assert!(smooth.1 < smooth.0 + 0.1 * taken, "{smooth:?}");
            }
        }
    }

    #[test]
    fn few_contacts_are_solved_as_many_are() {
        let disc = Obstacle::Disc { centre: Point::new(2.5, 9.0), radius_cm: 1.0 }.into();
        let bar = Obstacle::Line { ends: [Point::new(0.5, 8.0), Point::new(6.0, 9.0)] }.into();
        let pole = Pole { at: [2.0, -0.5], radius_cm: 0.3, height_cm: 30.0 }.into();
        let mut solved = [0; 3];
        for (seed, solids) in (0..).zip([&[disc][..], &[bar], &[pole], &[disc, pole], &[bar, pole]]) {
            let mut bean = Bean::new(Species::default().draw(seed, 1.0), seed).among(solids);
            for tick in 0..400_u32 {
                bean.advance(&[0.0, 1.0], 5.0);
                let Some(contact) = &bean.rod.contact else { continue };
                let active: Vec<usize> =
                    (0..contact.touches.len()).filter(|&number| contact.touches[number].is_active).collect();
                let mut few = contact.clone();
                for (touch, push) in few.touches.iter_mut().filter(|touch| touch.is_active).zip([30.0, 100.0])
                {
                    touch.force = [push * f64::from(tick % 5), push * f64::from(tick % 3) - push, push];
                }
                let mut many = few.clone();
                let forcing = forcing();
                let is_solved = match active[..] {
                    [one] => few.relax_forces_of([one], &forcing),
                    [one, other] => few.relax_forces_of([one, other], &forcing),
                    _ => false,
                };
                if is_solved {
                    many.relax_forces(&bean.rod.segments, &forcing);
                    let forces = |contact: &Contact| {
                        contact.touches.iter().map(|touch| touch.force).collect::<Vec<_>>()
                    };
                    assert_eq!(forces(&few), forces(&many));
                    solved[active.len()] += 1;
                }
            }
        }
        assert!(solved[1] > 100 && solved[2] > 100, "{solved:?}");
    }

    /// Any forcing with the sub-step of a bean.
    fn forcing() -> Forcing {
        Forcing {
            dt: 15.0 / 3600.0,
            age_h: 0.0,
            lamps: [[0.0; 3]; MAX_LAMPS],
            powers: [0.0; MAX_LAMPS],
            growth: 0.0,
            gain: 0.0,
            zone: 0.0,
            straightening: 0.0,
            leaf_mass: 0.0,
            relaxed_share: 0.1,
        }
    }
}
