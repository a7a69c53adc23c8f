//! Figure 5: maps of the mean shift of the tip in one step, by place and light: the data of the tip-motion model.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::colour::ColourMap;
use super::csv::Cell;
use super::lamp;
use super::plot::{Axis, Plot, number};
use super::trajectories::{axes, tips};
use super::{Body, Figure, Plants};
use tropism::geometry::Point;
use tropism::lamps::{Light, MAX_LAMPS};
use tropism::track::Track;

/// Side of a cell, in cm; chosen by hand.
const CELL: f64 = 0.25;

/// Cells of a map, at most: those of a larger one are wider. Chosen: some 20 bytes each, three times those of the paper's axes.
const MAX_CELLS: usize = 40_000;

/// A component of the shift.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    X,
    Y,
}

impl Component {
    const fn of(self, shift: Point) -> f64 {
        match self {
            Self::X => shift.x,
            Self::Y => shift.y,
        }
    }

    /// Shifts beyond this, in cm, share the last colour (ends of the colour bars of Fig. 5).
    const fn limit(self) -> f64 {
        match self {
            Self::X => 2.2,
            Self::Y => 1.0,
        }
    }

    /// Its name in files.
    const fn word(self) -> &'static str {
        match self {
            Self::X => "dx",
            Self::Y => "dy",
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::X => "\u{394}x",
            Self::Y => "\u{394}y",
        }
    }
}

/// Row and column of a place on the grid. Place (0, 0) has the root at its centre, so that mirroring maps cells to cells.
type GridPlace = (i64, i64);

/// Numbers of the figures: one a component and lamp.
const NUMBERS: [&str; 2 * MAX_LAMPS] = [
    "5a", "5b", "5c", "5d", "5e", "5f", "5g", "5h", "5i", "5j", "5k", "5l", "5m", "5n", "5o", "5p", "5q",
    "5r", "5s", "5t", "5u", "5v", "5w", "5x", "5y", "5z", "5aa", "5ab", "5ac", "5ad", "5ae", "5af",
];

/// Figures 5a to 5d: mean Δx of each lamp, then mean Δy of each lamp, in cells of 0.25 cm; further letters for more lamps.
///
/// Measured and mirrored shifts are pooled, as far as the lamps of a track have mirror images. Cells without data are not
/// drawn.
#[must_use]
pub fn shift_maps(tracks: &[Track], plants: Plants) -> Vec<Figure> {
    let mirrored: Vec<Track> = tracks.iter().filter_map(Track::mirrored).collect();
    let all = || tracks.iter().chain(&mirrored);
    let widest = tips(tracks).fold(15.0, |widest: f64, tip| widest.max(tip.x.abs()));
    let layout = lamp::layout_of(tracks);
    let pooled = if mirrored.is_empty() { "measured data" } else { "measured and mirrored data pooled" };
    let maps = [Component::X, Component::Y]
        .into_iter()
        .flat_map(|component| layout.lights().map(move |light| (component, light)));
    NUMBERS
        .into_iter()
        .zip(maps)
        .map(|(number, (component, light))| {
            let (mut x, y) = axes((-15.0, 15.0), (0.0, 25.0), tips(tracks));
            x = Axis::covering(x.label, (-15.0, 15.0), [-widest, widest].into_iter());
            let (side, means) = means_of_at_most(MAX_CELLS, all, component, light);
            Figure {
                number,
                title: format!("{} with the {} light on", component.name(), layout.name(Some(light))),
                caption: format!(
                    "Mean {} of a step in cells of {side} cm, {pooled}. The colour scale is the signed square root; cells \
                     without data are blank. {}",
                    component.name(),
                    plants.sentence()
                ),
                data: csv_of_means(component, side, &means),
                body: Body::Svg(map(x, y, component, side, &means)),
            }
        })
        .collect()
}

/// The side of the cells in cm and the mean in each: 0.25 cm, or a multiple of it by a power of two, so that there are at most
/// `most` cells.
fn means_of_at_most<'a, I: Iterator<Item = &'a Track>>(
    most: usize,
    tracks: impl Fn() -> I,
    component: Component,
    light: Light,
) -> (f64, BTreeMap<GridPlace, f64>) {
    if let Some(means) = means(tracks(), component, light, CELL, most) {
        return (CELL, means);
    }
    let ends = (Point::new(f64::MAX, f64::MAX), Point::new(f64::MIN, f64::MIN));
    let (low, high) = tracks().flat_map(Track::shifts).fold(ends, |(low, high), (at, ..)| {
        (Point::new(low.x.min(at.x), low.y.min(at.y)), Point::new(high.x.max(at.x), high.y.max(at.y)))
    });
    // Two more than the distance: a cell is cut by either edge. A cell of infinite size holds all.
    let cells = |side: f64| ((high.x - low.x) / side + 2.0) * ((high.y - low.y) / side + 2.0);
    let mut side = 2.0 * CELL;
    while side.is_finite() && cells(side) > most as f64 {
        side *= 2.0;
    }
    (side, means(tracks(), component, light, side, usize::MAX).unwrap_or_default())
}

/// The mean shift in each cell; `None` if there are more than `most` cells.
fn means<'a>(
    tracks: impl Iterator<Item = &'a Track>,
    component: Component,
    light: Light,
    side: f64,
    most: usize,
) -> Option<BTreeMap<GridPlace, f64>> {
    let mut sums: BTreeMap<GridPlace, (f64, f64)> = BTreeMap::new();
    for (before, after, _) in tracks.flat_map(Track::shifts).filter(|shift| shift.2 == light) {
        // `round` rounds half away from zero on both sides: a mirrored point falls into the mirrored cell.
        let cell = ((before.y / side).round() as i64, (before.x / side).round() as i64);
        let (sum, count) = sums.entry(cell).or_default();
        *sum += component.of(Point::new(after.x - before.x, after.y - before.y));
        *count += 1.0;
        if sums.len() > most {
            return None;
        }
    }
    // The order is by rows, so that neighbours in a row follow each other and become one dash.
    Some(sums.into_iter().map(|(cell, (sum, count))| (cell, sum / count)).collect())
}

/// The means as CSV: the centre of each cell, and the mean shift in it.
fn csv_of_means(component: Component, side: f64, means: &BTreeMap<GridPlace, f64>) -> String {
    let mut text = format!("x_cm,y_cm,mean_{}_cm\n", component.word());
    for ((row, column), &mean) in means {
        let [x, y] = [column, row].map(|&index| Cell(index as f64 * side));
        let _ = writeln!(text, "{x},{y},{}", Cell(mean));
    }
    text
}

fn map(x: Axis, y: Axis, component: Component, side: f64, means: &BTreeMap<GridPlace, f64>) -> String {
    let limit = component.limit();
    let mut plot = Plot::centimetres(x, y, 330.0, 78.0, 28.0);
    let size = side * plot.scale();
    let marks: Vec<_> = means
        .iter()
        .map(|(&(row, column), &mean)| {
            let (x, y) = plot.place((column as f64 - 0.5) * side, row as f64 * side);
            (ColourMap::level(colour_share(mean / limit)), (x, y))
        })
        .collect();
    plot.dashes(ColourMap::Diverging, (size, size), marks.into_iter());
    let ticks = [-1.0, -0.25, 0.0, 0.25, 1.0].map(|share| {
        let sign = if share > 0.0 { "+" } else { "" };
        (colour_share(share), format!("{sign}{}", number(share * limit)))
    });
    plot.colour_bar(
        ColourMap::Diverging,
        &format!("{} (cm)", component.name()),
        &ticks.each_ref().map(|(share, text)| (*share, text.as_str())),
    );
    plot.finish()
}

/// Position in the colour map of a share of the limit, from -1 to 1: its signed square root, because most shifts are
/// small.
fn colour_share(share: f64) -> f64 {
    0.5 + 0.5 * share.abs().sqrt().copysign(share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn figure_5b_is_golden() {
        let figures = shift_maps(&testing::swings(3, 60), Plants::Virtual);
        assert_eq!((figures.len(), figures[1].number), (4, "5b"));
        testing::golden(&figures[1]);
    }

    #[test]
    fn the_left_map_is_the_mirrored_right_one() {
        let tracks = testing::swings(2, 80);
        let mirrored: Vec<Track> = tracks.iter().filter_map(Track::mirrored).collect();
        let all = || tracks.iter().chain(&mirrored);
        let left = means(all(), Component::X, Light::LEFT, CELL, MAX_CELLS).unwrap();
        let right = means(all(), Component::X, Light::RIGHT, CELL, MAX_CELLS).unwrap();
        assert!(left.len() > 20);
        assert_eq!(left.len(), right.len());
        for ((row, column), shift) in left {
            assert!((shift + right[&(row, -column)]).abs() < 1e-9);
        }
    }

    #[test]
    fn the_colour_scale_is_a_signed_square_root() {
        assert_eq!([-1.0, -0.25, 0.0, 0.25, 1.0].map(colour_share), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }
}
