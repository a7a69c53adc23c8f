//! Files that are no photograph here, by their first bytes, and what converts them.

/// What a file is and how to make photographs of it; `None` for unknown bytes.
pub(super) fn kind_and_advice(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    /// ImageMagick, with the plug-ins that its packages bring.
    const CONVERT: &str = "`magick FILE FILE.jpg` converts it (ImageMagick)";
    const RAW: &str = "`darktable-cli FILE FILE.jpg` converts it";
    const FILM: &str = "give it the ending of a film, such as .mp4, and it is read picture by picture";
    let brand = || bytes.get(8..12).unwrap_or_default();
    Some(match bytes {
        // ISO base media files (ISO/IEC 14496-12): the brand names what is in them.
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => match brand() {
            b"avif" | b"avis" => ("an AVIF picture", CONVERT),
            b"heic" | b"heix" | b"heim" | b"heis" | b"hevc" | b"mif1" | b"msf1" => {
                ("a HEIC picture", CONVERT)
            }
            b"crx " => ("a raw picture (CR3)", RAW),
            _ => ("a film", FILM),
        },
        [b'R', b'I', b'F', b'F', ..] if brand() == b"WEBP" => ("a WebP picture", CONVERT),
        [b'R', b'I', b'F', b'F', ..] if brand() == b"AVI " => ("a film", FILM),
        [0x1a, 0x45, 0xdf, 0xa3, ..] => ("a film", FILM),
        [b'G', b'I', b'F', b'8', ..] => ("a GIF picture", CONVERT),
        [b'B', b'M', _, _, _, _, 0, 0, 0, 0, ..] => ("a BMP picture", CONVERT),
        [0, 0, 0, 12, b'j', b'P', ..] | [0xff, 0x4f, 0xff, 0x51, ..] => ("a JPEG 2000 picture", CONVERT),
        [0, 0, 0, 12, b'J', b'X', b'L', ..] | [0xff, 0x0a, ..] => ("a JPEG XL picture", CONVERT),
        [b'F', b'U', b'J', b'I', ..] | [b'I', b'I', b'R', b'O', ..] | [b'I', b'I', b'U', 0, ..] => {
            ("a raw picture", RAW)
        }
        _ => return None,
    })
}
