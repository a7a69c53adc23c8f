//! Colour conversion: from luma and chroma to red, green and blue (T.871, section 7: Rec. 601 over the full range).

/// Factors of T.871, section 7, times 2^14: 1.402, 0.714136, 0.344136 and 1.772.
const RED_OF_CR: i32 = 22_970;
const GREEN_OF_CR: i32 = 11_700;
const GREEN_OF_CB: i32 = 5_638;
const BLUE_OF_CB: i32 = 29_032;
const FACTOR_BITS: u32 = 14;

use super::Colour;

/// Pixels that are converted at once: as many bytes as the narrowest vectors have.
const CHUNK: usize = 16;

/// Converts a row of pixels; `rgb` has three bytes a pixel. Luma and chroma are in units of 1/2^`FRACTION` grey levels.
#[inline(always)]
pub(super) fn ycbcr_row_to_rgb<L: Copy + Into<i32>, const FRACTION: u32>(
    luma: &[L],
    blue: &[i16],
    red: &[i16],
    rgb: &mut [u8],
) {
    let mut converted = [[0; CHUNK]; 3];
    let chunks =
        luma.chunks(CHUNK).zip(blue.chunks(CHUNK)).zip(red.chunks(CHUNK)).zip(rgb.chunks_mut(3 * CHUNK));
    for (((luma, blue), red), rgb) in chunks {
        if let (Ok(luma), Ok(blue), Ok(red)) = (luma.try_into(), blue.try_into(), red.try_into()) {
            ycbcr_to_rgb::<L, CHUNK, FRACTION>(luma, blue, red, &mut converted);
        } else {
            for (i, ((luma, blue), red)) in luma.iter().zip(blue).zip(red).enumerate() {
                let mut pixel = [[0]; 3];
                ycbcr_to_rgb::<L, 1, FRACTION>(&[*luma], &[*blue], &[*red], &mut pixel);
                (0..3).for_each(|channel| converted[channel][i] = pixel[channel][0]);
            }
        }
        for (i, pixel) in rgb.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(&[converted[0][i], converted[1][i], converted[2][i]]);
        }
    }
}

/// Converts a row of samples of any kind but grey.
pub(super) fn unusual_row_to_rgb(colour: Colour, lines: &[Vec<i16>; 4], rgb: &mut [u8]) {
    let [first, second, third, black] = lines;
    if matches!(colour, Colour::YCbCr | Colour::Ycck) {
        ycbcr_row_to_rgb::<_, 0>(first, second, third, rgb);
    } else {
        for (((pixel, &red), &green), &blue) in rgb.chunks_exact_mut(3).zip(first).zip(second).zip(third) {
            pixel.copy_from_slice(&[red as u8, green as u8, blue as u8]);
        }
    }
    match colour {
        Colour::Grey | Colour::YCbCr | Colour::Rgb => {}
        Colour::Cmyk => darken(rgb, black),
        // The transform gives ink, so that what it leaves is the rest (Adobe Technical Note 5116).
        Colour::Ycck => {
            rgb.iter_mut().for_each(|value| *value = 255 - *value);
            darken(rgb, black);
        }
    }
}

/// Multiplies each pixel with the light that black ink leaves.
fn darken(rgb: &mut [u8], black: &[i16]) {
    for (pixel, &light) in rgb.chunks_exact_mut(3).zip(black) {
        pixel
            .iter_mut()
            .for_each(|value| *value = ((i32::from(*value) * i32::from(light) + 127) / 255) as u8);
    }
}

#[inline(always)]
fn ycbcr_to_rgb<L: Copy + Into<i32>, const N: usize, const FRACTION: u32>(
    luma: &[L; N],
    blue: &[i16; N],
    red: &[i16; N],
    out: &mut [[u8; N]; 3],
) {
    let bits = FACTOR_BITS + FRACTION;
    for i in 0..N {
        let luma = (luma[i].into() << FACTOR_BITS) + (1 << (bits - 1)) - 1;
        let (blue, red) = (blue[i] - (128 << FRACTION), red[i] - (128 << FRACTION));
        let times = |value: i16, factor: i32| i32::from(value) * factor;
        out[0][i] = ((luma + times(red, RED_OF_CR)) >> bits).clamp(0, 255) as u8;
        out[1][i] = ((luma - times(red, GREEN_OF_CR) - times(blue, GREEN_OF_CB)) >> bits).clamp(0, 255) as u8;
        out[2][i] = ((luma + times(blue, BLUE_OF_CB)) >> bits).clamp(0, 255) as u8;
    }
}
