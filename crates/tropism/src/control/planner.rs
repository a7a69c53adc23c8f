//! A controller that looks ahead: it tries what it could do on simulated plants, and does what turns out better.
//!
//! In: what was observed so far. Out: the lamp. The idea (rollout): a model resumes the observed plant some times, each time as
//! another of the plants that it may be; on request each learns from its past how this very plant answers. On all of them each choice is carried out, and the rest of the task is left to a rule.
//! Choices are compared on the same plants and random numbers. The rule is left only for what is surely better: the best of
//! many choices is else the one whose error is greatest.
//!
//! # References
//! Bertsekas, Tsitsiklis, Wu 1997, doi:10.1023/A:1009635226865: rollout algorithms. Chang, Givan, Chong 2004,
//! doi:10.1023/B:DISC.0000028199.78776.c4: rollout of several base policies.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Controller, PredictiveGreedy, PredictiveRule};
use crate::check::{OutOfRange, ensure};
use crate::lamps::Light;
use crate::math::statistics::{mean, standard_deviation};
use crate::observation::{Observation, Quality};
use crate::parallel;
use crate::plant::PlantModel;
use crate::random::{NoiseStream, Purpose, StepNoise, derive};
use crate::task::{Past, Task};
use crate::track::Sample;

/// Simulated plants on which choices are compared before those are dropped that are not better by a standard error (racing, Maron and
/// Moore 1994). Chosen: a third of the default plants.
const PLANTS_AT_ONCE: usize = 8;

/// What a [`Planner`] tries, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct PlannerConfig {
    /// Simulated plants on which each choice is tried, 2 to 1000.
    pub plants: u32,
    /// Minutes from one plan to the next, above 0.
    pub replan_min: f64,
    /// Whether the simulated plants learn from the past of the observed one how it answers.
    pub learns: bool,
    /// Minutes that are simulated, above 0; the task may end before.
    pub horizon_min: f64,
    /// For how long a choice keeps one lamp lit before the rule goes on, in minutes. Each time with each lamp is a choice.
    pub holds_min: Vec<f64>,
    /// By how much a choice moves the aim of the rule to the right, in cm.
    pub offsets_cm: Vec<f64>,
    /// By how many standard errors of the mean difference a choice must be better than the rule, 0 or more.
    pub sure: f64,
    /// The rule; by default the greedy one.
    pub rule: PredictiveRule,
    /// Seed of the simulated plants.
    pub seed: u64,
}

impl Default for PlannerConfig {
    /// Chosen on few virtual plants (docs/validation/planner.md).
    fn default() -> Self {
        Self {
            plants: 24,
            replan_min: 30.0,
            learns: false,
            horizon_min: 1500.0,
            holds_min: vec![30.0, 90.0, 180.0],
            offsets_cm: vec![-3.0, -1.5, 1.5, 3.0],
            sure: 2.0,
            rule: PredictiveRule::default(),
            seed: 1,
        }
    }
}

impl PlannerConfig {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        ensure((2..=1000).contains(&self.plants), "plants", self.plants, "2 to 1000")?;
        ensure(self.sure >= 0.0 && self.sure.is_finite(), "sure", self.sure, "0 or more")?;
        let is_time = |minutes: f64| minutes > 0.0 && minutes.is_finite();
        ensure(is_time(self.replan_min), "replan_min", self.replan_min, "minutes above 0")?;
        ensure(is_time(self.horizon_min), "horizon_min", self.horizon_min, "minutes above 0")?;
        for (index, &minutes) in self.holds_min.iter().enumerate() {
            ensure(is_time(minutes), format!("holds_min[{index}]"), minutes, "minutes above 0")?;
        }
        for (index, offset) in self.offsets_cm.iter().enumerate() {
            ensure(offset.is_finite(), format!("offsets_cm[{index}]"), offset, "a finite number")?;
        }
        self.rule.check().map_err(|error| error.in_table("rule"))
    }
}

/// What a planner may do until it plans again.
#[derive(Clone, Debug)]
enum Choice {
    /// Leaves it to a rule: its number.
    Rule(usize),
    /// Lights one lamp for some steps, and then leaves it to the first rule.
    Hold(Light, u32),
}

/// Steers a plant by simulations of what could be done; see [`PlannerConfig`].
///
/// ```
/// use std::sync::Arc;
/// use tropism::control::{Planner, PlannerConfig};
/// use tropism::plant::tip::{TipModel, TipModelConfig};
/// use tropism::prelude::*;
/// # use tropism_bean::{Species, Trial};
/// # use tropism::environment::unwatched;
/// # let species = Species::default();
/// # let trial = Trial::new(&species);
/// # let task = Task::open_loop(300);
/// # let mut in_turn = Periodic::new(36, &trial.layout);
/// # let track = trial.grow(1, &mut in_turn, &task, &mut unwatched);
/// let model = Arc::new(TipModel::fit(&[track], TipModelConfig::default()).unwrap());
/// let config = PlannerConfig { plants: 4, ..PlannerConfig::default() };
/// let mut planner = Planner::new(model, Task::default(), config).unwrap();
/// let light = planner.decide(&Observation::simulated(Point::new(0.0, 4.0)));
/// assert!(light == Light::LEFT || light == Light::RIGHT);
/// ```
pub struct Planner<M> {
    model: Arc<M>,
    task: Task,
    config: PlannerConfig,
    /// The rules, each with the memory that it has of this plant.
    rules: Vec<PredictiveGreedy>,
    choices: Vec<Choice>,
    /// What was observed, each with the lamp that was lit then; and what of it counts for the task.
    samples: Vec<Sample>,
    past: Option<Past>,
    step: u32,
    /// The choice in force, and the step at which it was made.
    chosen: Option<(usize, u32)>,
}

impl<M: PlantModel<Plant: Sync> + Send> Planner<M> {
    /// Steers with the lamps of `model` and at its period.
    ///
    /// # Errors
    /// As [`PlannerConfig::check`].
    pub fn new(model: Arc<M>, task: Task, config: PlannerConfig) -> Result<Self, OutOfRange> {
        config.check()?;
        let layout = model.layout();
        let rule = |offset: f64| {
            let rule = PredictiveRule { offset_cm: config.rule.offset_cm + offset, ..config.rule };
            PredictiveGreedy::new(rule, &task, layout)
        };
        let rules: Vec<PredictiveGreedy> =
            std::iter::once(0.0).chain(config.offsets_cm.iter().copied()).map(rule).collect();
        let holds = config.holds_min.iter().flat_map(|&minutes| {
            let steps = (minutes / model.period_min()).round().max(1.0) as u32;
            layout.steering().map(move |light| Choice::Hold(light, steps))
        });
        let choices = (0..rules.len()).map(Choice::Rule).chain(holds).collect();
        Ok(Self {
            rules,
            choices,
            model,
            task,
            config,
            samples: Vec::new(),
            past: None,
            step: 0,
            chosen: None,
        })
    }

    /// The choice that is better than the rule by most, of those that surely are; the rule if none is. `lights` are what the
    /// rules decided for what is seen now.
    fn plan(&self, lights: &[Light]) -> usize {
        let seed = derive(self.config.seed, Purpose::Plan, u64::from(self.step));
        let noise_of = |plant| NoiseStream::new(seed, Purpose::Plan, [plant, 0, 0]);
        let noises: Vec<NoiseStream> = (0..self.config.plants).map(noise_of).collect();
        let plants = self.simulated_plants(&noises);
        // By how much each choice is better than the rule, plant by plant; and the choices that may yet be.
        let mut gains: Vec<Vec<f64>> = vec![Vec::new(); self.choices.len()];
        let mut left: Vec<usize> = (1..self.choices.len()).collect();
        for first in (0..plants.len()).step_by(PLANTS_AT_ONCE) {
            let count = PLANTS_AT_ONCE.min(plants.len() - first);
            let of_plants = parallel::map(count, |number| {
                let (plant, noise) = (&plants[first + number], noises[first + number]);
                let worth = |choice| self.carry_out(choice, lights, plant.clone(), noise);
                let of_rule = worth(&self.choices[0]);
                left.iter().map(|&number| worth(&self.choices[number]) - of_rule).collect::<Vec<f64>>()
            });
            for of_plant in of_plants {
                left.iter().zip(of_plant).for_each(|(&number, gain)| gains[number].push(gain));
            }
            left.retain(|&number| {
                let (gain, error) = mean_and_error(&gains[number]);
                gain + error > 0.0
            });
            if left.is_empty() {
                break;
            }
        }
        let mut best = (0, 0.0);
        for number in left {
            let (gain, error) = mean_and_error(&gains[number]);
            if gain > best.1 && gain > self.config.sure * error {
                best = (number, gain);
            }
        }
        best.0
    }

    /// Plants that the observed one may be, one for each of `noises`.
    fn simulated_plants(&self, noises: &[NoiseStream]) -> Vec<M::Plant> {
        let mut seedlings: Vec<StepNoise> = noises.iter().map(NoiseStream::of_seedling).collect();
        let mut plants = if self.config.learns {
            self.model.twins(&self.samples, &mut seedlings)
        } else {
            seedlings.iter_mut().map(|noise| self.model.resumed(&self.samples, noise)).collect()
        };
        let solids = self.task.solids();
        plants.iter_mut().for_each(|plant| self.model.among(plant, &solids));
        plants
    }

    /// What the task is worth from now on if `plant` is steered by `choice`.
    fn carry_out(&self, choice: &Choice, lights: &[Light], mut plant: M::Plant, noise: NoiseStream) -> f64 {
        let (number, held, steps) = match *choice {
            Choice::Rule(number) => (number, lights[number], 1),
            Choice::Hold(light, steps) => (0, light, steps),
        };
        let mut rule = self.rules[number].clone();
        let mut past = self.past.clone().expect("an observation");
        let horizon = (self.config.horizon_min / self.model.period_min()).ceil() as u32;
        let mut worth = 0.0;
        for ahead in 0..horizon {
            let light = if ahead == 0 {
                held
            } else {
                let decided = rule.decide(&past.latest);
                if ahead < steps { held } else { decided }
            };
            self.model.step(&mut plant, light, &mut noise.at(ahead));
            let after = self.model.observe(&plant);
            worth += self.task.step_fitness(&past, &after);
            if self.task.is_over(self.step + ahead + 1, &after) {
                break;
            }
            past.push(after);
        }
        worth
    }
}

/// Mean of some gains and its standard error.
fn mean_and_error(gains: &[f64]) -> (f64, f64) {
    (mean(gains.iter().copied()), standard_deviation(gains) / (gains.len() as f64).sqrt())
}

impl<M: PlantModel<Plant: Sync> + Send> Controller for Planner<M> {
    fn decide(&mut self, seen: &Observation) -> Light {
        let period_min = self.model.period_min();
        let time_s = f64::from(self.step) * period_min * 60.0;
        self.samples.push(Sample::of(seen.clone(), self.step, time_s, None));
        match &mut self.past {
            Some(past) => past.push(seen.clone()),
            None => self.past = Some(Past::new(seen.clone())),
        }
        let lights: Vec<Light> = self.rules.iter_mut().map(|rule| rule.decide(seen)).collect();
        let every = (self.config.replan_min / period_min).round().max(1.0) as u32;
        let is_due = self.chosen.is_none_or(|(_, at)| self.step >= at + every);
        // A tip that is carried forward says nothing new.
        if self.chosen.is_none() || is_due && seen.quality != Quality::CarriedForward {
            self.chosen = Some((self.plan(&lights), self.step));
        }
        let (number, at) = self.chosen.expect("a plan");
        let light = match self.choices[number] {
            Choice::Rule(number) => lights[number],
            Choice::Hold(light, steps) if self.step < at + steps => light,
            Choice::Hold(..) => lights[0],
        };
        self.samples.last_mut().expect("a sample").light = Some(light);
        self.step += 1;
        light
    }

    fn miss(&mut self, steps: u32) {
        self.step += steps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::lamps::Layout;
    use crate::simulation::simulate;
    use crate::task::Score;

    /// Goes 1 mm a step to the side that was lit five steps before, and grows 0.5 mm.
    struct Late(Layout);

    #[derive(Clone)]
    struct LatePlant {
        tip: Point,
        sides: [f64; 5],
    }

    impl PlantModel for Late {
        type Plant = LatePlant;

        fn seedling(&self, start: Point, _noise: &mut StepNoise) -> LatePlant {
            LatePlant { tip: start, sides: [0.0; 5] }
        }

        fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> LatePlant {
            let mut plant = self.seedling(past[past.len() - 1].tip, noise);
            for sample in &past[..past.len() - 1] {
                plant.sides.rotate_left(1);
                plant.sides[4] = sample.light.map_or(0.0, |light| self.0.side(light));
            }
            plant
        }

        fn step(&self, plant: &mut LatePlant, light: Light, noise: &mut StepNoise) {
            plant.tip.x += 0.1 * plant.sides[0] + 0.005 * noise.normal();
            plant.tip.y += 0.05;
            plant.sides.rotate_left(1);
            plant.sides[4] = self.0.side(light);
        }

        fn observe(&self, plant: &LatePlant) -> Observation {
            Observation::simulated(plant.tip)
        }

        fn layout(&self) -> &Layout {
            &self.0
        }
    }

    /// Is worth the nearness to a line straight up, from a height on.
    #[derive(Debug)]
    struct OnLine;

    impl Score for OnLine {
        fn step_fitness(&self, _task: &Task, _past: &Past, after: &Observation) -> f64 {
            if after.tip.y > 6.0 { -(after.tip.x - 1.0).abs() } else { 0.0 }
        }
    }

    fn on_line() -> Task {
        Task { targets: vec![Point::new(1.0, 8.0)], end_height_cm: 8.0, ..Task::new(OnLine) }
    }

    fn planner(config: PlannerConfig) -> Planner<Late> {
        Planner::new(Arc::new(Late(Layout::default())), on_line(), config).unwrap()
    }

    fn config() -> PlannerConfig {
        let (replan_min, holds_min) = (10.0, vec![5.0, 15.0, 30.0]);
        PlannerConfig { plants: 6, replan_min, holds_min, ..PlannerConfig::default() }
    }

    #[test]
    fn what_a_late_plant_will_do_is_known_before() {
        let (model, layout) = (Late(Layout::default()), Layout::default());
        for seed in 0..5 {
            let of = |controller: &mut dyn Controller| {
                on_line().fitness(&simulate(&model, controller, &on_line(), seed))
            };
            let planned = of(&mut planner(config()));
            let ruled = of(&mut PredictiveGreedy::new(PredictiveRule::default(), &on_line(), &layout));
            // The rule swings by five steps of light to either side.
            assert!(planned > 0.6 * ruled, "{planned} is not much better than {ruled}");
        }
    }

    #[test]
    fn the_same_is_planned_again() {
        let track = || simulate(&Late(Layout::default()), &mut planner(config()), &on_line(), 3);
        assert_eq!(track(), track());
    }

    #[test]
    fn one_without_choices_is_its_rule() {
        let model = Late(Layout::default());
        let alone = PlannerConfig { holds_min: Vec::new(), offsets_cm: Vec::new(), ..config() };
        let rule = &mut PredictiveGreedy::new(PredictiveRule::default(), &on_line(), &model.0);
        assert_eq!(
            simulate(&model, &mut planner(alone), &on_line(), 1),
            simulate(&model, rule, &on_line(), 1)
        );
    }

    #[test]
    fn missed_steps_are_counted_and_a_held_tip_changes_no_plan() {
        let mut controller = planner(config());
        let mut seen = Observation::simulated(Point::new(0.0, 7.0));
        controller.decide(&seen);
        controller.miss(4);
        seen.quality = Quality::CarriedForward;
        let chosen = controller.chosen;
        controller.decide(&seen);
        assert_eq!((controller.samples[1].step, controller.chosen), (5, chosen));
        seen.quality = Quality::Measured;
        controller.decide(&seen);
        assert_eq!(controller.chosen.map(|(_, at)| at), Some(6));
    }

    #[test]
    fn mistakes_are_named() {
        let refused = |config: PlannerConfig, words: &str| {
            let error = config.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(PlannerConfig { plants: 1, ..config() }, "plants = 1");
        refused(PlannerConfig { replan_min: f64::NAN, ..config() }, "replan_min = NaN");
        refused(PlannerConfig { holds_min: vec![5.0, -1.0], ..config() }, "holds_min[1] = -1");
        refused(PlannerConfig { sure: -1.0, ..config() }, "sure = -1");
    }
}
