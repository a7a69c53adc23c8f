//! Status of a photograph after detection and tracking.

use serde::{Deserialize, Serialize};

/// Status of one photograph: `Ok`, or why its tip is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameStatus {
    /// The plant is detected and accepted.
    Ok,
    /// The file is empty, damaged or truncated.
    Corrupt,
    /// The file is not a picture, or its size is not that of the calibration.
    Foreign,
    /// The picture is black or much darker than the reference: flash or camera failed.
    Dark,
    /// No plant is detected, as before emergence.
    NoPlant,
    /// The bytes are those of the photograph before: the camera hangs.
    Repeated,
    /// The detection is implausible: a leaf, a fly, glare or mist may hide the tip.
    Ambiguous,
    /// A pole hides the tip.
    Hidden,
    /// The plant touches the upper, left or right edge of the crop: its tip may lie beyond.
    LeavesView,
    /// The tip lies outside the gate: farther from its last position than a plant can move.
    Jump,
    /// The plant is detected and accepted, but the interval since the photograph before is not the period.
    ClockGap,
}

impl FrameStatus {
    /// Every status.
    pub const ALL: [Self; 11] = [
        Self::Ok,
        Self::Corrupt,
        Self::Foreign,
        Self::Dark,
        Self::NoPlant,
        Self::Repeated,
        Self::Ambiguous,
        Self::Hidden,
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
            Self::Hidden => "hidden",
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
        let status = Self::ALL.into_iter().find(|status| status.name() == word);
        status.ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            format!("found status {word:?}, wanted one of {}", names.join(", "))
        })
    }
}
