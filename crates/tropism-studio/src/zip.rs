//! Archives in the ZIP format (APPNOTE 6.3), without compression: photographs are compressed already.

use flate2::Crc;

/// What an archive holds at most: more needs ZIP64, which not every system opens.
pub(crate) const MOST_BYTES: u64 = u32::MAX as u64 - (1 << 28);

/// Files of an archive at most.
pub(crate) const MOST_FILES: usize = 65_000;

/// Writes an archive piece by piece.
#[derive(Default)]
pub(crate) struct Archive {
    written: u32,
    files: u16,
    directory: Vec<u8>,
}

/// Version 1.0 of the format; names are UTF-8 (bit 11).
const VERSION: u16 = 10;
const FLAGS: u16 = 1 << 11;

/// 1 January 1980, the first day of the format: photographs carry their own times.
const TIME: u16 = 0;
const DAY: u16 = 0x21;

impl Archive {
    /// The bytes of a file in the archive, which follow those of the file before.
    pub(crate) fn file(&mut self, name: &str, content: &[u8]) -> Vec<u8> {
        let mut crc = Crc::new();
        crc.update(content);
        // The caller keeps below the most that there may be.
        let size = u32::try_from(content.len()).unwrap_or(u32::MAX);
        let length = u16::try_from(name.len()).unwrap_or(u16::MAX);
        let mut shared = Vec::with_capacity(26);
        for value in [VERSION, FLAGS, 0, TIME, DAY] {
            shared.extend(value.to_le_bytes());
        }
        for value in [crc.sum(), size, size] {
            shared.extend(value.to_le_bytes());
        }
        // Length of the name, and of nothing more.
        shared.extend(length.to_le_bytes());
        shared.extend(0_u16.to_le_bytes());
        let bytes = [b"PK\x03\x04", &shared[..], name.as_bytes(), content].concat();

        self.directory.extend(b"PK\x01\x02");
        self.directory.extend(VERSION.to_le_bytes());
        self.directory.extend(&shared);
        // No comment, first disk, no attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(self.written.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.written += u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        self.files += 1;
        bytes
    }

    /// The directory, which ends the archive.
    pub(crate) fn end(self) -> Vec<u8> {
        let size = u32::try_from(self.directory.len()).unwrap_or(u32::MAX);
        let mut bytes = self.directory;
        bytes.extend(b"PK\x05\x06\0\0\0\0");
        bytes.extend(self.files.to_le_bytes());
        bytes.extend(self.files.to_le_bytes());
        bytes.extend(size.to_le_bytes());
        bytes.extend(self.written.to_le_bytes());
        bytes.extend([0; 2]);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_of_one_file_is_that_of_the_format() {
        let mut archive = Archive::default();
        let file = archive.file("a.txt", b"bean");
        assert_eq!(file.len(), 30 + 5 + 4);
        // CRC-32 of "bean".
        let crc = {
            let mut crc = Crc::new();
            crc.update(b"bean");
            crc.sum().to_le_bytes()
        };
        assert_eq!(file[14..18], crc);
        assert_eq!(file[18..26], [4, 0, 0, 0, 4, 0, 0, 0]);
        let end = archive.end();
        assert_eq!(end.len(), 46 + 5 + 22);
        // Begin of the directory: behind the file.
        assert_eq!(end[end.len() - 6..end.len() - 2], 39_u32.to_le_bytes());
    }
}
