//! The clairvoyant schedule of one plant: which lamps would have steered this very plant best, had its noise been known.
//!
//! In: a plant before its first step, with all its noise, and a task. Out: the best schedule that a search finds, in blocks
//! of half an hour. The idea: a beam search over the blocks finds a start, and a local search over single blocks and pairs of
//! neighbours improves it and a greedy start. A search proves no optimum, and shorter blocks could do better: the result is a
//! lower reference of what is possible on the plant.
//!
//! # References
//! Beam search: Lowerre 1976, *The HARPY Speech Recognition System*. Local search: Aarts and Lenstra 1997, chapter 1.

use tropism::control::{Controller, Greedy, Schedule};
use tropism::environment::Environment;
use tropism::lamps::Light;
use tropism::observation::Observation;
use tropism::task::{Past, Task};
use tropism_bean::Specimen;

/// Length of a block, in min. Chosen by hand: an experiment then has some sixty blocks, few enough for a search.
const BLOCK_MIN: f64 = 30.0;

/// Plants that the beam search keeps after each block. Chosen by hand, not tuned.
const BEAM: usize = 16;

/// Most passes of the local search over all blocks, against endless ones: a pass that improves nothing ends it.
const PASSES: u32 = 6;

/// Least improvement that counts, in cm: far below the detector's noise, far above rounding.
const LEAST_GAIN_CM: f64 = 1e-6;

/// A plant on its way, with the fitness so far.
#[derive(Clone)]
struct Growing<'t> {
    task: &'t Task,
    plant: Specimen,
    past: Past,
    step: u32,
    fitness: f64,
    is_over: bool,
}

/// The plant under observation. A virtual bean can always be observed.
fn observe(plant: &mut Specimen) -> Observation {
    let Ok(seen) = plant.observe();
    seen
}

impl<'t> Growing<'t> {
    fn begin(mut plant: Specimen, task: &'t Task) -> Self {
        let seen = observe(&mut plant);
        let is_over = task.is_over(0, &seen);
        Self { task, plant, past: Past::new(seen), step: 0, fitness: 0.0, is_over }
    }

    /// Grows for `steps` steps under `light`, or until the task is over.
    fn advance(&mut self, light: Light, steps: u32) {
        for _ in 0..steps {
            if self.is_over {
                return;
            }
            let Ok(()) = self.plant.step(light);
            let seen = observe(&mut self.plant);
            self.fitness += self.task.step_fitness(&self.past, &seen);
            self.step += 1;
            self.is_over = self.task.is_over(self.step, &seen);
            self.past.push(seen);
        }
    }
}

/// The search on one plant.
struct Search<'s> {
    lights: Vec<Light>,
    block_steps: u32,
    may_go_on: &'s dyn Fn() -> bool,
}

/// The best schedule that the search finds on `plant`; `None` after `may_go_on` said no.
pub(super) fn search(plant: &Specimen, task: &Task, may_go_on: &dyn Fn() -> bool) -> Option<Schedule> {
    let block_steps = ((BLOCK_MIN / plant.period_min()).round() as u32).max(1);
    let search = Search { lights: plant.layout().steering().collect(), block_steps, may_go_on };
    let start = Growing::begin(plant.clone(), task);
    let starts = [search.beam(&start)?, search.greedy(&start)];
    let mut best = (f64::NEG_INFINITY, Vec::new());
    for schedule in starts {
        let found = search.improve(&start, schedule)?;
        if found.0 > best.0 {
            best = found;
        }
    }
    // A task that is over at its start leaves no block.
    let blocks = if best.1.is_empty() { search.lights } else { best.1 };
    let steps = |&light: &Light| std::iter::repeat_n(light, block_steps as usize);
    Some(Schedule::new(blocks.iter().flat_map(steps).collect()))
}

/// Keeps the [`BEAM`] fittest plants. Of equally fit ones, as all are while a task is worth nothing yet, those stay whose tips
/// lie apart: the others are near copies of them.
fn keep_fittest(plants: &mut Vec<(Growing<'_>, Vec<Light>)>) {
    // A stable sort: of equals the first stays, whatever the machine.
    let key = |(growing, _): &(Growing<'_>, Vec<Light>)| (growing.fitness, growing.past.latest.tip.x);
    plants.sort_by(|one, other| {
        let ((fitness, x), (other_fitness, other_x)) = (key(one), key(other));
        other_fitness.total_cmp(&fitness).then(x.total_cmp(&other_x))
    });
    if plants.len() <= BEAM {
        return;
    }
    let limit = plants[BEAM - 1].0.fitness;
    let first = plants.partition_point(|(growing, _)| growing.fitness > limit);
    let equals = plants[first..].partition_point(|(growing, _)| growing.fitness >= limit);
    let room = BEAM - first;
    for place in 1..room {
        plants.swap(first + place, first + place * (equals - 1) / (room - 1));
    }
    plants.truncate(BEAM);
}

impl Search<'_> {
    /// Keeps the [`BEAM`] fittest plants after each block; the schedule of the fittest plant at the end of its task.
    fn beam(&self, start: &Growing<'_>) -> Option<Vec<Light>> {
        let mut beam = vec![(start.clone(), Vec::new())];
        let mut best: Option<(f64, Vec<Light>)> = None;
        while !beam.is_empty() {
            if !(self.may_go_on)() {
                return None;
            }
            let mut next = Vec::with_capacity(beam.len() * self.lights.len());
            for (growing, schedule) in &beam {
                for &light in &self.lights {
                    let (mut growing, mut schedule) = (growing.clone(), schedule.clone());
                    growing.advance(light, self.block_steps);
                    schedule.push(light);
                    if !growing.is_over {
                        next.push((growing, schedule));
                    } else if best.as_ref().is_none_or(|(fitness, _)| growing.fitness > *fitness) {
                        best = Some((growing.fitness, schedule));
                    }
                }
            }
            keep_fittest(&mut next);
            beam = next;
        }
        Some(best.map_or_else(Vec::new, |(_, schedule)| schedule))
    }

    /// The schedule of the greedy rule that decides once a block.
    fn greedy(&self, start: &Growing<'_>) -> Vec<Light> {
        let mut rule = Greedy::new(start.task, start.plant.layout());
        let (mut growing, mut schedule) = (start.clone(), Vec::new());
        while !growing.is_over {
            let light = rule.decide(&growing.past.latest);
            growing.advance(light, self.block_steps);
            schedule.push(light);
        }
        schedule
    }

    /// Changes single blocks and pairs of neighbours as long as the fitness rises: the last fitness and schedule.
    fn improve(&self, start: &Growing<'_>, mut schedule: Vec<Light>) -> Option<(f64, Vec<Light>)> {
        let (mut best, mut states) = self.follow(start, &schedule);
        let last = |schedule: &[Light]| schedule.last().copied().unwrap_or(self.lights[0]);
        schedule.resize(states.len(), last(&schedule));
        for _ in 0..PASSES {
            let before = best;
            let mut block = 0;
            while block < states.len() {
                for width in [1, 2] {
                    for &light in &self.lights {
                        if !(self.may_go_on)() {
                            return None;
                        }
                        let mut changed = schedule.clone();
                        changed.iter_mut().skip(block).take(width).for_each(|lit| *lit = light);
                        if changed == schedule || block >= states.len() {
                            continue;
                        }
                        let (fitness, after) = self.follow(&states[block], &changed[block..]);
                        if fitness > best + LEAST_GAIN_CM {
                            (best, schedule) = (fitness, changed);
                            states.truncate(block);
                            states.extend(after);
                            schedule.resize(states.len(), last(&schedule));
                        }
                    }
                }
                block += 1;
            }
            if best <= before {
                break;
            }
        }
        Some((best, schedule))
    }

    /// The fitness at the end of `schedule`, whose last light stays lit, and the plant at the beginning of each block.
    fn follow<'t>(&self, start: &Growing<'t>, schedule: &[Light]) -> (f64, Vec<Growing<'t>>) {
        let (mut growing, mut states) = (start.clone(), Vec::new());
        let last = schedule.last().or(self.lights.first()).copied();
        let lights = schedule.iter().copied().chain(std::iter::repeat(last).flatten());
        for light in lights {
            if growing.is_over {
                break;
            }
            states.push(growing.clone());
            growing.advance(light, self.block_steps);
        }
        (growing.fitness, states)
    }
}

#[cfg(test)]
mod tests {
    use tropism::control::{Controller, Periodic};
    use tropism::environment::unwatched;
    use tropism::task::Task;
    use tropism_bean::{Species, Trial};

    use super::*;

    fn task() -> Task {
        Task { max_steps: 96, ..Task::default() }
    }

    #[test]
    fn a_schedule_grows_the_plant_that_a_controller_grows() {
        let species = Species::default();
        let trial = Trial::new(&species);
        let search =
            Search { lights: trial.layout.steering().collect(), block_steps: 1, may_go_on: &|| true };
        let task = task();
        let track = trial.grow(3, &mut Periodic::new(10, &trial.layout), &task, &mut unwatched);
        let schedule: Vec<Light> = track.samples.iter().filter_map(|sample| sample.light).collect();
        let start = Growing::begin(trial.specimen(3), &task);
        let (fitness, states) = search.follow(&start, &schedule);
        assert_eq!((fitness, states.len()), (task.fitness(&track), 96));
    }

    #[test]
    fn the_search_beats_the_rule_that_it_starts_from() {
        let species = Species::default();
        let trial = Trial::new(&species);
        let task = task();
        let fitness_of = |seed, controller: &mut dyn Controller| {
            task.fitness(&trial.grow(seed, controller, &task, &mut unwatched))
        };
        let mut gains = Vec::new();
        for seed in 4..8 {
            let mut found = search(&trial.specimen(seed), &task, &|| true).unwrap();
            assert_eq!(search(&trial.specimen(seed), &task, &|| true).as_ref(), Some(&found));
            assert_eq!(search(&trial.specimen(seed), &task, &|| false), None);
            let greedy = fitness_of(seed, &mut Greedy::new(&task, &trial.layout));
            gains.push(fitness_of(seed, &mut found) - greedy);
        }
        assert!(gains.iter().all(|gain| *gain >= 0.0) && gains.iter().any(|gain| *gain > 0.0), "{gains:?}");
    }

    #[test]
    fn of_plants_that_are_equally_fit_those_stay_whose_tips_lie_apart() {
        let species = Species::default();
        let task = task();
        let start = Growing::begin(Trial::new(&species).specimen(5), &task);
        let plant = |fitness: f64, x: f64| {
            let mut growing = Growing { fitness, ..start.clone() };
            growing.past.latest.tip.x = x;
            (growing, Vec::new())
        };
        let mut plants: Vec<_> = (0..40).map(|x| plant(0.0, f64::from(x))).collect();
        plants.push(plant(-1.0, 80.0));
        plants.push(plant(1.0, 90.0));
        keep_fittest(&mut plants);
        let mut tips: Vec<f64> = plants.iter().map(|(growing, _)| growing.past.latest.tip.x).collect();
        assert_eq!((tips.len(), tips[0]), (BEAM, 90.0));
        tips[1..].sort_by(f64::total_cmp);
        assert_eq!((tips[1], tips[BEAM - 1]), (0.0, 39.0));
        assert!(tips[1..].windows(2).all(|pair| (1.0..4.0).contains(&(pair[1] - pair[0]))), "{tips:?}");
    }
}
