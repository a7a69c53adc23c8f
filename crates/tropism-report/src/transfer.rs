//! Figures of a comparison of controllers on many plants: the distribution of their scores, and chosen trajectories.

use super::plot::{Axis, Path, Plot, number};
use super::trajectories::{Goals, axes, draw_steering, tips};
use super::{Body, Figure, Plants, lamp, plot};
use tropism::math::statistics::quantile_linear;
use tropism::track::Track;

/// The scores of a controller on the same plants as the others.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerScores {
    /// Name, without characters that mean something in XML.
    pub name: String,
    /// Fitness of each plant.
    pub fitness: Vec<f64>,
    /// 95 % interval of the mean.
    pub interval: [f64; 2],
}

/// A plant that a controller steered.
#[derive(Clone, Debug, PartialEq)]
pub struct SteeredPlant {
    /// Title, such as `best: plant 12, 14.1 cm`.
    pub title: String,
    /// The track of its tip.
    pub track: Track,
    /// Its targets and obstacles.
    pub goals: Goals,
}

/// Height of a row of [`score_strips`], in pixels.
const ROW: f64 = 62.0;
/// Places in a row below its upper edge, in pixels: the name, the points, the box and the interval of the mean.
const NAME: f64 = 14.0;
const POINTS: f64 = 27.0;
const BOX: f64 = 43.0;
const MEAN: f64 = 54.0;
/// Half of the height of the strip of points and of the box, in pixels.
const HALF_STRIP: f64 = 6.0;
const HALF_BOX: f64 = 5.0;
/// The golden ratio minus one: its multiples spread points evenly over the strip, whatever their number.
const SPREADING: f64 = 0.618_033_988_749_895;

/// A strip of points and a box for each controller: a point a plant; quartiles and median, whiskers from the 5 % to the 95 %
/// quantile; below it the mean with its 95 % interval. `unit` is that of the fitness, and `best` the greatest possible one.
#[must_use]
pub fn score_strips(controllers: &[ControllerScores], unit: &str, best: f64, plants: Plants) -> Figure {
    let rows = controllers.len().max(1) as f64;
    let all = controllers.iter().flat_map(|controller| controller.fitness.iter().copied());
    let x = Axis::covering(format!("fitness ({unit})"), (0.0, best.max(1.0)), all);
    let y = Axis { label: String::new(), from: 0.0, to: rows, tick: |_| String::new() };
    let mut plot = Plot::new(x, y, (560.0, ROW * rows), 24.0, 14.0);
    for (row, controller) in controllers.iter().enumerate() {
        draw_strip(&mut plot, row, controller);
    }
    Figure {
        number: "scores",
        title: "Fitness of each plant".to_owned(),
        caption: format!(
            "A point a plant, the same plants for each controller. Box: quartiles and median; whiskers: 5 % and 95 % of the \
             plants. Below: mean and its 95 % interval, by bootstrap over the plants. {}",
            plants.sentence()
        ),
        data: String::new(),
        body: Body::Svg(plot.finish()),
    }
}

fn draw_strip(plot: &mut Plot, row: usize, controller: &ControllerScores) {
    let top = plot.top_edge() + ROW * row as f64;
    let fitness: Vec<f64> = controller.fitness.iter().copied().filter(|value| value.is_finite()).collect();
    let at = |plot: &Plot, value: f64| plot.place(value, 0.0).0;
    let (left, _) = plot.place(plot.ends().0.x, 0.0);
    plot.text("mark", (left + 8.0, top + NAME), "start", &controller.name);
    for (index, &value) in fitness.iter().enumerate() {
        let across = (SPREADING * index as f64).fract() * 2.0 - 1.0;
        let place = (at(plot, value), top + POINTS + HALF_STRIP * across);
        plot.disc("fill e0 faint", place, 2.2);
    }
    if fitness.is_empty() {
        return;
    }
    let [low, quarter, median, three_quarters, high] =
        [0.05, 0.25, 0.5, 0.75, 0.95].map(|share| at(plot, quantile_linear(&fitness, share)));
    let middle = top + BOX;
    let mut whiskers = Path::default();
    whiskers.line(&[(low, middle), (high, middle)]);
    for end in [low, high] {
        whiskers.line(&[(end, middle - HALF_BOX / 2.0), (end, middle + HALF_BOX / 2.0)]);
    }
    plot.path("thin", &whiskers);
    let mut outline = Path::default();
    let (above, below) = (middle - HALF_BOX, middle + HALF_BOX);
    outline.line(&[
        (quarter, above),
        (three_quarters, above),
        (three_quarters, below),
        (quarter, below),
        (quarter, above),
    ]);
    plot.fill("box", &outline);
    let mut bar = Path::default();
    bar.line(&[(median, above), (median, below)]);
    plot.path("bold best", &bar);
    let mean = fitness.iter().sum::<f64>() / fitness.len() as f64;
    let [from, to] = controller.interval.map(|value| at(plot, value));
    let mut interval = Path::default();
    interval.line(&[(from, top + MEAN), (to, top + MEAN)]);
    plot.path("bold e5", &interval);
    plot.disc("fill e5", (at(plot, mean), top + MEAN), 3.0);
    plot.text("tick", (at(plot, mean).max(to) + 8.0, top + MEAN + 4.0), "start", &number(mean));
}

/// Width of a panel of [`steering_panels`], and space beside and above it, in pixels.
const PANEL: f64 = 214.0;
const BESIDE: f64 = 24.0;
const ABOVE: f64 = 46.0;
/// Height of the line with the name of a controller, in pixels.
const HEADING: f64 = 26.0;

/// Trajectories of chosen plants, a row of panels for each controller: its name, and the plants.
#[must_use]
pub fn steering_panels(rows: &[(String, Vec<SteeredPlant>)], plants: Plants) -> Figure {
    let (mut width, mut height, mut panels) = (0.0_f64, 0.0, String::new());
    for (name, steered) in rows {
        panels += &format!("<text class=\"label mark\" x=\"0\" y=\"{:.1}\">{name}</text>", height + 16.0);
        let tracks: Vec<Track> = steered.iter().map(|plant| plant.track.clone()).collect();
        let (mut left, mut row) = (0.0, 0.0_f64);
        for plant in steered {
            let svg = panel(plant, &tracks);
            let (wide, high) = plot::size(&svg);
            let frame = format!(
                "<svg x=\"{left:.1}\" y=\"{:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\"",
                height + HEADING
            );
            panels += &svg.replacen("<svg", &frame, 1);
            left += wide;
            row = row.max(high);
        }
        width = width.max(left);
        height += HEADING + row;
    }
    Figure {
        number: "trajectories",
        title: "Best, median and worst plant of each controller".to_owned(),
        caption: format!(
            "The trajectory of the tip, from the circle, coloured by the lamp that the controller lit. Crosses are the targets \
             in their order, on dotted lines at their heights. {}{}",
            rows.iter().flat_map(|(_, plants)| plants).next().map_or("", |plant| plant.goals.sentence()),
            plants.sentence()
        ),
        data: String::new(),
        body: Body::Svg(format!(
            "<svg class=\"figure\" viewBox=\"0 0 {width:.1} {height:.1}\">{panels}</svg>"
        )),
    }
}

/// The panel of one plant, on axes that hold all `tracks`.
fn panel(plant: &SteeredPlant, tracks: &[Track]) -> String {
    let points = tips(tracks).chain(&plant.goals.targets);
    let (x, y) = axes((-8.0, 8.0), plant.goals.heights(), points);
    let mut plot = Plot::centimetres(x, y, PANEL, BESIDE, ABOVE);
    draw_steering(&mut plot, &plant.track.samples, &plant.goals, false);
    plot.legend(&lamp::legend(&plant.track.layout, "light"));
    let (left, _) = plot.place(plot.ends().0.x, 0.0);
    plot.text("label", (left, 14.0), "start", &plant.title);
    plot.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use tropism::geometry::Point;

    #[test]
    fn the_strips_are_golden() {
        let scores = |name: &str, middle: f64| ControllerScores {
            name: name.to_owned(),
            fitness: (0..30).map(|plant| middle + f64::from(plant * plant % 17) / 3.0).collect(),
            interval: [middle + 1.8, middle + 3.1],
        };
        testing::golden(&score_strips(
            &[scores("greedy", 6.0), scores("run-07", 8.5)],
            "cm",
            15.0,
            Plants::Virtual,
        ));
    }

    #[test]
    fn panels_stand_in_rows() {
        let track = testing::swings(1, 60).remove(0);
        let plant = SteeredPlant {
            title: "best: plant 1".to_owned(),
            track,
            goals: Goals { targets: vec![Point::new(3.0, 6.0)], ..Goals::default() },
        };
        let rows = vec![("greedy".to_owned(), vec![plant.clone(); 3]), ("rule".to_owned(), vec![plant; 3])];
        let Body::Svg(svg) = steering_panels(&rows, Plants::Virtual).body else { panic!() };
        testing::assert_well_formed(&svg);
        assert_eq!(svg.matches("best: plant 1").count(), 6);
        let (width, _) = plot::size(&svg);
        assert!((width - 3.0 * (50.0 + PANEL + BESIDE)).abs() < 1e-9, "{width}");
    }

    #[test]
    fn no_plants_are_still_a_figure() {
        let none =
            ControllerScores { name: "greedy".to_owned(), fitness: Vec::new(), interval: [f64::NAN; 2] };
        for figure in [
            score_strips(&[], "cm", 15.0, Plants::Virtual),
            score_strips(&[none], "cm", 15.0, Plants::Virtual),
            steering_panels(&[], Plants::Virtual),
        ] {
            let Body::Svg(svg) = figure.body else { panic!() };
            testing::assert_well_formed(&svg);
            assert!(!svg.contains("NaN"), "{svg}");
        }
    }
}
