//! The most likely cause of a missed target, by rules.
//!
//! In: what happened to the tip between two targets, and the drawn parameters and random processes of the plant. Out: one
//! cause. The idea: a plant that paused or responded unusually for its species is the likely cause of a miss; what lies
//! within the usual range is none. `docs/explanation/transfer.md` states the rules. They look at the plant, never at the
//! controller, so the same findings are also counted for targets that were reached: without that, a common finding looks like a
//! cause.

use serde::{Deserialize, Serialize};
use tropism::math::statistics::quantile_linear;
use tropism::parallel;
use tropism::random::{self, Purpose};
use tropism::track::Track;
use tropism_bean::{Species, response_history};

use super::steer::TOP_COLUMNS;
use crate::model::Model;

/// Distance of measured and true tip from which the tip is misread, in cm: half of [`MISS_CM`](tropism::task::MISS_CM).
const MISREAD_CM: f64 = 0.5;

/// Share of misread steps before a target from which misreading counts as the cause. Chosen: a tip carried forward of three steps in the
/// half day before a target is less.
const MISREAD_SHARE: f64 = 0.1;

/// Share of steps without data in the model from which the model counts as the cause. Chosen.
const OUTSIDE_SHARE: f64 = 0.25;

/// Motility that pauses leave, as a share, below which a plant pauses.
const PAUSED: f64 = 0.5;

/// Least share of paused steps before a target from which a pause counts as the cause. Chosen.
const PAUSED_SHARE: f64 = 0.25;

/// Share of the species that counts as unusual on one side: what lies beyond one standard deviation of a normal distribution.
const TAIL: f64 = 0.16;

/// Number of plants that stand for the species: the standard error of the share [`TAIL`] is then 0.02.
const REFERENCE_PLANTS: u64 = 400;

/// Why a target was missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The tip was measured elsewhere than it was.
    TipMisread,
    /// The tip was where the model has no data.
    OutsideModel,
    /// The plant paused for longer than is usual at its age.
    GrowthPause,
    /// The plant responded to light more weakly than is usual.
    WeakResponse,
    /// The plant responded to light more strongly than is usual.
    StrongResponse,
    /// Nothing of these.
    NoneFound,
}

impl Cause {
    /// All causes, in the order in which they are looked for.
    pub const ALL: [Self; 6] = [
        Self::TipMisread,
        Self::OutsideModel,
        Self::GrowthPause,
        Self::WeakResponse,
        Self::StrongResponse,
        Self::NoneFound,
    ];

    /// A few words for people.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::TipMisread => "tip misread",
            Self::OutsideModel => "outside the model's data",
            Self::GrowthPause => "growth pause",
            Self::WeakResponse => "weak response",
            Self::StrongResponse => "strong response",
            Self::NoneFound => "none found",
        }
    }
}

/// The steps before a target: from the crossing of the target below, or the start, to its own crossing, or the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Approach {
    pub(super) from: u32,
    pub(super) to: u32,
}

impl Approach {
    /// The places of the steps of the approach in lists of `count` values, one at least if there is any.
    fn places(self, count: usize) -> std::ops::Range<usize> {
        let to = (self.to as usize).max(self.from as usize + 1).min(count);
        (self.from as usize).min(to)..to
    }
}

/// How a plant responds over time, as sums from the start: what any span of steps needs.
pub(super) struct Response {
    /// Sensitivity to light over that of the typical plant, times the slow fluctuation of motility.
    strength: Vec<f64>,
    /// Steps at which the plant paused.
    paused: Vec<f64>,
}

impl Response {
    /// The response of the plant of `seed` over `steps` steps of `period_min` minutes.
    pub(super) fn of(species: &Species, scale: f64, seed: u64, steps: u32, period_min: f64) -> Self {
        let plant = species.draw(seed, scale);
        let sensitivity = plant.tropism.light / species.typical.tropism.light;
        let (mut strength, mut paused) = (vec![0.0], vec![0.0]);
        for state in response_history(&plant, seed, steps, period_min) {
            strength.push(strength[strength.len() - 1] + sensitivity * state.motility);
            paused.push(paused[paused.len() - 1] + f64::from(u8::from(state.unpaused < PAUSED)));
        }
        Self { strength, paused }
    }

    /// Mean strength and share of paused steps over an approach.
    fn over(&self, approach: Approach) -> (f64, f64) {
        let places = approach.places(self.strength.len() - 1);
        let mean = |sums: &[f64]| (sums[places.end] - sums[places.start]) / places.len().max(1) as f64;
        (mean(&self.strength), mean(&self.paused))
    }
}

/// What a track shows of an approach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Evidence {
    /// Share of steps at which the measured tip was more than [`MISREAD_CM`] from the true one, or 1 if it was at the end.
    pub(super) misread: f64,
    /// Share of steps at which the model has no data.
    pub(super) outside: f64,
}

impl Evidence {
    /// The evidence in `track`, which has the true tip in columns if it was measured in photographs.
    pub(super) fn of(track: &Track, approach: Approach, model: Option<&Model>) -> Self {
        let samples = &track.samples[approach.places(track.samples.len())];
        let outside = model.map_or(0.0, |model| model.share_without_data(samples));
        Self { misread: misread(track, approach), outside }
    }
}

/// [`Evidence::misread`] of an approach; 0 of a track without the true tip.
fn misread(track: &Track, approach: Approach) -> f64 {
    let [Some(x), Some(y)] = TOP_COLUMNS.map(|name| track.numbers(name)) else { return 0.0 };
    let is_off = |row: usize| {
        let tip = track.samples[row].tip;
        tropism::math::hypot(tip.x - x[row], tip.y - y[row]) > MISREAD_CM
    };
    let places = approach.places(track.samples.len());
    if (approach.to as usize) < track.samples.len() && is_off(approach.to as usize) {
        return 1.0;
    }
    let count = places.len().max(1) as f64;
    places.filter(|&row| is_off(row)).count() as f64 / count
}

/// Plants that stand for a species.
pub(super) struct Reference(Vec<Response>);

impl Reference {
    /// The reference of `species`, varied by `scale`, over `steps` steps; `None` after `may_go_on` said no.
    pub(super) fn of(
        species: &Species,
        scale: f64,
        steps: u32,
        period_min: f64,
        may_go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let response = |number: usize| {
            let number = number as u64;
            let seed = random::derive(0, Purpose::Reference, number);
            may_go_on().then(|| Response::of(species, scale, seed, steps, period_min))
        };
        let plants = parallel::map(REFERENCE_PLANTS as usize, response);
        plants.into_iter().collect::<Option<_>>().map(Self)
    }

    /// The most likely cause of what happened in an approach to a plant that responds as `response`.
    pub(super) fn cause(&self, response: &Response, approach: Approach, evidence: Evidence) -> Cause {
        if evidence.misread >= MISREAD_SHARE {
            return Cause::TipMisread;
        }
        if evidence.outside >= OUTSIDE_SHARE {
            return Cause::OutsideModel;
        }
        let (strengths, pauses): (Vec<f64>, Vec<f64>) =
            self.0.iter().map(|plant| plant.over(approach)).unzip();
        let (strength, paused) = response.over(approach);
        if paused >= PAUSED_SHARE && paused > quantile_linear(&pauses, 1.0 - TAIL) {
            return Cause::GrowthPause;
        }
        if strength < quantile_linear(&strengths, TAIL) {
            return Cause::WeakResponse;
        }
        if strength > quantile_linear(&strengths, 1.0 - TAIL) {
            return Cause::StrongResponse;
        }
        Cause::NoneFound
    }
}

#[cfg(test)]
mod tests {
    use tropism::lamps::Light;
    use tropism::plant::tip::TipModelConfig;
    use tropism::simulation::ModelKind;

    use super::*;

    const APPROACH: Approach = Approach { from: 100, to: 200 };

    fn response(strength: f64, paused_steps: usize) -> Response {
        let strength = (0..=400).map(|step| strength * f64::from(step)).collect();
        let paused = (0..=400).map(|step: usize| step.saturating_sub(100).min(paused_steps) as f64).collect();
        Response { strength, paused }
    }

    #[test]
    fn what_is_unusual_for_the_species_is_a_cause() {
        let species = Species::default();
        let reference = Reference::of(&species, 1.0, 400, 5.0, &|| true).unwrap();
        let cause =
            |strength, paused, evidence| reference.cause(&response(strength, paused), APPROACH, evidence);
        let nothing = Evidence::default();
        assert_eq!(cause(1.0, 0, nothing), Cause::NoneFound);
        assert_eq!(cause(0.5, 0, nothing), Cause::WeakResponse);
        assert_eq!(cause(1.7, 0, nothing), Cause::StrongResponse);
        assert_eq!(cause(1.7, 90, nothing), Cause::GrowthPause);
        assert_eq!(cause(1.7, 10, nothing), Cause::StrongResponse, "a short pause is usual");
        assert_eq!(cause(1.0, 90, Evidence { outside: 0.5, ..nothing }), Cause::OutsideModel);
        assert_eq!(cause(1.0, 90, Evidence { misread: 0.2, outside: 0.5 }), Cause::TipMisread);
    }

    #[test]
    fn a_third_of_the_species_responds_unusually() {
        let species = Species::default();
        let reference = Reference::of(&species, 1.0, 300, 5.0, &|| true).unwrap();
        let causes: Vec<Cause> = (0..200)
            .map(|seed| {
                let response = Response::of(&species, 1.0, seed, 300, 5.0);
                reference.cause(&response, APPROACH, Evidence::default())
            })
            .collect();
        let count = |cause| causes.iter().filter(|found| **found == cause).count();
        for cause in [Cause::WeakResponse, Cause::StrongResponse] {
            assert!((14..=48).contains(&count(cause)), "{cause:?}: {}", count(cause));
        }
        assert!(count(Cause::GrowthPause) <= 48, "{}", count(Cause::GrowthPause));
    }

    #[test]
    fn a_tip_is_misread_at_the_crossing_or_often_before_it() {
        let text: String = (0..40).map(|step| format!("0,{},left\n", 4.0 + 0.1 * f64::from(step))).collect();
        let plain = Track::read_csv(format!("tip_x_cm,tip_y_cm,light\n{text}").as_bytes()).unwrap();
        let evidence = |off: &[usize]| {
            let mut track = plain.clone();
            let true_x = (0..40).map(|row| if off.contains(&row) { 0.7 } else { 0.1 });
            track.add_numbers(TOP_COLUMNS[0], 5, true_x);
            track.add_numbers(TOP_COLUMNS[1], 5, plain.samples.iter().map(|sample| sample.tip.y));
            Evidence::of(&track, Approach { from: 10, to: 30 }, None).misread
        };
        assert_eq!((evidence(&[]), evidence(&[9, 31]), evidence(&[30])), (0.0, 0.0, 1.0));
        assert_eq!(evidence(&[12, 13, 14]), 0.15);
        assert_eq!(Evidence::of(&plain, Approach { from: 10, to: 30 }, None).misread, 0.0);
    }

    #[test]
    fn steps_without_data_are_counted() {
        let text = "tip_x_cm,tip_y_cm,light\n0,4,left\n-0.1,4.03,left\n-0.2,4.06,left\n-0.3,4.09,dark\n";
        let track = Track::read_csv(text.as_bytes()).unwrap();
        let model = ModelKind::TIP.fit(&[&track], &TipModelConfig::default(), false).unwrap();
        let mut far = track.clone();
        far.samples[1].tip.y = 20.0;
        far.samples[1].light = Some(Light::LEFT);
        let evidence = |track| Evidence::of(track, Approach { from: 0, to: 2 }, Some(&model)).outside;
        assert_eq!((evidence(&track), evidence(&far)), (0.0, 0.5));
    }
}
