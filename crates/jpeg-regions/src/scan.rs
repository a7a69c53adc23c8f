//! Entropy-coded data of one sequential scan with all components: the quantised coefficients of all blocks, minimum coded
//! unit by unit (T.81, A.2 and F.2.2).

use super::bit_reader::BitReader;
use super::headers::{Frame, Scan};
use super::huffman::{AcTable, DcTable};
use super::{AcCoefficient, Block, JpegError, POOL};

/// The AC coefficients of all blocks in the order of the file, and the blocks of each component.
pub(super) type SparseBlocks = (Vec<AcCoefficient>, Vec<Vec<Block>>);

/// Whether a scan holds all components in the order of the frame.
pub(super) fn is_whole(frame: &Frame, scan: &Scan) -> bool {
    !frame.is_progressive
        && scan.components.iter().map(|component| component.index).eq(0..frame.components.len())
}

/// Reads all codes of a whole scan: the AC coefficients, with `STORE`, and the blocks of each component; and where the next
/// marker stands.
pub(super) fn decode<const STORE: bool>(
    frame: &Frame,
    scan: &Scan,
    bytes: &[u8],
) -> Result<(SparseBlocks, usize), JpegError> {
    let (units_across, units_down) = frame.unit_counts();
    let mut tables: Vec<(&DcTable, &AcTable)> = Vec::with_capacity(scan.components.len());
    for component in &scan.components {
        tables.push(component.dc.as_ref().zip(component.ac.as_ref()).ok_or(JpegError::NO_TABLE)?);
    }
    let mut reader = BitReader::new(bytes, scan.start);
    let mut ac_coefficients = if STORE { POOL.take() } else { Vec::new() };
    let mut ac_start = 0;
    let mut blocks: Vec<Vec<Block>> = (0..tables.len())
        .map(|index| {
            let (columns, rows) = frame.blocks(index);
            vec![Block::default(); columns * rows]
        })
        .collect();
    // The DC coefficient of each component's last block: the prediction of the next one (T.81, F.2.1.3.1).
    let mut dc = [0_i32; 4];
    let mut units_to_restart = scan.restart_interval;
    let mut restarts = 0;
    for unit in 0..units_across * units_down {
        if scan.restart_interval > 0 && units_to_restart == 0 {
            reader.expect_restart(restarts)?;
            restarts = (restarts + 1) % 8;
            units_to_restart = scan.restart_interval;
            dc = [0; 4];
        }
        units_to_restart = units_to_restart.wrapping_sub(1);
        let (x, y) = (unit % units_across, unit / units_across);
        for (index, &(dc_table, ac_table)) in tables.iter().enumerate() {
            let (columns, rows) = frame.components[index].sampling;
            for row in 0..rows {
                for column in 0..columns {
                    dc[index] += reader.decode_dc(dc_table).ok_or(JpegError::NO_CODE)?;
                    if ac_coefficients.len() < ac_start + 64 {
                        ac_coefficients.resize(2 * (ac_start + 64), AcCoefficient::default());
                    }
                    let out = ac_coefficients[ac_start..].first_chunk_mut().ok_or(JpegError::NO_CODE)?;
                    let count = reader.decode_ac::<STORE>(ac_table, out).ok_or(JpegError::NO_CODE)?;
                    blocks[index][(y * rows + row) * units_across * columns + x * columns + column] = Block {
                        ac_start: ac_start as u32,
                        ac_count: count as u16,
                        dc: i16::try_from(dc[index]).map_err(|_| JpegError::NO_CODE)?,
                    };
                    ac_start += if STORE { count } else { 0 };
                }
            }
        }
    }
    let end = reader.end_of_scan()?;
    Ok(((ac_coefficients, blocks), end))
}
