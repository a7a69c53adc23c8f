//! Which faults a run tolerates before it asks its user, and how durable its files are.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::check::{self, OutOfRange};
use crate::geometry::Region;
use crate::lamps::Layout;
use crate::vision::tracking::hold::MAX_HELD_FRAMES;

/// Columns of the paper's photographs (section 2.1).
pub const COLUMNS: f64 = 2592.0;

/// The faults that a run tolerates, and for how long: the table `fault_policy` of a rig file. The default is for a real plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct FaultPolicy {
    /// Seconds by which a step may begin late; a later step is missed. Missed steps are never caught up with, so that there
    /// is at most one photograph and one decision in a period.
    pub late_s: f64,
    /// Minutes of downtime after which the run asks before it is resumed.
    pub gap_min: f64,
    /// What happens after a longer downtime, or one of unknown length.
    pub on_gap: OnDowntime,
    /// Steps in a row at which the last tip is carried forward, if the camera gave no photograph or the plant was not detected. After
    /// them nothing is decided until the plant is detected again.
    pub hold_steps: u32,
    /// The most photographs that are taken at one step, each with the flash lit anew, as long as they are dark.
    pub flash_tries: u32,
    /// Pixels by which the camera may move before an alert. They are counted in pictures of 2592 columns, as the paper's
    /// are; in others they scale with the width.
    pub moved_px: f64,
    /// Pixels by which the camera may move before the run pauses, counted as [`Self::moved_px`].
    pub moved_pause_px: f64,
    /// Temperature of the host computer before an alert, in degrees Celsius.
    pub hot_c: f64,
    /// What the lamps do while nothing is decided.
    pub on_fault: OnFault,
    /// Steps in a row without a detected plant, or with the wrong lamp in the photograph, before an alert.
    pub alert_steps: u32,
    /// Steps in a row with the same fault before the run pauses.
    pub pause_steps: u32,
    /// Megabytes of the disk that are reserved for the journal, and released when the disk is full.
    pub reserve_mb: u32,
    /// Megabytes of the disk that must be free when the run begins.
    pub free_mb: u32,
}

/// What happens after a long downtime.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum OnDowntime {
    /// The run pauses and asks its user.
    Pause,
    /// The run is resumed.
    Resume,
}

/// What the lamps do while nothing is decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum OnFault {
    /// The lit lamp stays lit.
    Hold,
    /// All lamps are dark.
    Dark,
}

impl Default for FaultPolicy {
    fn default() -> Self {
        Self {
            late_s: 60.0,
            gap_min: 30.0,
            on_gap: OnDowntime::Pause,
            hold_steps: MAX_HELD_FRAMES,
            flash_tries: 2,
            moved_px: 5.0,
            moved_pause_px: 20.0,
            hot_c: 80.0,
            on_fault: OnFault::Hold,
            alert_steps: 3,
            pause_steps: 12,
            reserve_mb: 64,
            free_mb: 500,
        }
    }
}

impl FaultPolicy {
    /// Tolerates everything, for a virtual plant: the last tip is always carried forward, and the run never pauses.
    #[must_use]
    pub const fn unlimited() -> Self {
        Self {
            late_s: f64::INFINITY,
            gap_min: f64::INFINITY,
            on_gap: OnDowntime::Resume,
            hold_steps: u32::MAX,
            flash_tries: 1,
            moved_px: f64::INFINITY,
            moved_pause_px: f64::INFINITY,
            hot_c: f64::INFINITY,
            on_fault: OnFault::Hold,
            alert_steps: u32::MAX,
            pause_steps: u32::MAX,
            reserve_mb: 0,
            free_mb: 0,
        }
    }

    /// Checks the values of a file.
    ///
    /// # Errors
    /// A line that names the key, its value and its range.
    pub fn check(&self) -> Result<(), String> {
        self.check_ranges().map_err(|error| error.to_string())
    }

    fn check_ranges(&self) -> Result<(), OutOfRange> {
        let key = |key: &str| format!("fault_policy.{key}");
        // The ends are chosen: a day, a year, the width of any photograph, the heat at which any computer has ended.
        for (name, found, most) in [
            ("late_s", self.late_s, 86_400.0),
            ("gap_min", self.gap_min, 525_600.0),
            ("moved_px", self.moved_px, 100_000.0),
            ("moved_pause_px", self.moved_pause_px, 100_000.0),
            ("hot_c", self.hot_c, 200.0),
        ] {
            let is_allowed = (0.0..=most).contains(&found) || found == f64::INFINITY;
            check::ensure(is_allowed, key(name), found, format!("0 to {most}, or inf"))?;
        }
        // A count as large as these never comes about: steps are minutes apart.
        for (name, found, range) in [
            ("hold_steps", self.hold_steps, 0..=u32::MAX),
            ("flash_tries", self.flash_tries, 1..=10),
            ("alert_steps", self.alert_steps, 1..=u32::MAX),
            ("pause_steps", self.pause_steps, 1..=u32::MAX),
            ("reserve_mb", self.reserve_mb, 0..=10_000),
            ("free_mb", self.free_mb, 0..=1_000_000),
        ] {
            check::within(key(name), found, range)?;
        }
        Ok(())
    }
}

/// What a power cut may cost a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Durability {
    /// Nothing: each step is on the disk before the next begins. For real plants.
    Full,
    /// The steps of the last seconds; a killed program still costs nothing. For virtual plants at full speed.
    Fast,
}

/// Regions of a photograph that show the lamps, by name: to compare the lit lamp with the commanded one.
///
/// Without regions, the outer thirds of the picture stand for a left and a right lamp.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(transparent)]
pub struct LampsInView(pub BTreeMap<String, Region>);

impl LampsInView {
    /// The regions in the order of `layout`; `None` unless each of its lamps has one.
    #[must_use]
    pub fn places(&self, layout: &Layout) -> Option<Vec<Region>> {
        layout.lamps().iter().map(|lamp| self.0.get(&lamp.name).copied()).collect()
    }

    /// Checks the regions for photographs of `width` x `height` and the lamps of `layout`.
    ///
    /// # Errors
    /// A line that says what was found and what was wanted.
    pub fn check(&self, width: usize, height: usize, layout: &Layout) -> Result<(), String> {
        let names: Vec<&str> = layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
        if let Some(name) = self.0.keys().find(|name| !names.contains(&name.as_str())) {
            return Err(format!(
                "lamps_in_view: found the place of {name}, wanted those of {}",
                names.join(", ")
            ));
        }
        if self.0.is_empty() && layout.len() > 2 {
            return Err(format!(
                "lamps_in_view: the places of {} lamps are missing: {}",
                layout.len(),
                names.join(", ")
            ));
        }
        if let Some(name) = names.iter().find(|name| !self.0.is_empty() && !self.0.contains_key(**name)) {
            return Err(format!(
                "lamps_in_view: the place of {name} is missing: give one for each lamp, or none"
            ));
        }
        match self.0.iter().find(|(_, place)| !place.fits(width, height)) {
            Some((name, place)) => Err(format!(
                "lamps_in_view.{name}: found {place:?}, wanted a place inside a picture of {width} x {height}"
            )),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_a_policy_has_a_range() {
        assert_eq!(FaultPolicy::default().check(), Ok(()));
        assert_eq!(FaultPolicy::unlimited().check(), Ok(()));
        for (text, problem) in [
            (r#"{"late_s": -1}"#, "found fault_policy.late_s = -1, wanted 0 to 86400, or inf"),
            (r#"{"gap_min": 1e9}"#, "found fault_policy.gap_min = 1000000000, wanted 0 to 525600, or inf"),
            (r#"{"hot_c": 1e6}"#, "found fault_policy.hot_c = 1000000, wanted 0 to 200, or inf"),
            (r#"{"flash_tries": 11}"#, "found fault_policy.flash_tries = 11, wanted 1 to 10"),
            (r#"{"pause_steps": 0}"#, "found fault_policy.pause_steps = 0, wanted 1 to 4294967295"),
            (r#"{"reserve_mb": 10001}"#, "found fault_policy.reserve_mb = 10001, wanted 0 to 10000"),
            (r#"{"free_mb": 4294967295}"#, "found fault_policy.free_mb = 4294967295, wanted 0 to 1000000"),
        ] {
            let policy: FaultPolicy = serde_json::from_str(text).unwrap();
            assert_eq!(policy.check(), Err(problem.to_owned()));
        }
    }

    #[test]
    fn lamps_in_view_are_all_lamps_of_the_layout_or_none() {
        let view = |text: &str| serde_json::from_str::<LampsInView>(text).unwrap();
        let place = r#"{"x": 1, "y": 2, "width": 3, "height": 4}"#;
        let both = view(&format!(r#"{{"left": {place}, "right": {place}}}"#));
        let (two, four) = (Layout::default(), Layout::four_sides());
        assert_eq!(both.check(10, 10, &two), Ok(()));
        assert_eq!(both.places(&two).unwrap().len(), 2);
        assert_eq!(LampsInView::default().check(10, 10, &two), Ok(()));
        assert_eq!(LampsInView::default().places(&two), None);
        let problem = |view: &LampsInView, layout: &Layout| view.check(10, 10, layout).unwrap_err();
        assert!(problem(&LampsInView::default(), &four).contains("the places of 4 lamps are missing"));
        assert!(problem(&both, &four).contains("the place of front is missing"));
        assert!(problem(&view(&format!(r#"{{"rigth": {place}}}"#)), &two).contains("the place of rigth"));
        assert!(both.check(3, 10, &two).unwrap_err().starts_with("lamps_in_view.left: found Region"));
    }
}
