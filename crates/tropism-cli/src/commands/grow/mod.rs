//! `tropism grow`: virtual beans without photographs.

mod check;
mod kinematics;
mod tune;

use std::ops::ControlFlow;
use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use tropism::experiment::files;
use tropism::greenhouse::bean::{Species, grow};
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::track::{Sample, Track};

use crate::controller::{ControllerName, LoadedController};
use crate::options::{BeanOption, SeedOption, TaskOption};
use crate::shell::{Interrupted, Shell};

/// Grow virtual beans without photographs, for statistics
///
/// The tip is the highest point as the paper's detector would place it: projected, leaves included, on its grid and with
/// its noise. Where the shoot apex truly is stands in further columns.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism grow --plants 60 --steps 1000 --controller periodic:6h --out beans\n  \
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

    /// Folder to make, with a track a plant
    #[arg(long, value_name = "DIR", required_unless_present_any = ["check", "kinematics"])]
    out: Option<PathBuf>,

    /// Hold open-loop and steered beans against what is published instead: each statistic with its range
    #[arg(long, conflicts_with_all = ["plants", "steps", "controller", "out", "scale", "task"])]
    check: bool,

    /// Draw how the typical plant answers the experiments of plant physiology instead, into DIR
    #[arg(long, value_name = "DIR", conflicts_with_all = ["check", "plants", "steps", "controller", "out", "scale", "task"])]
    kinematics: Option<PathBuf>,

    /// Individual variation: 0 for average beans, 1 as between real plants, up to 2
    #[arg(long, default_value_t = 1.0, value_name = "X")]
    scale: f64,

    #[command(flatten)]
    bean: BeanOption,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,
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
        let species = self.bean.load()?.unwrap_or_default();
        if let Some(folder) = &self.kinematics {
            return kinematics::draw(&species, folder, shell);
        }
        let Some(out) = &self.out else { return check::check(&species, self.seed.seed, shell) };
        ensure!((0.0..=2.0).contains(&self.scale), "found --scale {}, wanted 0 to 2", self.scale);
        let controller = self.controller.load()?;
        let task = controller.task(&self.task, self.steps)?;
        let is_open_loop = task.targets.is_empty();
        files::make_folder(out)?;
        let progress = shell.progress("grow", self.plants.into());
        let task = &task;
        let plants: Vec<Option<(PathBuf, Track)>> = (0..self.plants)
            .into_par_iter()
            .map(|plant| {
                let grown = self.grow(&species, &controller, task, plant);
                progress.add(1);
                let Some(track) = grown else { return Ok(None) };
                let path = out.join(format!("plant-{:04}.csv", plant + 1));
                files::write_track(&path, &track)?;
                Ok(Some((path, track)))
            })
            .collect::<Result<_>>()?;
        drop(progress);
        let Some(plants) = plants.into_iter().collect::<Option<Vec<_>>>() else {
            return Err(Interrupted("some tracks were not written".to_owned()).into());
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
        text += &format!("wrote {0}\nnext: tropism fit {0}/*.csv --out model.json", out.display());
        shell.result(&text, &outcome)
    }

    fn grow(
        &self,
        species: &Species,
        controller: &LoadedController,
        task: &Task,
        plant: u32,
    ) -> Option<Track> {
        let seed = random::derive(self.seed.seed, Purpose::Plant, plant.into());
        let mut is_whole = true;
        let mut watch = |_: &Sample| {
            is_whole = !Shell::is_interrupted();
            if is_whole { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let track = grow(species, seed, self.scale, &mut *controller.build(task), task, &mut watch);
        is_whole.then_some(track)
    }
}
