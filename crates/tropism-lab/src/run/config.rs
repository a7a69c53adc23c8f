//! `run.toml`: everything that decides the outcome of a run.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::task::Task;
use tropism::vision::{Calibration, TipTracker, VisionConfig};
use tropism_bean::tent::Greenhouse;
use tropism_report::Plants;
use tropism_rig::file::RigFile;

use crate::controller::ControllerSpec;
use crate::error::Error;
use crate::files::{self, FileError};
use crate::folder::{FolderError, RunFolder};
use crate::journal::Journal;

/// What `run.toml` calls itself.
const SCHEMA: &str = "tropism.run/2";

/// Everything that decides the outcome of a run: the text of `run.toml`. The same configuration gives the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    schema: String,
    version: String,
    is_virtual: bool,
    /// Seed of the virtual plant.
    pub seed: u64,
    /// The controller, complete.
    pub controller: ControllerSpec,
    /// Targets and limits.
    pub task: Task,
    /// Camera, lamps, flash and vision; without the channels of its alerts, which decide nothing of the outcome.
    pub rig: RigFile,
}

impl Default for RunConfig {
    /// The paper's open-loop experiment in the virtual tent.
    fn default() -> Self {
        let rig = RigFile::greenhouse(Greenhouse::default(), VisionConfig::default());
        let controller = ControllerSpec::default();
        let task = controller.default_task();
        Self::new(rig, controller, task, 1)
    }
}

impl RunConfig {
    /// The configuration of a run of `controller` in `rig`. The solids of `task` come into the virtual tent; of a real one,
    /// whose settings name none, vision knows the task's obstacles, and with a camera at the side of its pole.
    #[must_use]
    pub fn new(mut rig: RigFile, controller: ControllerSpec, task: Task, seed: u64) -> Self {
        match rig.greenhouse.take() {
            Some(tent) => rig.greenhouse = Some(tent.among(&task.solids())),
            None if rig.vision.obstacles.is_empty() => rig.vision.obstacles = task.obstacles.clone(),
            None => {}
        }
        // In a real tent with a camera at the side both distances are known.
        if rig.greenhouse.is_none()
            && let (Some(pole), Some(side)) = (task.pole, &mut rig.side)
        {
            let cameras = [(&mut rig.vision, pole), (&mut side.vision, side.from.pole_to_camera(pole))];
            for ((vision, pole), distance_cm) in cameras.into_iter().zip(side.distance_cm) {
                if vision.poles.is_empty() {
                    (vision.poles, vision.camera_cm) = (vec![pole], Some(distance_cm));
                }
            }
        }
        Self {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: rig.is_virtual(),
            seed,
            controller,
            task,
            rig,
        }
    }

    /// Reads `run.toml` in `folder`. Where the journal has the settings of the run they decide: the
    /// file may be lost or damaged.
    ///
    /// # Errors
    /// [`Error::File`] names the file, the line and the key, or the schema that is not known; [`Error::Folder`] a damaged
    /// journal.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let (path, journal) = (folder.join("run.toml"), folder.join("journal.sqlite"));
        let recorded = Journal::find(&journal)
            .and_then(|journal| journal.map_or(Ok(None), |journal| journal.settings()))
            .map_err(|source| FolderError::Journal { path: journal, source })?;
        let text = match recorded {
            Some(text) => text,
            None => files::read_text(&path)?,
        };
        Self::parse(&path, &text)
    }

    /// As [`Self::read`], but takes a whole journal as it is: see [`Journal::follow`].
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn follow(folder: &Path) -> Result<Self, Error> {
        match Journal::follow(&folder.join("journal.sqlite")).and_then(|journal| journal.settings()) {
            Ok(Some(text)) => Self::parse(&folder.join("run.toml"), &text),
            _ => Self::read(folder),
        }
    }

    /// Reads the text of the `run.toml` at `path`.
    fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        let Head { schema } = files::parse_toml(path, text)?;
        if schema != SCHEMA {
            let problem = format!("found schema {schema:?}, wanted {SCHEMA:?}");
            return Err(FileError::content(path, problem).into());
        }
        Ok(files::parse_toml(path, text)?)
    }

    /// The text of `run.toml`.
    ///
    /// # Errors
    /// [`Error::At`] if a value cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String, Error> {
        toml::to_string(self).map_err(Error::at("run.toml"))
    }

    /// Whether the plant is virtual.
    #[must_use]
    pub const fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// The label of its plant in figures.
    #[must_use]
    pub const fn plants(&self) -> Plants {
        if self.is_virtual { Plants::Virtual } else { Plants::Real }
    }

    /// The controller in a few words.
    #[must_use]
    pub fn controller_description(&self) -> String {
        self.controller.description()
    }

    /// How its photographs map to centimetres.
    #[must_use]
    pub fn calibration(&self) -> Option<Calibration> {
        self.rig.calibration()
    }

    /// The tracker for its photographs.
    #[must_use]
    pub fn tracker(&self) -> Option<TipTracker> {
        let vision = &self.rig.vision;
        let tent = self.rig.greenhouse.as_ref();
        let vision = tent.map_or_else(|| vision.clone(), |tent| tent.vision(vision));
        let tracker = TipTracker::new(self.rig.calibration()?, vision).ok()?;
        Some(tracker.with_period(self.rig.period_min))
    }

    /// Checks what a file or a caller may have got wrong.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), Error> {
        let plan = |error: &dyn std::error::Error| Error::Plan(error.to_string());
        self.rig.check().and_then(|()| self.rig.calibrated()).map_err(|error| plan(&error))?;
        self.task.check().map_err(|error| plan(&error))?;
        let layout = self.rig.layout().map_err(|error| plan(&error))?;
        let cameras = self.rig.greenhouse.as_ref().map_or(1, |greenhouse| greenhouse.scene.cameras);
        if self.task.is_in_space() && self.rig.side.is_none() && cameras < 2 {
            return Err(Error::Plan(
                "the task is in space, and the rig has one camera: it takes two".to_owned(),
            ));
        }
        self.controller.check(&layout, self.rig.period_min)?;
        let Some(champion) = self.controller.champion() else { return Ok(()) };
        self.rig.allowed().permit(champion.dimming.example(&layout)).map_err(|problem| {
            Error::Plan(format!(
                "the controller dims lamps, which the rig does not allow: {problem}; set `allowed` of the rig's lamps, such as \
                 {{ any = {{ most_lit = {}, budget = 1.0 }} }}",
                layout.len()
            ))
        })
    }

    /// Makes the run folder at `path`, or opens the one that is there if its configuration is this one; one whose run is
    /// over only with `is_resumed`.
    ///
    /// # Errors
    /// [`Error::Folder`]; a [refusal](FolderError::is_refusal) leaves the folder as it was.
    pub fn open_folder(&self, path: &Path, is_resumed: bool) -> Result<RunFolder, Error> {
        Ok(RunFolder::open(path, &self.to_toml()?, self.rig.durability(), is_resumed)?)
    }
}

/// Reads and checks the rig of a rig file, or of a run folder.
///
/// # Errors
/// [`Error`] names the file, the key, and what is wrong with it.
pub fn read_rig(path: &Path) -> Result<RigFile, Error> {
    let rig = if path.is_dir() { files::read_rig_of_run(path)? } else { files::read_toml(path)? };
    rig.check().map_err(Error::at(path.display()))?;
    Ok(rig)
}

/// All faults of the rig file at `path`; none if it cannot be read at all, or if it is a folder.
pub(crate) fn rig_faults(path: &Path) -> Vec<String> {
    let Ok(text) = files::read_text(path) else { return Vec::new() };
    match files::parse_toml::<RigFile>(path, &text) {
        Ok(rig) => rig.faults().iter().map(|fault| format!("{}: {fault}", path.display())).collect(),
        Err(_) => files::toml_faults::<RigFile>(path, &text)
            .into_iter()
            .map(|fault| Error::from(fault).with_causes())
            .collect(),
    }
}
