//! Errors of stems and midlines against those published with real pictures.

use std::path::Path;

use tropism::geometry::{Pixel, Point, Polyline};
use tropism::math::{self, statistics::quantile_nearest};
use tropism::photo::{Image, Photo};
use tropism::vision::detect::silhouette::silhouette_midline;

use crate::marks::{Row, rows};

/// Mean distance from the marked stem, in % of its length, above which a stem is wrong.
pub(crate) const WRONG: f64 = 10.0;

/// Reads the picture at `path`.
pub(crate) fn open(path: &Path) -> Image {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Photo { name: path.display().to_string(), bytes, time_s: 0.0 }.decode().expect("a whole photograph")
}

/// Distance of a point from a line.
pub(crate) fn off(point: Point, line: &Polyline) -> f64 {
    foot(point, line).0
}

/// Distance of a point from a line, position of its foot as a segment's number and a share of it, and the foot.
fn foot(point: Point, line: &Polyline) -> (f64, (usize, f64), Point) {
    let mut nearest = (f64::INFINITY, (0, 0.0), point);
    for (number, pair) in line.0.windows(2).enumerate() {
        let (dx, dy) = (pair[1].x - pair[0].x, pair[1].y - pair[0].y);
        let share =
            ((point.x - pair[0].x) * dx + (point.y - pair[0].y) * dy) / (dx * dx + dy * dy).max(1e-12);
        let share = share.clamp(0.0, 1.0);
        let at = Point::new(pair[0].x + share * dx, pair[0].y + share * dy);
        let far = point.distance(at);
        if far < nearest.0 {
            nearest = (far, (number, share), at);
        }
    }
    nearest
}

/// Length of a line up to a share of one of its segments.
fn walked(line: &Polyline, (number, share): (usize, f64)) -> f64 {
    let mut lengths = line.0.windows(2).map(|pair| pair[0].distance(pair[1]));
    let before = lengths.by_ref().take(number).sum::<f64>();
    before + share * lengths.next().unwrap_or(0.0)
}

/// Relative difference, in %, between the length of the published line and that of the found one between the feet of
/// the published line's ends. The published line is laid on the found one first, by translation only.
fn between(found: &Polyline, published: &Polyline) -> f64 {
    let mut laid = published.resampled(100);
    for _ in 0..50 {
        let steps = laid.0.iter().map(|&at| (at, foot(at, found).2));
        let step = steps.fold(Point::default(), |sum, (at, on)| {
            Point::new(sum.x + (on.x - at.x) / 100.0, sum.y + (on.y - at.y) / 100.0)
        });
        laid.0.iter_mut().for_each(|at| *at = Point::new(at.x + step.x, at.y + step.y));
    }
    let along = |at: usize| walked(found, foot(laid.0[at], found).1);
    100.0 * ((along(99) - along(0)) / published.length() - 1.0)
}

/// Mean distance between two lines, in both directions, in % of the second's length.
fn apart(found: &Polyline, marked: &Polyline) -> f64 {
    let one = |from: &Polyline, to: &Polyline| {
        let points = from.resampled(50).0;
        points.iter().map(|&point| off(point, to)).sum::<f64>() / points.len() as f64
    };
    100.0 * 0.5 * (one(found, marked) + one(marked, found)) / marked.length()
}

/// The marked stem of a row, from base to tip.
pub(crate) fn marked(row: &Row) -> Vec<Pixel> {
    let number = |text: &str| text.parse::<f64>().expect("a pixel");
    row.text("points_base_to_tip_px")
        .split(';')
        .filter_map(|point| point.split_once(' '))
        .map(|(x, y)| Pixel::new(number(x), number(y)))
        .collect()
}

/// Errors of a stem.
pub(crate) struct StemErrors {
    /// Mean distance from the marked stem, in both directions, in % of its length.
    pub(crate) distance: f64,
    /// Error of the length without its sign, in %.
    pub(crate) length: f64,
    /// Distance of its end from the marked end, in pixels.
    pub(crate) end: f64,
}

impl StemErrors {
    /// Errors of the stem `found` against the `marked` one.
    pub(crate) fn between(found: &[Pixel], marked: &[Pixel]) -> Self {
        let line = |pixels: &[Pixel]| Polyline(pixels.iter().map(|at| Point::new(at.x, at.y)).collect());
        let (end, marked_end) = (found[found.len() - 1], marked[marked.len() - 1]);
        let (found, marked) = (line(found), line(marked));
        Self {
            distance: apart(&found, &marked),
            length: 100.0 * (found.length() / marked.length() - 1.0).abs(),
            end: end.distance(marked_end),
        }
    }
}

/// The numbers of the bean shoots in a folder, sorted.
pub(crate) fn shoots(folder: &Path) -> Vec<String> {
    let mut numbers: Vec<String> = std::fs::read_dir(folder)
        .expect("the folder of silhouettes")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix("_contour.csv").map(str::to_owned))
        .collect();
    numbers.sort();
    numbers
}

/// Errors of the midline that the library gives for a silhouette.
pub(crate) fn library_midline(folder: &Path, number: &str) -> Option<[Shoot; 2]> {
    midline(folder, number, silhouette_midline)
}

/// Errors of a shoot's midline, as `trace` finds it from the base, against the published one: as it is, and smoothed as
/// the published one is. `None` where no midline is found.
pub(crate) fn midline(
    folder: &Path,
    number: &str,
    trace: impl Fn(&Image, Pixel) -> Option<Vec<Pixel>>,
) -> Option<[Shoot; 2]> {
    let path = |kind: &str| folder.join(format!("{number}_{kind}.csv"));
    // The columns are called x,y in some files and x(pix),y(pix) in others.
    let place = |row: &Row| Some(Pixel::new(row.record[0].parse().ok()?, row.record[1].parse().ok()?));
    let contour: Vec<Pixel> = rows(&path("contour")).iter().filter_map(place).collect();
    let (x, y) = ("x_reoriented(pix)", "y_reoriented(pix)");
    let published =
        rows(&path("skeleton")).iter().map(|row| Point::new(row.number(x), row.number(y))).collect();
    compare(&contour, &Polyline(published), trace)
}

/// Errors of a shoot's midline.
pub(crate) struct Shoot {
    /// Error of its length, in %.
    pub(crate) length: f64,
    /// Error of its length between the feet of the published line's ends, in %: compares the paths, not the ends.
    pub(crate) between: f64,
    /// Mean distance, in % of the length.
    pub(crate) distance: f64,
}

fn compare(
    contour: &[Pixel],
    published: &Polyline,
    trace: impl Fn(&Image, Pixel) -> Option<Vec<Pixel>>,
) -> Option<[Shoot; 2]> {
    let (image, base) = filled(contour);
    let stem = trace(&image, base)?;
    let line = Polyline(stem.iter().map(|at| Point::new(at.x, -at.y)).collect());
    let smooth = smoothed(&line, smoothing(published));
    Some([line, smooth].map(|line| {
        // As published: the base at the origin, y up, mirrored so that the tip lies at positive x.
        let (first, last) = (line.0[0], line.0[line.0.len() - 1]);
        let side = if last.x >= first.x { 1.0 } else { -1.0 };
        let placed = line.0.iter().map(|at| Point::new(side * (at.x - first.x), at.y - first.y));
        let found = Polyline(placed.collect());
        Shoot {
            length: 100.0 * (found.length() / published.length() - 1.0),
            between: between(&found, published),
            distance: apart(&found, published),
        }
    }))
}

/// Standard deviation, in pixels, of the Gaussian filter that the published line was smoothed with.
///
/// Its points were evenly spaced before. A filter that mirrors a line at its end draws the end in by 0.8 of its
/// deviation and its points together: at one deviation from the end they are erf(1 / sqrt 2) = 0.683 as far apart as
/// in the middle.
fn smoothing(published: &Polyline) -> f64 {
    let spacings: Vec<f64> = published.0.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    let usual = quantile_nearest(&spacings, 0.5);
    let drawn_in = |spacing: &f64| *spacing < 0.683 * usual;
    let ends = [
        spacings.iter().take_while(|spacing| drawn_in(spacing)).count(),
        spacings.iter().rev().take_while(|spacing| drawn_in(spacing)).count(),
    ];
    usual * (ends[0] + ends[1]) as f64 / 2.0
}

/// Smooths a line by a Gaussian filter of standard deviation `deviation` pixels that mirrors it at its ends.
fn smoothed(line: &Polyline, deviation: f64) -> Polyline {
    let count = line.length().ceil() as usize;
    let even = line.resampled(count).0;
    let reach = (4.0 * deviation).ceil() as i64;
    let bell: Vec<f64> =
        (-reach..=reach).map(|i| math::exp(-0.5 * (i as f64 / deviation.max(0.5)).powi(2))).collect();
    let sum: f64 = bell.iter().sum();
    let mirrored = |i: i64| {
        let i = i.rem_euclid(2 * count as i64) as usize;
        even[if i < count { i } else { 2 * count - 1 - i }]
    };
    let mean = |at: i64| {
        let near = (at - reach..).zip(&bell).map(|(i, weight)| (mirrored(i), weight / sum));
        near.fold(Point::default(), |mean, (at, share)| {
            Point::new(mean.x + share * at.x, mean.y + share * at.y)
        })
    };
    Polyline((0..count as i64).map(mean).collect())
}

/// A light picture of a filled contour before black with a margin, and its lowest point: the base.
fn filled(contour: &[Pixel]) -> (Image, Pixel) {
    const MARGIN: f64 = 40.0;
    let most = |of: fn(&Pixel) -> f64| contour.iter().map(of).fold(0.0, f64::max);
    let (width, height) =
        ((most(|at| at.x) + 2.0 * MARGIN) as usize, (most(|at| at.y) + 2.0 * MARGIN) as usize);
    let mut image = Image { width, height, rgb: vec![10; 3 * width * height] };
    for y in 0..height {
        let at = y as f64 - MARGIN + 0.01;
        let mut crossings: Vec<f64> = (0..contour.len())
            .filter_map(|i| {
                let (one, other) = (contour[i], contour[(i + 1) % contour.len()]);
                ((one.y <= at) != (other.y <= at))
                    .then(|| one.x + (at - one.y) / (other.y - one.y) * (other.x - one.x) + MARGIN)
            })
            .collect();
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            let (from, to) = (pair[0].ceil() as usize, pair[1].floor() as usize);
            if from <= to {
                image.rgb[3 * (y * width + from)..3 * (y * width + to + 1)].fill(220);
            }
        }
    }
    let lowest = contour.iter().max_by(|a, b| a.y.total_cmp(&b.y)).copied().unwrap_or_default();
    let row: Vec<f64> = contour.iter().filter(|at| (at.y - lowest.y).abs() < 1.5).map(|at| at.x).collect();
    let x = row.iter().sum::<f64>() / row.len().max(1) as f64;
    (image, Pixel::new(x + MARGIN, lowest.y + MARGIN))
}
