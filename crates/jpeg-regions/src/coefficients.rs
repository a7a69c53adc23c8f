//! Pictures in several scans: progressive ones, and sequential ones whose components do not take turns (T.81, A.2.2 and
//! annex G).
//!
//! Each scan adds to the coefficients of all blocks, which are therefore kept in full. At the end they are packed as those of
//! a picture in one scan are.

use super::bit_reader::BitReader;
use super::headers::{Frame, Scan};
use super::scan::SparseBlocks;
use super::{AcCoefficient, BLOCK_SIDE, Block, JpegError};

/// Scans of a picture, at most. Chosen: encoders write some ten; a hostile file could ask for thousands of passes over a large
/// picture.
pub(super) const MAX_SCANS: usize = 100;

/// All coefficients of a picture by component, block and zig-zag index.
pub(super) struct Coefficients {
    components: Vec<Vec<[i16; 64]>>,
    /// For each component and coefficient, the lowest bit that was sent; `None` before its first scan.
    sent: Vec<[Option<u32>; 64]>,
}

impl Coefficients {
    /// Zeros.
    pub(super) fn new(frame: &Frame) -> Self {
        let blocks = |index| {
            let (columns, rows) = frame.blocks(index);
            vec![[0; 64]; columns * rows]
        };
        let count = frame.components.len();
        Self { components: (0..count).map(blocks).collect(), sent: vec![[None; 64]; count] }
    }

    /// Reads all codes of a scan and returns where the next marker stands.
    pub(super) fn add(&mut self, frame: &Frame, scan: &Scan, bytes: &[u8]) -> Result<usize, JpegError> {
        for component in &scan.components {
            for sent in &mut self.sent[component.index][scan.band.0..=scan.band.1] {
                *sent = Some(scan.bits.1);
            }
        }
        let mut decoder =
            ScanDecoder { frame, scan, reader: BitReader::new(bytes, scan.start), dc: [0; 4], band_ends: 0 };
        // The blocks of one component alone are those that it needs, row by row; of several, minimum coded units (T.81, A.2).
        let (across, down) = match scan.components.as_slice() {
            [only] => {
                let (columns, rows) = frame.samples(only.index);
                (columns.div_ceil(BLOCK_SIDE), rows.div_ceil(BLOCK_SIDE))
            }
            _ => frame.unit_counts(),
        };
        let is_alone = scan.components.len() == 1;
        for unit in 0..across * down {
            if scan.restart_interval > 0 && unit > 0 && unit % scan.restart_interval == 0 {
                decoder.restart(unit / scan.restart_interval - 1)?;
            }
            let (x, y) = (unit % across, unit / across);
            for (place, component) in scan.components.iter().enumerate() {
                let stride = frame.blocks(component.index).0;
                let (columns, rows) =
                    if is_alone { (1, 1) } else { frame.components[component.index].sampling };
                for row in 0..rows {
                    for column in 0..columns {
                        let at = (y * rows + row) * stride + x * columns + column;
                        decoder.block(place, &mut self.components[component.index][at])?;
                    }
                }
            }
        }
        decoder.reader.end_of_scan()
    }

    /// Whether all bits of all coefficients were sent.
    pub(super) fn are_complete(&self) -> bool {
        self.sent.iter().flatten().all(|sent| *sent == Some(0))
    }

    /// The coefficients other than zero, as those of one scan.
    pub(super) fn packed(&self) -> SparseBlocks {
        let mut ac_coefficients = Vec::new();
        let pack = |block: &[i16; 64], all: &mut Vec<AcCoefficient>| {
            let ac_start = all.len();
            let others = block.iter().enumerate().skip(1).filter(|&(_, &value)| value != 0);
            all.extend(others.map(|(index, &value)| AcCoefficient::new(index, value)));
            Block { ac_start: ac_start as u32, ac_count: (all.len() - ac_start) as u16, dc: block[0] }
        };
        let blocks = self
            .components
            .iter()
            .map(|blocks| blocks.iter().map(|block| pack(block, &mut ac_coefficients)).collect())
            .collect();
        (ac_coefficients, blocks)
    }
}

/// One scan on its way.
struct ScanDecoder<'a> {
    frame: &'a Frame,
    scan: &'a Scan,
    reader: BitReader<'a>,
    /// The DC coefficient of each component's last block.
    dc: [i32; 4],
    /// Blocks that follow without a new coefficient in the band (T.81, G.1.2.2: EOBRUN).
    band_ends: u32,
}

impl ScanDecoder<'_> {
    fn restart(&mut self, count: usize) -> Result<(), JpegError> {
        self.dc = [0; 4];
        self.band_ends = 0;
        self.reader.expect_restart((count % 8) as u8)
    }

    /// Reads a block of the component at `place` of the scan.
    fn block(&mut self, place: usize, block: &mut [i16; 64]) -> Result<(), JpegError> {
        let is_first = self.scan.bits.0 == 0;
        let decoded = match (self.frame.is_progressive, self.scan.band.0, is_first) {
            (false, ..) => self.sequential(place, block),
            (true, 0, true) => self.dc_first(place, block),
            (true, 0, false) => {
                block[0] |= (self.reader.bits(1) << self.scan.bits.1) as i16;
                Some(())
            }
            (true, _, true) => self.ac_first(block),
            (true, _, false) => self.ac_refine(block),
        };
        decoded.ok_or(JpegError::NO_CODE)
    }

    fn sequential(&mut self, place: usize, block: &mut [i16; 64]) -> Option<()> {
        let component = &self.scan.components[place];
        self.dc[place] += self.reader.decode_dc(component.dc.as_ref()?)?;
        block[0] = self.dc[place].try_into().ok()?;
        let mut found = [AcCoefficient::default(); 64];
        let count = self.reader.decode_ac::<true>(component.ac.as_ref()?, &mut found)?;
        found[..count].iter().for_each(|coefficient| block[coefficient.index()] = coefficient.value() as i16);
        Some(())
    }

    /// The upper bits of a DC coefficient (T.81, G.1.2.1).
    fn dc_first(&mut self, place: usize, block: &mut [i16; 64]) -> Option<()> {
        self.dc[place] += self.reader.decode_dc(self.scan.components[place].dc.as_ref()?)?;
        block[0] = (self.dc[place] << self.scan.bits.1).try_into().ok()?;
        Some(())
    }

    /// The upper bits of a band of AC coefficients (T.81, G.1.2.2).
    fn ac_first(&mut self, block: &mut [i16; 64]) -> Option<()> {
        if self.band_ends > 0 {
            self.band_ends -= 1;
            return Some(());
        }
        let table = self.scan.components[0].ac.as_ref()?;
        let mut index = self.scan.band.0;
        while index <= self.scan.band.1 {
            let (run, size) = self.reader.decode_run(table)?;
            match (run, size) {
                (15, 0) => index += 16,
                (_, 0) => {
                    self.band_ends = (1 << run) - 1 + self.reader.bits(run);
                    break;
                }
                _ => {
                    index += run as usize;
                    let value = self.reader.receive_value(size) << self.scan.bits.1;
                    *block.get_mut(index)? = value.try_into().ok()?;
                    index += 1;
                }
            }
        }
        Some(())
    }

    /// One more bit of a band of AC coefficients (T.81, G.1.2.3): of each that is not zero, and some new ones.
    fn ac_refine(&mut self, block: &mut [i16; 64]) -> Option<()> {
        let (table, (first, last)) = (self.scan.components[0].ac.as_ref()?, self.scan.band);
        let bit = 1_i16 << self.scan.bits.1;
        let mut index = first;
        while self.band_ends == 0 && index <= last {
            let (mut zeros, size) = self.reader.decode_run(table)?;
            let new = match (zeros, size) {
                (15, 0) => 0,
                (_, 0) => {
                    self.band_ends = (1 << zeros) + self.reader.bits(zeros);
                    break;
                }
                (_, 1) if self.reader.bits(1) == 1 => bit,
                (_, 1) => -bit,
                _ => return None,
            };
            while index <= last {
                if block[index] != 0 {
                    self.refine(&mut block[index], bit);
                } else if zeros == 0 {
                    break;
                } else {
                    zeros -= 1;
                }
                index += 1;
            }
            if new != 0 && index <= last {
                block[index] = new;
            }
            index += 1;
        }
        if self.band_ends > 0 {
            let others = block.get_mut(index..=last).unwrap_or_default();
            others.iter_mut().filter(|value| **value != 0).for_each(|value| self.refine(value, bit));
            self.band_ends -= 1;
        }
        Some(())
    }

    /// The next bit of a coefficient that is not zero.
    fn refine(&mut self, value: &mut i16, bit: i16) {
        if self.reader.bits(1) == 1 && *value & bit == 0 {
            *value = value.saturating_add(if *value > 0 { bit } else { -bit });
        }
    }
}
