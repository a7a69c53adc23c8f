//! What lies beside a stem.

use crate::math;
use crate::vision::detect::curve::{Place, smoothed};
use crate::vision::detect::ridge::bar::{Colour, SmoothedImage, colour_distance, mean_colour, median_colour};

/// Samples along a stem's width, once its way is known.
pub(super) const FINE: usize = 8;

/// Bands on each side, where what lies beside the stem is compared: from how far to how far from its middle, in widths.
const BANDS: usize = 4;

const SIDE: (f64, f64) = (0.75, 2.25);

/// A band has changed when its colour differs by more than this share of the stem's contrast, and what lies beside the
/// stem when so many of all bands have.
const CHANGED: f64 = 0.2;

const CHANGES: usize = 2;

/// Samples over which a change may last without being the end: a mark that is painted on the stem, a leaf's tip.
const PASSING: usize = 12;

/// Samples that a stretch begins with.
const WINDOW: usize = 12;

/// A stretch of the stem is at least this share of the longest; the first such is believed.
const SHARE: f64 = 0.4;

/// The stem's edge is where its colour comes within this share of the contrast of what lies beside it.
const EDGE: f64 = 0.2;

/// What lies along a line: the stem's colour and what is beside it.
pub(super) struct StemFlanks {
    /// Points, a stem's width by [`FINE`] apart.
    pub(super) line: Vec<Place>,
    width: f64,
    /// The stem's colour at each point.
    stem: Vec<Colour>,
    /// The colours of the bands beside it, those on the left first.
    bands: Vec<[Colour; 2 * BANDS]>,
    /// How far the stem's colour is from that of the bands, on the lower half.
    pub(super) contrast: f64,
}

impl StemFlanks {
    pub(super) fn along(picture: &SmoothedImage, line: Vec<Place>, width: f64) -> Self {
        let normals: Vec<Place> = (0..line.len()).map(|i| normal(&line, i)).collect();
        let colour = |i: usize, across: f64| {
            picture.at((line[i].0 + across * width * normals[i].0, line[i].1 + across * width * normals[i].1))
        };
        let breadth = (SIDE.1 - SIDE.0) / BANDS as f64;
        let band = |i: usize, band: usize| {
            let (side, band) = if band < BANDS { (-1.0, band) } else { (1.0, band - BANDS) };
            let from = SIDE.0 + breadth * band as f64;
            mean_colour([0.17, 0.5, 0.83].into_iter().map(|share| colour(i, side * (from + share * breadth))))
        };
        let stem: Vec<Colour> = (0..line.len())
            .map(|i| mean_colour([-0.3, -0.15, 0.0, 0.15, 0.3].into_iter().map(|across| colour(i, across))))
            .collect();
        let bands: Vec<[Colour; 2 * BANDS]> =
            (0..line.len()).map(|i| std::array::from_fn(|j| band(i, j))).collect();
        // Half a width along the line, on the mean.
        let near = |i: usize| i.saturating_sub(FINE / 4)..(i + FINE / 4 + 1).min(line.len());
        let stem: Vec<Colour> = (0..line.len()).map(|i| mean_colour(stem[near(i)].iter().copied())).collect();
        let bands: Vec<[Colour; 2 * BANDS]> = (0..line.len())
            .map(|i| std::array::from_fn(|j| mean_colour(bands[near(i)].iter().map(|bands| bands[j]))))
            .collect();
        let clear = |i: usize| {
            bands[i].iter().map(|&band| colour_distance(stem[i], band)).sum::<f64>() / (2 * BANDS) as f64
        };
        let contrast = math::statistics::quantile_nearest(
            &(0..line.len().div_ceil(2)).map(clear).collect::<Vec<_>>(),
            0.5,
        )
        .max(1e-6);
        Self { line, width, stem, bands, contrast }
    }

    /// What lies beside the points that `is_in`, on the median.
    fn beside(&self, from: usize, to: usize, is_in: impl Fn(usize) -> bool) -> [Colour; 2 * BANDS] {
        let points: Vec<usize> = (from..=to).filter(|&i| is_in(i)).collect();
        std::array::from_fn(|j| median_colour(&points.iter().map(|&i| self.bands[i][j]).collect::<Vec<_>>()))
    }

    /// For each point whether what lies beside it differs from `reference`.
    fn changes(&self, reference: &[Colour; 2 * BANDS]) -> Vec<bool> {
        let is_changed =
            |(band, wanted): &(&Colour, &Colour)| colour_distance(**band, **wanted) > CHANGED * self.contrast;
        self.bands
            .iter()
            .map(|bands| bands.iter().zip(reference).filter(is_changed).count() >= CHANGES)
            .collect()
    }

    /// The first and the last point of the stretch along which what lies beside the stem stays the same; `None` without.
    pub(super) fn stretch(&self) -> Option<(usize, usize)> {
        let mut stretches: Vec<(usize, usize)> = Vec::new();
        let mut start = 0;
        while start + WINDOW <= self.line.len() {
            let mut changes = self.changes(&self.beside(start, start + WINDOW - 1, |_| true));
            if changes[start..start + WINDOW].iter().filter(|&&is_changed| is_changed).count() > WINDOW / 5 {
                start += FINE / 4;
                continue;
            }
            let mut last = reach(start..self.line.len(), &changes);
            // What lies beside all of it tells better than what lies beside its beginning.
            for _ in 0..6 {
                let again = self.changes(&self.beside(start, last, |i| !changes[i]));
                if again == changes {
                    break;
                }
                changes = again;
                last = reach(start..self.line.len(), &changes);
            }
            let first = reach((0..=start).rev(), &changes);
            stretches.push((first, last));
            start = last.max(start + FINE / 4);
        }
        let long = |&(first, last): &(usize, usize)| last - first;
        let longest = stretches.iter().map(long).max()?;
        stretches.into_iter().find(|stretch| long(stretch) as f64 >= SHARE * longest as f64)
    }

    /// How much the stem stands out on its less clear side, where it does least: at a fifth of the points from `first` to
    /// `last` by less.
    pub(super) fn least(&self, first: usize, last: usize) -> f64 {
        let clear = |i: usize| {
            self.bands[i]
                .iter()
                .map(|&band| colour_distance(self.stem[i], band))
                .fold(f64::INFINITY, f64::min)
        };
        math::statistics::quantile_nearest(&(first..=last).map(clear).collect::<Vec<_>>(), 0.2)
    }

    /// Moves the line to the middle between the stem's edges, where half of a stem may lie in its own shadow.
    pub(super) fn centre(&mut self, picture: &SmoothedImage, first: usize, last: usize) {
        let normals: Vec<Place> = (0..self.line.len()).map(|i| normal(&self.line, i)).collect();
        let colour = |i: usize, across: f64| {
            let near = i.saturating_sub(FINE / 4)..(i + FINE / 4 + 1).min(self.line.len());
            mean_colour(near.map(|i| {
                picture.at((self.line[i].0 + across * normals[i].0, self.line[i].1 + across * normals[i].1))
            }))
        };
        // The edge of each side at each point, as far as it is seen.
        let edges = |side: usize| -> Option<Vec<f64>> {
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let far =
                |i: usize| mean_colour(self.bands[i][side * BANDS + 1..(side + 1) * BANDS].iter().copied());
            let seen: Vec<Option<f64>> = (first..=last)
                .map(|i| {
                    let around = i.saturating_sub(3 * FINE).max(first)..=(i + 3 * FINE).min(last);
                    let wall = median_colour(&around.map(far).collect::<Vec<_>>());
                    let mut is_inside = false;
                    (0..(2.5 * self.width) as u32).map(|half| 0.5 * f64::from(half)).find(|&across| {
                        let is_wall = colour_distance(colour(i, sign * across), wall) < EDGE * self.contrast;
                        is_inside |= !is_wall;
                        is_inside && is_wall && across > 0.2 * self.width
                    })
                })
                .collect();
            let middle = |i: usize, reach: usize| i.saturating_sub(reach)..(i + reach + 1).min(seen.len());
            let medians: Vec<Option<f64>> = (0..seen.len())
                .map(|i| {
                    let near: Vec<f64> = seen[middle(i, 5 * FINE / 4)].iter().copied().flatten().collect();
                    (!near.is_empty()).then(|| math::statistics::quantile_nearest(&near, 0.5))
                })
                .collect();
            let all: Vec<f64> = seen.iter().copied().flatten().collect();
            let usual = math::statistics::quantile_nearest(&all, 0.5);
            (all.len() > 2).then(|| medians.into_iter().map(|edge| edge.unwrap_or(usual)).collect())
        };
        let (Some(left), Some(right)) = (edges(0), edges(1)) else { return };
        let shifts: Vec<f64> = left.iter().zip(&right).map(|(left, right)| (right - left) / 2.0).collect();
        let shift = |i: usize| {
            let i = i.clamp(first, last) - first;
            let near = &shifts[i.saturating_sub(3 * FINE / 4)..(i + 3 * FINE / 4 + 1).min(shifts.len())];
            near.iter().sum::<f64>() / near.len() as f64
        };
        let moved: Vec<Place> = (0..self.line.len())
            .map(|i| {
                let by = shift(i);
                (self.line[i].0 + by * normals[i].0, self.line[i].1 + by * normals[i].1)
            })
            .collect();
        self.line = smoothed(&moved, FINE / 4);
    }
}

/// The last of `points` before a change that is no passing one; the first one if there is none.
fn reach(points: impl Iterator<Item = usize>, changes: &[bool]) -> usize {
    let mut last = None;
    for i in points {
        let since = last.map_or(0, |last: usize| last.abs_diff(i));
        if !changes[i] || last.is_none() {
            last = Some(i);
        } else if since > PASSING {
            break;
        }
    }
    last.unwrap_or(0)
}

/// The unit vector across a line at one of its points, to the right of where it goes.
fn normal(line: &[Place], i: usize) -> Place {
    let (from, to) = (line[i.saturating_sub(FINE / 2)], line[(i + FINE / 2).min(line.len() - 1)]);
    let length = math::hypot(to.0 - from.0, to.1 - from.1).max(1e-9);
    ((from.1 - to.1) / length, (to.0 - from.0) / length)
}
