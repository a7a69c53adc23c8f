//! Midline of a stem before any background, learned from root and tip in a few pictures.
//!
//! In: pictures in which root and tip are known. Out: the midline in any other picture of the series between its root and tip.
//! The one idea: the cheapest path between the two clicks shows what the plant looks like, and what is far from it what the
//! background looks like; a random forest separates them in all pictures.
//!
//! A step costs more where plant is less probable, and near the edge of what is probably plant, so the line keeps to the middle.
//! What is deeper than a stem is no cheaper than its middle: a line is not drawn into leaves. It ends at the given end, whatever
//! the forest sees there. The probability along the line says how far it is to be trusted.
//!
//! If nothing else is said, constants were chosen on the first half of the lines of `scripts/score-clicks`, without the bean.

use crate::geometry::{Pixel, Region};
use crate::math::statistics::upper_median;
use crate::math::vector::{Vec2, between, distance};
use crate::vision::detect::curve::{PlanePoint, resample, smooth, window};
use crate::vision::detect::distance_transform::distance_transform;
use crate::vision::detect::forest::{FEATURES, Features, Forest};
use crate::vision::detect::geodesic::{GeodesicGrid, NONE as NO_PATH};
use crate::vision::detect::midline::smooth_path;
use crate::vision::raster::filter::{sample_gaussian, smooth_gaussian};
use crate::vision::raster::plane::{LUMA, Plane};
use crate::vision::raster::source::{PixelSource, aligned_region};

/// Samples along the tallest plant of the clicks, about.
const HEIGHT: f64 = 200.0;

/// Weights of red, green and blue: luma, red against green, and yellow against blue.
const CHANNELS: [[f32; 3]; 3] = [LUMA, [0.5, -0.5, 0.0], [0.25, 0.25, -0.5]];

/// Standard deviations of the filters of features, in samples.
const SCALES: [f64; 3] = [1.0, 2.5, 6.0];

/// Factors that spread features over the levels of a byte: differences of scales, second derivatives, gradients.
const DETAIL_GAIN: f32 = 2.0;
const CURVATURE_GAIN: f32 = 4.0;
const GRADIENT_GAIN: f32 = 4.0;

/// Distance from a line up to which samples are plant, in samples, and from which on they are not, as a share of the plant's
/// height, and at least in samples.
const PLANT_RADIUS: u32 = 1;
const FAR_SHARE: f64 = 0.1;
const LEAST_FAR: f64 = 4.0;

/// Margin around root and tip in which examples of the background are taken, and samples around the lines of the clicks among
/// which a line is searched, as shares of the plant's height.
const MARGIN_SHARE: f64 = 0.5;
const BAND_SHARE: f64 = 0.15;

/// Probability from which on a sample is plant, and least probability: the cost of a step grows with its inverse.
const PLANT: f32 = 0.5;
const LEAST_PROBABILITY: f32 = 0.05;

/// Cost of a step, and what an edge adds over the squared distance to it in samples. Half and twice of that do as well.
const STEP_COST: f32 = 10.0;
const EDGE_COST: f32 = 40.0;

/// Chamfer distance (three a sample) from the middle of a stem to its edge before anything is learned, and at least.
const FIRST_DEPTH: u32 = 9;
const LEAST_DEPTH: u32 = 4;

/// Share of a line over which its probability is averaged.
const WINDOW_SHARE: f64 = 0.1;

/// Rounds of learning: from the second on, lines are those of the forest before. Two do nearly as well, four no better.
const ROUNDS: usize = 3;

/// A picture in which root and tip of the plant are known.
#[derive(Clone, Copy)]
pub struct KnownEnds<'a> {
    /// The picture.
    pub picture: &'a dyn PixelSource,
    /// Where the stem leaves the soil.
    pub root: Pixel,
    /// The tip.
    pub tip: Pixel,
}

/// A midline from the root up, and how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedLine {
    /// The line, in pixels; it ends at the tip.
    pub line: Vec<Pixel>,
    /// The least probability of plant along it, 0 to 1.
    pub confidence: f64,
}

/// What a plant's stem looks like.
#[derive(Clone, Debug)]
pub struct LearnedStem {
    forest: Forest,
    /// Pixels along a sample.
    step: usize,
    /// Chamfer distance from the middle of the stem to its edge.
    depth: u32,
    /// The lines of the clicks, from the root at (0, 0) to the tip at (1, 0).
    lines: Vec<Vec<Vec2>>,
}

impl LearnedStem {
    /// Learns from pictures with known ends; `None` where there is nothing to learn from.
    #[must_use]
    pub fn learn<'a>(examples: &[KnownEnds<'a>]) -> Option<Self> {
        let tallest = examples.iter().map(|example| example.root.distance(example.tip)).fold(0.0, f64::max);
        let step = ((tallest / HEIGHT).ceil() as usize).max(1);
        let surroundings = |example: KnownEnds<'a>| {
            let margin = MARGIN_SHARE * example.root.distance(example.tip);
            Some((example, Surroundings::of(example.picture, &[example.root, example.tip], margin, step)?))
        };
        let examples: Vec<_> = examples.iter().copied().filter_map(surroundings).collect();
        let mut learned: Option<Self> = None;
        for _ in 0..ROUNDS {
            let (mut plant, mut other) = (Vec::new(), Vec::new());
            let (mut lines, mut depths) = (Vec::new(), Vec::new());
            for (example, around) in &examples {
                let everywhere = vec![true; around.features.len()];
                let likeness = match &learned {
                    Some(learned) => around.probability(&learned.forest, &everywhere),
                    None => around.ridges(),
                };
                let depth = learned.as_ref().map_or(FIRST_DEPTH, |learned| learned.depth);
                let Some((line, along)) = trace(&likeness, &everywhere, depth, [example.root, example.tip])
                else {
                    continue;
                };
                depths.extend(along);
                let far = LEAST_FAR.max(FAR_SHARE * example.root.distance(example.tip) / step as f64);
                let from_line = around.distance_from(std::slice::from_ref(&line));
                for (&distance, features) in from_line.iter().zip(&around.features) {
                    if distance <= 3 * PLANT_RADIUS {
                        plant.push(*features);
                    } else if f64::from(distance) > 3.0 * far {
                        other.push(*features);
                    }
                }
                lines.push(line.iter().map(|&at| in_axis(around.plane.to_pixel(at), example)).collect());
            }
            let depth = upper_median(&depths, u32::cmp)?.max(LEAST_DEPTH);
            learned = Some(Self { forest: Forest::learn(&plant, &other)?, step, depth, lines });
        }
        learned
    }

    /// The midline between root and `end`, a point of the stem, in a picture with known root and tip; `None` where no picture is
    /// there.
    #[must_use]
    pub fn line(&self, known: KnownEnds<'_>, end: Pixel) -> Option<LearnedLine> {
        let guides: Vec<Pixel> = self.lines.iter().flatten().map(|&at| from_axis(at, &known)).collect();
        let corners: Vec<Pixel> = guides.iter().copied().chain([known.root, known.tip, end]).collect();
        let band = BAND_SHARE * known.root.distance(known.tip);
        let around = Surroundings::of(known.picture, &corners, band, self.step)?;
        let mut guides = guides.iter().map(|&at| around.plane.to_sample(at));
        let guides: Vec<Vec<PlanePoint>> =
            self.lines.iter().map(|line| guides.by_ref().take(line.len()).collect()).collect();
        let band = 3.0 * band / self.step as f64;
        let is_near: Vec<bool> =
            around.distance_from(&guides).into_iter().map(|distance| f64::from(distance) <= band).collect();
        let likeness = around.probability(&self.forest, &is_near);
        let (line, _) = trace(&likeness, &is_near, self.depth, [known.root, end])?;
        let values: Vec<f64> = line.iter().map(|&at| likeness.bilinear(at)).collect();
        let radius = (0.5 * WINDOW_SHARE * values.len() as f64) as usize;
        let mean = |i: usize| {
            let near = &values[window(i, radius, values.len())];
            near.iter().sum::<f64>() / near.len() as f64
        };
        let confidence = (radius..values.len() - radius).map(mean).fold(1.0, f64::min);
        Some(LearnedLine { line: line.iter().map(|&at| around.plane.to_pixel(at)).collect(), confidence })
    }
}

/// A pixel in the axes of a plant: the root is (0, 0), and the tip (1, 0).
fn in_axis(at: Pixel, KnownEnds { root, tip, .. }: &KnownEnds<'_>) -> Vec2 {
    let (axis, at) = (*tip - *root, at - *root);
    let square = (axis.x * axis.x + axis.y * axis.y).max(1e-9);
    [(at.x * axis.x + at.y * axis.y) / square, (at.y * axis.x - at.x * axis.y) / square]
}

/// The inverse of [`in_axis`].
fn from_axis([along, across]: Vec2, KnownEnds { root, tip, .. }: &KnownEnds<'_>) -> Pixel {
    let axis = *tip - *root;
    *root + Pixel::new(along * axis.x - across * axis.y, along * axis.y + across * axis.x)
}

/// The cheapest path from `root` to `end` through the samples that are `within`, and the chamfer distance to the edge of the
/// plant along it. What is more than `depth` from an edge is as cheap as the middle of the stem.
fn trace(
    likeness: &Plane,
    within: &[bool],
    depth: u32,
    [root, end]: [Pixel; 2],
) -> Option<(Vec<PlanePoint>, Vec<u32>)> {
    let is_plant: Vec<bool> = likeness.values.iter().map(|&value| value >= PLANT).collect();
    let edge_distance = distance_transform(&is_plant, likeness.width);
    let cost = |at: usize| {
        if !within[at] {
            return NO_PATH;
        }
        let samples = if is_plant[at] { edge_distance[at].min(depth) as f32 / 3.0 } else { 1.0 };
        ((STEP_COST + EDGE_COST / (samples * samples)) / likeness.values[at].max(LEAST_PROBABILITY)) as u32
    };
    let costs: Vec<u32> = (0..within.len()).map(cost).collect();
    let grid = GeodesicGrid::of_costs(&costs, likeness.width);
    let [start, goal] = [root, end].map(|at| grid.sample(likeness.to_sample(at)));
    let path = grid.shortest_paths(start?).path_to(goal?).filter(|path| path.len() > 2)?;
    let points: Vec<PlanePoint> = path.iter().map(|&at| grid.point(at)).collect();
    let depths =
        points.iter().map(|[x, y]| edge_distance[*y as usize * likeness.width + *x as usize]).collect();
    let mut line = resample(&smooth(&smooth_path(&grid, &path), (depth / 3) as usize), 1.0);
    let last = line.len() - 1;
    (line[0], line[last]) = (likeness.to_sample(root), likeness.to_sample(end));
    Some((line, depths))
}

/// Part of a picture around a plant.
struct Surroundings {
    /// Luma at the finest scale.
    plane: Plane,
    /// Second derivatives, the greatest over channels and scales.
    ridges: Vec<f32>,
    features: Vec<Features>,
}

impl Surroundings {
    /// The part of a picture within `margin` pixels of some points; `None` where that is too small.
    fn of(picture: &dyn PixelSource, points: &[Pixel], margin: f64, step: usize) -> Option<Self> {
        let (width, height) = picture.size();
        let side = |of: fn(&Pixel) -> f64, size: usize| {
            let least = points.iter().map(of).fold(f64::INFINITY, f64::min) - margin;
            let most = points.iter().map(of).fold(f64::NEG_INFINITY, f64::max) + margin;
            let first = least.clamp(0.0, size as f64) as usize;
            (first, ((most + 1.0).clamp(0.0, size as f64) as usize).saturating_sub(first))
        };
        let ((x, width), (y, height)) = (side(|at| at.x, width), side(|at| at.y, height));
        let region = aligned_region(Region { x, y, width, height }, step)
            .filter(|region| region.width.min(region.height) >= 8 * step)?;
        let image = picture.downscale(region, step);
        let whole = Region::whole(image.size());
        let planes: [[Plane; SCALES.len()]; CHANNELS.len()] = CHANNELS.map(|channel| {
            let fine = sample_gaussian(&image, whole, channel, SCALES[0], 1);
            let rest = |from: f64, to: f64| (to * to - from * from).sqrt();
            let middle = smooth_gaussian(&fine, rest(SCALES[0], SCALES[1]));
            let coarse = smooth_gaussian(&middle, rest(SCALES[1], SCALES[2]));
            [fine, middle, coarse]
        });
        let count = whole.width * whole.height;
        let mut features = vec![[0_u8; FEATURES]; count];
        let mut column = 0;
        let mut add = |value: &dyn Fn(usize) -> f32| {
            for (at, features) in features.iter_mut().enumerate() {
                features[column] = value(at).clamp(0.0, 255.0) as u8;
            }
            column += 1;
        };
        for (index, [fine, _, coarse]) in planes.iter().enumerate() {
            let zero = if index == 0 { 0.0 } else { 128.0 };
            add(&|at| zero + fine.values[at]);
            add(&|at| zero + coarse.values[at]);
            add(&|at| 128.0 + DETAIL_GAIN * (fine.values[at] - coarse.values[at]));
        }
        let mut ridges = vec![0.0_f32; count];
        for (index, scales) in planes.iter().enumerate() {
            for (plane, scale) in scales.iter().zip(SCALES) {
                let area = (scale * scale) as f32;
                let curvatures: Vec<[f32; 2]> =
                    (0..count).map(|at| curvature(plane, at).map(|one| area * one)).collect();
                for (ridge, [least, most]) in ridges.iter_mut().zip(&curvatures) {
                    *ridge = ridge.max(least.abs().max(most.abs()));
                }
                if index == 0 && scale < SCALES[2] {
                    add(&|at| 128.0 + CURVATURE_GAIN * curvatures[at][0]);
                    add(&|at| 128.0 + CURVATURE_GAIN * curvatures[at][1]);
                    add(&|at| GRADIENT_GAIN * scale as f32 * gradient(plane, at));
                }
            }
        }
        let [[fine, ..], ..] = planes;
        let middle = (step - 1) as f64 / 2.0;
        let origin = Pixel::new(region.x as f64 + middle, region.y as f64 + middle);
        Some(Self { plane: Plane { origin, step, ..fine }, ridges, features })
    }

    fn plane_of(&self, values: Vec<f32>) -> Plane {
        Plane { values, ..Plane { values: Vec::new(), ..self.plane } }
    }

    /// Likeness to a ridge or a valley, 0 to 1.
    fn ridges(&self) -> Plane {
        let mut sorted = self.ridges.clone();
        let rank = 95 * (sorted.len() - 1) / 100;
        let most = sorted.select_nth_unstable_by(rank, f32::total_cmp).1.max(1.0);
        self.plane_of(self.ridges.iter().map(|ridge| (ridge / most).min(1.0)).collect())
    }

    /// Probability of plant of the samples that are `within`.
    fn probability(&self, forest: &Forest, within: &[bool]) -> Plane {
        let value = |(features, &is_within)| if is_within { forest.probability(features) } else { 0.0 };
        self.plane_of(self.features.iter().zip(within).map(value).collect())
    }

    /// Chamfer distance of each sample from some lines, three a sample.
    fn distance_from(&self, lines: &[Vec<PlanePoint>]) -> Vec<u32> {
        let (width, height) = (self.plane.width, self.plane.height);
        let mut is_line = vec![false; width * height];
        for pair in lines.iter().flat_map(|line| line.windows(2)) {
            let steps = (2.0 * distance(pair[0], pair[1])).ceil() as usize;
            for step in 0..=steps {
                let [x, y] = between(pair[0], pair[1], step as f64 / steps.max(1) as f64);
                let (x, y) = (x.round(), y.round());
                if x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64 {
                    is_line[y as usize * width + x as usize] = true;
                }
            }
        }
        let mut distances = distance_transform(&is_line, width);
        distances.iter_mut().zip(&is_line).filter(|(_, is_line)| **is_line).for_each(|(far, _)| *far = 0);
        distances
    }
}

/// Values at the eight neighbours and the sample itself, row by row; beyond the edge the outermost samples are repeated.
fn around(plane: &Plane, at: usize) -> [[f32; 3]; 3] {
    let (x, y) = (at % plane.width, at / plane.width);
    let columns = [x.saturating_sub(1), x, (x + 1).min(plane.width - 1)];
    let rows = [y.saturating_sub(1), y, (y + 1).min(plane.height - 1)];
    rows.map(|y| columns.map(|x| plane.values[y * plane.width + x]))
}

/// Eigenvalues of the matrix of second derivatives, the smaller first.
fn curvature(plane: &Plane, at: usize) -> [f32; 2] {
    let [[a, b, c], [d, e, f], [g, h, i]] = around(plane, at);
    let (xx, yy, xy) = (d - 2.0 * e + f, b - 2.0 * e + h, 0.25 * (a - c - g + i));
    let half_difference = 0.5 * (xx - yy);
    let root = (half_difference * half_difference + xy * xy).sqrt();
    [0.5 * (xx + yy) - root, 0.5 * (xx + yy) + root]
}

/// Length of the gradient.
fn gradient(plane: &Plane, at: usize) -> f32 {
    let [[_, b, _], [d, _, f], [_, h, _]] = around(plane, at);
    let (dx, dy) = (0.5 * (f - d), 0.5 * (h - b));
    (dx * dx + dy * dy).sqrt()
}
