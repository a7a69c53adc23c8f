//! The stem: a growing elastic rod with differential growth.
//!
//! The rod is a chain of segments that follow the tissue (Lagrangian). Each carries a length, a curvature towards two material
//! directions, and memories of light and gravity. [`Chains`] integrates it over a tick, for one plant or for several in vector
//! lanes by the same text.
//!
//! The material frame (d1, d2, t) of a segment is twist-free (Bishop 1975): it rotates about `k1 d2 - k2 d1`, so straight
//! segments need no special case as with a Frenet frame. At an upright base d1 is x, d2 points away from the camera, t is up.
//!
//! # References
//! Bishop 1975, doi:10.1080/00029890.1975.11993807: frames without twist. Bastien, Bohr, Moulia, Douady 2013,
//! doi:10.1073/pnas.1214301109: gravitropism balanced by proprioception. Bastien, Douady, Moulia 2015,
//! doi:10.1371/journal.pcbi.1004037: phototropism and its power law of irradiance.

mod rotation;
mod contact;
mod exposure;
mod chains;

use tropism::lamps::MAX_LAMPS;
use tropism::lighting::Beam;
use tropism::math;
use tropism::math::vector::{Vec3, along};
use tropism::obstacle::Solid;

use crate::individual::Individual;
use crate::internodal::Internodal;
use crate::solid::ContactPoint;
use contact::Contact;
use rotation::Rotation;

pub(super) use chains::{Chains, LANES, Member};

/// A segment longer than this splits, in cm. Chosen by hand: 8 to some 65 segments a stem.
const MAX_SEGMENT_CM: f64 = 0.75;
/// Most segments. A full rod no longer splits. Chosen by hand: twice what a bean needs.
const MAX_SEGMENTS: usize = 127;
/// Segments of a seedling. Chosen by hand: 0.5 cm each.
const SEEDLING_SEGMENTS: usize = 8;
/// Index of the segment that bears the leaf pair of a seedling: 1 cm below the apex. Chosen by hand.
const LEAF_SEGMENT: usize = 6;
/// Distance from the apex within which tissue belongs to the internode that was laid down last, in cm. Chosen by hand: the
/// segments of a seedling above its leaf pair.
const PRIMORDIUM_CM: f64 = 0.6;
/// Distance from the apex at which the stem has its full radius, in cm. Chosen by hand.
const TAPER_CM: f64 = 15.0;

/// dyn/cm^2 in one MPa.
const MEGAPASCAL: f64 = 1e7;

/// Values that act on all segments alike during a tick.
#[derive(Clone, Debug)]
pub(super) struct Forcing {
    /// Sub-step, in h, and their number.
    pub(super) dt: f64,
    pub(super) substeps: u32,
    /// Age of the plant, in h.
    pub(super) age_h: f64,
    /// Places of the lamps, in cm.
    pub(super) lamps: [Vec3; MAX_LAMPS],
    /// Power of each lamp, 0 to 1; 0 for places without a lamp.
    pub(super) powers: [f64; MAX_LAMPS],
    /// Cones of the lamps.
    pub(super) beams: [Option<Beam>; MAX_LAMPS],
    /// Whether solids cast shadows.
    pub(super) is_shaded: bool,
    /// Elongation, in cm/h.
    pub(super) growth: f64,
    /// Motor gain on differential growth: maturity, fluctuation and pauses.
    pub(super) gain: f64,
    /// Length of the motile zone, in cm.
    pub(super) zone: f64,
    /// Rate of autotropic straightening (proprioception), gamma, per h.
    pub(super) straightening: f64,
    /// Mass of the leaf pair, in g.
    pub(super) leaf_mass: f64,
}

impl Forcing {
    /// Numbers of the lamps that are lit.
    fn lit(&self) -> impl Iterator<Item = usize> + use<> {
        let powers = self.powers;
        (0..MAX_LAMPS).filter(move |&number| powers[number] > 0.0)
    }
}

/// The state of a segment between two ticks, or that of a segment of as many plants as a number has lanes; vectors are towards d1
/// and d2.
#[derive(Clone, Copy, Debug, Default)]
struct Segment<R = f64> {
    /// Length, in cm.
    length: R,
    /// Actual curvature, in 1/cm, and how fast it changed in the last sub-step, in 1/cm/h.
    curvature: [R; 2],
    bending: [R; 2],
    /// Rest curvature, which differential growth changes, in 1/cm.
    rest: [R; 2],
    /// Stages of memory, in 1/cm/h: see [`Filter`](chains::Filter).
    memory: [[R; 2]; 3],
    /// Number of its internode, from 0 at the base; not used in lanes.
    internode: u32,
}

impl<R: Copy> Segment<R> {
    fn numbers(&self) -> [R; 13] {
        let Self { length, curvature: [a, b], bending: [c, d], rest: [e, f], memory, .. } = *self;
        let [[g, h], [i, j], [k, l]] = memory;
        [length, a, b, c, d, e, f, g, h, i, j, k, l]
    }

    fn numbers_mut(&mut self) -> [&mut R; 13] {
        let Self { length, curvature: [a, b], bending: [c, d], rest: [e, f], memory, .. } = self;
        let [[g, h], [i, j], [k, l]] = memory;
        [length, a, b, c, d, e, f, g, h, i, j, k, l]
    }
}

/// The lower end of a segment.
#[derive(Clone, Copy, Debug)]
struct Base {
    rotation: Rotation<f64>,
    /// Its place, in cm.
    at: Vec3,
}

impl Base {
    /// The lower end of the next segment, with the arithmetic of a sub-step.
    fn above(mut self, segment: &Segment) -> Self {
        let [halfway, rotation] = self.rotation.through(segment.curvature, segment.length);
        rotation::pass(&mut self.at, halfway.frame()[2], segment.length);
        Self { rotation, ..self }
    }
}

/// The stem as a chain of segments, base first.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    /// Rigid segments that a sub-step leaves out.
    foot: Vec<Segment>,
    /// The segments above the foot, which a sub-step computes.
    segments: Vec<Segment>,
    /// Number of the lowest of them that are rigid.
    rigid: usize,
    /// Index of the segment that bears the leaf pair, from the root.
    leaf: usize,
    /// Orientation of the root.
    root: Rotation<f64>,
    /// The lower end of the segments above the foot.
    base: Base,
    /// Length of stem below the topmost contact that has become rigid, in cm; 0 without one.
    anchored: f64,
    /// Solids and contacts with them; `None` without solids.
    contact: Option<Box<Contact>>,
}

/// A cross-section between two segments, or an end of the stem.
pub(super) struct Section {
    /// Its centre, in cm.
    pub(super) at: Vec3,
    /// Distance from the apex, in cm.
    pub(super) from_apex: f64,
    rotation: Rotation<f64>,
}

impl Section {
    /// Direction of the stem there.
    pub(super) fn along(&self) -> Vec3 {
        self.rotation.frame()[2]
    }
}

/// Radius of the stem at a distance from the apex, in cm.
pub(super) fn radius(plant: &Individual, from_apex: f64) -> f64 {
    let stem = &plant.stem;
    stem.radius_apex + (stem.radius_base - stem.radius_apex) * (from_apex / TAPER_CM).min(1.0)
}

impl Rod {
    /// The straight stem of a seedling.
    pub(super) fn seedling(plant: &Individual) -> Self {
        let length = plant.growth.start / SEEDLING_SEGMENTS as f64;
        let segment =
            |number| Segment { length, internode: u32::from(number > LEAF_SEGMENT), ..Segment::default() };
        let root = Rotation::of_bend([2.0 * plant.stem.tilt_x, -2.0 * plant.stem.tilt_z], 1.0);
        Self {
            foot: Vec::new(),
            segments: (0..SEEDLING_SEGMENTS).map(segment).collect(),
            rigid: 0,
            leaf: LEAF_SEGMENT,
            root,
            base: Base { rotation: root, at: [0.0; 3] },
            anchored: 0.0,
            contact: None,
        }
    }

    /// Puts the rod among solids.
    pub(super) fn set_solids(&mut self, solids: &[Solid]) {
        self.contact = (!solids.is_empty()).then(|| Box::new(Contact::new(solids, contact::FRICTION)));
    }

    /// Whether the rod stands among solids.
    pub(super) fn is_among_solids(&self) -> bool {
        self.contact.is_some()
    }

    /// Sets the coefficient of friction on the solids.
    pub(super) fn set_friction(&mut self, coefficient: f64) {
        if let Some(contact) = &mut self.contact {
            contact.friction = coefficient;
        }
    }

    /// Where the rod touches solids.
    pub(super) fn contacts(&self) -> Vec<ContactPoint> {
        self.contact.as_ref().map_or_else(Vec::new, |contact| contact.points().collect())
    }

    /// Tilts the base by `radians` towards positive x.
    pub(super) fn tilt_base(&mut self, radians: f64) {
        let Rotation([w, x, y, z]) = self.root;
        let (sin, cos) = math::sin_cos(0.5 * radians);
        self.root = Rotation([w * cos - y * sin, x * cos + z * sin, y * cos + w * sin, z * cos - x * sin]);
        self.base = self.foot.iter().fold(Base { rotation: self.root, at: [0.0; 3] }, Base::above);
    }

    /// All segments from the root to the apex.
    fn all(&self) -> impl Iterator<Item = &Segment> {
        self.foot.iter().chain(&self.segments)
    }

    /// Length along the stem, in cm.
    pub(super) fn length(&self) -> f64 {
        self.all().map(|segment| segment.length).sum()
    }

    /// Length of stem above its topmost hold, in cm: a solid that it presses on or pressed on when it became rigid, else the
    /// root.
    pub(super) fn free_length(&self) -> f64 {
        let Some((segment, share)) = self.contact.as_ref().and_then(|contact| contact.topmost()) else {
            return self.length() - self.anchored;
        };
        let above: f64 = self.segments[segment + 1..].iter().map(|segment| segment.length).sum();
        above + (1.0 - share) * self.segments[segment].length
    }

    /// Place of the apex, in cm.
    pub(super) fn apex(&self) -> Vec3 {
        let mut apex = [0.0; 3];
        self.for_each_section(|section| apex = section.at);
        apex
    }

    /// Calls `visit` with the cross-sections from the base to the apex: one more than there are segments.
    pub(super) fn for_each_section(&self, mut visit: impl FnMut(Section)) {
        let mut rotation = self.root;
        let mut at = [0.0; 3];
        let mut from_apex = self.length();
        visit(Section { at, from_apex, rotation });
        for segment in self.all() {
            let half = Rotation::of_bend(segment.curvature, segment.length);
            rotation = rotation.then(half);
            at = along(at, rotation.frame()[2], segment.length);
            rotation = rotation.then(half);
            from_apex -= segment.length;
            visit(Section { at, from_apex: from_apex.max(0.0), rotation });
        }
    }

    /// Index of the segment that bears the leaves, from the root.
    pub(super) fn leaf(&self) -> usize {
        self.leaf
    }

    /// The largest curvature, in 1/cm.
    pub(super) fn peak_curvature(&self) -> f64 {
        self.all().map(|segment| math::vector::norm(segment.curvature)).fold(0.0, f64::max)
    }

    /// Number of segments.
    pub(super) fn count(&self) -> usize {
        self.foot.len() + self.segments.len()
    }

    /// Number of segments that a sub-step computes.
    pub(super) fn computed(&self) -> usize {
        self.segments.len()
    }

    /// Lets segments farther than `beyond` cm from the apex become rigid: they keep the shape that they have.
    fn stiffen(&mut self, beyond: Option<f64>) {
        let Some(beyond) = beyond else { return };
        let length = self.length();
        let mut below: f64 =
            self.foot.iter().chain(&self.segments[..self.rigid]).map(|segment| segment.length).sum();
        while length - below - self.segments[self.rigid].length > beyond {
            let segment = &mut self.segments[self.rigid];
            (segment.rest, segment.bending) = (segment.curvature, [0.0; 2]);
            below += segment.length;
            if self.contact.as_ref().is_some_and(|contact| contact.presses(self.rigid)) {
                self.anchored = below;
            }
            self.rigid += 1;
        }
    }

    /// Moves rigid segments into the foot. This changes no bit of what is above them.
    ///
    /// They go in groups, so that the others keep their places in the sums of contacts.
    pub(super) fn set_down(&mut self) {
        let count = self.rigid - self.rigid % contact::WIDTH;
        self.base = self.segments[..count].iter().fold(self.base, Base::above);
        self.foot.extend(self.segments.drain(..count));
        self.rigid -= count;
        if let Some(contact) = self.contact.as_mut().filter(|_| count > 0) {
            contact.drop_lowest(count);
        }
    }

    /// Lays down internodes, and gives `put` the motility of each segment.
    fn mature(&mut self, of: &Internodal, age_h: f64, mut put: impl FnMut(usize, f64)) {
        let youngest = of.youngest(age_h);
        let (mut above, mut internode, mut node_cm) = (0.0, None, 0.0);
        for (i, segment) in self.segments.iter_mut().enumerate().rev() {
            let from_apex = above + 0.5 * segment.length;
            if from_apex < PRIMORDIUM_CM {
                segment.internode = segment.internode.max(youngest);
            }
            if internode != Some(segment.internode) {
                (internode, node_cm) = (Some(segment.internode), above);
            }
            above += segment.length;
            put(i, of.motility(segment.internode, from_apex - node_cm, age_h));
        }
    }

    /// Halves segments longer than [`MAX_SEGMENT_CM`]. Both halves inherit the state; leaves stay with the lower half.
    fn split(&mut self) {
        let mut i = self.rigid;
        while i < self.segments.len() {
            if self.segments[i].length > MAX_SEGMENT_CM && self.segments.len() < MAX_SEGMENTS {
                self.segments[i].length *= 0.5;
                self.segments.insert(i, self.segments[i]);
                if let Some(contact) = &mut self.contact {
                    contact.split(i);
                }
                if self.leaf > self.foot.len() + i {
                    self.leaf += 1;
                }
                i += 1;
            }
            i += 1;
        }
    }
}
