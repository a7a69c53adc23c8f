//! `tropism export`: a run as one archive or folder that others can read and check.

mod sink;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde::Serialize;
use tropism::observation::{Observation, Quality};
use tropism::rig::Event;
use tropism::track::{Column, Sample, Track};
use tropism_lab::{Journal, Row, RunConfig, files, holder};

use self::sink::Sink;
use crate::shell::{Interrupted, Shell};

/// Write a run as an archive or folder: track, events, photographs, settings, and a manifest with the sum of each file
///
/// Each photograph is compared with the sum in the journal, and all that was written is read back and compared again.
/// Nothing that is there is ever overwritten. A run that goes on is exported up to its latest step, and is not disturbed.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism export bean --out bean.tar\n  \
    tropism export bean --out /media/stick/bean\n  \
    tropism export bean --out bean.tar --keep-going     although photographs are lost")]
pub(crate) struct Export {
    /// Run folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// New archive, if it ends in .tar, or new folder
    #[arg(long, value_name = "FILE.tar|DIR")]
    out: PathBuf,

    /// Leave out photographs that are gone or not what they were, and list them, rather than fail
    #[arg(long)]
    keep_going: bool,
}

/// The file `manifest.json`.
#[derive(Serialize)]
struct Manifest<'a> {
    schema: &'static str,
    /// Version of tropism that wrote it.
    version: &'static str,
    run: String,
    is_virtual: bool,
    seed: u64,
    controller: String,
    is_over: bool,
    steps: usize,
    held: usize,
    /// What the columns of `track.csv` mean.
    columns: BTreeMap<&'static str, &'static str>,
    events: usize,
    /// What the columns of `events.csv` mean.
    event_columns: BTreeMap<&'static str, &'static str>,
    /// Every other file.
    files: &'a [Written],
    /// Photographs that were left out, and why.
    left_out: &'a [LeftOut],
}

/// A file of the export.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Written {
    /// Where it is in the export, with `/`.
    path: String,
    bytes: u64,
    sha256: String,
}

#[derive(Serialize)]
struct LeftOut {
    path: String,
    problem: String,
}

#[derive(Serialize)]
struct Outcome {
    out: PathBuf,
    is_virtual: bool,
    is_over: bool,
    steps: usize,
    files: usize,
    bytes: u64,
    left_out: Vec<LeftOut>,
}

/// What is copied from a run folder as it is, where it is there. The journal is not: it may be written at this moment,
/// and `track.csv` and `events.csv` have all that is in it.
const COPIED: [&str; 4] = ["run.toml", "calibration.toml", "truth.csv", "truth.jsonl"];

impl Export {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = RunConfig::read(&self.folder)?;
        let out = self.out.display();
        ensure!(!self.out.exists(), "{out}: found something here already, wanted a new name");
        ensure!(
            !is_inside(&self.out, &self.folder),
            "{out}: found it inside the run folder, wanted it elsewhere"
        );
        let journal = self.folder.join("journal.sqlite");
        let (rows, events) = Journal::open_to_read(&journal)
            .and_then(|journal| Ok((journal.rows()?, journal.events()?)))
            .with_context(|| journal.display().to_string())?;
        let is_over = self.folder.join("track.csv").exists() && holder(&self.folder)?.is_none();
        let sink = Sink::new(&self.out)?;
        let part = sink.part().to_owned();
        let done = self.write(shell, sink, &plan, (&rows, &events), is_over);
        if done.is_err() {
            sink::remove(&part);
        }
        let outcome = done?;
        shell.result(&outcome.text(), &outcome)
    }

    fn write(
        &self,
        shell: &Shell,
        mut sink: Sink,
        plan: &RunConfig,
        (rows, events): (&[Row], &[Event]),
        is_over: bool,
    ) -> Result<Outcome> {
        let progress = shell.progress("export", rows.len() as u64);
        let mut written = Vec::new();
        let mut keep = |sink: &mut Sink, path: String, bytes: &[u8]| -> Result<()> {
            sink.add(&path, bytes).with_context(|| format!("{}: cannot write {path}", self.out.display()))?;
            written.push(Written { path, bytes: bytes.len() as u64, sha256: files::sha256(bytes) });
            Ok(())
        };
        for name in COPIED {
            let path = self.folder.join(name);
            if path.exists() {
                keep(&mut sink, name.to_owned(), &files::read(&path)?)?;
            }
        }
        let mut csv = Vec::new();
        track(rows).write_csv(&mut csv).with_context(|| self.folder.display().to_string())?;
        keep(&mut sink, "track.csv".to_owned(), &csv)?;
        keep(&mut sink, "events.csv".to_owned(), &events_csv(events)?)?;
        let mut left_out = Vec::new();
        for row in rows {
            match photograph(&self.folder, row) {
                Ok(bytes) => keep(&mut sink, format!("photographs/{}", row.photo), &bytes)?,
                Err(error) if self.keep_going => {
                    let path = format!("photographs/{}", row.photo);
                    left_out.push(LeftOut { path, problem: format!("{error:#}") });
                }
                Err(error) => return Err(error.context("nothing was written (--keep-going leaves it out)")),
            }
            if let Some(bytes) = side_photograph(&self.folder, row)? {
                keep(&mut sink, format!("side/{}", row.photo), &bytes)?;
            }
            progress.add(1);
            if Shell::is_interrupted() {
                return Err(Interrupted("nothing was written".to_owned()).into());
            }
        }
        let is_held =
            |row: &&Row| row.seen.observation.as_ref().is_none_or(|seen| seen.quality == Quality::Held);
        let manifest = Manifest {
            schema: "tropism.export/1",
            version: env!("CARGO_PKG_VERSION"),
            run: name_of(&self.folder),
            is_virtual: plan.is_virtual(),
            seed: plan.seed,
            controller: plan.controller_description(),
            is_over,
            steps: rows.len(),
            held: rows.iter().filter(is_held).count(),
            columns: BTreeMap::from(COLUMNS),
            events: events.len(),
            event_columns: BTreeMap::from(EVENT_COLUMNS),
            files: &written,
            left_out: &left_out,
        };
        let mut text = serde_json::to_string_pretty(&manifest)?;
        text.push('\n');
        let path = "manifest.json".to_owned();
        sink.add(&path, text.as_bytes()).with_context(|| format!("{}: cannot write", self.out.display()))?;
        let mut all = written.clone();
        all.push(Written { path, bytes: text.len() as u64, sha256: files::sha256(text.as_bytes()) });
        let cannot = || format!("{}: cannot write", self.out.display());
        let found = sink.finish().with_context(cannot)?;
        if let Some(wrong) = all.iter().find(|file| !found.contains(file)) {
            bail!(
                "{}: found {} changed when it was read back, wanted it as it was written; check the disk",
                self.out.display(),
                wrong.path
            );
        }
        sink::put(&sink::part_of(&self.out), &self.out).with_context(cannot)?;
        Ok(Outcome {
            out: self.out.clone(),
            is_virtual: plan.is_virtual(),
            is_over,
            steps: rows.len(),
            files: all.len(),
            bytes: all.iter().map(|file| file.bytes).sum(),
            left_out,
        })
    }
}

impl Outcome {
    fn text(&self) -> String {
        let kind = if self.is_virtual { "a virtual plant" } else { "a plant" };
        let yet = if self.is_over { "" } else { ", which is not over" };
        let mut text = format!("{} steps of {kind}{yet}\n", self.steps);
        for LeftOut { path, problem } in &self.left_out {
            text += &format!("left out: {path}: {problem}\n");
        }
        let size = crate::units::bytes(self.bytes);
        text + &format!("wrote {}: {} files, {size}, read back and compared", self.out.display(), self.files)
    }
}

/// The columns of `track.csv`.
const COLUMNS: [(&str, &str); 17] = [
    ("step", "from 0"),
    ("time_s", "seconds since the start"),
    ("tip_x_cm", "tip, to the right of the root"),
    ("tip_y_cm", "tip, above the soil"),
    ("light", "left, right or dark: decided at this step, lit until the next"),
    ("quality", "measured in this photograph, held from an earlier one, or simulated"),
    ("frame", "file in photographs/"),
    ("tip_x_px", "tip in the photograph, from its left; empty where held"),
    ("tip_y_px", "tip in the photograph, from its top; empty where held"),
    ("class", "ok, or why the tip is held"),
    ("confidence", "0 to 1"),
    ("done", "1 if the lamp confirmed, 0 if nobody knows"),
    (
        "moved_x_px",
        "how far the camera's picture has moved to the right since the first one; empty where nobody knows",
    ),
    ("moved_y_px", "the same, down"),
    ("begun_unix_s", "when the step was really begun, in seconds since 1970; empty in a virtual tent"),
    ("photo_bytes", "size of the photograph"),
    ("photo_sha256", "its SHA-256, as the journal has it"),
];

/// The columns of `events.csv`.
const EVENT_COLUMNS: [(&str, &str); 5] = [
    ("step", "the latest step then"),
    ("kind", "what kind of thing happened, one word"),
    ("text", "what was found and what was done about it"),
    ("since_start_s", "seconds since the start; empty in a virtual tent"),
    ("unix_s", "seconds since 1970, by the clock on the wall; empty in a virtual tent"),
];

/// All that happened, as a table.
fn events_csv(events: &[Event]) -> Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(EVENT_COLUMNS.map(|(name, _)| name))?;
    for Event { step, kind, text, at } in events {
        let seconds = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.3}"));
        table.write_record([
            &step.to_string(),
            kind.name(),
            text,
            &seconds(at.map(|at| at.since_start.as_secs_f64())),
            &seconds(at.map(|at| at.unix_s)),
        ])?;
    }
    Ok(table.into_inner()?)
}

/// All steps of a journal at which something was decided, and the last, as a track with further columns.
fn track(rows: &[Row]) -> Track {
    let last = rows.last().map(|row| row.step);
    let is_in_track = |row: &&Row| row.decided.is_some() || Some(row.step) == last;
    let rows: Vec<_> = rows
        .iter()
        .filter(is_in_track)
        .filter_map(|row| Some((row, row.seen.observation.as_ref()?)))
        .collect();
    let samples = rows.iter().map(|(row, seen)| Sample {
        step: row.step,
        time_s: row.time_s,
        tip: seen.tip,
        stem: seen.stem.clone(),
        light: row.decided,
        quality: seen.quality,
    });
    let column = |name: &str, value: &dyn Fn(&Row, bool) -> String| {
        let cell = |(row, seen): &(&Row, &Observation)| value(row, seen.quality == Quality::Measured);
        Column::parsed(name, rows.iter().map(cell).collect())
    };
    // A held tip is not in this photograph: it has no place there.
    let place = |row: &Row, is_measured: bool, axis: usize| {
        let pixel = row.seen.tip_px.filter(|_| is_measured);
        pixel.map_or_else(String::new, |pixel| format!("{:.2}", [pixel.x, pixel.y][axis]))
    };
    let moved = |row: &Row, axis: usize| {
        row.seen.camera_shift.map_or_else(String::new, |by| format!("{:.2}", [by.x, by.y][axis]))
    };
    let columns = vec![
        column("frame", &|row, _| row.photo.clone()),
        column("tip_x_px", &|row, is_measured| place(row, is_measured, 0)),
        column("tip_y_px", &|row, is_measured| place(row, is_measured, 1)),
        column("class", &|row, _| row.seen.status.to_string()),
        column("confidence", &|row, _| format!("{:.3}", row.seen.confidence)),
        column("done", &|row, _| u8::from(row.is_done).to_string()),
        column("moved_x_px", &|row, _| moved(row, 0)),
        column("moved_y_px", &|row, _| moved(row, 1)),
        column("begun_unix_s", &|row, _| {
            row.begun.map_or_else(String::new, |at| format!("{:.3}", at.unix_s))
        }),
        column("photo_bytes", &|row, _| row.photo_bytes.to_string()),
        column("photo_sha256", &|row, _| row.photo_sha256.clone()),
    ];
    Track { columns, ..Track::of(samples.collect()) }
}

/// The photograph of a step, as the journal says it is.
fn photograph(folder: &Path, row: &Row) -> Result<Vec<u8>> {
    let path = folder.join("photographs").join(&row.photo);
    let bytes = files::read(&path)?;
    let found = files::sha256(&bytes);
    ensure!(
        found == row.photo_sha256,
        "{}: found {} bytes with the SHA-256 {found}, wanted {} bytes with {}, as the journal says",
        path.display(),
        bytes.len(),
        row.photo_bytes,
        row.photo_sha256
    );
    Ok(bytes)
}

fn side_photograph(folder: &Path, row: &Row) -> Result<Option<Vec<u8>>> {
    let path = folder.join("side").join(&row.photo);
    Ok(if path.exists() { Some(files::read(&path)?) } else { None })
}

/// The name of a folder, also of `.`.
fn name_of(folder: &Path) -> String {
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    whole.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Whether `path`, which need not exist, is in `folder`.
fn is_inside(path: &Path, folder: &Path) -> bool {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (parent.canonicalize(), folder.canonicalize()) {
        (Ok(parent), Ok(folder)) => parent.starts_with(folder),
        _ => false,
    }
}
