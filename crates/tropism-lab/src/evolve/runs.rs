//! The runs of an evolution at work: from their checkpoints to their last generation.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tropism::evolve::{Evolution, EvolutionRun};
use tropism_bean::Species;

use super::progress::EvolutionMonitor;
use super::record::checkpoint_path;
use super::{EvolutionRecord, EvolvePlan, MODEL};
use crate::files::FileError;
use crate::model::Model;
use crate::reach::note_out_of_reach;
use crate::stopwatch::{Stopwatch, timed};
use crate::work::{Milestone, Pace, Place, Record, Stage, Unit, Units};
use crate::{Checkpoint, Error, Monitor, files};

/// An evolution at work.
pub struct Evolving<'p> {
    plan: &'p EvolvePlan,
    pub(super) model: Model,
    stopwatch: Stopwatch,
    /// What all runs have reached.
    status: Mutex<EvolutionMonitor>,
    /// Processor seconds of the runs so far.
    cpu_seconds: Mutex<f64>,
}

impl<'p> Evolving<'p> {
    /// # Errors
    /// [`Error`] if the settings do not go with the model.
    pub(super) fn new(plan: &'p EvolvePlan, model: Model) -> Result<Self, Error> {
        let status = Mutex::new(EvolutionMonitor::new(plan.evolution.runs as usize, plan.task.kind.unit()));
        let stopwatch = Stopwatch::start();
        let evolving = Self { plan, model, stopwatch, status, cpu_seconds: Mutex::new(0.0) };
        evolving.evolution()?;
        Ok(evolving)
    }

    /// The evolution.
    ///
    /// # Errors
    /// [`Error`] if the settings do not go with the model.
    pub(super) fn evolution(&self) -> Result<Evolution<'_, Model>, Error> {
        let EvolvePlan { task, evolution, seed, .. } = self.plan;
        Evolution::new(&self.model, task, evolution.clone(), *seed).map_err(Error::in_plan("evolution"))
    }

    /// All runs, each of which has reached its last generation.
    pub(super) fn runs(&self, monitor: &dyn Monitor) -> Result<Vec<EvolutionRun>, Error> {
        let evolution = self.evolution()?;
        (0..self.plan.evolution.runs)
            .map(|index| begin(&evolution, index, &self.checkpoint(index), monitor))
            .collect()
    }

    pub(super) fn cpu_seconds(&self) -> f64 {
        *self.cpu_seconds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn wall_seconds(&self) -> f64 {
        self.stopwatch.wall_seconds()
    }

    fn checkpoint(&self, index: u32) -> Checkpoint {
        Checkpoint::new(checkpoint_path(&self.plan.out, index))
    }

    /// Evolves run `index` to its last generation, from its checkpoint if there is one.
    fn evolve(&self, index: u32, monitor: &dyn Monitor) -> Result<(), Error> {
        let (evolution, checkpoint, status) = (self.evolution()?, self.checkpoint(index), &self.status);
        let generations = self.plan.evolution.generations;
        let interval = Duration::from_secs(self.plan.checkpoint_s);
        let mut run = begin(&evolution, index, &checkpoint, monitor)?;
        if let Some(last) = run.history.last() {
            monitor.skip(run.history.len() as u64);
            if let Ok(mut status) = status.lock() {
                status.resume(index, last);
            }
        }
        let (mut saved, mut saved_generations) = (Instant::now(), run.history.len());
        while (run.history.len() as u32) < generations && monitor.may_go_on() {
            let generation = evolution.advance(&mut run);
            monitor.generation(index, generation);
            monitor.advance(1);
            if let Ok(mut status) = status.lock() {
                status.update(index, generation, monitor);
            }
            if saved.elapsed() >= interval {
                checkpoint.save(run.to_json().as_bytes())?;
                (saved, saved_generations) = (Instant::now(), run.history.len());
            }
        }
        if run.history.len() > saved_generations {
            checkpoint.save(run.to_json().as_bytes())?;
        }
        let is_done = run.history.len() as u32 == generations;
        if is_done { Ok(()) } else { Err(Error::Interrupted { folder: self.plan.out.clone() }) }
    }
}

impl Units for Evolving<'_> {
    fn record(&self) -> Result<Record, Error> {
        let record = Record::of(self.plan, &EvolutionRecord::new(self.plan, &self.model))?;
        Ok(Record { beside: vec![(MODEL, self.model.to_json().into_bytes())], ..record })
    }

    fn stages(&self) -> Vec<Stage> {
        let size = u64::from(self.plan.evolution.generations);
        let unit = |index| Unit { size, ..Unit::new(format!("run-{index:02}"), format!("run {index}")) };
        let units = (0..self.plan.evolution.runs).map(unit).collect();
        vec![Stage { name: "evolve".to_owned(), pace: Pace::Parallel, units }]
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        let EvolvePlan { evolution, seed, out, .. } = self.plan;
        let index = place.unit as u32;
        let parse = |text: &str| EvolutionRun::from_json(text, evolution, *seed, index);
        let saved = files::read_as(&checkpoint_path(out, index), parse);
        let done = saved.ok().filter(|run| run.history.len() as u32 == evolution.generations);
        if let (Some(last), Ok(mut status)) =
            (done.as_ref().and_then(|run| run.history.last()), self.status.lock())
        {
            status.resume(index, last);
        }
        Ok(done.is_some())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let (evolved, seconds) = timed(|| self.evolve(place.unit as u32, monitor));
        *self.cpu_seconds.lock().unwrap_or_else(PoisonError::into_inner) += seconds;
        evolved
    }

    fn reached(&self, milestone: &Milestone, monitor: &dyn Monitor) -> Result<(), Error> {
        if *milestone == Milestone::Begun {
            note_out_of_reach(&self.plan.task, &Species::default(), monitor);
        }
        Ok(())
    }

    /// The same evolution with fewer generations: the first of them are the same to the bit.
    fn extends(&self, known: &str) -> bool {
        toml::from_str(known).is_ok_and(|known| EvolutionRecord::new(self.plan, &self.model).extends(&known))
    }
}

/// Run `index` as its checkpoint has it, or before its first generation. A checkpoint that is broken costs time and nothing
/// else: the run begins anew, and comes to the same bits.
fn begin(
    evolution: &Evolution<'_, Model>,
    index: u32,
    checkpoint: &Checkpoint,
    monitor: &dyn Monitor,
) -> Result<EvolutionRun, Error> {
    let parse = |text: &str| evolution.resume(index, text);
    let loaded = match checkpoint.load(parse) {
        Err(refused @ (FileError::Parse { .. } | FileError::Content { .. })) => {
            checkpoint.set_aside()?;
            let kept = checkpoint.broken();
            monitor.note(&format!("{refused}; kept as {}, run {index} begins anew", kept.display()));
            None
        }
        loaded => loaded?,
    };
    let Some(loaded) = loaded else {
        return evolution.begin(index).map_err(Error::at(format!("run {index}")));
    };
    if let Some(refused) = loaded.refused {
        monitor.note(&format!(
            "{refused}; run {index} goes on from {}, generation {}",
            checkpoint.previous().display(),
            loaded.value.search.generation()
        ));
    }
    Ok(loaded.value)
}
