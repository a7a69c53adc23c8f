//! Chroma upsampling: one row of a component at the picture's resolution.
//!
//! A component of half the resolution is interpolated linearly, the nearest sample weighing 3/4 and the next one 1/4,
//! as libjpeg's "fancy upsampling" does.

use std::ops::Range;

use super::Component;
use super::idct::Window;

/// Writes columns `xs` of row `y` of the picture to `out`. `mixed` is a buffer that is used again from row to row.
#[inline(always)]
pub(super) fn upsample_row(
    component: &Component,
    samples: &Window<u8>,
    y: usize,
    xs: Range<usize>,
    mixed: &mut Vec<i16>,
    out: &mut Vec<i16>,
) {
    let (across, down) = component.subsampling;
    if across > 2 || down > 2 || (across == 2 && component.samples.0 <= 2) {
        // Unusual, or hardly wider than a sample: the sample is repeated, as in libjpeg.
        let near = samples.row(y / down, xs.start / across..(xs.end - 1) / across + 1);
        out.clear();
        out.extend(xs.clone().map(|x| i16::from(near[x / across - xs.start / across])));
        return;
    }
    let last = (component.samples.0 - 1, component.samples.1 - 1);
    let (first, end) = (xs.start / across, (xs.end - 1) / across + 1);
    // One sample more on each side; beyond the edge, the edge is repeated below.
    let (from, to) = (first.saturating_sub(across - 1), (end + across - 1).min(last.0 + 1));
    let near = samples.row(y / down, from..to);
    mixed.resize(end - first + 2, 0);
    let inner = &mut mixed[1 + from - first..][..to - from];
    if down == 1 {
        inner.iter_mut().zip(near).for_each(|(value, near)| *value = i16::from(*near));
    } else {
        let next = if y.is_multiple_of(2) { (y / 2).saturating_sub(1) } else { (y / 2 + 1).min(last.1) };
        let far = samples.row(next, from..to);
        for ((value, near), far) in inner.iter_mut().zip(near).zip(far) {
            *value = (3 * i16::from(*near) + i16::from(*far) + 2) >> 2;
        }
    }
    let count = mixed.len();
    if across == 1 {
        out.clear();
        out.extend_from_slice(&mixed[1..count - 1]);
        return;
    }
    if from == first {
        mixed[0] = mixed[1];
    }
    if to == end {
        mixed[count - 1] = mixed[count - 2];
    }
    out.resize(2 * (end - first), 0);
    for (i, pair) in out.chunks_exact_mut(2).enumerate() {
        let near = 3 * mixed[i + 1] + 2;
        pair[0] = (near + mixed[i]) >> 2;
        pair[1] = (near + mixed[i + 2]) >> 2;
    }
    out.drain(..xs.start - 2 * first);
    out.truncate(xs.len());
}
