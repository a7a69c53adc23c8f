//! `tropism grow`: virtual beans, many and fast.

mod check;
mod kinematics;
mod photographs;
mod tune;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use tropism::greenhouse::bean::grow;
use tropism::greenhouse::tent::Greenhouse;
use tropism::random::{self, Purpose};
use tropism::task::Targets;
use tropism::task::Task;
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};
use tropism_lab::{ControllerSpec, files};

use self::photographs::Nursery;
use crate::controller::{ControllerName, task_for};
use crate::options::{SeedOption, TaskOption, TentOptions};
use crate::shell::{Interrupted, Shell};

/// Grow virtual beans for statistics, without photographs or with them
///
/// The tip is the highest point as the paper's detector would place it: projected, leaves included, on its grid and with
/// its noise. Where the shoot apex truly is stands in further columns. No photograph is looked at, not even of those that
/// --photographs writes: they are for `tropism track` and for vision of your own, with the truth beside them.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism grow --plants 60 --steps 1000 --controller periodic:6h --out beans\n  \
                  tropism grow --photographs --cameras 2 --faults fly=0.01 --out beans\n  \
                  tropism grow --check\n  \
                  tropism grow --kinematics figures"
)]
pub(crate) struct Grow {
    /// Virtual beans, each an individual
    #[arg(long, default_value_t = 6, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    plants: u32,

    /// Steps of five minutes at most; 1000 (83.3 hours) by default for a periodic controller
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    steps: Option<u32>,

    /// periodic[:6h], chase, or the file of an evolved network
    #[arg(long, default_value = "periodic:6h", value_name = "CONTROLLER")]
    controller: ControllerName,

    /// Folder to make, with a track a plant; with --photographs, a run folder a plant
    #[arg(long, value_name = "DIR", required_unless_present_any = ["check", "kinematics"])]
    out: Option<PathBuf>,

    /// Keep a photograph of each step, and what is true of it
    #[arg(long)]
    photographs: bool,

    /// Go on with the plants in DIR where the same command stopped
    #[arg(long, requires = "photographs")]
    resume: bool,

    /// Hold open-loop and steered beans against what is published instead: each statistic with its range
    #[arg(long, conflicts_with_all = ["plants", "steps", "controller", "out", "photographs", "task", "scale", "scene", "cameras", "faults"])]
    check: bool,

    /// Draw how the typical plant answers the experiments of plant physiology instead, into DIR
    #[arg(long, value_name = "DIR", conflicts_with_all = ["check", "plants", "steps", "controller", "out", "photographs", "task", "scale", "scene", "cameras", "faults"])]
    kinematics: Option<PathBuf>,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,

    #[command(
        flatten,
        next_help_heading = "The virtual tent (--scene, --cameras and --faults with --photographs)"
    )]
    tent: TentOptions,
}

#[derive(Serialize)]
struct Outcome {
    is_virtual: bool,
    plants: u32,
    out: PathBuf,
    /// Fitness of each plant, where there is a task.
    fitness: Option<Vec<f64>>,
    mean_fitness: Option<f64>,
    mean_final_height_cm: f64,
    tracks: Vec<PathBuf>,
}

impl Grow {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let greenhouse = self.tent.load()?.unwrap_or_default();
        let species = &greenhouse.bean;
        if let Some(folder) = &self.kinematics {
            return kinematics::draw(species, folder, shell);
        }
        let Some(out) = &self.out else { return check::check(species, self.seed.seed, shell) };
        let plain = Greenhouse { scale: greenhouse.scale, bean: species.clone(), ..Greenhouse::default() };
        ensure!(
            self.photographs || greenhouse == plain,
            "found --scene, --cameras or --faults, wanted --photographs with them: they are about photographs"
        );
        let controller = self.controller.load(PAPER_PERIOD_MIN)?;
        let task = task_for(&controller, &self.task, self.steps)?;
        let is_open_loop = task.targets.is_empty();
        files::make_folder(out)?;
        let plants = match self.photographs {
            true => self.photograph(&greenhouse, &controller, &task, out, shell)?,
            false => self.grow(&greenhouse, &controller, &task, out, shell)?,
        };
        let Some(plants) = plants.into_iter().collect::<Option<Vec<_>>>() else {
            return Err(match self.photographs {
                true => Interrupted::resumable(out),
                false => Interrupted("some tracks were not written".to_owned()).into(),
            });
        };
        let count = plants.len() as f64;
        let fitness: Option<Vec<f64>> =
            (!is_open_loop).then(|| plants.iter().map(|(_, track)| task.fitness(track)).collect());
        let heights = plants.iter().map(|(_, track)| track.samples[track.samples.len() - 1].tip.y);
        let outcome = Outcome {
            is_virtual: true,
            plants: self.plants,
            out: out.clone(),
            mean_fitness: fitness.as_ref().map(|fitness| fitness.iter().sum::<f64>() / count),
            fitness,
            mean_final_height_cm: heights.sum::<f64>() / count,
            tracks: plants.into_iter().map(|(path, _)| path).collect(),
        };
        let mut text = format!(
            "{} virtual beans, {:.1} cm high in the end on average\n",
            self.plants, outcome.mean_final_height_cm
        );
        if let Some(mean) = outcome.mean_fitness {
            text += &format!("fitness {mean:.2} cm of at most {:.2} on average\n", task.best());
        }
        text += &format!("wrote {}\nnext: ", out.display());
        text += &match self.photographs {
            false => format!("tropism fit {}/*.csv --out model.json", out.display()),
            true => {
                let first = self.folder(out, 0);
                format!(
                    "tropism track {0}/photographs --calibration {0}/calibration.toml --out {0}.csv",
                    first.display()
                )
            }
        };
        shell.result(&text, &outcome)
    }

    /// Seed of one of the plants: a number that TOML can hold, so that `tropism run --seed` grows the same plant.
    fn seed_of(&self, plant: u32) -> u64 {
        random::derive(self.seed.seed, Purpose::Plant, plant.into()) >> 1
    }

    /// What one of the plants is called, in `out`.
    fn folder(&self, out: &Path, plant: u32) -> PathBuf {
        out.join(format!("plant-{:04}", plant + 1))
    }

    /// Each plant's track and its file; `None` where the user asked for an end.
    fn grow(
        &self,
        greenhouse: &Greenhouse,
        controller: &ControllerSpec,
        task: &Targets,
        out: &Path,
        shell: &Shell,
    ) -> Result<Vec<Option<(PathBuf, Track)>>> {
        let progress = shell.progress("grow", self.plants.into());
        let grow = |plant: u32| {
            let mut is_whole = true;
            let mut watch = |_: &Sample| {
                is_whole = !Shell::is_interrupted();
                if is_whole { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            };
            let Greenhouse { bean, scale, .. } = greenhouse;
            let mut controller = controller.build(task, PAPER_PERIOD_MIN);
            let track = grow(bean, self.seed_of(plant), *scale, &mut *controller, task, &mut watch);
            progress.add(1);
            if !is_whole {
                return Ok(None);
            }
            let path = self.folder(out, plant).with_extension("csv");
            files::write_track(&path, &track)?;
            Ok(Some((path, track)))
        };
        (0..self.plants).into_par_iter().map(grow).collect()
    }

    /// The same with photographs, a run folder a plant.
    fn photograph(
        &self,
        greenhouse: &Greenhouse,
        controller: &ControllerSpec,
        task: &Targets,
        out: &Path,
        shell: &Shell,
    ) -> Result<Vec<Option<(PathBuf, Track)>>> {
        let progress = shell.progress("photograph", u64::from(self.plants) * (u64::from(task.max_steps) + 1));
        let nursery = Nursery { greenhouse, controller, task, is_resumed: self.resume, progress: &progress };
        // Nothing is begun that could not be ended.
        for plant in 0..self.plants {
            nursery.check(&self.folder(out, plant), self.seed_of(plant))?;
        }
        (0..self.plants)
            .into_par_iter()
            .map(|plant| {
                let folder = self.folder(out, plant);
                let track = nursery.grow(&folder, self.seed_of(plant))?;
                Ok(track.map(|track| (folder.join("track.csv"), track)))
            })
            .collect()
    }
}
