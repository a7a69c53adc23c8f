//! Status of a photograph after detection and tracking.

use serde::{Deserialize, Serialize};

/// Status of one photograph: `Ok`, or why its tip is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// The clicked tip is followed and accepted, but the usual detection takes another place for the tip.
    Disputed,
    /// The plant is detected and accepted, but the interval since the photograph before is not the period.
    ClockGap,
}

words! {
    FrameStatus, "status": Ok = "ok", Corrupt = "corrupt", Foreign = "foreign", Dark = "dark", NoPlant = "no_plant",
    Repeated = "repeated", Ambiguous = "ambiguous", Hidden = "hidden", LeavesView = "leaves_view", Jump = "jump",
    Disputed = "disputed", ClockGap = "clock_gap",
}
