//! Figures as PDF files: one page of lines and areas, as large as the figure.
//!
//! The file is PDF 1.4 (ISO 32000-1, sections 7 and 8) without compression and without fonts, so that no library writes it.

use std::fmt::Write;

use super::drawing::{Colour, Drawing, Shape};

/// Points a pixel of a figure: CSS has 96 pixels an inch, PDF 72 points.
const POINTS: f64 = 0.75;

/// What a stroke is broader where edges are sharp, in pixels: viewers blur edges, which shows as seams.
const OVERLAP: f64 = 0.4;

/// The drawing as a PDF file.
pub(super) fn pdf(drawing: &Drawing) -> Vec<u8> {
    let (width, height) = (drawing.size.0 * POINTS, drawing.size.1 * POINTS);
    // Pixels from the upper left corner, and round joins.
    let mut content = format!("{POINTS} 0 0 -{POINTS} 0 {height:.2} cm 1 j\n");
    let mut opacities: Vec<u8> = Vec::new();
    for shape in &drawing.shapes {
        draw(&mut content, shape, &mut opacities);
    }
    let states = opacities.iter().fold(String::new(), |mut states, percent| {
        let opacity = f64::from(*percent) / 100.0;
        let _ = write!(states, "/G{percent} << /CA {opacity} /ca {opacity} >> ");
        states
    });
    file(&[
        "<< /Type /Catalog /Pages 2 0 R >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.2} {height:.2}] /Contents 4 0 R /Resources << /ExtGState << \
             {states}>> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}\nendstream", content.len()),
    ])
}

/// A file of objects, which are numbered from 1; the first is the catalogue.
fn file(objects: &[String]) -> Vec<u8> {
    let mut text = "%PDF-1.4\n".to_owned();
    let mut places = String::new();
    for (number, object) in (1..).zip(objects) {
        let _ = writeln!(places, "{:010} 00000 n ", text.len());
        let _ = writeln!(text, "{number} 0 obj\n{object}\nendobj");
    }
    let (start, size) = (text.len(), objects.len() + 1);
    let _ = write!(
        text,
        "xref\n0 {size}\n0000000000 65535 f \n{places}trailer\n<< /Size {size} /Root 1 0 R >>\nstartxref\n{start}\n%%EOF\n"
    );
    text.into_bytes()
}

fn draw(content: &mut String, shape: &Shape, opacities: &mut Vec<u8>) {
    let percent = (shape.opacity * 100.0).round() as u8;
    if percent < 100 {
        let _ = writeln!(content, "q /G{percent} gs");
        if !opacities.contains(&percent) {
            opacities.push(percent);
        }
    }
    if let Some(colour) = shape.fill {
        let _ = writeln!(content, "{} rg", channels(colour));
    }
    if let Some((colour, width)) = shape.stroke {
        let width = width + if shape.is_crisp { OVERLAP } else { 0.0 };
        let dash = shape.dash.map_or_else(String::new, |[dash, gap]| format!("{dash} {gap}"));
        let _ = writeln!(content, "{} RG {width:.2} w [{dash}] 0 d", channels(colour));
    }
    for line in &shape.lines {
        for (index, (x, y)) in line.iter().enumerate() {
            let _ = write!(content, "{x:.1} {y:.1} {} ", if index == 0 { "m" } else { "l" });
        }
    }
    content.push_str(match (shape.fill, shape.stroke) {
        (Some(_), Some(_)) => "B\n",
        (Some(_), None) => "f\n",
        (None, _) => "S\n",
    });
    if percent < 100 {
        content.push_str("Q\n");
    }
}

fn channels(colour: Colour) -> String {
    colour.map(|channel| format!("{:.3}", f64::from(channel) / 255.0)).join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_names_the_place_of_each_object() {
        let svg =
            r#"<svg class="figure" viewBox="0 0 80 40"><path class="stroke e0 faint" d="M1 2l3 4"/></svg>"#;
        let text = String::from_utf8(pdf(&Drawing::of(svg))).unwrap();
        assert!(text.contains("/MediaBox [0 0 60.00 30.00]") && text.contains("1.0 2.0 m 4.0 6.0 l S"));
        assert!(text.contains("/G35 gs") && text.contains("/G35 << /CA 0.35"));
        let places: Vec<usize> =
            text.lines().filter_map(|line| line.strip_suffix(" 00000 n ")?.parse().ok()).collect();
        assert_eq!(places.len(), 4);
        for (number, place) in (1..).zip(places) {
            assert!(text[place..].starts_with(&format!("{number} 0 obj")));
        }
        let start: usize = text.lines().rev().nth(1).unwrap().parse().unwrap();
        assert!(text[start..].starts_with("xref"));
        let (_, rest) = text.split_once("stream\n").unwrap();
        let (content, _) = rest.split_once("\nendstream").unwrap();
        assert!(text.contains(&format!("/Length {} ", content.len())));
    }
}
