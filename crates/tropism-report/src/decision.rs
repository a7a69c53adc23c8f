//! Decision map of a controller: the lamp that it lights, over the position of the tip.

use tropism_neat::Genome;

use super::colour::ColourMap;
use super::plot::{Axis, Path, Plot};
use super::trajectories::{Goals, axes, draw_steering};
use super::{Body, Figure, Plants};
use tropism::control::ShapeError;
use tropism::control::network_analysis::{Boundary, Decisions, NetworkAnalysis};
use tropism::geometry::Point;
use tropism::math::interpolate::lerp;
use tropism::track::Track;

/// Side of a cell, in cm; chosen by hand.
const CELL: f64 = 0.125;

/// Work of a map, at most: links, and five for each neuron, times activations. Where it would take more, cells are larger.
/// Chosen: about a second. Networks that settle soon, as evolved ones do, have the smallest cells.
const MAX_WORK: f64 = 3e8;

/// Places in a row and in a column at which the work of a map is measured.
const PROBES: usize = 5;

/// Shares of the diverging colour map for the left lamp, for neither and for the right lamp. Chosen by hand: pale, so that a
/// trajectory stands out.
const PALE: [f64; 3] = [0.31, 0.5, 0.69];

/// The track of a plant that the controller steered, to draw over its map.
#[derive(Clone, Copy, Debug)]
pub struct SteeredTrack<'t> {
    /// The trajectory of the tip.
    pub track: &'t Track,
    /// The kind of plant.
    pub plants: Plants,
}

/// Draws the lamp that the controller `genome` lights for a tip that rests at a point, with targets and a steered track.
///
/// The map reaches over x from -8 to 8 cm and y from 4 to 16 cm, and further where targets or the track do.
///
/// # Errors
/// [`ShapeError`] if the genome does not have two inputs and one output.
pub fn decision(
    genome: &Genome,
    targets: &[Point],
    steered: Option<SteeredTrack<'_>>,
) -> Result<Figure, ShapeError> {
    let samples = steered.map_or(&[][..], |steered| &steered.track.samples);
    let points = samples.iter().map(|sample| &sample.tip).chain(targets);
    let (x, y) = axes((-8.0, 8.0), (4.0, 16.0), points);
    let decisions = Decisions::new(genome, corners(&x, &y))?;
    let mut plot = Plot::centimetres(x, y, 372.0, 18.0, 28.0);
    draw_map(&mut plot, &decisions, genome.links().len() + 5 * genome.neurons().len());
    let goals = Goals { targets: targets.to_vec(), ..Goals::default() };
    draw_steering(&mut plot, samples, &goals, true);
    let depends = ColourMap::Diverging.class(ColourMap::level(PALE[1]));
    plot.legend(&[("left", "left lamp"), ("right", "right lamp"), (&depends, "depends")]);
    let state = match NetworkAnalysis::of(genome) {
        NetworkAnalysis { is_linear: true, .. } => String::new(),
        NetworkAnalysis { has_memory: false, .. } => {
            " The network is activated until its signals have passed; along a trajectory the decision may lag.".to_owned()
        }
        _ => " The network has memory: it is activated until its state settles, once from rest and once from each corner of \
             the map. Grey: the lamp depends on the past, or never settles."
            .to_owned(),
    };
    let path = steered.map_or_else(String::new, |steered| {
        format!(
            " The line is the trajectory of a tip, from the circle, coloured by the lamp that was lit. {}",
            steered.plants.sentence()
        )
    });
    Ok(Figure {
        number: "decision",
        title: "Decision map".to_owned(),
        caption: format!("The lamp that the controller lights for a tip that rests at a point.{state}{path}"),
        data: String::new(),
        body: Body::Svg(plot.finish()),
    })
}

fn corners(x: &Axis, y: &Axis) -> [Point; 4] {
    [(x.from, y.from), (x.to, y.from), (x.from, y.to), (x.to, y.to)].map(|(x, y)| Point::new(x, y))
}

/// Draws the decision in each cell of the panel. `work` is that of one activation.
fn draw_map(plot: &mut Plot, decisions: &Decisions, work: usize) {
    let (from, to) = plot.ends();
    let count = |from: f64, to: f64| ((to - from) / CELL).round().clamp(1.0, 400.0);
    let (columns, rows) = (count(from.x, to.x), count(from.y, to.y));
    let probe = |row: usize, column: usize| {
        let share = |place: usize| (place as f64 + 0.5) / PROBES as f64;
        decisions.activations(Point::new(lerp(from.x, to.x, share(column)), lerp(from.y, to.y, share(row))))
    };
    let probes = (0..PROBES * PROBES).map(|place| probe(place / PROBES, place % PROBES));
    let activations = probes.sum::<usize>() as f64 / (PROBES * PROBES) as f64;
    let factor = (columns * rows * activations * work as f64 / MAX_WORK).sqrt().max(1.0);
    let [columns, rows] = [columns, rows].map(|count| (count / factor).round().max(1.0) as usize);
    let (wide, high) = ((to.x - from.x) / columns as f64, (to.y - from.y) / rows as f64);
    let corner = plot.place(from.x, from.y);
    let next = plot.place(from.x + wide, from.y + high);
    let mut marks = Vec::with_capacity(columns * rows);
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let (x, y) = (from.x + column as f64 * wide, from.y + (row as f64 + 0.5) * high);
        let share = match decisions.share_right(Point::new(x + 0.5 * wide, y)) {
            0.0 => PALE[0],
            1.0 => PALE[2],
            _ => PALE[1],
        };
        marks.push((ColourMap::level(share), plot.place(x, y)));
    }
    // A little higher than a row, so that no gap shows between two.
    plot.dashes(ColourMap::Diverging, (next.0 - corner.0, corner.1 - next.1 + 0.5), marks.into_iter());
    let mut axes = Path::default();
    axes.line(&[plot.place(from.x, to.y), plot.place(from.x, from.y), plot.place(to.x, from.y)]);
    plot.path("axis", &axes);
}

/// The decision rule of a linear controller as text: `right where 0.830 x - 0.120 y + 0.400 > 0`.
#[must_use]
pub fn rule(boundary: Boundary) -> String {
    let term = |value: f64| format!("{} {:.3}", if value < 0.0 { "-" } else { "+" }, value.abs());
    format!("right where {:.3} x {} y {} > 0", boundary.x, term(boundary.y), term(boundary.constant))
}

/// The map of [`decision`] as text for a terminal.
///
/// One line a centimetre of height from 16 down to 4, one character each half centimetre of x from -8 to 8: `<` left, `>`
/// right, `~` depends on the past, a digit for a target.
///
/// # Errors
/// [`ShapeError`] if the genome does not have two inputs and one output.
pub fn decision_text(genome: &Genome, targets: &[Point]) -> Result<String, ShapeError> {
    let corners = [(-8.0, 4.0), (8.0, 4.0), (-8.0, 16.0), (8.0, 16.0)].map(|(x, y)| Point::new(x, y));
    let decisions = Decisions::new(genome, corners)?;
    let mut text = String::new();
    for height in (4..=16).rev().map(f64::from) {
        let letter = |half: i32| {
            let x = 0.5 * f64::from(half);
            let is_here =
                |target: &Point| (target.x - x).abs() < 0.25 && (target.y - 0.25 - height).abs() <= 0.5;
            if let Some(index) = targets.iter().position(is_here) {
                return char::from_digit(index as u32 + 1, 10).unwrap_or('+');
            }
            match decisions.share_right(Point::new(x, height)) {
                0.0 => '<',
                1.0 => '>',
                _ => '~',
            }
        };
        let line: String = (-16..=16).map(letter).collect();
        text += &format!("{height:4} {line}\n");
    }
    Ok(text + "     -8              0               8  x and y of the tip, cm\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use tropism_neat::{Config, random_genome};

    const TARGETS: [Point; 2] = [Point::new(3.0, 6.0), Point::new(-5.0, 9.0)];

    /// A linear controller whose boundary crosses the map from its lower to its upper edge.
    fn linear() -> Genome {
        let genomes = (0..).map(|index| random_genome(&Config::wahby2016(), 2, 1, 4, index));
        let side = |line: Boundary, x: f64, y: f64| line.x * x + line.y * y + line.constant > 0.0;
        let mut crossed = genomes.filter(|genome| {
            let line = Boundary::of(genome).unwrap();
            [4.0, 16.0].iter().all(|&y| side(line, -8.0, y) != side(line, 8.0, y))
        });
        crossed.next().unwrap()
    }

    #[test]
    fn a_map_with_a_path_is_golden() {
        let track = &testing::swings(1, 120)[0];
        let steered = SteeredTrack { track, plants: Plants::ModelOfVirtual };
        testing::golden(&decision(&linear(), &TARGETS, Some(steered)).unwrap());
    }

    #[test]
    fn the_text_agrees_with_the_boundary() {
        let genome = linear();
        let boundary = Boundary::of(&genome).unwrap();
        let text = decision_text(&genome, &[]).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 14);
        assert!(text.contains('<') && text.contains('>'), "{text}");
        for (line, y) in lines[..13].iter().zip((4..=16).rev()) {
            for (column, letter) in line[5..].chars().enumerate() {
                let x = 0.5 * column as f64 - 8.0;
                let sum = boundary.x * x + boundary.y * f64::from(y) + boundary.constant;
                assert_eq!(letter, if sum > 0.0 { '>' } else { '<' }, "{x}, {y}");
            }
        }
    }

    #[test]
    fn a_rule_is_written_with_signs() {
        let boundary = Boundary { x: -0.5, y: 0.125, constant: -2.0 };
        assert_eq!(rule(boundary), "right where -0.500 x + 0.125 y - 2.000 > 0");
    }

    #[test]
    fn only_controllers_have_a_map() {
        let genome = random_genome(&Config::wahby2016(), 3, 1, 1, 0);
        assert!(decision(&genome, &[], None).is_err() && decision_text(&genome, &[]).is_err());
    }
}
