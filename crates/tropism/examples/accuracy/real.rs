//! Real photographs beside marks made by hand, in pixels.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use tropism::geometry::{Pixel, Point, Polyline, Region};
use tropism::light;
use tropism::math::{self, quantile};
use tropism::photo::{Image, Photo};
use tropism::vision::robust::silhouette;
use tropism::vision::{Calibration, Eye, Mode, VisionConfig, lit, look_from};

use crate::marks::{Row, rows};
use crate::score::off;

fn open(path: &Path) -> Image {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Photo { name: path.display().to_string(), bytes, time_s: 0.0 }.decode().expect("a whole photograph")
}

/// Pixels as points, so that lines can be compared.
fn line(pixels: &[Pixel]) -> Polyline {
    Polyline(pixels.iter().map(|at| Point::new(at.x, at.y)).collect())
}

/// Makes a row of the photographs of a folder.
type Sum = fn(&Path, Mode) -> String;

pub(crate) fn print(folder: &Path, mode: Mode, has: impl Fn(&str) -> bool) {
    println!("\nreal photographs, pixels");
    let rows: [(&str, Sum); 4] = [
        ("real/flora-robotica", flora),
        ("real/sunflower-timelapse", timelapse),
        ("real/sunflower-centerlines", centerlines),
        ("real/bean-silhouettes", silhouettes),
    ];
    for (name, row) in rows.into_iter().filter(|(name, _)| has(name)) {
        println!("{name:28} {}", row(folder, mode));
    }
}

fn within(values: &[f64], most: f64) -> String {
    let near = values.iter().filter(|&&value| value <= most).count();
    format!(
        "median {:.2}, worst {:.2}, within {most} px {near} of {}",
        quantile(values, 0.5),
        quantile(values, 1.0),
        values.len()
    )
}

fn flora(folder: &Path, mode: Mode) -> String {
    let marks = rows(&folder.join("annotations/flora-robotica.csv"));
    let crop = Region { x: 290, y: 150, width: 150, height: 186 };
    let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
    let lights = rows(&folder.join("flora-robotica/light.csv"));
    let (mut lost, mut lamps) = (0, 0);
    let (mut tops, mut ends) = (Vec::new(), Vec::new());
    for row in &lights {
        let file = format!("{}.jpg", row.text("frame"));
        let image = open(&folder.join("flora-robotica").join(&file));
        lamps += usize::from(light::name(lit(&image, None)) == row.text("light"));
        let Some(seen) = look_from(&image, Some(Pixel::new(362.0, 336.0)), &config) else {
            lost += 1;
            continue;
        };
        if let Some(mark) = marks.iter().find(|mark| mark.text("file") == file) {
            tops.push(mark.miss(seen.tip));
            ends.extend(seen.apex.map(|apex| apex.distance(mark.place("apex_"))));
        }
    }
    let files =
        lights.iter().map(|row| folder.join("flora-robotica").join(format!("{}.jpg", row.text("frame"))));
    let calibration = Calibration::flat(Pixel::new(362.0, 336.0), 11.0, 720, 480);
    format!(
        "{} frames, lost {lost}, lit lamp right {lamps}, in order: {} | top: {} | apex: {}",
        lights.len(),
        followed(files, calibration, config),
        within(&tops, 4.0),
        within(&ends, 6.0)
    )
}

/// What an eye makes of photographs in order: how many of each class.
fn followed(files: impl Iterator<Item = PathBuf>, calibration: Calibration, config: VisionConfig) -> String {
    let mut eye = Eye::new(calibration, config).expect("a region inside the picture");
    let mut classes = BTreeMap::new();
    for (index, file) in files.enumerate() {
        let bytes = std::fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let seen = eye.observe(&Photo { name: String::new(), bytes, time_s: 300.0 * index as f64 });
        *classes.entry(seen.class.name()).or_insert(0) += 1;
    }
    classes.into_iter().map(|(class, count)| format!("{class} {count}")).collect::<Vec<_>>().join(", ")
}

/// Each seedling's region and base.
const SUNFLOWERS: [(Region, Pixel); 3] = [
    (Region { x: 130, y: 40, width: 250, height: 258 }, Pixel::new(273.0, 309.0)),
    (Region { x: 430, y: 20, width: 240, height: 275 }, Pixel::new(557.0, 306.0)),
    (Region { x: 730, y: 40, width: 250, height: 255 }, Pixel::new(799.0, 304.0)),
];

fn timelapse(folder: &Path, mode: Mode) -> String {
    let marks = rows(&folder.join("annotations/sunflower-timelapse.csv"));
    let (mut lost, mut tops, mut ends) = (0, Vec::new(), Vec::new());
    for mark in &marks {
        let image = open(&folder.join("sunflower-timelapse").join(mark.text("file")));
        let (crop, base) = SUNFLOWERS[mark.number("plant") as usize - 1];
        let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
        let Some(seen) = look_from(&image, Some(base), &config) else {
            lost += 1;
            continue;
        };
        tops.push(mark.miss(seen.tip));
        if mark.number("node_hidden") == 0.0 {
            ends.extend(seen.apex.map(|apex| apex.distance(mark.place("node_"))));
        }
    }
    let frames = rows(&folder.join("sunflower-timelapse/frames.csv"));
    let order = SUNFLOWERS.map(|(crop, base)| {
        let calibration = Calibration::flat(base, 50.0, 1000, 700);
        let files = frames.iter().map(|row| folder.join("sunflower-timelapse").join(row.text("file")));
        followed(files, calibration, VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() })
    });
    let order = order.join("; ");
    format!(
        "{} marks, lost {lost}, in order: {order} | top: {} | stem end: {}",
        marks.len(),
        within(&tops, 5.0),
        within(&ends, 8.0)
    )
}

/// What is found of a seedling's stem.
struct Answer {
    /// Whether its leaves are closed.
    is_young: bool,
    /// Whether its picture's number is odd: thresholds were chosen on these.
    is_odd: bool,
    /// How far the stem is off in % of its length, where one is found.
    off: Option<f64>,
}

/// The stem marked from base to tip, and what is found when its base is clicked.
fn centerlines(folder: &Path, mode: Mode) -> String {
    let marks = rows(&folder.join("sunflower-centerlines/centerlines.csv"));
    let scored: Vec<Answer> = marks
        .par_iter()
        .map(|row| {
            let number = |text: &str| text.parse::<f64>().expect("a pixel");
            let pixels: Vec<Pixel> = row
                .text("points_base_to_tip_px")
                .split(';')
                .filter_map(|point| point.split_once(' '))
                .map(|(x, y)| Pixel::new(number(x), number(y)))
                .collect();
            let image = open(&folder.join("sunflower-centerlines/images").join(row.text("file")));
            let config = VisionConfig { mode, ..VisionConfig::default() };
            let is_young = ["Hook", "Closed"].contains(&row.text("stage"));
            let is_odd = row.text("file").trim_end_matches(".jpg").ends_with(['1', '3', '5', '7', '9']);
            let seen = look_from(&image, Some(pixels[0]), &config).and_then(|seen| seen.stem);
            Answer { is_young, is_odd, off: seen.map(|stem| apart(&line(&stem), &line(&pixels))) }
        })
        .collect();
    let share = |of: fn(&Answer) -> bool| {
        let off: Vec<f64> = scored.iter().filter(|one| of(one)).filter_map(|one| one.off).collect();
        let all = scored.iter().filter(|one| of(one)).count();
        let wrong = off.iter().filter(|&&off| off > WRONG).count();
        format!(
            "{all}, answered {}, mean distance median {:.2} % of length, wrong (> {WRONG} %) {wrong}",
            off.len(),
            quantile(&off, 0.5)
        )
    };
    format!(
        "Hook and Closed: {} | of these, odd numbers (used to tune): {} | even: {} | all: {}",
        share(|one| one.is_young),
        share(|one| one.is_young && one.is_odd),
        share(|one| one.is_young && !one.is_odd),
        share(|_| true)
    )
}

/// A stem this far from the marked one on the mean, in % of its length, is wrong.
const WRONG: f64 = 10.0;

/// Mean distance between two lines, both ways, in % of the second's length.
fn apart(found: &Polyline, marked: &Polyline) -> f64 {
    let one = |from: &Polyline, to: &Polyline| {
        let points = from.equidistant(50).0;
        points.iter().map(|&point| off(point, to)).sum::<f64>() / points.len() as f64
    };
    100.0 * 0.5 * (one(found, marked) + one(marked, found)) / marked.length()
}

fn silhouettes(folder: &Path, _: Mode) -> String {
    let mut files: Vec<_> = std::fs::read_dir(folder.join("bean-silhouettes"))
        .expect("the folder of silhouettes")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix("_contour.csv").map(str::to_owned))
        .collect();
    files.sort();
    let found: Vec<Option<[Shoot; 2]>> = files
        .par_iter()
        .map(|number| {
            let path = |kind: &str| folder.join("bean-silhouettes").join(format!("{number}_{kind}.csv"));
            // The columns are called x,y in some files and x(pix),y(pix) in others.
            let place =
                |row: &Row| Some(Pixel::new(row.record[0].parse().ok()?, row.record[1].parse().ok()?));
            let contour: Vec<Pixel> = rows(&path("contour")).iter().filter_map(place).collect();
            let (x, y) = ("x_reoriented(pix)", "y_reoriented(pix)");
            let published =
                rows(&path("skeleton")).iter().map(|row| Point::new(row.number(x), row.number(y))).collect();
            compare(&contour, &Polyline(published))
        })
        .collect();
    let known: Vec<[Shoot; 2]> = found.into_iter().flatten().collect();
    let off = |which: usize| {
        let of = |value: fn(&Shoot) -> f64| known.iter().map(|one| value(&one[which])).collect::<Vec<_>>();
        let (lengths, distances) = (of(|one| one.length), of(|one| one.distance));
        let sizes: Vec<f64> = lengths.iter().map(|length| length.abs()).collect();
        format!(
            "length off by median {:.2} % (mean {:+.2} %), worst {:.2} %, mean distance median {:.2} % of length, worst {:.2} %",
            quantile(&sizes, 0.5),
            lengths.iter().sum::<f64>() / known.len().max(1) as f64,
            quantile(&sizes, 1.0),
            quantile(&distances, 0.5),
            quantile(&distances, 1.0)
        )
    };
    format!(
        "{} shoots, answered {} | {} | smoothed as the published line is: {}",
        files.len(),
        known.len(),
        off(0),
        off(1)
    )
}

/// How far a shoot's midline is from the published one.
struct Shoot {
    /// By how much it is too long, in %.
    length: f64,
    /// The mean distance, in % of the length.
    distance: f64,
}

/// The midline of a contour beside the published one, as it is and smoothed as the published one is.
fn compare(contour: &[Pixel], published: &Polyline) -> Option<[Shoot; 2]> {
    let (image, base) = filled(contour);
    let stem = silhouette(&image, base)?;
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
            distance: apart(&found, published),
        }
    }))
}

/// The deviation, in pixels, of the Gaussian filter that the published line was smoothed with.
///
/// Its points were evenly spaced before. Where a filter mirrors a line at its end it draws the end in, by 0.8 of its
/// deviation, and its points together: so far from the end that the filter deviates, they are erf(1 / sqrt 2) = 0.683 as
/// far apart as in the middle.
fn smoothing(published: &Polyline) -> f64 {
    let spacings: Vec<f64> = published.0.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    let usual = quantile(&spacings, 0.5);
    let drawn_in = |spacing: &f64| *spacing < 0.683 * usual;
    let ends = [
        spacings.iter().take_while(|spacing| drawn_in(spacing)).count(),
        spacings.iter().rev().take_while(|spacing| drawn_in(spacing)).count(),
    ];
    usual * (ends[0] + ends[1]) as f64 / 2.0
}

/// A line smoothed by a Gaussian filter of so many pixels' deviation that mirrors it at its ends.
fn smoothed(line: &Polyline, deviation: f64) -> Polyline {
    let count = line.length().ceil() as usize;
    let even = line.equidistant(count).0;
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

/// A contour filled with light before black, a margin around it, and its lowest place: the base.
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
