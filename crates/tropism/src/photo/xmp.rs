//! The orientation in an XMP packet, where editing programs write it (ISO 16684-1; Exif has the same numbers).

use super::Orientation;

/// What an XMP packet begins with in a JPEG file, in an APP1 segment.
const JPEG_NAMESPACE: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// What it begins with in a PNG file: keyword, no compression, and an empty language and translation.
const PNG_KEYWORD: &[u8] = b"XML:com.adobe.xmp\0\0\0\0\0";

/// The orientation that the XMP packet of a JPEG or PNG file says; upright without one.
pub(super) fn orientation(bytes: &[u8]) -> Orientation {
    let packet = match bytes {
        [0xff, 0xd8, ..] => jpeg_packet(bytes),
        [0x89, b'P', b'N', b'G', ..] => png_packet(bytes),
        _ => None,
    };
    packet.and_then(number_in).map_or_else(Orientation::default, Orientation)
}

fn jpeg_packet(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.get(2..)?;
    loop {
        let &[0xff, code, high, low, ..] = rest else { return None };
        // Start of scan: no header follows.
        if code == 0xda {
            return None;
        }
        let length = usize::from(u16::from_be_bytes([high, low]));
        let body = rest.get(4..2 + length)?;
        if let (0xe1, Some(packet)) = (code, body.strip_prefix(JPEG_NAMESPACE)) {
            return Some(packet);
        }
        rest = &rest[2 + length..];
    }
}

fn png_packet(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.get(8..)?;
    loop {
        let (length, after) = rest.split_first_chunk()?;
        let (kind, after) = after.split_first_chunk::<4>()?;
        let (data, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        if let (b"iTXt", Some(packet)) = (kind, data.strip_prefix(PNG_KEYWORD)) {
            return Some(packet);
        }
        rest = after.get(4..)?;
    }
}

/// The digit behind `tiff:Orientation`, an attribute or an element.
fn number_in(packet: &[u8]) -> Option<u8> {
    let name = b"tiff:Orientation";
    let mut places = packet.windows(name.len()).enumerate().filter(|(_, window)| window == name);
    places.find_map(|(at, _)| {
        let value = match &packet[at + name.len()..] {
            [b'=', b'"' | b'\'', value, ..] | [b'>', value, ..] => value,
            _ => return None,
        };
        (b'1'..=b'8').contains(value).then(|| value - b'0')
    })
}
