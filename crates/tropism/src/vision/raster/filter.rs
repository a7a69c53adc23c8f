//! Gaussian filter, subsampling and downscaling (section 2.2.2).
//!
//! In: a picture and a crop. Out: a plane of smoothed samples, or a smaller picture. The one idea: all steps are
//! linear, so their order is free, and the cheapest one filters only where a sample is taken.

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::simd::{Kernel, dispatch};
use crate::vision::raster::plane::Plane;

/// Downscales a crop by `factor` with a box filter: each pixel is the mean of a square of `factor` x `factor` pixels.
/// Incomplete squares at the right and lower edge are dropped.
///
/// # Panics
/// If `crop` does not lie inside the picture or `factor` is 0.
#[must_use]
pub fn downscale(image: &Image, crop: Region, factor: usize) -> Image {
    assert!(crop.fits(image.width, image.height) && factor > 0, "{crop:?} by {factor}");
    let (width, height) = (crop.width / factor, crop.height / factor);
    let pixels = (factor * factor) as u32;
    let mut rgb = Vec::with_capacity(3 * width * height);
    if factor == 1 {
        for y in crop.y..crop.y + height {
            rgb.extend_from_slice(&image.rgb[3 * (y * image.width + crop.x)..][..3 * width]);
        }
        return Image { width, height, rgb };
    }
    let mut sums = vec![0_u32; 3 * width * factor];
    for top in (crop.y..).step_by(factor).take(height) {
        sums.fill(0);
        for y in top..top + factor {
            let row = &image.rgb[3 * (y * image.width + crop.x)..][..3 * width * factor];
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += u32::from(*value));
        }
        for square in sums.chunks_exact(3 * factor) {
            let sum = square
                .chunks_exact(3)
                .fold([0; 3], |sum, pixel| [sum[0] + pixel[0], sum[1] + pixel[1], sum[2] + pixel[2]]);
            rgb.extend(sum.map(|sum| ((sum + pixels / 2) / pixels) as u8));
        }
    }
    Image { width, height, rgb }
}

/// Weights of a Gaussian kernel of standard deviation `sigma`, truncated at three deviations; they sum to 1.
fn gaussian_kernel(sigma: f64) -> Vec<f32> {
    let radius = (3.0 * sigma).ceil() as i32;
    let density = |i: i32| crate::math::exp(-0.5 * (f64::from(i) / sigma) * (f64::from(i) / sigma));
    let weights: Vec<f64> = (-radius..=radius).map(|i| if sigma > 0.0 { density(i) } else { 1.0 }).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| (weight / sum) as f32).collect()
}

/// Filters a picture with a Gaussian of standard deviation `sigma` pixels and takes every `step`-th pixel of `crop`.
///
/// `channels` are the weights of red, green and blue: [`LUMA`](super::plane::LUMA) desaturates. The paper filters the
/// whole picture in colour and crops last. All of these steps are linear, so the cheaper order used here (weigh the
/// channels, crop, filter at the samples) gives the same values. Beyond the picture's edge its outermost pixels are
/// repeated.
///
/// # Panics
/// If `crop` does not lie inside the picture or `step` is 0.
#[must_use]
pub fn sample_gaussian(image: &Image, crop: Region, channels: [f32; 3], sigma: f64, step: usize) -> Plane {
    dispatch(GaussianSampling { image, crop, channels, sigma, step })
}

/// [`sample_gaussian`], compiled for several processors.
struct GaussianSampling<'a> {
    image: &'a Image,
    crop: Region,
    channels: [f32; 3],
    sigma: f64,
    step: usize,
}

impl Kernel for GaussianSampling<'_> {
    type Result = Plane;

    #[inline(always)]
    fn run(self) -> Plane {
        let GaussianSampling { image, crop, channels, sigma, step } = self;
        let (columns, rows) = (image.width, image.height);
        assert!(crop.fits(columns, rows) && step > 0, "{crop:?} in {columns} x {rows}");
        let weights = gaussian_kernel(sigma);
        let radius = weights.len() / 2;
        // The weighted channels of the crop, with a margin as far as the picture reaches.
        let (left, top) = (crop.x.saturating_sub(radius), crop.y.saturating_sub(radius));
        let width = (crop.x + crop.width + radius).min(columns) - left;
        let height = (crop.y + crop.height + radius).min(rows) - top;
        let tables: [[f32; 256]; 3] =
            channels.map(|weight| std::array::from_fn(|level| weight * f32::from(level as u8)));
        let mut values = vec![0.0; width * height];
        for (y, row) in (top..).zip(values.chunks_exact_mut(width)) {
            weigh_channels(&image.rgb[3 * (y * columns + left)..][..3 * width], &tables, row);
        }
        let plane = Plane { width, height, values, origin: Pixel::new(left as f64, top as f64), step: 1 };
        // A sample lies in the middle of the square of pixels that it represents.
        let (across, down) = ((step / 2).min(crop.width - 1), (step / 2).min(crop.height - 1));
        let size = ((crop.width - 1 - across) / step + 1, (crop.height - 1 - down) / step + 1);
        filter(&plane, &weights, (crop.x + across - left, crop.y + down - top), size, step)
    }
}

/// Writes the weighted sum of red, green and blue of each pixel; `tables` hold each channel's weighted levels.
///
/// Not inlined: with wide vectors it would gather from the tables, which takes longer.
#[inline(never)]
fn weigh_channels(rgb: &[u8], tables: &[[f32; 256]; 3], out: &mut [f32]) {
    for (value, pixel) in out.iter_mut().zip(rgb.as_chunks::<3>().0) {
        let level = |channel: usize| tables[channel][usize::from(pixel[channel])];
        *value = level(0) + level(1) + level(2);
    }
}

/// Filters a plane with a Gaussian of standard deviation `sigma` samples; beyond its edges the outermost samples are
/// repeated.
#[must_use]
pub fn smooth_gaussian(plane: &Plane, sigma: f64) -> Plane {
    filter(plane, &gaussian_kernel(sigma), (0, 0), (plane.width, plane.height), 1)
}

/// Filters a plane with a separable kernel at `size` samples, `step` apart from the sample `first` on: down the columns,
/// where neighbours lie side by side in memory, then along the row.
#[inline(always)]
fn filter(
    plane: &Plane,
    weights: &[f32],
    first: (usize, usize),
    (width, height): (usize, usize),
    step: usize,
) -> Plane {
    let radius = weights.len() / 2;
    let mut values = vec![0.0; width * height];
    let mut line = vec![0.0; plane.width + 2 * radius];
    for (j, out) in values.chunks_exact_mut(width).enumerate() {
        let y = first.1 + j * step;
        let middle = &mut line[radius..radius + plane.width];
        weigh_rows(middle, |k| plane.row((y + k).saturating_sub(radius).min(plane.height - 1)), weights);
        let (leftmost, rightmost) = (middle[0], middle[plane.width - 1]);
        line[..radius].fill(leftmost);
        line[radius + plane.width..].fill(rightmost);
        if step == 1 {
            weigh_rows(out, |k| &line[first.0 + k..][..width], weights);
            continue;
        }
        for (i, sum) in out.iter_mut().enumerate() {
            let from = &line[first.0 + i * step..][..weights.len()];
            *sum = from.iter().zip(weights).map(|(value, weight)| value * weight).sum();
        }
    }
    let origin = plane.to_pixel([first.0 as f64, first.1 as f64]);
    Plane { width, height, values, origin, step: plane.step * step }
}

/// Writes the weighted sum of rows, added up in the order of the weights.
#[inline(always)]
fn weigh_rows<'a>(out: &mut [f32], row: impl Fn(usize) -> &'a [f32], weights: &[f32]) {
    // The kernel of mode `robust` has five weights: one pass over the rows instead of five.
    if let Ok([a, b, c, d, e]) = <[f32; 5]>::try_from(weights) {
        let [one, two, three, four, five] = std::array::from_fn(|k| &row(k)[..out.len()]);
        for (i, sum) in out.iter_mut().enumerate() {
            *sum = a * one[i] + b * two[i] + c * three[i] + d * four[i] + e * five[i];
        }
        return;
    }
    out.fill(0.0);
    for (k, weight) in weights.iter().enumerate() {
        out.iter_mut().zip(row(k)).for_each(|(sum, value)| *sum += weight * value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::raster::plane::LUMA;
    use proptest::prelude::*;

    fn picture(width: usize, height: usize) -> Image {
        let rgb = (0..3 * width * height).map(|i| (i * 7919 % 256) as u8).collect();
        Image { width, height, rgb }
    }

    /// The paper's order of steps: desaturate and filter the whole picture, then sample, then crop.
    fn in_paper_order(image: &Image, crop: Region, sigma: f64, step: usize) -> Vec<f64> {
        let grey = |x: i64, y: i64| {
            let at = |v: i64, size: usize| v.clamp(0, size as i64 - 1) as usize;
            let [r, g, b] = image.at(at(x, image.width), at(y, image.height)).map(f64::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        let weights: Vec<f64> = gaussian_kernel(sigma).into_iter().map(f64::from).collect();
        let radius = (weights.len() / 2) as i64;
        let mut values = Vec::new();
        let offset = |size: usize| (step / 2).min(size - 1);
        for y in (crop.y + offset(crop.height)..crop.y + crop.height).step_by(step) {
            for x in (crop.x + offset(crop.width)..crop.x + crop.width).step_by(step) {
                let (x, y) = (x as i64, y as i64);
                let mut sum = 0.0;
                for (k, wy) in (-radius..=radius).zip(&weights) {
                    for (l, wx) in (-radius..=radius).zip(&weights) {
                        sum += wx * wy * grey(x + l, y + k);
                    }
                }
                values.push(sum);
            }
        }
        values
    }

    proptest! {
        #[test]
        fn the_cheap_order_gives_the_values_of_the_papers_order(
            (width, height) in (1..24_usize, 1..24_usize), corner in (0.0..1.0, 0.0..1.0), far in (0.0..1.0, 0.0..1.0),
            sigma in 0.0..2.0, step in 1..5_usize,
        ) {
            let image = picture(width, height);
            let (x, y) = ((corner.0 * width as f64) as usize, (corner.1 * height as f64) as usize);
            let crop = Region {
                x, y,
                width: 1 + (far.0 * (width - x) as f64) as usize % (width - x),
                height: 1 + (far.1 * (height - y) as f64) as usize % (height - y),
            };
            let plane = sample_gaussian(&image, crop, LUMA, sigma, step);
            prop_assert_eq!(plane.values.len(), in_paper_order(&image, crop, sigma, step).len());
            for (found, wanted) in plane.values.iter().zip(in_paper_order(&image, crop, sigma, step)) {
                prop_assert!((f64::from(*found) - wanted).abs() < 1e-2, "{found} {wanted}");
            }
        }
    }

    #[test]
    fn downscaling_takes_means() {
        let image =
            Image { width: 3, height: 2, rgb: [[0; 3], [40; 3], [9; 3], [80; 3], [120; 3], [9; 3]].concat() };
        let all = Region { x: 0, y: 0, width: 3, height: 2 };
        assert_eq!(downscale(&image, all, 2), Image { width: 1, height: 1, rgb: vec![60; 3] });
        assert_eq!(downscale(&image, Region { x: 2, width: 1, ..all }, 1).rgb, vec![9; 6]);
        assert_eq!(downscale(&image, all, 5).rgb, Vec::<u8>::new());
    }

    #[test]
    fn a_place_and_its_pixel_are_one() {
        let plane =
            sample_gaussian(&picture(40, 30), Region { x: 8, y: 5, width: 20, height: 20 }, LUMA, 0.5, 4);
        assert_eq!(plane.origin, Pixel::new(10.0, 7.0));
        assert_eq!(plane.to_sample(plane.to_pixel([2.5, 3.0])), [2.5, 3.0]);
    }
}
