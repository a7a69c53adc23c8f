//! Figure 9: the stem as ten points, over one experiment.

use std::fmt::Write;

use super::csv::Cell;
use super::lamp;
use super::plot::{Axis, LEGEND_ROW, Plot, legend_rows};
use super::{Body, Figure, Plants};
use tropism::geometry::Polyline;
use tropism::lamps::{Layout, Light};

/// A stem in cm from the base up, and the lamp that was lit; `None` is dark.
pub type LitStem = (Polyline, Option<Light>);

/// Figure 9: each stem as a line through its ten points, coloured by the lamp that was lit, with a disc at its end.
///
/// Later stems are drawn over earlier ones.
#[must_use]
pub fn stems(stems: &[LitStem], layout: &Layout, plants: Plants) -> Figure {
    let points = stems.iter().flat_map(|(stem, _)| &stem.0);
    let x = Axis::covering("x (cm)", (-10.0, 10.0), points.clone().map(|point| point.x));
    let y = Axis::covering("y (cm)", (0.0, 15.0), points.map(|point| point.y));
    let legend = lamp::legend(layout, "light");
    let top = 28.0 + LEGEND_ROW * (legend_rows(&legend, 372.0 + 18.0) - 1) as f64;
    let mut plot = Plot::centimetres(x, y, 372.0, 18.0, top);
    for (stem, light) in stems {
        plot.line(lamp::class(*light), stem.0.iter().map(|point| (point.x, point.y)));
    }
    for (stem, _) in stems {
        if let Some(end) = stem.0.last() {
            plot.disc("start", plot.place(end.x, end.y), 2.0);
        }
    }
    plot.legend(&legend);
    Figure {
        number: "9",
        title: "The stem as ten points".to_owned(),
        caption: format!(
            "{} stems of one experiment, from first to last, each a line through ten points at equal distances; discs mark \
             the end of the stem. Not mirrored. {}",
            stems.len(),
            plants.sentence()
        ),
        data: csv_of_stems(stems, layout),
        body: Body::Svg(plot.finish()),
    }
}

/// The points of stems as CSV, a row a point.
fn csv_of_stems(stems: &[LitStem], layout: &Layout) -> String {
    let mut text = "stem,light,point,x_cm,y_cm\n".to_owned();
    for (stem, (line, light)) in (1..).zip(stems) {
        let light = layout.name(*light);
        for (index, point) in (1..).zip(&line.0) {
            let _ = writeln!(text, "{stem},{light},{index},{},{}", Cell(point.x), Cell(point.y));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use tropism::geometry::Point;

    /// A stem that leans further the higher it is.
    fn stem(length: f64, lean: f64) -> Polyline {
        let point = |i: i32| {
            let share = f64::from(i) / 9.0;
            Point::new(lean * share * share, length * share)
        };
        Polyline((0..10).map(point).collect())
    }

    #[test]
    fn figure_9_is_golden() {
        let one = |i: i32| {
            let light = if i / 6 % 2 == 0 { Light::LEFT } else { Light::RIGHT };
            let lean = 3.0 * f64::from(i % 6 - 3) / 3.0;
            (stem(4.0 + 0.5 * f64::from(i), if light == Light::LEFT { -lean } else { lean }), Some(light))
        };
        let stems_of_run: Vec<LitStem> = (0..18).map(one).collect();
        testing::golden(&stems(&stems_of_run, &Layout::default(), Plants::Virtual));
    }

    #[test]
    fn no_stems_and_short_stems_still_make_a_figure() {
        for few in
            [vec![], vec![(Polyline::default(), None)], vec![(Polyline(vec![Point::new(0.0, 99.0)]), None)]]
        {
            let Body::Svg(svg) = stems(&few, &Layout::default(), Plants::Real).body else { panic!() };
            testing::assert_well_formed(&svg);
        }
    }
}
