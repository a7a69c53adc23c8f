//! A baseline JPEG file, decoded where somebody looks.
//!
//! In: the bytes of a file. Out: the pixels of any part of it, or the means of squares of four or eight pixels. The one
//! idea: whether a file is whole shows once its Huffman codes are read to the last, and that is a quarter of the work;
//! most blocks of a photograph of one plant are cloth that nobody asks for, and a mean of pixels needs no pixels.
//!
//! What is odd, damaged, or of another process than Huffman-coded baseline is refused without a reason: the decoder of
//! [`Photo::decode`](crate::photo::Photo::decode) has the last word on it. What is taken has the pixels of that decoder,
//! to the bit.
//!
//! # References
//! ITU-T Recommendation T.81 (1992): markers B, Huffman decoding F.2, zigzag and transform A.3.

mod bits;
mod part;
mod shrunk;
mod transform;

use std::cell::RefCell;

use bits::{AcTable, Bits, DcTable};

use super::MAX_PIXELS;

/// Columns and rows of a block.
const SIDE: usize = 8;

/// The place in a block, row by row, of each frequency in the order of the file (T.81, figure A.6).
const ZIGZAG: [u8; 64] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20, 13, 6, 7,
    14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39,
    46, 53, 60, 61, 54, 47, 55, 62, 63,
];

/// A whole file, as frequencies.
#[derive(Clone, Debug)]
pub struct Jpeg {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Brightness, and blueness and redness where the picture has colour.
    planes: Vec<Plane>,
    /// Those of all blocks, in the order of the file, and then some of no meaning.
    frequencies: Vec<Frequency>,
}

/// One component of a picture.
#[derive(Clone, Debug)]
struct Plane {
    /// Pixels across and down that a sample stands for: 1 or 2.
    spread: (usize, usize),
    /// Blocks in a row and rows of them, those beyond the picture's edge that fill the last unit included.
    across: usize,
    down: usize,
    /// What each frequency is multiplied by, in the order of the file.
    steps: [i32; 64],
    blocks: Vec<Block>,
}

/// Eight by eight samples.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Its first frequency but for the mean, and how many there are.
    first: u32,
    count: u16,
    /// The mean: the frequency zero.
    mean: i16,
}

/// A frequency that is not zero: its place in the order of the file and, 16 bits up, its signed value.
#[derive(Clone, Copy, Debug, Default)]
struct Frequency(u32);

impl Frequency {
    const fn new(place: usize, value: i16) -> Self {
        Self((value as u16 as u32) << 16 | place as u32)
    }

    const fn place(self) -> usize {
        (self.0 & 63) as usize
    }

    const fn value(self) -> i32 {
        (self.0 as i32) >> 16
    }
}

thread_local! {
    /// Room for the frequencies of the next file: megabytes that the system would otherwise hand out anew, page by page and
    /// filled with zeros, for every photograph.
    static ROOM: RefCell<Vec<Frequency>> = const { RefCell::new(Vec::new()) };
}

/// Frequencies that room is kept for at most, between two files.
const MOST_KEPT: usize = 4 << 20;

impl Drop for Jpeg {
    fn drop(&mut self) {
        if self.frequencies.len() <= MOST_KEPT {
            // A thread that is ending keeps nothing.
            let _ = ROOM.try_with(|room| room.replace(std::mem::take(&mut self.frequencies)));
        }
    }
}

/// What stands before the codes.
struct Header {
    width: usize,
    height: usize,
    /// Samples across and down in a unit of the first component; the others have one.
    sampling: (usize, usize),
    parts: Vec<Part>,
    /// Units between two restarts; 0 without.
    restart: usize,
    /// Where the codes begin.
    codes: usize,
}

struct Part {
    steps: [i32; 64],
    dc: DcTable,
    ac: AcTable,
}

impl Jpeg {
    /// Reads a file; `None` where it is anything but a whole, plain baseline JPEG without a byte after its end.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let header = Header::read(bytes)?;
        let (frequencies, blocks) = header.scan::<true>(bytes)?;
        let (across, down) = header.units();
        let parts = header.parts.iter().zip(blocks).enumerate();
        let planes = parts.map(|(index, (part, blocks))| {
            let (columns, rows) = if index == 0 { header.sampling } else { (1, 1) };
            Plane {
                spread: (header.sampling.0 / columns, header.sampling.1 / rows),
                across: across * columns,
                down: down * rows,
                steps: part.steps,
                blocks,
            }
        });
        Some(Self { width: header.width, height: header.height, planes: planes.collect(), frequencies })
    }

    /// Reads the codes of a file and keeps nothing: what no decoder can do without. The number of its blocks.
    #[must_use]
    pub fn floor(bytes: &[u8]) -> Option<usize> {
        let (_, blocks) = Header::read(bytes)?.scan::<false>(bytes)?;
        Some(blocks.iter().map(Vec::len).sum())
    }

    fn frequencies(&self, block: &Block) -> &[Frequency] {
        &self.frequencies[block.first as usize..][..usize::from(block.count)]
    }
}

impl Header {
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut steps: [Option<[i32; 64]>; 4] = [None; 4];
        let mut tables: [Option<DcTable>; 4] = Default::default();
        let mut others: [Option<AcTable>; 4] = Default::default();
        let mut frame: Option<&[u8]> = None;
        let mut restart = 0;
        let mut at = 2;
        bytes.starts_with(&[0xff, 0xd8]).then_some(())?;
        loop {
            let &[0xff, marker, high, low] = bytes.get(at..at + 4)? else { return None };
            let length = usize::from(u16::from_be_bytes([high, low]));
            let body = bytes.get(at + 4..at + 2 + length)?;
            at += 2 + length;
            match marker {
                0xc0 if frame.is_none() => frame = Some(body),
                0xc4 => huffman(body, &mut tables, &mut others)?,
                0xdb => quantisation(body, &mut steps)?,
                0xdd => restart = usize::from(u16::from_be_bytes(body.try_into().ok()?)),
                0xda => return Self::of(frame?, body, &steps, tables, others, restart, at),
                // Those which the other decoder reads more of than their length are left to it.
                0xe0 if !body.starts_with(b"AVI1") => {}
                0xe1 if !body.starts_with(b"http://ns.adobe.com/xmp/extension/") => {}
                0xe2..=0xed | 0xef | 0xfe => {}
                _ => return None,
            }
        }
    }

    fn of(
        frame: &[u8],
        scan: &[u8],
        steps: &[Option<[i32; 64]>; 4],
        mut tables: [Option<DcTable>; 4],
        mut others: [Option<AcTable>; 4],
        restart: usize,
        codes: usize,
    ) -> Option<Self> {
        let (&[8, y1, y0, x1, x0, count], components) = frame.split_first_chunk()? else { return None };
        let side = |high, low| usize::from(u16::from_be_bytes([high, low]));
        let (width, height, count) = (side(x1, x0), side(y1, y0), usize::from(count));
        let is_known = matches!(count, 1 | 3) && components.len() == 3 * count;
        let is_sized = width >= 2 * SIDE && height >= 2 * SIDE && width * height <= MAX_PIXELS;
        let (&scanned, selectors) = scan.split_first()?;
        let is_whole = usize::from(scanned) == count && selectors.get(2 * count..) == Some(&[0, 63, 0]);
        if !(is_known && is_sized && is_whole) {
            return None;
        }
        let sampling = |component: &[u8]| (usize::from(component[1] >> 4), usize::from(component[1] & 15));
        let mut parts = Vec::with_capacity(count);
        for (index, (component, selector)) in
            components.chunks_exact(3).zip(selectors.chunks_exact(2)).enumerate()
        {
            let is_again = components.chunks_exact(3).take(index).any(|other| other[0] == component[0]);
            let is_plain = match (index, count) {
                (0, 3) => matches!(sampling(component), (1, 1) | (2, 1) | (2, 2)),
                _ => sampling(component) == (1, 1),
            };
            if is_again || !is_plain || component[0] != selector[0] {
                return None;
            }
            let steps = (*steps.get(usize::from(component[2]))?)?;
            let (dc, ac) = (usize::from(selector[1] >> 4), usize::from(selector[1] & 15));
            let (dc, ac) = (tables.get_mut(dc)?.as_ref()?.clone(), others.get_mut(ac)?.as_ref()?.clone());
            parts.push(Part { steps, dc, ac });
        }
        Some(Self { width, height, sampling: sampling(components), parts, restart, codes })
    }

    /// Units across and down: what the components' blocks are interleaved by.
    const fn units(&self) -> (usize, usize) {
        (self.width.div_ceil(SIDE * self.sampling.0), self.height.div_ceil(SIDE * self.sampling.1))
    }

    /// Reads all codes: the frequencies, where they are to be kept, and the blocks of each component. `None` where a code
    /// is none, or where the file goes on or has ended before.
    fn scan<const KEEP: bool>(&self, bytes: &[u8]) -> Option<(Vec<Frequency>, Vec<Vec<Block>>)> {
        let (across, down) = self.units();
        let (columns, rows) = self.sampling;
        let mut bits = Bits::new(bytes, self.codes);
        let mut frequencies = if KEEP { ROOM.take() } else { Vec::new() };
        let mut first = 0;
        let mut blocks: Vec<Vec<Block>> = (0..self.parts.len())
            .map(|index| vec![Block::default(); across * down * if index == 0 { columns * rows } else { 1 }])
            .collect();
        let mut means = [0_i32; 3];
        // Within what the transform cannot overflow.
        let most: Vec<i32> =
            self.parts.iter().map(|part| i32::from(i16::MAX) / part.steps[0].max(1)).collect();
        let mut left = self.restart;
        let mut restarts = 0;
        for unit in 0..across * down {
            if self.restart > 0 && left == 0 {
                bits.marker(0xd0 + restarts)?;
                restarts = (restarts + 1) % 8;
                left = self.restart;
                means = [0; 3];
            }
            left = left.wrapping_sub(1);
            let (x, y) = (unit % across, unit / across);
            for (index, part) in self.parts.iter().enumerate() {
                let (columns, rows) = if index == 0 { (columns, rows) } else { (1, 1) };
                for row in 0..rows {
                    for column in 0..columns {
                        means[index] += bits.dc(&part.dc)?;
                        if frequencies.len() < first + 64 {
                            frequencies.resize(2 * (first + 64), Frequency::default());
                        }
                        let count = bits.ac::<KEEP>(&part.ac, frequencies[first..].first_chunk_mut()?)?;
                        if means[index].abs() > most[index] {
                            return None;
                        }
                        blocks[index][(y * rows + row) * across * columns + x * columns + column] =
                            Block { first: first as u32, count: count as u16, mean: means[index] as i16 };
                        first += if KEEP { count } else { 0 };
                    }
                }
            }
        }
        bits.marker(0xd9)?;
        (bits.place() == bytes.len()).then_some((frequencies, blocks))
    }
}

/// T.81, B.2.4.1: tables of 8 bits.
fn quantisation(mut body: &[u8], steps: &mut [Option<[i32; 64]>; 4]) -> Option<()> {
    while let Some((&kind, rest)) = body.split_first() {
        let (table, rest) = rest.split_first_chunk::<64>()?;
        *steps.get_mut(usize::from(kind))? = Some(table.map(i32::from));
        body = rest;
    }
    Some(())
}

/// T.81, B.2.4.2.
fn huffman(mut body: &[u8], dc: &mut [Option<DcTable>; 4], ac: &mut [Option<AcTable>; 4]) -> Option<()> {
    while let Some((&kind, rest)) = body.split_first() {
        let (lengths, rest) = rest.split_first_chunk::<16>()?;
        let count = lengths.iter().copied().map(usize::from).sum();
        let (symbols, rest) = rest.split_at_checked(count)?;
        match kind >> 4 {
            0 => *dc.get_mut(usize::from(kind))? = Some(DcTable::new(lengths, symbols)?),
            1 => *ac.get_mut(usize::from(kind & 15))? = Some(AcTable::new(lengths, symbols)?),
            _ => return None,
        }
        body = rest;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Region;
    use crate::photo::{Image, Photo};
    use crate::random::{self, Purpose};

    /// How a file is written.
    #[derive(Clone, Copy, Debug)]
    struct Kind {
        quality: u8,
        sampling: SamplingFactor,
        is_grey: bool,
        restart: u16,
    }

    /// Smooth ground, edges and noise.
    fn scene(width: usize, height: usize, noise: f64) -> Image {
        let mut rng = random::stream(5, Purpose::Scene, 0);
        let mut rgb = Vec::with_capacity(3 * width * height);
        for at in 0..width * height {
            let (x, y) = (at % width, at / width);
            let is_bar = (x + y / 3) % 40 < 5;
            let ground = [x * 255 / width, y * 200 / height, (x * y) % 256 / 4];
            for value in if is_bar { [250, 255, 10] } else { ground } {
                rgb.push((value as f64 + noise * (random::uniform(&mut rng) - 0.5)).clamp(0.0, 255.0) as u8);
            }
        }
        Image { width, height, rgb }
    }

    fn file(image: &Image, kind: Kind, is_progressive: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, kind.quality);
        encoder.set_sampling_factor(kind.sampling);
        encoder.set_restart_interval(kind.restart);
        encoder.set_progressive(is_progressive);
        let (width, height) = (image.width as u16, image.height as u16);
        if kind.is_grey {
            let grey: Vec<u8> = image.rgb.chunks_exact(3).map(|pixel| pixel[1]).collect();
            encoder.encode(&grey, width, height, ColorType::Luma).unwrap();
        } else {
            encoder.encode(&image.rgb, width, height, ColorType::Rgb).unwrap();
        }
        bytes
    }

    fn decoded(bytes: &[u8]) -> Image {
        Photo { name: String::new(), bytes: bytes.to_vec(), time_s: 0.0 }.decode().unwrap()
    }

    fn cut(image: &Image, region: Region) -> Vec<u8> {
        let rows = region.y..region.y + region.height;
        let row = |y| &image.rgb[3 * (y * image.width + region.x)..][..3 * region.width];
        rows.flat_map(row).copied().collect()
    }

    fn kinds() -> impl Strategy<Value = Kind> {
        let sampling = prop_oneof![
            Just(SamplingFactor::F_1_1),
            Just(SamplingFactor::F_2_1),
            Just(SamplingFactor::F_2_2)
        ];
        let restart = prop_oneof![Just(0_u16), Just(2), Just(7)];
        (1..=100_u8, sampling, any::<bool>(), restart)
            .prop_map(|(quality, sampling, is_grey, restart)| Kind { quality, sampling, is_grey, restart })
    }

    const PLAIN: Kind = Kind { quality: 90, sampling: SamplingFactor::F_2_2, is_grey: false, restart: 0 };

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_part_has_the_pixels_of_the_plain_decoder(
            kind in kinds(), (width, height) in (16..120_usize, 16..90_usize), noise in 0.0..120.0,
            from in (0.0..1.0, 0.0..1.0), to in (0.0..1.0, 0.0..1.0),
        ) {
            let bytes = file(&scene(width, height, noise), kind, false);
            let whole = decoded(&bytes);
            let jpeg = Jpeg::read(&bytes).unwrap();
            let all = jpeg.part(Region { x: 0, y: 0, width, height });
            prop_assert!(all == whole);
            let (x, y) = ((from.0 * width as f64) as usize, (from.1 * height as f64) as usize);
            let side = |share: f64, most: usize| 1 + (share * most as f64) as usize % most;
            let region = Region { x, y, width: side(to.0, width - x), height: side(to.1, height - y) };
            prop_assert_eq!(jpeg.part(region).rgb, cut(&whole, region));
        }

        #[test]
        fn a_square_is_the_mean_of_its_pixels(
            kind in kinds(), (width, height) in (16..120_usize, 16..90_usize), factor in 1..4_u32,
        ) {
            // Little noise: where pixels are not clamped the means are told apart by rounding only.
            let factor = 2_usize.pow(factor);
            let mut image = scene(width, height, 8.0);
            image.rgb.iter_mut().for_each(|value| *value = 64 + *value / 2);
            let bytes = file(&image, Kind { quality: kind.quality.max(60), is_grey: true, ..kind }, false);
            let (whole, jpeg) = (decoded(&bytes), Jpeg::read(&bytes).unwrap());
            let region = Region { x: 8, y: 8, width: width - 8, height: height - 8 };
            let (grey, shrunk) = (jpeg.shrunk_grey(region, factor), jpeg.shrunk(region, factor));
            let (columns, rows) = (region.width / factor, region.height / factor);
            prop_assert_eq!((grey.len(), shrunk.width, shrunk.height), (columns * rows, columns, rows));
            for (at, (&grey, rgb)) in grey.iter().zip(shrunk.rgb.chunks_exact(3)).enumerate() {
                let (x, y) = (8 + at % columns * factor, 8 + at / columns * factor);
                let square = cut(&whole, Region { x, y, width: factor, height: factor });
                let mean = square.iter().map(|&value| f32::from(value)).sum::<f32>() / square.len() as f32;
                prop_assert!((grey - mean).abs() < 0.75, "{grey} for {mean}");
                prop_assert!(rgb.iter().all(|&value| (f32::from(value) - mean).abs() <= 1.0));
            }
        }
    }

    #[test]
    fn shrunk_colours_are_near_those_of_the_pixels() {
        let mut image = scene(160, 120, 0.0);
        image.rgb.iter_mut().for_each(|value| *value = 64 + *value / 2);
        for sampling in [SamplingFactor::F_1_1, SamplingFactor::F_2_1, SamplingFactor::F_2_2] {
            let bytes = file(&image, Kind { sampling, ..PLAIN }, false);
            let (whole, jpeg) = (decoded(&bytes), Jpeg::read(&bytes).unwrap());
            let shrunk = jpeg.shrunk(Region { x: 0, y: 0, width: 160, height: 120 }, 4);
            let mut off = 0.0;
            for (at, pixel) in shrunk.rgb.chunks_exact(3).enumerate() {
                let square = cut(&whole, Region { x: at % 40 * 4, y: at / 40 * 4, width: 4, height: 4 });
                for (channel, &value) in pixel.iter().enumerate() {
                    let mean =
                        square.iter().skip(channel).step_by(3).map(|&v| f64::from(v)).sum::<f64>() / 16.0;
                    off += (f64::from(value) - mean).abs() / shrunk.rgb.len() as f64;
                }
            }
            assert!(off < 1.5, "{sampling:?}: {off}");
        }
    }

    #[test]
    fn what_is_not_plain_and_whole_is_left_to_the_other_decoder() {
        let image = scene(64, 48, 30.0);
        let whole = file(&image, PLAIN, false);
        assert!(Jpeg::read(&whole).is_some() && Jpeg::floor(&whole) == Some(4 * 3 * 6));
        for length in 0..whole.len() {
            assert!(Jpeg::read(&whole[..length]).is_none(), "{length} of {}", whole.len());
        }
        let refused = |bytes: &[u8]| Jpeg::read(bytes).is_none();
        assert!(refused(&[&whole[..], &[0]].concat()) && refused(b"GIF89a"));
        assert!(refused(&file(&image, PLAIN, true)), "progressive");
        assert!(
            refused(&file(&image, Kind { sampling: SamplingFactor::F_1_2, ..PLAIN }, false)),
            "tall units"
        );
        assert!(refused(&file(&scene(8, 48, 0.0), PLAIN, false)), "narrow");
        // A file cut short in its middle with the end marker put back.
        let middle = whole.len() * 3 / 4;
        assert!(refused(&[&whole[..middle], &[0xff, 0xd9]].concat()));
    }

    #[test]
    fn what_is_taken_is_never_refused_by_the_other_decoder() {
        let whole = file(&scene(64, 48, 30.0), Kind { restart: 2, ..PLAIN }, false);
        let mut rng = random::stream(9, Purpose::Scene, 0);
        let mut taken = BTreeSet::new();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (8.0 * random::uniform(&mut rng)) as u8;
            if let Some(jpeg) = Jpeg::read(&bytes) {
                let region = Region { x: 0, y: 0, width: jpeg.width, height: jpeg.height };
                assert!(jpeg.part(region) == decoded(&bytes), "byte {at}");
                taken.insert(at);
            }
        }
        assert!(taken.len() > 100, "{}", taken.len());
    }
}
