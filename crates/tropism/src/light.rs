//! Which lamp is lit: the paper's lighting condition C.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The lamp that is lit, as the camera sees it.
///
/// The paper's C is "whether the right light is on" (section 2.2.3): `Right` is its `true`.
/// A dark tent is `Option::<Light>::None`, never a third light: exactly one lamp is lit at every step of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Light {
    /// The lamp at negative x.
    Left,
    /// The lamp at positive x.
    Right,
}

impl Light {
    /// Both lights, left first.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// The other lamp: what this one is in a mirror.
    ///
    /// ```
    /// use tropism::light::Light;
    /// assert_eq!(Light::Left.mirrored(), Light::Right);
    /// ```
    #[must_use]
    pub const fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// The sign of the lamp's x: −1 for left, 1 for right.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Left => -1.0,
            Self::Right => 1.0,
        }
    }

    /// `left` or `right`, as in every file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

impl fmt::Display for Light {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A word that names no light.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("found light {0:?}, wanted left, right or dark")]
pub struct UnknownLight(pub String);

/// A light as files spell it: `left`, `right`, or `dark` for none.
///
/// # Errors
/// [`UnknownLight`] for any other word.
pub fn parse(word: &str) -> Result<Option<Light>, UnknownLight> {
    match word {
        "dark" => Ok(None),
        _ => word.parse().map(Some),
    }
}

/// The spelling of a light in files: `left`, `right`, or `dark` for none.
#[must_use]
pub fn name(light: Option<Light>) -> &'static str {
    light.map_or("dark", Light::name)
}

impl FromStr for Light {
    type Err = UnknownLight;

    fn from_str(word: &str) -> Result<Self, UnknownLight> {
        match word {
            "left" => Ok(Self::Left),
            "right" => Ok(Self::Right),
            _ => Err(UnknownLight(word.to_owned())),
        }
    }
}
