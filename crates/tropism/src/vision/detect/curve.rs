//! Polylines of points in a plane: smoothing, resampling and directions.

use crate::math;

/// A point in a plane, or a vector: column and row of samples, with fractions.
pub type PlanePoint = (f64, f64);

/// Distance between two points, in samples.
pub(super) fn distance(one: PlanePoint, other: PlanePoint) -> f64 {
    math::hypot(other.0 - one.0, other.1 - one.1)
}

/// Unit vector from one point to another.
pub(super) fn direction(from: PlanePoint, to: PlanePoint) -> PlanePoint {
    let length = distance(from, to).max(1e-9);
    ((to.0 - from.0) / length, (to.1 - from.1) / length)
}

/// The point at `offset` times a vector from another point.
pub(super) fn offset_by(point: PlanePoint, offset: f64, vector: PlanePoint) -> PlanePoint {
    (point.0 + offset * vector.0, point.1 + offset * vector.1)
}

/// Smooths a polyline by a moving average over `radius` points on both sides, fewer towards the ends, which stay.
pub(super) fn smooth(line: &[PlanePoint], radius: usize) -> Vec<PlanePoint> {
    (0..line.len())
        .map(|i| {
            let radius = radius.min(i).min(line.len() - 1 - i);
            let window = &line[i - radius..=i + radius];
            let sum = window.iter().fold((0.0, 0.0), |sum, at| (sum.0 + at.0, sum.1 + at.1));
            (sum.0 / window.len() as f64, sum.1 / window.len() as f64)
        })
        .collect()
}

/// Resamples a polyline to points about `spacing` apart; both ends are kept.
pub(super) fn resample(line: &[PlanePoint], spacing: f64) -> Vec<PlanePoint> {
    let mut lengths = vec![0.0];
    for pair in line.windows(2) {
        let last = lengths[lengths.len() - 1];
        lengths.push(last + distance(pair[0], pair[1]));
    }
    let length = lengths[lengths.len() - 1];
    let count = (length / spacing).round().max(1.0) as usize;
    (0..=count)
        .map(|i| {
            let arc_length = length * i as f64 / count as f64;
            let next = lengths.partition_point(|&at| at < arc_length).clamp(1, line.len() - 1);
            let (from, to) = (line[next - 1], line[next]);
            let fraction = (arc_length - lengths[next - 1]) / (lengths[next] - lengths[next - 1]).max(1e-12);
            (from.0 + fraction * (to.0 - from.0), from.1 + fraction * (to.1 - from.1))
        })
        .collect()
}
