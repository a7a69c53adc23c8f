//! Figures of `tropism measure`: kymographs, stems beside the fitted rod, and what is known of beta and gamma.

use std::fmt::Write;

use super::colour::ColourMap;
use super::csv::Cell;
use super::plot::{Axis, Plot};
use super::{Body, Figure, Plants};
use tropism::geometry::{Point, STEM_POINTS};
use tropism::math;
use tropism::measure::{Estimate, Measurement, StemRecord};

/// Stems of one plant: a name, the record, and the fit.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredPlant<'a> {
    /// Name of the plant.
    pub name: &'a str,
    /// Its stems over time.
    pub record: &'a StemRecord,
    /// Its constants and the fitted stems.
    pub measurement: &'a Measurement,
}

/// Largest number of stems that the overlay shows. Chosen: more cannot be distinguished.
const MAX_STEMS: usize = 9;

/// Angle of each piece of a stem to the vertical, in degrees.
fn angles(stem: &[Point; STEM_POINTS]) -> [f64; STEM_POINTS - 1] {
    core::array::from_fn(|k| {
        let (from, to) = (stem[k], stem[k + 1]);
        math::atan2(to.x - from.x, to.y - from.y).to_degrees()
    })
}

/// Kymographs of the angle: measured, the fitted response without the plant's own forcing, and their difference.
#[must_use]
pub fn kymographs(plant: MeasuredPlant, plants: Plants) -> Vec<Figure> {
    let measured: Vec<_> = plant.record.stems.iter().map(angles).collect();
    let response: Vec<_> = plant.measurement.response_stems.iter().map(angles).collect();
    let wrapped = |degrees: f64| degrees - 360.0 * (degrees / 360.0).round();
    let difference: Vec<_> = measured
        .iter()
        .zip(&response)
        .map(|(seen, rod)| core::array::from_fn(|k| wrapped(seen[k] - rod[k])))
        .collect();
    let panels = [
        ("kymograph-measured", "Angle along the stem, measured", &measured, 90.0),
        (
            "kymograph-response",
            "The same of the fitted rod, without circumnutation and drift",
            &response,
            90.0,
        ),
        ("kymograph-difference", "Measured less fitted: circumnutation, drift, noise", &difference, 30.0),
    ];
    let panel = |(number, title, rows, limit): (&'static str, &str, &Vec<[f64; STEM_POINTS - 1]>, f64)| {
        Figure {
            number,
            title: format!("{title}: {}", plant.name),
            caption: format!(
                "Angle to the vertical in degrees, to {limit} either way, over time and place: 0 is the base, 1 the apex. {}",
                plants.sentence()
            ),
            data: csv_of_angles(&plant.record.times_h, rows),
            body: Body::Svg(kymograph(&plant.record.times_h, rows, limit)),
        }
    };
    panels.into_iter().map(panel).collect()
}

fn kymograph(times_h: &[f64], rows: &[[f64; STEM_POINTS - 1]], limit: f64) -> String {
    let last = times_h.last().copied().unwrap_or(1.0).max(1e-6);
    let x = Axis::covering("time (h)", (0.0, last), [].into_iter());
    let y = Axis::covering("share of the length from the base", (0.0, 1.0), [].into_iter());
    let mut plot = Plot::new(x, y, (300.0, 140.0), 64.0, 34.0);
    let (width, height) = plot.size();
    let pieces = (STEM_POINTS - 1) as f64;
    let cell = (width / times_h.len().max(1) as f64 + 0.4, height / pieces + 0.3);
    let marks = times_h.iter().zip(rows).flat_map(|(time, row)| {
        let plot = &plot;
        row.iter().enumerate().map(move |(k, angle)| {
            let level = ColourMap::level(0.5 + 0.5 * angle / limit);
            let (x, y) = plot.place(time * (1.0 - 1.0 / times_h.len() as f64), (k as f64 + 0.5) / pieces);
            (level, (x, y))
        })
    });
    let marks: Vec<_> = marks.collect();
    plot.dashes(ColourMap::Diverging, cell, marks.into_iter());
    let (low, high) = (format!("\u{2212}{limit:.0}\u{b0}"), format!("{limit:.0}\u{b0}"));
    plot.colour_bar(ColourMap::Diverging, "", &[(0.0, &low), (0.5, "0\u{b0}"), (1.0, &high)]);
    plot.finish()
}

fn csv_of_angles(times_h: &[f64], rows: &[[f64; STEM_POINTS - 1]]) -> String {
    let mut text = "time_h,piece,angle_deg\n".to_owned();
    for (time, row) in times_h.iter().zip(rows) {
        for (piece, angle) in (1..).zip(row) {
            let _ = writeln!(text, "{},{piece},{}", Cell(*time), Cell(*angle));
        }
    }
    text
}

/// Stems at equal times, measured and fitted without the plant's own forcing.
#[must_use]
pub fn fitted_stems(plant: MeasuredPlant, plants: Plants) -> Figure {
    let frames = plant.record.stems.len();
    let shown: Vec<usize> =
        (0..MAX_STEMS.min(frames)).map(|k| k * (frames - 1) / (MAX_STEMS.min(frames) - 1).max(1)).collect();
    let pairs =
        || shown.iter().map(|&frame| (&plant.record.stems[frame], &plant.measurement.response_stems[frame]));
    let points = || pairs().flat_map(|(seen, rod)| seen.iter().chain(rod));
    let x = Axis::covering("x (cm)", (-0.5, 0.5), points().map(|point| point.x));
    let y = Axis::covering("y (cm)", (0.0, 1.0), points().map(|point| point.y));
    let mut plot = Plot::centimetres(x, y, 300.0, 20.0, 34.0);
    for (seen, rod) in pairs() {
        plot.line("e0", seen.iter().map(|point| (point.x, point.y)));
        plot.line("e2", rod.iter().map(|point| (point.x, point.y)));
    }
    plot.legend(&[("e0", "measured"), ("e2", "fitted response")]);
    let mut data = "time_h,kind,point,x_cm,y_cm\n".to_owned();
    for (&frame, (seen, rod)) in shown.iter().zip(pairs()) {
        for (kind, stem) in [("measured", seen), ("fitted", rod)] {
            for (number, point) in (1..).zip(stem) {
                let time = Cell(plant.record.times_h[frame]);
                let _ = writeln!(data, "{time},{kind},{number},{},{}", Cell(point.x), Cell(point.y));
            }
        }
    }
    Figure {
        number: "stems",
        title: format!("Stems: {}", plant.name),
        caption: format!(
            "{} stems at equal times, and those of the fitted rod without circumnutation and drift. {}",
            shown.len(),
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// Points of an ellipse.
const ELLIPSE_POINTS: usize = 60;
/// Squared radius, in standard deviations, of the ellipse that holds 90 % of a bivariate normal distribution: -2 ln 0.1.
const ELLIPSE_90: f64 = 4.605_170_185_988_091;

/// The 90 % ellipse of each plant in the plane of beta and gamma, with the lines of constant convergence length.
#[must_use]
pub fn ridge(measured: &[MeasuredPlant], plants: Plants) -> Figure {
    let ellipse = |plant: &MeasuredPlant| -> Vec<(f64, f64)> {
        let ([beta, gamma], [xx, xy, yy]) = plant.measurement.ln_beta_gamma;
        // The factor of Cholesky turns the unit circle into the ellipse.
        let first = xx.max(1e-12).sqrt();
        let (second, third) = (xy / first, (yy - xy * xy / xx.max(1e-12)).max(0.0).sqrt());
        let radius = ELLIPSE_90.sqrt();
        (0..=ELLIPSE_POINTS)
            .map(|k| {
                let (sin, cos) = math::sin_cos(core::f64::consts::TAU * k as f64 / ELLIPSE_POINTS as f64);
                let ln_beta = beta + radius * first * cos;
                let ln_gamma = gamma + radius * (second * cos + third * sin);
                (math::exp(ln_beta), math::exp(ln_gamma))
            })
            .collect()
    };
    let ellipses: Vec<_> = measured.iter().map(ellipse).collect();
    // An ellipse that these data do not bound must not set the scale.
    let middle =
        |at: usize| measured.iter().map(move |plant| math::exp(plant.measurement.ln_beta_gamma.0[at]));
    let most = |at: usize| 3.0 * middle(at).fold(1e-3, f64::max);
    let within = |(beta, gamma): &(f64, f64)| *beta <= most(0) && *gamma <= most(1);
    let points = || ellipses.iter().flatten().filter(|point| within(point));
    let x = Axis::covering("beta (1/(cm h))", (0.0, 0.01), points().map(|point| point.0));
    let y = Axis::covering("gamma (1/h)", (0.0, 0.01), points().map(|point| point.1));
    let mut plot = Plot::new(x, y, (300.0, 240.0), 60.0, 34.0);
    let (_, upper) = plot.ends();
    for convergence in [0.25, 0.5, 1.0, 2.0, 4.0, 8.0] {
        let end = upper.x.min(upper.y / convergence);
        plot.line("axis", [(0.0, 0.0), (end, end * convergence)].into_iter());
        let place = plot.place(end, end * convergence);
        plot.text("tick", (place.0 + 3.0, place.1 + 3.0), "start", &format!("Lc {convergence}"));
    }
    let mut data = "plant,ln_beta,ln_gamma,var_ln_beta,cov,var_ln_gamma\n".to_owned();
    for (plant, ellipse) in measured.iter().zip(&ellipses) {
        plot.line("e0", ellipse.iter().filter(|point| within(point)).copied());
        let ([beta, gamma], [xx, xy, yy]) = plant.measurement.ln_beta_gamma;
        let place = plot.place(math::exp(beta).min(upper.x), math::exp(gamma).min(upper.y));
        plot.disc("start", place, 2.5);
        let cells = [beta, gamma, xx, xy, yy].map(|value| Cell(value).to_string()).join(",");
        let _ = writeln!(data, "{},{cells}", tropism::text::csv_cell(plant.name));
    }
    Figure {
        number: "ridge",
        title: "Beta against gamma".to_owned(),
        caption: format!(
            "90 % ellipse of each plant, and lines of constant convergence length Lc = gamma/beta in cm. A ridge along a line \
             means that Lc is known better than either. {}",
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// Values of plants, by group, with their intervals; those that are not identified are left out.
#[must_use]
pub fn strips(
    symbol: &str,
    unit: &str,
    groups: &[(String, Vec<&Estimate>, Option<&Estimate>)],
    plants: Plants,
) -> Figure {
    let shown = || groups.iter().flat_map(|(_, values, mean)| values.iter().copied().chain(*mean));
    let ends =
        || shown().filter(|estimate| estimate.status.has_value()).flat_map(|estimate| estimate.interval);
    let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    let most = 3.0
        * shown().map(|estimate| estimate.value.abs()).filter(|value| value.is_finite()).fold(0.0, f64::max);
    let y = Axis::covering(format!("{symbol}{unit}"), (0.0, 1e-3), ends().filter(|end| end.abs() <= most));
    let x = Axis { label: String::new(), from: 0.0, to: groups.len().max(1) as f64, tick: |_| String::new() };
    let mut plot = Plot::new(x, y, (110.0 * groups.len().max(2) as f64, 200.0), 20.0, 34.0);
    let (low, high) = plot.ends();
    let mut data = "group,value,low,high\n".to_owned();
    for (number, (name, values, mean)) in groups.iter().enumerate() {
        let values: Vec<_> = values.iter().filter(|estimate| estimate.status.has_value()).collect();
        for (k, estimate) in values.iter().enumerate() {
            let x = number as f64 + 0.15 + 0.55 * (k as f64 + 0.5) / values.len() as f64;
            let [from, to] = estimate.interval.map(|end| end.clamp(low.y, high.y));
            plot.line("e0", [(x, from), (x, to)].into_iter());
            plot.disc("start", plot.place(x, estimate.value.clamp(low.y, high.y)), 2.5);
            let cells = [estimate.value, estimate.interval[0], estimate.interval[1]]
                .map(|value| Cell(value).to_string());
            let _ = writeln!(data, "{},{}", tropism::text::csv_cell(name), cells.join(","));
        }
        if let Some(mean) = mean.filter(|mean| mean.status.has_value()) {
            let [from, to] = mean.interval.map(|end| end.clamp(low.y, high.y));
            let x = number as f64 + 0.85;
            plot.line("e2", [(x, from), (x, to)].into_iter());
            plot.disc("start", plot.place(x, mean.value.clamp(low.y, high.y)), 4.0);
        }
        let place = plot.place(number as f64 + 0.5, low.y);
        plot.text("tick", (place.0, place.1 + 16.0), "middle", &svg_text(name));
    }
    Figure {
        number: "groups",
        title: format!("{symbol} of each plant"),
        caption: format!(
            "Each plant with its 90 % interval; on the right of each group the mean with its 90 % t interval over plants. {}",
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// A user's text in SVG.
fn svg_text(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
