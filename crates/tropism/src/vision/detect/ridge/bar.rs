//! Contrast of a bar: the difference of its colour from the colours on both sides.
//!
//! In: a picture, and a bar's position, heading and width. Out: its contrast. The one idea: the differences to the
//! two sides are combined by their inner product, so an edge, which has a difference on one side only, has no
//! contrast (after Koller, Gerig, Székely and Dettwiler 1995, *Multiscale detection of curvilinear structures in 2-D
//! and 3-D image data*, ICCV).

use crate::math;
use crate::math::vector::{dot, mean, sub};
use crate::photo::Image;
use crate::vision::detect::curve::PlanePoint;
use crate::vision::detect::ridge::rgb::Rgb;
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::plane::Neighbours;

/// Standard deviation of the Gaussian filter before all else, in pixels.
const SIGMA: f64 = 1.0;

/// Width of the thinnest stem that is found, in pixels.
pub(super) const MIN_WIDTH: f64 = 5.0;

/// Offsets across a bar at which its colour is sampled, in widths.
const INSIDE: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

/// Offsets to each side at which the colour beside it is sampled, in widths.
const BESIDE: [f64; 3] = [0.6, 0.75, 0.9];

/// A picture after a Gaussian filter.
pub(super) struct SmoothedImage {
    pub(super) width: usize,
    pub(super) height: usize,
    colours: Vec<[f32; 3]>,
}

impl SmoothedImage {
    /// Filters a picture; `None` where it is too small for a stem and its flanks.
    pub(super) fn of(image: &Image) -> Option<Self> {
        let whole = image.region();
        if (image.width.min(image.height) as f64) < 4.0 * MIN_WIDTH {
            return None;
        }
        let channel = |i: usize| {
            let mut weights = [0.0; 3];
            weights[i] = 1.0;
            sample_gaussian(image, whole, weights, SIGMA, 1).values
        };
        let [red, green, blue] = [0, 1, 2].map(channel);
        let colours = red.into_iter().zip(green).zip(blue).map(|((r, g), b)| [r, g, b]).collect();
        Some(Self { width: image.width, height: image.height, colours })
    }

    /// The colour at a point, by bilinear interpolation; beyond the edge the outermost pixels are repeated.
    pub(super) fn at(&self, point: PlanePoint) -> Rgb {
        let neighbours = Neighbours::of(point, self.width, self.height);
        let colours = neighbours.indices.map(|index| self.colours[index]);
        std::array::from_fn(|i| neighbours.interpolate(colours.map(|colour| f64::from(colour[i]))))
    }

    /// Whether a point lies in the picture, at least a pixel from its edge.
    pub(super) fn contains(&self, [x, y]: PlanePoint) -> bool {
        x >= 1.0 && y >= 1.0 && x < self.width as f64 - 1.0 && y < self.height as f64 - 1.0
    }

    /// Contrast of a bar at a point, in grey values. `heading` is in radians from upright to the right.
    ///
    /// It is negative where the bar's colour lies between those of its sides.
    pub(super) fn bar_contrast(&self, at: PlanePoint, heading: f64, width: f64) -> f64 {
        let (sin, cos) = (math::sin(heading), math::cos(heading));
        let point = |across: f64, along: f64| {
            let (across, along) = (across * width, along * width);
            [at[0] + across * cos + along * sin, at[1] + across * sin - along * cos]
        };
        let colour = |offsets: &[f64], side: f64| {
            mean(
                offsets
                    .iter()
                    .flat_map(|&across| [-0.25, 0.25].map(|along| self.at(point(side * across, along)))),
            )
        };
        let inside = colour(&INSIDE, 1.0);
        let (left, right) = (colour(&BESIDE, -1.0), colour(&BESIDE, 1.0));
        let product = dot(sub(inside, left), sub(inside, right));
        product.abs().sqrt().copysign(product)
    }
}
