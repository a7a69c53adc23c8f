//! Colour maps as classes of the figures' style sheet.
//!
//! A colour map has [`LEVELS`] classes, each with one colour on light ground and another on dark ground.

use tropism::math::interpolate::lerp;

/// Colours of a colour map: an odd number, so that a diverging one has a middle.
pub(super) const LEVELS: usize = 17;

/// A colour map.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ColourMap {
    /// From little to much, for values of one sign.
    Sequential,
    /// From negative over zero to positive.
    Diverging,
}

impl ColourMap {
    const BOTH: [Self; 2] = [Self::Sequential, Self::Diverging];

    const fn letter(self) -> char {
        match self {
            Self::Sequential => 's',
            Self::Diverging => 'd',
        }
    }

    /// The class of `level`, below [`LEVELS`].
    pub(super) fn class(self, level: usize) -> String {
        format!("{}{level}", self.letter())
    }

    /// The level of `share` in `0..=1`; a share outside has the level of the nearer end.
    pub(super) fn level(share: f64) -> usize {
        (share * (LEVELS - 1) as f64).round().clamp(0.0, (LEVELS - 1) as f64) as usize
    }

    /// Anchor colours from low to high, for light or for dark ground. Chosen by hand: the sequential map moves away from
    /// the ground; the middle of the diverging map differs from the ground, because the ground means no data.
    const fn anchors(self, is_dark: bool) -> &'static [[u8; 3]] {
        match (self, is_dark) {
            (Self::Sequential, false) => {
                &[[239, 221, 204], [240, 162, 124], [201, 74, 104], [105, 30, 118], [29, 14, 66]]
            }
            (Self::Sequential, true) => {
                &[[58, 48, 84], [116, 54, 126], [204, 80, 112], [245, 152, 106], [252, 240, 190]]
            }
            (Self::Diverging, false) => &[
                [10, 47, 98],
                [36, 105, 190],
                [140, 184, 230],
                [226, 222, 214],
                [243, 186, 116],
                [205, 107, 16],
                [110, 50, 2],
            ],
            (Self::Diverging, true) => &[
                [200, 226, 255],
                [100, 166, 244],
                [48, 100, 172],
                [62, 65, 70],
                [160, 100, 34],
                [240, 158, 62],
                [255, 226, 180],
            ],
        }
    }

    fn colour(self, level: usize, is_dark: bool) -> String {
        let anchors = self.anchors(is_dark);
        let place = level as f64 / (LEVELS - 1) as f64 * (anchors.len() - 1) as f64;
        let low = (place.floor() as usize).min(anchors.len() - 2);
        let share = place - low as f64;
        let channel = |channel: usize| {
            let (from, to) = (f64::from(anchors[low][channel]), f64::from(anchors[low + 1][channel]));
            lerp(from, to, share).round() as u8
        };
        format!("#{:02x}{:02x}{:02x}", channel(0), channel(1), channel(2))
    }
}

/// The style sheet of all figures: that of light ground, and in blocks of `@media` what differs on dark ground.
#[must_use]
pub fn style() -> String {
    let rules = |is_dark| {
        ColourMap::BOTH
            .into_iter()
            .flat_map(|map| (0..LEVELS).map(move |level| (map.class(level), map.colour(level, is_dark))))
            .map(|(class, colour)| format!(".figure .{class}{{color:{colour}}}"))
            .collect::<String>()
    };
    let (light, dark) = (rules(false), rules(true));
    let sheet = include_str!("figure.css");
    format!("{sheet}{light}\n@media screen and (prefers-color-scheme:dark){{{dark}}}\n")
}

/// The style sheet for files that any program may show: the colours of light ground, without variables of CSS.
pub(super) fn plain_style() -> String {
    let sheet = style();
    let before =
        |text: &str, end: &str| text.split_once(end).map_or(0, |(before, _)| before.len() + end.len());
    let mut plain = String::new();
    let mut rest = sheet.as_str();
    // Each block for dark ground ends with two braces.
    while let Some((light, dark)) = rest.split_once("@media") {
        plain += light;
        rest = &dark[before(dark, "}}")..];
    }
    plain += rest;
    let mut variables = Vec::new();
    while let Some((head, tail)) = plain.split_once("--").filter(|(head, _)| !head.ends_with("var(")) {
        let (name, tail) = tail.split_once(':').unwrap_or((tail, ""));
        let (value, tail) = tail.split_once(';').unwrap_or((tail, ""));
        variables.push((format!("var(--{name})"), value.to_owned()));
        plain = format!("{head}{tail}");
    }
    variables.iter().fold(plain, |plain, (variable, value)| plain.replace(variable, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_maps_end_at_their_anchors() {
        assert_eq!(ColourMap::Sequential.colour(0, false), "#efddcc");
        assert_eq!(ColourMap::Diverging.colour(8, true), "#3e4146");
        assert_eq!(ColourMap::Diverging.colour(16, false), "#6e3202");
        assert_eq!([-1.0, 0.0, 0.5, 7.0, f64::NAN].map(ColourMap::level), [0, 0, 8, 16, 0]);
    }
}
