//! Contact of the rod with solids: the forces that keep it out, and Coulomb friction.
//!
//! In: the rod within a sub-step, before it relaxes. Out: how the forces of all contacts change its curvatures in this sub-step.
//! The idea: the elastic relaxation of a sub-step is linear in the forces, so the least forces that leave no point of
//! contact inside a solid are the solution of a complementarity problem (Signorini's condition),
//!
//! `0 <= f_n,  0 <= gap + J dk(f),  f_n (gap + J dk(f)) = 0,  |f_t| <= friction f_n`
//!
//! with the gap, which a dent makes negative, and the Jacobian `J` of the places of contact over the curvatures. Projected
//! Gauss-Seidel solves it, and starts from the forces of the sub-step before. So a contact is as stiff as tissue and yet
//! stable at any sub-step: the force is implicit.
//!
//! # References
//! Jean 1999, doi:10.1016/S0045-7825(98)00383-1: contact and Coulomb friction by an implicit step and projected Gauss-Seidel.

use core::ops::Range;

use tropism::math::vector::{Vec3, add, cross, dot, norm, normalize_or, scale, sub};
use tropism::obstacle::Solid;
use tropism::simd::{Kernel, dispatch};

use super::MEGAPASCAL;
use super::{MAX_SEGMENT_CM, MAX_SEGMENTS, radius};
use crate::solid;
use crate::{ContactPoint, Individual};

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
/// How much faster than one moves the distance from a solid may change: perspective bends the flanks of obstacles. Chosen
/// by hand.
const SLACK: f64 = 1.3;
/// Most sweeps of the solver, and the change of all gaps in cm below which it ends. Chosen by measurement: more change the
/// forces in the fourth digit.
const SWEEPS: (usize, f64) = (40, 1e-6);
/// Most looks for the point of a segment nearest to a solid, and the slope of the distance there at which they end. Chosen: the
/// distance then errs by some nanometres from a disc.
const LOOKS: (usize, f64) = (3, 1e-3);
/// Least square of the cosine of an angle whose tangent is taken. Chosen: it bounds the tangent by 1000.
const STEEPEST: f64 = 1e-6;

/// Solids around a rod, and its contacts with them.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    pub(super) solids: Vec<Solid>,
    pub(super) friction: f64,
    /// Sub-steps in which no point of the rod can come near each solid.
    waits: Vec<u32>,
    /// The last look at each segment from each solid.
    looks: Vec<Vec<Look>>,
    /// Contacts of the last sub-step.
    touches: Vec<Touch>,
    work: Work,
}

/// A look at a segment from a solid.
#[derive(Clone, Copy, Debug, Default)]
struct Look {
    /// Where the middle of the segment was, in cm.
    middle: Vec3,
    /// How far it may move before a point of the segment can be near, in cm; 0 and below if one may be.
    free: f64,
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

    /// Distance from another along the stem, counted in segments.
    fn apart(&self, other: &Self) -> f64 {
        ((self.segment as f64 - other.segment as f64) + (self.share - other.share)).abs()
    }
}

/// [`Contact::solve`] as a kernel.
struct Solve<'a> {
    contact: &'a mut Contact,
    last: usize,
    segments: &'a Chain,
    plant: &'a Individual,
    dt: f64,
}

impl Kernel for Solve<'_> {
    type Result = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { contact, last, segments, plant, dt } = self;
        assert!(last < MAX_SEGMENTS);
        contact.work.last = last;
        contact.start_from_before();
        contact.relax_freely(last, segments);
        let count = contact.touches.len();
        contact.work.blocks.resize(count * count, [[0.0; 3]; 3]);
        contact.work.active.clear();
        for number in 0..count {
            if contact.touches[number].force[0] > 0.0 || contact.work.moved[number][0] < 0.0 {
                contact.activate(number, segments);
            }
        }
        if contact.work.active.is_empty() {
            return false;
        }
        loop {
            contact.relax_forces(dt);
            contact.load(last);
            // One that the forces of the others press into a solid bears a force, too.
            let goes_in = |number: &usize| !contact.work.active.contains(number) && contact.goes_in(*number);
            let Some(further) = (0..count).find(goes_in) else { break };
            contact.activate(further, segments);
        }
        contact.curve(last, segments, plant);
        true
    }
}

/// Segments that are computed side by side. Chosen: two vectors of AVX2.
pub(super) const WIDTH: usize = 8;
/// Parts of so many segments.
const PARTS: usize = MAX_SEGMENTS.div_ceil(WIDTH);

/// One value for each segment, in parts that are computed at once. In the part of the last segment, further ones have 0.
type Row = [[f64; WIDTH]; PARTS];

/// A row of the Jacobian: how a place moves along an axis by the bending of each segment towards d1 and d2.
type JacobianRow = [Row; 2];

/// Working memory of a sub-step.
#[derive(Clone, Debug, Default)]
struct Work {
    before: Vec<Touch>,
    /// The last segment near a solid.
    last: usize,
    /// How far growth moves the lower end of each segment in this sub-step, in cm.
    grown: Vec<Vec3>,
    /// Bending of each segment by a unit moment in this sub-step.
    soft: Row,
    /// Bending of each segment without contacts.
    free: [Row; 2],
    /// Of each point near a solid the rows of its axes; that of the normal alone before it is active.
    rows: Vec<[JacobianRow; 3]>,
    /// Movement along its axes without contacts; along the normal the gap is added.
    moved: Vec<Vec3>,
    /// The points that bear a force in this sub-step or may do so.
    active: Vec<usize>,
    /// Compliance of each active point to forces at another: how far it moves along each axis.
    blocks: Vec<[Vec3; 3]>,
    /// Movement of the active points under the forces.
    residues: Vec<Vec3>,
    /// Moment of the forces about each segment, towards d1 and d2.
    moments: [Row; 2],
    /// How the forces change the curvatures of each segment, and its rest curvatures.
    bent: [Row; 4],
}

/// One value for each segment.
type PerSegment = [f64; PARTS * WIDTH];

/// The segments of one plant in a sub-step.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// Length at the beginning, in cm, and elongation.
    pub(super) length: PerSegment,
    pub(super) elongation: PerSegment,
    /// Material frame at the middle, direction of the segment, and place of the middle, in cm.
    pub(super) d1: [PerSegment; 3],
    pub(super) d2: [PerSegment; 3],
    pub(super) along: [PerSegment; 3],
    pub(super) middle: [PerSegment; 3],
    /// Distance of the middle from the apex, in cm.
    pub(super) from_apex: PerSegment,
    /// Change of curvature by a unit moment, in 1/cm for each dyn cm, and by elastic relaxation towards d1 and d2, in 1/cm.
    pub(super) softness: PerSegment,
    pub(super) relaxing: [PerSegment; 2],
}

impl Chain {
    pub(super) fn new() -> Self {
        const NONE: PerSegment = [0.0; PARTS * WIDTH];
        Self {
            length: NONE,
            elongation: NONE,
            d1: [NONE; 3],
            d2: [NONE; 3],
            along: [NONE; 3],
            middle: [NONE; 3],
            from_apex: NONE,
            softness: NONE,
            relaxing: [NONE; 2],
        }
    }
}

impl Contact {
    pub(super) fn new(solids: &[Solid], friction: f64) -> Self {
        Self {
            solids: solids.to_vec(),
            friction,
            waits: vec![0; solids.len()],
            looks: vec![Vec::new(); solids.len()],
            touches: Vec::new(),
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
        self.looks.iter_mut().for_each(Vec::clear);
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

    /// The lowest `count` segments are gone. None of them is touched.
    pub(super) fn drop_lowest(&mut self, count: usize) {
        self.looks.iter_mut().for_each(|looks| drop(looks.drain(..count.min(looks.len()))));
        self.touches.iter_mut().for_each(|touch| touch.segment -= count);
    }

    /// Whether a segment presses on a solid.
    pub(super) fn presses(&self, segment: usize) -> bool {
        self.touches.iter().any(|touch| touch.segment == segment && touch.force[0] > 0.0)
    }

    /// The topmost point that bears a force: its segment and where in it, from 0 to 1.
    pub(super) fn topmost(&self) -> Option<(usize, f64)> {
        let pressed = self.touches.iter().filter(|touch| touch.force[0] > 0.0);
        pressed
            .map(|touch| (touch.segment, touch.share))
            .max_by(|one, other| one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)))
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

    /// Finds the points at which the mobile segments of a rod are near solids, and their forces in a sub-step of `dt` hours.
    /// Returns whether there are any; then [`Self::bending`] says how they bend the rod.
    pub(super) fn press(
        &mut self,
        mobile: Range<usize>,
        segments: &Chain,
        plant: &Individual,
        dt: f64,
    ) -> bool {
        std::mem::swap(&mut self.work.before, &mut self.touches);
        self.touches.clear();
        for number in 0..self.solids.len() {
            self.find_of(number, mobile.clone(), segments, plant, dt);
        }
        let last = self.touches.iter().map(|touch| touch.segment).max();
        last.is_some_and(|last| dispatch(Solve { contact: self, last, segments, plant, dt }))
    }

    /// How the contacts change the curvatures towards d1 and d2 of the segments up to the last contact in this sub-step, and
    /// their rest curvatures, in 1/cm.
    pub(super) fn bending(&self) -> [&[f64]; 4] {
        self.work.bent.each_ref().map(|bent| &bent.as_flattened()[..=self.work.last])
    }

    /// Finds the points of the rod that are near one solid.
    fn find_of(&mut self, number: usize, mobile: Range<usize>, rod: &Chain, plant: &Individual, dt: f64) {
        if self.waits[number] > 0 {
            self.waits[number] -= 1;
            return;
        }
        self.looks[number].resize(mobile.end, Look::default());
        let thickest = plant.stem.radius_apex.max(plant.stem.radius_base);
        // How far any segment is from being near.
        let mut least = f64::INFINITY;
        for i in mobile.clone() {
            let middle = frame(&rod.middle, i);
            let look = &mut self.looks[number][i];
            let mut free = look.free - norm(sub(middle, look.middle));
            if free <= 0.0 {
                let (distance, normal) = solid::distance(&self.solids[number], middle);
                // A segment grows meanwhile, at most to the length at which it splits.
                let half = 0.5 * rod.length[i].max(MAX_SEGMENT_CM);
                free = (distance - thickest - REACH_CM) / SLACK - half;
                *look = Look { middle, free };
                if free <= 0.0 {
                    self.touch(number, i, &mobile, rod, plant, (distance, normal));
                }
            }
            least = least.min(free);
        }
        // As an integer it saturates.
        self.waits[number] = (least / (FASTEST * dt)).max(0.0) as u32;
    }

    /// Adds the point of a segment that is nearest to a solid, if it is near. A shared end belongs to the upper segment.
    /// `of_middle` is the distance of its middle, and the direction in which it grows.
    fn touch(
        &mut self,
        number: usize,
        i: usize,
        mobile: &Range<usize>,
        rod: &Chain,
        plant: &Individual,
        of_middle: (f64, Vec3),
    ) {
        let (along, length) = (frame(&rod.along, i), rod.length[i]);
        let middle = frame(&rod.middle, i);
        let at = |share: f64| add(middle, scale(along, (share - 0.5) * length));
        // A distance from a convex body is convex along a line: its slope changes sign once.
        let with_slope = |(distance, normal): (f64, Vec3)| (distance, normal, dot(normal, along));
        let look = |share: f64| with_slope(solid::distance(&self.solids[number], at(share)));
        let (distance, _, slope) = with_slope(of_middle);
        // So is no point of the segment nearer, as perspective changes the slope little.
        let thickest = plant.stem.radius_apex.max(plant.stem.radius_base);
        if distance - (slope.abs() + SLACK - 1.0) * 0.5 * length - thickest >= REACH_CM {
            return;
        }
        let beyond = if slope < 0.0 { 1.0 } else { 0.0 };
        let end = look(beyond);
        let (share, (distance, normal, slope)) = if slope < 0.0 && end.2 <= 0.0 {
            if i + 1 < mobile.end {
                return;
            }
            (1.0, end)
        } else if slope >= 0.0 && end.2 >= 0.0 {
            // If the segment below has a nearest point of its own, its end is none.
            let is_below = |touch: &Touch| touch.solid == number && touch.segment + 1 == i;
            if i == mobile.start || self.touches.last().is_some_and(is_below) {
                return;
            }
            (0.0, end)
        } else {
            // The tangent of the angle that has this sine: along a line past a point it is linear.
            let tangent = |slope: f64| slope / (1.0 - slope * slope).max(STEEPEST).sqrt();
            let (mut low, mut high) = ((0.5, tangent(slope)), (beyond, tangent(end.2)));
            if slope >= 0.0 {
                (low, high) = (high, low);
            }
            let mut looks = 0;
            loop {
                let share = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
                let found = look(share);
                looks += 1;
                if found.2.abs() < LOOKS.1 || looks == LOOKS.0 {
                    break (share, found);
                }
                *if found.2 < 0.0 { &mut low } else { &mut high } = (share, tangent(found.2));
            }
        };
        let from_apex = (rod.from_apex[i] - (share - 0.5) * length).max(0.0);
        let gap = distance - radius(plant, from_apex);
        if gap < REACH_CM {
            let other = if normal[2].abs() < 0.7 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
            let sideways = sub(other, scale(normal, dot(other, normal)));
            let tangent = normalize_or(sub(along, scale(normal, slope)), normalize_or(sideways, other));
            let axes = [normal, tangent, cross(normal, tangent)];
            let (at, force) = (at(share), [0.0; 3]);
            self.touches.push(Touch { solid: number, segment: i, share, at, gap, axes, force });
        }
    }

    /// Gives each contact the force of the nearest one of the sub-step before.
    fn start_from_before(&mut self) {
        for touch in &mut self.touches {
            let same = self.work.before.iter_mut().filter(|other| other.solid == touch.solid);
            let nearest = same.min_by(|one, other| one.apart(touch).total_cmp(&other.apart(touch)));
            if let Some(nearest) = nearest.filter(|other| other.apart(touch) < 1.0) {
                let pull = nearest.pull();
                touch.force = touch.axes.map(|axis| dot(axis, pull));
                touch.force[0] = touch.force[0].max(0.0);
                nearest.force = [0.0; 3];
            }
        }
    }

    /// Computes how the points near solids would move along the normals without forces.
    #[inline(always)]
    fn relax_freely(&mut self, last: usize, segments: &Chain) {
        let Work { grown, soft, free: [free1, free2], rows, moved, .. } = &mut self.work;
        for part in 0..=last / WIDTH {
            for lane in 0..WIDTH {
                let i = part * WIDTH + lane;
                let length = segments.length[i];
                soft[part][lane] = segments.softness[i] * length;
                free1[part][lane] = segments.relaxing[0][i] * length;
                free2[part][lane] = -segments.relaxing[1][i] * length;
            }
        }
        [soft, free1, free2].into_iter().for_each(|row| end(row, last));
        grown.clear();
        let mut way = [0.0; 3];
        for i in 0..=last {
            grown.push(way);
            way = add(way, scale(frame(&segments.along, i), segments.elongation[i]));
        }
        let count = self.touches.len();
        if rows.len() < count {
            rows.resize(count, [[[[0.0; WIDTH]; PARTS]; 2]; 3]);
        }
        moved.resize(count, [0.0; 3]);
        for number in 0..count {
            self.fill(number, 0, segments);
            let touch = &self.touches[number];
            self.work.moved[number][0] += touch.gap.max(-CORRECTION_CM - touch.force[0] / STIFFNESS);
        }
    }

    /// Computes the row of the Jacobian of an axis of a point, and the movement along it without forces.
    #[inline(always)]
    fn fill(&mut self, number: usize, axis: usize, segments: &Chain) {
        let Work { grown, free: [free1, free2], rows, moved, .. } = &mut self.work;
        let (touch, [row1, row2]) = (&self.touches[number], &mut rows[number][axis]);
        let (own, at, moved) = (touch.segment, touch.at, &mut moved[number][axis]);
        let axis = touch.axes[axis];
        assert!(own < MAX_SEGMENTS);
        for part in 0..=own / WIDTH {
            for lane in 0..WIDTH {
                let i = part * WIDTH + lane;
                let turn = cross(sub(at, frame(&segments.middle, i)), axis);
                row1[part][lane] = dot(turn, frame(&segments.d2, i));
                row2[part][lane] = dot(turn, frame(&segments.d1, i));
            }
        }
        // A segment bends by halves at both of its ends.
        let along = frame(&segments.along, own);
        let turn = cross(scale(along, 0.5 * touch.share * segments.length[own]), axis);
        row1[own / WIDTH][own % WIDTH] = dot(turn, frame(&segments.d2, own));
        row2[own / WIDTH][own % WIDTH] = dot(turn, frame(&segments.d1, own));
        end(row1, own);
        end(row2, own);
        let mut sums = [0.0; WIDTH];
        for part in 0..=own / WIDTH {
            for lane in 0..WIDTH {
                sums[lane] += row1[part][lane] * free1[part][lane] + row2[part][lane] * free2[part][lane];
            }
        }
        let grown = add(grown[own], scale(along, touch.share * segments.elongation[own]));
        *moved = total(sums) + dot(axis, grown);
    }

    /// Lets a point bear a force: computes the rest of its Jacobian, and its compliances.
    #[inline(always)]
    fn activate(&mut self, number: usize, segments: &Chain) {
        self.fill(number, 1, segments);
        self.fill(number, 2, segments);
        let Work { active, rows, soft, blocks, .. } = &mut self.work;
        let count = self.touches.len();
        active.push(number);
        for &other in &*active {
            let last = self.touches[number].segment.min(self.touches[other].segment);
            let block = compliances(&rows[number], &rows[other], soft, last);
            blocks[number * count + other] = block;
            blocks[other * count + number] = [0, 1, 2].map(|row| block.map(|of_one| of_one[row]));
        }
    }

    /// Projected Gauss-Seidel: brings the forces at the active points to balance.
    #[inline(always)]
    fn relax_forces(&mut self, dt: f64) {
        let (friction, creep, count) = (self.friction, CREEP * dt, self.touches.len());
        let Work { active, moved, blocks, residues, .. } = &mut self.work;
        residues.clear();
        residues.resize(count, [0.0; 3]);
        for &number in &*active {
            residues[number] = active.iter().fold(moved[number], |movement, &other| {
                add(movement, product(&blocks[number * count + other], self.touches[other].force))
            });
        }
        for _ in 0..SWEEPS.0 {
            let mut changed = 0.0_f64;
            for &number in &*active {
                let own = &blocks[number * count + number];
                let force = self.touches[number].force;
                let residue = residues[number];
                let stiff = own[0][0] + 1.0 / STIFFNESS;
                let pressed = (force[0] - (residue[0] + force[0] / STIFFNESS) / stiff).max(0.0);
                let change = pressed - force[0];
                changed = changed.max(change.abs() * stiff);

                let stiff = own[1][1].max(own[2][2]) + creep;
                let aside = [1, 2].map(|axis| {
                    force[axis] - (residue[axis] + own[axis][0] * change + creep * force[axis]) / stiff
                });
                let held = held_by_friction(friction * pressed, aside);
                let change = [change, held[0] - force[1], held[1] - force[2]];
                changed = changed.max(change[1].abs().max(change[2].abs()) * stiff);
                self.touches[number].force = [pressed, held[0], held[1]];
                // Most points that could bear a force bear none.
                if change == [0.0; 3] {
                    continue;
                }
                for &other in &*active {
                    residues[other] = add(residues[other], product(&blocks[other * count + number], change));
                }
            }
            if changed < SWEEPS.1 {
                break;
            }
        }
    }

    /// Computes the moments of the forces about each segment.
    #[inline(always)]
    fn load(&mut self, last: usize) {
        let Work { rows, active, moments: [moment1, moment2], .. } = &mut self.work;
        for moments in [&mut *moment1, moment2] {
            moments[..=last / WIDTH].fill([0.0; WIDTH]);
        }
        for &number in &*active {
            let touch = &self.touches[number];
            for (row, force) in rows[number].iter().zip(touch.force) {
                for part in 0..=touch.segment / WIDTH {
                    for lane in 0..WIDTH {
                        moment1[part][lane] += force * row[0][part][lane];
                    }
                    for lane in 0..WIDTH {
                        moment2[part][lane] += force * row[1][part][lane];
                    }
                }
            }
        }
    }

    /// Whether the forces at other points press a point into its solid.
    #[inline(always)]
    fn goes_in(&self, number: usize) -> bool {
        let Work { rows, soft, moved, moments: [moment1, moment2], .. } = &self.work;
        let [row1, row2] = &rows[number][0];
        let mut sums = [0.0; WIDTH];
        for part in 0..=self.touches[number].segment / WIDTH {
            for lane in 0..WIDTH {
                let moved = row1[part][lane] * moment1[part][lane] + row2[part][lane] * moment2[part][lane];
                sums[lane] += soft[part][lane] * moved;
            }
        }
        moved[number][0] + total(sums) < 0.0
    }

    /// Computes how the moments bend each segment. Where they exceed what turgor can, growth gives way: the rest curvature
    /// follows the actual one.
    #[inline(always)]
    fn curve(&mut self, last: usize, segments: &Chain, plant: &Individual) {
        let Work { moments: [moment1, moment2], bent: [bent1, bent2, rest1, rest2], .. } = &mut self.work;
        for part in 0..=last / WIDTH {
            for lane in 0..WIDTH {
                let i = part * WIDTH + lane;
                let radius = radius(plant, segments.from_apex[i]);
                // One half of a cross-section that is pressed by turgor, and another that is pulled by it.
                let most = 4.0 / 3.0 * TURGOR * radius * radius * radius;
                let [moment1, moment2] = [moment1[part][lane], moment2[part][lane]];
                let found = (moment1 * moment1 + moment2 * moment2).sqrt();
                let yielding = if found > most { 1.0 - most / found } else { 0.0 };
                bent1[part][lane] = segments.softness[i] * moment1;
                bent2[part][lane] = -segments.softness[i] * moment2;
                rest1[part][lane] = yielding * bent1[part][lane];
                rest2[part][lane] = yielding * bent2[part][lane];
            }
        }
    }
}

/// Coulomb: friction holds up to `most`.
#[inline(always)]
fn held_by_friction(most: f64, aside: [f64; 2]) -> [f64; 2] {
    let wanted = norm(aside);
    if wanted > most { scale(aside, most / wanted) } else { aside }
}

/// How far a place moves along each axis by a unit force along each axis of another, by their rows up to a segment.
#[inline(always)]
fn compliances(one: &[JacobianRow; 3], other: &[JacobianRow; 3], soft: &Row, last: usize) -> [Vec3; 3] {
    let mut sums = [[[0.0; WIDTH]; 3]; 3];
    for part in 0..=last / WIDTH {
        for towards in 0..2 {
            for (sums, one) in sums.iter_mut().zip(one) {
                let mut one = one[towards][part];
                for lane in 0..WIDTH {
                    one[lane] *= soft[part][lane];
                }
                for (sums, other) in sums.iter_mut().zip(other) {
                    for lane in 0..WIDTH {
                        sums[lane] += one[lane] * other[towards][part][lane];
                    }
                }
            }
        }
    }
    sums.map(|sums| sums.map(total))
}

/// The product of a matrix and a vector.
#[inline(always)]
fn product(rows: &[Vec3; 3], vector: Vec3) -> Vec3 {
    rows.map(|row| dot(row, vector))
}

/// Sets a row to 0 beyond a segment, to the end of its part.
#[inline(always)]
fn end(row: &mut Row, last: usize) {
    row[last / WIDTH][last % WIDTH + 1..].fill(0.0);
}

/// The sum of a part.
#[inline(always)]
fn total(part: [f64; WIDTH]) -> f64 {
    let [a, b, c, d, e, f, g, h] = part;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// A vector of a segment.
#[inline(always)]
fn frame(values: &[PerSegment; 3], i: usize) -> Vec3 {
    [values[0][i], values[1][i], values[2][i]]
}

#[cfg(test)]
mod tests {
    use tropism::geometry::Point;
    use tropism::obstacle::{Obstacle, Pole};

    use super::*;
    use crate::{Bean, Species};

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
}
