//! A decoder of JPEG files that decodes only what is asked for.
//!
//! In: the bytes of a file. Out: the pixels of any region, or of a region at 1/2, 1/4 or 1/8 of its size. The one
//! idea: a file is known to be whole once its Huffman codes are read to the last. The inverse DCT can wait until a
//! region is asked for, and most blocks of a photograph of one plant show only cloth. A smaller picture follows from
//! the DCT coefficients without any pixels.
//!
//! The steps of decoding, each in its file: marker segments (`headers`), Huffman tables (`huffman`, `standard`), codes
//! and values (`bit_reader`), the only scan of most files (`scan`), several scans (`coefficients`), dequantisation and
//! inverse DCT (`idct`), chroma upsampling (`upsample`), colour conversion (`colour`). `region` puts them together.
//!
//! [`Jpeg::read`] accepts sequential and progressive files with Huffman codes and 8-bit samples, in any number of scans,
//! grey, in colour or for print (CMYK). A scan that fails, or leaves data behind, is damage: libjpeg and others fill in
//! what is missing. What follows the end marker is not looked at. The pixels differ by rounding only from those of other
//! decoders.
//!
//! [`Jpeg::decode_region`], [`Jpeg::decode_scaled`] and [`Jpeg::decode_scaled_luma`] and all that they call are inlined: a
//! caller that is compiled for wider vectors (`#[target_feature]`) has them compiled for these.
//!
//! # References
//! ITU-T Recommendation T.81 (1992), *Digital compression and coding of continuous-tone still images*: annex A (DCT,
//! zig-zag, minimum coded units), B (marker segments), C (Huffman tables), F.2 (sequential decoding), G (progressive). ITU-T
//! Recommendation T.871 (2011), *JPEG File Interchange Format*.

mod huffman;
mod standard;
mod bit_reader;
mod colour;
mod headers;
mod idct;
mod upsample;
mod region;
mod scan;
mod coefficients;

#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::fmt;
use std::ops::Range;

use coefficients::{Coefficients, MAX_SCANS};
use headers::{Headers, QuantisationTable};
use scan::SparseBlocks;

/// The largest picture that is read, in pixels: it bounds the memory that a file from elsewhere can claim.
pub const MAX_PIXELS: usize = 64 << 20;

/// Columns and rows of a block.
const BLOCK_SIDE: usize = 8;

/// The place in a block, row by row, of each zig-zag index (T.81, figure A.6).
const ZIGZAG: [u8; 64] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20, 13, 6, 7,
    14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39,
    46, 53, 60, 61, 54, 47, 55, 62, 63,
];

/// A whole file as quantised DCT coefficients.
#[derive(Clone, Debug)]
pub struct Jpeg {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    colour: Colour,
    /// What `colour` names, in its order.
    components: Vec<Component>,
    /// The AC coefficients of all blocks, in the order of the file; unused room follows.
    ac_coefficients: Vec<AcCoefficient>,
}

/// What the components of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Colour {
    Grey,
    /// Luma, and blue-difference and red-difference chroma.
    YCbCr,
    Rgb,
    /// Light that cyan, magenta, yellow and black ink leave: Adobe's programs, which write such files, keep them inverted.
    Cmyk,
    /// `Cmyk`, of which the first three are coded as luma and chroma.
    Ycck,
}

/// Why bytes are not read as a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JpegError {
    /// Not a JPEG file, or one of a kind that no camera writes: which.
    Unsupported(&'static str),
    /// Cut short or damaged: what is wrong.
    Damaged(&'static str),
    /// More than [`MAX_PIXELS`].
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl JpegError {
    const NO_TABLE: Self = Self::Damaged("a table is missing");
    const NO_CODE: Self = Self::Damaged("a code that does not exist");
}

impl fmt::Display for JpegError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsupported(what) | Self::Damaged(what) => f.write_str(what),
            Self::TooLarge { width, height } => write!(f, "{width} x {height} pixels"),
        }
    }
}

impl std::error::Error for JpegError {}

/// One component of a picture.
#[derive(Clone, Debug)]
struct Component {
    /// Pixels across and down that a sample stands for, 1 to 4.
    subsampling: (usize, usize),
    /// Columns and rows of samples.
    samples: (usize, usize),
    /// Blocks in a row and rows of blocks, with those beyond the picture's edge that complete the last unit.
    block_columns: usize,
    block_rows: usize,
    /// The quantisation table, by zig-zag index.
    quantisation: [i32; 64],
    /// Blocks, row by row.
    blocks: Vec<Block>,
}

/// The quantised coefficients of 8 x 8 samples.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Where its AC coefficients begin in [`Jpeg::ac_coefficients`], and how many are not zero.
    ac_start: u32,
    ac_count: u16,
    /// The DC coefficient.
    dc: i16,
}

/// An AC coefficient other than zero: its zig-zag index, and 16 bits up its signed value.
#[derive(Clone, Copy, Debug, Default)]
struct AcCoefficient(u32);

impl AcCoefficient {
    const fn new(index: usize, value: i16) -> Self {
        Self((value as u16 as u32) << 16 | index as u32)
    }

    /// The zig-zag index, 1 to 63.
    const fn index(self) -> usize {
        (self.0 & 63) as usize
    }

    const fn value(self) -> i32 {
        (self.0 as i32) >> 16
    }
}

thread_local! {
    /// The coefficients' memory for the thread's next file. The system would otherwise hand out and clear several
    /// megabytes, page by page, for every photograph.
    static POOL: RefCell<Vec<AcCoefficient>> = const { RefCell::new(Vec::new()) };
}

/// Coefficients that a thread keeps memory for at most between two files: 16 MiB.
const MAX_POOLED: usize = 4 << 20;

impl Drop for Jpeg {
    fn drop(&mut self) {
        if self.ac_coefficients.len() <= MAX_POOLED {
            // A thread that is ending keeps nothing.
            let _ = POOL.try_with(|pool| pool.replace(std::mem::take(&mut self.ac_coefficients)));
        }
    }
}

impl Jpeg {
    /// Reads a file.
    ///
    /// # Errors
    /// [`JpegError`] for what is not a whole picture, or of a kind that is not read.
    pub fn read(bytes: &[u8]) -> Result<Self, JpegError> {
        let mut headers = Headers::new(bytes)?;
        let mut quantisation = [None; 4];
        let mut coefficients: Option<Coefficients> = None;
        let mut scans = 0;
        let blocks = loop {
            let Some(scan) = headers.next_scan(bytes)? else {
                let Some(coefficients) = coefficients else { return Err(JpegError::Damaged("no picture")) };
                if !coefficients.are_complete() {
                    return Err(JpegError::Damaged("scans are missing"));
                }
                break coefficients.packed();
            };
            let frame = headers.frame()?;
            for component in &scan.components {
                // Each component keeps the table of its first scan, as in libjpeg.
                quantisation[component.index] = quantisation[component.index].or(component.quantisation);
            }
            if scans == 0 && scan::is_whole(frame, &scan) {
                let (blocks, end) = scan::decode::<true>(frame, &scan, bytes)?;
                headers.resume_at(end);
                if headers.next_scan(bytes)?.is_some() {
                    return Err(JpegError::Damaged("a scan too many"));
                }
                break blocks;
            }
            let end =
                coefficients.get_or_insert_with(|| Coefficients::new(frame)).add(frame, &scan, bytes)?;
            headers.resume_at(end);
            scans += 1;
            if scans > MAX_SCANS {
                return Err(JpegError::Unsupported("more than 100 scans"));
            }
        };
        Self::of_blocks(&headers, &quantisation, blocks)
    }

    fn of_blocks(
        headers: &Headers,
        quantisation: &[Option<QuantisationTable>; 4],
        (ac_coefficients, blocks): SparseBlocks,
    ) -> Result<Self, JpegError> {
        let frame = headers.frame()?;
        let mut components = Vec::with_capacity(blocks.len());
        for (index, (blocks, quantisation)) in blocks.into_iter().zip(quantisation).enumerate() {
            let quantisation = quantisation.ok_or(JpegError::NO_TABLE)?;
            // The mean of a block lies between black and white, but for the rounding of the coefficient. Twice the range shows
            // that codes were lost (T.81, A.3.1 and A.3.3: 8 times 128).
            let most = 2 * 1024 + quantisation[0];
            if blocks.iter().any(|block| (i32::from(block.dc) * quantisation[0]).abs() > most) {
                return Err(JpegError::Damaged("a block that is brighter than white or darker than black"));
            }
            let (columns, rows) = frame.components[index].sampling;
            let (block_columns, block_rows) = frame.blocks(index);
            components.push(Component {
                subsampling: (frame.most_sampling.0 / columns, frame.most_sampling.1 / rows),
                samples: frame.samples(index),
                block_columns,
                block_rows,
                quantisation,
                blocks,
            });
        }
        Ok(Self {
            width: frame.width,
            height: frame.height,
            colour: headers.colour()?,
            components,
            ac_coefficients,
        })
    }

    /// Reads all Huffman codes of a picture in one scan, keeps nothing, and returns the number of blocks: the least work that
    /// any decoder must do, for benchmarks. `None` as in [`Jpeg::read`], and for several scans.
    #[must_use]
    pub fn scan_only(bytes: &[u8]) -> Option<usize> {
        let mut headers = Headers::new(bytes).ok()?;
        let scan = headers.next_scan(bytes).ok()??;
        let frame = headers.frame().ok()?;
        scan::is_whole(frame, &scan).then_some(())?;
        let ((_, blocks), _) = scan::decode::<false>(frame, &scan, bytes).ok()?;
        Some(blocks.iter().map(Vec::len).sum())
    }

    /// Panics unless `columns` and `rows` lie in the picture and neither is empty.
    #[inline(always)]
    fn check_region(&self, columns: &Range<usize>, rows: &Range<usize>) {
        assert!(
            !columns.is_empty() && columns.end <= self.width && !rows.is_empty() && rows.end <= self.height,
            "columns {columns:?} and rows {rows:?} of {} x {}",
            self.width,
            self.height
        );
    }

    fn ac_coefficients(&self, block: &Block) -> &[AcCoefficient] {
        &self.ac_coefficients[block.ac_start as usize..][..usize::from(block.ac_count)]
    }
}
