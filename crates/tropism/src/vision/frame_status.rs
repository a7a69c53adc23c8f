//! What became of a photograph.

use serde::{Deserialize, Serialize};

/// What became of one photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameStatus {
    /// A plant is seen.
    Ok,
    /// The file is empty, damaged or cut short.
    Corrupt,
    /// The file is no picture, or one of another size than the calibration holds for.
    Foreign,
    /// The picture is black: the flash or the camera failed.
    Dark,
    /// No plant is seen, as before emergence.
    NoPlant,
    /// The same bytes as the photograph before: the camera hangs.
    Repeated,
    /// Something looks otherwise than it can, as when a leaf, a fly or glare is in front of the plant.
    Ambiguous,
    /// The plant reaches out of the crop.
    LeavesView,
    /// The tip is farther from where it was than a plant can move.
    Jump,
    /// The tip is seen and believed, but the time since the photograph before is not the period.
    ClockGap,
}

impl FrameStatus {
    /// Every class.
    pub const ALL: [Self; 10] = [
        Self::Ok,
        Self::Corrupt,
        Self::Foreign,
        Self::Dark,
        Self::NoPlant,
        Self::Repeated,
        Self::Ambiguous,
        Self::LeavesView,
        Self::Jump,
        Self::ClockGap,
    ];

    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Corrupt => "corrupt",
            Self::Foreign => "foreign",
            Self::Dark => "dark",
            Self::NoPlant => "no_plant",
            Self::Repeated => "repeated",
            Self::Ambiguous => "ambiguous",
            Self::LeavesView => "leaves_view",
            Self::Jump => "jump",
            Self::ClockGap => "clock_gap",
        }
    }
}

impl std::fmt::Display for FrameStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for FrameStatus {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let class = Self::ALL.into_iter().find(|class| class.name() == word);
        class.ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            format!("found class {word:?}, wanted one of {}", names.join(", "))
        })
    }
}
