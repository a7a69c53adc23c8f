//! The tables of an export: the journal as `track.csv` and `events.csv`, and what their columns mean.

use tropism::lamps::Layout;
use tropism::lighting::Lighting;
use tropism::observation::Observation;
use tropism::rig::Event;
use tropism::text::csv_cell;
use tropism::track::{Column, Sample, Track};
use tropism_rig::secret::shown;

use crate::folder::{programme_columns, tip_px};
use crate::journal::{StepRecord, lights_that_acted};

/// Columns of `track.csv`.
pub(super) const TRACK_COLUMNS: [(&str, &str); 21] = [
    ("step", "from 0"),
    ("time_s", "seconds since the start"),
    ("tip_x_cm", "tip, to the right of the root"),
    ("tip_y_cm", "tip, above the soil"),
    ("light", "name of the lamp that was lit until the next step; dark where none is known to have been"),
    ("quality", "measured in this photograph, carried forward from an earlier one, or simulated"),
    ("frame", "file in photographs/"),
    ("tip_x_px", "tip in the photograph, from its left; empty where carried forward"),
    ("tip_y_px", "tip in the photograph, from its top; empty where carried forward"),
    ("class", "ok, or why the tip is carried forward"),
    ("confidence", "0 to 1"),
    ("decided", "name of the lamp that was decided; dark if none was"),
    ("done", "1 if the lamp confirmed, 0 if it is not known"),
    ("part", "with a programme: number of the part that acted, 0 outside of all"),
    ("steered", "with a programme: 1 if what was decided was lit, 0 if not"),
    ("base", "with a programme: the base light, lamps and levels"),
    (
        "moved_x_px",
        "how far the camera's picture has moved to the right since the first one; empty where it is not known",
    ),
    ("moved_y_px", "the same, down"),
    ("begun_unix_s", "when the step was really begun, in seconds since 1970; empty in a virtual tent"),
    ("photo_bytes", "size of the photograph"),
    ("photo_sha256", "its SHA-256, as the journal has it"),
];

/// Columns of `events.csv`.
pub(super) const EVENT_COLUMNS: [(&str, &str); 5] = [
    ("step", "the step that it concerns: of missed ones the last, of others the latest step then"),
    ("kind", "what kind of thing happened, one word"),
    ("text", "what was found and what was done about it"),
    ("since_start_s", "seconds since the start; empty in a virtual tent"),
    ("unix_s", "seconds since 1970, by the clock on the wall; empty in a virtual tent"),
];

/// The bytes of `events.csv`.
pub(super) fn events_csv(events: &[Event]) -> Result<Vec<u8>, csv::Error> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(EVENT_COLUMNS.map(|(name, _)| name))?;
    for Event { step, kind, text, at } in events {
        let seconds = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.3}"));
        table.write_record([
            &step.to_string(),
            kind.name(),
            &csv_cell(&shown(text)),
            &seconds(at.map(|at| at.since_start.as_secs_f64())),
            &seconds(at.map(|at| at.unix_s)),
        ])?;
    }
    table.into_inner().map_err(|error| error.into_error().into())
}

/// The bytes of `track.csv`, with the lamps of `layout` by their names.
pub(super) fn track_csv(steps: &[StepRecord], layout: &Layout) -> Vec<u8> {
    track(steps, layout).to_csv()
}

/// The steps of a journal with a decision, and the last step, as a track with further columns.
fn track(steps: &[StepRecord], layout: &Layout) -> Track {
    let last = steps.last().map(|step| step.step);
    let is_in_track = |(step, _): &(&StepRecord, Lighting)| step.decided.is_some() || Some(step.step) == last;
    let (steps, lights): (Vec<(&StepRecord, &Observation)>, Vec<Lighting>) = steps
        .iter()
        .zip(lights_that_acted(steps))
        .filter(is_in_track)
        .filter_map(|(step, light)| Some(((step, step.observation()?), light)))
        .unzip();
    let samples = steps
        .iter()
        .zip(lights)
        .map(|((step, seen), light)| Sample::of((*seen).clone(), step.step, step.time_s, light));
    let column = |name: &str, value: &dyn Fn(&StepRecord) -> String| {
        Column::parsed(name, steps.iter().map(|(step, _)| value(step)).collect())
    };
    let moved = |step: &StepRecord, axis: usize| {
        step.seen.camera_shift.map_or_else(String::new, |by| format!("{:.2}", [by.x, by.y][axis]))
    };
    let mut columns = vec![
        column("frame", &|step| step.photo.clone()),
        column("tip_x_px", &|step| tip_px(step)[0].clone()),
        column("tip_y_px", &|step| tip_px(step)[1].clone()),
        column("class", &|step| step.seen.status.to_string()),
        column("confidence", &|step| format!("{:.3}", step.seen.confidence)),
        column("decided", &|step| step.decided.unwrap_or_default().word(layout)),
        column("done", &|step| u8::from(step.is_confirmed).to_string()),
        column("moved_x_px", &|step| moved(step, 0)),
        column("moved_y_px", &|step| moved(step, 1)),
        column("begun_unix_s", &|step| step.begun.map_or_else(String::new, |at| format!("{:.3}", at.unix_s))),
        column("photo_bytes", &|step| step.photo_bytes.to_string()),
        column("photo_sha256", &|step| step.photo_sha256.clone()),
    ];
    columns.extend(programme_columns(steps.iter().map(|(step, _)| *step), layout));
    Track { layout: layout.clone(), columns, ..Track::of(samples.collect()) }
}
