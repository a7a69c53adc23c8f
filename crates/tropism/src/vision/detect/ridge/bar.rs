//! Bars across a stem: colours of a picture between pixels.

use crate::geometry::Region;
use crate::math;
use crate::photo::Image;
use crate::vision::detect::curve::Place;
use crate::vision::raster::filter::sample_gaussian;

/// A colour: red, green and blue from 0 to 255, between pixels and on the mean.
pub(super) type Colour = [f64; 3];

/// How far apart two colours are.
pub(super) fn colour_distance(one: Colour, other: Colour) -> f64 {
    math::vector::distance(one, other)
}

/// The mean of some colours.
pub(super) fn mean_colour(colours: impl Iterator<Item = Colour>) -> Colour {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for colour in colours {
        sum.iter_mut().zip(colour).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    sum.map(|sum| sum / f64::max(count, 1.0))
}

/// The colour whose red, green and blue are the medians.
pub(super) fn median_colour(colours: &[Colour]) -> Colour {
    std::array::from_fn(|i| {
        math::statistics::quantile_nearest(&colours.iter().map(|colour| colour[i]).collect::<Vec<_>>(), 0.5)
    })
}

/// The deviation of a picture's noise, as a distance of colours (J. Immerkær 1996, doi:10.1006/cviu.1996.0060): what a
/// mask leaves that is blind to edges and slopes.
pub(super) fn noise_deviation(image: &Image) -> f64 {
    let at = |x: usize, y: usize| f64::from(image.at(x, y)[1]);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in (1..image.height - 1).step_by(2) {
        for x in (1..image.width - 1).step_by(2) {
            let row = |y: usize| at(x - 1, y) - 2.0 * at(x, y) + at(x + 1, y);
            sum += (row(y - 1) - 2.0 * row(y) + row(y + 1)).abs();
            count += 1.0;
        }
    }
    (std::f64::consts::PI / 2.0).sqrt() / 6.0 * sum / f64::max(count, 1.0) * 3_f64.sqrt()
}

/// Deviation of the Gaussian filter before anything else, in pixels.
const SIGMA: f64 = 1.0;

/// The thinnest stem in pixels, the broadest as a share of the picture's shorter side, and the ratio from one width that
/// is tried to the next.
pub(super) const THINNEST: f64 = 5.0;

/// Where across a bar its inside is sampled, and where, on both sides, what lies beside it; in its widths.
const INSIDE: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];

const BESIDE: [f64; 3] = [0.6, 0.75, 0.9];

/// A picture, a little smoothed.
pub(super) struct SmoothedImage {
    pub(super) width: usize,
    pub(super) height: usize,
    colours: Vec<[f32; 3]>,
}

impl SmoothedImage {
    /// `None` where the picture is too small for a stem and what lies beside it.
    pub(super) fn of(image: &Image) -> Option<Self> {
        let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
        if (image.width.min(image.height) as f64) < 4.0 * THINNEST {
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

    /// The colour between pixels; the outermost pixels reach on for ever.
    pub(super) fn at(&self, (x, y): Place) -> Colour {
        let (x, y) = (x.clamp(0.0, self.width as f64 - 1.0), y.clamp(0.0, self.height as f64 - 1.0));
        let (left, top) = (x as usize, y as usize);
        let (right, bottom) = ((left + 1).min(self.width - 1), (top + 1).min(self.height - 1));
        let (across, down) = (x - left as f64, y - top as f64);
        let at = |x: usize, y: usize| self.colours[y * self.width + x];
        let corners = [at(left, top), at(right, top), at(left, bottom), at(right, bottom)];
        std::array::from_fn(|i| {
            math::interpolate::bilinear(corners.map(|colour| f64::from(colour[i])), across, down)
        })
    }

    pub(super) fn holds(&self, (x, y): Place) -> bool {
        x >= 1.0 && y >= 1.0 && x < self.width as f64 - 1.0 && y < self.height as f64 - 1.0
    }

    /// How much a bar stands out on both sides in the same way: the distance of colours, or less than 0 where its colour
    /// lies between those of its sides.
    pub(super) fn bar_contrast(&self, at: Place, heading: f64, width: f64) -> f64 {
        let (sin, cos) = (math::sin(heading), math::cos(heading));
        let place = |across: f64, along: f64| {
            let (across, along) = (across * width, along * width);
            (at.0 + across * cos + along * sin, at.1 + across * sin - along * cos)
        };
        let colour = |offsets: &[f64], side: f64| {
            mean_colour(
                offsets
                    .iter()
                    .flat_map(|&across| [-0.25, 0.25].map(|along| self.at(place(side * across, along)))),
            )
        };
        let inside = colour(&INSIDE, 1.0);
        let (left, right) = (colour(&BESIDE, -1.0), colour(&BESIDE, 1.0));
        let dot: f64 = (0..3).map(|i| (inside[i] - left[i]) * (inside[i] - right[i])).sum();
        dot.abs().sqrt().copysign(dot)
    }
}
