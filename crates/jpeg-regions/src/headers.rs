//! Marker segments before the entropy-coded data: sizes, quantisation tables and Huffman tables (T.81, annex B).

use super::huffman::{AcTable, DcTable};
use super::{BLOCK_SIDE, MAX_PIXELS};

/// Second bytes of markers (T.81, table B.1).
mod marker {
    /// Start of image.
    pub(super) const SOI: u8 = 0xd8;
    /// Start of frame, baseline DCT.
    pub(super) const SOF0: u8 = 0xc0;
    /// Define Huffman tables.
    pub(super) const DHT: u8 = 0xc4;
    /// Start of scan.
    pub(super) const SOS: u8 = 0xda;
    /// Define quantisation tables.
    pub(super) const DQT: u8 = 0xdb;
    /// Define restart interval.
    pub(super) const DRI: u8 = 0xdd;
    /// Application data 0 to 13 and 15; 14 is Adobe's and may change the colours.
    pub(super) const APP0: u8 = 0xe0;
    pub(super) const APP1: u8 = 0xe1;
    pub(super) const APP2: u8 = 0xe2;
    pub(super) const APP13: u8 = 0xed;
    pub(super) const APP15: u8 = 0xef;
    /// Comment.
    pub(super) const COM: u8 = 0xfe;
}

/// A quantisation table by zig-zag index.
type QuantisationTable = [i32; 64];

/// What the marker segments say about the scan that follows.
pub(super) struct Headers {
    /// Columns of the picture.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// Luma blocks across and down in a minimum coded unit; a chroma component has one.
    pub(super) luma_sampling: (usize, usize),
    /// Luma alone, or luma and two chroma components.
    pub(super) components: Vec<ScanComponent>,
    /// Minimum coded units between two restart markers; 0 without markers.
    pub(super) restart_interval: usize,
    /// Position of the first byte of entropy-coded data.
    pub(super) scan_start: usize,
}

/// The tables of a component.
pub(super) struct ScanComponent {
    pub(super) quantisation: QuantisationTable,
    pub(super) dc: DcTable,
    pub(super) ac: AcTable,
}

/// Tables by their destination identifiers.
#[derive(Default)]
struct Tables {
    quantisation: [Option<QuantisationTable>; 4],
    dc: [Option<DcTable>; 4],
    ac: [Option<AcTable>; 4],
}

impl Headers {
    /// Reads the segments of a file up to its first scan; `None` for segments that do not make a plain baseline file.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        let mut tables = Tables::default();
        let mut frame: Option<&[u8]> = None;
        let mut restart_interval = 0;
        let mut position = 2;
        bytes.starts_with(&[0xff, marker::SOI]).then_some(())?;
        loop {
            let &[0xff, code, high, low] = bytes.get(position..position + 4)? else { return None };
            let length = usize::from(u16::from_be_bytes([high, low]));
            let body = bytes.get(position + 4..position + 2 + length)?;
            position += 2 + length;
            match code {
                marker::SOF0 if frame.is_none() => frame = Some(body),
                marker::DHT => tables.define_huffman(body)?,
                marker::DQT => tables.define_quantisation(body)?,
                marker::DRI => restart_interval = usize::from(u16::from_be_bytes(body.try_into().ok()?)),
                marker::SOS => return Self::of_scan(frame?, body, tables, restart_interval, position),
                // In these two, zune-jpeg reads beyond the segment: left to it.
                marker::APP0 if !body.starts_with(b"AVI1") => {}
                marker::APP1 if !body.starts_with(b"http://ns.adobe.com/xmp/extension/") => {}
                marker::APP2..=marker::APP13 | marker::APP15 | marker::COM => {}
                _ => return None,
            }
        }
    }

    /// The headers of a `scan` (T.81, B.2.3) in a `frame` (B.2.2).
    fn of_scan(
        frame: &[u8],
        scan: &[u8],
        mut tables: Tables,
        restart_interval: usize,
        scan_start: usize,
    ) -> Option<Self> {
        // Samples of 8 bits, then the number of lines, of samples in a line, and of components.
        let (&[8, y1, y0, x1, x0, count], components) = frame.split_first_chunk()? else { return None };
        let side = |high, low| usize::from(u16::from_be_bytes([high, low]));
        let (width, height, count) = (side(x1, x0), side(y1, y0), usize::from(count));
        let is_known = matches!(count, 1 | 3) && components.len() == 3 * count;
        let is_sized = width >= 2 * BLOCK_SIDE && height >= 2 * BLOCK_SIDE && width * height <= MAX_PIXELS;
        let (&scanned, selectors) = scan.split_first()?;
        // Baseline: all coefficients, 0 to 63, in one scan, without successive approximation.
        let is_whole = usize::from(scanned) == count && selectors.get(2 * count..) == Some(&[0, 63, 0]);
        if !(is_known && is_sized && is_whole) {
            return None;
        }
        let sampling = |component: &[u8]| (usize::from(component[1] >> 4), usize::from(component[1] & 15));
        let mut scan_components = Vec::with_capacity(count);
        for (index, (component, selector)) in
            components.chunks_exact(3).zip(selectors.chunks_exact(2)).enumerate()
        {
            let is_repeated = components.chunks_exact(3).take(index).any(|other| other[0] == component[0]);
            let has_usual_sampling = match (index, count) {
                (0, 3) => matches!(sampling(component), (1, 1) | (2, 1) | (2, 2)),
                _ => sampling(component) == (1, 1),
            };
            if is_repeated || !has_usual_sampling || component[0] != selector[0] {
                return None;
            }
            scan_components.push(tables.of_component(component[2], selector[1])?);
        }
        Some(Self {
            width,
            height,
            luma_sampling: sampling(components),
            components: scan_components,
            restart_interval,
            scan_start,
        })
    }

    /// Minimum coded units across and down (T.81, A.2).
    pub(super) const fn unit_counts(&self) -> (usize, usize) {
        let (across, down) = self.luma_sampling;
        (self.width.div_ceil(BLOCK_SIDE * across), self.height.div_ceil(BLOCK_SIDE * down))
    }

    /// Blocks across and down of component `index` in a minimum coded unit.
    pub(super) const fn blocks_in_unit(&self, index: usize) -> (usize, usize) {
        if index == 0 { self.luma_sampling } else { (1, 1) }
    }
}

impl Tables {
    /// Reads quantisation tables of 8-bit precision (T.81, B.2.4.1).
    fn define_quantisation(&mut self, mut body: &[u8]) -> Option<()> {
        while let Some((&destination, rest)) = body.split_first() {
            let (table, rest) = rest.split_first_chunk::<64>()?;
            *self.quantisation.get_mut(usize::from(destination))? = Some(table.map(i32::from));
            body = rest;
        }
        Some(())
    }

    /// Reads Huffman tables (T.81, B.2.4.2).
    fn define_huffman(&mut self, mut body: &[u8]) -> Option<()> {
        while let Some((&class_and_destination, rest)) = body.split_first() {
            let (code_counts, rest) = rest.split_first_chunk::<16>()?;
            let count = code_counts.iter().copied().map(usize::from).sum();
            let (symbols, rest) = rest.split_at_checked(count)?;
            let destination = usize::from(class_and_destination & 15);
            match class_and_destination >> 4 {
                0 => *self.dc.get_mut(destination)? = Some(DcTable::new(code_counts, symbols)?),
                1 => *self.ac.get_mut(destination)? = Some(AcTable::new(code_counts, symbols)?),
                _ => return None,
            }
            body = rest;
        }
        Some(())
    }

    /// The tables that a frame header (`quantisation`) and a scan header (`entropy`: DC, AC) select for a component.
    fn of_component(&mut self, quantisation: u8, entropy: u8) -> Option<ScanComponent> {
        Some(ScanComponent {
            quantisation: (*self.quantisation.get(usize::from(quantisation))?)?,
            dc: self.dc.get(usize::from(entropy >> 4))?.clone()?,
            ac: self.ac.get(usize::from(entropy & 15))?.clone()?,
        })
    }
}
