//! Photographed virtual beans: a run folder a plant, with a photograph of each step and the ground truth beside them.

use std::ops::ControlFlow;
use std::path::Path;

use tropism::parallel;
use tropism::track::{Sample, Track};
use tropism_bean::tent::TentHandle;

use super::{GrowPlan, GrownPlant};
use crate::work::check_same;
use crate::{Error, Monitor, files, lock};

/// A camera of the virtual tent.
#[derive(Clone, Copy, PartialEq, Eq)]
enum View {
    Front,
    Side,
}

impl View {
    /// The folder of its photographs in a run folder.
    const fn folder(self) -> &'static str {
        match self {
            Self::Front => "photographs",
            Self::Side => "side",
        }
    }

    fn photograph(self, device: &TentHandle) -> Vec<u8> {
        match self {
            Self::Front => device.front_photograph(),
            Self::Side => device.side_photograph().map_or_else(Vec::new, |(_, bytes)| bytes),
        }
    }
}

impl GrowPlan {
    /// Grows and photographs all plants.
    pub(super) fn photograph(&self, monitor: &dyn Monitor) -> Result<Vec<GrownPlant>, Error> {
        let steps = u64::from(self.plants) * (u64::from(self.task.max_steps) + 1);
        monitor.stage("photograph", steps);
        // All folders are checked before the first plant grows.
        for plant in 0..self.plants {
            let record = self.folder(plant).join("run.toml");
            check_same(&record, &self.config(self.seed_of(plant)).to_toml()?, self.resume, "a plant")?;
        }
        let grow = |plant: usize| {
            let plant = plant as u32;
            let folder = self.folder(plant);
            let track = self.photograph_plant(&folder, self.seed_of(plant), monitor)?;
            Ok::<_, Error>(track.map(|track| self.grown(folder.join("track.csv"), &track)))
        };
        let plants: Vec<Option<GrownPlant>> = parallel::try_map(self.plants as usize, grow)?;
        let plants: Option<Vec<GrownPlant>> = plants.into_iter().collect();
        plants.ok_or_else(|| Error::Interrupted { folder: self.out.clone() })
    }

    /// Grows the plant of `seed` in `folder`; `None` if it was interrupted.
    ///
    /// A folder with a track is complete. In any other folder the plant grows again from the start, which takes little
    /// time beside the photographs; photographs that exist are kept.
    fn photograph_plant(
        &self,
        folder: &Path,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<Option<Track>, Error> {
        let track_file = folder.join("track.csv");
        if track_file.exists() {
            monitor.skip(self.task.max_steps.into());
            return Ok(Some(files::read_track(&track_file)?));
        }
        let views = if self.greenhouse.scene.cameras > 1 {
            &[View::Front, View::Side][..]
        } else {
            &[View::Front][..]
        };
        for view in views {
            files::make_folder(&folder.join(view.folder()))?;
        }
        let _lock = lock(folder)?;
        files::write(&folder.join("run.toml"), self.config(seed).to_toml()?.as_bytes())?;
        self.write_calibrations(folder, views)?;
        let (mut truth, mut written) = (None, Ok(()));
        let mut watch = |sample: &Sample, device: &TentHandle| {
            written = views.iter().try_for_each(|view| {
                let path = folder.join(view.folder()).join(format!("{:06}.jpg", sample.step));
                if self.resume && path.exists() {
                    return Ok(());
                }
                files::write(&path, &view.photograph(device))
            });
            monitor.advance(1);
            if sample.is_dark() {
                truth = Some((device.truth_csv(), device.truth_json()));
            }
            if written.is_ok() && monitor.may_go_on() {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        };
        let (tent, period_min) = (self.tent(), self.period_min);
        let mut controller = self.controller.build(&self.task, &tent.layout, period_min);
        let track = tent.grow(seed, period_min, &mut *controller, &self.task, &mut watch);
        written?;
        let Some((csv, jsonl)) = truth else { return Ok(None) };
        files::write(&folder.join("truth.csv"), &csv)?;
        files::write(&folder.join("truth.jsonl"), &jsonl)?;
        // The track comes last: a folder that has it is complete.
        files::write_track(&track_file, &track)?;
        Ok(Some(track))
    }

    /// Writes the calibration of each camera: in the run folder for the front, in `side` for the side.
    fn write_calibrations(&self, folder: &Path, views: &[View]) -> Result<(), Error> {
        for view in views {
            let path = match view {
                View::Front => folder.join("calibration.toml"),
                View::Side => folder.join(view.folder()).join("calibration.toml"),
            };
            files::write(&path, files::toml_of(&path, &self.greenhouse.calibration())?.as_bytes())?;
        }
        Ok(())
    }
}
