//! Evolutions or settings compared: fitness over the generations on one axis, and the distribution of final values.

use std::fmt::Write;

use super::csv::Cell;
use super::plot::{Axis, LEGEND_ROW, Path, Place, Plot, legend_rows, number};
use super::transfer::{ControllerScores, score_strips};
use super::{Body, Figure, Plants};
use tropism::math::statistics::five_numbers;

/// Runs of one kind among others that they are compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedRuns {
    /// Name of the evolution, study or setting.
    pub name: String,
    /// Best fitness of each generation of each run: `best[run][generation - 1]`; empty where there are no generations.
    pub best: Vec<Vec<f64>>,
    /// The values that are compared, such as the best fitness of each run.
    pub values: Vec<f64>,
    /// 95 % interval of the mean of the values.
    pub interval: [f64; 2],
}

/// Points of a line over the generations: twice the pixels between two of them on a panel of 372. Chosen by hand.
const POINTS: usize = 186;

/// Number of line colours; further lines are dashed.
const COLOURS: usize = 6;

/// Number of lines that look different.
const LOOKS: usize = 2 * COLOURS;

const PANEL: (f64, f64) = (420.0, 290.0);
const BESIDE: f64 = 24.0;

/// Median and quartiles over runs of the best fitness of a generation, a line and a band for each of `compared`. `best` is the
/// greatest possible fitness. All are in `unit`.
#[must_use]
pub fn fitness_compared(compared: &[ComparedRuns], unit: &str, best: Option<f64>, plants: Plants) -> Figure {
    let lines: Vec<Vec<(usize, [f64; 3])>> = compared.iter().map(|one| quartiles(&one.best)).collect();
    let last = lines.iter().flatten().map(|(generation, _)| *generation).max().unwrap_or(1).max(2);
    let all = lines.iter().flatten().flat_map(|(_, values)| *values);
    let y = Axis::covering(format!("best fitness ({unit})"), (0.0, best.unwrap_or(1.0).max(1.0)), all);
    let x = Axis { label: "generation".to_owned(), from: 0.0, to: last as f64, tick: number };
    let looks: Vec<String> = (0..compared.len()).map(look).collect();
    let legend: Vec<(&str, String)> =
        looks.iter().zip(compared).map(|(look, one)| (look.as_str(), escaped(&one.name))).collect();
    let top = 28.0 + LEGEND_ROW * (legend_rows(&legend, PANEL.0 + BESIDE) - 1) as f64;
    let mut plot = Plot::new(x, y, PANEL, BESIDE, top);
    if let Some(best) = best {
        plot.horizontal_line("grid dotted", best);
        let place = (plot.right_edge() + 2.0, plot.place(0.0, best).1 + 4.0);
        plot.text("tick", place, "start", &number(best));
    }
    let mut data = "name,generation,quartile_1,median,quartile_3\n".to_owned();
    for ((line, look), one) in lines.iter().zip(&looks).zip(compared) {
        draw_band(&mut plot, line, look);
        for (generation, values) in line {
            let [low, median, high] = values.map(Cell);
            let name = one.name.replace('"', "\"\"");
            let _ = writeln!(data, "\"{name}\",{generation},{low},{median},{high}");
        }
    }
    for (line, look) in lines.iter().zip(&looks) {
        let medians = line.iter().map(|(generation, [_, median, _])| (*generation as f64, *median));
        plot.line(&format!("bold {look}"), medians);
    }
    plot.legend(&legend);
    Figure {
        number: "comparison",
        title: "Fitness over the generations, compared".to_owned(),
        caption: format!(
            "Best fitness of a generation over independent evolutionary runs: the median as a line, the quartiles as a band.{} {}",
            if best.is_some() { " The dotted line marks the best possible fitness." } else { "" },
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// A strip of points and a box for each of `compared`, in `unit`; `what` says what a point is, such as `a run`.
#[must_use]
pub fn values_compared(
    compared: &[ComparedRuns],
    unit: &str,
    best: f64,
    what: &str,
    plants: Plants,
) -> Figure {
    let scores = |one: &ComparedRuns| ControllerScores {
        name: escaped(&one.name),
        fitness: one.values.clone(),
        interval: one.interval,
    };
    let strips = score_strips(&compared.iter().map(scores).collect::<Vec<_>>(), unit, best, plants);
    let mut data = format!("name,fitness_{unit}\n");
    for one in compared {
        for value in &one.values {
            let _ = writeln!(data, "\"{}\",{}", one.name.replace('"', "\"\""), Cell(*value));
        }
    }
    Figure {
        title: "Fitness, compared".to_owned(),
        caption: format!(
            "A point {what}. Box: quartiles and median; whiskers: 5 % and 95 %. Below: mean and its 95 % interval, by \
             bootstrap. {}",
            plants.sentence()
        ),
        data,
        ..strips
    }
}

/// Lower quartile, median and upper quartile over runs at some [`POINTS`] generations, the first and the last among them. A run
/// that ended early counts in the generations that it has.
fn quartiles(runs: &[Vec<f64>]) -> Vec<(usize, [f64; 3])> {
    let generations = runs.iter().map(Vec::len).max().unwrap_or(0);
    let step = generations.div_ceil(POINTS).max(1);
    let is_shown = |generation: &usize| (generation - 1).is_multiple_of(step) || *generation == generations;
    let at = |generation: usize| {
        let of_runs = runs.iter().filter_map(|run| run.get(generation - 1).copied());
        let finite: Vec<f64> = of_runs.filter(|value| value.is_finite()).collect();
        let [_, low, median, high, _] = five_numbers(&finite)?;
        Some((generation, [low, median, high]))
    };
    (1..=generations).filter(is_shown).filter_map(at).collect()
}

fn draw_band(plot: &mut Plot, line: &[(usize, [f64; 3])], look: &str) {
    let edge = |which: usize| {
        let places = line.iter().map(|(generation, values)| plot.place(*generation as f64, values[which]));
        places.collect::<Vec<Place>>()
    };
    let (low, high) = (edge(0), edge(2));
    let around: Vec<Place> =
        low.iter().copied().chain(high.into_iter().rev()).chain(low.first().copied()).collect();
    let mut band = Path::default();
    band.line(&around);
    plot.fill(&format!("band {look}"), &band);
}

/// The classes of the line with this number. Those beyond [`LOOKS`] look like earlier ones.
fn look(index: usize) -> String {
    let dash = if index % LOOKS >= COLOURS { " dashed" } else { "" };
    format!("e{}{dash}", index % COLOURS)
}

/// A name as text of an SVG.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn compared(name: &str, speed: f64, generations: usize) -> ComparedRuns {
        let run = |run: usize| {
            (0..generations)
                .map(|at| 14.0 - 12.0 / (1.0 + at as f64 * speed * (run + 2) as f64 / 60.0))
                .collect()
        };
        let best: Vec<Vec<f64>> = (0..6).map(run).collect();
        let values: Vec<f64> = best.iter().filter_map(|run| run.last().copied()).collect();
        ComparedRuns { name: name.to_owned(), best, values, interval: [11.0, 12.5] }
    }

    #[test]
    fn the_comparison_is_golden() {
        let both = [compared("population=50", 1.0, 300), compared("population=150", 2.5, 200)];
        testing::golden(&fitness_compared(&both, "cm", Some(15.0), Plants::ModelOfVirtual));
    }

    #[test]
    fn the_data_are_those_of_the_lines() {
        let one = compared("a \"b\", c", 1.0, 500);
        let figure = fitness_compared(std::slice::from_ref(&one), "cm", None, Plants::ModelOfReal);
        let lines: Vec<&str> = figure.data.lines().collect();
        assert!((POINTS / 2..=POINTS + 2).contains(&lines.len()), "{}", lines.len());
        assert!(lines[1].starts_with("\"a \"\"b\"\", c\",1,2.0000,2.0000,2.0000"), "{}", lines[1]);
        assert!(lines[lines.len() - 1].starts_with("\"a \"\"b\"\", c\",500,"), "the last generation");
        let values = values_compared(&[one], "cm", 15.0, "a run", Plants::ModelOfReal);
        assert_eq!((values.data.lines().count(), values.number), (7, "scores"));
    }

    #[test]
    fn many_lines_and_none_are_figures() {
        let names = (0..14).map(|index| compared(&format!("a<{index}&"), 1.0, 3));
        let empty = ComparedRuns {
            name: "-".to_owned(),
            best: Vec::new(),
            values: Vec::new(),
            interval: [f64::NAN; 2],
        };
        for all in [names.collect(), Vec::new(), vec![empty]] {
            for figure in [
                fitness_compared(&all, "cm", Some(15.0), Plants::Virtual),
                values_compared(&all, "cm", 15.0, "a run", Plants::Virtual),
            ] {
                let Body::Svg(svg) = figure.body else { panic!() };
                testing::assert_well_formed(&svg);
                assert!(!svg.contains("NaN") && !svg.contains("a<"), "{svg}");
            }
        }
    }
}
