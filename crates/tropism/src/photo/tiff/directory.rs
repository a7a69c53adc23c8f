//! Directories of TIFF files: the tags of each picture (TIFF 6.0, section 2; BigTIFF with its wider offsets).

use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};

use super::TiffError;

/// Bytes of one tag's values, at most. Chosen: the offsets of a million strips take less.
const MAX_VALUE_BYTES: u64 = 16 << 20;

/// Numbers of the tags that are read (TIFF 6.0, appendix A).
pub(super) mod tag {
    pub(in crate::photo::tiff) const NEW_SUBFILE_TYPE: u16 = 254;
    pub(in crate::photo::tiff) const WIDTH: u16 = 256;
    pub(in crate::photo::tiff) const HEIGHT: u16 = 257;
    pub(in crate::photo::tiff) const BITS: u16 = 258;
    pub(in crate::photo::tiff) const COMPRESSION: u16 = 259;
    pub(in crate::photo::tiff) const PHOTOMETRIC: u16 = 262;
    pub(in crate::photo::tiff) const DESCRIPTION: u16 = 270;
    pub(in crate::photo::tiff) const STRIP_OFFSETS: u16 = 273;
    pub(in crate::photo::tiff) const SAMPLES: u16 = 277;
    pub(in crate::photo::tiff) const ROWS_PER_STRIP: u16 = 278;
    pub(in crate::photo::tiff) const STRIP_BYTES: u16 = 279;
    pub(in crate::photo::tiff) const PLANAR: u16 = 284;
    pub(in crate::photo::tiff) const PREDICTOR: u16 = 317;
    pub(in crate::photo::tiff) const COLOUR_MAP: u16 = 320;
    pub(in crate::photo::tiff) const TILE_WIDTH: u16 = 322;
    pub(in crate::photo::tiff) const TILE_HEIGHT: u16 = 323;
    pub(in crate::photo::tiff) const TILE_OFFSETS: u16 = 324;
    pub(in crate::photo::tiff) const TILE_BYTES: u16 = 325;
    pub(in crate::photo::tiff) const SUB_DIRECTORIES: u16 = 330;
    pub(in crate::photo::tiff) const SAMPLE_FORMAT: u16 = 339;
    pub(in crate::photo::tiff) const JPEG_TABLES: u16 = 347;
    pub(in crate::photo::tiff) const YCBCR_SUBSAMPLING: u16 = 530;
    pub(in crate::photo::tiff) const EXIF: u16 = 34_665;
    pub(in crate::photo::tiff) const GPS: u16 = 34_853;
}

/// The order of bytes in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// The number that up to eight bytes are.
    pub(super) fn number(self, bytes: &[u8]) -> u64 {
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        match self {
            Self::Big => bytes.iter().fold(0, add),
            Self::Little => bytes.iter().rev().fold(0, add),
        }
    }

    /// The lowest `count` bytes of a number.
    pub(super) fn bytes(self, number: u64, count: usize) -> Vec<u8> {
        let mut bytes = number.to_le_bytes()[..count].to_vec();
        if self == Self::Big {
            bytes.reverse();
        }
        bytes
    }
}

/// A tag's values.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Number of the values' type (TIFF 6.0, section 2, "Types").
    pub(super) kind: u16,
    pub(super) count: u64,
    /// The values in the file's order of bytes.
    pub(super) bytes: Vec<u8>,
}

/// Bytes of one value of a type.
const fn size_of_kind(kind: u16) -> Option<u64> {
    Some(match kind {
        1 | 2 | 6 | 7 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16..=18 => 8,
        _ => return None,
    })
}

/// The tags of one picture.
#[derive(Clone, Debug)]
pub(super) struct Directory {
    pub(super) order: ByteOrder,
    pub(super) entries: BTreeMap<u16, Entry>,
}

impl Directory {
    /// All numbers of a tag; empty without it.
    pub(super) fn numbers(&self, tag: u16) -> Vec<u64> {
        let Some(entry) = self.entries.get(&tag) else { return Vec::new() };
        let Some(size @ (1 | 2 | 4 | 8)) = size_of_kind(entry.kind) else { return Vec::new() };
        entry.bytes.chunks_exact(size as usize).map(|value| self.order.number(value)).collect()
    }

    /// The first number of a tag.
    pub(super) fn number(&self, tag: u16) -> Option<u64> {
        self.numbers(tag).first().copied()
    }

    /// Whether this is a smaller copy of another picture in the file.
    pub(super) fn is_reduced(&self) -> bool {
        self.number(tag::NEW_SUBFILE_TYPE).is_some_and(|kind| kind & 1 == 1)
    }

    /// The text of the description.
    pub(super) fn description(&self) -> String {
        let bytes = self.entries.get(&tag::DESCRIPTION).map_or(&[][..], |entry| &entry.bytes);
        String::from_utf8_lossy(bytes).into_owned()
    }
}

/// Reads the directories of a file one after the other.
pub(super) struct Directories<R> {
    input: R,
    order: ByteOrder,
    is_big: bool,
    /// Where the next directory stands; 0 behind the last.
    next: u64,
    /// Where those before stood.
    seen: Vec<u64>,
}

impl<R: Read + Seek> Directories<R> {
    /// Reads the header of a file.
    pub(super) fn new(mut input: R) -> Result<Self, TiffError> {
        input.seek(SeekFrom::Start(0))?;
        let mut start = [0; 8];
        input.read_exact(&mut start)?;
        let order = if start[0] == b'I' { ByteOrder::Little } else { ByteOrder::Big };
        let is_big = order.number(&start[2..4]) == 43;
        let mut next = order.number(&start[4..8]);
        if is_big {
            let mut offset = [0; 8];
            input.read_exact(&mut offset)?;
            next = order.number(&offset);
        }
        Ok(Self { input, order, is_big, next, seen: Vec::new() })
    }

    /// The next directory; `None` behind the last.
    pub(super) fn read_next(&mut self) -> Result<Option<Directory>, TiffError> {
        if self.next == 0 {
            return Ok(None);
        }
        if self.seen.contains(&self.next) {
            return Err(TiffError::Damaged("its directories lead in a circle"));
        }
        self.seen.push(self.next);
        self.input.seek(SeekFrom::Start(self.next))?;
        let wide = if self.is_big { 8 } else { 4 };
        let count = self.read_number(if self.is_big { 8 } else { 2 })?;
        let size = 4 + 2 * wide as u64;
        if count > u64::from(u16::MAX) {
            return Err(TiffError::Damaged("too many tags"));
        }
        let mut table = vec![0; (count * size) as usize];
        self.input.read_exact(&mut table)?;
        self.next = self.read_number(wide)?;
        let mut entries = BTreeMap::new();
        for row in table.chunks_exact(size as usize) {
            let [tag, kind] = [&row[..2], &row[2..4]].map(|value| self.order.number(value) as u16);
            let count = self.order.number(&row[4..4 + wide]);
            let Some(length) = size_of_kind(kind).and_then(|size| size.checked_mul(count)) else { continue };
            let place = &row[4 + wide..];
            let bytes = if length <= wide as u64 {
                place[..length as usize].to_vec()
            } else if length > MAX_VALUE_BYTES {
                return Err(TiffError::Damaged("a tag of more than 16 MiB"));
            } else {
                self.read_at(self.order.number(place), length)?
            };
            entries.insert(tag, Entry { kind, count, bytes });
        }
        Ok(Some(Directory { order: self.order, entries }))
    }

    /// So many bytes from an offset.
    pub(super) fn read_at(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, TiffError> {
        self.input.seek(SeekFrom::Start(offset))?;
        let mut bytes = Vec::new();
        (&mut self.input).take(length).read_to_end(&mut bytes)?;
        if bytes.len() as u64 == length {
            Ok(bytes)
        } else {
            Err(TiffError::Damaged("the file ends too early"))
        }
    }

    fn read_number(&mut self, size: usize) -> Result<u64, TiffError> {
        let mut bytes = [0; 8];
        self.input.read_exact(&mut bytes[..size])?;
        Ok(self.order.number(&bytes[..size]))
    }
}
