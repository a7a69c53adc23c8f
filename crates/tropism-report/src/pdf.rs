//! Figures as PDF files: one page, as large as the figure, with text that can be searched and copied.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{CidFontType, FontFlags, LineJoinStyle, SystemInfo, TextRenderingMode, UnicodeCmap};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str};
use subsetter::GlyphRemapper;

use super::drawing::{Colour, Drawing, FONT_SIZE, Item, Shape, Text};
use super::font::{Font, Metrics};

/// Points a pixel of a figure: CSS has 96 pixels an inch, PDF 72 points.
const POINTS: f32 = 0.75;

/// What a stroke is broader where edges are sharp, in pixels: viewers blur edges, which shows as seams.
const OVERLAP: f64 = 0.4;

/// Glyphs of a font are numbered by a collection of their own (ISO 32000-1, section 9.7.3).
const IDENTITY: SystemInfo<'static> =
    SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

/// A page that is being written.
struct Page {
    content: Content,
    /// Percentages of opacity that the page uses.
    opacities: Vec<u8>,
    regular: Used,
    bold: Used,
}

/// What a page uses of a font.
struct Used {
    font: &'static Font,
    /// New numbers of its glyphs.
    glyphs: GlyphRemapper,
    /// The letter of each new number, from the empty box, 0; none in a font that is not used.
    letters: Vec<char>,
}

impl Used {
    fn of(font: &'static Font) -> Self {
        Self { font, glyphs: GlyphRemapper::new(), letters: Vec::new() }
    }

    /// A text as new numbers of glyphs, two bytes each.
    fn encoded(&mut self, text: &str) -> Vec<u8> {
        if self.letters.is_empty() {
            self.letters.push(char::REPLACEMENT_CHARACTER);
        }
        let mut bytes = Vec::new();
        for letter in text.chars() {
            let number = self.glyphs.remap(self.font.glyph(letter));
            if usize::from(number) == self.letters.len() {
                self.letters.push(letter);
            }
            bytes.extend(number.to_be_bytes());
        }
        bytes
    }
}

/// The drawing as a PDF file.
pub(super) fn pdf(drawing: &Drawing) -> Vec<u8> {
    let (width, height) = (drawing.size.0 as f32 * POINTS, drawing.size.1 as f32 * POINTS);
    let mut page = Page {
        content: Content::new(),
        opacities: Vec::new(),
        regular: Used::of(Font::weighing(false)),
        bold: Used::of(Font::weighing(true)),
    };
    // Pixels from the upper left corner.
    page.content.transform([POINTS, 0.0, 0.0, -POINTS, 0.0, height]);
    page.content.set_line_join(LineJoinStyle::RoundJoin);
    for item in &drawing.items {
        match item {
            Item::Shape(shape) => page.draw(shape),
            Item::Text(text) => page.write(text),
        }
    }
    page.file(width, height)
}

/// Ten micrometres, a tenth of a pixel, are fine enough: files are half as large.
fn tenths(value: f64) -> f32 {
    ((value * 10.0).round() / 10.0) as f32
}

fn channels(colour: Colour) -> [f32; 3] {
    colour.map(|channel| (f32::from(channel) / 255.0 * 1000.0).round() / 1000.0)
}

impl Page {
    fn begin(&mut self, opacity: f64) {
        let percent = (opacity * 100.0).round() as u8;
        self.content.save_state();
        if percent < 100 {
            self.content.set_parameters(Name(format!("G{percent}").as_bytes()));
            if !self.opacities.contains(&percent) {
                self.opacities.push(percent);
            }
        }
    }

    fn set_fill(&mut self, colour: Colour) {
        let [red, green, blue] = channels(colour);
        self.content.set_fill_rgb(red, green, blue);
    }

    fn set_stroke(&mut self, colour: Colour, width: f64) {
        let [red, green, blue] = channels(colour);
        self.content.set_stroke_rgb(red, green, blue).set_line_width(width as f32);
    }

    fn draw(&mut self, shape: &Shape) {
        self.begin(shape.opacity);
        if let Some(colour) = shape.fill {
            self.set_fill(colour);
        }
        if let Some((colour, width)) = shape.stroke {
            self.set_stroke(colour, width + if shape.is_crisp { OVERLAP } else { 0.0 });
            if let Some(lengths) = shape.dash {
                self.content.set_dash_pattern(lengths.map(|length| length as f32), 0.0);
            }
        }
        for line in &shape.lines {
            for (index, &(x, y)) in line.iter().enumerate() {
                let (x, y) = (tenths(x), tenths(y));
                if index == 0 {
                    self.content.move_to(x, y)
                } else {
                    self.content.line_to(x, y)
                };
            }
        }
        match (shape.fill, shape.stroke) {
            (Some(_), Some(_)) => self.content.fill_nonzero_and_stroke(),
            (Some(_), None) => self.content.fill_nonzero(),
            (None, _) => self.content.stroke(),
        };
        self.content.restore_state();
    }

    fn write(&mut self, text: &Text) {
        let used = if text.is_bold { &mut self.bold } else { &mut self.regular };
        let bytes = used.encoded(&text.letters);
        let (x, y) = (tenths(text.start.0), tenths(text.start.1));
        // In the space of text y points up.
        let matrix = if text.is_turned { [0.0, -1.0, -1.0, 0.0, x, y] } else { [1.0, 0.0, 0.0, -1.0, x, y] };
        self.begin(text.opacity);
        self.set_fill(text.ink);
        if let Some((colour, width)) = text.outline {
            self.set_stroke(colour, width);
        }
        let name = if text.is_bold { Name(b"Bold") } else { Name(b"Regular") };
        let modes = [(text.outline.is_some(), TextRenderingMode::Stroke), (true, TextRenderingMode::Fill)];
        self.content.begin_text().set_font(name, FONT_SIZE as f32);
        for (_, mode) in modes.into_iter().filter(|(is_wanted, _)| *is_wanted) {
            self.content.set_text_rendering_mode(mode).set_text_matrix(matrix).show(Str(&bytes));
        }
        self.content.end_text().restore_state();
    }

    fn file(self, width: f32, height: f32) -> Vec<u8> {
        let mut pdf = Pdf::new();
        let mut next = Ref::new(1);
        let [catalogue, pages, page, content] = [(); 4].map(|()| next.bump());
        pdf.catalog(catalogue).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        compressed(&mut pdf, content, &self.content.finish());
        let fonts: Vec<(Name<'_>, Ref)> = [(Name(b"Regular"), &self.regular), (Name(b"Bold"), &self.bold)]
            .into_iter()
            .filter(|(_, used)| !used.letters.is_empty())
            .map(|(name, used)| (name, embedded(&mut pdf, &mut next, name, used)))
            .collect();
        let mut written = pdf.page(page);
        written.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
        let mut resources = written.resources();
        resources.fonts().pairs(fonts);
        let mut states = resources.ext_g_states();
        for percent in self.opacities {
            let share = f32::from(percent) / 100.0;
            let mut state = states
                .insert(Name(format!("G{percent}").as_bytes()))
                .start::<pdf_writer::writers::ExtGraphicsState<'_>>();
            state.stroking_alpha(share).non_stroking_alpha(share);
        }
        states.finish();
        resources.finish();
        written.finish();
        pdf.finish()
    }
}

fn compressed(pdf: &mut Pdf, name: Ref, bytes: &[u8]) {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory does not fail.
    let packed = packer.write_all(bytes).and_then(|()| packer.finish()).unwrap_or_default();
    pdf.stream(name, &packed).filter(Filter::FlateDecode);
}

/// Embeds the used glyphs of a font, with the letters that they stand for.
fn embedded(pdf: &mut Pdf, next: &mut Ref, name: Name<'_>, used: &Used) -> Ref {
    let [font, cid, descriptor, cmap, file] = [(); 5].map(|()| next.bump());
    // A name with a tag of six letters says that this is a part of the font (ISO 32000-1, section 9.6.4).
    let full = [b"TROPIS+DejaVuSansCondensed-", name.0].concat();
    let full = Name(&full);
    pdf.type0_font(font)
        .base_font(full)
        .encoding_predefined(Name(b"Identity-H"))
        .descendant_font(cid)
        .to_unicode(cmap);
    let mut written = pdf.cid_font(cid);
    written.subtype(CidFontType::Type2).base_font(full).system_info(IDENTITY).font_descriptor(descriptor);
    written.cid_to_gid_map_predefined(Name(b"Identity"));
    let widths = used.glyphs.remapped_gids().map(|glyph| used.font.advance(glyph) * 1000.0);
    written.widths().consecutive(0, widths);
    written.finish();
    let Metrics { bounds: [left, lower, right, upper], ascent, descent, capitals } = used.font.metrics();
    pdf.font_descriptor(descriptor)
        .name(full)
        .flags(FontFlags::SYMBOLIC)
        .bbox(Rect::new(left, lower, right, upper))
        .italic_angle(0.0)
        .ascent(ascent)
        .descent(descent)
        .cap_height(capitals)
        .stem_v(0.0)
        .font_file2(file);
    let mut letters = UnicodeCmap::<u16>::new(Name(b"Letters"), IDENTITY);
    for (number, &letter) in (0..).zip(&used.letters) {
        letters.pair(number, letter);
    }
    compressed(pdf, cmap, &letters.finish());
    // Without a subset the whole font.
    let subset = subsetter::subset(used.font.data, 0, &used.glyphs);
    compressed(pdf, file, &subset.unwrap_or_else(|_| used.font.data.to_vec()));
    font
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    /// The streams of a file, unpacked.
    fn streams(file: &[u8]) -> Vec<Vec<u8>> {
        let starts = file.windows(7).enumerate().filter(|(_, bytes)| bytes == b"stream\n");
        let starts = starts.map(|(place, _)| place).filter(|&place| !file[..place].ends_with(b"end"));
        let unpacked = |place: usize| {
            let mut bytes = Vec::new();
            flate2::read::ZlibDecoder::new(&file[place + 7..]).read_to_end(&mut bytes).unwrap();
            bytes
        };
        starts.map(unpacked).collect()
    }

    #[test]
    fn a_page_has_the_lines_of_the_figure() {
        let svg =
            r#"<svg class="figure" viewBox="0 0 80 40"><path class="stroke e0 faint" d="M1 2l3 4"/></svg>"#;
        let file = pdf(&Drawing::of(svg));
        let text = String::from_utf8_lossy(&file);
        assert!(text.contains("/MediaBox [0 0 60 30]") && text.contains("/CA 0.35"), "{text}");
        let content = String::from_utf8(streams(&file).remove(0)).unwrap();
        assert!(content.contains("1 2 m\n4 6 l\nS") && content.contains("/G35 gs"), "{content}");
    }

    #[test]
    fn a_text_of_letters_that_the_font_lacks_has_its_font_all_the_same() {
        let svg = r#"<svg class="figure"><text class="label" x="1" y="20">🌱</text></svg>"#;
        let file = pdf(&Drawing::of(svg));
        assert!(String::from_utf8_lossy(&file).contains("/Font"), "the page names a font");
        assert_eq!(streams(&file).len(), 3, "content, letters and font");
    }

    #[test]
    fn letters_beyond_ascii_are_embedded_and_can_be_searched() {
        let svg = r#"<svg class="figure"><text class="label" x="1" y="20">höhe-µ</text></svg>"#;
        let file = pdf(&Drawing::of(svg));
        let streams = streams(&file);
        let letters = String::from_utf8_lossy(&streams[1]);
        for letter in "höe-µ".chars() {
            assert!(letters.contains(&format!("<{:04X}>", u32::from(letter))), "{letter}: {letters}");
        }
        // Of some 6000 glyphs are embedded the empty box, five letters, and the parts that accented ones consist of.
        let font = ttf_parser::Face::parse(&streams[2], 0).unwrap();
        assert!((6..12).contains(&font.number_of_glyphs()), "{}", font.number_of_glyphs());
        assert!(file.len() < 10_000, "{}", file.len());
    }
}
