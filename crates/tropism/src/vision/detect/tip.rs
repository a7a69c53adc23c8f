//! The highest point of the plant: "the highest sampled position on the plant is assumed to be the plant tip"
//! (section 2.2.2).

use crate::geometry::Pixel;
use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::raster::plane::Plane;

/// The highest sample above `threshold`, word for word: the middle of the longest run of such samples in the topmost
/// row that has one.
#[must_use]
pub fn highest_sample(plane: &Plane, threshold: f32) -> Option<Pixel> {
    (0..plane.height).find_map(|y| {
        let (left, right) = longest_run(plane.row(y).iter().map(|&value| value > threshold))?;
        Some(plane.to_pixel((left + right) as f64 / 2.0, y as f64))
    })
}

/// The longest run of `true`, first and last place; the first of equals.
fn longest_run(places: impl Iterator<Item = bool>) -> Option<(usize, usize)> {
    let (mut best, mut start) = (None, None);
    for (x, is_plant) in places.enumerate() {
        start = if is_plant { start.or(Some(x)) } else { None };
        if let Some(left) = start
            && best.is_none_or(|(first, last)| x - left > last - first)
        {
            best = Some((left, x));
        }
    }
    best
}

/// Samples around the highest that tell how bright the plant is there: a mist's halo is narrower.
const ABOUT: usize = 16;

/// The highest point of one connected part of a plane that is 0 on background and 1 on plant, between samples: where the
/// upper edge of its topmost row crosses `threshold`, or the same share of what it is about there, where it is fainter.
///
/// `part` says which samples within `bounds` belong to the part. In each column around the topmost row's run the edge is
/// interpolated between samples; the tip is the top of the parabola through these edges. Where they are no parabola it is
/// the highest of them, above the run's middle, weighted by what its samples exceed the threshold by.
#[must_use]
pub fn highest_edge(
    plane: &Plane,
    bounds: BoundingBox,
    part: impl Fn(usize) -> bool,
    threshold: f32,
) -> Option<Pixel> {
    let topmost = |threshold: f32| {
        let is_plant = |at: usize| plane.values[at] > threshold && part(at);
        (bounds.top..=bounds.bottom).find_map(|y| {
            let row = y * plane.width;
            let (left, right) = longest_run((bounds.left..=bounds.right).map(|x| is_plant(row + x)))?;
            Some((y, (bounds.left + left, bounds.left + right)))
        })
    };
    // Where the plant is fainter there than its mean, as behind mist, what is its edge is fainter as well.
    let (y, (left, right)) = topmost(threshold)?;
    let rows = y..(y + ABOUT).min(bounds.bottom + 1);
    let columns = left.saturating_sub(ABOUT).max(bounds.left)..(right + ABOUT).min(bounds.right + 1);
    let about = rows.flat_map(|y| columns.clone().map(move |x| y * plane.width + x)).filter(|&at| part(at));
    let threshold = threshold * about.map(|at| plane.values[at]).fold(0.0, f32::max).min(1.0);
    let (y, (left, right)) = topmost(threshold)?;
    let is_plant = |x: usize, y: usize| {
        let at = y * plane.width + x;
        plane.values[at] > threshold && part(at)
    };
    // Where the plant is brighter than its mean, half of that is its edge.
    let below = (y..(y + 3).min(plane.height)).flat_map(|y| &plane.row(y)[left..=right]);
    let threshold = threshold.max(0.5 * below.copied().fold(0.0, f32::max));
    let crossings: Vec<(f64, f64)> = (left.saturating_sub(1)..=(right + 1).min(plane.width - 1))
        .filter_map(|x| Some((x as f64, upper_edge(plane, is_plant, x, y, threshold)?)))
        .collect();
    let top = crossings.iter().map(|crossing| crossing.1).reduce(f64::min)?;
    if let Some((x, height)) = vertex(&crossings) {
        let (x, height) =
            (x.clamp(left as f64 - 0.5, right as f64 + 0.5), height.clamp(top - 0.5, top + 0.5));
        return Some(plane.to_pixel(x, height));
    }
    let weights = (left..=right).map(|x| (x as f64, f64::from(plane.row(y)[x].max(0.0))));
    let (weight, moment) = weights.fold((0.0, 0.0), |sum, (x, weight)| (sum.0 + weight, sum.1 + weight * x));
    Some(plane.to_pixel(moment / weight, top))
}

/// How far below row `row` - 1 the part's upper edge is in column `x`, as a row with fractions; `None` where it is more
/// than three rows down.
fn upper_edge(
    plane: &Plane,
    is_plant: impl Fn(usize, usize) -> bool,
    x: usize,
    row: usize,
    threshold: f32,
) -> Option<f64> {
    let is_edge = |y: usize| is_plant(x, y) && plane.row(y)[x] > threshold;
    let y = (row..(row + 3).min(plane.height)).find(|&y| is_edge(y))?;
    let inside = plane.row(y)[x];
    // Half of the sample at the crossing is plant: the crossing is the edge.
    let outside = if y == 0 { inside } else { plane.row(y - 1)[x] };
    let rise = if outside < threshold { f64::from((inside - threshold) / (inside - outside)) } else { 0.0 };
    Some(y as f64 - rise)
}

/// The top (the least second coordinate) of the parabola that fits the points best: the tip of something round lies
/// between samples. `None` where they are too few or do not bend like one.
fn vertex(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let middle = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mut sums = [0.0; 6];
    for &(x, y) in points {
        let x = x - middle;
        for (sum, value) in sums.iter_mut().zip([x * x, x * x * x, x * x * x * x, y, x * y, x * x * y]) {
            *sum += value;
        }
    }
    let [squares, cubes, fourths, t0, t1, t2] = sums;
    let bend = fourths - cubes * cubes / squares - squares * squares / count;
    let a = (t2 - cubes * t1 / squares - squares * t0 / count) / bend;
    let b = (t1 - cubes * a) / squares;
    let c = (t0 - squares * a) / count;
    (a > 0.02).then(|| (middle - b / (2.0 * a), c - b * b / (4.0 * a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(rows: &[&str]) -> Plane {
        let values = rows.iter().flat_map(|row| row.bytes().map(|b| f32::from(b - b'0') * 10.0)).collect();
        Plane { width: rows[0].len(), height: rows.len(), values, origin: (100.0, 50.0), step: 2 }
    }

    #[test]
    fn the_highest_row_wins_and_its_longest_run() {
        let plane = plane(&["0000000", "0700990", "0700990", "0700000"]);
        assert_eq!(highest_sample(&plane, 50.0), Some(Pixel::new(109.0, 52.0)));
        assert_eq!(highest_sample(&plane, 95.0), None);
    }

    #[test]
    fn the_top_of_something_round_lies_between_samples() {
        let top = |x: f64| 3.3 + 0.1 * (x - 6.4) * (x - 6.4);
        let values = (0..13 * 12).map(|at| {
            let (x, y) = ((at % 13) as f64, (at / 13) as f64);
            (100.0 * (y - top(x) + 0.5)).clamp(0.0, 100.0) as f32
        });
        let plane = Plane { width: 13, height: 12, values: values.collect(), origin: (0.0, 0.0), step: 1 };
        let all = BoundingBox { left: 0, right: 12, top: 0, bottom: 11 };
        let found = highest_edge(&plane, all, |_| true, 50.0).unwrap();
        assert!((found.x - 6.4).abs() < 0.2 && (found.y - 3.3).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn what_is_faint_at_its_top_is_seen_to_its_end() {
        // A stem that is fainter above than below, and is blurred: where half of what it was is left, it ends.
        let brightness = [vec![0.0, 0.1, 0.32, 0.5], vec![0.6; 18], vec![0.8, 1.0]].concat();
        let values: Vec<f32> = brightness.iter().flat_map(|&value| [0.0, value, value, 0.0]).collect();
        let plane = Plane { width: 4, height: brightness.len(), values, origin: (0.0, 0.0), step: 1 };
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
