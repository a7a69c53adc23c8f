//! Kinematics of a virtual plant in standard experiments of plant physiology, beside published values.
//!
//! In: an individual. Out: one figure an experiment, and the values measured in it. No value is a parameter of the model:
//! each follows from its equations, so it can be compared with measurements.

use super::plot::{Axis, Plot};
use super::{Body, Figure, Plants};
use tropism::math::statistics::mean;
use tropism_bean::Individual;
use tropism_bean::experiments::{self, Circumnutation, Response};

/// Lengths of the stem in the experiments, in cm: a seedling, and the paper's plants half and fully grown.
const LENGTHS: [f64; 3] = [5.0, 10.0, 20.0];
/// Durations of a pulse of light, in min.
const PULSES: [f64; 5] = [5.0, 10.0, 20.0, 40.0, 80.0];
/// Angle by which the pot is tilted, in degrees.
const TILT_DEG: f64 = 60.0;
/// Classes of the curves in the style sheet.
const CLASSES: [&str; 5] = ["e0", "e1", "e2", "e3", "e5"];

/// One quantity of a virtual plant beside published values.
#[derive(Clone, Debug, PartialEq)]
pub struct KinematicValue {
    /// The quantity, with its unit.
    pub quantity: String,
    /// Its value in the virtual plant.
    pub value: f64,
    /// Published values in living plants with their sources, or "none found".
    pub published: &'static str,
}

/// Figures and values of circumnutation, a phototropic step, a gravitropic step, autostraightening and pulses of light.
#[must_use]
pub fn kinematics(plant: &Individual) -> (Vec<Figure>, Vec<KinematicValue>) {
    let mut rows = Vec::new();
    let figures = vec![
        circling(plant, &mut rows),
        phototropism(plant, &mut rows),
        gravitropism(plant, &mut rows),
        straightening(plant, &mut rows),
        pulses(plant, &mut rows),
    ];
    (figures, rows)
}

fn circling(plant: &Individual, rows: &mut Vec<KinematicValue>) -> Figure {
    let circles = LENGTHS.map(|length| experiments::circumnutation(plant, length, 10.0));
    let turns = circles.each_ref().map(last_turns);
    let reach = turns.iter().flatten().flatten().fold(0.2_f64, |most, at| most.max(at.abs()));
    let axis = |label| Axis::covering(label, (-reach, reach), [].into_iter());
    let mut plot = Plot::centimetres(axis("to the right (cm)"), axis("to the back (cm)"), 300.0, 20.0, 34.0);
    for (path, class) in turns.iter().zip(CLASSES) {
        plot.line(class, path.iter().map(|&[x, back]| (x, back)));
    }
    add_legend(&mut plot, LENGTHS.iter().map(|length| format!("{length} cm")));
    let [_, _, long] = &circles;
    let [.., path] = &turns;
    let [major, minor] = semi_axes(path);
    push(rows, "period of circumnutation at 20 cm, min", long.period_min, PERIOD);
    push(rows, "semi-major axis of its ellipse, cm", major, ELLIPSE);
    push(rows, "ratio of minor to major axis", minor / major, ELLIPSE);
    push(rows, "turns counter-clockwise from above: 1, clockwise: -1", sense(path), SENSE);
    figure("circumnutation", "Circumnutation from above", "The apex over three turns in the dark.", plot)
}

const PERIOD: &str = "98.6 ± 12.7 (n = 103; Ohad et al. 2026, twining 'Helda'); about 100 (Millet et al. 1984); 115 to 120 \
                      (Darwin 1875)";
const ELLIPSE: &str = "none found for a bush bean; twining stems sweep 12 cm (Ohad et al. 2026)";
const SENSE: &str = "1 (Darwin 1875: against the sun)";
const LAG: &str = "bean: none found; 4 (buckwheat, Plant Cell Physiol. 25:1513); 45 to 75 (Arabidopsis, Whippo and Hangarter \
                   2003)";
const RATE: &str = "bean: none found; 90 and more (buckwheat, the same); median 64 of 11 (Arabidopsis gl1, raw data of \
                    jschnab/phototropism)";
const SET_POINT: &str = "bean: none found";
const OVERSHOOT: &str = "at most a swing or two for balance numbers of 3 to 5 (Bastien et al. 2013)";
const UNFOUND: &str = "bean: none found";
const STRAIGHTENING: &str =
    "1.3 to 1.7 (Arabidopsis, Meroz et al. 2019); 6 (cress root, Plant Physiol. 117:893)";
const PULSE: &str = "a response that grows with duration beyond 10 to 20 min (second positive; Arabidopsis, Janoudi and Poff)";

fn phototropism(plant: &Individual, rows: &mut Vec<KinematicValue>) -> Figure {
    let responses = LENGTHS.map(|length| experiments::phototropic_step(plant, length, 14.0));
    for (length, response) in LENGTHS.into_iter().zip(&responses) {
        push(rows, &format!("lag after light from one side at {length} cm, min"), response.lag_min(), LAG);
        push(
            rows,
            &format!("fastest turning at {length} cm, degrees an hour"),
            response.max_rate_deg_h(),
            RATE,
        );
        push(rows, &format!("set point at {length} cm, degrees"), response.set_point_deg(), SET_POINT);
        push(rows, &format!("overshoot at {length} cm, degrees"), response.overshoot_deg(), OVERSHOOT);
    }
    let names = LENGTHS.iter().map(|length| format!("{length} cm"));
    let plot = angle_plot(&responses, names, 14.0);
    figure(
        "phototropism",
        "Light from one side",
        "The apex after the right lamp is lit, at three lengths.",
        plot,
    )
}

fn gravitropism(plant: &Individual, rows: &mut Vec<KinematicValue>) -> Figure {
    let responses = LENGTHS.map(|length| experiments::gravitropic_step(plant, length, TILT_DEG, 14.0));
    for (length, response) in LENGTHS.into_iter().zip(&responses) {
        let quantity = format!("fastest righting from {TILT_DEG} degrees at {length} cm, degrees an hour");
        push(rows, &quantity, response.max_rate_deg_h(), UNFOUND);
    }
    let names = LENGTHS.iter().map(|length| format!("{length} cm"));
    let plot = angle_plot(&responses, names, 14.0);
    figure("gravitropism", "Tilted pot", "The apex after the pot is tilted by 60 degrees in the dark.", plot)
}

fn straightening(plant: &Individual, rows: &mut Vec<KinematicValue>) -> Figure {
    let responses = LENGTHS.map(|length| experiments::straightening(plant, length, 6.0, 24.0));
    for (length, response) in LENGTHS.into_iter().zip(&responses) {
        push(
            rows,
            &format!("straightening to 1/e at {length} cm, h"),
            response.relaxation_h(),
            STRAIGHTENING,
        );
    }
    let names = LENGTHS.iter().map(|length| format!("{length} cm"));
    let plot = angle_plot(&responses, names, 24.0);
    let caption = "The apex after six hours under the right lamp, in the dark on a clinostat.";
    figure("straightening", "Straightening", caption, plot)
}

fn pulses(plant: &Individual, rows: &mut Vec<KinematicValue>) -> Figure {
    let responses = PULSES.map(|minutes| experiments::light_pulse(plant, 10.0, minutes, 6.0));
    for (minutes, response) in PULSES.into_iter().zip(&responses) {
        let (peak, farthest) = response.peak();
        push(rows, &format!("farthest after {minutes} min of light at 10 cm, degrees"), farthest, PULSE);
        let after = response.hours(peak) * 60.0 - minutes;
        push(rows, &format!("still turning after the end of {minutes} min of light, min"), after, UNFOUND);
    }
    let plot = angle_plot(&responses, PULSES.iter().map(|minutes| format!("{minutes} min")), 6.0);
    figure(
        "pulses",
        "Pulses of light",
        "The apex of a stem of 10 cm after light from the right, then dark.",
        plot,
    )
}

fn push(rows: &mut Vec<KinematicValue>, quantity: &str, value: f64, published: &'static str) {
    rows.push(KinematicValue { quantity: quantity.to_owned(), value, published });
}

/// Draws the angle of the apex over time, one curve a response.
fn angle_plot(responses: &[Response], names: impl Iterator<Item = String>, hours: f64) -> Plot {
    let degrees = responses.iter().flat_map(|response| response.degrees.iter().copied());
    let y = Axis::covering("apex from the vertical (degrees)", (0.0, 20.0), degrees);
    let mut plot =
        Plot::new(Axis::covering("hours", (0.0, hours), [].into_iter()), y, (380.0, 220.0), 20.0, 34.0);
    for (response, class) in responses.iter().zip(CLASSES) {
        let reading = |(reading, &degrees): (usize, &f64)| (response.hours(reading), degrees);
        plot.line(class, response.degrees.iter().enumerate().map(reading));
    }
    add_legend(&mut plot, names);
    plot
}

/// Adds the legend of the curves, and marks the plant as virtual.
fn add_legend(plot: &mut Plot, names: impl Iterator<Item = String>) {
    let entries: Vec<(&str, String)> = CLASSES.into_iter().zip(names).collect();
    plot.legend(&entries);
    let corner = (plot.right_edge() - 6.0, plot.top_edge() + 16.0);
    plot.text("label halo", corner, "end", "virtual plant");
}

fn figure(number: &'static str, title: &str, caption: &str, plot: Plot) -> Figure {
    Figure {
        number,
        title: title.to_owned(),
        caption: format!("{caption} {}", Plants::Virtual.sentence()),
        data: String::new(),
        body: Body::Svg(plot.finish()),
    }
}

/// The last three turns of the apex around their centre: to the right, and to the back.
fn last_turns(circling: &Circumnutation) -> Vec<[f64; 2]> {
    let readings = (3.0 * circling.period_min) as usize;
    let path = &circling.path[circling.path.len().saturating_sub(readings)..];
    let centre = [0, 2].map(|axis| mean(path.iter().map(|at| at[axis])));
    path.iter().map(|at| [at[0] - centre[0], centre[1] - at[2]]).collect()
}

/// Semi-axes, the major first, of the ellipse that a path of whole turns follows, from its second moments.
fn semi_axes(path: &[[f64; 2]]) -> [f64; 2] {
    let moment = |one: usize, other: usize| mean(path.iter().map(|at| at[one] * at[other]));
    let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
    let spread = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    // The variances of a point that runs around an ellipse are half the squares of its semi-axes.
    [1.0, -1.0].map(|sign| (2.0 * (0.5 * (xx + yy) + sign * spread).max(0.0)).sqrt())
}

/// Sense of rotation: 1 for counter-clockwise as seen from above, with the back upwards; else -1.
fn sense(path: &[[f64; 2]]) -> f64 {
    path.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[0][1] * pair[1][0]).sum::<f64>().signum()
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::*;
    use tropism::math;

    #[test]
    fn semi_axes_are_those_of_an_ellipse() {
        let path: Vec<[f64; 2]> = (0..300)
            .map(|step| TAU * f64::from(step) / 100.0)
            .map(|turn| {
                let (long, short) = (2.0 * math::cos(turn), 0.5 * math::sin(turn));
                [0.8 * long - 0.6 * short, 0.6 * long + 0.8 * short]
            })
            .collect();
        let [major, minor] = semi_axes(&path);
        assert!((major - 2.0).abs() < 1e-9 && (minor - 0.5).abs() < 1e-9, "{major} {minor}");
        assert_eq!(sense(&path), 1.0);
        assert_eq!(sense(&path.iter().rev().copied().collect::<Vec<_>>()), -1.0);
    }

    #[test]
    fn the_average_bean_is_near_published_values() {
        let (figures, rows) = kinematics(&Individual::default());
        assert_eq!(figures.len(), 5);
        for figure in &figures {
            let Body::Svg(svg) = &figure.body else { panic!("a drawing") };
            crate::testing::assert_well_formed(svg);
            assert!(svg.contains("virtual plant") && figure.caption.ends_with("The plants are virtual."));
        }
        let value = |words: &str| {
            rows.iter().find(|row| row.quantity.starts_with(words)).unwrap_or_else(|| panic!("{words}")).value
        };
        assert!((85.0..112.0).contains(&value("period of circumnutation")));
        assert_eq!(value("turns counter-clockwise"), 1.0);
        assert!((0.4..0.8).contains(&value("ratio of minor")), "{}", value("ratio of minor"));
        assert!((4.0..75.0).contains(&value("lag after light from one side at 10 cm")));
        assert!((1.0..10.0).contains(&value("straightening to 1/e at 20 cm")));
        assert!(value("farthest after 20 min") > 3.0 * value("farthest after 5 min"));
    }
}
