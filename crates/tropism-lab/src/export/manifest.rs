//! The manifest of an export: `manifest.json`, with what its files hold and the SHA-256 of each.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use tropism::observation::Quality;
use tropism::rig::Event;

use super::LeftOut;
use super::tables::{EVENT_COLUMNS, TRACK_COLUMNS};
use crate::error::Error;
use crate::files;
use crate::journal::StepRecord;
use crate::run::RunConfig;

pub(super) const SCHEMA: &str = "tropism.export/1";

/// A file of the export.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Written {
    /// Where it is in the export, with `/` between folders.
    pub(super) path: String,
    /// Its size.
    pub(super) bytes: u64,
    /// Its SHA-256, in hexadecimal.
    pub(super) sha256: String,
}

impl Written {
    pub(super) fn new(path: String, bytes: &[u8]) -> Self {
        Self { path, bytes: bytes.len() as u64, sha256: files::sha256(bytes) }
    }
}

/// What an export holds.
pub(super) struct Contents<'a> {
    pub(super) config: &'a RunConfig,
    pub(super) steps: &'a [StepRecord],
    pub(super) events: &'a [Event],
    pub(super) is_over: bool,
}

#[derive(Serialize)]
struct Manifest<'a> {
    schema: &'static str,
    /// Version of tropism that wrote the export.
    version: &'static str,
    run: String,
    is_virtual: bool,
    seed: u64,
    controller: String,
    is_over: bool,
    steps: usize,
    carried_forward: usize,
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

impl Contents<'_> {
    /// The text of the manifest of the run in `folder`.
    pub(super) fn manifest(
        &self,
        folder: &Path,
        files: &[Written],
        left_out: &[LeftOut],
    ) -> Result<String, Error> {
        let is_carried_forward = |step: &&StepRecord| {
            step.seen.observation.as_ref().is_none_or(|seen| seen.quality == Quality::CarriedForward)
        };
        let manifest = Manifest {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            run: name_of(folder),
            is_virtual: self.config.is_virtual(),
            seed: self.config.seed,
            controller: self.config.controller_description(),
            is_over: self.is_over,
            steps: self.steps.len(),
            carried_forward: self.steps.iter().filter(is_carried_forward).count(),
            columns: BTreeMap::from(TRACK_COLUMNS),
            events: self.events.len(),
            event_columns: BTreeMap::from(EVENT_COLUMNS),
            files,
            left_out,
        };
        let text = serde_json::to_string_pretty(&manifest).map_err(Error::at("manifest.json"))?;
        Ok(text + "\n")
    }
}

/// The name of a folder, also of `.`.
pub(super) fn name_of(folder: &Path) -> String {
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    whole.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned())
}
