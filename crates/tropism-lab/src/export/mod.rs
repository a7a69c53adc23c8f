//! The workflow `export`: a run as one archive or folder that others can read and check.
//!
//! In comes a run folder, out comes a copy with tables instead of the journal, and a manifest with the SHA-256 of each file.
//! Each photograph is compared with the journal, and all that was written is read back and compared again. The run may go
//! on meanwhile: it is exported up to its latest step.

mod tables;
mod manifest;
mod sink;

use std::cmp::Reverse;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use tropism_rig::secret;

use crate::error::Error;
use crate::files;
use crate::folder::{read_journal, read_photo};
use crate::lock::holder;
use crate::monitor::Monitor;
use crate::run::RunConfig;
use crate::workflow::Workflow;
use manifest::{Contents, Written};
use sink::Sink;

/// The run to export.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExportPlan {
    /// Run folder.
    pub folder: PathBuf,
    /// New archive, if it ends in `.tar`, or new folder. Nothing is overwritten.
    pub out: PathBuf,
    /// Whether photographs that are missing or damaged are left out and listed. Otherwise they are an error.
    #[serde(default)]
    pub keep_going: bool,
}

/// What was exported.
#[derive(Clone, Debug, Serialize)]
pub struct ExportResults {
    /// Archive or folder.
    pub out: PathBuf,
    /// Whether the plant is virtual.
    pub is_virtual: bool,
    /// Whether the run is over.
    pub is_over: bool,
    /// Recorded steps.
    pub steps: usize,
    /// Files of the export.
    pub files: usize,
    /// Their size.
    pub bytes: u64,
    /// Photographs that were left out.
    pub left_out: Vec<LeftOut>,
}

/// A photograph that was left out.
#[derive(Clone, Debug, Serialize)]
pub struct LeftOut {
    /// Where it would be in the export.
    pub path: String,
    /// What is wrong with it.
    pub problem: String,
}

/// Files that are copied from a run folder if they are there. The journal is not: a run may be writing it, and `track.csv`
/// and `events.csv` hold all that is in it.
const COPIED: [&str; 4] = [RUN_FILE, "calibration.toml", "truth.csv", "truth.jsonl"];

/// The settings of a run. They may hold addresses with passwords.
const RUN_FILE: &str = "run.toml";

impl Workflow for ExportPlan {
    type Results = ExportResults;
    const SCHEMA: &'static str = manifest::SCHEMA;

    fn check(&self) -> Result<(), Error> {
        let out = self.out.display();
        if self.out.exists() {
            return Err(Error::Plan(format!("{out}: something is here already: choose a new name")));
        }
        if is_inside(&self.out, &self.folder) {
            return Err(Error::Plan(format!("{out}: this is inside the run folder: choose a place outside")));
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<ExportResults, Error> {
        // Before the first is read: an error in a foreign file would show a line of it.
        let journal = self.folder.join("journal.sqlite");
        for path in [self.folder.join(RUN_FILE), journal.clone()] {
            files::check_unlinked(&self.folder, &path)?;
        }
        let config = RunConfig::read(&self.folder)?;
        self.check()?;
        let (steps, events) = read_journal(&self.folder)?;
        let is_over = self.folder.join("track.csv").exists() && holder(&self.folder)?.is_none();
        let contents = Contents { config: &config, steps: &steps, events: &events, is_over };
        let mut writer = Writer { sink: Sink::create(&self.out)?, out: &self.out, written: Vec::new() };
        let part = sink::part_of(&self.out);
        let done = self.write(&mut writer, &contents, monitor).and_then(|left_out| {
            let written = writer.finish()?;
            Ok(self.results(&contents, &written, left_out))
        });
        if done.is_err() {
            sink::remove(&part);
        }
        done
    }
}

impl ExportPlan {
    /// Writes all files, and returns the photographs that were left out.
    fn write(
        &self,
        writer: &mut Writer<'_>,
        contents: &Contents<'_>,
        monitor: &dyn Monitor,
    ) -> Result<Vec<LeftOut>, Error> {
        monitor.stage("export", contents.steps.len() as u64);
        for name in COPIED {
            let path = self.folder.join(name);
            files::check_unlinked(&self.folder, &path)?;
            if !path.exists() {
                continue;
            }
            let bytes = if name == RUN_FILE { without_secrets(&path)? } else { files::read(&path)? };
            writer.add(name.to_owned(), &bytes)?;
        }
        let layout = contents.config.rig.layout().map_err(Error::at(self.folder.display()))?;
        let at = || Error::at(self.folder.display());
        writer.add("track.csv".to_owned(), &tables::track_csv(contents.steps, &layout))?;
        writer.add("events.csv".to_owned(), &tables::events_csv(contents.events).map_err(at())?)?;
        let mut left_out = Vec::new();
        for step in contents.steps {
            let path = format!("photographs/{}", step.photo);
            files::check_unlinked(&self.folder, &self.folder.join(&path))?;
            match read_photo(&self.folder, step) {
                Ok(photo) => writer.add(path, &photo.bytes)?,
                Err(error) if self.keep_going => left_out.push(LeftOut { path, problem: error.to_string() }),
                Err(error) => {
                    let place = "nothing was written (`keep_going` leaves it out)".to_owned();
                    return Err(Error::At { place, source: Box::new(error) });
                }
            }
            let side = self.folder.join("side").join(&step.photo);
            files::check_unlinked(&self.folder, &side)?;
            if side.exists() {
                writer.add(format!("side/{}", step.photo), &files::read(&side)?)?;
            }
            monitor.advance(1);
            if !monitor.may_go_on() {
                return Err(Error::Cancelled("nothing was written".to_owned()));
            }
        }
        let text = contents.manifest(&self.folder, &writer.written, &left_out)?;
        writer.add("manifest.json".to_owned(), text.as_bytes())?;
        Ok(left_out)
    }

    fn results(&self, contents: &Contents<'_>, written: &[Written], left_out: Vec<LeftOut>) -> ExportResults {
        ExportResults {
            out: self.out.clone(),
            is_virtual: contents.config.is_virtual(),
            is_over: contents.is_over,
            steps: contents.steps.len(),
            files: written.len(),
            bytes: written.iter().map(|file| file.bytes).sum(),
            left_out,
        }
    }
}

/// An export that is being written, and the files in it so far.
struct Writer<'a> {
    sink: Sink,
    out: &'a Path,
    written: Vec<Written>,
}

impl Writer<'_> {
    fn add(&mut self, path: String, bytes: &[u8]) -> Result<(), Error> {
        let place = || format!("{}: cannot write {path}", self.out.display());
        self.sink.add(&path, bytes).map_err(|source| Error::at(place())(source))?;
        self.written.push(Written::new(path, bytes));
        Ok(())
    }

    /// Reads all files back, compares them, and gives the export its name.
    fn finish(self) -> Result<Vec<Written>, Error> {
        let Self { sink, out, written } = self;
        let cannot = || Error::at(format!("{}: cannot write", out.display()));
        let found = sink.finish().map_err(cannot())?;
        if let Some(wrong) = written.iter().find(|file| !found.contains(file)) {
            return Err(Error::Failed(format!(
                "{}: {} has changed when it was read back: check the disk",
                out.display(),
                wrong.path
            )));
        }
        sink::rename(&sink::part_of(out), out).map_err(cannot())?;
        Ok(written)
    }
}

/// The bytes of a TOML file with `***` in place of the secrets in its addresses; all else stays to the letter.
fn without_secrets(path: &Path) -> Result<Vec<u8>, Error> {
    let mut text = files::read_text(path)?;
    let mut found = Vec::new();
    let table = DeTable::parse(&text).map_err(Error::at(path.display()))?;
    table.get_ref().values().for_each(|value| find_secrets(value, &mut found));
    // From the last on, because what stands before it keeps its place.
    found.sort_by_key(|(place, _)| Reverse(place.start));
    for (place, shown) in found {
        text.replace_range(place, &toml::Value::String(shown).to_string());
    }
    Ok(text.into_bytes())
}

/// Adds the place of each text with a secret in its addresses, and the text without.
fn find_secrets(value: &Spanned<DeValue<'_>>, found: &mut Vec<(Range<usize>, String)>) {
    match value.get_ref() {
        DeValue::String(text) => {
            // An address by itself ends where the text does, whatever letters it holds.
            let is_url =
                text.split_once("://").is_some_and(|(scheme, _)| !scheme.contains(char::is_whitespace));
            let shown =
                if is_url { secret::redacted(text) } else { secret::redacted_text(text).into_owned() };
            found.extend((shown != **text).then(|| (value.span(), shown)));
        }
        DeValue::Array(values) => values.iter().for_each(|value| find_secrets(value, found)),
        DeValue::Table(table) => table.values().for_each(|value| find_secrets(value, found)),
        _ => {}
    }
}

/// Whether `path`, which need not exist, is in `folder`.
fn is_inside(path: &Path, folder: &Path) -> bool {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (parent.canonicalize(), folder.canonicalize()) {
        (Ok(parent), Ok(folder)) => parent.starts_with(folder),
        _ => false,
    }
}
