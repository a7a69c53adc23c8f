//! Lighting: the levels of all lamps of a layout, and which lightings a rig allows.
//!
//! A [`Light`] is the one lamp that is fully lit, as in the paper. A [`Lighting`] is the general case: each lamp has a level
//! from 0 to 255, as 8-bit dimmers have. [`Allowed::One`] is the default of every rig: exactly the lightings that a [`Light`]
//! or darkness can be. [`Beam`] is the cone of a lamp or a sensor.

use std::fmt::{self, Write};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::check::{self, OutOfRange};
use crate::lamps::{self, DARK, Layout, Light, MAX_LAMPS, UnknownLight};
use crate::math::vector::{Vec3, dot, norm, sub};
use crate::math::{cos, exp, ln};

/// The level of a lamp at full power.
pub const FULL: u8 = u8::MAX;

/// The levels of all lamps of a layout, 0 (dark) to 255 (full power), in the order of the layout.
///
/// ```
/// use tropism::lamps::{Layout, Light};
/// use tropism::lighting::Lighting;
/// let four = Layout::four_sides();
/// let dusk = Lighting::DARK.with(Light::LEFT, 128).with(Light::BACK, 255);
/// assert_eq!(dusk.word(&four), "left:128+back");
/// assert_eq!(Lighting::parse("left:128+back", &four), Ok(dusk));
/// assert_eq!(Lighting::only(Light::LEFT).word(&four), "left");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Lighting([u8; MAX_LAMPS]);

impl Lighting {
    /// No lamp is lit.
    pub const DARK: Self = Self([0; MAX_LAMPS]);

    /// One lamp at full power, all others dark.
    #[must_use]
    pub const fn only(light: Light) -> Self {
        Self::DARK.with(light, FULL)
    }

    /// The same lighting, but for the level of one lamp.
    #[must_use]
    pub const fn with(mut self, light: Light, level: u8) -> Self {
        self.0[light.index()] = level;
        self
    }

    /// The level of a lamp, 0 to 255.
    #[must_use]
    pub const fn level(self, light: Light) -> u8 {
        self.0[light.index()]
    }

    /// The levels in the order of the layout; 0 for places without a lamp.
    #[must_use]
    pub const fn levels(self) -> [u8; MAX_LAMPS] {
        self.0
    }

    /// The lamps that are lit and their levels, in the order of the layout.
    pub fn lit(self) -> impl Iterator<Item = (Light, u8)> {
        self.0
            .into_iter()
            .enumerate()
            .filter_map(|(index, level)| Light::new(index).map(|light| (light, level)))
            .filter(|(_, level)| *level > 0)
    }

    /// The lightings of the paper: one lamp at full power, or darkness; `None` for any other lighting.
    #[must_use]
    #[inline]
    pub fn single(self) -> Option<Option<Light>> {
        // Asked once a simulated step: all levels are compared at once.
        let levels = u128::from_le_bytes(self.0);
        if levels == 0 {
            return Some(None);
        }
        let index = levels.trailing_zeros() as usize / 8;
        (levels == u128::from(FULL) << (8 * index)).then(|| Light::new(index))
    }

    /// The one lamp at full power, for a world or a model that knows no other light.
    ///
    /// # Panics
    /// For all other lightings.
    #[must_use]
    pub fn one_lamp(self) -> Light {
        self.single().flatten().unwrap_or_else(|| {
            panic!("found the lighting {self}, wanted one lamp at full power: nothing else is known here")
        })
    }

    /// The brightest lamp, the first of equals; `None` in the dark.
    #[must_use]
    pub fn brightest(self) -> Option<Light> {
        self.lit().max_by(|(a, one), (b, other)| one.cmp(other).then(b.cmp(a))).map(|(light, _)| light)
    }

    /// The lighting that this one is in a mirror, as [`Layout::mirrored`]; `None` where a lit lamp has no mirror image.
    #[must_use]
    pub fn mirrored(self, layout: &Layout) -> Option<Self> {
        self.lit()
            .try_fold(Self::DARK, |image, (light, level)| Some(image.with(layout.mirrored(light)?, level)))
    }

    /// The lamps of `layout` alone.
    #[must_use]
    pub fn within(self, layout: &Layout) -> Self {
        self.lit()
            .filter(|(light, _)| layout.contains(*light))
            .fold(Self::DARK, |lighting, (light, level)| lighting.with(light, level))
    }

    /// The light to which a plant bends: the one lamp that steers and is lit, if at full power, or none; `None` where several
    /// steer or a level is below it. Lamps of other colours do not count.
    ///
    /// ```
    /// use tropism::lamps::{Colour, Lamp, Layout, Light};
    /// use tropism::lighting::Lighting;
    /// let mut lamps = Layout::wahby2016().lamps().to_vec();
    /// lamps.push(Lamp::new("top", [0.0, 80.0, 0.0]).with_colour(Colour::Red));
    /// let layout = Layout::new(lamps).unwrap();
    /// assert_eq!(Lighting::parse("left+top:40", &layout).unwrap().bending(&layout), Some(Some(Light::LEFT)));
    /// assert_eq!(Lighting::parse("left:40+top", &layout).unwrap().bending(&layout), None);
    /// ```
    #[must_use]
    pub fn bending(self, layout: &Layout) -> Option<Option<Light>> {
        layout.steering().fold(Self::DARK, |lit, light| lit.with(light, self.level(light))).single()
    }

    /// Each lamp at the level that `level` makes of its levels in both.
    #[must_use]
    pub fn zip(self, other: Self, level: impl Fn(u8, u8) -> u8) -> Self {
        Self(std::array::from_fn(|index| level(self.0[index], other.0[index])))
    }

    /// Powers of the lamps as shares of full power, 0 to 1.
    #[must_use]
    pub fn powers(self) -> [f64; MAX_LAMPS] {
        self.0.map(|level| f64::from(level) / f64::from(FULL))
    }

    /// Sum of the levels over 255: the power in units of one fully lit lamp.
    #[must_use]
    pub fn total(self) -> f64 {
        f64::from(self.0.iter().map(|&level| u32::from(level)).sum::<u32>()) / f64::from(FULL)
    }

    /// The commands that bring lamps from this lighting to `next`: first all that lower a level, then all that raise one.
    ///
    /// In between no lamp is above both its old and its new level, and the levels are at most the old ones all over or at
    /// most the new ones all over. So where [`Allowed`] permits both lightings, it permits all in between.
    pub fn switching(self, next: Self) -> impl Iterator<Item = (Light, u8)> {
        let changes = move |is_lowering: bool| {
            (0..MAX_LAMPS).filter_map(Light::new).filter_map(move |light| {
                let (old, new) = (self.level(light), next.level(light));
                (old != new && (new < old) == is_lowering).then_some((light, new))
            })
        };
        changes(true).chain(changes(false))
    }

    /// The word for this lighting in files: `dark`, the name of the one lamp at full power, or lamps with levels, such as
    /// `n1:128+n4`. A lamp without a level is at full power.
    #[must_use]
    pub fn word(self, layout: &Layout) -> String {
        self.written(|light| layout.name(Some(light)))
    }

    fn written<'n>(self, name: impl Fn(Light) -> &'n str) -> String {
        let mut word = String::new();
        for (light, level) in self.lit() {
            let plus = if word.is_empty() { "" } else { "+" };
            let _ = write!(word, "{plus}{}", name(light));
            if level < FULL {
                let _ = write!(word, ":{level}");
            }
        }
        if word.is_empty() { DARK.to_owned() } else { word }
    }

    /// The lighting that a word in a file stands for.
    ///
    /// # Errors
    /// [`LightingError`] names the part that is wrong.
    pub fn parse(word: &str, layout: &Layout) -> Result<Self, LightingError> {
        Self::read(word, |name| layout.parse(name))
    }

    fn read(
        word: &str,
        lamp: impl Fn(&str) -> Result<Option<Light>, UnknownLight>,
    ) -> Result<Self, LightingError> {
        if word == DARK {
            return Ok(Self::DARK);
        }
        let mut lighting = Self::DARK;
        for part in word.split('+') {
            let (name, level) = match part.split_once(':') {
                None => (part, FULL),
                Some((name, digits)) => {
                    let is_plain = !digits.starts_with('+');
                    let level = digits.parse::<u8>().ok().filter(|&level| level > 0 && is_plain);
                    (name, level.ok_or_else(|| LightingError::Level { part: part.to_owned() })?)
                }
            };
            let light = match lamp(name) {
                Ok(Some(light)) => light,
                Ok(None) => return Err(LightingError::Dark { word: word.to_owned() }),
                Err(unknown) => return Err(unknown.into()),
            };
            if lighting.level(light) > 0 {
                return Err(LightingError::Twice { name: name.to_owned() });
            }
            lighting = lighting.with(light, level);
        }
        Ok(lighting)
    }
}

impl fmt::Display for Lighting {
    /// The word with the [standard names](Light::standard_name) of the lamps, for files that carry no layout.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.written(Light::standard_name))
    }
}

impl FromStr for Lighting {
    type Err = LightingError;

    /// Reads what `Display` writes.
    fn from_str(word: &str) -> Result<Self, LightingError> {
        Self::read(word, lamps::parse)
    }
}

impl Serialize for Lighting {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Lighting {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        std::borrow::Cow::<str>::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl From<Light> for Lighting {
    fn from(light: Light) -> Self {
        Self::only(light)
    }
}

impl From<Option<Light>> for Lighting {
    fn from(light: Option<Light>) -> Self {
        light.map_or(Self::DARK, Self::only)
    }
}

/// A word that stands for no lighting of a layout.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LightingError {
    /// A part names no lamp.
    #[error(transparent)]
    Lamp(#[from] UnknownLight),
    /// A level out of range.
    #[error("found light {part:?}, wanted a level from 1 to 255 after the colon")]
    Level {
        /// The part of the word.
        part: String,
    },
    /// A lamp stands twice.
    #[error("lamp {name:?} stands twice")]
    Twice {
        /// The lamp.
        name: String,
    },
    /// Darkness beside a lamp.
    #[error("found light {word:?}, wanted `{DARK}` alone or names of lamps")]
    Dark {
        /// The word.
        word: String,
    },
}

/// Which lightings a rig allows. In files: `"one"`, or `{ any = { most_lit = 3, budget = 1.5 } }`.
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Allowed {
    /// One lamp at full power, or darkness, as in the paper.
    #[default]
    One,
    /// Any levels within limits.
    Any {
        /// Most lamps that may be lit at once, from 1 on.
        most_lit: u8,
        /// Most power, in units of one fully lit lamp: the limit of the power supply. From 1/255 on.
        budget: f64,
    },
}

/// A lighting that a rig does not allow.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotAllowed {
    /// Levels or several lamps where one lamp at full power is allowed.
    #[error(
        "found {lit} lit lamps with a total of {total:.2} full lamps, wanted one lamp at full power or darkness"
    )]
    Several {
        /// Number of lit lamps.
        lit: usize,
        /// Their power, in units of one fully lit lamp.
        total: f64,
    },
    /// Too many lamps.
    #[error("found {lit} lit lamps, wanted at most {most} (`most_lit`)")]
    TooMany {
        /// Number of lit lamps.
        lit: usize,
        /// The limit.
        most: u8,
    },
    /// Too much power.
    #[error("found a power of {total:.2} full lamps, wanted at most {budget} (`budget`)")]
    OverBudget {
        /// The power, in units of one fully lit lamp.
        total: f64,
        /// The limit.
        budget: f64,
    },
}

impl Allowed {
    /// Checks the limits themselves.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match *self {
            Self::One => Ok(()),
            Self::Any { most_lit, budget } => {
                check::within("most_lit", most_lit, 1..=MAX_LAMPS as u8)?;
                check::within("budget", budget, 1.0 / f64::from(FULL)..=MAX_LAMPS as f64)
            }
        }
    }

    /// Checks that `lighting` is allowed.
    ///
    /// # Errors
    /// [`NotAllowed`] says which limit it exceeds.
    pub fn permit(&self, lighting: Lighting) -> Result<(), NotAllowed> {
        let (lit, total) = (lighting.lit().count(), lighting.total());
        match *self {
            Self::One if lighting.single().is_none() => Err(NotAllowed::Several { lit, total }),
            Self::Any { most_lit, .. } if lit > most_lit.into() => {
                Err(NotAllowed::TooMany { lit, most: most_lit })
            }
            Self::Any { budget, .. } if total > budget => Err(NotAllowed::OverBudget { total, budget }),
            _ => Ok(()),
        }
    }

    /// Whether this is the default, which files leave out.
    #[must_use]
    pub fn is_one(&self) -> bool {
        *self == Self::One
    }
}

/// The cone of a lamp or of a sensor: a power of the cosine to its axis, one half at `half_angle_deg`, nothing behind.
///
/// Data sheets of LEDs and infrared receivers state this half angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beam {
    /// Direction of the axis; its length does not matter.
    pub facing: Vec3,
    /// Angle to the axis at which half of the intensity is left, in degrees: 1 to 80.
    pub half_angle_deg: f64,
}

impl Beam {
    /// Checks direction and angle.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let length = norm(self.facing);
        check::ensure(
            length > 0.0 && length.is_finite(),
            "facing",
            format!("{:?}", self.facing),
            "three finite numbers that are not all 0",
        )?;
        check::within("half_angle_deg", self.half_angle_deg, 1.0..=80.0)
    }

    /// The power of the cosine.
    #[must_use]
    pub fn exponent(&self) -> f64 {
        -core::f64::consts::LN_2 / ln(cos(self.half_angle_deg.to_radians()))
    }

    /// Share of the intensity on the axis, 0 to 1, that a source at `from` has in the direction of `place`; 1 at the source.
    #[must_use]
    pub fn share(&self, from: Vec3, place: Vec3) -> f64 {
        let towards = sub(place, from);
        let far = norm(towards);
        if far == 0.0 {
            return 1.0;
        }
        let cosine = (dot(towards, self.facing) / (far * norm(self.facing))).min(1.0);
        if cosine > 0.0 { exp(self.exponent() * ln(cosine)) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lamps::Lamp;

    fn layout() -> Layout {
        Layout::new((1..=MAX_LAMPS).map(|number| Lamp::new(&format!("n{number}"), [0.0; 3])).collect())
            .unwrap()
    }

    /// Levels of which many are 0 and some 255.
    fn lighting() -> impl Strategy<Value = Lighting> {
        let level = prop_oneof![3 => Just(0), 1 => Just(FULL), 2 => any::<u8>()];
        proptest::array::uniform::<_, MAX_LAMPS>(level).prop_map(Lighting)
    }

    fn piece() -> impl Strategy<Value = &'static str> {
        proptest::sample::select(vec!["dark", "n1", "n9", ":", "+", "0", "7", "128", "256", "left"])
    }

    proptest! {
        #[test]
        fn words_are_read_as_they_are_written(lighting in lighting()) {
            let layout = layout();
            prop_assert_eq!(Lighting::parse(&lighting.word(&layout), &layout), Ok(lighting));
            prop_assert_eq!(lighting.to_string().parse(), Ok(lighting));
        }

        #[test]
        fn no_word_makes_the_reader_panic(pieces in proptest::collection::vec(piece(), 0..7)) {
            let word = pieces.concat();
            if let Ok(lighting) = Lighting::parse(&word, &layout()) {
                prop_assert!(lighting != Lighting::DARK || word == "dark");
            }
        }

        /// Whatever is allowed at both ends is allowed in between.
        #[test]
        fn switching_never_exceeds_what_is_allowed_before_and_after(
            from in lighting(), to in lighting(), most_lit in 1_u8..=16, budget in 0.1..16.0,
        ) {
            let allowed = Allowed::Any { most_lit, budget };
            let both = allowed.permit(from).and(allowed.permit(to)).is_ok();
            let (mut now, mut is_raising) = (from, false);
            for (light, level) in from.switching(to) {
                is_raising |= level > now.level(light);
                prop_assert_eq!(is_raising, level > now.level(light), "first lower, then raise");
                now = now.with(light, level);
                prop_assert!(!both || allowed.permit(now).is_ok(), "{:?}", now);
                prop_assert!(now.total() <= from.total().max(to.total()));
            }
            prop_assert_eq!(now, to);
        }

        #[test]
        fn one_is_exactly_what_a_light_can_be(lighting in lighting(), light in 0_usize..17) {
            let light = Light::new(light);
            prop_assert_eq!(Lighting::from(light).single(), Some(light));
            prop_assert!(Allowed::One.permit(Lighting::from(light)).is_ok());
            prop_assert_eq!(Allowed::One.permit(lighting).is_ok(), lighting.single().is_some());
        }

        #[test]
        fn a_beam_falls_from_its_axis_to_half_and_to_nothing(half_angle_deg in 1.0..80.0, far in 0.1..50.0) {
            let beam = Beam { facing: [0.0, 0.0, 3.0], half_angle_deg };
            let at = |degrees: f64| {
                let angle = degrees.to_radians();
                beam.share([1.0, 2.0, 3.0], [1.0 + far * crate::math::sin(angle), 2.0, 3.0 + far * cos(angle)])
            };
            prop_assert!((at(0.0) - 1.0).abs() < 1e-9 && (at(half_angle_deg) - 0.5).abs() < 1e-6);
            prop_assert!(at(0.5 * half_angle_deg) > at(half_angle_deg) && at(120.0) == 0.0);
        }
    }

    #[test]
    fn words_of_todays_files_stay_as_they_are() {
        for layout in [Layout::wahby2016(), Layout::four_sides()] {
            for light in layout.lights().map(Some).chain([None]) {
                assert_eq!(Lighting::from(light).word(&layout), layout.name(light));
                assert_eq!(Lighting::parse(layout.name(light), &layout), Ok(light.into()));
            }
        }
    }

    #[test]
    fn a_mirror_exchanges_levels_and_the_brightest_lamp_is_the_first_of_equals() {
        let four = Layout::four_sides();
        let lighting = Lighting::DARK.with(Light::LEFT, 7).with(Light::FRONT, 9).with(Light::BACK, 9);
        assert_eq!(lighting.mirrored(&four).unwrap().word(&four), "right:7+front:9+back:9");
        assert_eq!((lighting.brightest(), Lighting::DARK.brightest()), (Some(Light::FRONT), None));
        assert_eq!(lighting.within(&Layout::wahby2016()).to_string(), "left:7");
    }

    #[test]
    fn wrong_words_are_named() {
        let problem = |word: &str| Lighting::parse(word, &Layout::wahby2016()).unwrap_err().to_string();
        assert_eq!(problem("front"), "found light \"front\", wanted left, right or dark");
        assert!(problem("left:0").contains("1 to 255"));
        assert!(problem("left:256").contains("\"left:256\""));
        assert!(problem("left+left:3").contains("twice"));
        assert!(problem("left+dark").contains("alone"));
        assert!(problem("").contains("found light \"\""));
    }

    #[test]
    fn limits_are_read_from_files_and_checked() {
        let read = |text: &str| serde_json::from_str::<Allowed>(text).unwrap();
        assert_eq!(read("\"one\""), Allowed::One);
        let any = read("{\"any\": {\"most_lit\": 2, \"budget\": 1.5}}");
        assert_eq!(any, Allowed::Any { most_lit: 2, budget: 1.5 });
        let both = Lighting::only(Light::LEFT).with(Light::RIGHT, 127);
        assert!(any.check().is_ok() && any.permit(both).is_ok());
        let error = any.permit(both.with(Light::RIGHT, FULL)).unwrap_err().to_string();
        assert_eq!(error, "found a power of 2.00 full lamps, wanted at most 1.5 (`budget`)");
        let error = Allowed::One.permit(both).unwrap_err().to_string();
        assert!(error.contains("found 2 lit lamps with a total of 1.50"), "{error}");
        let error = Allowed::Any { most_lit: 0, budget: 1.0 }.check().unwrap_err().to_string();
        assert_eq!(error, "found most_lit = 0, wanted 1 to 16");
    }
}
