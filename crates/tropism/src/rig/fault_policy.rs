//! How much a run bears before it asks its user.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::geometry::Region;
use crate::lamps::Layout;
use crate::vision::tracking::hold::MAX_HELD_FRAMES;

/// Columns of the paper's camera, section 2.1.
pub const COLUMNS: f64 = 2592.0;

/// What is borne, and for how long. The default is for a tent with a real plant in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FaultPolicy {
    /// Seconds by which a step may begin late. One that would be later is missed: it is never caught up with, so that
    /// there is never more than one photograph and one decision in a period.
    pub late_s: f64,
    /// Minutes without the program after which it asks before it goes on.
    pub gap_min: f64,
    /// What is done after a longer gap, or one of unknown length.
    pub on_gap: OnGap,
    /// Steps in a row for which the last sighting may stand in, where the camera gave no photograph or it shows no plant
    /// that can be believed. After them nothing is decided until the plant is seen.
    pub hold_steps: u32,
    /// Photographs that are taken at one step at most, the flash lit anew for each, as long as they are dark.
    pub flash_tries: u32,
    /// Pixels by which the camera may move until somebody is told, and until the run pauses, in pictures of
    /// 2592 columns, as the paper's are; in others as much of their width.
    pub moved_px: f64,
    /// See [`Self::moved_px`].
    pub moved_pause_px: f64,
    /// Degrees Celsius of the computer above which somebody is told.
    pub hot_c: f64,
    /// What the lamps do while nothing is decided.
    pub on_fault: OnFault,
    /// Steps in a row without a believed plant, or with the wrong lamp in the photograph, after which somebody is told.
    pub alert_steps: u32,
    /// Steps in a row with the same trouble after which the run pauses.
    pub pause_steps: u32,
    /// Megabytes of disk that are kept for the journal: given up when the disk is full.
    pub ballast_mb: u32,
    /// Megabytes of disk that must be free at the beginning.
    pub free_mb: u32,
}

/// After a long gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnGap {
    /// Ask.
    Pause,
    /// Go on.
    Resume,
}

/// While nothing is decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnFault {
    /// The lamp that is lit stays lit.
    Hold,
    /// All lamps are dark.
    Dark,
}

impl Default for FaultPolicy {
    fn default() -> Self {
        Self {
            late_s: 60.0,
            gap_min: 30.0,
            on_gap: OnGap::Pause,
            hold_steps: MAX_HELD_FRAMES,
            flash_tries: 2,
            moved_px: 5.0,
            moved_pause_px: 20.0,
            hot_c: 80.0,
            on_fault: OnFault::Hold,
            alert_steps: 3,
            pause_steps: 12,
            ballast_mb: 64,
            free_mb: 500,
        }
    }
}

impl FaultPolicy {
    /// For a virtual plant, which waits for nobody: the last sighting always stands in, and nothing is asked.
    #[must_use]
    pub const fn unlimited() -> Self {
        Self {
            late_s: f64::INFINITY,
            gap_min: f64::INFINITY,
            on_gap: OnGap::Resume,
            hold_steps: u32::MAX,
            flash_tries: 1,
            moved_px: f64::INFINITY,
            moved_pause_px: f64::INFINITY,
            hot_c: f64::INFINITY,
            on_fault: OnFault::Hold,
            alert_steps: u32::MAX,
            pause_steps: u32::MAX,
            ballast_mb: 0,
            free_mb: 0,
        }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// A line that names the key, its value and its range.
    pub fn check(&self) -> Result<(), String> {
        for (key, found) in [
            ("late_s", self.late_s),
            ("gap_min", self.gap_min),
            ("moved_px", self.moved_px),
            ("moved_pause_px", self.moved_pause_px),
            ("hot_c", self.hot_c),
        ] {
            if found.is_nan() || found < 0.0 {
                return Err(format!("patience.{key}: found {found}, wanted 0 or more"));
            }
        }
        if !(1..=10).contains(&self.flash_tries) {
            return Err(format!("patience.flash_tries: found {}, wanted 1 to 10", self.flash_tries));
        }
        if self.alert_steps == 0 || self.pause_steps == 0 {
            return Err(format!(
                "patience: found alert_steps = {}, pause_steps = {}, wanted 1 or more",
                self.alert_steps, self.pause_steps
            ));
        }
        Ok(())
    }
}

/// What a power cut may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Durability {
    /// Nothing: every step is on the disk before the next begins. For real plants.
    Full,
    /// The steps of the last seconds; a killed program costs nothing. For virtual plants at full speed.
    Fast,
}

/// Regions of a photograph that show the lamps, by name: to compare the lit lamp with the commanded one.
///
/// Without regions, the outer thirds of the picture stand for a left and a right lamp.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LampsInView(pub BTreeMap<String, Region>);

impl LampsInView {
    /// The regions in the order of `layout`; `None` unless each of its lamps has one.
    #[must_use]
    pub fn places(&self, layout: &Layout) -> Option<Vec<Region>> {
        layout.lamps().iter().map(|lamp| self.0.get(&lamp.name).copied()).collect()
    }

    /// Checks what a file may have got wrong, for photographs of `width` x `height` and the lamps of `layout`.
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
                "lamps_in_view: found no places of {} lamps, wanted one for each: {}",
                layout.len(),
                names.join(", ")
            ));
        }
        if let Some(name) = names.iter().find(|name| !self.0.is_empty() && !self.0.contains_key(**name)) {
            return Err(format!(
                "lamps_in_view: found no place of {name}, wanted one for each lamp, or none"
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
        assert!(problem(&LampsInView::default(), &four).contains("found no places of 4 lamps"));
        assert!(problem(&both, &four).contains("found no place of front"));
        assert!(problem(&view(&format!(r#"{{"rigth": {place}}}"#)), &two).contains("the place of rigth"));
        assert!(both.check(3, 10, &two).unwrap_err().starts_with("lamps_in_view.left: found Region"));
    }
}
