//! Points in the further columns of a track, as [`TrackPlan`](super::TrackPlan) writes them.

use tropism::geometry::Point;
use tropism::track::Track;

/// The point in the columns `NAME_x_cm` and `NAME_y_cm` of one row; `None` if a column or a value is missing.
#[must_use]
pub fn point_at(track: &Track, name: &str, row: usize) -> Option<Point> {
    let coordinate = |axis: char| {
        let wanted = format!("{name}_{axis}_cm");
        let column = track.columns.iter().find(|column| column.name == wanted)?;
        column.values.text(row).parse().ok().filter(|value: &f64| value.is_finite())
    };
    Some(Point::new(coordinate('x')?, coordinate('y')?))
}
