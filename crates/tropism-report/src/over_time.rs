//! Tracks over time: place of the tip, angle, length and growth rate of the stem.

use std::fmt::Write;

use super::csv::Cell;
use super::plot::{self, Axis, Plot};
use super::{Body, Figure, Plants, lamp};
use tropism::math;
use tropism::observation::Quality;
use tropism::track::Track;

/// Width and height of a panel, in pixels, and space beside it.
const PANEL: (f64, f64) = (560.0, 120.0);
const BESIDE: f64 = 24.0;

/// Shares of the duration, and hours: the window over which a growth rate is fitted is a tenth of the track, within these.
/// Chosen by hand: shorter ones show the noise of the length.
const WINDOW_SHARE: f64 = 0.1;
const WINDOW_H: (f64, f64) = (1.0, 12.0);

/// Least number of lengths in a window.
const LEAST_IN_WINDOW: usize = 5;

/// The stem's points between which the angle of its upper end is measured, of ten.
const UPPER_END: (u32, u32) = (8, 10);

/// A quantity over time: its label, the column of its data, and its values.
struct Quantity {
    label: &'static str,
    column: &'static str,
    of: fn(&Curves) -> &[f64],
    least: (f64, f64),
}

const QUANTITIES: [Quantity; 5] = [
    Quantity { label: "tip x (cm)", column: "tip_x_cm", of: |curves| &curves.x, least: (-0.5, 0.5) },
    Quantity { label: "tip y (cm)", column: "tip_y_cm", of: |curves| &curves.y, least: (0.0, 1.0) },
    Quantity {
        label: "angle (degrees)",
        column: "angle_deg",
        of: |curves| &curves.angle,
        least: (-5.0, 5.0),
    },
    Quantity { label: "length (cm)", column: "length_cm", of: |curves| &curves.length, least: (0.0, 1.0) },
    Quantity {
        label: "growth (mm/h)",
        column: "growth_mm_h",
        of: |curves| &curves.growth,
        least: (0.0, 1.0),
    },
];

/// The quantities of a track, one value a sample; NaN where nothing was measured.
struct Curves {
    hours: Vec<f64>,
    x: Vec<f64>,
    y: Vec<f64>,
    angle: Vec<f64>,
    length: Vec<f64>,
    growth: Vec<f64>,
    has_stems: bool,
}

impl Curves {
    fn of(track: &Track) -> Self {
        let measured =
            |value: fn(&tropism::geometry::Point) -> f64| -> Vec<f64> {
                let samples = track.samples.iter();
                samples
                    .map(|sample| {
                        if sample.quality == Quality::CarriedForward { f64::NAN } else { value(&sample.tip) }
                    })
                    .collect()
            };
        let hours: Vec<f64> = track.samples.iter().map(|sample| sample.time_s / 3600.0).collect();
        let (x, y) = (measured(|tip| tip.x), measured(|tip| tip.y));
        let end = |point: u32, axis: char| track.numbers(&format!("stem_{point}_{axis}_cm"));
        let (low, high) = UPPER_END;
        let ends = [end(low, 'x'), end(low, 'y'), end(high, 'x'), end(high, 'y')];
        let degrees = |x: f64, y: f64| math::atan2(x, y).to_degrees();
        let (angle, has_stems): (Vec<f64>, bool) = match ends {
            [Some(x0), Some(y0), Some(x1), Some(y1)] => {
                ((0..x0.len()).map(|row| degrees(x1[row] - x0[row], y1[row] - y0[row])).collect(), true)
            }
            _ => (x.iter().zip(&y).map(|(&x, &y)| degrees(x, y)).collect(), false),
        };
        let length = track.numbers("length_cm").unwrap_or_default();
        let growth = growth_rates(&hours, &length);
        Self { hours, x, y, angle, length, growth, has_stems }
    }
}

/// Hours over which a growth rate is fitted.
fn window_h(hours: &[f64]) -> f64 {
    let duration = hours.last().zip(hours.first()).map_or(0.0, |(last, first)| last - first);
    (WINDOW_SHARE * duration).clamp(WINDOW_H.0, WINDOW_H.1)
}

/// The slope of a line fitted to the lengths around each time, in mm/h; NaN where there are too few.
fn growth_rates(hours: &[f64], length: &[f64]) -> Vec<f64> {
    let half = window_h(hours) / 2.0;
    let known: Vec<(f64, f64)> =
        hours.iter().copied().zip(length.iter().copied()).filter(|(_, length)| length.is_finite()).collect();
    let rate = |&at: &f64| {
        let from = known.partition_point(|(time, _)| *time < at - half);
        let to = known.partition_point(|(time, _)| *time <= at + half);
        let window = known.get(from..to).unwrap_or_default();
        let is_enough = window.len() >= LEAST_IN_WINDOW
            && window.first().is_some_and(|first| first.0 <= at)
            && window.last().is_some_and(|last| last.0 >= at);
        if is_enough { 10.0 * slope(window) } else { f64::NAN }
    };
    if length.is_empty() { Vec::new() } else { hours.iter().map(rate).collect() }
}

/// The slope of the line of least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / count;
    let (time, length) = (mean(|point| point.0), mean(|point| point.1));
    let products: f64 = points.iter().map(|point| (point.0 - time) * (point.1 - length)).sum();
    let squares: f64 = points.iter().map(|point| (point.0 - time) * (point.0 - time)).sum();
    if squares > 0.0 { products / squares } else { f64::NAN }
}

/// Place of the tip, angle, length and growth rate over hours, a panel each, and each track in its own colour.
///
/// Where no track has a column `length_cm`, as `tropism track` writes it, there are no panels of length and growth. At the
/// hours of `notes` stand dotted lines.
#[must_use]
pub fn over_time(tracks: &[Track], notes: &[f64], plants: Plants) -> Figure {
    let curves: Vec<Curves> = tracks.iter().map(Curves::of).collect();
    let drawn: Vec<&Quantity> = QUANTITIES
        .iter()
        .filter(|quantity| {
            let is_measured = |curves: &Curves| (quantity.of)(curves).iter().any(|value| value.is_finite());
            curves.iter().any(is_measured) || quantity.column.starts_with("tip")
        })
        .collect();
    let last = drawn.len().saturating_sub(1);
    let hours = || curves.iter().flat_map(|curves| curves.hours.iter().copied());
    let only = if let [only] = tracks { Some(only) } else { None };
    let (mut width, mut height, mut panels) = (0.0_f64, 0.0, String::new());
    for (index, quantity) in drawn.iter().enumerate() {
        let values = curves.iter().flat_map(|curves| (quantity.of)(curves).iter().copied());
        let label = if index == last { "time (hours)" } else { "" };
        let x = Axis::covering(label, (0.0, 1.0), hours());
        let y = Axis::covering(quantity.label, quantity.least, values);
        let mut plot = Plot::new(x, y, PANEL, BESIDE, if index == 0 { 30.0 } else { 10.0 });
        if let Some(track) = only.filter(|_| index == 0) {
            draw_lights(&mut plot, track);
        }
        if let Some(track) = only {
            draw_nights(&mut plot, track);
        }
        for &hours in notes {
            let mut mark = plot::Path::default();
            let x = plot.place(hours, 0.0).0;
            mark.line(&[(x, plot.top_edge()), (x, plot.bottom_edge())]);
            plot.path("dotted", &mark);
        }
        for (number, curves) in curves.iter().enumerate() {
            let points = curves.hours.iter().copied().zip((quantity.of)(curves).iter().copied());
            draw_measured(&mut plot, &format!("e{}", number % 6), &points.collect::<Vec<_>>());
        }
        let svg = plot.finish();
        let (wide, high) = plot::size(&svg);
        let frame = format!("<svg x=\"0\" y=\"{height:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\"");
        panels += &svg.replacen("<svg", &frame, 1);
        width = width.max(wide);
        height += high - if index == last { 0.0 } else { 16.0 };
    }
    Figure {
        number: "time",
        title: "Over time".to_owned(),
        caption: caption(&curves, drawn.len(), only.is_some(), plants)
            + if notes.is_empty() { "" } else { " Dotted lines are notes." }
            + if only.is_some_and(has_nights) {
                " The controller did not steer where it is shaded."
            } else {
                ""
            },
        data: csv(&curves),
        body: Body::Svg(format!(
            "<svg class=\"figure\" viewBox=\"0 0 {width:.1} {height:.1}\">{panels}</svg>"
        )),
    }
}

fn caption(curves: &[Curves], panels: usize, is_alone: bool, plants: Plants) -> String {
    let angle = if curves.iter().all(|curves| curves.has_stems) {
        "The angle is that of the upper fifth of the stem"
    } else {
        "The angle is that of the line from the root to the tip, and of the upper fifth of the stem where stems are detected"
    };
    let growth = if panels == QUANTITIES.len() {
        let hours = curves.iter().map(|curves| window_h(&curves.hours)).fold(0.0, f64::max);
        format!("Growth is the slope of a line fitted to the lengths over {} hours.", plot::number(hours))
    } else {
        "Length and growth are left out: the tracks lack the column length_cm of `tropism track`.".to_owned()
    };
    let colours =
        if is_alone { "The strip on top is the lamp that was lit." } else { "Each track in its own colour." };
    format!("{colours} {angle}, from the vertical, positive to the right. {growth} {}", plants.sentence())
}

/// A strip of the lamps that were lit, on top of the panel: each pixel has the brightest lamp of its time.
fn draw_lights(plot: &mut Plot, track: &Track) {
    let samples = &track.samples;
    let Some(end) = samples.last().map(|last| plot.place(last.time_s / 3600.0, 0.0).0) else { return };
    let (start, top) = (plot.place(0.0, 0.0).0, plot.top_edge() - 8.0);
    let seconds_a_pixel = 3600.0 / plot.scale();
    let lit = |pixel: usize| {
        let until = seconds_a_pixel * (pixel as f64 + 0.5);
        samples[samples.partition_point(|sample| sample.time_s <= until).max(1) - 1].lighting().brightest()
    };
    let pixels: Vec<_> = (0..(end - start).clamp(0.0, PANEL.0) as usize).map(lit).collect();
    let mut left = start;
    for run in pixels.chunk_by(|a, b| a == b) {
        let right = left + run.len() as f64;
        let mut dash = plot::Path::default();
        dash.line(&[(left, top), (right, top)]);
        plot.path(&format!("key {}", lamp::class(run[0])), &dash);
        left = right;
    }
}

fn has_nights(track: &Track) -> bool {
    track.numbers("steered").is_some_and(|steered| steered.contains(&0.0))
}

/// Shades the times at which a programme did not let the controller steer, by the column `steered`.
fn draw_nights(plot: &mut Plot, track: &Track) {
    let Some(steered) = track.numbers("steered") else { return };
    let place =
        |index: usize| track.samples.get(index).map(|sample| plot.place(sample.time_s / 3600.0, 0.0).0);
    let (top, bottom) = (plot.top_edge(), plot.bottom_edge());
    let (mut nights, mut from) = (plot::Path::default(), 0);
    for run in steered.chunk_by(|a, b| a == b) {
        let to = from + run.len();
        let ends = place(from).zip(place(to.min(track.samples.len() - 1)));
        if let Some((left, right)) = ends.filter(|_| run[0] == 0.0) {
            nights.line(&[(left, top), (right, top), (right, bottom), (left, bottom)]);
        }
        from = to;
    }
    plot.fill("dark band", &nights);
}

/// Gaps of a curve that are drawn, at most: a curve of more goes through the points that are measured.
const MAX_GAPS: usize = 1000;

/// Lines through the points that are measured, with gaps where they are not; a point alone is a dash.
fn draw_measured(plot: &mut Plot, class: &str, points: &[(f64, f64)]) {
    let is_measured = |point: &&(f64, f64)| point.1.is_finite();
    if points.windows(2).filter(|pair| pair[0].1.is_finite() && !pair[1].1.is_finite()).count() > MAX_GAPS {
        plot.line(class, points.iter().filter(is_measured).copied());
        return;
    }
    for run in points.split(|point| !point.1.is_finite()) {
        if let [(x, y)] = run {
            let (x, y) = plot.place(*x, *y);
            let mut dash = plot::Path::default();
            dash.line(&[(x - 0.7, y), (x + 0.7, y)]);
            plot.path(class, &dash);
        } else {
            plot.line(class, run.iter().copied());
        }
    }
}

fn csv(curves: &[Curves]) -> String {
    let columns: Vec<&str> = QUANTITIES.iter().map(|quantity| quantity.column).collect();
    let mut text = format!("plant,time_h,{}\n", columns.join(","));
    for (plant, curves) in (1..).zip(curves) {
        for (row, &hours) in curves.hours.iter().enumerate() {
            let _ = write!(text, "{plant},{}", Cell(hours));
            for quantity in &QUANTITIES {
                let value = (quantity.of)(curves).get(row).copied().unwrap_or(f64::NAN);
                let _ = write!(text, ",{}", Cell(value));
            }
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    /// A stem that leans by 30 degrees and grows by 2 mm/h, of which every tenth photograph shows nothing.
    fn leaning() -> Track {
        let rows: Vec<(f64, f64, char)> = (0..200)
            .map(|step| {
                let length = 4.0 + 0.2 * f64::from(step) / 12.0;
                (0.5 * length, 0.75_f64.sqrt() * length, if step < 100 { 'l' } else { 'r' })
            })
            .collect();
        let mut track = testing::track(&rows);
        for sample in track.samples.iter_mut().step_by(10) {
            sample.quality = Quality::CarriedForward;
        }
        let tips: Vec<_> = track.samples.iter().map(|sample| (sample.tip, sample.quality)).collect();
        let measured =
            |value: f64, quality: Quality| if quality == Quality::CarriedForward { f64::NAN } else { value };
        for (point, share) in [(8, 7.0 / 9.0), (10, 1.0)] {
            track.add_numbers(
                &format!("stem_{point}_x_cm"),
                4,
                tips.iter().map(|(tip, q)| measured(share * tip.x, *q)),
            );
            track.add_numbers(
                &format!("stem_{point}_y_cm"),
                4,
                tips.iter().map(|(tip, q)| measured(share * tip.y, *q)),
            );
        }
        let length = |tip: &tropism::geometry::Point| math::hypot(tip.x, tip.y);
        track.add_numbers("length_cm", 4, tips.iter().map(|(tip, quality)| measured(length(tip), *quality)));
        track
    }

    #[test]
    fn angle_and_growth_are_those_of_the_stem() {
        let curves = Curves::of(&leaning());
        assert!(curves.angle[0].is_nan() && (curves.angle[1] - 30.0).abs() < 0.1, "{:?}", &curves.angle[..3]);
        assert!(
            curves.growth[50..150].iter().all(|rate| (rate - 2.0).abs() < 0.05),
            "{:?}",
            &curves.growth[50..60]
        );
        let data = over_time(&[leaning()], &[], Plants::Real).data;
        assert!(
            data.starts_with("plant,time_h,tip_x_cm,tip_y_cm,angle_deg,length_cm,growth_mm_h\n1,0.0000,,,,,"),
            "{data}"
        );
    }

    #[test]
    fn the_figure_over_time_is_golden() {
        let figure = over_time(&[leaning()], &[], Plants::Virtual);
        testing::golden(&figure);
        let Body::Svg(svg) = &figure.body else { panic!() };
        assert_eq!(svg.matches("<svg").count(), 1 + QUANTITIES.len());
    }

    #[test]
    fn nights_are_shaded_in_each_panel() {
        let mut track = leaning();
        track.add_numbers(
            "steered",
            0,
            (0..200).map(|step| if (50..90).contains(&step) { 0.0 } else { 1.0 }),
        );
        let figure = over_time(&[track], &[], Plants::Virtual);
        let Body::Svg(svg) = &figure.body else { panic!() };
        assert_eq!(svg.matches("fill dark band").count(), QUANTITIES.len());
        assert!(figure.caption.ends_with("where it is shaded."), "{}", figure.caption);
    }

    #[test]
    fn without_stems_length_and_growth_are_left_out_with_a_word() {
        let figure = over_time(&testing::swings(2, 60), &[], Plants::Real);
        let Body::Svg(svg) = &figure.body else { panic!() };
        assert_eq!(svg.matches("<svg").count(), 1 + 3);
        assert!(figure.caption.contains("lack the column length_cm"), "{}", figure.caption);
    }
}
