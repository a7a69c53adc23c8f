//! The runs of an evolution at work: from their checkpoints to their last generation.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use tropism::evolve::{Evolution, EvolutionRun};
use tropism::parallel;

use super::EvolvePlan;
use super::progress::EvolutionMonitor;
use super::record::checkpoint_path;
use crate::files::FileError;
use crate::model::Model;
use crate::stopwatch::timed;
use crate::{Checkpoint, Error, Monitor};

impl EvolvePlan {
    /// Evolves all runs to their last generation; with the processor time of all, in s.
    pub(super) fn evolve(
        &self,
        evolution: &Evolution<'_, Model>,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<EvolutionRun>, f64), Error> {
        let status = Mutex::new(EvolutionMonitor::new(self.evolution.runs as usize, self.task.kind.unit()));
        let evolve = |index| {
            let (run, seconds) = timed(|| self.evolve_run(index as u32, evolution, monitor, &status));
            Ok::<_, Error>((run?, seconds))
        };
        let runs: Vec<(Option<EvolutionRun>, f64)> = parallel::try_map(self.evolution.runs as usize, evolve)?;
        let seconds = runs.iter().map(|(_, seconds)| seconds).sum();
        let runs: Option<Vec<EvolutionRun>> = runs.into_iter().map(|(run, _)| run).collect();
        Ok((runs.ok_or_else(|| self.interrupted())?, seconds))
    }

    /// Evolves run `index` to its last generation, from its checkpoint if there is one; `None` if it was interrupted.
    fn evolve_run(
        &self,
        index: u32,
        evolution: &Evolution<'_, Model>,
        monitor: &dyn Monitor,
        status: &Mutex<EvolutionMonitor>,
    ) -> Result<Option<EvolutionRun>, Error> {
        let checkpoint = Checkpoint::new(checkpoint_path(&self.out, index));
        let interval = Duration::from_secs(self.checkpoint_s);
        let mut run = self.begin(evolution, index, &checkpoint, monitor)?;
        if let Some(last) = run.history.last() {
            monitor.skip(run.history.len() as u64);
            if let Ok(mut status) = status.lock() {
                status.resume(index, last);
            }
        }
        let (mut saved, mut saved_generations) = (Instant::now(), run.history.len());
        while (run.history.len() as u32) < self.evolution.generations && monitor.may_go_on() {
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
        Ok((run.history.len() as u32 == self.evolution.generations).then_some(run))
    }

    /// Run `index` as its checkpoint has it, or before its first generation. A checkpoint that is broken costs time and nothing
    /// else: the run begins anew, and comes to the same bits.
    fn begin(
        &self,
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
}
