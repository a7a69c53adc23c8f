//! Colour conversion: from luma and chroma to red, green and blue (T.871, section 7: Rec. 601 over the full range).

/// Factors of T.871, section 7, times 2^14: 1.402, 0.714136, 0.344136 and 1.772, cut to whole numbers as in
/// `zune-jpeg`.
const RED_OF_CR: i32 = 22_970;
const GREEN_OF_CR: i32 = 11_700;
const GREEN_OF_CB: i32 = 5_638;
const BLUE_OF_CB: i32 = 29_032;
const FACTOR_BITS: u32 = 14;

/// Pixels that are converted at once: as many bytes as the narrowest vectors have.
const CHUNK: usize = 16;

/// Converts a row of pixels; `rgb` has three bytes a pixel.
#[inline(always)]
pub(super) fn ycbcr_row_to_rgb(luma: &[u8], blue: &[i16], red: &[i16], rgb: &mut [u8]) {
    let mut converted = [[0; CHUNK]; 3];
    let chunks =
        luma.chunks(CHUNK).zip(blue.chunks(CHUNK)).zip(red.chunks(CHUNK)).zip(rgb.chunks_mut(3 * CHUNK));
    for (((luma, blue), red), rgb) in chunks {
        if let (Ok(luma), Ok(blue), Ok(red)) = (luma.try_into(), blue.try_into(), red.try_into()) {
            ycbcr_to_rgb::<CHUNK>(luma, blue, red, &mut converted);
        } else {
            for (i, ((luma, blue), red)) in luma.iter().zip(blue).zip(red).enumerate() {
                let mut pixel = [[0]; 3];
                ycbcr_to_rgb(&[*luma], &[*blue], &[*red], &mut pixel);
                (0..3).for_each(|channel| converted[channel][i] = pixel[channel][0]);
            }
        }
        for (i, pixel) in rgb.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(&[converted[0][i], converted[1][i], converted[2][i]]);
        }
    }
}

#[inline(always)]
fn ycbcr_to_rgb<const N: usize>(luma: &[u8; N], blue: &[i16; N], red: &[i16; N], out: &mut [[u8; N]; 3]) {
    for i in 0..N {
        let luma = (i32::from(luma[i]) << FACTOR_BITS) + (1 << (FACTOR_BITS - 1)) - 1;
        let (blue, red) = (blue[i] - 128, red[i] - 128);
        let times = |value: i16, factor: i32| i32::from(value) * factor;
        out[0][i] = ((luma + times(red, RED_OF_CR)) >> FACTOR_BITS).clamp(0, 255) as u8;
        out[1][i] =
            ((luma - times(red, GREEN_OF_CR) - times(blue, GREEN_OF_CB)) >> FACTOR_BITS).clamp(0, 255) as u8;
        out[2][i] = ((luma + times(blue, BLUE_OF_CB)) >> FACTOR_BITS).clamp(0, 255) as u8;
    }
}

/// Red, green and blue of a luma and two chroma values between whole numbers, 128 for grey.
#[inline]
pub(super) fn rgb_of(luma: f32, blue: f32, red: f32) -> [f32; 3] {
    let (blue, red) = (blue - 128.0, red - 128.0);
    [luma + 1.402 * red, luma - 0.714_136 * red - 0.344_136 * blue, luma + 1.772 * blue]
}
