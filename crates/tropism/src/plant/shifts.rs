//! Observed shifts of the tip: the data of the tip-motion model, eqs. (1)-(3).

use serde::{Deserialize, Serialize};

use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::track::Track;

/// One observed step: where the tip was, under which light, and how far it moved until the next observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Tip before the step, in cm.
    pub tip: Point,
    /// Movement in x, in cm.
    pub dx: f64,
    /// Movement in y, in cm.
    pub dy: f64,
    /// The lamp that was lit.
    pub light: Light,
}

impl Shift {
    /// The same step in a mirror (section 2.2.3: x becomes -x, C is flipped, y stays); `None` where `layout` has no lamp
    /// at the mirrored place.
    #[must_use]
    pub fn mirrored(self, layout: &Layout) -> Option<Self> {
        let light = layout.mirrored(self.light)?;
        Some(Self { tip: self.tip.mirrored(), dx: -self.dx, dy: self.dy, light })
    }
}

/// All shifts of a track: pairs of successive, measured tips with a lit lamp between them.
#[must_use]
pub fn of_track(track: &Track) -> Vec<Shift> {
    track
        .shifts()
        .map(|(before, after, light)| Shift {
            tip: before,
            dx: after.x - before.x,
            dy: after.y - before.y,
            light,
        })
        .collect()
}

/// The shifts and their mirror images: "logically double the available data" (section 2.2.3). A layout without mirror
/// symmetry has no mirror images.
#[must_use]
pub fn with_mirrored(shifts: &[Shift], layout: &Layout) -> Vec<Shift> {
    let images = shifts.iter().filter(|_| layout.is_symmetric()).filter_map(|shift| shift.mirrored(layout));
    shifts.iter().copied().chain(images).collect()
}

/// Half the width and half the height of the sliding window, eq. (1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Window {
    /// Half-width w_x, in cm. Paper: 0.5.
    pub wx: f64,
    /// Half-height w_y, in cm. Paper: 1.
    pub wy: f64,
}

impl Default for Window {
    fn default() -> Self {
        Self { wx: 0.5, wy: 1.0 }
    }
}

impl Window {
    /// Whether `place` lies in the rectangle R around `centre`, edges included, eq. (1).
    #[must_use]
    pub fn holds(&self, centre: Point, place: Point) -> bool {
        centre.x - self.wx <= place.x
            && place.x <= centre.x + self.wx
            && centre.y - self.wy <= place.y
            && place.y <= centre.y + self.wy
    }
}

/// The mean shift in x of all data in the window around `centre` under `light`: eqs. (2), (3) and the mean of eq. (5).
/// `None` where the window holds no data (the white of Fig. 5).
///
/// This is the reference, straight from the equations; it reads every shift.
#[must_use]
pub fn window_mean(shifts: &[Shift], window: Window, centre: Point, light: Light) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_u32);
    for shift in shifts.iter().filter(|shift| shift.light == light && window.holds(centre, shift.tip)) {
        sum += shift.dx;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}
