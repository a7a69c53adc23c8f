//! Huffman codes, read from the bytes of a scan (T.81, F.2.2).
//!
//! The one idea: most codes are short and so are the bits of their values, so one look at the next few bits in a table
//! tells run, value and length at once.

use super::Frequency;

/// Bits that are looked up at once.
const LOOK: u32 = 11;

/// The bits of a scan, from the first to its last marker.
///
/// A value that is copied in and out of what is seldom called, so that it stays in registers.
#[derive(Clone, Copy)]
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    /// The next byte.
    at: usize,
    /// The next bits, the first one highest. Those beyond `left` are either those that follow or zero.
    window: u64,
    /// Bits of the window that are taken in, those made up after the end included.
    left: u32,
    /// Bits that were made up.
    made_up: u32,
}

impl<'a> Bits<'a> {
    pub(super) const fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, window: 0, left: 0, made_up: 0 }
    }

    /// The next byte's place, once a marker has been read.
    pub(super) const fn place(&self) -> usize {
        self.at
    }

    /// Takes in bits until there are more than 56.
    #[inline(always)]
    fn refill(&mut self) {
        if let Some(chunk) = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<8>()) {
            let word = u64::from_be_bytes(*chunk);
            let has_ff = (!word).wrapping_sub(0x0101_0101_0101_0101) & word & 0x8080_8080_8080_8080 != 0;
            if !has_ff {
                self.window |= word >> self.left;
                let taken = (63 - self.left) / 8;
                self.at += taken as usize;
                self.left += 8 * taken;
                return;
            }
        }
        *self = self.refilled_by_bytes();
    }

    /// The same where a byte may be stuffed, or where a marker ends the scan: zeros stand for what is missing.
    #[cold]
    #[inline(never)]
    fn refilled_by_bytes(mut self) -> Self {
        while self.left <= 56 {
            let byte = match self.bytes.get(self.at..) {
                Some([0xff, 0, ..]) => {
                    self.at += 2;
                    0xff
                }
                Some([0xff, ..] | []) | None => {
                    self.made_up += 8;
                    0
                }
                Some([byte, ..]) => {
                    self.at += 1;
                    *byte
                }
            };
            self.window |= u64::from(byte) << (56 - self.left);
            self.left += 8;
        }
        self
    }

    #[inline(always)]
    const fn peek(&self, count: u32) -> usize {
        (self.window >> (64 - count)) as usize
    }

    #[inline(always)]
    const fn drop(&mut self, count: u32) {
        self.window <<= count;
        self.left -= count;
    }

    /// The value of `size` bits, 1 to 15, the upper half of which is positive (T.81, F.2.2.1).
    #[inline(always)]
    fn value(&mut self, size: u32) -> i32 {
        let bits = self.peek(size) as i32;
        self.drop(size);
        extended(bits, size)
    }

    /// The difference of a block's mean to the one before; `None` where there is no code.
    #[inline(always)]
    pub(super) fn dc(&mut self, table: &DcTable) -> Option<i32> {
        if self.left < 32 {
            self.refill();
        }
        let entry = table.0.look[self.peek(LOOK)];
        let (length, symbol) =
            if entry & 0xff != 0 { (entry & 0xff, entry >> 8) } else { table.0.find(self.window)? };
        self.drop(length);
        Some(if symbol == 0 { 0 } else { self.value(symbol) })
    }

    /// Writes down the frequencies of a block but for the mean, and how many they are; `None` where there is no code or one
    /// too many.
    #[inline(always)]
    pub(super) fn ac<const KEEP: bool>(
        &mut self,
        table: &AcTable,
        room: &mut [Frequency; 64],
    ) -> Option<usize> {
        let (mut place, mut count) = (1, 0);
        while place < 64 {
            if self.left < 32 {
                self.refill();
            }
            let entry = table.look[self.peek(LOOK)];
            let mut value = (entry as i32) >> 16;
            if value != 0 {
                place += (entry >> 8 & 15) as usize;
                self.drop(entry & 0xff);
            } else {
                let is_short = entry & 0xff != 0;
                let (length, symbol) =
                    if is_short { (entry & 0xff, entry >> 8) } else { table.codes.find(self.window)? };
                self.drop(length);
                let (run, size) = ((symbol >> 4) as usize, symbol & 15);
                match (run, size) {
                    (0, 0) => return Some(count),
                    (15, 0) => {
                        place += 16;
                        continue;
                    }
                    (_, 1..=10) => {
                        place += run;
                        value = self.value(size);
                    }
                    _ => return None,
                }
            }
            if place > 63 {
                return None;
            }
            if KEEP {
                room[count % 64] = Frequency::new(place, value as i16);
            }
            count += 1;
            place += 1;
        }
        (place == 64).then_some(count)
    }

    /// Reads the marker that comes next, once fewer bits than a byte are left before it.
    pub(super) fn marker(&mut self, kind: u8) -> Option<()> {
        *self = self.refilled_by_bytes();
        let is_next = self.bytes.get(self.at..self.at + 2) == Some(&[0xff, kind]);
        let is_spent = self.left >= self.made_up && self.left - self.made_up < 8;
        *self = Self::new(self.bytes, self.at + 2);
        (is_next && is_spent).then_some(())
    }
}

#[inline]
const fn extended(bits: i32, size: u32) -> i32 {
    if bits >> (size - 1) == 0 { bits - (1 << size) + 1 } else { bits }
}

/// Codes of up to 16 bits and their symbols.
#[derive(Clone, Debug)]
struct Codes {
    /// For the next bits the length of their code, and 8 bits up its symbol; 0 where it is longer.
    look: Box<[u32; 1 << LOOK]>,
    /// For each length the first code beyond those of it, 16 bits wide, and what to add to a code for its symbol's place.
    beyond: [u32; 17],
    shift: [i32; 17],
    symbols: Vec<u8>,
}

impl Codes {
    /// `None` where there are more codes of a length than can be, or one is all ones.
    fn new(lengths: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        let mut look = Box::new([0; 1 << LOOK]);
        let (mut beyond, mut shift) = ([0; 17], [0; 17]);
        let (mut code, mut place) = (0_u32, 0_usize);
        for (length, &count) in (1..=16_u32).zip(lengths) {
            shift[length as usize] = place as i32 - code as i32;
            for _ in 0..count {
                if length <= LOOK {
                    let free = LOOK - length;
                    let entry = length | u32::from(*symbols.get(place)?) << 8;
                    look.get_mut((code << free) as usize..((code + 1) << free) as usize)?.fill(entry);
                }
                code += 1;
                place += 1;
            }
            if code >= 1 << length {
                return None;
            }
            beyond[length as usize] = code << (16 - length);
            code <<= 1;
        }
        Some(Self { look, beyond, shift, symbols: symbols.to_vec() })
    }

    /// Length and symbol of a code that is longer than what is looked up; `None` where there is none.
    #[cold]
    fn find(&self, window: u64) -> Option<(u32, u32)> {
        let next = (window >> 48) as u32;
        let length = (LOOK + 1..=16).find(|&length| next < self.beyond[length as usize])?;
        let place = (next >> (16 - length)) as i32 + self.shift[length as usize];
        Some((length, u32::from(*self.symbols.get(place as usize)?)))
    }
}

/// The codes of means.
#[derive(Clone, Debug)]
pub(super) struct DcTable(Codes);

impl DcTable {
    /// `None` where a symbol is none.
    pub(super) fn new(lengths: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        symbols.iter().all(|&symbol| symbol <= 11).then_some(())?;
        Some(Self(Codes::new(lengths, symbols)?))
    }
}

/// The codes of frequencies.
#[derive(Clone, Debug)]
pub(super) struct AcTable {
    codes: Codes,
    /// For the next bits, where they hold a code and its value: the length of both, 8 bits up the run before it, 16 bits up
    /// the value. Elsewhere the value is 0 and the rest as in `codes`.
    look: Box<[u32; 1 << LOOK]>,
}

impl AcTable {
    pub(super) fn new(lengths: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        let codes = Codes::new(lengths, symbols)?;
        let mut look = codes.look.clone();
        for (bits, entry) in look.iter_mut().enumerate() {
            let (length, run, size) = (*entry & 0xff, *entry >> 12, *entry >> 8 & 15);
            if length > 0 && size > 0 && length + size <= LOOK {
                let value = bits as u32 >> (LOOK - length - size) & ((1 << size) - 1);
                let value = extended(value as i32, size);
                *entry = (length + size) | run << 8 | (value as u32) << 16;
            }
        }
        Some(Self { codes, look })
    }
}
