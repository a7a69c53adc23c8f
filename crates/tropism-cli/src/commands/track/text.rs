//! What `tropism track` prints for people.

use std::collections::BTreeMap;
use std::path::Path;

use tropism::lamps;
use tropism::vision::Direction;
use tropism::vision::tracking::hold::MAX_HELD_FRAMES;
use tropism_lab::files::shell_word;
use tropism_lab::track::{
    CameraMotion, GuideResults, PlantTrack, TrackCounts, TrackPlan, TrackResults, WarningKind,
};
use tropism_lab::units::plural;
use tropism_rig::secret::shown;

use crate::progress::with_options;

/// Bad files that are named on the terminal; the JSON file names all.
const NAMED: usize = 5;

/// The text after a guide.
pub(super) fn guide(results: &GuideResults) -> String {
    format!(
        "{}, {}\nwrote {}: open it in a browser, click, and copy the command",
        plural(results.series.photographs, "photograph"),
        results.series,
        results.guide.display()
    )
}

/// The text after tracks.
pub(super) fn tracks(plan: &TrackPlan, results: &TrackResults) -> String {
    let [first, ..] = results.tracks.as_slice() else { return String::new() };
    let kind = if first.is_virtual { " of a virtual plant" } else { "" };
    let mut lines = vec![
        format!("{}{kind}, {}", plural(first.counts.frames, "photograph"), results.series),
        lamps_lit(&first.counts.lights),
    ];
    lines.extend(
        first.problems.iter().take(NAMED).map(|(name, problem)| shown(&format!("{name}: {problem}"))),
    );
    if first.problems.len() > NAMED {
        lines.push(format!("and {} more bad files", first.problems.len() - NAMED));
    }
    for track in &results.tracks {
        let which = track.plant.as_ref().map_or_else(String::new, |name| format!("plant {name}: "));
        lines.push(format!(
            "{which}{}",
            if track.is_each { photographs(&track.counts) } else { frames(&track.counts) }
        ));
        lines.extend(located(plan, track));
        lines.extend(track.next_click.as_ref().filter(|_| is_unsure(track)).map(|name| {
            format!(
                "{which}least sure around {}: --tip {},X,Y would help most there",
                shown(name),
                shell_word(Path::new(name))
            )
        }));
        lines.push(format!("wrote {}", track.track.display()));
        lines.extend(
            track
                .warnings
                .iter()
                .map(|warning| with_options(&format!("uncertain: {which}{}", warning.advice))),
        );
    }
    lines.extend(camera(&first.counts.camera, first.calibration.px_per_cm));
    if let Some(place) = plan.overlay.as_ref().or(plan.sheet.as_ref()) {
        lines.push(format!("look at {}: is the cross on the tip?", place.display()));
    }
    if let Some(folder) = &plan.overlay {
        let film = shell_word(&folder.with_added_extension("gif"));
        lines.push(format!("or see it move: tropism timelapse {} --out {film}", shell_word(folder)));
    }
    let files: Vec<String> = results.tracks.iter().map(|track| shell_word(&track.track)).collect();
    let is_lit = first.counts.lights.keys().any(|name| *name != lamps::name(None));
    lines.push(if results.tracks.iter().all(|track| track.warnings.is_empty()) && is_lit {
        format!("next: tropism fit {} --out model.json", files.join(" "))
    } else if results.tracks.iter().all(|track| track.warnings.is_empty()) {
        "next: a table of the lamp in each photograph, for --light: a model needs it".to_owned()
    } else if results
        .tracks
        .iter()
        .flat_map(|track| &track.warnings)
        .all(|one| one.kind == WarningKind::Times)
    {
        "next: the same command with --time or --period, or with the photographs that belong together alone"
            .to_owned()
    } else {
        let photographs: Vec<String> = plan.photographs.iter().map(|path| shell_word(path)).collect();
        format!(
            "next: tropism track {} --guide guide.html, to click root, scale and region",
            photographs.join(" ")
        )
    });
    lines.join("\n")
}

/// Whether another click is worth a line: a short gap in an automatic track is not.
fn is_unsure(track: &PlantTrack) -> bool {
    !track.is_each && (!track.clicks.is_empty() || track.counts.longest_gap > MAX_HELD_FRAMES as usize)
}

/// A line on the place that was found by the plant's motion; `None` where the plan gives it.
fn located(plan: &TrackPlan, track: &PlantTrack) -> Option<String> {
    let region = track.region().filter(|_| track.is_located)?;
    let base = track.calibration.base;
    let look = if plan.sheet.is_none() && plan.overlay.is_none() { " (--sheet shows it)" } else { "" };
    let up = match track.up() {
        Direction::Up => String::new(),
        up => format!(" --up {}", up.name()),
    };
    Some(format!("found by its motion: --roi {region} --base {:.0},{:.0}{up}{look}", base.x, base.y))
}

/// The counts of photographs that have nothing to do with each other.
fn photographs(counts: &TrackCounts) -> String {
    format!(
        "{} of {} measured ({})",
        counts.measured,
        plural(counts.frames, "photograph"),
        counted(&counts.classes)
    )
}

fn frames(counts: &TrackCounts) -> String {
    format!(
        "{} measured, {} carried forward, {} before the first detection ({}); longest gap {} ({:.0} min)",
        counts.measured,
        counts.carried_forward,
        counts.before,
        counted(&counts.classes),
        counts.longest_gap,
        counts.longest_gap_min
    )
}

/// A line on the movement of the camera; `None` if it stood still.
fn camera(camera: &CameraMotion, px_per_cm: f64) -> Option<String> {
    let moved = camera.first.as_ref().map(|first| {
        format!(
            "moved by up to {:.1} px ({:.1} mm) in {}, first in {}: corrected",
            camera.farthest_px,
            10.0 * camera.farthest_px / px_per_cm,
            plural(camera.moved, "photograph"),
            shown(first)
        )
    });
    let unknown = (camera.unknown > 0).then(|| {
        format!("background not found again in {}: not corrected", plural(camera.unknown, "photograph"))
    });
    let parts: Vec<String> = moved.into_iter().chain(unknown).collect();
    (!parts.is_empty()).then(|| format!("camera {}", parts.join("; ")))
}

/// `lamp lit: left 47, right 47, none seen 3`.
fn lamps_lit(lights: &BTreeMap<&'static str, usize>) -> String {
    let dark = lamps::name(None);
    let named: Vec<String> = lights
        .iter()
        .filter(|(name, _)| **name != dark)
        .map(|(name, count)| format!("{name} {count}"))
        .collect();
    let unseen = lights.get(dark).map(|count| format!("none seen {count}"));
    format!("lamp lit: {}", named.into_iter().chain(unseen).collect::<Vec<_>>().join(", "))
}

/// `left 47, right 47`.
fn counted(counts: &BTreeMap<&'static str, usize>) -> String {
    counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}
