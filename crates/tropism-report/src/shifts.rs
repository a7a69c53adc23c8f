//! Figure 5: the shifts that the tip-motion model is made of, by place and by light.

use std::collections::BTreeMap;

use super::colour::Ramp;
use super::plot::{Axis, Plot, number};
use super::trajectories::{axes, tips};
use super::{Body, Figure, Plants};
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::track::Track;

/// Side of a cell, in cm.
const CELL: f64 = 0.25;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    X,
    Y,
}

impl Direction {
    const fn of(self, shift: Point) -> f64 {
        match self {
            Self::X => shift.x,
            Self::Y => shift.y,
        }
    }

    /// Shifts beyond this many cm share the last colour, as in the paper.
    const fn limit(self) -> f64 {
        match self {
            Self::X => 2.2,
            Self::Y => 1.0,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::X => "\u{394}x",
            Self::Y => "\u{394}y",
        }
    }
}

/// Column and row of a cell; cell (0, 0) has the root at its centre, so that a mirror maps cells to cells.
type Cell = (i64, i64);

/// Figures 5a to 5d: mean Δx, then mean Δy, in cells of 0.25 cm, for the left and the right light; measured and mirrored
/// shifts pooled, nothing drawn where there are none.
#[must_use]
pub fn shift_maps(tracks: &[Track], plants: Plants) -> [Figure; 4] {
    let mirrored: Vec<Track> = tracks.iter().filter_map(Track::mirrored).collect();
    let all = || tracks.iter().chain(&mirrored);
    let widest = tips(tracks).fold(15.0, |widest: f64, tip| widest.max(tip.x.abs()));
    [("5a", Direction::X, Light::LEFT), ("5b", Direction::X, Light::RIGHT), ("5c", Direction::Y, Light::LEFT), (
        "5d",
        Direction::Y,
        Light::RIGHT,
    )]
    .map(|(number, direction, light)| {
        let (mut x, y) = axes((-15.0, 15.0), (0.0, 25.0), tips(tracks));
        x = Axis::over(x.label, (-15.0, 15.0), [-widest, widest].into_iter());
        Figure {
            number,
            title: format!("{} with the {light} light on", direction.name()),
            caption: format!(
                "Mean {} of a step in cells of 0.25 cm, measured and mirrored data pooled. The colours are stretched \
                 about zero; no colour, no data. {}",
                direction.name(),
                plants.sentence()
            ),
            body: Body::Svg(map(x, y, direction, &means(all(), direction, light))),
        }
    })
}

fn means<'a>(
    tracks: impl Iterator<Item = &'a Track>,
    direction: Direction,
    light: Light,
) -> BTreeMap<Cell, f64> {
    let mut sums: BTreeMap<Cell, (f64, f64)> = BTreeMap::new();
    for (before, after, _) in tracks.flat_map(Track::shifts).filter(|shift| shift.2 == light) {
        // `round` goes away from zero on both sides: a mirrored point falls into the mirrored cell.
        let cell = ((before.y / CELL).round() as i64, (before.x / CELL).round() as i64);
        let (sum, count) = sums.entry(cell).or_default();
        *sum += direction.of(Point::new(after.x - before.x, after.y - before.y));
        *count += 1.0;
    }
    // Rows first, so that neighbours in a row follow each other; handed on as (column, row).
    sums.into_iter().map(|(cell, (sum, count))| (cell, sum / count)).collect()
}

fn map(x: Axis, y: Axis, direction: Direction, means: &BTreeMap<Cell, f64>) -> String {
    let limit = direction.limit();
    let mut plot = Plot::centimetres(x, y, 330.0, 78.0, 28.0);
    let size = CELL * plot.scale();
    let marks: Vec<_> = means
        .iter()
        .map(|(&(row, column), &mean)| {
            let (x, y) = plot.place((column as f64 - 0.5) * CELL, row as f64 * CELL);
            (Ramp::level(stretched(mean / limit)), (x, y))
        })
        .collect();
    plot.dashes(Ramp::Diverging, (size, size), marks.into_iter());
    let ticks = [-1.0, -0.25, 0.0, 0.25, 1.0].map(|share| {
        let sign = if share > 0.0 { "+" } else { "" };
        (stretched(share), format!("{sign}{}", number(share * limit)))
    });
    plot.colour_bar(
        Ramp::Diverging,
        &format!("{} (cm)", direction.name()),
        &ticks.each_ref().map(|(share, words)| (*share, words.as_str())),
    );
    plot.finish()
}

/// The place in the ramp of a share of the limit, from -1 to 1: its square root with its sign, since most shifts are
/// small.
fn stretched(share: f64) -> f64 {
    0.5 + 0.5 * share.abs().sqrt().copysign(share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn figure_5b_is_golden() {
        let [_, figure, _, _] = shift_maps(&testing::swings(3, 60), Plants::Virtual);
        assert_eq!(figure.number, "5b");
        testing::golden(&figure);
    }

    #[test]
    fn the_left_map_is_the_right_one_in_a_mirror() {
        let tracks = testing::swings(2, 80);
        let mirrored: Vec<Track> = tracks.iter().filter_map(Track::mirrored).collect();
        let all = || tracks.iter().chain(&mirrored);
        let left = means(all(), Direction::X, Light::LEFT);
        let right = means(all(), Direction::X, Light::RIGHT);
        assert!(left.len() > 20);
        assert_eq!(left.len(), right.len());
        for ((row, column), shift) in left {
            assert!((shift + right[&(row, -column)]).abs() < 1e-9);
        }
    }

    #[test]
    fn colours_are_stretched_about_zero() {
        assert_eq!([-1.0, -0.25, 0.0, 0.25, 1.0].map(stretched), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }
}
