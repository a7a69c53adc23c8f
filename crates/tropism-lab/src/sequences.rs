//! Random sequences of targets in the reach of a plant.
//!
//! In: a task whose targets are to be drawn, a species with its lamps, and a seed. Out: the task with its targets. The rule: a plant of
//! the species without individual variation grows from the start of the task under light that moves to another lamp at random
//! times. The way up to the highest target of the task is divided into bands, one a target; each new target is where the tip
//! was at a random height in the upper part of its band. So each sequence is in the reach of such a plant.

use std::path::Path;

use tropism::control::Schedule;
use tropism::environment::unwatched;
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::plant::PlantModel;
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::track::Track;
use tropism_bean::Trial;
use tropism_bean::tent::Greenhouse;

use crate::{Error, model};

/// Mean time between two moves of the light, in hours: as often as in the paper's open-loop experiments (section 2.2.1).
const MOVE_H: f64 = 6.0;

/// The lower part of a band that holds no target, as a share: targets are never on top of each other.
const CLEAR: f64 = 1.0 / 3.0;

/// Plants that are grown before a sequence is given up, because none was as high as the highest target.
const TRIES: u64 = 20;

/// Light for `steps` steps of `period_min` minutes that moves to another lamp at random times.
fn wandering(layout: &Layout, period_min: f64, steps: u32, seed: u64) -> Schedule {
    let mut rng = random::stream(seed, Purpose::Targets, 0);
    let mut below = |count: usize| (random::uniform(&mut rng) * count as f64) as usize;
    let lights: Vec<Light> = layout.steering().collect();
    let steps_a_move = (60.0 * MOVE_H / period_min).ceil() as usize;
    let mut lit = below(lights.len());
    let light = |_| {
        if below(steps_a_move) == 0 {
            lit = (lit + 1 + below(lights.len() - 1)) % lights.len();
        }
        lights[lit]
    };
    Schedule::new((0..steps.max(1)).map(light).collect())
}

/// Draws the targets of a `task` whose targets are still to be drawn: number 0 under `seed`, in the tent `greenhouse` at steps
/// of `period_min` minutes. Other tasks stay as they are.
///
/// # Errors
/// [`Error::Plan`] as [`sequence`].
pub(crate) fn draw(
    task: &mut Task,
    greenhouse: &Greenhouse,
    period_min: f64,
    seed: u64,
) -> Result<(), Error> {
    if task.is_to_draw() {
        *task = sequence(task, &greenhouse.trial(period_min), seed, 0)?;
    }
    Ok(())
}

/// As [`draw`], for plants of the model in `path`: under its lamps, at its steps.
///
/// # Errors
/// [`Error::File`] if the model cannot be read; [`Error::Plan`] as [`sequence`].
pub(crate) fn draw_for(task: &mut Task, path: &Path, seed: u64) -> Result<(), Error> {
    if !task.is_to_draw() {
        return Ok(());
    }
    let model = model::read(path)?;
    let greenhouse = Greenhouse { layout: model.layout().clone(), ..Greenhouse::default() };
    draw(task, &greenhouse, model.period_min(), seed)
}

/// A random sequence of targets for number `index` under `seed`, after the rule above; `trial` is the species, whose individual
/// variation does not count.
///
/// # Errors
/// [`Error::Plan`] if its typical plant is never as high as the highest target of `task` may be.
pub(crate) fn sequence(task: &Task, trial: &Trial<'_>, seed: u64, index: u64) -> Result<Task, Error> {
    try_sequence(task, trial, seed, index).ok_or_else(|| {
        Error::Plan(format!(
            "random targets: no typical plant grows as high as {} cm in {} steps: lower them, or give more steps",
            task.highest_cm, task.max_steps
        ))
    })
}

fn try_sequence(task: &Task, trial: &Trial<'_>, seed: u64, index: u64) -> Option<Task> {
    let typical = Trial { scale: 0.0, ..trial.clone() };
    let mut rng = random::stream(seed, Purpose::Targets, index);
    let band = (task.highest_cm - task.start.y) / f64::from(task.count);
    let heights: Vec<f64> = (0..task.count)
        .map(|number| {
            let share = CLEAR + (1.0 - CLEAR) * random::uniform(&mut rng);
            task.start.y + band * (f64::from(number) + share)
        })
        .collect();
    (0..TRIES).find_map(|attempt| {
        let plant = random::derive(seed, Purpose::Targets, index * TRIES + attempt) >> 1;
        let mut lights = wandering(&typical.layout, typical.period_min, task.max_steps, plant);
        let track = typical.grow(plant, &mut lights, task, &mut unwatched);
        let targets: Option<Vec<Point>> = heights.iter().map(|&height| place_at(&track, height)).collect();
        Some(task.drawn(targets?))
    })
}

/// Where the tip of a track was first at `height`, between two steps; `None` if it never was.
fn place_at(track: &Track, height: f64) -> Option<Point> {
    let pair = track.samples.windows(2).find(|pair| pair[1].tip.y >= height)?;
    let [before, after] = [pair[0].tip, pair[1].tip];
    let share =
        if after.y > before.y { ((height - before.y) / (after.y - before.y)).clamp(0.0, 1.0) } else { 1.0 };
    Some(Point::new(before.x + share * (after.x - before.x), height))
}

#[cfg(test)]
mod tests {
    use tropism_bean::Species;

    use super::*;

    #[test]
    fn sequences_differ_and_rise_within_the_way_of_the_task() {
        let (task, species) = (Task::random_targets(), Species::default());
        let trial = Trial::new(&species);
        let drawn: Vec<Task> = (0..12).map(|index| sequence(&task, &trial, 7, index).unwrap()).collect();
        for targets in &drawn {
            targets.check().unwrap();
            assert_eq!(targets.targets.len(), 3);
            let bands = targets.targets.iter().zip(1..).map(|(target, number)| {
                let top = 4.0 + f64::from(number) * 9.5 / 3.0;
                (top - 2.2..=top).contains(&target.y)
            });
            assert!(bands.into_iter().all(|is_in_band| is_in_band), "{targets:?}");
        }
        let widest =
            drawn.iter().flat_map(|task| &task.targets).map(|target| target.x.abs()).fold(0.0, f64::max);
        assert!((1.5..9.0).contains(&widest), "{widest}");
        assert!(drawn.windows(2).all(|pair| pair[0] != pair[1]));
        assert_eq!(sequence(&task, &trial, 7, 3).unwrap(), drawn[3], "the same seed, the same targets");
        let mut first = task.clone();
        super::draw(&mut first, &Greenhouse::default(), 5.0, 7).unwrap();
        assert_eq!(first, drawn[0], "a command without many plants takes the first");
    }

    #[test]
    fn a_height_that_no_plant_reaches_has_no_sequence() {
        let species = Species::default();
        let trial = Trial::new(&species);
        let task = Task {
            count: 1,
            highest_cm: 500.0,
            end_height_cm: 501.0,
            max_steps: 20,
            ..Task::random_targets()
        };
        let error = sequence(&task, &trial, 1, 0).unwrap_err().to_string();
        assert!(error.contains("no typical plant grows as high as 500 cm in 20 steps"), "{error}");
    }
}
