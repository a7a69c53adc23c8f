//! The font of text in PNG and PDF files and on photographs: DejaVu Sans Condensed, about as wide as the fonts of browsers.

use std::sync::LazyLock;

use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A weight of the font.
pub(super) struct Font {
    /// The file.
    pub(super) data: &'static [u8],
    /// What the file holds; `None` if it is broken, which a test excludes.
    face: Option<Face<'static>>,
}

static REGULAR: LazyLock<Font> = LazyLock::new(|| Font::of(dejavu::sans_condensed::regular()));
static BOLD: LazyLock<Font> = LazyLock::new(|| Font::of(dejavu::sans_condensed::bold()));

/// Metrics of a font as PDF asks for them, in thousandths of its size.
pub(super) struct Metrics {
    /// Left, lower, right and upper bound of all glyphs.
    pub(super) bounds: [f32; 4],
    pub(super) ascent: f32,
    pub(super) descent: f32,
    pub(super) capitals: f32,
}

impl Font {
    /// The bold or the regular weight.
    pub(super) fn weighing(is_bold: bool) -> &'static Self {
        if is_bold { &BOLD } else { &REGULAR }
    }

    fn of(data: &'static [u8]) -> Self {
        Self { data, face: Face::parse(data, 0).ok() }
    }

    /// The glyph of a letter: the empty box, number 0, for one that the font lacks.
    pub(super) fn glyph(&self, letter: char) -> u16 {
        self.face.as_ref().and_then(|face| face.glyph_index(letter)).map_or(0, |glyph| glyph.0)
    }

    /// How far a glyph moves the pen, in shares of the font's size.
    pub(super) fn advance(&self, glyph: u16) -> f32 {
        let advance = |face: &Face<'_>| face.glyph_hor_advance(GlyphId(glyph)).map(|units| self.share(units));
        self.face.as_ref().and_then(advance).unwrap_or_default()
    }

    /// The width of a text, in shares of the font's size.
    pub(super) fn width(&self, text: &str) -> f32 {
        text.chars().map(|letter| self.advance(self.glyph(letter))).sum()
    }

    /// Height of capitals, in shares of the font's size.
    pub(super) fn capitals(&self) -> f32 {
        self.metrics().capitals / 1000.0
    }

    /// The outlines of a text whose base line begins at `(x, y)`; `None` without ink.
    pub(super) fn outlines(&self, text: &str, (x, y): (f32, f32), size: f32) -> Option<Path> {
        let face = self.face.as_ref()?;
        let mut outline = Outline(PathBuilder::new(), 0.0);
        for letter in text.chars() {
            let glyph = GlyphId(self.glyph(letter));
            face.outline_glyph(glyph, &mut outline);
            outline.1 += f32::from(face.glyph_hor_advance(glyph).unwrap_or_default());
        }
        let unit = size / f32::from(face.units_per_em());
        // In fonts y points up.
        outline.0.finish()?.transform(Transform::from_row(unit, 0.0, 0.0, -unit, x, y))
    }

    pub(super) fn metrics(&self) -> Metrics {
        let Some(face) = &self.face else {
            return Metrics { bounds: [0.0; 4], ascent: 0.0, descent: 0.0, capitals: 0.0 };
        };
        let thousandths = |units: i16| f32::from(units) * 1000.0 / f32::from(face.units_per_em());
        let bounds = face.global_bounding_box();
        Metrics {
            bounds: [bounds.x_min, bounds.y_min, bounds.x_max, bounds.y_max].map(thousandths),
            ascent: thousandths(face.ascender()),
            descent: thousandths(face.descender()),
            // The font does not say it.
            capitals: face
                .glyph_index('H')
                .and_then(|glyph| face.glyph_bounding_box(glyph))
                .map_or(0.0, |bounds| thousandths(bounds.y_max)),
        }
    }

    fn share(&self, units: u16) -> f32 {
        self.face.as_ref().map_or(0.0, |face| f32::from(units) / f32::from(face.units_per_em()))
    }
}

/// A path that is built in the font's units, and how far the pen has moved.
struct Outline(PathBuilder, f32);

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x + self.1, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x + self.1, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1 + self.1, y1, x + self.1, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1 + self.1, y1, x2 + self.1, y2, x + self.1, y);
    }

    fn close(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_of_many_languages_and_of_formulas_are_in_both_weights() {
        for font in [Font::weighing(false), Font::weighing(true)] {
            for letter in "höhe-µ Größe β γ λ Δ − ≥ ± ° · × → ← “é” ő ñ ç Ж ø".chars()
            {
                assert!(font.glyph(letter) != 0, "{letter}");
            }
            assert_eq!(font.glyph('\u{1f331}'), 0, "a letter that is lacking is a box");
            assert!(font.outlines("\u{1f331}", (0.0, 0.0), 12.0).is_some());
        }
    }

    #[test]
    fn a_text_is_as_wide_as_its_outlines() {
        let font = Font::weighing(false);
        let bounds = font.outlines("H1H", (10.0, 20.0), 100.0).unwrap().bounds();
        assert!((bounds.bottom() - 20.0).abs() < 0.1, "{bounds:?}");
        assert!((bounds.height() - 100.0 * font.capitals()).abs() < 1.5, "{bounds:?}");
        // Each letter has space at its sides.
        let wide = 100.0 * font.width("H1H");
        assert!(bounds.left() > 10.0 && bounds.right() < 10.0 + wide && bounds.width() > 0.8 * wide);
        assert_eq!((font.width(""), font.outlines(" ", (0.0, 0.0), 9.0)), (0.0, None));
    }
}
