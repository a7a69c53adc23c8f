//! Huffman tables and their look-up forms (T.81, annex C and F.2.2.3).

/// Bits of a code that are looked up at once. A table of 2048 entries has 8 KiB and stays in the processor's nearest
/// cache.
pub(super) const LOOKUP_BITS: u32 = 11;

/// Codes of up to 16 bits and their symbols.
#[derive(Clone, Debug)]
pub(super) struct HuffmanTable {
    /// For the next [`LOOKUP_BITS`] bits: the length of their code and, 8 bits up, its symbol; 0 for a longer code.
    lookup: Box<[u32; 1 << LOOKUP_BITS]>,
    /// For each length, the first code beyond those of that length, left-aligned to 16 bits (T.81: MAXCODE + 1).
    code_limits: [u32; 17],
    /// For each length, what to add to a code for the place of its symbol (T.81: VALPTR - MINCODE).
    symbol_offsets: [i32; 17],
    /// The symbols in the order of their codes (T.81: HUFFVAL).
    symbols: Vec<u8>,
}

impl HuffmanTable {
    /// The table with so many codes of 1 to 16 bits (T.81: BITS) for `symbols`.
    ///
    /// `None` for more codes of a length than there can be, and for a code of ones alone (T.81, C.2).
    fn new(code_counts: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        let mut lookup = Box::new([0; 1 << LOOKUP_BITS]);
        let (mut code_limits, mut symbol_offsets) = ([0; 17], [0; 17]);
        let (mut code, mut place) = (0_u32, 0_usize);
        for (length, &count) in (1..=16_u32).zip(code_counts) {
            symbol_offsets[length as usize] = place as i32 - code as i32;
            for _ in 0..count {
                if length <= LOOKUP_BITS {
                    let free = LOOKUP_BITS - length;
                    let entry = length | u32::from(*symbols.get(place)?) << 8;
                    lookup.get_mut((code << free) as usize..((code + 1) << free) as usize)?.fill(entry);
                }
                code += 1;
                place += 1;
            }
            if code >= 1 << length {
                return None;
            }
            code_limits[length as usize] = code << (16 - length);
            code <<= 1;
        }
        Some(Self { lookup, code_limits, symbol_offsets, symbols: symbols.to_vec() })
    }

    /// The look-up entry of the next [`LOOKUP_BITS`] bits.
    #[inline(always)]
    pub(super) fn entry(&self, next_bits: usize) -> u32 {
        self.lookup[next_bits]
    }

    /// Length and symbol of a code of more than [`LOOKUP_BITS`] bits at the top of `buffer`; `None` for no code.
    #[cold]
    pub(super) fn decode_long(&self, buffer: u64) -> Option<(u32, u32)> {
        let next = (buffer >> 48) as u32;
        let length = (LOOKUP_BITS + 1..=16).find(|&length| next < self.code_limits[length as usize])?;
        let place = (next >> (16 - length)) as i32 + self.symbol_offsets[length as usize];
        Some((length, u32::from(*self.symbols.get(place as usize)?)))
    }
}

/// The codes of DC differences. A symbol is the size of the difference in bits.
#[derive(Clone, Debug)]
pub(super) struct DcTable(pub(super) HuffmanTable);

impl DcTable {
    /// `None` for no table, or a size beyond 15 bits, the most that the lossless process has (T.81, table H.2); 8-bit samples
    /// need 11 (table F.1), and some encoders define more than they use.
    pub(super) fn new(code_counts: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        symbols.iter().all(|&symbol| symbol <= 15).then_some(())?;
        Some(Self(HuffmanTable::new(code_counts, symbols)?))
    }
}

/// The codes of AC coefficients. A symbol holds the run of zeros before the coefficient (upper four bits) and its
/// size.
#[derive(Clone, Debug)]
pub(super) struct AcTable {
    pub(super) codes: HuffmanTable,
    /// For the next [`LOOKUP_BITS`] bits, where they hold a code and its value: the length of both, 8 bits up the
    /// run, 16 bits up the value. Elsewhere the value is 0 and the rest is as in `codes`.
    lookup: Box<[u32; 1 << LOOKUP_BITS]>,
}

impl AcTable {
    /// `None` for no table.
    pub(super) fn new(code_counts: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        let codes = HuffmanTable::new(code_counts, symbols)?;
        let mut lookup = codes.lookup.clone();
        for (bits, entry) in lookup.iter_mut().enumerate() {
            let (length, run, size) = (*entry & 0xff, *entry >> 12, *entry >> 8 & 15);
            if length > 0 && size > 0 && length + size <= LOOKUP_BITS {
                let value = bits as u32 >> (LOOKUP_BITS - length - size) & ((1 << size) - 1);
                let value = extend(value as i32, size);
                *entry = (length + size) | run << 8 | (value as u32) << 16;
            }
        }
        Some(Self { codes, lookup })
    }

    /// The look-up entry of the next [`LOOKUP_BITS`] bits.
    #[inline(always)]
    pub(super) fn entry(&self, next_bits: usize) -> u32 {
        self.lookup[next_bits]
    }
}

/// The signed value that `size` bits stand for: the upper half is positive (T.81, F.2.2.1, procedure EXTEND).
#[inline]
pub(super) const fn extend(bits: i32, size: u32) -> i32 {
    if bits >> (size - 1) == 0 { bits - (1 << size) + 1 } else { bits }
}
