//! Files of several pages: each page as a file of its own.
//!
//! A series in one file may be many times larger than memory, so only the tags are read at first.

use std::io::{Read, Seek};

use super::TiffError;
use super::directory::{ByteOrder, Directories, Directory, Entry, tag};
use crate::photo::PhotoError;

/// Bytes of a page, at most: four samples of 16 bits a pixel.
const MAX_PAGE_BYTES: u64 = 8 * crate::photo::MAX_PIXELS as u64;

/// Type numbers of values (TIFF 6.0, section 2, "Types").
const SHORT: u16 = 3;
const LONG: u16 = 4;

/// The pages of a TIFF file that are photographs: those of the size of the first one, without smaller copies.
///
/// Three grey pages that ImageJ calls the channels of one picture are one photograph, red, green and blue. Its long stacks,
/// which have one set of tags for many pictures behind each other, are read, too.
pub struct TiffPages<R> {
    directories: Directories<R>,
    /// The pictures of each photograph: one, or three channels.
    pages: Vec<Vec<Directory>>,
}

impl<R: Read + Seek> TiffPages<R> {
    /// Reads the tags of all pages.
    ///
    /// # Errors
    /// [`PhotoError::Damaged`] if they cannot be read.
    pub fn read(input: R) -> Result<Self, PhotoError> {
        let mut directories = Directories::new(input)?;
        let mut found: Vec<Directory> = Vec::new();
        while let Some(directory) = directories.read_next()? {
            let size = |directory: &Directory| [tag::WIDTH, tag::HEIGHT].map(|side| directory.number(side));
            if !directory.is_reduced() && found.first().is_none_or(|first| size(first) == size(&directory)) {
                found.push(directory);
            }
        }
        let Some(first) = found.first() else { return Err(TiffError::Damaged("no picture").into()) };
        let description = first.description();
        let imagej = |key: &str| -> Option<u64> {
            description.starts_with("ImageJ=").then_some(())?;
            description
                .lines()
                .find_map(|line| line.strip_prefix(key)?.strip_prefix('=')?.trim().parse().ok())
        };
        let (images, channels) = (imagej("images").unwrap_or(1), imagej("channels").unwrap_or(1));
        if found.len() == 1 && images > 1 {
            found = stacked(first, images);
        }
        let is_grey = found.iter().all(|page| page.number(tag::SAMPLES).unwrap_or(1) == 1);
        let together = if channels == 3 && is_grey && found.len().is_multiple_of(3) { 3 } else { 1 };
        let pages = found.chunks(together).map(<[Directory]>::to_vec).collect();
        Ok(Self { directories, pages })
    }

    /// Photographs in the file.
    #[must_use]
    pub fn count(&self) -> usize {
        self.pages.len()
    }

    /// The bytes of a file with one page alone; `None` beyond the last.
    ///
    /// # Errors
    /// [`PhotoError::Damaged`] if the file ends before the page does.
    pub fn page(&mut self, index: usize) -> Result<Option<Vec<u8>>, PhotoError> {
        let Some(channels) = self.pages.get(index) else { return Ok(None) };
        let mut page = channels[0].clone();
        // Places in the old file, and what ImageJ says of all pages together.
        for tag in [tag::EXIF, tag::GPS, tag::SUB_DIRECTORIES, tag::DESCRIPTION] {
            page.entries.remove(&tag);
        }
        let mut data = Vec::new();
        for channel in channels {
            let tags = chunk_tags(channel);
            let (offsets, lengths) = (channel.numbers(tags.0), channel.numbers(tags.1));
            if offsets.is_empty() || offsets.len() != lengths.len() {
                return Err(TiffError::Damaged("strips or tiles are missing").into());
            }
            if lengths.iter().fold(0_u64, |sum, length| sum.saturating_add(*length)) > MAX_PAGE_BYTES {
                return Err(TiffError::Damaged("a page of more bytes than a photograph can have").into());
            }
            for (offset, length) in offsets.into_iter().zip(lengths) {
                data.push(self.directories.read_at(offset, length)?);
            }
        }
        if channels.len() == 3 {
            for (tag, kind, values) in
                [(tag::SAMPLES, SHORT, &[3][..]), (tag::PHOTOMETRIC, SHORT, &[2]), (tag::PLANAR, SHORT, &[2])]
            {
                page.set(tag, kind, values);
            }
        }
        Ok(Some(write(page, &data)))
    }
}

/// The tags of where chunks stand and how long they are.
fn chunk_tags(directory: &Directory) -> (u16, u16) {
    if directory.entries.contains_key(&tag::TILE_OFFSETS) {
        (tag::TILE_OFFSETS, tag::TILE_BYTES)
    } else {
        (tag::STRIP_OFFSETS, tag::STRIP_BYTES)
    }
}

/// The pictures of a stack of ImageJ: each as long as the first, which is not packed, and right behind the one before.
fn stacked(first: &Directory, images: u64) -> Vec<Directory> {
    let (offsets, lengths) = (first.numbers(tag::STRIP_OFFSETS), first.numbers(tag::STRIP_BYTES));
    let is_plain = first.number(tag::COMPRESSION).unwrap_or(1) == 1;
    let ([start, ..], true) = (offsets.as_slice(), is_plain) else { return vec![first.clone()] };
    let number = |tag| first.number(tag).unwrap_or(1);
    let bits: u64 = first.numbers(tag::BITS).iter().sum::<u64>().max(1);
    let Some(length) = number(tag::WIDTH)
        .checked_mul(number(tag::HEIGHT))
        .and_then(|pixels| Some(pixels.checked_mul(bits)? / 8))
        .filter(|&length| length > 0 && lengths.iter().sum::<u64>() >= length)
    else {
        return vec![first.clone()];
    };
    // Chosen: more pictures than a camera takes in ten years at five minutes.
    let count = images.min(1 << 20);
    (0..count)
        .map(|index| {
            let mut picture = first.clone();
            picture.set(tag::STRIP_OFFSETS, LONG, &[start.saturating_add(index.saturating_mul(length))]);
            picture.set(tag::STRIP_BYTES, LONG, &[length]);
            picture.set(tag::ROWS_PER_STRIP, LONG, &[number(tag::HEIGHT)]);
            picture
        })
        .collect()
}

impl Directory {
    /// Gives a tag these numbers. Offsets beyond 4 GiB have the type of BigTIFF.
    fn set(&mut self, tag: u16, kind: u16, values: &[u64]) {
        let (kind, size) = match kind {
            SHORT => (SHORT, 2),
            _ if values.iter().all(|&value| u32::try_from(value).is_ok()) => (LONG, 4),
            _ => (16, 8),
        };
        let bytes = values.iter().flat_map(|&value| self.order.bytes(value, size)).collect();
        self.entries.insert(tag, Entry { kind, count: values.len() as u64, bytes });
    }
}

/// A file with one picture, whose strips or tiles are these.
fn write(mut page: Directory, chunks: &[Vec<u8>]) -> Vec<u8> {
    let order = page.order;
    let number = |value: usize, size| order.bytes(value as u64, size);
    // Header, chunks, values that do not fit into the directory, directory.
    let mut file = if order == ByteOrder::Little { b"II".to_vec() } else { b"MM".to_vec() };
    file.extend(number(42, 2));
    file.extend([0; 4]);
    let (offsets, lengths) = chunk_tags(&page);
    let mut places = Vec::with_capacity(chunks.len());
    for chunk in chunks {
        places.push(file.len() as u64);
        file.extend(chunk);
        file.resize(file.len().next_multiple_of(2), 0);
    }
    let sizes: Vec<u64> = chunks.iter().map(|chunk| chunk.len() as u64).collect();
    page.set(offsets, LONG, &places);
    page.set(lengths, LONG, &sizes);
    let mut table = number(page.entries.len(), 2);
    for (tag, entry) in &page.entries {
        table.extend(number(usize::from(*tag), 2));
        table.extend(number(usize::from(entry.kind), 2));
        table.extend(number(entry.count as usize, 4));
        if entry.bytes.len() <= 4 {
            table.extend(&entry.bytes);
            table.resize(table.len() + 4 - entry.bytes.len(), 0);
        } else {
            table.extend(number(file.len(), 4));
            file.extend(&entry.bytes);
            file.resize(file.len().next_multiple_of(2), 0);
        }
    }
    table.extend([0; 4]);
    let start = number(file.len(), 4);
    file[4..8].copy_from_slice(&start);
    file.extend(table);
    file
}
