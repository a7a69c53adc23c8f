//! `tropism grow --photographs`: a run folder a plant, with all its photographs and what is true beside them.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Result, ensure};
use tropism::greenhouse::tent::{Greenhouse, TentHandle};
use tropism::task::Targets;
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};
use tropism::vision::VisionConfig;
use tropism_lab::{files, lock};
use tropism_rig::file::RigFile;

use crate::commands::run::RunPlan;
use crate::controller::LoadedController;
use crate::shell::{Progress, Shell};

/// All plants: what they have in common.
pub(super) struct Nursery<'a> {
    pub(super) greenhouse: &'a Greenhouse,
    pub(super) controller: &'a LoadedController,
    pub(super) task: &'a Targets,
    pub(super) is_resumed: bool,
    pub(super) progress: &'a Progress,
}

impl Nursery<'_> {
    /// All that decides what becomes of the plant of `seed`: the text of its `run.toml`.
    fn plan(&self, seed: u64) -> Result<String> {
        let rig = RigFile::greenhouse(self.greenhouse.clone(), VisionConfig::default());
        Ok(toml::to_string(&RunPlan::new(rig, self.controller, self.task.clone(), seed))?)
    }

    /// Checks that the plant of `seed` may be grown in `folder`.
    pub(super) fn check(&self, folder: &Path, seed: u64) -> Result<()> {
        let file = folder.join("run.toml");
        if !file.exists() {
            return Ok(());
        }
        ensure!(
            self.is_resumed,
            "{}: found a plant here already, wanted a new folder (or --resume to go on with it)",
            folder.display()
        );
        ensure!(
            files::read_text(&file)? == self.plan(seed)?,
            "{}: found a plant that was grown with other options, wanted the same ones; use another folder",
            file.display()
        );
        Ok(())
    }

    /// Grows the plant of `seed` in `folder`; `None` if the user asked for an end before it was over. A folder with a track
    /// is complete. In another the plant grows once more, which costs little, and the photographs that are there stay.
    pub(super) fn grow(&self, folder: &Path, seed: u64) -> Result<Option<Track>> {
        let track = folder.join("track.csv");
        if track.exists() {
            self.progress.skip(self.task.max_steps.into());
            return Ok(Some(files::read_track(&track)?));
        }
        let [front, side] = [("photographs", true), ("side", self.greenhouse.scene.cameras > 1)]
            .map(|(name, is_there)| is_there.then(|| folder.join(name)));
        let calibration = toml::to_string(&self.greenhouse.calibration())?;
        for folder in front.iter().chain(&side) {
            files::make_folder(folder)?;
        }
        let _lock = lock(folder)?;
        files::write(&folder.join("run.toml"), self.plan(seed)?.as_bytes())?;
        for folder in [Some(folder), side.as_deref()].into_iter().flatten() {
            files::write(&folder.join("calibration.toml"), calibration.as_bytes())?;
        }
        let (mut truth, mut kept) = (None, Ok(()));
        let mut watch = |sample: &Sample, device: &TentHandle| {
            kept = [(&front, true), (&side, false)].into_iter().try_for_each(|(folder, is_front)| {
                let Some(folder) = folder else { return Ok(()) };
                let path = folder.join(format!("{:06}.jpg", sample.step));
                if self.is_resumed && path.exists() {
                    return Ok(());
                }
                let bytes = match is_front {
                    true => device.front_photograph(),
                    false => device.side_photograph().map_or_else(Vec::new, |(_, bytes)| bytes),
                };
                files::write(&path, &bytes)
            });
            self.progress.add(1);
            if sample.light.is_none() {
                truth = Some((device.truth_csv(), device.truth_json()));
            }
            if kept.is_ok() && !Shell::is_interrupted() {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        };
        let mut controller = self.controller.build(self.task);
        let grown = self.greenhouse.grow(seed, PAPER_PERIOD_MIN, &mut *controller, self.task, &mut watch);
        kept?;
        let Some((csv, jsonl)) = truth else { return Ok(None) };
        files::write(&folder.join("truth.csv"), &csv)?;
        files::write(&folder.join("truth.jsonl"), &jsonl)?;
        // Last, for it tells that all is there.
        files::write_track(&track, &grown)?;
        Ok(Some(grown))
    }
}
