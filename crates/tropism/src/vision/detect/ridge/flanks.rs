//! Flanks of a stem, the background on both sides: leaves begin where they change for good.
//!
//! In: a line along a stem, and its width. Out: the stretch of it that is stem, how clearly it stands out there, and
//! the line moved to the middle between the stem's edges.

use crate::math::statistics::{self, quantile_nearest};
use crate::math::vector::{along, distance, mean};
use crate::vision::detect::curve::{PlanePoint, normal, smooth, window};
use crate::vision::detect::ridge::bar::SmoothedImage;
use crate::vision::detect::ridge::rgb::{self, Rgb};

/// Points of the line along one width of the stem.
pub(super) const POINTS_PER_WIDTH: usize = 8;

/// Number of bands on each side, and the range of their distances from the middle, in widths.
const BANDS: usize = 4;
const BANDS_START: f64 = 0.75;
const BANDS_END: f64 = 2.25;

/// Colour difference from which on a band has changed, as a share of the stem's contrast.
const BAND_CHANGE: f64 = 0.2;

/// Number of changed bands from which on a point's flanks have changed.
const CHANGED_BANDS: usize = 2;

/// Greatest length of a passing change, in points: a mark painted on the stem, or a leaf's tip.
const PASSING_POINTS: usize = 12;

/// Number of points at the beginning of a stretch that its flanks are first learned from.
const SEED_POINTS: usize = 12;

/// Least length of a stretch, as a share of the longest; the first such stretch is the stem.
const MIN_STRETCH_SHARE: f64 = 0.4;

/// Colour difference to the flank below which a sample lies outside the stem, as a share of the contrast.
const EDGE_CONTRAST: f64 = 0.2;

/// Colours of the bands at one point: those on the left first, each side from the stem outwards.
type Bands = [Rgb; 2 * BANDS];

/// A line along a stem, with the colours of the stem and of its flanks.
pub(super) struct StemFlanks {
    /// Points, [`POINTS_PER_WIDTH`] to a width of the stem.
    pub(super) line: Vec<PlanePoint>,
    /// Width of the stem.
    pub(super) width: f64,
    /// Colour of the stem at each point.
    stem: Vec<Rgb>,
    /// Colours of the bands at each point.
    bands: Vec<Bands>,
    /// Median distance between the colours of stem and bands, on the lower half of the line.
    pub(super) contrast: f64,
}

impl StemFlanks {
    /// Samples the colours along a line.
    pub(super) fn sample(image: &SmoothedImage, line: Vec<PlanePoint>, width: f64) -> Self {
        let normals: Vec<PlanePoint> =
            (0..line.len()).map(|i| normal(&line, i, POINTS_PER_WIDTH / 2)).collect();
        let colour = |i: usize, across: f64| image.at(along(line[i], normals[i], across * width));
        let band_width = (BANDS_END - BANDS_START) / BANDS as f64;
        let band_colour = |i: usize, band: usize| {
            let (side, band) = if band < BANDS { (-1.0, band) } else { (1.0, band - BANDS) };
            let start = BANDS_START + band_width * band as f64;
            let offsets = [0.17, 0.5, 0.83].map(|share| side * (start + share * band_width));
            mean(offsets.into_iter().map(|across| colour(i, across)))
        };
        let stem: Vec<Rgb> = (0..line.len())
            .map(|i| mean([-0.3, -0.15, 0.0, 0.15, 0.3].into_iter().map(|across| colour(i, across))))
            .collect();
        let bands: Vec<Bands> =
            (0..line.len()).map(|i| std::array::from_fn(|band| band_colour(i, band))).collect();
        // Both are averaged over half a width along the line.
        let window = |i: usize| window(i, POINTS_PER_WIDTH / 4, line.len());
        let stem: Vec<Rgb> = (0..line.len()).map(|i| mean(stem[window(i)].iter().copied())).collect();
        let bands: Vec<Bands> = (0..line.len())
            .map(|i| std::array::from_fn(|band| mean(bands[window(i)].iter().map(|bands| bands[band]))))
            .collect();
        let contrast =
            |i: usize| bands[i].iter().map(|&band| distance(stem[i], band)).sum::<f64>() / (2 * BANDS) as f64;
        let lower_half = (0..line.len().div_ceil(2)).map(contrast).collect::<Vec<_>>();
        let contrast = quantile_nearest(&lower_half, 0.5).max(1e-6);
        Self { line, width, stem, bands, contrast }
    }

    /// Colour of the stem at a point.
    pub(super) fn stem_colour(&self, i: usize) -> Rgb {
        self.stem[i]
    }

    /// Colour beside a point, without the band nearest to the stem; side 0 is left.
    pub(super) fn outer_colour(&self, i: usize, side: usize) -> Rgb {
        mean(self.bands[i][side * BANDS + 1..(side + 1) * BANDS].iter().copied())
    }

    /// Median bands of the points between two that `counts` admits.
    fn median_bands(&self, first: usize, last: usize, counts: impl Fn(usize) -> bool) -> Bands {
        let points: Vec<usize> = (first..=last).filter(|&i| counts(i)).collect();
        std::array::from_fn(|band| {
            rgb::median(&points.iter().map(|&i| self.bands[i][band]).collect::<Vec<_>>())
        })
    }

    /// Whether the flanks of each point differ from `reference`.
    fn changes(&self, reference: &Bands) -> Vec<bool> {
        let is_changed =
            |(band, wanted): &(&Rgb, &Rgb)| distance(**band, **wanted) > BAND_CHANGE * self.contrast;
        self.bands
            .iter()
            .map(|bands| bands.iter().zip(reference).filter(is_changed).count() >= CHANGED_BANDS)
            .collect()
    }

    /// First and last point of the first long stretch with unchanged flanks; `None` where there is none.
    pub(super) fn stem_stretch(&self) -> Option<(usize, usize)> {
        // Region growing along the line: a seed learns the flanks, and the stretch grows until they change for good.
        let mut stretches: Vec<(usize, usize)> = Vec::new();
        let mut start = 0;
        while start + SEED_POINTS <= self.line.len() {
            let seed = start..start + SEED_POINTS;
            let mut changes = self.changes(&self.median_bands(start, seed.end - 1, |_| true));
            if changes[seed].iter().filter(|&&is_changed| is_changed).count() > SEED_POINTS / 5 {
                start += POINTS_PER_WIDTH / 4;
                continue;
            }
            let mut last = last_unchanged(start..self.line.len(), &changes);
            // The flanks of the whole stretch are a better reference than those of its seed: alternate between learning
            // and growing until nothing changes, as in k-means.
            for _ in 0..6 {
                let again = self.changes(&self.median_bands(start, last, |i| !changes[i]));
                if again == changes {
                    break;
                }
                changes = again;
                last = last_unchanged(start..self.line.len(), &changes);
            }
            let first = last_unchanged((0..=start).rev(), &changes);
            stretches.push((first, last));
            start = last.max(start + POINTS_PER_WIDTH / 4);
        }
        let length = |&(first, last): &(usize, usize)| last - first;
        let longest = stretches.iter().map(length).max()?;
        stretches.into_iter().find(|stretch| length(stretch) as f64 >= MIN_STRETCH_SHARE * longest as f64)
    }

    /// The 20 % quantile, over the points from `first` to `last`, of the least contrast to a band.
    pub(super) fn least_contrast(&self, first: usize, last: usize) -> f64 {
        let least = |i: usize| {
            let distances = self.bands[i].iter().map(|&band| distance(self.stem[i], band));
            distances.fold(f64::INFINITY, f64::min)
        };
        quantile_nearest(&(first..=last).map(least).collect::<Vec<_>>(), 0.2)
    }

    /// Moves the line to the middle between the stem's edges: half of a stem may lie in its own shadow.
    pub(super) fn centre(&mut self, image: &SmoothedImage, first: usize, last: usize) {
        let normals: Vec<PlanePoint> =
            (0..self.line.len()).map(|i| normal(&self.line, i, POINTS_PER_WIDTH / 2)).collect();
        let (Some(left), Some(right)) =
            (self.edges(image, &normals, first, last, 0), self.edges(image, &normals, first, last, 1))
        else {
            return;
        };
        let shifts: Vec<f64> = left.iter().zip(&right).map(|(left, right)| (right - left) / 2.0).collect();
        let mean_shift = |i: usize| {
            let i = i.clamp(first, last) - first;
            let radius = 3 * POINTS_PER_WIDTH / 4;
            statistics::mean(shifts[window(i, radius, shifts.len())].iter().copied())
        };
        let moved: Vec<PlanePoint> =
            (0..self.line.len()).map(|i| along(self.line[i], normals[i], mean_shift(i))).collect();
        self.line = smooth(&moved, POINTS_PER_WIDTH / 4);
    }

    /// Distance of the stem's edge on one side (0 is left) from the line, for each point from `first` to `last`;
    /// `None` where too few edges are found.
    fn edges(
        &self,
        image: &SmoothedImage,
        normals: &[PlanePoint],
        first: usize,
        last: usize,
        side: usize,
    ) -> Option<Vec<f64>> {
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let colour = |i: usize, across: f64| {
            let near = window(i, POINTS_PER_WIDTH / 4, self.line.len());
            mean(near.map(|i| image.at(along(self.line[i], normals[i], across))))
        };
        let found: Vec<Option<f64>> = (first..=last)
            .map(|i| {
                let radius = 3 * POINTS_PER_WIDTH;
                let around = i.saturating_sub(radius).max(first)..=(i + radius).min(last);
                let flank = rgb::median(&around.map(|i| self.outer_colour(i, side)).collect::<Vec<_>>());
                // From the middle outwards, the first sample of the flank's colour after one of the stem's.
                let mut was_inside = false;
                let offsets = (0..(2.5 * self.width) as u32).map(|half| 0.5 * f64::from(half));
                offsets.into_iter().find(|&across| {
                    let is_outside =
                        distance(colour(i, sign * across), flank) < EDGE_CONTRAST * self.contrast;
                    was_inside |= !is_outside;
                    was_inside && is_outside && across > 0.2 * self.width
                })
            })
            .collect();
        let radius = 5 * POINTS_PER_WIDTH / 4;
        let medians: Vec<Option<f64>> = (0..found.len())
            .map(|i| {
                let near = &found[window(i, radius, found.len())];
                let edges: Vec<f64> = near.iter().copied().flatten().collect();
                (!edges.is_empty()).then(|| quantile_nearest(&edges, 0.5))
            })
            .collect();
        let all: Vec<f64> = found.iter().copied().flatten().collect();
        let overall = quantile_nearest(&all, 0.5);
        (all.len() > 2).then(|| medians.into_iter().map(|edge| edge.unwrap_or(overall)).collect())
    }
}

/// The last of `points` before a change that does not pass; the first one where all have changed.
fn last_unchanged(points: impl Iterator<Item = usize>, changes: &[bool]) -> usize {
    let mut last = None;
    for i in points {
        let since = last.map_or(0, |last: usize| last.abs_diff(i));
        if !changes[i] || last.is_none() {
            last = Some(i);
        } else if since > PASSING_POINTS {
            break;
        }
    }
    last.unwrap_or(0)
}
