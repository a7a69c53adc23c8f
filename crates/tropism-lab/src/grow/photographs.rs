//! Photographed virtual beans: a run folder a plant, with a photograph of each step and the ground truth beside them.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::task::Task;
use tropism::track::Sample;
use tropism_bean::tent::{Greenhouse, TentHandle};

use super::{GrowPlan, GrowResults};
use crate::controller::ControllerSpec;
use crate::work::{Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus, check_same};
use crate::{Error, Monitor, Workflow, files, lock};

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

/// What decides the photographs: the content of `grow.toml`.
#[derive(Serialize, Deserialize)]
struct GrowRecord {
    schema: String,
    version: String,
    is_virtual: bool,
    seed: u64,
    plants: u32,
    period_min: f64,
    controller: ControllerSpec,
    task: Task,
    greenhouse: Greenhouse,
}

/// The photographed plants are long work; the others grow in a moment, and are no units of it.
impl Work for GrowPlan {
    const WORKFLOW: &'static str = "grow";
    const NAME: &'static str = "a set of photographed plants";
    const RECORD: &'static str = "grow.toml";
    const RESULTS: &'static [&'static str] = &["grow.json"];

    type Begun<'p> = Photographing<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        vec![&mut self.out]
    }

    fn of_folder(out: &Path) -> Result<Self, Error> {
        let GrowRecord { seed, plants, period_min, controller, task, greenhouse, .. } =
            files::read_toml(&out.join(Self::RECORD))?;
        let out = out.to_owned();
        let plan = Self { plants, controller, task, greenhouse, period_min, seed, out, ..Self::default() };
        Ok(Self { photographs: true, resume: true, ..plan })
    }

    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let plan = Self::of_folder(folder)?;
        let done = (0..plan.plants).filter(|&plant| plan.photographed_track(plant).exists()).count();
        let part = PartStatus::new("photographed", done as u64, plan.plants.into(), "plants");
        WorkStatus::of::<Self>(folder, vec![part])
    }

    /// Checks all folders before the first plant grows.
    fn begin(&self, _monitor: &dyn Monitor) -> Result<Photographing<'_>, Error> {
        if !self.photographs {
            let problem =
                "plants without `photographs` grow as a whole: only photographed ones are units of long work";
            return Err(Error::Plan(problem.to_owned()));
        }
        for plant in 0..self.plants {
            let record = self.folder(plant).join("run.toml");
            check_same(&record, &self.config(self.seed_of(plant)).to_toml()?, true, "a plant")?;
        }
        Ok(Photographing(self))
    }

    fn collect(&self, _begun: &Photographing<'_>, _monitor: &dyn Monitor) -> Result<GrowResults, Error> {
        let grown = |plant| {
            let path = self.photographed_track(plant);
            let track = files::read_track(&path)?;
            Ok::<_, Error>(self.grown(path, &track))
        };
        let results = self.results((0..self.plants).map(grown).collect::<Result<_, _>>()?);
        files::write_json(&self.out.join("grow.json"), &results)?;
        Ok(results)
    }
}

/// Plants that are photographed.
pub struct Photographing<'p>(&'p GrowPlan);

impl Units for Photographing<'_> {
    fn record(&self) -> Result<Record, Error> {
        let GrowPlan { plants, controller, task, greenhouse, period_min, seed, .. } = self.0.clone();
        let content = GrowRecord {
            schema: GrowPlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: true,
            seed,
            plants,
            period_min,
            controller,
            task,
            greenhouse,
        };
        Record::of(self.0, &content)
    }

    fn stages(&self) -> Vec<Stage> {
        let photographs = u64::from(self.0.task.max_steps) + 1;
        let unit = |plant| {
            let about = format!("photographs of plant {}", plant + 1);
            Unit { size: photographs, ..Unit::new(format!("plant-{:04}", plant + 1), about) }
        };
        let units = (0..self.0.plants).map(unit).collect();
        vec![Stage { name: "photograph".to_owned(), pace: Pace::Parallel, units }]
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        Ok(self.0.photographed_track(place.unit as u32).exists())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let plant = place.unit as u32;
        self.0.photograph(&self.0.folder(plant), self.0.seed_of(plant), monitor)
    }
}

impl GrowPlan {
    /// The track file of a photographed plant, from 0: it comes last, so that a plant that has it is complete.
    fn photographed_track(&self, plant: u32) -> PathBuf {
        self.folder(plant).join("track.csv")
    }

    /// Grows and photographs the plant of `seed` in `folder`. What was interrupted grows again from the start, which takes little
    /// time beside the photographs; photographs that exist are kept.
    fn photograph(&self, folder: &Path, seed: u64, monitor: &dyn Monitor) -> Result<(), Error> {
        let views = if self.greenhouse.scene.cameras > 1 {
            &[View::Front, View::Side][..]
        } else {
            &[View::Front][..]
        };
        for view in views {
            files::make_folder(&folder.join(view.folder()))?;
        }
        let _lock = lock(folder)?;
        let record = folder.join("run.toml");
        let goes_on = record.exists();
        files::write(&record, self.config(seed).to_toml()?.as_bytes())?;
        self.write_calibrations(folder, views)?;
        let (mut truth, mut written) = (None, Ok(()));
        let mut watch = |sample: &Sample, device: &TentHandle| {
            written = views.iter().try_for_each(|view| {
                let path = folder.join(view.folder()).join(format!("{:06}.jpg", sample.step));
                if goes_on && path.exists() {
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
        let Some((csv, jsonl)) = truth else { return Err(Error::Interrupted { folder: self.out.clone() }) };
        files::write(&folder.join("truth.csv"), &csv)?;
        files::write(&folder.join("truth.jsonl"), &jsonl)?;
        Ok(files::write_track(&folder.join("track.csv"), &track)?)
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
