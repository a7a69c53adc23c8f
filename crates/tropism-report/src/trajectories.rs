//! Figures 4a, 4b, 7 and 8: trajectories of the tip.

use std::borrow::Cow;
use std::fmt::Write;

use super::csv::Cell;
use super::lamp;
use super::plot::{Axis, LEGEND_ROW, Path, Place, Plot, legend_rows};
use super::thinning;
use super::{Body, Figure, Plants};
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::obstacle::Obstacle;
use tropism::task::Task;
use tropism::text::plural;
use tropism::track::{Sample, Track};

/// Least length of a vector of Figure 4b, in cm: shorter steps are joined. Chosen by hand.
const LEAST_VECTOR_CM: f64 = 0.5;

/// Axes of the tip in cm: from `x` and `y`, extended where a point lies outside.
pub(super) fn axes<'a>(
    x: (f64, f64),
    y: (f64, f64),
    points: impl Iterator<Item = &'a Point> + Clone,
) -> (Axis, Axis) {
    (
        Axis::covering("tip x (cm)", x, points.clone().map(|point| point.x)),
        Axis::covering("tip y (cm)", y, points.map(|point| point.y)),
    )
}

/// Share of the paper's axes that the tips reach at least, or other axes fit them better; chosen by hand.
const LEAST_FILLED: f64 = 1.0 / 3.0;

/// Axes of tips in cm: the paper's of Figure 4, unless the plants are much smaller.
fn fitted_axes<'a>(points: impl Iterator<Item = &'a Point> + Clone) -> (Axis, Axis) {
    let most = |value: fn(&Point) -> f64| {
        points.clone().map(value).filter(|value| value.is_finite()).fold(0.0, f64::max)
    };
    let is_small = most(|tip| tip.x.abs()) < LEAST_FILLED * 15.0 && most(|tip| tip.y) < LEAST_FILLED * 25.0;
    if is_small { axes((-1.0, 1.0), (0.0, 2.0), points) } else { axes((-15.0, 15.0), (0.0, 25.0), points) }
}

/// The tips of tracks as CSV, a row a sample.
pub(super) fn csv_of_tips(tracks: &[Track]) -> String {
    let mut text = "plant,step,time_h,tip_x_cm,tip_y_cm,light\n".to_owned();
    for (plant, track) in (1..).zip(tracks) {
        for Sample { step, time_s, tip, light, .. } in &track.samples {
            let (hours, light) = (Cell(time_s / 3600.0), track.layout.name(*light));
            let _ = writeln!(text, "{plant},{step},{hours},{},{},{light}", Cell(tip.x), Cell(tip.y));
        }
    }
    text
}

pub(super) fn tips(tracks: &[Track]) -> impl Iterator<Item = &Point> + Clone {
    tracks.iter().flat_map(|track| track.samples.iter().map(|sample| &sample.tip))
}

/// Figure 4a: the trajectory of each tip in its own colour, and its final height at the right-hand side.
#[must_use]
pub fn trajectories(tracks: &[Track], plants: Plants) -> Figure {
    let (x, y) = fitted_axes(tips(tracks));
    let mut plot = Plot::centimetres(x, y, 346.0, 66.0, 28.0);
    for (index, track) in tracks.iter().enumerate() {
        plot.line(&colour(index), track.samples.iter().map(|sample| (sample.tip.x, sample.tip.y)));
    }
    for (index, height, label) in final_heights(&plot, tracks) {
        let (class, edge) = (colour(index), plot.right_edge());
        let mut tick = Path::default();
        tick.line(&[(edge - 6.0, height), (edge + 4.0, height), (edge + 12.0, label)]);
        plot.path(&class, &tick);
        plot.text(&format!("mark {class}"), (edge + 16.0, label + 4.0), "start", &(index + 1).to_string());
        let last = tracks[index].samples.last().map_or(0.0, |sample| sample.tip.y);
        plot.text("tick", (edge + 32.0, label + 4.0), "start", &format!("{last:.1}"));
    }
    Figure {
        number: "4a",
        title: "Trajectories of the tip".to_owned(),
        caption: format!(
            "Each experiment in its own colour; at the right-hand side its number, as in Figure 2, and its final height in \
             cm. Not mirrored. {}",
            plants.sentence()
        ),
        data: csv_of_tips(tracks),
        body: Body::Svg(plot.finish()),
    }
}

fn colour(index: usize) -> String {
    format!("e{}", index % 6)
}

/// Index, vertical position of the final height and of its label in pixels, of each track that has samples. Labels do not
/// overlap as far as there is space.
fn final_heights(plot: &Plot, tracks: &[Track]) -> Vec<(usize, f64, f64)> {
    // 14 pixels are the line height of a label.
    let spacing = 14.0_f64.min((plot.bottom_edge() - plot.top_edge()) / tracks.len() as f64);
    let last = |(index, track): (usize, &Track)| {
        track.samples.last().map(|sample| (index, plot.place(sample.tip.x, sample.tip.y).1))
    };
    let mut heights: Vec<(usize, f64)> = tracks.iter().enumerate().filter_map(last).collect();
    heights.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut labels: Vec<f64> = Vec::new();
    for (_, height) in &heights {
        labels.push(labels.last().map_or(*height, |above| height.max(above + spacing)));
    }
    // Labels are moved apart downwards; half of that way back up centres them about their ticks.
    let moved = labels.iter().zip(&heights).map(|(label, (_, height))| label - height).fold(0.0, f64::max);
    let room = labels.first().map_or(0.0, |first| first - plot.top_edge());
    let lift = (moved / 2.0).min(room);
    heights.into_iter().zip(labels).map(|((index, height), label)| (index, height, label - lift)).collect()
}

/// Figure 4b: the direction of motion of the tip, coloured by the lamp that was lit.
///
/// A vector is drawn as an arrow. Steps shorter than 0.5 cm are joined while the same lamp stays lit.
#[must_use]
pub fn directions(tracks: &[Track], plants: Plants) -> Figure {
    let (x, y) = fitted_axes(tips(tracks));
    let layout = lamp::layout_of(tracks);
    let legend = lamp::legend(&layout, "light");
    let top = 28.0 + LEGEND_ROW * (legend_rows(&legend, 346.0 + 66.0) - 1) as f64;
    let mut plot = Plot::centimetres(x, y, 346.0, 66.0, top);
    let most = thinning::MAX_MARKS / layout.len();
    let mut is_thinned = false;
    let mut data = "light,from_x_cm,from_y_cm,to_x_cm,to_y_cm\n".to_owned();
    for light in layout.lights() {
        let ends: Vec<(Point, Point)> = tracks.iter().flat_map(|track| vectors(track, light)).collect();
        for (from, to) in &ends {
            let name = layout.name(Some(light));
            let [x, y, to_x, to_y] = [from.x, from.y, to.x, to.y].map(Cell);
            let _ = writeln!(data, "{name},{x},{y},{to_x},{to_y}");
        }
        let all: Vec<(Place, Place)> =
            ends.into_iter().map(|(from, to)| (plot.place(from.x, from.y), plot.place(to.x, to.y))).collect();
        is_thinned |= all.len() > most;
        let mut arrows = Path::default();
        for (from, to) in thinning::longest(all, most, plot.size()) {
            arrow(&mut arrows, from, to);
        }
        plot.fill(lamp::class(Some(light)), &arrows);
    }
    plot.legend(&legend);
    let thinned = if is_thinned { " Of the many arrows the longest at each place is drawn." } else { "" };
    Figure {
        number: "4b",
        title: "Directions of the tip".to_owned(),
        caption: format!(
            "Arrows point in the direction of motion, coloured by the lamp that was lit; steps shorter than 0.5 cm are \
             joined.{thinned} Not mirrored. {}",
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// Start and end of each vector under `light`, at least [`LEAST_VECTOR_CM`] long, except the last before a switch.
fn vectors(track: &Track, light: Light) -> Vec<(Point, Point)> {
    let mut vectors = Vec::new();
    let mut start: Option<Point> = None;
    for sample in &track.samples {
        let is_lit = sample.light == Some(light);
        if let Some(from) = start.filter(|from| !is_lit || from.distance(sample.tip) >= LEAST_VECTOR_CM) {
            vectors.push((from, sample.tip));
            start = None;
        }
        start = start.or(Some(sample.tip)).filter(|_| is_lit);
    }
    vectors
}

/// Length of the head of an arrow and half of its width, in pixels, and half of the width of its shaft; chosen by hand.
const HEAD: f64 = 6.0;
const HALF_HEAD: f64 = 2.6;
const HALF_SHAFT: f64 = 0.55;

/// Adds an arrow to a path that is filled. The head of a short one is as long as the arrow.
fn arrow(path: &mut Path, from: Place, to: Place) {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = (dx * dx + dy * dy).sqrt().max(1e-9);
    let head = HEAD.min(length);
    let at = |along: f64, aside: f64| {
        let (along, aside) = (along / length, aside / length);
        (from.0 + along * dx - aside * dy, from.1 + along * dy + aside * dx)
    };
    let neck = length - head;
    if neck > 0.0 {
        path.start(at(0.0, HALF_SHAFT));
        path.draw(at(neck, HALF_SHAFT));
        path.draw(at(neck, -HALF_SHAFT));
        path.draw(at(0.0, -HALF_SHAFT));
    }
    path.start(at(neck, HALF_HEAD));
    path.draw(to);
    path.draw(at(neck, -HALF_HEAD));
}

/// Figures 7 and 8: the trajectory of one steered tip, coloured by the lamp that was lit, with its targets.
///
/// `number` is `7a` to `7d` in simulation and `8` in reality. `fitness` is that of the track and,
/// where it is known, the best possible one, in cm.
#[must_use]
pub fn steering(
    number: &'static str,
    title: &str,
    track: &Track,
    goals: &Goals,
    (fitness, best): (f64, Option<f64>),
    plants: Plants,
) -> Figure {
    let points = track.samples.iter().map(|sample| &sample.tip).chain(&goals.targets);
    let (x, y) = axes((-8.0, 8.0), goals.heights(), points);
    let legend = lamp::legend(&track.layout, "light on");
    let top = 28.0 + LEGEND_ROW * (legend_rows(&legend, 372.0 + 18.0) - 1) as f64;
    let mut plot = Plot::centimetres(x, y, 372.0, 18.0, top);
    draw_steering(&mut plot, &track.samples, goals, false);
    plot.legend(&legend);
    let steps = track.samples.len().saturating_sub(1);
    Figure {
        number,
        title: format!(
            "{title}, fitness {}{} cm",
            super::plot::number(fitness),
            best.map_or_else(String::new, |best| format!(" of {}", super::plot::number(best)))
        ),
        caption: format!(
            "The trajectory of the tip over {}, from the circle, coloured by the lamp that the controller lit. \
             Crosses are the targets in their order, on dotted lines at their heights. {}{}",
            plural(steps, "step"),
            goals.sentence(),
            plants.sentence()
        ),
        data: csv_of_tips(std::slice::from_ref(track)),
        body: Body::Svg(plot.finish()),
    }
}

/// What a steered plant is to reach, and what its stem must not touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Goals {
    /// Targets of the tip, in cm.
    pub targets: Vec<Point>,
    /// Line on which the stem is to lie, in cm; the stem is drawn with it, where the track has it.
    pub line: Vec<Point>,
    /// Obstacles; the stem is drawn with them, where the track has it.
    pub obstacles: Vec<Obstacle>,
}

impl Goals {
    /// Those of a task.
    #[must_use]
    pub fn of(task: &Task) -> Self {
        Self { targets: task.targets.clone(), line: task.line.clone(), obstacles: task.obstacles.clone() }
    }

    /// Whether the whole stem counts, and not the tip alone.
    const fn has_stem(&self) -> bool {
        !self.obstacles.is_empty() || !self.line.is_empty()
    }

    /// Heights in cm that a figure shows at least: the whole stem where it counts.
    pub(super) const fn heights(&self) -> (f64, f64) {
        if self.has_stem() { (0.0, 16.0) } else { (4.0, 16.0) }
    }

    /// What the caption says of obstacles and of the form of the stem.
    pub(super) const fn sentence(&self) -> &'static str {
        match (self.obstacles.is_empty(), self.line.is_empty()) {
            (true, true) => "",
            (false, true) => "Obstacles are grey, and the stem is drawn every two hours. ",
            (true, false) => "The stem is to end on the dashed line; it is drawn every two hours. ",
            (false, false) => {
                "Obstacles are grey, the stem is to end on the dashed line, and is drawn every two hours. "
            }
        }
    }
}

/// Seconds between two stems that are drawn with obstacles.
const STEMS_S: f64 = 7200.0;

/// Draws obstacles and the line of a form, and the stem of a plant where the goals are about it.
fn draw_stems(plot: &mut Plot, samples: &[Sample], goals: &Goals) {
    plot.line("bold target dashed", goals.line.iter().map(|point| (point.x, point.y)));
    for obstacle in &goals.obstacles {
        let mut path = Path::default();
        match *obstacle {
            Obstacle::Disc { centre, radius_cm } => {
                let (x, y) = plot.place(centre.x, centre.y);
                plot.disc("fill dark faint", (x, y), radius_cm * plot.scale());
            }
            Obstacle::Box { corners: [one, other] } => {
                let corners = [(one.x, one.y), (other.x, one.y), (other.x, other.y), (one.x, other.y)];
                path.line(&corners.map(|(x, y)| plot.place(x, y)));
                plot.fill("dark faint", &path);
            }
            Obstacle::Line { ends } => {
                path.line(&ends.map(|end| plot.place(end.x, end.y)));
                plot.path("bold dark", &path);
            }
        }
    }
    let mut next = 0.0;
    for sample in samples.iter().filter(|_| goals.has_stem()) {
        if let Some(stem) = sample.stem.as_ref().filter(|_| sample.time_s >= next) {
            next = sample.time_s + STEMS_S;
            plot.line("best thin", stem.0.iter().map(|point| (point.x, point.y)));
        }
    }
}

/// Draws the trajectory of one steered tip, coloured by the lamp that was lit, and its goals. With `is_outlined` the
/// trajectory has an outline in the colour of the ground.
pub(super) fn draw_steering(plot: &mut Plot, samples: &[Sample], goals: &Goals, is_outlined: bool) {
    let targets = &goals.targets;
    draw_stems(plot, samples, goals);
    for target in targets {
        plot.horizontal_line("grid dotted", target.y);
    }
    let samples = &*thinned(plot, samples);
    let outline = samples.iter().map(|sample| (sample.tip.x, sample.tip.y));
    plot.line("under", outline.filter(|_| is_outlined));
    for run in runs(samples) {
        let class = format!("bold {}", lamp::class(run[0].lighting().brightest()));
        plot.line(&class, run.iter().map(|sample| (sample.tip.x, sample.tip.y)));
    }
    if let Some(first) = samples.first() {
        plot.disc("start", plot.place(first.tip.x, first.tip.y), 3.5);
    }
    for (index, target) in targets.iter().enumerate() {
        let (x, y) = plot.place(target.x, target.y);
        let mut cross = Path::default();
        cross.line(&[(x - 5.0, y - 5.0), (x + 5.0, y + 5.0)]);
        cross.line(&[(x - 5.0, y + 5.0), (x + 5.0, y - 5.0)]);
        plot.path("bold target", &cross);
        plot.text("mark halo target", (x, y - 10.0), "middle", &(index + 1).to_string());
    }
}

/// The samples that are drawn: a line changes its colour with the lamp, so a long one is thinned before it is cut into colours.
fn thinned<'s>(plot: &Plot, samples: &'s [Sample]) -> Cow<'s, [Sample]> {
    if samples.len() <= thinning::MAX_POINTS {
        return Cow::Borrowed(samples);
    }
    let places: Vec<Place> = samples.iter().map(|sample| plot.place(sample.tip.x, sample.tip.y)).collect();
    thinning::drawn(&places).into_iter().map(|index| samples[index].clone()).collect()
}

/// Runs of samples with the same brightest lamp. Each ends with the first sample of the next, so that the line has no gaps.
fn runs(samples: &[Sample]) -> impl Iterator<Item = &[Sample]> {
    let mut start = 0;
    let is_same = |a: &Sample, b: &Sample| a.lighting().brightest() == b.lighting().brightest();
    let ends = samples.chunk_by(is_same).map(move |run| {
        let range = (start, (start + run.len() + 1).min(samples.len()));
        start += run.len();
        &samples[range.0..range.1]
    });
    ends.filter(|run| run.len() > 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    const TARGETS: [Point; 3] = [Point::new(3.0, 6.0), Point::new(-5.0, 9.0), Point::new(-1.0, 13.5)];

    #[test]
    fn figure_4a_is_golden() {
        testing::golden(&trajectories(&testing::swings(3, 60), Plants::Real));
    }

    #[test]
    fn figure_4b_is_golden() {
        testing::golden(&directions(&testing::swings(3, 60), Plants::Virtual));
    }

    #[test]
    fn figure_7a_is_golden() {
        let track = &testing::swings(1, 120)[0];
        testing::golden(&steering(
            "7a",
            "A good controller",
            track,
            &Goals { targets: TARGETS.to_vec(), ..Goals::default() },
            (14.3, Some(15.0)),
            Plants::ModelOfVirtual,
        ));
    }

    #[test]
    fn a_task_without_a_best_fitness_names_none() {
        let track = &testing::swings(1, 20)[0];
        let figure = steering("8", "A run", track, &Goals::default(), (0.1, None), Plants::Real);
        assert_eq!(figure.title, "A run, fitness 0.1 cm");
    }

    #[test]
    fn vectors_join_short_steps_but_never_two_lights() {
        let rows = [(0.0, 4.0, 'l'), (-0.3, 4.0, 'l'), (-0.6, 4.0, 'l'), (-0.7, 4.0, 'r'), (0.5, 4.0, '-')];
        let track = testing::track(&rows);
        let ends =
            |light| vectors(&track, light).into_iter().map(|(from, to)| (from.x, to.x)).collect::<Vec<_>>();
        assert_eq!(ends(Light::LEFT), [(0.0, -0.6), (-0.6, -0.7)]);
        assert_eq!(ends(Light::RIGHT), [(-0.7, 0.5)]);
    }

    #[test]
    fn the_highest_tip_of_a_long_track_is_drawn() {
        let mut rows: Vec<(f64, f64, char)> = (0..50_000)
            .map(|step| (f64::from(step % 100) / 10.0, 4.0, if step % 2 == 0 { 'l' } else { 'r' }))
            .collect();
        rows[31_234].1 = 15.0;
        let track = testing::track(&rows);
        let plot = {
            let (x, y) = axes((-8.0, 8.0), (4.0, 16.0), tips(std::slice::from_ref(&track)));
            Plot::centimetres(x, y, 372.0, 18.0, 28.0)
        };
        let drawn = thinned(&plot, &track.samples);
        assert!(drawn.len() < 10_000);
        let steps: Vec<u32> = drawn.iter().map(|sample| sample.step).collect();
        assert!([0, 31_234, 49_999].iter().all(|step| steps.contains(step)));
    }

    #[test]
    fn runs_cover_every_step_once() {
        let rows = [(0.0, 4.0, 'l'), (0.0, 4.0, 'l'), (0.0, 4.0, 'r'), (0.0, 4.0, 'l'), (0.0, 4.0, '-')];
        let track = testing::track(&rows);
        let steps = runs(&track.samples)
            .map(|run| run.iter().map(|sample| sample.step).collect::<Vec<_>>())
            .collect::<Vec<_>>();
        assert_eq!(steps, [vec![0, 1, 2], vec![2, 3], vec![3, 4]]);
    }

    #[test]
    fn labels_of_final_heights_do_not_overlap() {
        let tracks: Vec<Track> = (0..6).map(|_| testing::track(&[(0.0, 20.0, '-')])).collect();
        let (x, y) = axes((-15.0, 15.0), (0.0, 25.0), tips(&tracks));
        let plot = Plot::centimetres(x, y, 346.0, 66.0, 28.0);
        let labels = final_heights(&plot, &tracks);
        assert_eq!(labels.len(), 6);
        assert!(labels.windows(2).all(|pair| pair[1].2 - pair[0].2 >= 13.9));
    }
}
