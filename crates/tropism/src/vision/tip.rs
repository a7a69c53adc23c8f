//! The highest point of the plant: "the highest sampled position on the plant is assumed to be the plant tip"
//! (section 2.2.2).

use crate::geometry::Pixel;
use crate::vision::parts::Bounds;
use crate::vision::segment::Plane;

/// The highest sample above `threshold`, word for word: the middle of the longest run of such samples in the topmost
/// row that has one.
#[must_use]
pub fn highest(plane: &Plane, threshold: f32) -> Option<Pixel> {
    (0..plane.height).find_map(|y| {
        let (left, right) = longest_run(plane.row(y).iter().map(|&value| value > threshold))?;
        Some(plane.pixel((left + right) as f64 / 2.0, y as f64))
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

/// The highest point of one connected part of the plane, between samples: where the upper edge of its topmost row
/// crosses `threshold`.
///
/// `part` says which samples within `bounds` belong to the part. The run of the topmost row gives x, weighted by what its samples
/// exceed the threshold by; linear interpolation between the run and the row above gives y.
#[must_use]
pub fn edge(plane: &Plane, bounds: Bounds, part: impl Fn(usize) -> bool, threshold: f32) -> Option<Pixel> {
    let is_plant = |x: usize, y: usize| {
        let at = y * plane.width + x;
        plane.values[at] > threshold && part(at)
    };
    let (y, (left, right)) = (bounds.top..=bounds.bottom).find_map(|y| {
        let (left, right) = longest_run((bounds.left..=bounds.right).map(|x| is_plant(x, y)))?;
        Some((y, (bounds.left + left, bounds.left + right)))
    })?;
    let row = &plane.row(y)[left..=right];
    let (mut weight, mut moment) = (0.0, 0.0);
    for (i, value) in row.iter().enumerate() {
        let excess = f64::from(value - threshold);
        weight += excess;
        moment += excess * (left + i) as f64;
    }
    let x = moment / weight;
    // Half of the sample at the crossing is plant: the crossing is the edge.
    let column = (x.round() as usize).clamp(left, right);
    let inside = row[column - left];
    let outside = if y == 0 { inside } else { plane.row(y - 1)[column] };
    let rise = if outside < threshold { f64::from((inside - threshold) / (inside - outside)) } else { 0.0 };
    Some(plane.pixel(x, y as f64 - rise))
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
        assert_eq!(highest(&plane, 50.0), Some(Pixel::new(109.0, 52.0)));
        assert_eq!(highest(&plane, 95.0), None);
    }

    #[test]
    fn the_edge_lies_between_samples() {
        let plane = plane(&["00000", "00800", "00800"]);
        let all = Bounds { left: 0, right: 4, top: 0, bottom: 2 };
        assert_eq!(edge(&plane, all, |_| true, 40.0), Some(Pixel::new(104.0, 51.0)));
        assert_eq!(edge(&plane, all, |_| true, 20.0).map(|tip| tip.y), Some(50.5));
        assert_eq!(edge(&plane, all, |at| at > 9, 40.0).map(|tip| tip.y), Some(54.0));
    }
}
