//! The visible shape of a bean at one time: the interface between biology and rendering.

use tropism::math;
use tropism::math::vector::Vec3;

use super::view::View;

/// A cross-section of the stem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Centre, in cm.
    pub at: Vec3,
    /// Radius, in cm.
    pub radius: f64,
}

/// One of the pair of primary leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// Insertion of the petiole on the stem, in cm.
    pub base: Vec3,
    /// Unit vector from the base along petiole and midrib.
    pub along: Vec3,
    /// Unit vector across the blade, at right angles to `along`.
    pub across: Vec3,
    /// Length of petiole and blade together, in cm.
    pub length: f64,
}

/// The visible shape of a bean.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// Age since the seedling had its initial length, in h.
    pub age_h: f64,
    /// Stem from the base to the apex.
    pub stem: Vec<Node>,
    /// Unit vector of the direction of the apex.
    pub heading: Vec3,
    /// The primary leaves.
    pub leaves: [Leaf; 2],
    /// How far the primary leaves have spread: 0 folded along the apex, 1 open.
    pub spread: f64,
    /// How far the cotyledons have withered: 0 fresh, 1 fallen.
    pub withered: f64,
}

impl Pose {
    /// The plant in the coordinates of the camera of `view`.
    #[must_use]
    pub fn seen_from(&self, view: View) -> Self {
        self.moved(|place| view.to_camera(place), |direction| view.to_camera(direction))
    }

    /// The plant after a rigid motion, which takes each place and turns each direction.
    pub(super) fn moved(&self, take: impl Fn(Vec3) -> Vec3, turn: impl Fn(Vec3) -> Vec3) -> Self {
        let leaf = |leaf: Leaf| Leaf {
            base: take(leaf.base),
            along: turn(leaf.along),
            across: turn(leaf.across),
            length: leaf.length,
        };
        Self {
            stem: self.stem.iter().map(|node| Node { at: take(node.at), radius: node.radius }).collect(),
            heading: turn(self.heading),
            leaves: self.leaves.map(leaf),
            ..*self
        }
    }

    /// The shoot apex, in cm.
    ///
    /// # Panics
    /// If the stem has no nodes.
    #[must_use]
    pub fn apex(&self) -> Vec3 {
        self.stem.last().expect("a stem has nodes").at
    }
}

impl Leaf {
    /// Petiole as a share of the length of the leaf. Chosen by hand.
    pub const PETIOLE: f64 = 0.25;
    /// Width of the blade as a share of its length. Chosen by hand: a cordate leaf.
    pub const WIDTH: f64 = 0.75;

    /// A place on the leaf: `u` from 0 at the base to 1 at the blade's end, `v` across in cm.
    #[must_use]
    pub fn place(&self, u: f64, v: f64) -> Vec3 {
        core::array::from_fn(|axis| {
            self.base[axis] + u * self.length * self.along[axis] + v * self.across[axis]
        })
    }

    /// The outline of the cordate blade, in cm, from where the petiole meets it, around, and back: 2 x `half` places.
    #[must_use]
    pub fn outline(&self, half: usize) -> Vec<Vec3> {
        self.outline_of(&Self::unit_outline(half)).collect()
    }

    /// The outline of this leaf from that of a leaf of length 1.
    pub(super) fn outline_of(&self, unit: &[[f64; 2]]) -> impl Iterator<Item = Vec3> {
        unit.iter().map(|&[u, v]| self.place(u, v * self.length))
    }

    /// The outline of a leaf of length 1: `u` and `v` of [`Self::place`] for each of 2 x `half` places.
    pub(super) fn unit_outline(half: usize) -> Vec<[f64; 2]> {
        let blade = 1.0 - Self::PETIOLE;
        let edge = |side: f64, step: usize| {
            let turn = core::f64::consts::PI * step as f64 / half as f64;
            // Widest at a third of the blade, two lobes behind the petiole's end, a point in front.
            let reach = 0.5 - 0.5 * math::cos(turn);
            let lobe = -0.08 * math::sin(turn) * (1.0 - reach) * (1.0 - reach) * 4.0;
            let width = 0.5 * Self::WIDTH * math::sin(turn) * (1.25 - 0.5 * reach);
            [Self::PETIOLE + blade * (reach + lobe), side * width * blade]
        };
        (0..half).map(|step| edge(1.0, step)).chain((1..=half).rev().map(|step| edge(-1.0, step))).collect()
    }
}
