//! The page of `tropism track --guide`: photographs on which a user clicks base, scale and region.
//!
//! In: photographs as JPEG, and what is known of scale and plants. Out: one HTML page that needs no other file.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Serialize, Serializer};
use tropism::geometry::{Pixel, Region};

/// The page, with a placeholder for its content. Its first line marks a file as a guide.
const PAGE: &str = include_str!("guide.html");

/// The content of a guide.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GuidePage {
    /// Files and folders of the photographs, for the command.
    #[serde(rename = "photographs")]
    pub paths: Vec<String>,
    /// Columns of a photograph.
    pub width: usize,
    /// Rows of a photograph.
    pub height: usize,
    /// The plants whose place is known.
    pub plants: Vec<GuidePlant>,
    /// The scale, if it is known.
    pub px_per_cm: Option<f64>,
    /// The photographs on the page.
    #[serde(rename = "shown")]
    pub photographs: Vec<GuidePhotograph>,
}

/// A plant whose place is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GuidePlant {
    /// Where the stem leaves the soil.
    pub base: Pixel,
    /// Its region of interest; `None` is the whole picture.
    pub region: Option<Region>,
}

/// A photograph on the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GuidePhotograph {
    /// Its name.
    pub name: String,
    /// Pixels of the photograph for one of the page's picture.
    pub factor: usize,
    /// Columns of the page's picture.
    pub columns: usize,
    /// Rows of the page's picture.
    pub rows: usize,
    /// The page's picture.
    #[serde(rename = "data", serialize_with = "as_base64")]
    pub jpeg: Vec<u8>,
}

impl GuidePage {
    /// The page as HTML.
    #[must_use]
    pub fn to_html(&self) -> String {
        let content = serde_json::to_string(self).expect("strings and numbers are JSON");
        // A name with `</script>` would end the page's script: `<` is escaped.
        PAGE.replacen("/*CONTENT*/", &content.replace('<', "\\u003c"), 1)
    }
}

fn as_base64<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&STANDARD.encode(bytes))
}

/// Whether a text is a guide.
#[must_use]
pub fn is_guide(text: &str) -> bool {
    text.lines().next() == PAGE.lines().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_its_content_and_is_known_again() {
        let photograph = GuidePhotograph {
            name: "</script>.jpg".to_owned(),
            factor: 2,
            columns: 3,
            rows: 4,
            jpeg: vec![0xff, 0xd8, 0xff],
        };
        let page = GuidePage {
            paths: vec!["photos".to_owned()],
            width: 6,
            height: 8,
            plants: vec![GuidePlant { base: Pixel::new(1.0, 2.0), region: None }],
            px_per_cm: Some(11.0),
            photographs: vec![photograph],
        };
        let html = page.to_html();
        assert!(is_guide(&html) && !is_guide("<p>mine"));
        assert!(!html.contains("/*CONTENT*/") && !html.contains("</script>.jpg"));
        assert!(html.contains("\"data\":\"/9j/\"") && html.contains("\"px_per_cm\":11.0"));
    }
}
