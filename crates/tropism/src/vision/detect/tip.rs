//! Tip of the plant: "the highest sampled position on the plant is assumed to be the plant tip" (section 2.2.2).
//!
//! In: a plane, and in mode `robust` the component that is the plant. Out: its highest point. The one idea of mode
//! `robust`: the upper edge crosses the threshold between samples, and a round tip is the vertex of a parabola
//! through the edge.

use crate::geometry::Pixel;
use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::raster::plane::Plane;

/// The paper's tip: the middle of the longest run of samples above `threshold` in the topmost row that has one.
#[must_use]
pub fn highest_sample(plane: &Plane, threshold: f32) -> Option<Pixel> {
    (0..plane.height).find_map(|y| {
        let (left, right) = longest_run(plane.row(y).iter().map(|&value| value > threshold))?;
        Some(plane.to_pixel([(left + right) as f64 / 2.0, y as f64]))
    })
}

/// First and last index of the longest run of `true`; the first of equals.
fn longest_run(flags: impl Iterator<Item = bool>) -> Option<(usize, usize)> {
    let (mut best, mut start) = (None, None);
    for (x, is_plant) in flags.enumerate() {
        start = if is_plant { start.or(Some(x)) } else { None };
        if let Some(left) = start
            && best.is_none_or(|(first, last)| x - left > last - first)
        {
            best = Some((left, x));
        }
    }
    best
}

/// Samples around the topmost run that give the plant's local brightness. Chosen by hand: the halo of mist is
/// narrower.
const LOCAL_RADIUS: usize = 16;

/// Rows below the topmost one in which a column's edge is searched. Chosen by hand.
const EDGE_ROWS: usize = 3;

/// Least curvature of the parabola through a round tip, in rows per squared column. Chosen by hand.
const MIN_CURVATURE: f64 = 0.02;

/// The highest point, to a fraction of a sample, of one component of a plane that is 0 on background and 1 on plant.
///
/// `is_component` says which samples within `bounds` belong to the component. The upper edge of the columns around
/// the topmost run is interpolated where it crosses `threshold`; the tip is the vertex of the parabola through these
/// edges, or else the highest of them above the centroid of the run. Where the plant is locally fainter than its
/// mean, the threshold is lowered in proportion.
#[must_use]
pub fn highest_edge(
    plane: &Plane,
    bounds: BoundingBox,
    is_component: impl Fn(usize) -> bool,
    threshold: f32,
) -> Option<Pixel> {
    let topmost_run = |threshold: f32| {
        let is_plant = |at: usize| plane.values[at] > threshold && is_component(at);
        (bounds.top..=bounds.bottom).find_map(|y| {
            let row = y * plane.width;
            let (left, right) = longest_run((bounds.left..=bounds.right).map(|x| is_plant(row + x)))?;
            Some((y, (bounds.left + left, bounds.left + right)))
        })
    };
    // A plant that is locally fainter than its mean, as behind mist, has a fainter edge as well.
    let (y, (left, right)) = topmost_run(threshold)?;
    let rows = y..(y + LOCAL_RADIUS).min(bounds.bottom + 1);
    let columns =
        left.saturating_sub(LOCAL_RADIUS).max(bounds.left)..(right + LOCAL_RADIUS).min(bounds.right + 1);
    let local = rows
        .flat_map(|y| columns.clone().map(move |x| y * plane.width + x))
        .filter(|&at| is_component(at))
        .map(|at| plane.values[at]);
    let threshold = threshold * local.fold(0.0, f32::max).min(1.0);
    let (y, (left, right)) = topmost_run(threshold)?;
    let is_plant = |x: usize, y: usize| {
        let at = y * plane.width + x;
        plane.values[at] > threshold && is_component(at)
    };
    // A plant that is brighter than its mean has its edge at half of its height.
    let below = (y..(y + EDGE_ROWS).min(plane.height)).flat_map(|y| &plane.row(y)[left..=right]);
    let threshold = threshold.max(0.5 * below.copied().fold(0.0, f32::max));
    // Least squares over all columns of the run averages out the noise of single edges.
    let edges: Vec<(f64, f64)> = (left.saturating_sub(1)..=(right + 1).min(plane.width - 1))
        .filter_map(|x| Some((x as f64, upper_edge(plane, is_plant, x, y, threshold)?)))
        .collect();
    let top = edges.iter().map(|edge| edge.1).reduce(f64::min)?;
    if let Some((x, height)) = parabola_vertex(&edges) {
        let (x, height) =
            (x.clamp(left as f64 - 0.5, right as f64 + 0.5), height.clamp(top - 0.5, top + 0.5));
        return Some(plane.to_pixel([x, height]));
    }
    let weights = (left..=right).map(|x| (x as f64, f64::from(plane.row(y)[x].max(0.0))));
    let (weight, moment) = weights.fold((0.0, 0.0), |sum, (x, weight)| (sum.0 + weight, sum.1 + weight * x));
    Some(plane.to_pixel([moment / weight, top]))
}

/// The component's upper edge in column `x`, from row `row` down, as a row with a fraction; `None` where it lies more
/// than [`EDGE_ROWS`] rows down.
fn upper_edge(
    plane: &Plane,
    is_plant: impl Fn(usize, usize) -> bool,
    x: usize,
    row: usize,
    threshold: f32,
) -> Option<f64> {
    let is_inside = |y: usize| is_plant(x, y) && plane.row(y)[x] > threshold;
    let y = (row..(row + EDGE_ROWS).min(plane.height)).find(|&y| is_inside(y))?;
    let inside = plane.row(y)[x];
    // Half of a sample on the edge is plant, so the edge is where the value crosses the threshold.
    let outside = if y == 0 { inside } else { plane.row(y - 1)[x] };
    let rise = if outside < threshold { f64::from((inside - threshold) / (inside - outside)) } else { 0.0 };
    Some(y as f64 - rise)
}

/// The vertex (least second coordinate) of the parabola through points by least squares; `None` where they are fewer
/// than three or curve too little.
fn parabola_vertex(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let mean = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mut sums = [0.0; 6];
    for &(x, y) in points {
        let x = x - mean;
        for (sum, value) in sums.iter_mut().zip([x * x, x * x * x, x * x * x * x, y, x * y, x * x * y]) {
            *sum += value;
        }
    }
    // Normal equations of y = a x^2 + b x + c with centred x, by elimination.
    let [squares, cubes, fourths, y0, y1, y2] = sums;
    let determinant = fourths - cubes * cubes / squares - squares * squares / count;
    let a = (y2 - cubes * y1 / squares - squares * y0 / count) / determinant;
    let b = (y1 - cubes * a) / squares;
    let c = (y0 - squares * a) / count;
    (a > MIN_CURVATURE).then(|| (mean - b / (2.0 * a), c - b * b / (4.0 * a)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::detect::testing;

    fn plane(rows: &[&str]) -> Plane {
        let values = rows.iter().flat_map(|row| row.bytes().map(|b| f32::from(b - b'0') * 10.0)).collect();
        Plane { width: rows[0].len(), height: rows.len(), values, origin: Pixel::new(100.0, 50.0), step: 2 }
    }

    #[test]
    fn the_highest_row_wins_and_its_longest_run() {
        let plane = plane(&["0000000", "0700990", "0700990", "0700000"]);
        assert_eq!(highest_sample(&plane, 50.0), Some(Pixel::new(109.0, 52.0)));
        assert_eq!(highest_sample(&plane, 95.0), None);
    }

    #[test]
    fn the_vertex_of_a_round_tip_lies_between_samples() {
        let top = |x: f64| 3.3 + 0.1 * (x - 6.4) * (x - 6.4);
        let values = (0..13 * 12).map(|at| {
            let (x, y) = ((at % 13) as f64, (at / 13) as f64);
            (100.0 * (y - top(x) + 0.5)).clamp(0.0, 100.0) as f32
        });
        let plane = testing::plane(13, values.collect());
        let all = BoundingBox { left: 0, right: 12, top: 0, bottom: 11 };
        let found = highest_edge(&plane, all, |_| true, 50.0).unwrap();
        assert!((found.x - 6.4).abs() < 0.2 && (found.y - 3.3).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn a_plant_that_fades_upwards_is_found_to_its_end() {
        // A blurred stem that is fainter above than below ends where half of its local brightness is left.
        let brightness = [vec![0.0, 0.1, 0.32, 0.5], vec![0.6; 18], vec![0.8, 1.0]].concat();
        let values: Vec<f32> = brightness.iter().flat_map(|&value| [0.0, value, value, 0.0]).collect();
        let plane = testing::plane(4, values);
        let all = BoundingBox { left: 0, right: 3, top: 0, bottom: brightness.len() - 1 };
        let tip = highest_edge(&plane, all, |_| true, 0.5).unwrap();
        assert!((tip.x - 1.5).abs() < 1e-6 && (tip.y - 1.9).abs() < 0.1, "{tip:?}");
    }

    #[test]
    fn the_edge_lies_between_samples() {
        let plane = plane(&["00000", "00800", "00800"]);
        let all = BoundingBox { left: 0, right: 4, top: 0, bottom: 2 };
        assert_eq!(highest_edge(&plane, all, |_| true, 40.0), Some(Pixel::new(104.0, 51.0)));
        // Half of the plant's brightness, where that is more than the threshold.
        assert_eq!(highest_edge(&plane, all, |_| true, 20.0).map(|tip| tip.y), Some(51.0));
        assert_eq!(highest_edge(&plane, all, |_| true, 60.0).map(|tip| tip.y), Some(51.5));
        assert_eq!(highest_edge(&plane, all, |at| at > 9, 40.0).map(|tip| tip.y), Some(54.0));
    }
}
