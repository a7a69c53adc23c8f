//! An evolutionary run as a file: its checkpoint, checked when it is read.

use serde::Deserialize;

use super::{EvolutionConfig, EvolutionError, EvolutionRun};
use crate::file::{schema_of, sha256};

/// What a saved run calls itself.
const SCHEMA: &str = "tropism.evolution-run/1";

/// A saved run that cannot be resumed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SavedRunError {
    /// Not JSON, cut short, or not of a saved run's form.
    #[error("not a saved run: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("found schema \"{found}\", wanted \"{SCHEMA}\"")]
    Schema {
        /// What was found.
        found: String,
    },
    /// Some value is not what was written.
    #[error("found a run with the check sum {found}, wanted {wanted}: the file was changed or damaged")]
    Damaged {
        /// First digits of the check sum of what was read.
        found: String,
        /// First digits of the one in the file.
        wanted: String,
    },
    /// Its parts contradict each other.
    #[error("found {history} generations in its history, wanted {generations}")]
    History {
        /// Generations in its history.
        history: usize,
        /// Generations of its population.
        generations: u32,
    },
    /// A run of other settings, or another one of the same evolution.
    #[error("found a run with seed {found}, wanted seed {wanted} and the evolution's settings")]
    OtherRun {
        /// Its seed.
        found: u64,
        /// The seed of the run that was asked for.
        wanted: u64,
    },
    /// The evolution that it should belong to cannot be.
    #[error(transparent)]
    Evolution(#[from] EvolutionError),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "schema")]
    _schema: String,
    sha256: String,
    run: EvolutionRun,
}

impl EvolutionRun {
    /// The whole run as JSON, with `"schema": "tropism.evolution-run/1"` and a check sum.
    #[must_use]
    pub fn to_json(&self) -> String {
        let (text, sum) = self.summed();
        format!("{{\"schema\":\"{SCHEMA}\",\"sha256\":\"{sum}\",\"run\":{text}}}\n")
    }

    fn summed(&self) -> (String, String) {
        let text = serde_json::to_string(self).expect("a run has no maps and no unwritable values");
        let sum = sha256(&text);
        (text, sum)
    }

    /// Reads run number `index` of an evolution with `seed`, as [`to_json`](Self::to_json) wrote it.
    ///
    /// # Errors
    /// [`SavedRunError`]: broken JSON, another schema, a value that is not what was written, or another run.
    pub fn from_json(
        json: &str,
        config: &EvolutionConfig,
        outputs: usize,
        seed: u64,
        index: u32,
    ) -> Result<Self, SavedRunError> {
        let schema = schema_of(json)?;
        if schema != SCHEMA {
            return Err(SavedRunError::Schema { found: schema });
        }
        let File { sha256, run, .. } = serde_json::from_str(json)?;
        let (_, sum) = run.summed();
        if sum != sha256 {
            let start = |sum: &str| sum.chars().take(12).collect();
            return Err(SavedRunError::Damaged { found: start(&sum), wanted: start(&sha256) });
        }
        if run.history.len() != run.neat.generation() as usize {
            return Err(SavedRunError::History {
                history: run.history.len(),
                generations: run.neat.generation(),
            });
        }
        let wanted = config.begin(outputs, seed, index).map_err(EvolutionError::from)?;
        let settings = |run: &Self| (run.seed, run.neat.seed(), run.episodes);
        if settings(&run) != settings(&wanted) || run.neat.config() != wanted.neat.config() {
            return Err(SavedRunError::OtherRun { found: run.seed, wanted: wanted.seed });
        }
        Ok(run)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolve::Evolution;
    use crate::plant::tip::{TipModel, TipModelConfig};
    use crate::task::Targets;
    use crate::track::Track;

    /// A model of one plant that leans after a lamp, and a task so short that a generation takes a moment.
    fn world() -> (TipModel, Targets) {
        let rows: String = (0..60)
            .map(|step: i32| {
                let is_left = step / 20 % 2 == 0;
                let x = 0.2 * f64::from(20 - (step % 40 - 20).abs());
                format!("{x},{},{}\n", 4.0 + 0.05 * f64::from(step), if is_left { "right" } else { "left" })
            })
            .collect();
        let track = Track::read_csv(format!("tip_x_cm,tip_y_cm,light\n{rows}").as_bytes()).unwrap();
        let model = TipModel::fit([&track], TipModelConfig::default()).unwrap();
        (model, Targets { max_steps: 60, ..Targets::default() })
    }

    fn short() -> EvolutionConfig {
        EvolutionConfig { generations: 8, ..EvolutionConfig::default() }
    }

    fn begun(generations: u32) -> EvolutionRun {
        let (model, task) = world();
        let evolution = Evolution::new(&model, &task, short(), 7).unwrap();
        let mut run = evolution.begin(2).unwrap();
        for _ in 0..generations {
            evolution.advance(&mut run);
        }
        run
    }

    #[test]
    fn a_saved_run_resumes_to_the_same_bits() {
        let (model, task) = world();
        let evolution = Evolution::new(&model, &task, short(), 7).unwrap();
        let mut saved = evolution.resume(2, &begun(3).to_json()).unwrap();
        let flow = evolution.finish(&mut saved, &mut |_| std::ops::ControlFlow::Continue(()));
        assert!(flow.is_continue());
        assert_eq!(saved.to_json(), begun(8).to_json());
    }

    #[test]
    fn every_cut_and_every_changed_digit_is_refused() {
        let json = begun(2).to_json();
        let refusal = |json: &str| EvolutionRun::from_json(json, &short(), 1, 7, 2).unwrap_err().to_string();
        for tenth in 0..10 {
            assert!(refusal(&json[..json.len() * tenth / 10]).starts_with("not a saved run: "), "{tenth}");
        }
        let changed = |from: &str, to: &str| {
            assert!(json.contains(from), "{from}");
            refusal(&json.replacen(from, to, 1))
        };
        assert!(changed("\"best_ever\":", "\"best_ever\":1").contains("changed or damaged"));
        assert!(changed("evolution-run/1", "evolution-run/2").contains("wanted \"tropism.evolution-run/1\""));
        assert!(changed("\"history\"", "\"story\"").contains("unknown field `story`"));
        assert!(changed("\"weight\":", "\"weight\":1e308,\"wait\":").starts_with("not a saved run"));
    }

    #[test]
    fn the_run_of_another_evolution_is_refused() {
        let json = begun(1).to_json();
        let refusal = |config: &EvolutionConfig, seed, index| {
            EvolutionRun::from_json(&json, config, 1, seed, index).unwrap_err().to_string()
        };
        assert!(refusal(&short(), 7, 3).contains("found a run with seed"));
        assert!(refusal(&short(), 8, 2).contains("found a run with seed"));
        let mut other = short();
        other.neat.survival_rate = 0.5;
        assert!(refusal(&other, 7, 2).contains("the evolution's settings"));
    }

    #[test]
    fn history_and_population_must_agree() {
        let mut run = begun(2);
        run.history.pop();
        let error = EvolutionRun::from_json(&run.to_json(), &short(), 1, 7, 2).unwrap_err().to_string();
        assert_eq!(error, "found 1 generations in its history, wanted 2");
    }
}
