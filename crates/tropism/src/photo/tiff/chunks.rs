//! Strips and tiles: the samples of a picture, unpacked.

use std::io::Read;

use flate2::read::ZlibDecoder;
use jpeg_regions::{Jpeg, JpegError};
use weezl::BitOrder;
use weezl::decode::Decoder as LzwDecoder;

use super::directory::{ByteOrder, Directory, tag};
use super::{Photometric, TiffError};

/// JPEG compression (TIFF Technical Note 2).
const JPEG: u64 = 7;

/// How the samples of a picture are laid out.
pub(super) struct Layout {
    pub(super) photometric: Photometric,
    width: usize,
    height: usize,
    /// Samples of a pixel, with those that are not used, such as transparency.
    pub(super) samples: usize,
    /// Bits of a sample: 1, 2, 4, 8 or 16.
    pub(super) bits: usize,
    /// Whether each sample has chunks of its own.
    is_planar: bool,
    /// Columns and rows of a strip or tile.
    chunk: (usize, usize),
    is_tiled: bool,
    compression: u64,
    has_predictor: bool,
    /// Luma samples across and down to one of chroma.
    subsampling: (usize, usize),
    offsets: Vec<u64>,
    lengths: Vec<u64>,
}

impl Layout {
    pub(super) fn of(
        directory: &Directory,
        photometric: Photometric,
        width: usize,
        height: usize,
    ) -> Result<Self, TiffError> {
        let number = |tag, default: u64| directory.number(tag).unwrap_or(default);
        let samples = number(tag::SAMPLES, 1) as usize;
        if !(photometric.samples()..=16).contains(&samples) {
            return Err(TiffError::Unsupported(format!("{samples} samples a pixel")));
        }
        let bits = number(tag::BITS, 1) as usize;
        if directory.numbers(tag::BITS).iter().any(|&other| other != bits as u64)
            || !matches!(bits, 1 | 2 | 4 | 8 | 16)
        {
            return Err(TiffError::Unsupported(format!(
                "samples of {:?} bits",
                directory.numbers(tag::BITS)
            )));
        }
        if directory.numbers(tag::SAMPLE_FORMAT).iter().any(|&format| !matches!(format, 1 | 4)) {
            return Err(TiffError::Unsupported("samples that are no whole positive numbers".to_owned()));
        }
        let has_predictor = match number(tag::PREDICTOR, 1) {
            1 => false,
            2 if bits >= 8 => true,
            other => return Err(TiffError::Unsupported(format!("predictor {other} for {bits} bits"))),
        };
        let compression = number(tag::COMPRESSION, 1);
        let subsampling = match (photometric, directory.numbers(tag::YCBCR_SUBSAMPLING).as_slice()) {
            // JPEG has factors of its own.
            (Photometric::YCbCr, _) if compression == JPEG => (1, 1),
            (Photometric::YCbCr, &[across @ (1 | 2 | 4), down @ (1 | 2 | 4), ..]) => {
                (across as usize, down as usize)
            }
            (Photometric::YCbCr, []) => (2, 2),
            (Photometric::YCbCr, other) => {
                return Err(TiffError::Unsupported(format!("chroma subsampled by {other:?}")));
            }
            _ => (1, 1),
        };
        let is_planar = number(tag::PLANAR, 1) == 2 && samples > 1;
        if subsampling != (1, 1) && (is_planar || bits != 8 || samples != 3) {
            return Err(TiffError::Unsupported("subsampled chroma by planes".to_owned()));
        }
        let is_tiled = directory.entries.contains_key(&tag::TILE_OFFSETS);
        let (chunk, offsets, lengths) = if is_tiled {
            let side = |tag| number(tag, 0) as usize;
            ((side(tag::TILE_WIDTH), side(tag::TILE_HEIGHT)), tag::TILE_OFFSETS, tag::TILE_BYTES)
        } else {
            let rows = number(tag::ROWS_PER_STRIP, height as u64).clamp(1, height as u64) as usize;
            ((width, rows), tag::STRIP_OFFSETS, tag::STRIP_BYTES)
        };
        // A tile may be larger than the picture, but not much.
        if chunk.0 == 0
            || chunk.1 == 0
            || chunk.0 > width.next_multiple_of(1 << 12)
            || chunk.1 > height.next_multiple_of(1 << 12)
        {
            return Err(TiffError::Damaged("tiles of no usual size"));
        }
        let (offsets, lengths) = (directory.numbers(offsets), directory.numbers(lengths));
        Ok(Self {
            photometric,
            width,
            height,
            samples,
            bits,
            is_planar,
            chunk,
            is_tiled,
            compression,
            has_predictor,
            subsampling,
            offsets,
            lengths,
        })
    }

    /// What the samples mean when they are unpacked: JPEG gives red, green and blue for luma and chroma.
    pub(super) const fn unpacked(&self) -> Photometric {
        match (self.photometric, self.compression) {
            (Photometric::YCbCr, JPEG) => Photometric::Rgb,
            (other, _) => other,
        }
    }

    /// Samples of a pixel in one chunk.
    const fn chunk_samples(&self) -> usize {
        if self.is_planar { 1 } else { self.samples }
    }

    /// Bytes of a chunk of so many rows.
    const fn chunk_bytes(&self, rows: usize) -> usize {
        let (across, down) = self.subsampling;
        if across * down > 1 {
            return self.chunk.0.div_ceil(across) * rows.div_ceil(down) * (across * down + 2);
        }
        (self.chunk.0 * self.chunk_samples() * self.bits).div_ceil(8) * rows
    }
}

/// All samples of a picture, pixel by pixel.
pub(super) fn samples_of(
    bytes: &[u8],
    directory: &Directory,
    layout: &Layout,
) -> Result<Vec<u16>, TiffError> {
    let (across, down) = (layout.width.div_ceil(layout.chunk.0), layout.height.div_ceil(layout.chunk.1));
    let planes = if layout.is_planar { layout.samples } else { 1 };
    if layout.offsets.len() < across * down * planes {
        return Err(TiffError::Damaged("strips or tiles are missing"));
    }
    let mut values = vec![0; layout.width * layout.height * layout.samples];
    for (index, &offset) in layout.offsets.iter().enumerate().take(across * down * planes) {
        let (plane, place) = (index / (across * down), index % (across * down));
        let (left, top) = (place % across * layout.chunk.0, place / across * layout.chunk.1);
        // Strips end with the picture, tiles do not.
        let rows = if layout.is_tiled { layout.chunk.1 } else { layout.chunk.1.min(layout.height - top) };
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let packed = bytes.get(start..).unwrap_or_default();
        let packed = match layout.lengths.get(index) {
            Some(&length) => packed.get(..usize::try_from(length).unwrap_or(usize::MAX)),
            // Without lengths, as in old files of one strip.
            None => Some(packed),
        };
        let packed = packed.ok_or(TiffError::Damaged("a strip or tile lies outside of the file"))?;
        let chunk = unpack(packed, directory, layout, rows)?;
        let samples = layout.chunk_samples();
        let columns = layout.chunk.0.min(layout.width - left);
        for (row, line) in chunk.chunks_exact(layout.chunk.0 * samples).enumerate().take(layout.height - top)
        {
            let first = (top + row) * layout.width + left;
            if layout.is_planar {
                let out = values[first * layout.samples..].iter_mut().skip(plane).step_by(layout.samples);
                out.zip(&line[..columns]).for_each(|(out, value)| *out = *value);
            } else {
                values[first * samples..][..columns * samples].copy_from_slice(&line[..columns * samples]);
            }
        }
    }
    Ok(values)
}

/// The samples of a chunk of so many rows.
fn unpack(packed: &[u8], directory: &Directory, layout: &Layout, rows: usize) -> Result<Vec<u16>, TiffError> {
    let length = layout.chunk_bytes(rows);
    let damaged = TiffError::Damaged("a strip or tile does not unpack to its size");
    let mut data = match layout.compression {
        1 => packed.get(..length).ok_or(damaged.clone())?.to_vec(),
        5 => unpack_lzw(packed, length),
        8 | 32_946 => {
            let mut data = Vec::new();
            ZlibDecoder::new(packed)
                .take(length as u64)
                .read_to_end(&mut data)
                .map_err(|_| damaged.clone())?;
            data
        }
        32_773 => unpack_bits(packed, length),
        JPEG => return unpack_jpeg(packed, directory, layout, rows),
        other => {
            let name = match other {
                2..=4 => "fax compression",
                6 => "JPEG compression of the old kind",
                34_712 => "JPEG 2000 compression",
                34_925 => "LZMA compression",
                50_000 => "Zstandard compression",
                50_001 => "WebP compression",
                _ => return Err(TiffError::Unsupported(format!("compression {other}"))),
            };
            return Err(TiffError::Unsupported(name.to_owned()));
        }
    };
    if data.len() < length {
        return Err(damaged);
    }
    if layout.has_predictor {
        add_up(&mut data, layout, directory.order);
    }
    if layout.subsampling != (1, 1) {
        return Ok(spread(&data, layout, rows));
    }
    let line = layout.chunk.0 * layout.chunk_samples();
    Ok(match layout.bits {
        16 => data.chunks_exact(2).map(|value| directory.order.number(value) as u16).collect(),
        8 => data.into_iter().map(u16::from).collect(),
        bits => {
            let (in_byte, mask) = (8 / bits, (1_u16 << bits) - 1);
            let value = |row: &[u8], at: usize| {
                u16::from(row[at / in_byte]) >> (8 - bits - at % in_byte * bits) & mask
            };
            let row_bytes = (line * bits).div_ceil(8);
            data.chunks_exact(row_bytes).flat_map(|row| (0..line).map(move |at| value(row, at))).collect()
        }
    })
}

fn unpack_lzw(packed: &[u8], length: usize) -> Vec<u8> {
    let mut data = vec![0; length];
    let mut decoder = LzwDecoder::with_tiff_size_switch(BitOrder::Msb, 8);
    let (mut from, mut to) = (0, 0);
    while to < length {
        let result = decoder.decode_bytes(&packed[from..], &mut data[to..]);
        from += result.consumed_in;
        to += result.consumed_out;
        if result.status.is_err() || (result.consumed_in == 0 && result.consumed_out == 0) {
            break;
        }
    }
    data.truncate(to);
    data
}

/// PackBits (TIFF 6.0, section 9).
fn unpack_bits(mut packed: &[u8], length: usize) -> Vec<u8> {
    let mut data = Vec::with_capacity(length);
    while let Some((&head, rest)) = packed.split_first()
        && data.len() < length
    {
        packed = rest;
        match head {
            0..=127 => {
                let (literal, rest) = packed.split_at(packed.len().min(usize::from(head) + 1));
                data.extend(literal);
                packed = rest;
            }
            128 => {}
            _ => {
                let Some((&byte, rest)) = packed.split_first() else { break };
                data.extend(std::iter::repeat_n(byte, 257 - usize::from(head)));
                packed = rest;
            }
        }
    }
    data
}

/// Undoes horizontal differences (TIFF 6.0, section 14).
fn add_up(data: &mut [u8], layout: &Layout, order: ByteOrder) {
    let (size, samples) = (layout.bits / 8, layout.chunk_samples());
    for row in data.chunks_exact_mut(layout.chunk.0 * samples * size) {
        for at in (samples * size..row.len()).step_by(size) {
            let sum = order.number(&row[at..at + size]) + order.number(&row[at - samples * size..][..size]);
            row[at..at + size].copy_from_slice(&order.bytes(sum, size));
        }
    }
}

/// Pixels of subsampled chroma: units of luma samples, then two of chroma (TIFF 6.0, section 21).
fn spread(data: &[u8], layout: &Layout, rows: usize) -> Vec<u16> {
    let (across, down) = layout.subsampling;
    let units = layout.chunk.0.div_ceil(across);
    let mut values = Vec::with_capacity(3 * layout.chunk.0 * rows);
    for row in 0..rows {
        for column in 0..layout.chunk.0 {
            let unit = &data[(row / down * units + column / across) * (across * down + 2)..];
            let luma = unit[row % down * across + column % across];
            values.extend([luma, unit[across * down], unit[across * down + 1]].map(u16::from));
        }
    }
    values
}

/// A chunk that is a JPEG picture (TIFF Technical Note 2). Its colours become those of `layout`.
fn unpack_jpeg(
    packed: &[u8],
    directory: &Directory,
    layout: &Layout,
    rows: usize,
) -> Result<Vec<u16>, TiffError> {
    if layout.bits != 8 || layout.photometric == Photometric::Cmyk {
        return Err(TiffError::Unsupported("JPEG compression of CMYK or deep samples".to_owned()));
    }
    let tables = directory.entries.get(&tag::JPEG_TABLES).map_or(&[][..], |entry| &entry.bytes);
    // Tables without their end marker go before the picture without its start. Adobe's marker says how colours are coded.
    let transform = u8::from(layout.photometric == Photometric::YCbCr);
    let tables = tables.strip_suffix(&[0xff, 0xd9]).unwrap_or(tables).get(2..).unwrap_or_default();
    let mut file = b"\xff\xd8\xff\xee\0\x0eAdobe\0\x64\0\0\0\0".to_vec();
    file.push(transform);
    file.extend(tables);
    file.extend(packed.get(2..).unwrap_or_default());
    let jpeg = Jpeg::read(&file).map_err(|error| match error {
        JpegError::Unsupported(what) => TiffError::Unsupported(what.to_owned()),
        JpegError::Damaged(problem) => TiffError::Damaged(problem),
        JpegError::TooLarge { .. } => TiffError::Damaged("a strip or tile larger than the picture"),
    })?;
    if jpeg.width < layout.chunk.0 || jpeg.height < rows {
        return Err(TiffError::Damaged("a strip or tile that is too small"));
    }
    let rgb = jpeg.decode_region(0..layout.chunk.0, 0..rows);
    let pixels = rgb.chunks_exact(3);
    Ok(match (layout.chunk_samples(), layout.photometric) {
        (1, _) => pixels.map(|pixel| u16::from(pixel[0])).collect(),
        (3, _) => rgb.into_iter().map(u16::from).collect(),
        _ => return Err(TiffError::Unsupported("JPEG compression with transparency".to_owned())),
    })
}
