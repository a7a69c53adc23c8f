//! Lamps: which one is lit, what they are called and where they stand.
//!
//! A [`Layout`] names 2 to 16 lamps and their places. A [`Light`] is the number of the lit lamp in that layout: the paper's
//! lighting condition C (section 2.2.3). One lamp is lit at a step; a dark tent is `None`, never a further light.
//! A [`Lighting`](crate::lighting::Lighting) is the general case: several lamps, and levels.
//! Mirroring is a property of the layout: the mirror image of a lamp is the lamp that stands at the mirrored place.
//!
//! # References
//! Wahby et al. 2016, section 2.1 (places of the two lamps) and section 2.2.3 (mirrored data).

use core::f64::consts::TAU;
use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::math::{atan2, cos, hypot, sin};

/// The largest number of lamps in a layout. Chosen: a wall of eight nodes that shine in two directions each.
pub const MAX_LAMPS: usize = 16;

/// Names of lamps in files that carry no layout, by number.
const STANDARD_NAMES: [&str; MAX_LAMPS] = [
    "left", "right", "front", "back", "lamp5", "lamp6", "lamp7", "lamp8", "lamp9", "lamp10", "lamp11",
    "lamp12", "lamp13", "lamp14", "lamp15", "lamp16",
];

/// The word for darkness in every file.
pub const DARK: &str = "dark";

/// The lit lamp, as its number in a [`Layout`].
///
/// The paper's C is "whether the right light is on" (section 2.2.3): [`Light::RIGHT`] is its `true`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Light(u8);

impl Light {
    /// The lamp at negative x in the paper's layout.
    pub const LEFT: Self = Self(0);
    /// The lamp at positive x in the paper's layout.
    pub const RIGHT: Self = Self(1);
    /// The lamp between plant and camera in [`Layout::four_sides`].
    pub const FRONT: Self = Self(2);
    /// The lamp behind the plant in [`Layout::four_sides`].
    pub const BACK: Self = Self(3);
    /// The two lights of the paper, left first.
    pub const BOTH: [Self; 2] = [Self::LEFT, Self::RIGHT];

    /// Light number `index` of a layout; `None` from [`MAX_LAMPS`] on.
    #[must_use]
    pub const fn new(index: usize) -> Option<Self> {
        if index < MAX_LAMPS { Some(Self(index as u8)) } else { None }
    }

    /// Number of the lamp in its layout, 0 to 15.
    #[must_use]
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The number in one letter, `0` to `F`: columns of lights in files of models.
    #[must_use]
    pub(crate) fn letter(self) -> char {
        char::from_digit(u32::from(self.0), 16).unwrap_or('?').to_ascii_uppercase()
    }

    /// The lamp of a [letter](Self::letter).
    pub(crate) fn of_letter(letter: char) -> Option<Self> {
        letter
            .to_digit(16)
            .filter(|_| !letter.is_ascii_lowercase())
            .and_then(|number| Self::new(number as usize))
    }

    /// Name of the lamp in files that carry no layout: `left`, `right`, `front`, `back`, `lamp5` to `lamp16`.
    #[must_use]
    pub const fn standard_name(self) -> &'static str {
        STANDARD_NAMES[self.0 as usize]
    }
}

impl fmt::Display for Light {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.standard_name())
    }
}

impl Serialize for Light {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.standard_name())
    }
}

impl<'de> Deserialize<'de> for Light {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = std::borrow::Cow::<str>::deserialize(deserializer)?;
        match parse(&word) {
            Ok(Some(light)) => Ok(light),
            _ => Err(serde::de::Error::custom(UnknownLight::new(&word, &STANDARD_NAMES))),
        }
    }
}

/// The word for `light` in files that carry no layout.
#[must_use]
pub const fn name(light: Option<Light>) -> &'static str {
    match light {
        None => DARK,
        Some(light) => light.standard_name(),
    }
}

/// The light that a word stands for in files that carry no layout; `None` is `dark`.
///
/// # Errors
/// [`UnknownLight`] for any other word.
pub fn parse(word: &str) -> Result<Option<Light>, UnknownLight> {
    parse_among(&STANDARD_NAMES, word)
}

fn parse_among(names: &[&str], word: &str) -> Result<Option<Light>, UnknownLight> {
    if word == DARK {
        return Ok(None);
    }
    let index = names.iter().position(|name| *name == word);
    index.and_then(Light::new).map(Some).ok_or_else(|| UnknownLight::new(word, names))
}

/// A word that names no lamp of a layout.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("found light {found:?}, wanted {wanted}")]
pub struct UnknownLight {
    /// The word.
    pub found: String,
    /// The names of the layout, and `dark`.
    pub wanted: String,
}

impl UnknownLight {
    fn new(found: &str, names: &[&str]) -> Self {
        Self { found: found.to_owned(), wanted: format!("{} or {DARK}", names.join(", ")) }
    }
}

/// The colour of a lamp. A fixture of several channels is several lamps at one place.
///
/// ```
/// use tropism::lamps::Colour;
/// assert!(Colour::White.steers() && !Colour::Red.steers()); // phototropins absorb blue light
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Colour {
    /// 400 to 500 nm, to which shoots bend; that of a lamp of which nothing else is said.
    #[default]
    Blue,
    /// All of daylight, blue among it.
    White,
    /// 600 to 700 nm: feeds the plant.
    Red,
    /// 700 to 750 nm.
    FarRed,
}

impl Colour {
    /// Whether controllers choose among lamps of this colour: shoots bend to its blue light.
    #[must_use]
    pub const fn steers(self) -> bool {
        matches!(self, Self::Blue | Self::White)
    }

    /// Files leave out the usual colour.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
    fn is_usual(&self) -> bool {
        *self == Self::default()
    }
}

/// One lamp of a layout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    /// Name, used in files and figures: 1 to 24 letters, digits, `-` or `_`.
    pub name: String,
    /// Place in cm from the root: x to the right, y up from the soil, z towards the camera.
    pub at: [f64; 3],
    /// Colour. Blue if it is left out.
    #[serde(default, skip_serializing_if = "Colour::is_usual")]
    pub colour: Colour,
}

impl Lamp {
    /// A blue lamp `name` at `at`, in cm.
    #[must_use]
    pub fn new(name: &str, at: [f64; 3]) -> Self {
        Self { name: name.to_owned(), at, colour: Colour::Blue }
    }

    /// The same lamp in another colour.
    #[must_use]
    pub fn with_colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }
}

/// The lamps of a rig: 2 to 16, their names and places.
///
/// ```
/// use tropism::lamps::{Layout, Light};
/// let paper = Layout::wahby2016();
/// assert_eq!(paper.name(Some(Light::RIGHT)), "right");
/// assert_eq!(paper.mirrored(Light::RIGHT), Some(Light::LEFT));
/// assert_eq!(paper.parse("dark"), Ok(None));
/// let four = Layout::four_sides();
/// assert_eq!(four.mirrored(Light::FRONT), Some(Light::FRONT));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Vec<Lamp>", into = "Vec<Lamp>")]
pub struct Layout {
    lamps: Vec<Lamp>,
}

/// A layout that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// Too few or too many lamps.
    #[error("found {0} lamps, wanted 2 to {MAX_LAMPS}")]
    Count(usize),
    /// No lamp to which plants bend.
    #[error("no lamp is blue or white: plants do not bend to others")]
    NoneSteers,
    /// A name that files cannot hold, or `dark`.
    #[error("found a lamp named {0:?}, wanted 1 to 24 letters, digits, - or _, other than {DARK}")]
    Name(String),
    /// Two lamps of one name.
    #[error("two lamps are named {0:?}")]
    Twice(String),
    /// A place that is no place.
    #[error("lamp {name}: found at = {at:?}, wanted three finite numbers of cm")]
    Place {
        /// Name of the lamp.
        name: String,
        /// Its place, in cm.
        at: [f64; 3],
    },
}

/// Height of both lamps above the soil, in cm (section 2.1).
const HEIGHT_CM: f64 = 30.0;

/// Distance of each lamp to the root along x, in cm (section 2.1).
const ASIDE_CM: f64 = 35.0;

/// Distance from the pot's axis to the back wall, on which the lamps are placed, in cm (section 2.1).
const WALL_CM: f64 = 8.0;

impl Layout {
    /// A layout of `lamps`, in this order.
    ///
    /// # Errors
    /// [`LayoutError`] for a count, a name or a place that cannot be.
    pub fn new(lamps: Vec<Lamp>) -> Result<Self, LayoutError> {
        if !(2..=MAX_LAMPS).contains(&lamps.len()) {
            return Err(LayoutError::Count(lamps.len()));
        }
        if !lamps.iter().any(|lamp| lamp.colour.steers()) {
            return Err(LayoutError::NoneSteers);
        }
        for (number, Lamp { name, at, .. }) in lamps.iter().enumerate() {
            let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
            if name.is_empty() || name.len() > 24 || name == DARK || !name.chars().all(is_plain) {
                return Err(LayoutError::Name(name.clone()));
            }
            if lamps[..number].iter().any(|other| other.name == *name) {
                return Err(LayoutError::Twice(name.clone()));
            }
            if !at.iter().all(|value| value.is_finite()) {
                return Err(LayoutError::Place { name: name.clone(), at: *at });
            }
        }
        Ok(Self { lamps })
    }

    /// The paper's two lamps, `left` and `right`, at the back wall (section 2.1).
    #[must_use]
    pub fn wahby2016() -> Self {
        let aside = |name, x| Lamp::new(name, [x, HEIGHT_CM, -WALL_CM]);
        Self { lamps: vec![aside("left", -ASIDE_CM), aside("right", ASIDE_CM)] }
    }

    /// The paper's two lamps and two more, `front` and `back`, at the same height and the same distance from the plant.
    #[must_use]
    pub fn four_sides() -> Self {
        let mut lamps = Self::wahby2016().lamps;
        lamps.push(Lamp::new("front", [0.0, HEIGHT_CM, ASIDE_CM]));
        lamps.push(Lamp::new("back", [0.0, HEIGHT_CM, -ASIDE_CM]));
        Self { lamps }
    }

    /// The lamps in order.
    #[must_use]
    pub fn lamps(&self) -> &[Lamp] {
        &self.lamps
    }

    /// How many lamps there are, 2 to 16.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a layout has at least two lamps")]
    pub const fn len(&self) -> usize {
        self.lamps.len()
    }

    /// The lights of the layout, in the order of its lamps.
    pub fn lights(&self) -> impl ExactSizeIterator<Item = Light> + use<> {
        (0..self.lamps.len() as u8).map(Light)
    }

    /// The lights among which controllers choose: those of lamps whose [`Colour`] steers.
    pub fn steering(&self) -> impl Iterator<Item = Light> + use<'_> {
        self.lights().filter(|light| self.steers(*light))
    }

    fn steers(&self, light: Light) -> bool {
        self.lamps.get(light.index()).is_some_and(|lamp| lamp.colour.steers())
    }

    /// Whether `light` is one of this layout.
    #[must_use]
    pub const fn contains(&self, light: Light) -> bool {
        light.index() < self.lamps.len()
    }

    /// The word for `light` in files: the lamp's name, or `dark`.
    #[must_use]
    pub fn name(&self, light: Option<Light>) -> &str {
        match light {
            None => DARK,
            Some(light) => self.lamps.get(light.index()).map_or(light.standard_name(), |lamp| &lamp.name),
        }
    }

    /// The light that a word in a file stands for; `None` is `dark`.
    ///
    /// # Errors
    /// [`UnknownLight`] names the word and the names of this layout.
    pub fn parse(&self, word: &str) -> Result<Option<Light>, UnknownLight> {
        let names: Vec<&str> = self.lamps.iter().map(|lamp| lamp.name.as_str()).collect();
        parse_among(&names, word)
    }

    /// The light that `light` is in a mirror (x changes sign); `None` where no lamp of its colour stands at the mirrored place.
    #[must_use]
    pub fn mirrored(&self, light: Light) -> Option<Light> {
        /// Two places are one within this, in cm. Chosen: less than the size of a lamp.
        const SAME_CM: f64 = 0.5;
        let Lamp { at: [x, y, z], colour, .. } = *self.lamps.get(light.index())?;
        let is_image = |lamp: &Lamp| {
            let apart = [lamp.at[0] + x, lamp.at[1] - y, lamp.at[2] - z];
            lamp.colour == colour && apart.iter().all(|apart| apart.abs() <= SAME_CM)
        };
        self.lamps.iter().position(is_image).and_then(Light::new)
    }

    /// Whether every lamp that steers has a mirror image in the layout, so that tracks may be mirrored (section 2.2.3).
    #[must_use]
    pub fn is_symmetric(&self) -> bool {
        self.steering().all(|light| self.mirrored(light).is_some())
    }

    /// The turns about the vertical and the mirrors that bring each lamp, seen from above, to about where another one stands:
    /// matrices for (x, z), the identity among them. In such an image an experiment is one under the same lamps.
    ///
    /// "About" is a third of the angle between lamps that stand evenly around the plant: the paper's two stand 8 cm behind it.
    /// Lamps right above the root stay where they are, and lamps that do not steer do not count.
    ///
    /// ```
    /// use tropism::lamps::Layout;
    /// assert_eq!(Layout::four_sides().symmetries().len(), 8); // those of a square
    /// assert!(Layout::wahby2016().symmetries().contains(&[[-1.0, 0.0], [0.0, 1.0]])); // the mirror of section 2.2.3
    /// ```
    #[must_use]
    pub fn symmetries(&self) -> Vec<[[f64; 2]; 2]> {
        let around = |lamp: &Lamp| {
            let [x, _, z] = lamp.at;
            (lamp.colour.steers() && hypot(x, z) > 0.0).then(|| atan2(z, x))
        };
        let angles: Vec<f64> = self.lamps.iter().filter_map(around).collect();
        let about = TAU / (3 * angles.len().max(1)) as f64;
        let apart = |one: f64, other: f64| {
            let turned: f64 = one - other;
            (turned - TAU * (turned / TAU).round()).abs()
        };
        // Each lamp is the image of one alone.
        let is_symmetry = |image: &dyn Fn(f64) -> f64| {
            let mut taken = vec![false; angles.len()];
            angles.iter().all(|&angle| {
                let is_there = |&lamp: &usize| !taken[lamp] && apart(image(angle), angles[lamp]) <= about;
                let found = (0..angles.len()).find(is_there);
                found.is_some_and(|lamp| {
                    taken[lamp] = true;
                    true
                })
            })
        };
        let exact = |value: f64| if (value - value.round()).abs() < 1e-9 { value.round() } else { value };
        let count = angles.len().max(1);
        let mut found = Vec::new();
        for number in 0..count {
            let turn = TAU * number as f64 / count as f64;
            if is_symmetry(&|angle| angle + turn) {
                let (sin, cos) = (exact(sin(turn)), exact(cos(turn)));
                found.push([[cos, -sin], [sin, cos]]);
            }
        }
        // A mirror takes an angle to `turn` less it. Its line stands at half of `turn`: at a lamp, or between two.
        for number in 0..2 * count {
            let turn = TAU * number as f64 / (2 * count) as f64;
            if is_symmetry(&|angle| turn - angle) {
                let (sin, cos) = (exact(sin(turn)), exact(cos(turn)));
                found.push([[cos, sin], [sin, -cos]]);
            }
        }
        found
    }

    /// The side to which a lamp draws: the sign of its x, 0 in the middle and for a lamp that does not steer.
    #[must_use]
    pub fn side(&self, light: Light) -> f64 {
        let x =
            self.lamps.get(light.index()).filter(|lamp| lamp.colour.steers()).map_or(0.0, |lamp| lamp.at[0]);
        if x == 0.0 { 0.0 } else { x.signum() }
    }

    /// The lamp that draws to the side of `x`: of those that steer the one whose x is least or greatest.
    #[must_use]
    pub fn towards(&self, is_right: bool) -> Light {
        let sign = if is_right { 1.0 } else { -1.0 };
        let reach = |light: &Light| sign * self.lamps[light.index()].at[0];
        self.steering().max_by(|a, b| reach(a).total_cmp(&reach(b)).then(b.cmp(a))).unwrap_or(Light::LEFT)
    }

    /// The lamp that steers and whose direction from the root, seen from above, is nearest to that of (x, z).
    ///
    /// ```
    /// use tropism::lamps::{Layout, Light};
    /// let four = Layout::four_sides();
    /// assert_eq!(four.along(0.5, 2.0), Light::FRONT);
    /// assert_eq!(four.along(-1.0, 0.0), Light::LEFT);
    /// ```
    #[must_use]
    pub fn along(&self, x: f64, z: f64) -> Light {
        let cosine = |light: &Light| {
            let [lamp_x, _, lamp_z] = self.lamps[light.index()].at;
            let far = hypot(lamp_x, lamp_z);
            if far > 0.0 { (lamp_x * x + lamp_z * z) / far } else { 0.0 }
        };
        self.steering().max_by(|a, b| cosine(a).total_cmp(&cosine(b)).then(b.cmp(a))).unwrap_or(Light::LEFT)
    }
}

impl Default for Layout {
    /// The paper's.
    fn default() -> Self {
        Self::wahby2016()
    }
}

impl TryFrom<Vec<Lamp>> for Layout {
    type Error = LayoutError;

    fn try_from(lamps: Vec<Lamp>) -> Result<Self, LayoutError> {
        Self::new(lamps)
    }
}

impl From<Layout> for Vec<Lamp> {
    fn from(layout: Layout) -> Self {
        layout.lamps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for layout in [Layout::wahby2016(), Layout::four_sides()] {
            for light in layout.lights() {
                assert_eq!(Light::of_letter(light.letter()), Some(light));
                assert_eq!(layout.parse(layout.name(Some(light))), Ok(Some(light)));
                assert_eq!(
                    serde_json::from_value::<Light>(serde_json::to_value(light).unwrap()).unwrap(),
                    light
                );
            }
            assert_eq!(layout.parse(layout.name(None)), Ok(None));
        }
        let error = Layout::wahby2016().parse("front").unwrap_err().to_string();
        assert_eq!(error, "found light \"front\", wanted left, right or dark");
    }

    #[test]
    fn a_mirror_is_its_own_inverse() {
        let three = Layout::new(vec![
            Lamp::new("north", [-20.0, 10.0, 0.0]),
            Lamp::new("top", [0.0, 80.0, 0.0]),
            Lamp::new("south", [20.0, 10.0, 0.0]),
        ]);
        for layout in [Layout::wahby2016(), Layout::four_sides(), three.unwrap()] {
            assert!(layout.is_symmetric());
            for light in layout.lights() {
                assert_eq!(layout.mirrored(layout.mirrored(light).unwrap()), Some(light));
            }
        }
        let alone = vec![Lamp::new("a", [3.0, 10.0, 0.0]), Lamp::new("b", [0.0, 10.0, 0.0])];
        assert!(!Layout::new(alone).unwrap().is_symmetric());
    }

    #[test]
    fn symmetries_bring_lamps_to_lamps() {
        let around = |count: usize| {
            let angle = |number: usize| TAU * (number as f64 + 0.05) / count as f64;
            let lamp = |number| {
                let (sin, cos) = (sin(angle(number)), cos(angle(number)));
                Lamp::new(&format!("lamp{number}"), [30.0 * cos, 20.0, 30.0 * sin])
            };
            Layout::new((0..count).map(lamp).collect()).unwrap()
        };
        for count in 3..=8 {
            let found = around(count).symmetries();
            assert_eq!((found.len(), found[0]), (2 * count, [[1.0, 0.0], [0.0, 1.0]]), "{count} lamps");
        }
        let lamps = vec![Lamp::new("a", [3.0, 10.0, 0.0]), Lamp::new("b", [0.0, 10.0, 3.0])];
        // Two lamps at a right angle: no turn, and the mirror that swaps them.
        let found = Layout::new(lamps).unwrap().symmetries();
        assert_eq!(found, [[[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]]);
    }

    #[test]
    fn the_lamp_on_a_side_is_the_outermost() {
        for layout in [Layout::wahby2016(), Layout::four_sides()] {
            assert_eq!((layout.towards(false), layout.towards(true)), (Light::LEFT, Light::RIGHT));
            assert_eq!((layout.side(Light::LEFT), layout.side(Light::RIGHT)), (-1.0, 1.0));
        }
    }

    #[test]
    fn a_red_lamp_steers_nothing_and_has_a_red_image() {
        let [left, right] = Layout::wahby2016().lamps.try_into().unwrap();
        let top = Lamp::new("top", [-60.0, 80.0, 0.0]).with_colour(Colour::Red);
        let layout = Layout::new(vec![top, left, right]).unwrap();
        let [top, left, right] = layout.lights().collect::<Vec<_>>().try_into().unwrap();
        assert_eq!(
            (layout.towards(false), layout.towards(true), layout.along(-1.0, 0.0)),
            (left, right, left)
        );
        assert_eq!((layout.side(top), layout.side(left)), (0.0, -1.0));
        assert!(layout.is_symmetric() && layout.mirrored(top).is_none());
        assert_eq!(layout.steering().collect::<Vec<_>>(), [left, right]);
        assert_eq!(layout.symmetries(), Layout::wahby2016().symmetries());
        let pair = ["a", "b"].map(|name| Lamp::new(name, [if name == "a" { -9.0 } else { 9.0 }, 10.0, 0.0]));
        let [a, b] = pair;
        assert!(!Layout::new(vec![a, b.with_colour(Colour::Red)]).unwrap().is_symmetric());
        let text = serde_json::to_string(&layout).unwrap();
        assert!(text.contains(r#""colour":"red""#) && !text.contains("blue"), "{text}");
        assert_eq!(serde_json::from_str::<Layout>(&text).unwrap(), layout);
    }

    #[test]
    fn layouts_that_cannot_be_are_refused() {
        let lamp = |name: &str| Lamp::new(name, [0.0; 3]);
        let error = |lamps: &[Lamp]| Layout::new(lamps.to_vec()).unwrap_err().to_string();
        assert!(error(&[lamp("a")]).contains("found 1 lamps, wanted 2 to 16"));
        assert!(error(&["a", "b"].map(|name| lamp(name).with_colour(Colour::Red))).contains("do not bend"));
        assert!(error(&[lamp("a"), lamp("dark")]).contains("\"dark\""));
        assert!(error(&[lamp("a"), lamp("b c")]).contains("\"b c\""));
        assert!(error(&[lamp("a"), lamp("a")]).contains("two lamps are named \"a\""));
        assert!(error(&[lamp("a"), Lamp::new("b", [f64::NAN, 0.0, 0.0])]).contains("lamp b"));
        let text = serde_json::to_string(&Layout::four_sides()).unwrap();
        assert_eq!(serde_json::from_str::<Layout>(&text).unwrap(), Layout::four_sides());
        assert!(serde_json::from_str::<Layout>("[]").is_err());
    }
}
