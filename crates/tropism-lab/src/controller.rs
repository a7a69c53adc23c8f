//! Controllers as data: what a plan and a run folder keep of a controller, from which it is built again.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::control::{Controller, Greedy, Periodic, PredictiveGreedy};
use tropism::evolve::{Champion, Trial, TunedRule};
use tropism::lamps::{Layout, Light};
use tropism::plant::PlantModel;
use tropism::task::Task;
use tropism::track::SAME_PERIOD;

use crate::error::Error;
use crate::files::{self, FileError};
use crate::model::{Model, ModelKind};

/// Minutes between two switches of the paper's periodic controller: six hours (section 2.2.1).
pub const PAPER_SWITCH_MIN: f64 = 360.0;

/// The most steps between two switches of a periodic controller: as many as a task may have.
const MAX_SWITCH_STEPS: f64 = 1e6;

/// A controller as data, complete: [`build`](Self::build) needs no file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum ControllerSpec {
    /// Lights each lamp in turn, whatever the plant does.
    Periodic {
        /// Minutes until the other lamp is lit, by the clock: each switch is made at the step nearest to its time. Paper:
        /// 360.
        minutes: f64,
        /// The lamp that is lit first.
        #[serde(default = "left")]
        first: Light,
    },
    /// Lights the lamp towards the next target: the baseline without a model.
    Greedy,
    /// Lights what an evolved network decides.
    Network {
        /// The network with its sensors, lamps and task.
        champion: Box<Champion>,
    },
    /// Lights what a tuned rule decides.
    Rule {
        /// The rule with its lamps, period and task.
        tuned: Box<TunedRule>,
    },
}

const fn left() -> Light {
    Light::LEFT
}

impl Default for ControllerSpec {
    /// The paper's open-loop controller.
    fn default() -> Self {
        Self::periodic(PAPER_SWITCH_MIN)
    }
}

impl ControllerSpec {
    /// A periodic controller that lights the left lamp first and switches every `minutes`.
    #[must_use]
    pub const fn periodic(minutes: f64) -> Self {
        Self::Periodic { minutes, first: left() }
    }

    /// A controller that obeys the network of `champion`.
    ///
    /// # Errors
    /// [`Error::Plan`] if the network has not the inputs of its sensors and the outputs of its lamps.
    pub fn network(champion: Champion) -> Result<Self, Error> {
        champion.check().map_err(|error| Error::Plan(error.to_string()))?;
        Ok(Self::Network { champion: Box::new(champion) })
    }

    /// Reads a champion file, such as `champion.json`, a network alone, or a rule file, such as `rule.json`.
    ///
    /// # Errors
    /// [`Error`] names the file.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = files::read_text(path)?;
        if ModelKind::of_file(&text).is_some() {
            let problem = "found a model of a plant, wanted an evolved network or a tuned rule: make one on it by `evolve` or `tune`";
            return Err(FileError::content(path, problem.to_owned()).into());
        }
        if TunedRule::is_named_in(&text) {
            let tuned = files::read_as(path, TunedRule::from_json)?;
            return Ok(Self::Rule { tuned: Box::new(tuned) });
        }
        let champion = files::read_as(path, Champion::from_json)?;
        Self::network(champion).map_err(Error::at(path.display()))
    }

    /// The champion that decides; `None` if none does.
    #[must_use]
    pub fn champion(&self) -> Option<&Champion> {
        match self {
            Self::Network { champion } => Some(champion),
            Self::Periodic { .. } | Self::Greedy | Self::Rule { .. } => None,
        }
    }

    /// The task that it was evolved or tuned for; `None` where there is none.
    #[must_use]
    pub fn own_task(&self) -> Option<&Task> {
        match self {
            Self::Periodic { .. } | Self::Greedy => None,
            Self::Network { champion } => champion.task.as_ref(),
            Self::Rule { tuned } => tuned.task.as_ref(),
        }
    }

    /// The lamps of the model that it was evolved or tuned on; `None` where there is none.
    #[must_use]
    pub fn own_layout(&self) -> Option<&Layout> {
        match self {
            Self::Periodic { .. } | Self::Greedy => None,
            Self::Network { champion } => Some(&champion.layout),
            Self::Rule { tuned } => Some(&tuned.layout),
        }
    }

    /// Minutes from one step to the next of the model that it was evolved or tuned on; `None` where there is none.
    #[must_use]
    pub fn own_period_min(&self) -> Option<f64> {
        match self {
            Self::Periodic { .. } | Self::Greedy => None,
            Self::Network { champion } => Some(champion.period_min),
            Self::Rule { tuned } => Some(tuned.period_min),
        }
    }

    /// What its model predicts for unseen plants; `None` where it does not say.
    #[must_use]
    pub fn expected(&self) -> Option<Trial> {
        match self {
            Self::Periodic { .. } | Self::Greedy => None,
            Self::Network { champion } => champion.expected,
            Self::Rule { tuned } => tuned.expected,
        }
    }

    /// SHA-256 of the file of the model that it was evolved or tuned on, in hexadecimal; `None` where it is not known.
    #[must_use]
    pub fn own_model_sha256(&self) -> Option<&str> {
        match self {
            Self::Periodic { .. } | Self::Greedy => None,
            Self::Network { champion } => champion.model_sha256.as_deref(),
            Self::Rule { tuned } => tuned.model_sha256.as_deref(),
        }
    }

    /// Whether it decides without looking at the plant.
    #[must_use]
    pub const fn is_open_loop(&self) -> bool {
        matches!(self, Self::Periodic { .. })
    }

    /// The task for such a controller where none is named: the one that it was evolved or tuned for, the 1000 steps of an
    /// open-loop experiment, or the paper's three targets.
    #[must_use]
    pub fn default_task(&self) -> Task {
        match self.own_task() {
            Some(task) => task.clone(),
            None if self.is_open_loop() => Task::open_loop(1000),
            None => Task::default(),
        }
    }

    /// Checks that the controller can be built for the lamps of `layout` and steps of `period_min` minutes.
    ///
    /// # Errors
    /// [`Error::Plan`] says what was found and what was wanted.
    pub fn check(&self, layout: &Layout, period_min: f64) -> Result<(), Error> {
        match self {
            Self::Periodic { minutes, first } => {
                if !layout.contains(*first) {
                    return Err(Error::Plan(format!(
                        "controller: found first = {first}, wanted a lamp of the rig"
                    )));
                }
                if (1.0..=MAX_SWITCH_STEPS).contains(&switch_steps(*minutes, period_min)) {
                    return Ok(());
                }
                Err(Error::Plan(format!(
                    "controller: found a switch every {minutes} minutes, wanted one to a million steps of {period_min} minutes"
                )))
            }
            Self::Greedy => Ok(()),
            Self::Network { champion } => {
                champion.check().map_err(|error| Error::Plan(error.to_string()))?;
                if champion.layout.len() == layout.len() && !is_same_period(champion.period_min, period_min) {
                    return Err(Error::Plan(format!(
                        "controller: found a network for steps of {} minutes, wanted one for steps of {period_min} minutes: \
                         fit a model to tracks of such steps, and evolve on it",
                        champion.period_min
                    )));
                }
                if champion.layout.len() == layout.len() {
                    return Ok(());
                }
                Err(Error::Plan(format!(
                    "controller: found a network for {} lamps, wanted one for the {} lamps of the rig or model",
                    champion.layout.len(),
                    layout.len()
                )))
            }
            Self::Rule { tuned } => {
                tuned.check().map_err(Error::in_plan("controller"))?;
                let found = (tuned.layout.len(), tuned.period_min);
                // A rule steers by the places of the lamps: it may have been tuned with some of them.
                let has_lamps = tuned.layout.lamps().iter().all(|lamp| layout.lamps().contains(lamp));
                if (found.0 == layout.len() || has_lamps) && is_same_period(found.1, period_min) {
                    return Ok(());
                }
                Err(Error::Plan(format!(
                    "controller: found a rule for {} lamps and steps of {} minutes, wanted one for {} lamps and steps of \
                     {period_min} minutes",
                    found.0,
                    found.1,
                    layout.len()
                )))
            }
        }
    }

    /// Checks that the controller can steer plants of `model`.
    ///
    /// # Errors
    /// [`Error::Plan`] as [`check`](Self::check), and where it dims lamps and the model knows one alone.
    pub(crate) fn check_on(&self, model: &Model) -> Result<(), Error> {
        self.check(model.layout(), model.period_min())?;
        let light = self.champion().map_or(Ok(()), |champion| champion.dimming.check(model));
        light.map_err(|error| Error::Plan(error.to_string()))
    }

    /// Builds the controller for `task`, with all its neurons at rest, for the lamps of `layout` and steps of `period_min`
    /// minutes.
    ///
    /// # Panics
    /// If [`check`](Self::check) refuses it.
    #[must_use]
    pub fn build(&self, task: &Task, layout: &Layout, period_min: f64) -> Box<dyn Controller + Send> {
        match self {
            Self::Periodic { minutes, first } => {
                let steps_each = switch_steps(*minutes, period_min);
                Box::new(Periodic::every(steps_each, layout).starting_with(*first))
            }
            Self::Greedy => Box::new(Greedy::new(task, layout)),
            Self::Network { champion } => {
                Box::new(champion.controller(task).expect("a controller that was checked"))
            }
            Self::Rule { tuned } => Box::new(PredictiveGreedy::new(tuned.rule, task, layout)),
        }
    }

    /// A few words for people: `periodic, every 6 h`, `greedy`, `rule`, or the size of the network.
    #[must_use]
    pub fn description(&self) -> String {
        match self {
            Self::Periodic { minutes, .. } if minutes % 60.0 == 0.0 => {
                format!("periodic, every {} h", minutes / 60.0)
            }
            Self::Periodic { minutes, .. } => format!("periodic, every {minutes} min"),
            Self::Greedy => "greedy".to_owned(),
            Self::Network { champion } => {
                let genome = &champion.genome;
                format!("network, {} neurons, {} links", genome.neurons().len(), genome.links().len())
            }
            Self::Rule { .. } => "rule".to_owned(),
        }
    }
}

/// Whether two periods are one, but for what a clock keeps.
fn is_same_period(one: f64, other: f64) -> bool {
    (one - other).abs() <= SAME_PERIOD * other
}

/// Steps between two switches; a time that is a step but for rounding is one.
fn switch_steps(minutes: f64, period_min: f64) -> f64 {
    let steps = minutes / period_min;
    if (steps - steps.round()).abs() < 1e-9 * steps { steps.round() } else { steps }
}
