//! A virtual bean that is tried on a page: its frames, fitness and crossings under a controller.

use serde::Serialize;
use tropism::control::{Controller, Schedule};
use tropism::environment::Environment;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::observation::{Observation, Quality};
use tropism::task::{Crossing, Task};
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};
use tropism_bean::{Species, Trial};

use crate::{PageError, rounded};

/// Steps of a bean that is tried, at most: three days and a half.
pub const MOST_STEPS: u32 = 1000;

/// A step of the bean: its tip, the lamp that is lit from here on, and its stem.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Frame {
    /// The tip, in cm to the right of the root.
    pub x: f64,
    /// The tip, in cm above the soil.
    pub y: f64,
    /// `left` or `right`; `None` at the end.
    pub lamp: Option<&'static str>,
    /// Points of the stem from the root on, in cm.
    pub stem: Vec<[f64; 2]>,
    /// Whether it touches an obstacle.
    pub touches: bool,
    /// How far the stem is from the wanted form, in cm; of tasks with a form.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off: Option<f64>,
}

/// A bean that was tried, from one of its steps on.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TriedBean {
    /// The step from which on it is sent.
    pub from: usize,
    /// Its steps.
    pub frames: Vec<Frame>,
    /// Fitness so far at each of them, in cm.
    pub fitness: Vec<f64>,
    /// For each target, where the tip first reached its height.
    pub crossings: Vec<Option<Crossing>>,
    /// Whether the task is over.
    pub is_over: bool,
}

/// Grows the common bean of `seed` in the paper's tent for `steps` steps at most, or until `task` is over. Returns the frames,
/// fitness so far (cm) and crossings from step `from` on.
pub fn try_out(
    task: &Task,
    controller: &mut (impl Controller + ?Sized),
    seed: u64,
    steps: u32,
    from: usize,
) -> TriedBean {
    let species = Species::default();
    let mut bean = Trial { solids: task.solids(), ..Trial::new(&species) }.specimen(seed);
    let (mut frames, mut samples) = (Vec::new(), Vec::new());
    let mut is_over = false;
    for step in 0..=steps {
        let Ok(seen) = bean.observe();
        is_over = task.is_over(step, &seen);
        let light = (!is_over && step < steps).then(|| controller.decide(&seen));
        frames.push(frame(task, &seen, light));
        samples.push(Sample {
            step,
            time_s: 60.0 * PAPER_PERIOD_MIN * f64::from(step),
            tip: seen.tip,
            light,
            levels: None,
            quality: Quality::Simulated,
            stem: seen.stem,
            depth: None,
        });
        let Some(light) = light else { break };
        let Ok(()) = bean.step(light);
    }
    let track = Track::of(samples);
    let from = from.min(frames.len());
    TriedBean {
        from,
        frames: frames.split_off(from),
        fitness: task.fitness_so_far(&track)[from..].iter().map(|sum| rounded(*sum, 2)).collect(),
        crossings: task.crossings(&track),
        is_over,
    }
}

fn frame(task: &Task, seen: &Observation, light: Option<Light>) -> Frame {
    let pair = |point: &Point| [rounded(point.x, 2), rounded(point.y, 2)];
    let off = || seen.stem.as_ref().map(|stem| rounded(task.form_difference_cm(stem), 2));
    Frame {
        x: rounded(seen.tip.x, 2),
        y: rounded(seen.tip.y, 2),
        lamp: light.map(|light| if light == Light::RIGHT { "right" } else { "left" }),
        stem: seen.stem.as_ref().map(|stem| stem.0.iter().map(pair).collect()).unwrap_or_default(),
        touches: task.touches(seen),
        off: if task.has_form() { off() } else { None },
    }
}

/// The lights that a person gave, as letters `l` and `r`, one a step. The lamp of the last one stays lit; without any, the left.
///
/// # Errors
/// [`PageError`] for another letter, and for more than [`MOST_STEPS`].
pub fn schedule_of(letters: &str) -> Result<Schedule, PageError> {
    if letters.len() > MOST_STEPS as usize {
        return Err(PageError::new(format!("found {} lights, wanted at most {MOST_STEPS}", letters.len())));
    }
    let light = |letter| match letter {
        'l' => Ok(Light::LEFT),
        'r' => Ok(Light::RIGHT),
        other => Err(PageError::new(format!("lights: found {other:?}, wanted l or r"))),
    };
    let mut lights = letters.chars().map(light).collect::<Result<Vec<_>, _>>()?;
    lights.push(Light::LEFT);
    Ok(Schedule::new(lights))
}

/// Tips of a track in cm, 120 of them and the last at most, with their steps' numbers.
fn kept(track: &Track) -> impl Iterator<Item = &Sample> {
    let every = track.samples.len().div_ceil(120).max(1);
    let last = track.samples.len().saturating_sub(1);
    let is_kept = move |index: usize| index.is_multiple_of(every) || index == last;
    track.samples.iter().enumerate().filter(move |(index, _)| is_kept(*index)).map(|(_, sample)| sample)
}

/// The path of a tip as a page draws it, in cm, and the lamp at each point.
#[must_use]
pub fn thinned(track: &Track) -> (Vec<[f64; 2]>, Vec<Option<String>>) {
    kept(track)
        .map(|sample| {
            let tip = [rounded(sample.tip.x, 2), rounded(sample.tip.y, 2)];
            (tip, sample.light.map(|light| light.to_string()))
        })
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tropism::control::Greedy;
    use tropism::lamps::Layout;

    #[test]
    fn a_person_who_lights_the_same_lamps_grows_the_same_bean() {
        let task = Task { max_steps: 30, ..Task::default() };
        let answer = try_out(&task, &mut Greedy::new(&task, &Layout::default()), 4, MOST_STEPS, 0);
        let frames = answer.frames;
        assert_eq!((frames.len(), answer.is_over), (31, true));
        let letters: String = frames.iter().filter_map(|frame| frame.lamp).map(|lamp| &lamp[..1]).collect();
        let own = try_out(&task, &mut schedule_of(&letters).unwrap(), 4, letters.len() as u32, 10);
        assert_eq!((own.from, &own.frames[..]), (10, &frames[10..]));
        assert!(schedule_of("lx").is_err() && schedule_of(&"l".repeat(1001)).is_err());
    }
}
