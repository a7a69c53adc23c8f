//! Check that bytes are a complete photograph.

use tropism::photo::Photo;

/// Checks that `bytes` are a complete JPEG or PNG.
///
/// # Errors
/// What was found; of a foreign file its first 40 characters, because some cameras answer with an HTML page.
pub(crate) fn check(bytes: &[u8]) -> Result<(), String> {
    let photo = Photo { name: String::new(), bytes: bytes.to_vec(), time_s: 0.0 };
    match photo.decode() {
        Ok(_) => Ok(()),
        Err(tropism::photo::PhotoError::UnknownFormat(_)) => {
            let start: String = String::from_utf8_lossy(bytes)
                .chars()
                .take(40)
                .map(|letter| if letter.is_control() { ' ' } else { letter })
                .collect();
            Err(format!("found {start:?}, wanted a JPEG, PNG or TIFF picture"))
        }
        Err(error) => Err(error.to_string()),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use tropism::photo::Image;

    use super::*;

    /// A photograph that differs with `seed`.
    pub(crate) fn jpeg(seed: usize) -> Vec<u8> {
        let rgb = (0..3 * 32 * 24).map(|i| ((i * (seed + 1)) % 251) as u8).collect();
        Image { width: 32, height: 24, rgb }.to_jpeg(90).unwrap()
    }

    #[test]
    fn pages_and_halves_are_no_photographs() {
        assert_eq!(check(&jpeg(1)), Ok(()));
        assert!(check(&jpeg(1)[..200]).unwrap_err().contains("damaged"));
        assert!(check(b"<!DOCTYPE html>\n<h1>").unwrap_err().contains("<!DOCTYPE html> <h1>"));
        assert!(check(b"").unwrap_err().contains("empty"));
    }
}
