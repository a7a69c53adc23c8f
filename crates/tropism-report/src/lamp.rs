//! Colours of lamps: classes of the style sheet in figures, values on photographs.

use tropism::lamps::{Layout, Light};
use tropism::track::Track;

/// Lamps with a colour of their own; the ninth has that of the first.
const COLOURED: usize = 8;

/// Classes by the number of a lamp in its layout; their colours are in `figure.css`.
///
/// Chosen by a search with random steps: the two colours of the paper's lamps are given, hues are named (green, magenta,
/// cyan, red, violet, yellow), and the smallest CIE 1976 colour difference between two of them, the ink and the grey of
/// darkness is maximal, as seen with normal, protanopic, deuteranopic and tritanopic vision. The tests hold the result.
const CLASSES: [&str; COLOURED] = ["left", "right", "lamp3", "lamp4", "lamp5", "lamp6", "lamp7", "lamp8"];

/// Colours on photographs, which are dark: those of the style sheet on dark ground.
pub(super) const COLOURS: [[u8; 3]; COLOURED] = [
    [109, 179, 255],
    [255, 171, 74],
    [187, 254, 161],
    [204, 88, 189],
    [85, 227, 254],
    [241, 85, 80],
    [119, 121, 253],
    [249, 224, 10],
];

/// The class of a lamp in figures; `dark` for none.
pub(super) const fn class(light: Option<Light>) -> &'static str {
    match light {
        Some(light) => CLASSES[light.index() % COLOURED],
        None => "dark",
    }
}

/// The colour of a lamp on photographs; white for none.
pub(super) const fn colour(light: Option<Light>) -> [u8; 3] {
    match light {
        Some(light) => COLOURS[light.index() % COLOURED],
        None => [255; 3],
    }
}

/// The layout with the most lamps of some tracks; without tracks the paper's.
pub(super) fn layout_of(tracks: &[Track]) -> Layout {
    tracks.iter().map(|track| &track.layout).max_by_key(|layout| layout.len()).cloned().unwrap_or_default()
}

/// The entries of a legend: the class of each lamp, and its name with `suffix`.
pub(super) fn legend(layout: &Layout, suffix: &str) -> Vec<(&'static str, String)> {
    layout
        .lights()
        .map(|light| (class(Some(light)), format!("{} {suffix}", layout.name(Some(light)))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tropism::math::{hypot, pow};

    /// Linear RGB as seen with normal, protanopic, deuteranopic and tritanopic vision (Machado, Oliveira and Fernandes
    /// 2009, doi:10.1109/TVCG.2009.113, severity 1), and the factor of its distances: tritanopia is rare.
    const VISIONS: [([[f64; 3]; 3], f64); 4] = [
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1.0),
        (
            [
                [0.152286, 1.052583, -0.204868],
                [0.114503, 0.786281, 0.099216],
                [-0.003882, -0.048116, 1.051998],
            ],
            1.0,
        ),
        (
            [
                [0.367322, 0.860646, -0.227968],
                [0.280085, 0.672501, 0.047413],
                [-0.011820, 0.042940, 0.968881],
            ],
            1.0,
        ),
        (
            [
                [1.255528, -0.076749, -0.178779],
                [-0.078411, 0.930809, 0.147602],
                [0.004733, 0.691367, 0.303900],
            ],
            1.35,
        ),
    ];

    /// The value of a variable of the style sheet, on light or on dark ground.
    fn css(name: &str, is_dark: bool) -> [u8; 3] {
        let sheet = include_str!("figure.css");
        let (light, dark) = sheet.split_once("@media").unwrap();
        let part = if is_dark { dark } else { light };
        let value = part.split_once(&format!("--{name}:#")).unwrap_or_else(|| panic!("{name}")).1;
        let digits = value.split([';', '}']).next().unwrap();
        let value = |digits: &str| u8::from_str_radix(digits, 16).unwrap();
        match digits.len() {
            3 => [0, 1, 2].map(|at| value(&digits[at..=at]) * 17),
            _ => [0, 2, 4].map(|at| value(&digits[at..at + 2])),
        }
    }

    fn linear(colour: [u8; 3]) -> [f64; 3] {
        colour.map(|value| {
            let value = f64::from(value) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { pow((value + 0.055) / 1.055, 2.4) }
        })
    }

    fn product(matrix: [[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum::<f64>())
    }

    /// CIE 1976 L*a*b*.
    fn lab(rgb: [f64; 3]) -> [f64; 3] {
        let xyz =
            product([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]], rgb);
        let curve = |t: f64| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
        let [x, y, z] = [curve(xyz[0] / 0.95047), curve(xyz[1]), curve(xyz[2] / 1.08883)];
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// The smallest difference of two colours over all kinds of vision.
    fn difference(a: [u8; 3], b: [u8; 3]) -> f64 {
        let seen = |matrix, colour| lab(product(matrix, linear(colour)).map(|value| value.clamp(0.0, 1.0)));
        let one = |(matrix, factor): ([[f64; 3]; 3], f64)| {
            let (a, b) = (seen(matrix, a), seen(matrix, b));
            factor * hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2])
        };
        VISIONS.map(one).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Contrast ratio of WCAG 2.
    fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
        let luminance = |colour| {
            let [red, green, blue] = linear(colour);
            0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05
        };
        let (a, b) = (luminance(a), luminance(b));
        a.max(b) / a.min(b)
    }

    #[test]
    fn eight_lamps_differ_for_every_reader() {
        for (is_dark, least_contrast) in [(false, 3.0), (true, 4.5)] {
            let ground = css("ground", is_dark);
            let mut colours = CLASSES.map(|class| css(class, is_dark)).to_vec();
            for &colour in &colours {
                assert!(contrast(colour, ground) >= least_contrast, "{colour:?}");
            }
            colours.extend([css("quiet", is_dark), css("target", is_dark)]);
            for (index, &a) in colours.iter().enumerate() {
                for &b in &colours[..index.min(CLASSES.len())] {
                    assert!(difference(a, b) >= 22.0, "{a:?} {b:?}: {}", difference(a, b));
                }
            }
        }
    }

    #[test]
    fn photographs_have_the_colours_of_dark_ground() {
        assert_eq!(CLASSES.map(|class| css(class, true)), COLOURS);
    }

    #[test]
    fn tracks_of_more_lamps_decide_the_legend() {
        let four = Track { layout: Layout::four_sides(), ..Track::default() };
        let names = |tracks: &[Track]| legend(&layout_of(tracks), "light");
        assert_eq!(names(&[]), [("left", "left light".to_owned()), ("right", "right light".to_owned())]);
        assert_eq!(names(&[Track::default(), four])[3], ("lamp4", "back light".to_owned()));
    }
}
