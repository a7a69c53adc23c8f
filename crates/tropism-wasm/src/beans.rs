//! The six virtual beans of the paper's open-loop experiment, and the model of their tracks: `tropism grow --plants 6` and
//! `tropism fit`, to the bit.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use tropism::check::within;
use tropism::control::Periodic;
use tropism::lamps::Light;
use tropism::plant::tip::TipModelConfig;
use tropism::random::{self, Purpose};
use tropism::simulation::{AnyModel, ModelKind};
use tropism::task::Task;
use tropism::track::Track;
use tropism_bean::{Species, Trial};

use crate::SessionError;

/// Plants (section 2.2.1).
const PLANTS: u64 = 6;

/// Steps of an open-loop experiment: three days and a half.
const STEPS: u32 = 1000;

/// An open-loop experiment with six virtual beans.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpenLoop {
    /// Seed of the beans. Default: that of `tropism grow`, 1.
    pub seed: u64,
    /// Steps of five minutes between two switches of the lamps, 1 to 1000. Paper: 72, six hours (section 2.2.1).
    pub switch_steps: u32,
}

impl Default for OpenLoop {
    fn default() -> Self {
        Self { seed: 1, switch_steps: 72 }
    }
}

impl OpenLoop {
    /// The tracks of its beans, as their files hold them: rounded.
    pub(crate) fn tracks(&self) -> Result<Vec<Track>, SessionError> {
        within("switch_steps", self.switch_steps, 1..=STEPS)?;
        let species = Species::default();
        let trial = Trial::new(&species);
        let seed = |plant| random::derive(self.seed, Purpose::Plant, plant) >> 1;
        let seeds: Vec<u64> = (0..PLANTS).map(seed).collect();
        let periodic = |_| Periodic::new(self.switch_steps, &trial.layout).starting_with(Light::LEFT);
        let task = Task::open_loop(STEPS);
        let grown = trial.grow_all(&seeds, periodic, &task, &mut |_, _| ControlFlow::Continue(()));
        let read = |track: &Track| Track::read_csv(&track.to_csv()[..]);
        grown.iter().map(read).collect::<Result<_, _>>().map_err(SessionError::from)
    }
}

/// The model of `tracks`, labelled as virtual.
pub(crate) fn fit(
    tracks: &[Track],
    kind: ModelKind,
    config: &TipModelConfig,
) -> Result<AnyModel, SessionError> {
    Ok(kind.fit(&tracks.iter().collect::<Vec<_>>(), config, true)?)
}
