//! Populations of virtual beans: tracks, with or without photographs.
//!
//! In: a virtual tent with a species, a controller, a task and a seed. Out: one track a plant. The tip is where the
//! detector of the paper would place it; no photograph is analysed. With photographs each plant has a run folder, and
//! the ground truth stands beside them.

mod acceptance;
mod kinematics;
mod photographs;

use std::ops::ControlFlow;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::math::statistics::mean;
use tropism::parallel;
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};
use tropism::vision::VisionConfig;
use tropism_bean::Trial;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;
use tropism_rig::file::RigFile;

pub use self::acceptance::{AcceptancePlan, AcceptanceRow, OPEN_LOOP_PLANTS, STEERED_PLANTS};
pub use self::kinematics::{KinematicsPlan, KinematicsResults, MeasuredQuantity};
use crate::controller::ControllerSpec;
use crate::folder::check_no_other_work;
use crate::run::RunConfig;
use crate::work::Work;
use crate::{Error, Monitor, Workflow, files, sequences, work};

/// Least and greatest number of plants that a thread grows side by side. Chosen: a vector of plants; and few enough that an
/// interruption loses little, for tracks are written when all of them have grown.
const PLANTS_AT_ONCE: [usize; 2] = [8, 64];

/// Grows virtual beans under a controller, and writes their tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GrowPlan {
    /// Number of plants, each an individual of the species, 1 to 1000000. Paper: 6 (section 2.2.1).
    pub plants: u32,
    /// Controller of the lamps.
    pub controller: ControllerSpec,
    /// Task of the controller.
    pub task: Task,
    /// Species, lamps and tent. Its scene and faults only change photographs.
    pub greenhouse: Greenhouse,
    /// Time from one step to the next, in min. Paper: 5 (section 2.1).
    pub period_min: f64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Folder for the tracks, or for the run folders of the plants.
    pub out: PathBuf,
    /// Whether to write a photograph of each step, with the ground truth.
    pub photographs: bool,
    /// Angle by which the pots are tipped to the right at the first step, in degrees, -180 to 180. Not with `photographs`.
    pub tilt_deg: f64,
    /// Whether all lamps stay dark. Not with `photographs`.
    pub dark: bool,
    /// Whether tracks that are there are replaced. Photographs never are.
    pub replace: bool,
    /// Whether to continue with photographed plants in `out`.
    pub resume: bool,
}

impl Default for GrowPlan {
    fn default() -> Self {
        let controller = ControllerSpec::default();
        Self {
            plants: 6,
            task: controller.default_task(),
            controller,
            greenhouse: Greenhouse::default(),
            period_min: PAPER_PERIOD_MIN,
            seed: 1,
            out: "beans".into(),
            photographs: false,
            tilt_deg: 0.0,
            dark: false,
            replace: false,
            resume: false,
        }
    }
}

/// The plants of a [`GrowPlan`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrowResults {
    /// Always true.
    pub is_virtual: bool,
    /// Number of plants.
    pub plants: u32,
    /// The folder.
    pub out: PathBuf,
    /// Fitness of each plant, in cm; `None` without targets.
    pub fitness: Option<Vec<f64>>,
    /// Mean fitness, in cm; `None` without targets.
    pub mean_fitness: Option<f64>,
    /// Mean height of the tips at the end, in cm.
    pub mean_final_height_cm: f64,
    /// Track file of each plant.
    pub tracks: Vec<PathBuf>,
}

/// A plant that has grown.
struct GrownPlant {
    /// Its track file.
    track: PathBuf,
    /// `None` without targets.
    fitness: Option<f64>,
    final_height_cm: f64,
}

impl Workflow for GrowPlan {
    type Results = GrowResults;

    const SCHEMA: &'static str = "tropism.grow/1";

    fn check(&self) -> Result<(), Error> {
        Error::check_range("plants", self.plants, 1_000_000)?;
        self.config(0).check()?;
        let Greenhouse { variation, bean, layout, scene, solids, .. } = self.greenhouse.clone();
        let scene = Scene { cameras: scene.cameras, ..Scene::default() };
        let without_photographs =
            Greenhouse { variation, bean, layout, scene, solids, ..Greenhouse::default() };
        if !self.photographs && self.greenhouse != without_photographs {
            return Err(Error::Plan(
                "found `greenhouse.scene` or `greenhouse.faults`, wanted `photographs` with them: they only change \
                 photographs"
                    .to_owned(),
            ));
        }
        if !(-180.0..=180.0).contains(&self.tilt_deg) {
            return Err(Error::Plan(format!(
                "found `tilt_deg` {}, wanted -180 to 180 degrees",
                self.tilt_deg
            )));
        }
        if self.photographs {
            if self.tilt_deg != 0.0 || self.dark {
                return Err(Error::Plan(
                    "`tilt_deg` and `dark` cannot be photographed: leave `photographs` out".to_owned(),
                ));
            }
            return Ok(());
        }
        check_no_other_work(&self.out, <Self as Work>::RECORD)?;
        let next = self.track_path(self.plants);
        if next.exists() {
            return Err(Error::Plan(format!(
                "{}: this is the track of one more plant: choose a folder without other plants, for they would be mixed",
                next.display()
            )));
        }
        (0..self.plants).try_for_each(|plant| files::check_free(&self.track_path(plant), self.replace))
    }

    fn prepare(&mut self) -> Result<(), Error> {
        sequences::draw(&mut self.task, &self.greenhouse, self.period_min, self.seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<GrowResults, Error> {
        if self.photographs {
            return work::perform(self, monitor);
        }
        files::make_folder(&self.out)?;
        Ok(self.results(self.grow(monitor)?))
    }
}

impl GrowPlan {
    /// The run folder of a photographed plant, from 0.
    #[must_use]
    pub fn folder(&self, plant: u32) -> PathBuf {
        self.out.join(format!("plant-{:04}", plant + 1))
    }

    /// The track file of a plant, from 0, without photographs.
    #[must_use]
    pub fn track_path(&self, plant: u32) -> PathBuf {
        self.folder(plant).with_added_extension("csv")
    }

    /// The seed of a plant, from 0. It fits into TOML, so that a run with this seed grows the same plant.
    fn seed_of(&self, plant: u32) -> u64 {
        random::derive(self.seed, Purpose::Plant, plant.into()) >> 1
    }

    /// The tent with the solids of the task.
    fn tent(&self) -> Greenhouse {
        self.greenhouse.clone().among(&self.task.solids())
    }

    /// The run that would grow and photograph the plant of `seed`.
    fn config(&self, seed: u64) -> RunConfig {
        let rig = RigFile {
            period_min: self.period_min,
            ..RigFile::greenhouse(self.tent(), VisionConfig::default())
        };
        RunConfig::new(rig, self.controller.clone(), self.task.clone(), seed)
    }

    /// What counts of a plant with this track.
    fn grown(&self, path: PathBuf, track: &Track) -> GrownPlant {
        GrownPlant {
            fitness: self.task.has_goal().then(|| self.task.fitness(track)),
            final_height_cm: track.samples.last().map_or(f64::NAN, |last| last.tip.y),
            track: path,
        }
    }

    fn results(&self, plants: Vec<GrownPlant>) -> GrowResults {
        let fitness: Option<Vec<f64>> = plants.iter().map(|plant| plant.fitness).collect();
        let heights = plants.iter().map(|plant| plant.final_height_cm);
        GrowResults {
            is_virtual: true,
            plants: self.plants,
            out: self.out.clone(),
            mean_fitness: fitness.as_ref().map(|fitness| mean(fitness.iter().copied())),
            fitness,
            mean_final_height_cm: mean(heights),
            tracks: plants.into_iter().map(|plant| plant.track).collect(),
        }
    }

    /// Grows all plants without photographs.
    fn grow(&self, monitor: &dyn Monitor) -> Result<Vec<GrownPlant>, Error> {
        monitor.stage("grow", self.plants.into());
        let plants: Vec<u32> = (0..self.plants).collect();
        let at_once =
            (plants.len() / rayon::current_num_threads()).clamp(PLANTS_AT_ONCE[0], PLANTS_AT_ONCE[1]);
        let parts: Vec<&[u32]> = plants.chunks(at_once).collect();
        let plants: Vec<Vec<Option<GrownPlant>>> =
            parallel::try_map(parts.len(), |part| self.grow_side_by_side(parts[part], monitor))?;
        let plants: Option<Vec<GrownPlant>> = plants.into_iter().flatten().collect();
        plants.ok_or_else(|| Error::Cancelled("some tracks were not written".to_owned()))
    }

    /// Grows some plants in one thread, and writes the tracks of those that were not interrupted.
    fn grow_side_by_side(
        &self,
        plants: &[u32],
        monitor: &dyn Monitor,
    ) -> Result<Vec<Option<GrownPlant>>, Error> {
        let trial = Trial {
            solids: self.tent().solids,
            tilt_deg: self.tilt_deg,
            is_dark: self.dark,
            ..self.greenhouse.trial(self.period_min)
        };
        let seeds: Vec<u64> = plants.iter().map(|&plant| self.seed_of(plant)).collect();
        let make_controller = |_| self.controller.build(&self.task, &trial.layout, self.period_min);
        let mut is_whole = vec![true; plants.len()];
        let mut watch = |place: usize, sample: &Sample| {
            is_whole[place] = monitor.may_go_on();
            if !is_whole[place] || sample.is_dark() {
                monitor.advance(1);
            }
            if is_whole[place] { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let tracks = trial.grow_all(&seeds, make_controller, &self.task, &mut watch);
        let write = |((&plant, track), is_whole): ((&u32, Track), bool)| {
            if !is_whole {
                return Ok(None);
            }
            let path = self.track_path(plant);
            files::write_track(&path, &track)?;
            Ok(Some(self.grown(path, &track)))
        };
        plants.iter().zip(tracks).zip(is_whole).map(write).collect()
    }
}
