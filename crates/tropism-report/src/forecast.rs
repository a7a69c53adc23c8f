//! Errors of forecasts over time, a panel for each part of the plant and each kind of light.

use std::fmt::Write;

use super::csv::Cell;
use super::plot::{Axis, LEGEND_ROW, Path, Plot, legend_rows, number};
use super::{Body, Figure, Plants, plot};

/// The errors of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct ForecastErrors {
    /// Name of the model.
    pub name: String,
    /// Hours after the start, mean error and its 95 % interval, in cm.
    pub errors_cm: Vec<(f64, f64, [f64; 2])>,
}

/// Models compared on the same forecasts.
#[derive(Clone, Debug, PartialEq)]
pub struct ForecastPanel {
    /// What is predicted, such as `tip, six-hour light`.
    pub title: String,
    /// A line for each model.
    pub lines: Vec<ForecastErrors>,
}

const PANEL: (f64, f64) = (380.0, 230.0);
const BESIDE: f64 = 24.0;
/// Panels in a row.
const COLUMNS: usize = 2;
/// Number of line colours; further lines are dashed.
const COLOURS: usize = 6;

/// The error of each model over the time since the start, with its 95 % interval at each horizon.
#[must_use]
pub fn forecast_errors(panels: &[ForecastPanel], plants: Plants) -> Figure {
    let (mut width, mut height, mut row, mut svgs) = (0.0_f64, 0.0, 0.0_f64, String::new());
    let mut data = "panel,model,hours,error_cm,low_cm,high_cm\n".to_owned();
    for (index, one) in panels.iter().enumerate() {
        let svg = panel(one);
        let (wide, high) = plot::size(&svg);
        if index.is_multiple_of(COLUMNS) {
            height += row;
            row = 0.0;
        }
        let left = wide * (index % COLUMNS) as f64;
        let frame =
            format!("<svg x=\"{left:.1}\" y=\"{height:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\"");
        svgs += &svg.replacen("<svg", &frame, 1);
        width = width.max(left + wide);
        row = row.max(high);
        for line in &one.lines {
            for &(hours, error, [low, high]) in &line.errors_cm {
                let (panel, name) = (quoted(&one.title), quoted(&line.name));
                let _ = writeln!(
                    data,
                    "{panel},{name},{},{},{},{}",
                    Cell(hours),
                    Cell(error),
                    Cell(low),
                    Cell(high)
                );
            }
        }
    }
    height += row;
    Figure {
        number: "forecast",
        title: "Errors of forecasts".to_owned(),
        caption: format!(
            "Mean distance from the forecast to the plant, over the time since the plant was seen last. Bars: 95 % interval of \
             the mean. {}",
            plants.sentence()
        ),
        data,
        body: Body::Svg(format!("<svg class=\"figure\" viewBox=\"0 0 {width:.1} {height:.1}\">{svgs}</svg>")),
    }
}

fn panel(panel: &ForecastPanel) -> String {
    let points = || panel.lines.iter().flat_map(|line| &line.errors_cm);
    let last = points().map(|(hours, ..)| *hours).fold(0.0, f64::max);
    let x =
        Axis { label: "hours since the start".to_owned(), from: 0.0, to: last.max(0.1) * 1.02, tick: number };
    let y = Axis::covering("error (cm)", (0.0, 0.5), points().map(|(.., [_, high])| *high));
    let looks: Vec<String> = (0..panel.lines.len())
        .map(|index| format!("e{}{}", index % COLOURS, if index >= COLOURS { " dashed" } else { "" }))
        .collect();
    let legend: Vec<(&str, String)> =
        looks.iter().zip(&panel.lines).map(|(look, line)| (look.as_str(), escaped(&line.name))).collect();
    let top = 46.0 + LEGEND_ROW * (legend_rows(&legend, PANEL.0 + BESIDE) - 1) as f64;
    let mut plot = Plot::new(x, y, PANEL, BESIDE, top);
    for (look, line) in looks.iter().zip(&panel.lines) {
        let mut bars = Path::default();
        for &(hours, _, [low, high]) in &line.errors_cm {
            bars.line(&[plot.place(hours, low), plot.place(hours, high)]);
        }
        plot.path(look, &bars);
        plot.line(&format!("bold {look}"), line.errors_cm.iter().map(|&(hours, error, _)| (hours, error)));
    }
    plot.legend(&legend);
    let (left, _) = plot.place(plot.ends().0.x, 0.0);
    plot.text("label", (left, 14.0), "start", &escaped(&panel.title));
    plot.finish()
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// A name as text of an SVG.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn panels_stand_side_by_side_with_a_line_for_each_model() {
        let line = |name: &str, scale: f64| ForecastErrors {
            name: name.to_owned(),
            errors_cm: [(0.1, 0.2), (1.0, 1.8), (6.0, 5.5)]
                .map(|(hours, error)| (hours, scale * error, [0.9 * scale * error, 1.2 * scale * error]))
                .to_vec(),
        };
        let panel = |title: &str| ForecastPanel {
            title: title.to_owned(),
            lines: vec![line("standing still", 1.0), line("a<b", 0.4)],
        };
        let figure =
            forecast_errors(&[panel("tip"), panel("stem"), panel("tip, random light")], Plants::Virtual);
        assert_eq!(figure.data.lines().count(), 1 + 3 * 2 * 3);
        let Body::Svg(svg) = figure.body else { panic!("no drawing") };
        testing::assert_well_formed(&svg);
        assert_eq!(svg.matches("<svg").count(), 1 + 3, "a panel each");
        assert_eq!(svg.matches("a&lt;b").count(), 3, "{svg}");
        assert!(svg.contains("random light") && !svg.contains("NaN"), "{svg}");
    }
}
