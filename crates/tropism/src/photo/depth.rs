//! Samples of 16 bits as samples of 8.

/// Bits of the samples of cameras that keep fewer than 16 in 16, from the fewest.
const DEPTHS: [u32; 4] = [10, 12, 14, 16];

/// Bytes of samples of 16 bits: the upper eight of the bits that are used.
///
/// A sensor of 10, 12 or 14 bits is often written as it is, so that the picture seems black: the fewest of these bits that hold
/// all samples count as the range. Some programs write such samples with their bytes exchanged: then no low byte is above 15,
/// which in a picture of the full range only samples that are padded from 8 bits are (all low bytes are equal).
pub(super) fn to_eight_bits(mut values: Vec<u16>) -> Vec<u8> {
    let low = |value: &u16| value & 0xff;
    let is_exchanged = values.iter().all(|value| low(value) < 16)
        && values.iter().any(|value| *value >= 1 << 12)
        && values.first().is_some_and(|first| values.iter().any(|value| low(value) != low(first)));
    if is_exchanged {
        values.iter_mut().for_each(|value| *value = value.swap_bytes());
    }
    let most = values.iter().copied().max().unwrap_or(0);
    let depth = DEPTHS.into_iter().find(|&depth| u32::from(most) < 1 << depth).unwrap_or(16);
    // Samples of so few bits that all fit in a byte are not spread: a picture of 8 bits in 16 stays dark or bright as it is.
    values.into_iter().map(|value| (value >> if most < 256 { 0 } else { depth - 8 }) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_that_are_used_count() {
        assert_eq!(to_eight_bits(vec![0, 0x8000, 0xffff]), [0, 128, 255]);
        assert_eq!(to_eight_bits(vec![0, 512, 1023]), [0, 128, 255]);
        assert_eq!(to_eight_bits(vec![0, 2048, 4095]), [0, 128, 255]);
        assert_eq!(to_eight_bits(vec![0, 8192, 16_383]), [0, 128, 255]);
        assert_eq!(to_eight_bits(vec![7, 200]), [7, 200]);
        // Ten bits with exchanged bytes, and bytes that are padded to 16 bits.
        assert_eq!(to_eight_bits(vec![0, 0x0002, 0xff03]), [0, 128, 255]);
        assert_eq!(to_eight_bits(vec![0x0a07, 0xff07]), [10, 255]);
    }
}
