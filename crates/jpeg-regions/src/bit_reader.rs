//! Reads Huffman codes, and the values that follow them, from entropy-coded data (T.81, F.2.2).
//!
//! The one idea: most codes and values are short, so one look-up of the next few bits gives run, value and length
//! together.

use super::huffman::{AcTable, DcTable, LOOKUP_BITS, extend};
use super::{AcCoefficient, JpegError};

/// Reads bits from entropy-coded data, without the bytes stuffed after 0xff (T.81, F.1.2.3).
///
/// Rarely called methods take and return a copy, so that the fields stay in registers.
#[derive(Clone, Copy)]
pub(super) struct BitReader<'a> {
    bytes: &'a [u8],
    /// The next byte to read.
    position: usize,
    /// The next bits, the first one highest. Bits beyond `filled` are zero or repeat what follows.
    buffer: u64,
    /// Bits in the buffer, padding included.
    filled: u32,
    /// Zero bits that were added after the end of the data.
    padding: u32,
}

impl<'a> BitReader<'a> {
    pub(super) const fn new(bytes: &'a [u8], position: usize) -> Self {
        Self { bytes, position, buffer: 0, filled: 0, padding: 0 }
    }

    /// Fills the buffer to more than 56 bits.
    #[inline(always)]
    fn refill(&mut self) {
        if let Some(chunk) = self.bytes.get(self.position..).and_then(|rest| rest.first_chunk::<8>()) {
            let word = u64::from_be_bytes(*chunk);
            let has_ff = (!word).wrapping_sub(0x0101_0101_0101_0101) & word & 0x8080_8080_8080_8080 != 0;
            if !has_ff {
                self.buffer |= word >> self.filled;
                let taken = (63 - self.filled) / 8;
                self.position += taken as usize;
                self.filled += 8 * taken;
                return;
            }
        }
        *self = self.refilled_bytewise();
    }

    /// The reader with a full buffer, filled byte by byte: without stuffed bytes, and with zeros from a marker on.
    #[cold]
    #[inline(never)]
    fn refilled_bytewise(mut self) -> Self {
        while self.filled <= 56 {
            let byte = match self.bytes.get(self.position..) {
                Some([0xff, 0, ..]) => {
                    self.position += 2;
                    0xff
                }
                Some([0xff, ..] | []) | None => {
                    self.padding += 8;
                    0
                }
                Some([byte, ..]) => {
                    self.position += 1;
                    *byte
                }
            };
            self.buffer |= u64::from(byte) << (56 - self.filled);
            self.filled += 8;
        }
        self
    }

    #[inline(always)]
    const fn peek(&self, count: u32) -> usize {
        (self.buffer >> (64 - count)) as usize
    }

    #[inline(always)]
    const fn consume(&mut self, count: u32) {
        self.buffer <<= count;
        self.filled -= count;
    }

    /// Reads a signed value of `size` bits, 1 to 15 (T.81, F.2.2.1, procedures RECEIVE and EXTEND).
    #[inline(always)]
    fn receive(&mut self, size: u32) -> i32 {
        let bits = self.peek(size) as i32;
        self.consume(size);
        extend(bits, size)
    }

    /// Reads the difference of a DC coefficient to that of the block before (T.81, F.2.2.1); `None` for no code.
    #[inline(always)]
    pub(super) fn decode_dc(&mut self, table: &DcTable) -> Option<i32> {
        if self.filled < 32 {
            self.refill();
        }
        let entry = table.0.entry(self.peek(LOOKUP_BITS));
        let (length, symbol) =
            if entry & 0xff != 0 { (entry & 0xff, entry >> 8) } else { table.0.decode_long(self.buffer)? };
        self.consume(length);
        Some(if symbol == 0 { 0 } else { self.receive(symbol) })
    }

    /// Reads the AC coefficients of a block that are not zero into `out` and returns their number (T.81, F.2.2.2);
    /// without `STORE` it only counts them. `None` for no code, or a coefficient beyond the 63rd.
    #[inline(always)]
    pub(super) fn decode_ac<const STORE: bool>(
        &mut self,
        table: &AcTable,
        out: &mut [AcCoefficient; 64],
    ) -> Option<usize> {
        let (mut index, mut count) = (1, 0);
        while index < 64 {
            if self.filled < 32 {
                self.refill();
            }
            let entry = table.entry(self.peek(LOOKUP_BITS));
            let mut value = (entry as i32) >> 16;
            if value != 0 {
                index += (entry >> 8 & 15) as usize;
                self.consume(entry & 0xff);
            } else {
                let is_short = entry & 0xff != 0;
                let (length, symbol) = if is_short {
                    (entry & 0xff, entry >> 8)
                } else {
                    table.codes.decode_long(self.buffer)?
                };
                self.consume(length);
                let (run, size) = ((symbol >> 4) as usize, symbol & 15);
                match (run, size) {
                    // End of block (EOB): the rest is zero.
                    (0, 0) => return Some(count),
                    // Sixteen zeros (ZRL).
                    (15, 0) => {
                        index += 16;
                        continue;
                    }
                    (_, 1..=10) => {
                        index += run;
                        value = self.receive(size);
                    }
                    // Baseline has no coefficient of more than 10 bits (T.81, table F.2).
                    _ => return None,
                }
            }
            if index > 63 {
                return None;
            }
            if STORE {
                out[count % 64] = AcCoefficient::new(index, value as i16);
            }
            count += 1;
            index += 1;
        }
        (index == 64).then_some(count)
    }

    /// Reads a run of zeros and the size of the value behind it; `None` for no code.
    pub(super) fn decode_run(&mut self, table: &AcTable) -> Option<(u32, u32)> {
        if self.filled < 32 {
            self.refill();
        }
        let entry = table.codes.entry(self.peek(LOOKUP_BITS));
        let (length, symbol) = if entry & 0xff != 0 {
            (entry & 0xff, entry >> 8)
        } else {
            table.codes.decode_long(self.buffer)?
        };
        self.consume(length);
        Some((symbol >> 4, symbol & 15))
    }

    /// Reads a signed value of 1 to 15 bits.
    pub(super) fn receive_value(&mut self, size: u32) -> i32 {
        if self.filled < 32 {
            self.refill();
        }
        self.receive(size)
    }

    /// Reads up to 16 bits.
    pub(super) fn bits(&mut self, count: u32) -> u32 {
        if count == 0 {
            return 0;
        }
        if self.filled < 32 {
            self.refill();
        }
        let bits = self.peek(count) as u32;
        self.consume(count);
        bits
    }

    /// Reads the restart marker of this number, 0 to 7, before which less than a byte of data may be left.
    pub(super) fn expect_restart(&mut self, number: u8) -> Result<(), JpegError> {
        let at = self.end_of_scan()?;
        let fill = self.bytes[at..].iter().take_while(|&&byte| byte == 0xff).count();
        let position = at + fill + 1;
        if self.bytes.get(position - 1) != Some(&(0xd0 + number)) {
            return Err(JpegError::Damaged("a restart marker is missing"));
        }
        *self = Self::new(self.bytes, position);
        Ok(())
    }

    /// Checks that the data end here, and returns the position of the marker that follows.
    ///
    /// Some cameras fill up with zeros or ones; any other byte that is left shows that codes were lost.
    pub(super) fn end_of_scan(&mut self) -> Result<usize, JpegError> {
        *self = self.refilled_bytewise();
        let Some(left) = self.filled.checked_sub(self.padding) else {
            return Err(JpegError::Damaged("the data end before the last block"));
        };
        let excess = JpegError::Damaged("data are left behind the last block");
        // Whole bytes that were read ahead, after the bits that fill up the last one.
        let ahead = (self.buffer << (left % 8)).to_be_bytes();
        if !ahead[..(left / 8) as usize].iter().all(|byte| matches!(byte, 0 | 0xff)) {
            return Err(excess);
        }
        loop {
            match self.bytes.get(self.position..) {
                Some([0xff, 0, ..]) => self.position += 2,
                Some([0xff, _, ..]) => return Ok(self.position),
                Some([0, ..]) => self.position += 1,
                Some([_, _, ..]) => return Err(excess),
                _ => return Err(JpegError::Damaged("no end marker")),
            }
        }
    }
}
