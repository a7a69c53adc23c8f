//! The line of each measured plant: its usable steps, and the weights by ridge regression.

use super::body::Residual;
use super::errors::smooth_lengths;
use super::history::History;
use super::light::Lamps;
use super::measured::{MAX_HEIGHT_CM, MeasuredPlant, MeasuredPlants};
use super::regression::ridge_regression;
use super::replay::{Record, Replay};
use super::shape::{MODES, Modes, Place, Scores, stem_of, top_of};
use super::terms::{TERMS, Windows, expected};
use crate::math::statistics::mean;
use crate::math::vector::sub;
use crate::plant::ModelError;

/// Weights of the change of each score.
pub(super) type Weights<R = f64> = [[R; TERMS]; MODES];

/// Ridge of the weights of all plants together, which are drawn to 0; of terms scaled to a mean square of 1. At 100 the
/// predicted fitness was the same within 0.1 cm.
const POOLED_RIDGE: f64 = 30.0;

/// Ridge of the weights of one plant, which are drawn to those of all. Of 30, 100 and infinity, 100 predicted the fitness of
/// the greedy rule best in five replicates of virtual beans.
const PLANT_RIDGE: f64 = 100.0;

/// A measured step: its residual, and the state in which it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step<const AXES: usize> {
    pub(super) residual: Residual<AXES>,
    /// From the highest point of the stem to the tip before the step.
    pub(super) offset_before: Place<AXES>,
    /// First score before the step.
    pub(super) lean: [f64; AXES],
    /// Mean light of the last 50 minutes.
    pub(super) light: [f64; AXES],
}

/// One usable step of a plant.
pub(super) struct Row<const AXES: usize> {
    pub(super) step: usize,
    pub(super) terms: [[f64; TERMS]; AXES],
    pub(super) length_cm: f64,
    /// Its residual is the whole change.
    pub(super) what: Step<AXES>,
}

/// The usable steps of a plant: all that enters the terms is known, and stem and tip are measured before and after.
pub(super) fn rows<const AXES: usize>(
    plant: &MeasuredPlant<AXES>,
    measured: &MeasuredPlants<AXES>,
    modes: &Modes,
    windows: &Windows,
) -> Vec<Row<AXES>> {
    // Steps until what is not known has left the memory.
    let (mut light_gap, mut change_gap) = (0, 0_usize);
    let mut light = History::<AXES, 1>::new(windows.oldest_light());
    let mut changes = History::<AXES, MODES>::new(windows.oldest_change());
    let lengths = smooth_lengths(&plant.lengths(modes), measured.period_min);
    let scores = plant.scores(modes);
    let mut rows = Vec::new();
    let lamps = Lamps::of(&measured.layout);
    for (step, lit) in plant.lit(&lamps).enumerate().take(plant.tips.len().saturating_sub(1)) {
        light.add(lit.unwrap_or([[0.0]; AXES]));
        if lit.is_none() {
            light_gap = windows.oldest_light();
        }
        let change = scores[step].zip(scores[step + 1]).map(|(from, to)| changes_of(&from, &to));
        let row = || {
            let (tip, after) = (plant.tips[step]?, plant.tips[step + 1]?);
            let (length_cm, next_length_cm) = (lengths[step]?, lengths[step + 1]?);
            let (change, scores, next) = (change?, scores[step]?, scores[step + 1]?);
            let is_usable = light_gap == 0 && change_gap == 0 && tip.up < MAX_HEIGHT_CM;
            let offset = |tip: Place<AXES>, base: Place<AXES>, scores, length_cm| {
                tip - top_of(&stem_of(base, modes.tilts(scores), length_cm))
            };
            let what = Step {
                residual: Residual {
                    scores: change,
                    growth_cm: next_length_cm - length_cm,
                    offset: offset(after, plant.stems[step + 1]?[0], next, next_length_cm),
                },
                offset_before: offset(tip, plant.stems[step]?[0], scores, length_cm),
                lean: scores.map(|scores| scores[0]),
                light: light.mean(windows.like).map(|[light]| light),
            };
            let terms = windows.terms(&light, length_cm, scores, &changes);
            is_usable.then_some(Row { step, terms, length_cm, what })
        };
        rows.extend(row());
        changes.add(change.unwrap_or([[0.0; MODES]; AXES]));
        change_gap = if change.is_none() { windows.oldest_change() } else { change_gap.saturating_sub(1) };
        light_gap = light_gap.saturating_sub(1);
    }
    rows
}

pub(super) fn changes_of<const AXES: usize>(from: &[Scores; AXES], to: &[Scores; AXES]) -> [Scores; AXES] {
    core::array::from_fn(|axis| sub(to[axis], from[axis]))
}

/// How one measured plant answers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Response<const AXES: usize> {
    /// The same along all axes.
    pub(super) weights: Weights,
    pub(super) replay: Replay<Step<AXES>>,
    /// Mean of the lowest points of its stems.
    pub(super) base: Place<AXES>,
}

impl<const AXES: usize> Response<AXES> {
    fn new(
        plant: &MeasuredPlant<AXES>,
        rows: Vec<Row<AXES>>,
        pooled: &Weights,
        scale: &[f64; TERMS],
    ) -> Self {
        let weights = weights_of(rows.iter(), pooled, &scale.map(|scale| PLANT_RIDGE * scale));
        let record = |Row { step, terms, length_cm, mut what }: Row<AXES>| {
            for (scores, terms) in what.residual.scores.iter_mut().zip(&terms) {
                for (score, weights) in scores.iter_mut().zip(&weights) {
                    *score -= expected(weights, terms, 1.0);
                }
            }
            Record { step, length_cm, what }
        };
        Self { weights, replay: Replay::new(rows.into_iter().map(record).collect()), base: plant.mean_base() }
    }
}

fn weights_of<'r, const AXES: usize>(
    rows: impl Iterator<Item = &'r Row<AXES>> + Clone,
    prior: &Weights,
    ridge: &[f64; TERMS],
) -> Weights {
    core::array::from_fn(|mode| {
        let along = |row: &'r Row<AXES>| {
            row.terms.iter().zip(row.what.residual.scores).map(move |(terms, change)| (terms, change[mode]))
        };
        ridge_regression(rows.clone().flat_map(along), &prior[mode], ridge)
    })
}

/// The responses of all plants with a usable step: weights of all together first, then those of each plant, drawn to them.
pub(super) fn responses<const AXES: usize>(
    measured: &MeasuredPlants<AXES>,
    modes: &Modes,
    windows: &Windows,
) -> Result<Vec<Response<AXES>>, ModelError> {
    let of_plants: Vec<(&MeasuredPlant<AXES>, Vec<Row<AXES>>)> = (measured.plants.iter())
        .map(|plant| (plant, rows(plant, measured, modes, windows)))
        .filter(|(_, rows)| !rows.is_empty())
        .collect();
    if of_plants.is_empty() {
        return Err(ModelError::NoShifts { tracks: measured.plants.len() });
    }
    let rows = || of_plants.iter().flat_map(|(_, rows)| rows);
    let mean_square = |term: usize| {
        let squares = rows().flat_map(|row| row.terms.map(|terms| terms[term] * terms[term]));
        // A term that is 0 throughout gets a weight of 0, whatever its ridge.
        mean(squares).max(f64::MIN_POSITIVE)
    };
    let scale: [f64; TERMS] = core::array::from_fn(mean_square);
    let pooled = weights_of(rows(), &[[0.0; TERMS]; MODES], &scale.map(|scale| POOLED_RIDGE * scale));
    let responses = of_plants.into_iter().map(|(plant, rows)| Response::new(plant, rows, &pooled, &scale));
    Ok(responses.collect())
}
