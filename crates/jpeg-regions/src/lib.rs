//! A decoder of baseline JPEG files that decodes only what is asked for.
//!
//! In: the bytes of a file. Out: the pixels of any region, or of a region at 1/2, 1/4 or 1/8 of its size. The one
//! idea: a file is known to be whole once its Huffman codes are read to the last. The inverse DCT can wait until a
//! region is asked for, and most blocks of a photograph of one plant show only cloth. A smaller picture follows from
//! the DCT coefficients without any pixels.
//!
//! The steps of decoding, each in its file: marker segments (`headers`), Huffman tables (`huffman`), codes and values
//! (`bit_reader`), minimum coded units (`scan`), dequantisation and inverse DCT (`idct`), chroma upsampling
//! (`upsample`), colour conversion (`colour`). `region` puts them together.
//!
//! [`Jpeg::read`] accepts what the baseline process allows and cameras write. It declines everything else without a
//! reason, for another decoder to decide. The pixels differ by rounding only from
//! those of other decoders.
//!
//! [`Jpeg::decode_region`], [`Jpeg::decode_scaled`] and [`Jpeg::decode_scaled_luma`] and all that they call are inlined: a
//! caller that is compiled for wider vectors (`#[target_feature]`) has them compiled for these.
//!
//! # References
//! ITU-T Recommendation T.81 (1992), *Digital compression and coding of continuous-tone still images*: annex A (DCT,
//! zig-zag, minimum coded units), B (marker segments), C (Huffman tables), F.2 (baseline decoding). ITU-T
//! Recommendation T.871 (2011), *JPEG File Interchange Format*.

mod huffman;
mod bit_reader;
mod colour;
mod headers;
mod idct;
mod upsample;
mod region;
mod scan;

#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::ops::Range;

use headers::Headers;

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
    /// Luma, and blue-difference and red-difference chroma where the picture has colour.
    components: Vec<Component>,
    /// The AC coefficients of all blocks, in the order of the file; unused room follows.
    ac_coefficients: Vec<AcCoefficient>,
}

/// One component of a picture: Y, Cb or Cr.
#[derive(Clone, Debug)]
struct Component {
    /// Pixels across and down that a sample stands for, 1 or 2.
    subsampling: (usize, usize),
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
    /// Reads a file; `None` for anything but a whole baseline JPEG of a usual form without a byte after its end.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let headers = Headers::read(bytes)?;
        let (ac_coefficients, blocks) = headers.decode_scan::<true>(bytes)?;
        let (units_across, units_down) = headers.unit_counts();
        let components = headers.components.iter().zip(blocks).enumerate();
        let components = components.map(|(index, (component, blocks))| {
            let (columns, rows) = headers.blocks_in_unit(index);
            Component {
                subsampling: (headers.luma_sampling.0 / columns, headers.luma_sampling.1 / rows),
                block_columns: units_across * columns,
                block_rows: units_down * rows,
                quantisation: component.quantisation,
                blocks,
            }
        });
        let components = components.collect();
        Some(Self { width: headers.width, height: headers.height, components, ac_coefficients })
    }

    /// Reads all Huffman codes of a file, keeps nothing, and returns the number of blocks: the least work that any
    /// decoder must do, for benchmarks. `None` as in [`Jpeg::read`].
    #[must_use]
    pub fn scan_only(bytes: &[u8]) -> Option<usize> {
        let (_, blocks) = Headers::read(bytes)?.decode_scan::<false>(bytes)?;
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
