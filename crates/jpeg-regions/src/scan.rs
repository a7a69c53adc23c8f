//! Entropy-coded data: the quantised coefficients of all blocks, minimum coded unit by unit (T.81, A.2 and F.2.2).

use super::bit_reader::BitReader;
use super::headers::Headers;
use super::{AcCoefficient, Block, POOL};

/// End of image, and the first of the eight restart markers (T.81, table B.1).
const EOI: u8 = 0xd9;
const RST0: u8 = 0xd0;

impl Headers {
    /// Reads all codes: the AC coefficients, with `STORE`, and the blocks of each component.
    ///
    /// `None` for a code that does not exist, and where the file goes on after its last unit or ends before.
    pub(super) fn decode_scan<const STORE: bool>(
        &self,
        bytes: &[u8],
    ) -> Option<(Vec<AcCoefficient>, Vec<Vec<Block>>)> {
        let (units_across, units_down) = self.unit_counts();
        let mut reader = BitReader::new(bytes, self.scan_start);
        let mut ac_coefficients = if STORE { POOL.take() } else { Vec::new() };
        let mut ac_start = 0;
        let mut blocks: Vec<Vec<Block>> = (0..self.components.len())
            .map(|index| {
                let (columns, rows) = self.blocks_in_unit(index);
                vec![Block::default(); units_across * units_down * columns * rows]
            })
            .collect();
        // The DC coefficient of each component's last block: the prediction of the next one (T.81, F.2.1.3.1).
        let mut dc = [0_i32; 3];
        let mut units_to_restart = self.restart_interval;
        let mut restarts = 0;
        for unit in 0..units_across * units_down {
            if self.restart_interval > 0 && units_to_restart == 0 {
                reader.expect_marker(RST0 + restarts)?;
                restarts = (restarts + 1) % 8;
                units_to_restart = self.restart_interval;
                dc = [0; 3];
            }
            units_to_restart = units_to_restart.wrapping_sub(1);
            let (x, y) = (unit % units_across, unit / units_across);
            for (index, component) in self.components.iter().enumerate() {
                let (columns, rows) = self.blocks_in_unit(index);
                for row in 0..rows {
                    for column in 0..columns {
                        dc[index] += reader.decode_dc(&component.dc)?;
                        if ac_coefficients.len() < ac_start + 64 {
                            ac_coefficients.resize(2 * (ac_start + 64), AcCoefficient::default());
                        }
                        let out = ac_coefficients[ac_start..].first_chunk_mut()?;
                        let count = reader.decode_ac::<STORE>(&component.ac, out)?;
                        blocks[index][(y * rows + row) * units_across * columns + x * columns + column] =
                            Block {
                                ac_start: ac_start as u32,
                                ac_count: count as u16,
                                dc: i16::try_from(dc[index]).ok()?,
                            };
                        ac_start += if STORE { count } else { 0 };
                    }
                }
            }
        }
        reader.expect_marker(EOI)?;
        (reader.position() == bytes.len()).then_some((ac_coefficients, blocks))
    }
}
