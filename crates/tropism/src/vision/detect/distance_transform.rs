//! The way from each sample to the nearest of the other kind.

/// Three times the way (four across a corner) to the nearest sample of the other kind; what lies outside is of neither.
pub(super) fn distance_transform(is_part: &[bool], width: usize) -> Vec<u32> {
    let mut depth = vec![u32::from(u16::MAX); is_part.len()];
    let rows = is_part.len() / width;
    for row in 0..rows {
        let (before, rest) = depth.split_at_mut(row * width);
        let (kinds, now) = (&is_part[row * width..][..width], &mut rest[..width]);
        if let Some(above) = row.checked_sub(1) {
            reach(now, kinds, &before[above * width..], &is_part[above * width..][..width]);
        }
        for x in 1..width {
            now[x] = now[x].min(stepped(kinds[x], kinds[x - 1], now[x - 1], 3));
        }
    }
    for row in (0..rows).rev() {
        let (rest, after) = depth.split_at_mut((row + 1) * width);
        let (kinds, now) = (&is_part[row * width..][..width], &mut rest[row * width..]);
        if row + 1 < rows {
            reach(now, kinds, &after[..width], &is_part[(row + 1) * width..][..width]);
        }
        for x in (1..width).rev() {
            now[x - 1] = now[x - 1].min(stepped(kinds[x - 1], kinds[x], now[x], 3));
        }
    }
    depth
}

/// The way to a sample by way of its neighbour.
fn stepped(kind: bool, other: bool, depth: u32, step: u32) -> u32 {
    step + if kind == other { depth } else { 0 }
}

/// Takes the ways of a row's samples by way of those of the row beside it.
fn reach(depth: &mut [u32], kinds: &[bool], beside: &[u32], others: &[bool]) {
    let mut nearer = |to: usize, from: usize, count: usize, step: u32| {
        let samples = depth[to..][..count].iter_mut().zip(&kinds[to..][..count]);
        let neighbours = others[from..][..count].iter().zip(&beside[from..][..count]);
        for ((depth, &kind), (&other, &beside)) in samples.zip(neighbours) {
            *depth = (*depth).min(stepped(kind, other, beside, step));
        }
    };
    let width = kinds.len();
    nearer(0, 0, width, 3);
    nearer(1, 0, width - 1, 4);
    nearer(0, 1, width - 1, 4);
}
