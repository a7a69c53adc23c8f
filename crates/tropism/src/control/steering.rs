//! From where a tip should move to the lamp that draws it there.

use crate::lamps::{Layout, Light};

/// The lamps of a layout, as a rule uses them.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Steering {
    /// The outermost lamps to the left and to the right.
    Plane([Light; 2]),
    /// All lamps, by their direction from the root.
    Space(Layout),
}

impl Steering {
    pub(super) fn in_plane(layout: &Layout) -> Self {
        Self::Plane([layout.towards(false), layout.towards(true)])
    }

    pub(super) fn in_space(layout: &Layout) -> Self {
        Self::Space(layout.clone())
    }

    /// The lamp that draws the tip by (x, z).
    pub(super) fn towards(&self, [x, z]: [f64; 2]) -> Light {
        match self {
            Self::Plane([left, right]) => {
                if x > 0.0 {
                    *right
                } else {
                    *left
                }
            }
            Self::Space(layout) => layout.along(x, z),
        }
    }

    /// How far the light of a lamp draws to the right and to the front: -1, 0 or 1 along its main direction.
    pub(super) fn sides(&self, light: Light) -> [f64; 2] {
        match self {
            Self::Plane([_, right]) => [if light == *right { 1.0 } else { -1.0 }, 0.0],
            Self::Space(layout) => {
                let [x, _, z] = layout.lamps()[light.index()].at;
                if x.abs() >= z.abs() { [x.signum(), 0.0] } else { [0.0, z.signum()] }
            }
        }
    }
}
