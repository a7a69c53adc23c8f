//! Virtual beans beside the paper and the literature: each statistic with its accepted range.

use serde::{Deserialize, Serialize};
use tropism::control::PredictiveGreedy;
use tropism::evolve::{RuleGeneration, RuleSearch};
use tropism::parallel;
use tropism::plant::PlantModel;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::track::Track;
use tropism_bean::{Species, acceptance};

use crate::{Error, Monitor, Workflow};

/// Number of open-loop beans: ten sets of six, as the paper had six.
pub const OPEN_LOOP_PLANTS: u32 = 60;
/// Number of fresh beans that each controller steers; chosen by hand, as many as open-loop beans.
pub const STEERED_PLANTS: u32 = 60;
/// Number of sets of six from which a model is made to tune a controller on; chosen by hand, half of all sets.
const TUNED_SETS: usize = 5;

/// Compares virtual beans of a species with what is published on *Phaseolus vulgaris*.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AcceptancePlan {
    /// The species.
    pub species: Species,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for AcceptancePlan {
    fn default() -> Self {
        Self { species: Species::default(), seed: 1 }
    }
}

/// A statistic with its accepted range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AcceptanceRow {
    /// Number of the statistic in `docs/validation/bean-statistics.md`; some have several rows.
    pub number: u32,
    /// What was measured, with its unit.
    pub statistic: String,
    /// The value.
    pub value: f64,
    /// The least accepted value.
    pub least: f64,
    /// The greatest accepted value; `None` without an upper limit.
    pub most: Option<f64>,
    /// Whether the value lies in the range.
    pub holds: bool,
}

impl From<acceptance::AcceptanceRow> for AcceptanceRow {
    fn from(row: acceptance::AcceptanceRow) -> Self {
        let [least, most] = row.range;
        Self {
            number: row.number,
            statistic: row.statistic.to_owned(),
            value: row.value,
            least,
            most: most.is_finite().then_some(most),
            holds: row.holds(),
        }
    }
}

impl Workflow for AcceptancePlan {
    /// The rows in the order of their numbers.
    type Results = Vec<AcceptanceRow>;

    const SCHEMA: &'static str = "tropism.acceptance/1";

    fn check(&self) -> Result<(), Error> {
        self.species.check().map_err(Error::in_plan("species"))
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<Vec<AcceptanceRow>, Error> {
        let seeds: Vec<u64> = (0..OPEN_LOOP_PLANTS + STEERED_PLANTS)
            .map(|plant| random::derive(self.seed, Purpose::Plant, plant.into()))
            .collect();
        let (open_loop, fresh) = seeds.split_at(OPEN_LOOP_PLANTS as usize);
        let tracks = self.grow_open_loop(open_loop, monitor)?;
        let tuned = self.tune(&tracks, monitor)?;
        let mut rows = acceptance::population(&tracks);
        rows.extend(acceptance::single_plant(&self.species));
        rows.extend(acceptance::closed_loop(&self.species, fresh, &tuned));
        rows.sort_by_key(|row| row.number);
        Ok(rows.into_iter().map(AcceptanceRow::from).collect())
    }
}

impl AcceptancePlan {
    fn grow_open_loop(&self, seeds: &[u64], monitor: &dyn Monitor) -> Result<Vec<Track>, Error> {
        monitor.stage("open-loop beans", seeds.len() as u64);
        parallel::try_map(seeds.len(), |plant| {
            let track = acceptance::open_loop_experiment(&self.species, seeds[plant]);
            monitor.advance(1);
            if monitor.may_go_on() { Ok(track) } else { Err(Error::cancelled()) }
        })
    }

    /// Rules that are nearly perfect on the model that they were tuned on, or the best one if none is, each with its fitness
    /// on unseen plants of the model.
    fn tune(&self, tracks: &[Track], monitor: &dyn Monitor) -> Result<Vec<(f64, PredictiveGreedy)>, Error> {
        let (search, task) = (RuleSearch::default(), Task::default());
        monitor.stage("tuning controllers", TUNED_SETS as u64 * u64::from(search.generations));
        let tune = |set: &[Track]| {
            let model = TipModel::fit(set, TipModelConfig::default())?;
            let mut watch = |_: &RuleGeneration| {
                monitor.advance(1);
                monitor.answer()
            };
            let found = search.tune(&model, &task, self.seed, &mut watch).ok_or_else(Error::cancelled)?;
            Ok((found.expected.mean, PredictiveGreedy::new(found.rule, &task, model.layout())))
        };
        let mut tuned: Vec<(f64, PredictiveGreedy)> =
            tracks.chunks(acceptance::SET_SIZE).take(TUNED_SETS).map(tune).collect::<Result<_, Error>>()?;
        // A search may end in a local optimum: such a controller is not nearly perfect.
        tuned.sort_by(|a, b| b.0.total_cmp(&a.0));
        let good = tuned.iter().filter(|(fitness, _)| *fitness >= acceptance::GOOD_MODEL_FITNESS).count();
        tuned.truncate(good.max(1));
        Ok(tuned)
    }
}
