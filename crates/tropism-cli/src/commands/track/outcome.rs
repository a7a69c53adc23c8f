//! What becomes of the photographs in the end: tracks, what stands beside them, and a few words.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use serde::Serialize;
use tropism::vision::{Calibration, VisionConfig};
use tropism_lab::{RunConfig, files};

use super::Track;
use super::plants::Plant;
use super::series::{Series, Shot, TimeFrom};
use super::table::{Counts, words};
use super::work::Work;
use crate::shell::Shell;

/// Bad files that are named on the terminal; all are in the JSON file.
const NAMED: usize = 5;

/// All that decides what is made of the photographs.
#[derive(Serialize)]
pub(super) struct Settings<'a> {
    pub(super) version: &'static str,
    pub(super) vision: VisionConfig,
    pub(super) plants: &'a [Plant],
    pub(super) time: TimeFrom,
    pub(super) period_min: Option<f64>,
    pub(super) light: String,
}

/// What stands in the JSON file beside a track, and with `--json` on stdout.
#[derive(Serialize)]
pub(super) struct Outcome<'a> {
    schema: &'static str,
    track: PathBuf,
    plant: Option<&'a str>,
    is_virtual: bool,
    #[serde(flatten)]
    counts: &'a Counts,
    time_from: TimeFrom,
    period_min: f64,
    missing_steps: u32,
    calibration: Calibration,
    calibration_is_assumed: bool,
    /// The SHA-256 of the photographs' own, one after the other.
    photographs_sha256: String,
    problems: &'a BTreeMap<String, String>,
    settings: &'a Settings<'a>,
    settings_sha256: &'a str,
}

impl Track {
    /// Writes the tracks and what stands beside them.
    pub(super) fn finish(
        &self,
        work: &Work<'_>,
        settings: &Settings<'_>,
        settings_sha256: &str,
        shell: &Shell,
    ) -> Result<()> {
        let (series, problems) = (work.series, &work.problems);
        let is_virtual = are_virtual(&series.shots);
        let photographs_sha256 = files::sha256(work.sha256.as_bytes());
        let mut outcomes = Vec::new();
        let mut unseen = Vec::new();
        for (plant, table) in work.plants.iter().zip(&work.tables) {
            let outcome = Outcome {
                schema: "tropism.track/1",
                track: self.out(plant),
                plant: plant.name.as_deref(),
                is_virtual,
                counts: &table.counts,
                time_from: series.time_from,
                period_min: series.period_min,
                missing_steps: series.missing(),
                calibration: plant.calibration,
                calibration_is_assumed: self.assumes_scale(),
                photographs_sha256: photographs_sha256.clone(),
                problems,
                settings,
                settings_sha256,
            };
            let Some(track) = table.track() else {
                let which = plant.name.as_ref().map_or_else(String::new, |name| format!("plant {name}: "));
                unseen.push(format!(
                    "{which}found no plant in any of {} photographs ({}), wanted one in the region of interest, with its \
                     foot near --base",
                    table.counts.frames,
                    words(&table.counts.classes)
                ));
                continue;
            };
            files::write_track(&outcome.track, &track)?;
            let json = serde_json::to_string_pretty(&outcome)? + "\n";
            files::write(&outcome.track.with_extension("json"), json.as_bytes())?;
            outcomes.push(outcome);
        }
        if outcomes.is_empty() {
            work.journal.remove()?;
        }
        if let [first, ..] = outcomes.as_slice() {
            let text = self.text(series, problems, &outcomes, first.counts);
            match outcomes.as_slice() {
                [only] => shell.result(&text, only)?,
                several => shell.result(&text, &several)?,
            }
        }
        ensure!(unseen.is_empty(), "{}", unseen.join("; "));
        Ok(())
    }

    fn text(
        &self,
        series: &Series,
        problems: &BTreeMap<String, String>,
        outcomes: &[Outcome<'_>],
        first: &Counts,
    ) -> String {
        let kind = if outcomes[0].is_virtual { " of a virtual plant" } else { "" };
        let mut lines = vec![format!("{} photographs{kind}, {}", first.frames, series.words())];
        lines.push(format!("lamp lit: {}", words(&first.lights)));
        for (name, problem) in problems.iter().take(NAMED) {
            lines.push(format!("{name}: {problem}"));
        }
        if problems.len() > NAMED {
            lines.push(format!("and {} more bad files", problems.len() - NAMED));
        }
        for outcome in outcomes {
            let which = outcome.plant.map_or_else(String::new, |name| format!("plant {name}: "));
            let Counts { measured, held, before, classes, longest_gap, longest_gap_min, .. } = outcome.counts;
            lines.push(format!(
                "{which}{measured} measured, {held} held, {before} before the first sighting ({}); longest gap \
                 {longest_gap} ({longest_gap_min:.0} min)",
                words(classes),
            ));
            if !outcome.counts.leaves_view_at.is_empty() {
                let edges = words(&outcome.counts.leaves_view_at);
                lines.push(format!("{which}reaches out of its region ({edges}): a larger --roi may help"));
            }
            lines.push(format!("wrote {}", outcome.track.display()));
        }
        lines.extend(first.camera.words(outcomes[0].calibration.px_per_cm));
        if let Some(place) = self.overlay.as_ref().or(self.sheet.as_ref()) {
            lines.push(format!("look at {}: is the cross on the tip?", place.display()));
        }
        if let Some(folder) = &self.overlay {
            let folder = folder.display();
            lines.push(format!("or see it move: tropism timelapse {folder} --out {folder}.gif"));
        }
        let tracks: Vec<String> =
            outcomes.iter().map(|outcome| outcome.track.display().to_string()).collect();
        lines.push(format!("next: tropism fit {} --out model.json", tracks.join(" ")));
        lines.join("\n")
    }
}

/// Whether photographs lie in a run folder that says that its plant is virtual.
fn are_virtual(shots: &[Shot]) -> bool {
    let mut folders: Vec<&Path> = shots.iter().filter_map(|shot| shot.path.parent()).collect();
    folders.dedup();
    folders
        .iter()
        .flat_map(|folder| [Some(*folder), folder.parent()])
        .flatten()
        .any(|folder| RunConfig::read(folder).is_ok_and(|run| run.is_virtual()))
}
