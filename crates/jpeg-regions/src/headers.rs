//! Marker segments: sizes, quantisation tables, Huffman tables and the headers of scans (T.81, annex B).

use super::huffman::{AcTable, DcTable};
use super::standard;
use super::{BLOCK_SIDE, Colour, JpegError, MAX_PIXELS};

/// Second bytes of markers (T.81, table B.1).
mod marker {
    /// Start of image.
    pub(super) const SOI: u8 = 0xd8;
    /// End of image.
    pub(super) const EOI: u8 = 0xd9;
    /// Start of frame: baseline, to progressive DCT with Huffman codes.
    pub(super) const SOF0: u8 = 0xc0;
    pub(super) const SOF2: u8 = 0xc2;
    /// Start of frame: the first and the last of those with other processes. Two codes between them are other markers.
    pub(super) const SOF3: u8 = 0xc3;
    pub(super) const SOF15: u8 = 0xcf;
    /// Define Huffman tables.
    pub(super) const DHT: u8 = 0xc4;
    /// Define conditioning of arithmetic coding.
    pub(super) const DAC: u8 = 0xcc;
    /// Start of scan.
    pub(super) const SOS: u8 = 0xda;
    /// Define quantisation tables.
    pub(super) const DQT: u8 = 0xdb;
    /// Define restart interval.
    pub(super) const DRI: u8 = 0xdd;
    /// Application data: JFIF, and Adobe's, which tell how colours are coded.
    pub(super) const APP0: u8 = 0xe0;
    pub(super) const APP14: u8 = 0xee;
    /// Markers without a segment: temporary, and restart.
    pub(super) const TEM: u8 = 0x01;
    pub(super) const RST0: u8 = 0xd0;
    pub(super) const RST7: u8 = 0xd7;
}

/// A quantisation table by zig-zag index.
pub(super) type QuantisationTable = [i32; 64];

/// What the marker segments so far say.
#[derive(Default)]
pub(super) struct Headers {
    quantisation: [Option<QuantisationTable>; 4],
    dc: [Option<DcTable>; 4],
    ac: [Option<AcTable>; 4],
    frame: Option<Frame>,
    /// Minimum coded units between two restart markers; 0 without markers.
    restart_interval: usize,
    is_jfif: bool,
    /// Adobe's code of the colour transform.
    adobe_transform: Option<u8>,
    /// Position of the next byte.
    position: usize,
}

/// Size and components of a picture (T.81, B.2.2).
#[derive(Clone)]
pub(super) struct Frame {
    pub(super) is_progressive: bool,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) components: Vec<FrameComponent>,
    /// The largest sampling factors, across and down.
    pub(super) most_sampling: (usize, usize),
}

#[derive(Clone, Copy)]
pub(super) struct FrameComponent {
    id: u8,
    /// Blocks across and down in a minimum coded unit.
    pub(super) sampling: (usize, usize),
    table: u8,
}

/// A scan (T.81, B.2.3) and the tables that its components use.
pub(super) struct Scan {
    pub(super) components: Vec<ScanComponent>,
    /// The first and the last coefficient, by zig-zag index.
    pub(super) band: (usize, usize),
    /// Successive approximation: the bit that was sent before, or 0 in a first scan, and the bit of this scan.
    pub(super) bits: (u32, u32),
    pub(super) restart_interval: usize,
    /// Position of the first byte of entropy-coded data.
    pub(super) start: usize,
}

pub(super) struct ScanComponent {
    /// Place in [`Frame::components`].
    pub(super) index: usize,
    /// As defined when the scan begins; `None` if undefined.
    pub(super) quantisation: Option<QuantisationTable>,
    pub(super) dc: Option<DcTable>,
    pub(super) ac: Option<AcTable>,
}

impl Headers {
    /// The headers at the start of a file.
    pub(super) fn new(bytes: &[u8]) -> Result<Self, JpegError> {
        if !bytes.starts_with(&[0xff, marker::SOI]) {
            return Err(JpegError::Unsupported("no JPEG file"));
        }
        Ok(Self { position: 2, ..Self::default() })
    }

    /// Goes on at a marker behind a scan.
    pub(super) const fn resume_at(&mut self, position: usize) {
        self.position = position;
    }

    /// The frame, once a scan was found.
    pub(super) fn frame(&self) -> Result<&Frame, JpegError> {
        self.frame.as_ref().ok_or(JpegError::Damaged("a scan before any frame header"))
    }

    /// Reads the segments up to the next scan; `None` at the end of the picture.
    ///
    /// Bytes between segments are skipped, as libjpeg does: some programs write a comment longer than it says.
    pub(super) fn next_scan(&mut self, bytes: &[u8]) -> Result<Option<Scan>, JpegError> {
        loop {
            let code = self.next_marker(bytes)?;
            match code {
                marker::EOI => return Ok(None),
                marker::TEM | marker::RST0..=marker::RST7 => continue,
                marker::SOI => return Err(JpegError::Damaged("a second start of image")),
                _ => {}
            }
            let cut = JpegError::Damaged("a header is cut short");
            let length = bytes.get(self.position..).and_then(|rest| rest.first_chunk::<2>()).ok_or(cut)?;
            let length = usize::from(u16::from_be_bytes(*length));
            let body = bytes.get(self.position + 2..self.position + length).ok_or(cut)?;
            self.position += length;
            match code {
                marker::SOF0..=marker::SOF2 => self.define_frame(code == marker::SOF2, body)?,
                marker::DHT => self.define_huffman(body).ok_or(JpegError::Damaged("a Huffman table"))?,
                marker::DAC => return Err(JpegError::Unsupported("arithmetic coding")),
                marker::SOF3..=marker::SOF15 => {
                    return Err(JpegError::Unsupported("a lossless, hierarchical or arithmetic process"));
                }
                marker::DQT => {
                    self.define_quantisation(body).ok_or(JpegError::Damaged("a quantisation table"))?;
                }
                marker::DRI => {
                    let interval = body.first_chunk().ok_or(JpegError::Damaged("a restart interval"))?;
                    self.restart_interval = usize::from(u16::from_be_bytes(*interval));
                }
                marker::APP0 => self.is_jfif |= body.starts_with(b"JFIF\0"),
                marker::APP14 if body.starts_with(b"Adobe") => self.adobe_transform = body.get(11).copied(),
                marker::SOS => {
                    return self.scan(body).map(Some);
                }
                _ => {}
            }
        }
    }

    /// The code of the next marker; the position moves behind it.
    fn next_marker(&mut self, bytes: &[u8]) -> Result<u8, JpegError> {
        loop {
            let rest = bytes.get(self.position..).unwrap_or_default();
            let at = rest.iter().position(|&byte| byte == 0xff).ok_or(JpegError::Damaged("no end marker"))?;
            let fill = rest[at..].iter().take_while(|&&byte| byte == 0xff).count();
            let code = rest.get(at + fill).copied().ok_or(JpegError::Damaged("no end marker"))?;
            self.position += at + fill + 1;
            if code != 0 {
                return Ok(code);
            }
        }
    }

    fn define_frame(&mut self, is_progressive: bool, body: &[u8]) -> Result<(), JpegError> {
        if self.frame.is_some() {
            return Err(JpegError::Damaged("a second frame header"));
        }
        let damaged = JpegError::Damaged("a frame header");
        let (&[precision, y1, y0, x1, x0, count], components) = body.split_first_chunk().ok_or(damaged)?;
        if precision != 8 {
            return Err(JpegError::Unsupported("samples of other than 8 bits"));
        }
        let side = |high, low| usize::from(u16::from_be_bytes([high, low]));
        let (width, height, count) = (side(x1, x0), side(y1, y0), usize::from(count));
        if width == 0 || height == 0 {
            return Err(JpegError::Damaged("no pixels"));
        }
        if width * height > MAX_PIXELS {
            return Err(JpegError::TooLarge { width, height });
        }
        if !matches!(count, 1 | 3 | 4) {
            return Err(JpegError::Unsupported("other than 1, 3 or 4 components"));
        }
        let mut found: Vec<FrameComponent> = components
            .chunks_exact(3)
            .take(count)
            .map(|component| FrameComponent {
                id: component[0],
                sampling: (usize::from(component[1] >> 4), usize::from(component[1] & 15)),
                table: component[2],
            })
            .collect();
        let is_sampled = |component: &FrameComponent| {
            (1..=4).contains(&component.sampling.0) && (1..=4).contains(&component.sampling.1)
        };
        let is_repeated = |at: usize| found[..at].iter().any(|other| other.id == found[at].id);
        if found.len() < count || !found.iter().all(is_sampled) || (0..count).any(is_repeated) {
            return Err(damaged);
        }
        // The only component is never interleaved, so its sampling factors mean nothing (T.81, A.2.2).
        if let [only] = found.as_mut_slice() {
            only.sampling = (1, 1);
        }
        let most = |factor: fn(&FrameComponent) -> usize| found.iter().map(factor).max().unwrap_or(1);
        let most_sampling = (most(|component| component.sampling.0), most(|component| component.sampling.1));
        if found.iter().any(|FrameComponent { sampling: (across, down), .. }| {
            !most_sampling.0.is_multiple_of(*across) || !most_sampling.1.is_multiple_of(*down)
        }) {
            return Err(JpegError::Unsupported("sampling factors that do not divide each other"));
        }
        self.frame = Some(Frame { is_progressive, width, height, components: found, most_sampling });
        Ok(())
    }

    /// Reads quantisation tables (T.81, B.2.4.1).
    fn define_quantisation(&mut self, mut body: &[u8]) -> Option<()> {
        while let Some((&precision_and_destination, rest)) = body.split_first() {
            let entry = self.quantisation.get_mut(usize::from(precision_and_destination & 15))?;
            if precision_and_destination >> 4 == 0 {
                let (table, rest) = rest.split_first_chunk::<64>()?;
                *entry = Some(table.map(i32::from));
                body = rest;
            } else {
                let (table, rest) = rest.split_first_chunk::<128>()?;
                let value = |at: usize| i32::from(u16::from_be_bytes([table[2 * at], table[2 * at + 1]]));
                *entry = Some(std::array::from_fn(value));
                body = rest;
            }
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

    /// Reads the header of a scan.
    fn scan(&self, body: &[u8]) -> Result<Scan, JpegError> {
        let frame = self.frame()?;
        let damaged = JpegError::Damaged("the header of a scan");
        let (&count, rest) = body.split_first().ok_or(damaged)?;
        let count = usize::from(count);
        let (selectors, rest) = rest.split_at_checked(2 * count).ok_or(damaged)?;
        let &[first, last, bits] = rest.first_chunk().ok_or(damaged)?;
        let mut components: Vec<ScanComponent> = Vec::with_capacity(count);
        for selector in selectors.chunks_exact(2) {
            let index = frame.components.iter().position(|component| component.id == selector[0]);
            let index = index.ok_or(damaged)?;
            if components.iter().any(|other| other.index == index) {
                return Err(damaged);
            }
            let [dc, ac] = [selector[1] >> 4, selector[1] & 15].map(usize::from);
            components.push(ScanComponent {
                index,
                quantisation: self
                    .quantisation
                    .get(usize::from(frame.components[index].table))
                    .copied()
                    .flatten(),
                dc: self.dc.get(dc).cloned().flatten().or_else(|| standard::dc_table(dc)),
                ac: self.ac.get(ac).cloned().flatten().or_else(|| standard::ac_table(ac)),
            });
        }
        // Sequential scans have all coefficients, whatever the header says.
        let (band, bits) = if frame.is_progressive {
            ((usize::from(first), usize::from(last)), (u32::from(bits >> 4), u32::from(bits & 15)))
        } else {
            ((0, 63), (0, 0))
        };
        let is_banded = match band {
            (0, 0) => true,
            (0, 63) => !frame.is_progressive,
            (first, last) => 1 <= first && first <= last && last <= 63 && count == 1,
        };
        if components.is_empty() || !is_banded || bits.1 > 13 || (bits.0 > 0 && bits.0 != bits.1 + 1) {
            return Err(damaged);
        }
        Ok(Scan { components, band, bits, restart_interval: self.restart_interval, start: self.position })
    }

    /// How colours are coded, by the rules of libjpeg (`default_decompress_parms`).
    pub(super) fn colour(&self) -> Result<Colour, JpegError> {
        let components = &self.frame()?.components;
        Ok(match (components.len(), self.adobe_transform) {
            (1, _) => Colour::Grey,
            (4, Some(2)) => Colour::Ycck,
            (4, _) => Colour::Cmyk,
            _ if self.is_jfif => Colour::YCbCr,
            (_, Some(0)) => Colour::Rgb,
            (_, Some(_)) => Colour::YCbCr,
            (_, None) if components.iter().map(|component| component.id).eq(*b"RGB") => Colour::Rgb,
            _ => Colour::YCbCr,
        })
    }
}

impl Frame {
    /// Minimum coded units across and down (T.81, A.2).
    pub(super) const fn unit_counts(&self) -> (usize, usize) {
        let (across, down) = self.most_sampling;
        (self.width.div_ceil(BLOCK_SIDE * across), self.height.div_ceil(BLOCK_SIDE * down))
    }

    /// Columns and rows of the samples of a component (T.81, A.1.1).
    pub(super) fn samples(&self, index: usize) -> (usize, usize) {
        let ((across, down), (most_across, most_down)) =
            (self.components[index].sampling, self.most_sampling);
        ((self.width * across).div_ceil(most_across), (self.height * down).div_ceil(most_down))
    }

    /// Columns and rows of the blocks of a component, with those beyond the picture's edge that complete the last unit.
    pub(super) fn blocks(&self, index: usize) -> (usize, usize) {
        let ((columns, rows), (across, down)) = (self.unit_counts(), self.components[index].sampling);
        (columns * across, rows * down)
    }
}
