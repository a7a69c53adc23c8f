//! A stroke font for text in pictures: letters as lines on a grid of 4 x 6, sharp at any size, without a font file.

use tiny_skia::PathBuilder;

/// A vertex on the grid: columns to the right, rows down.
type Vertex = (u8, u8);

/// Grid columns from one letter to the next: four of the letter and two of space.
const ADVANCE: f32 = 6.0;

/// The strokes of a letter; none for a letter that the font lacks.
const fn strokes(letter: char) -> &'static [&'static [Vertex]] {
    match letter {
        '0' => &[&[(0, 1), (1, 0), (3, 0), (4, 1), (4, 5), (3, 6), (1, 6), (0, 5), (0, 1)]],
        '1' => &[&[(1, 1), (2, 0), (2, 6)]],
        '2' => &[&[(0, 1), (1, 0), (3, 0), (4, 1), (4, 2), (0, 6), (4, 6)]],
        '3' => &[&[(0, 0), (4, 0), (2, 2), (3, 2), (4, 3), (4, 5), (3, 6), (1, 6), (0, 5)]],
        '4' => &[&[(3, 6), (3, 0), (0, 4), (4, 4)]],
        '5' => &[&[(4, 0), (0, 0), (0, 2), (3, 2), (4, 3), (4, 5), (3, 6), (0, 6)]],
        '6' => &[&[(3, 0), (1, 0), (0, 1), (0, 5), (1, 6), (3, 6), (4, 5), (4, 4), (3, 3), (0, 3)]],
        '7' => &[&[(0, 0), (4, 0), (1, 6)]],
        '8' => &[
            &[(1, 3), (0, 2), (0, 1), (1, 0), (3, 0), (4, 1), (4, 2), (3, 3), (1, 3)],
            &[(1, 3), (0, 4), (0, 5), (1, 6), (3, 6), (4, 5), (4, 4), (3, 3)],
        ],
        '9' => &[&[(4, 3), (1, 3), (0, 2), (0, 1), (1, 0), (3, 0), (4, 1), (4, 5), (3, 6), (1, 6)]],
        'A' => &[&[(0, 6), (2, 0), (4, 6)], &[(1, 4), (3, 4)]],
        'H' => &[&[(0, 0), (0, 6)], &[(4, 0), (4, 6)], &[(0, 3), (4, 3)]],
        'I' => &[&[(2, 0), (2, 6)]],
        'L' => &[&[(0, 0), (0, 6), (4, 6)]],
        'M' => &[&[(0, 6), (0, 0), (2, 3), (4, 0), (4, 6)]],
        'N' => &[&[(0, 6), (0, 0), (4, 6), (4, 0)]],
        'P' => &[&[(0, 6), (0, 0), (3, 0), (4, 1), (4, 2), (3, 3), (0, 3)]],
        'R' => &[&[(0, 6), (0, 0), (3, 0), (4, 1), (4, 2), (3, 3), (0, 3)], &[(2, 3), (4, 6)]],
        'T' => &[&[(0, 0), (4, 0)], &[(2, 0), (2, 6)]],
        'U' => &[&[(0, 0), (0, 5), (1, 6), (3, 6), (4, 5), (4, 0)]],
        'V' => &[&[(0, 0), (2, 6), (4, 0)]],
        _ => &[],
    }
}

/// The strokes of `text` in letters `height` pixels high, with their upper left corner at `(x, y)`.
pub(super) fn path(text: &str, (x, y): (f32, f32), height: f32) -> PathBuilder {
    let mut path = PathBuilder::new();
    let size = height / 6.0;
    let mut left = x;
    for letter in text.chars() {
        for stroke in strokes(letter) {
            for (index, &(column, row)) in stroke.iter().enumerate() {
                let (x, y) = (left + f32::from(column) * size, y + f32::from(row) * size);
                if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
        }
        left += ADVANCE * size;
    }
    path
}

/// The width of `text` in pixels, in letters `height` pixels high.
pub(super) fn width(text: &str, height: f32) -> f32 {
    let letters = text.chars().count() as f32;
    (letters * ADVANCE - 2.0).max(0.0) * height / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_of_a_film_is_in_the_font() {
        for letter in "VIRTUALPLANT0123456789HMIN".chars() {
            assert!(!strokes(letter).is_empty(), "{letter}");
        }
    }

    #[test]
    fn text_is_as_wide_as_its_path() {
        let bounds = path("H1H", (10.0, 20.0), 12.0).finish().unwrap().bounds();
        assert_eq!((bounds.left(), bounds.top(), bounds.bottom()), (10.0, 20.0, 32.0));
        assert!((bounds.width() - width("H1H", 12.0)).abs() < 1e-4);
        assert_eq!(width("", 12.0), 0.0);
    }
}
