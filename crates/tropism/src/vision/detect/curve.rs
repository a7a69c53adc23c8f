//! Lines of places in a plane.

use crate::math;

/// A place in a plane: column and row, with fractions.
pub type Place = (f64, f64);

/// The unit vector from one place to another.
pub(super) fn direction(from: Place, to: Place) -> Place {
    let length = math::hypot(to.0 - from.0, to.1 - from.1).max(1e-9);
    ((to.0 - from.0) / length, (to.1 - from.1) / length)
}

/// Each point moved to the mean of those up to `radius` before and after it; the ends stay.
pub(super) fn smoothed(line: &[Place], radius: usize) -> Vec<Place> {
    (0..line.len())
        .map(|i| {
            let radius = radius.min(i).min(line.len() - 1 - i);
            let near = &line[i - radius..=i + radius];
            let sum = near.iter().fold((0.0, 0.0), |sum, at| (sum.0 + at.0, sum.1 + at.1));
            (sum.0 / near.len() as f64, sum.1 / near.len() as f64)
        })
        .collect()
}

/// The same line with points about `spacing` apart, both ends kept.
pub(super) fn resampled(line: &[Place], spacing: f64) -> Vec<Place> {
    let mut lengths = vec![0.0];
    for pair in line.windows(2) {
        let last = lengths[lengths.len() - 1];
        lengths.push(last + math::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1));
    }
    let length = lengths[lengths.len() - 1];
    let count = (length / spacing).round().max(1.0) as usize;
    (0..=count)
        .map(|i| {
            let along = length * i as f64 / count as f64;
            let next = lengths.partition_point(|&at| at < along).clamp(1, line.len() - 1);
            let (from, to) = (line[next - 1], line[next]);
            let share = (along - lengths[next - 1]) / (lengths[next] - lengths[next - 1]).max(1e-12);
            (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1))
        })
        .collect()
}
