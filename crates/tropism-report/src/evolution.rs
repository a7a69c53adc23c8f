//! Figure 6: fitness over the generations.

use std::fmt::Write;

use super::csv::Cell;
use super::plot::{Axis, Path, Plot, nice_step};
use super::{Body, Figure, Plants};
use tropism::math::statistics::five_numbers;
use tropism::text::plural;

/// The best possible fitness of the paper's task, which its Figure 6 marks, in cm.
const PAPER_BEST: f64 = 15.0;

/// The median of the paper's Figure 6a in cm, read by eye from the printed figure, and the generation at which it saturates,
/// section 3.1.
const PAPER_MEDIAN: (f64, f64) = (14.0, 1000.0);

/// The unit of that fitness.
const PAPER_UNIT: &str = "cm";

/// Approximate number of boxes (Fig. 6a has 21).
const BOXES: f64 = 20.0;

/// Figure 6a: box plots of the best fitness of a generation over runs, in `unit`; `runs[run][generation - 1]`.
///
/// A box reaches from the 25th to the 75th percentile and shows the median; its whiskers reach to the minimum and the
/// maximum. Boxes stand at generation 1 and at round generations (every hundredth of 2000). A run that ended early counts
/// in the generations that it has.
#[must_use]
pub fn fitness_boxes(runs: &[Vec<f64>], unit: &str, plants: Plants) -> Figure {
    let generations = runs.iter().map(Vec::len).max().unwrap_or(0);
    let step = (nice_step(generations as f64 / BOXES * 8.0).max(1.0)) as usize;
    let shown = (1..=generations).filter(|generation| *generation == 1 || generation % step == 0);
    let boxes: Vec<(usize, [f64; 5])> = shown
        .filter_map(|generation| {
            let fitness = runs.iter().filter_map(|run| run.get(generation - 1)).copied();
            let finite: Vec<f64> = fitness.filter(|value| value.is_finite()).collect();
            Some((generation, five_numbers(&finite)?))
        })
        .collect();
    let label = format!("best fitness ({unit})");
    let y = Axis::covering(label, ends(unit), boxes.iter().flat_map(|(_, numbers)| *numbers));
    let last = generations.max(1) as f64;
    let room = 0.03 * last;
    let mut plot = Plot::new(axis_of_generations(-room, last + room), y, (372.0, 270.0), 18.0, 28.0);
    let half = (0.32 * step as f64 * plot.scale()).clamp(1.5, 7.0);
    plot.line("median thin", boxes.iter().map(|(generation, numbers)| (*generation as f64, numbers[2])));
    mark_best(&mut plot, unit);
    let (median, flat) = PAPER_MEDIAN;
    let has_paper = unit == PAPER_UNIT && last > flat;
    if has_paper {
        plot.line("thin dashed", [flat, last].map(|generation| (generation, median)).into_iter());
    }
    let mut data = "generation,least,quartile_1,median,quartile_3,greatest\n".to_owned();
    for (generation, numbers) in &boxes {
        let [least, low, median, high, greatest] = numbers.map(Cell);
        let _ = writeln!(data, "{generation},{least},{low},{median},{high},{greatest}");
        draw_box(&mut plot, *generation as f64, numbers, half);
    }
    Figure {
        number: "6a",
        title: format!("Best fitness, {}", plural(runs.len(), "run")),
        caption: format!(
            "Best fitness of a generation over independent evolutionary runs: minimum, quartiles and maximum, with the median \
             as a bar{}{}. {}",
            if unit == PAPER_UNIT {
                "; the dotted line marks 15 cm, the best possible in the paper's task"
            } else {
                ""
            },
            if has_paper {
                "; the dashed line is the paper's median, about 14 cm from generation 1000 on"
            } else {
                ""
            },
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// The ends of the axis of fitness, which reach farther if it does.
fn ends(unit: &str) -> (f64, f64) {
    (0.0, if unit == PAPER_UNIT { PAPER_BEST + 1.0 } else { 1.0 })
}

/// Marks the best possible fitness of the paper's task, on an axis of its unit.
fn mark_best(plot: &mut Plot, unit: &str) {
    if unit == PAPER_UNIT {
        plot.horizontal_line("grid dotted", PAPER_BEST);
        plot.text("tick", (plot.right_edge() + 2.0, plot.place(0.0, PAPER_BEST).1 + 4.0), "start", "15");
    }
}

fn axis_of_generations(from: f64, to: f64) -> Axis {
    Axis { label: "generation".to_owned(), from, to, tick: super::plot::number }
}

fn draw_box(plot: &mut Plot, generation: f64, numbers: &[f64; 5], half: f64) {
    let [minimum, low, median, high, maximum] = numbers.map(|value| plot.place(generation, value).1);
    let (x, _) = plot.place(generation, 0.0);
    let mut whiskers = Path::default();
    whiskers.line(&[(x, minimum), (x, maximum)]);
    for end in [minimum, maximum] {
        whiskers.line(&[(x - half / 2.0, end), (x + half / 2.0, end)]);
    }
    plot.path("thin", &whiskers);
    let mut outline = Path::default();
    outline.line(&[(x - half, low), (x + half, low), (x + half, high), (x - half, high), (x - half, low)]);
    plot.fill("box", &outline);
    let mut bar = Path::default();
    bar.line(&[(x - half, median), (x + half, median)]);
    plot.path("bold best", &bar);
}

/// Figure 6b of the run whose last generation has the upper median of all best fitness; `None` without runs.
#[must_use]
pub fn fitness_median_run(
    best: &[Vec<f64>],
    mean: &[Vec<f64>],
    unit: &str,
    plants: Plants,
) -> Option<Figure> {
    let run = median_run(best)?;
    let why = "whose last generation has the median of all best fitness";
    Some(fitness_run(run, why, [&best[run], &mean[run]], unit, plants))
}

/// The run whose last generation has the upper median of all best fitness.
fn median_run(best: &[Vec<f64>]) -> Option<usize> {
    let at_end = |run: &usize| best[*run].last().copied().unwrap_or(f64::NEG_INFINITY);
    let mut order: Vec<usize> = (0..best.len()).collect();
    order.sort_by(|a, b| at_end(a).total_cmp(&at_end(b)).then(b.cmp(a)));
    order.get(order.len() / 2).copied()
}

/// Figure 6b: best and mean fitness of each generation of the run with the number `run` from 0, in `unit`. `why` says in the words
/// of a clause why this run is shown.
#[must_use]
pub fn fitness_run(run: usize, why: &str, [best, mean]: [&[f64]; 2], unit: &str, plants: Plants) -> Figure {
    let last = best.len().max(mean.len()).max(2) as f64;
    let y = Axis::covering(format!("fitness ({unit})"), ends(unit), best.iter().chain(mean).copied());
    let mut plot = Plot::new(axis_of_generations(0.0, last), y, (372.0, 270.0), 18.0, 28.0);
    mark_best(&mut plot, unit);
    let mut data = "generation,best,mean\n".to_owned();
    for (generation, (best, mean)) in (1..).zip(best.iter().zip(mean)) {
        let _ = writeln!(data, "{generation},{},{}", Cell(*best), Cell(*mean));
    }
    for (class, fitness) in [("thin mean", mean), ("bold best", best)] {
        plot.line(class, (1..).map(f64::from).zip(fitness.iter().copied()));
    }
    plot.legend(&[("best", "best"), ("mean", "mean")]);
    Figure {
        number: "6b",
        title: format!("Run {run}, a median one"),
        caption: format!(
            "Best and mean fitness of each generation of run {run}, {why}. \
             The best can fall: each generation meets new growth noise, and the best genome is evaluated again. {}",
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn rising(run: usize, generations: usize) -> Vec<f64> {
        (0..generations).map(|at| 14.0 - 12.0 / (1.0 + (at * (run + 2)) as f64 / 60.0)).collect()
    }

    #[test]
    fn figure_6a_is_golden() {
        let runs: Vec<Vec<f64>> = (0..5).map(|run| rising(run, 200)).collect();
        testing::golden(&fitness_boxes(&runs, "cm", Plants::ModelOfVirtual));
    }

    #[test]
    fn figure_6b_is_golden() {
        let best = rising(3, 200);
        let mean: Vec<f64> = best.iter().map(|fitness| fitness - 4.0).collect();
        testing::golden(&fitness_run(3, "one of all", [&best, &mean], "cm", Plants::ModelOfReal));
    }

    #[test]
    fn the_median_run_is_the_upper_median() {
        let runs = [7.0, 1.0, 9.0, 8.0].map(|last| vec![0.0, last]);
        assert_eq!(median_run(&runs), Some(3));
        assert_eq!(median_run(&[]), None);
    }

    #[test]
    fn the_best_of_the_paper_is_marked_in_its_unit_alone() {
        let svg = |unit| match fitness_boxes(&[vec![0.2, 0.4]], unit, Plants::Virtual).body {
            Body::Svg(svg) => svg,
            _ => panic!(),
        };
        assert!(svg("cm").contains("best fitness (cm)") && svg("cm").contains(">15</text>"));
        assert!(svg("turns").contains("best fitness (turns)") && !svg("turns").contains(">15</text>"));
    }

    #[test]
    fn two_thousand_generations_have_the_boxes_of_the_paper() {
        let Body::Svg(svg) = fitness_boxes(&[rising(1, 2000)], "cm", Plants::ModelOfVirtual).body else {
            panic!()
        };
        assert_eq!(svg.matches("fill box").count(), 21);
    }
}
