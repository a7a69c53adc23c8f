//! Draw a target: what is within reach, evolution as a job, and trying a champion on a virtual bean.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tropism::control::Controller;
use tropism::environment::Environment;
use tropism::geometry::Point;
use tropism::greenhouse::bean::{Species, Trial};
use tropism::lamps::{Layout, Light};
use tropism::observation::{Observation, Quality};
use tropism::task::{OpenLoop, Targets, Task, TaskSpec};
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};
use tropism_lab::controller::ControllerSpec;
use tropism_lab::files;

use crate::error::Refusal;
use crate::{Studio, evolution, found, jobs};

/// Generations of an evolution that a page asks for, at most.
pub(crate) const MOST_GENERATIONS: u32 = 100_000;

/// Targets of a drawing, at most.
const MOST_TARGETS: usize = 8;

/// Steps of a bean that is tried, at most: three days and a half.
const MOST_STEPS: u32 = 1000;

/// How far above the last target the experiment ends, in cm. Paper: 0.3 (section 2.3.1).
const ABOVE_CM: f64 = 0.3;

/// The model of virtual beans that is made where the folder has none, and the folder of its tracks.
const VIRTUAL: (&str, &str) = ("virtual-bean.json", "virtual-bean");

/// The task that visits `targets`, from the lowest to the highest.
///
/// # Errors
/// [`Refusal`] names the target and what is wrong with it.
pub(crate) fn task(targets: &[[f64; 2]]) -> Result<TaskSpec, Refusal> {
    if targets.is_empty() || targets.len() > MOST_TARGETS {
        let count = targets.len();
        return Err(Refusal::bad(format!("found {count} targets, wanted 1 to {MOST_TARGETS}")));
    }
    let mut points: Vec<Point> = targets.iter().map(|&target| Point::from(target)).collect();
    points.sort_by(|one, other| one.y.total_cmp(&other.y));
    let highest = points[points.len() - 1].y;
    if points.iter().any(|point| !point.is_finite() || point.x.abs() > 50.0 || highest > 50.0) {
        return Err(Refusal::bad("found a target beyond 50 cm, wanted it nearer"));
    }
    let task =
        Targets { targets: points, end_height_cm: round_to_mm(highest + ABOVE_CM), ..Targets::default() };
    let task = TaskSpec::from(task);
    task.check().map_err(|error| Refusal::bad(error.to_string()))?;
    Ok(task)
}

fn round_to_mm(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

/// A controller that keeps the plant upright and then leans it to the right for good.
struct Lean {
    upright: u32,
    step: u32,
}

impl Controller for Lean {
    fn decide(&mut self, seen: &Observation) -> Light {
        self.step += 1;
        if self.step > self.upright || seen.tip.x < 0.0 { Light::RIGHT } else { Light::LEFT }
    }
}

/// The farthest place, by height, at which a tip of four virtual beans arrives there for the first time: each leans to the
/// side early or late, 15 times. Pairs of height and distance from the root, in cm; the same to both sides.
pub(crate) fn reach() -> &'static [[f64; 2]] {
    static REACH: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    REACH.get_or_init(|| {
        const BEANS: u64 = 4;
        const STEPS: u32 = 600;
        let species = Species::default();
        let delays: Vec<u32> = (0..STEPS - 60).step_by(36).collect();
        let plants: Vec<(u64, u32)> =
            delays.iter().flat_map(|&delay| (1..=BEANS).map(move |seed| (seed, delay))).collect();
        let seeds: Vec<u64> = plants.iter().map(|(seed, _)| *seed).collect();
        let task = OpenLoop { steps: STEPS, ..OpenLoop::default() };
        let mut farthest: BTreeMap<i32, f64> = BTreeMap::new();
        let mut highest = vec![f64::NEG_INFINITY; seeds.len()];
        let mut watch = |place: usize, sample: &Sample| {
            if sample.tip.y > highest[place] {
                highest[place] = sample.tip.y;
                let at = farthest.entry((2.0 * sample.tip.y).floor() as i32).or_insert(0.0);
                *at = at.max(sample.tip.x);
            }
            ControlFlow::Continue(())
        };
        let lean = |place: usize| Lean { upright: plants[place].1, step: 0 };
        Trial::new(&species).grow_all(&seeds, lean, &task, &mut watch);
        // What a low plant reaches, a high one reaches too: between the delays that were tried there are others.
        let mut so_far = 0.0_f64;
        let widest = farthest.into_iter().map(|(half, x)| {
            so_far = so_far.max(x);
            [f64::from(half) / 2.0, round_to_mm(so_far)]
        });
        widest.collect()
    })
}

/// Who steers a bean that is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Who {
    Champion,
    Greedy,
    You,
}

/// A bean to try a controller on.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TryPlan {
    pub(crate) who: Who,
    /// JSON of the targets: `[[3, 6], ...]`.
    pub(crate) targets: String,
    /// The evolution whose champion steers.
    #[serde(default)]
    pub(crate) at: String,
    /// The run of the evolution; the champion of all by default.
    pub(crate) run: Option<u32>,
    /// Seed of the bean.
    pub(crate) seed: u64,
    /// With [`Who::You`], a letter `l` or `r` for each step so far.
    #[serde(default)]
    pub(crate) lights: String,
    /// The first step that is told.
    #[serde(default)]
    pub(crate) from: usize,
}

/// A step of the bean: its tip, the lamp that is lit from here on, and its stem.
#[derive(Serialize)]
struct Frame {
    x: f64,
    y: f64,
    lamp: Option<&'static str>,
    stem: Vec<[f64; 2]>,
}

/// Grows the bean.
pub(crate) fn try_out(studio: &Studio, plan: &TryPlan) -> Result<Value, Refusal> {
    let targets: Vec<[f64; 2]> =
        serde_json::from_str(&plan.targets).map_err(|error| Refusal::bad(format!("targets: {error}")))?;
    let task = task(&targets)?;
    let (layout, species) = (Layout::default(), Species::default());
    let mut controller: Box<dyn Controller> = match plan.who {
        Who::Greedy => ControllerSpec::Greedy.build(&task, &layout, PAPER_PERIOD_MIN),
        Who::Champion => {
            let folder = found::resolve_kind(&studio.root, &plan.at, found::Kind::Evolution)?;
            let spec = evolution::controller(&folder, plan.run)?;
            spec.check(&layout, PAPER_PERIOD_MIN)?;
            spec.build(&task, &layout, PAPER_PERIOD_MIN)
        }
        Who::You => Box::new(Given::read(&plan.lights)?),
    };
    let most = if plan.who == Who::You { plan.lights.len() as u32 } else { MOST_STEPS };
    let mut bean = Trial::new(&species).specimen(plan.seed);
    let (mut frames, mut samples) = (Vec::new(), Vec::new());
    let mut is_over = false;
    for step in 0..=most {
        let Ok(seen) = bean.observe();
        is_over = task.is_over(step, &seen);
        let light = (!is_over && step < most).then(|| controller.decide(&seen));
        frames.push(frame(&seen, light));
        samples.push(Sample {
            step,
            time_s: 60.0 * PAPER_PERIOD_MIN * f64::from(step),
            tip: seen.tip,
            light,
            quality: Quality::Simulated,
            stem: None,
            depth: None,
        });
        let Some(light) = light else { break };
        let Ok(()) = bean.step(light);
    }
    let track = Track::of(samples);
    let crossings = task.as_targets().map(|targets| targets.crossings(&track)).unwrap_or_default();
    let steps = frames.len();
    let fitness: Vec<f64> = fitness_so_far(&task, &track);
    Ok(json!({
        "from": plan.from.min(steps),
        "frames": frames.into_iter().skip(plan.from).collect::<Vec<_>>(),
        "fitness": &fitness[plan.from.min(steps)..],
        "crossings": crossings,
        "is_over": is_over,
        "best": task.best_fitness(),
    }))
}

/// The fitness up to each step, in cm.
fn fitness_so_far(task: &TaskSpec, track: &Track) -> Vec<f64> {
    let seen = |sample: &Sample| Observation::simulated(sample.tip);
    let Some(first) = track.samples.first().map(seen) else { return Vec::new() };
    let mut sum = 0.0;
    let steps = track.samples.windows(2).map(|pair| {
        sum += task.step_fitness(&first, &seen(&pair[0]), &seen(&pair[1]));
        (100.0 * sum).round() / 100.0
    });
    std::iter::once(0.0).chain(steps).collect()
}

fn frame(seen: &Observation, light: Option<Light>) -> Frame {
    let rounded = |value: f64| (100.0 * value).round() / 100.0;
    let pair = |point: &Point| [rounded(point.x), rounded(point.y)];
    Frame {
        x: rounded(seen.tip.x),
        y: rounded(seen.tip.y),
        lamp: light.map(|light| if light == Light::RIGHT { "right" } else { "left" }),
        stem: seen.stem.as_ref().map(|stem| stem.0.iter().map(pair).collect()).unwrap_or_default(),
    }
}

/// The lights that a person gave.
struct Given(std::vec::IntoIter<Light>);

impl Given {
    fn read(letters: &str) -> Result<Self, Refusal> {
        let light = |letter| match letter {
            'l' => Ok(Light::LEFT),
            'r' => Ok(Light::RIGHT),
            other => Err(Refusal::bad(format!("lights: found {other:?}, wanted l or r"))),
        };
        if letters.len() > MOST_STEPS as usize {
            return Err(Refusal::bad(format!("found {} lights, wanted at most {MOST_STEPS}", letters.len())));
        }
        Ok(Self(letters.chars().map(light).collect::<Result<Vec<_>, _>>()?.into_iter()))
    }
}

impl Controller for Given {
    fn decide(&mut self, _seen: &Observation) -> Light {
        self.0.next().unwrap_or(Light::LEFT)
    }
}

/// An evolution that a page asks for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EvolveRequest {
    pub(crate) name: String,
    pub(crate) targets: Vec<[f64; 2]>,
    #[serde(default = "four")]
    pub(crate) runs: u32,
    #[serde(default = "three_hundred")]
    pub(crate) generations: u32,
    #[serde(default = "one")]
    pub(crate) seed: u64,
    /// File of the model; that of virtual beans if it is left out.
    pub(crate) model: Option<String>,
}

const fn four() -> u32 {
    4
}

const fn three_hundred() -> u32 {
    300
}

const fn one() -> u64 {
    1
}

/// Checks the name of what is to be made in the folder of the studio.
pub(crate) fn check_name(name: &str) -> Result<(), Refusal> {
    let is_plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
    if (1..=60).contains(&name.len()) && is_plain && !name.starts_with('-') {
        return Ok(());
    }
    Err(Refusal::bad(format!("found the name {name:?}, wanted letters, digits, - and _, 60 at most")))
}

/// Puts an evolution for drawn targets into the queue: its folder, and the commands that do the same.
pub(crate) fn evolve(studio: &Studio, request: &EvolveRequest) -> Result<Value, Refusal> {
    let EvolveRequest { name, targets, runs, generations, seed, model } = request;
    let saved = save(studio, name, targets)?;
    if !(1..=1000).contains(runs) || !(1..=MOST_GENERATIONS).contains(generations) {
        return Err(Refusal::bad("wanted 1 to 1000 runs of 1 to 100000 generations"));
    }
    if studio.root.join(name).exists() || studio.queue.has(name) {
        return Err(Refusal::bad(format!("{name}: found a folder of this name, wanted a new one")));
    }
    let mut commands = Vec::new();
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<String>>();
    let model = match model {
        Some(model) => {
            found::resolve(&studio.root, model)?;
            model.clone()
        }
        None => {
            let (model, tracks) = VIRTUAL;
            if !studio.root.join(model).exists() {
                commands.push(words(&format!("grow --plants 6 --out {tracks}")));
                commands.push(words(&format!("fit {tracks} --out {model}")));
            }
            model.to_owned()
        }
    };
    let mut evolve = words("evolve --model");
    evolve.push(model);
    evolve.extend(words(&format!(
        "--task {name}.toml --out {name} --runs {runs} --generations {generations} --seed {seed} --checkpoint 1"
    )));
    commands.push(evolve);
    let lines: Vec<String> = commands.iter().map(|words| jobs::line(words)).collect();
    let number = studio.queue.add(name, commands).map_err(|error| Refusal::bad(error.to_string()))?;
    Ok(json!({ "job": number, "at": name, "task": saved["task"], "commands": lines }))
}

/// Writes the task file of drawn targets: its text, and the commands that use it.
pub(crate) fn save(studio: &Studio, name: &str, targets: &[[f64; 2]]) -> Result<Value, Refusal> {
    check_name(name)?;
    let text = task_text(targets)?;
    let path = studio.root.join(format!("{name}.toml"));
    match files::read_text(&path) {
        Ok(found) if found != text => {
            return Err(Refusal::bad(format!(
                "{name}.toml: found another task of this name, wanted a new name"
            )));
        }
        Ok(_) => {}
        Err(_) => files::write(&path, text.as_bytes())?,
    }
    Ok(json!({ "task": text, "file": format!("{name}.toml"), "commands": commands(name) }))
}

/// The task file of drawn targets.
pub(crate) fn task_text(targets: &[[f64; 2]]) -> Result<String, Refusal> {
    let task = task(targets)?;
    toml::to_string(&task).map_err(|error| Refusal::bad(error.to_string()))
}

fn commands(name: &str) -> [String; 2] {
    [
        format!("tropism evolve --model {} --task {name}.toml --out {name}", VIRTUAL.0),
        format!("tropism run --rig greenhouse --controller {name}/champion.json --out {name}-bean"),
    ]
}

/// Files of models in the folder of the studio: names of the usual ones that are there.
pub(crate) fn models(root: &Path) -> Vec<String> {
    let mut folders = vec![String::new()];
    let entries = std::fs::read_dir(root).into_iter().flatten().flatten();
    let is_folder = |entry: &std::fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
    folders.extend(entries.filter(is_folder).filter_map(|entry| entry.file_name().into_string().ok()));
    folders.retain(|folder| !folder.starts_with('.'));
    folders.sort_unstable();
    let mut found = Vec::new();
    for folder in folders {
        for name in [VIRTUAL.0, "model.json", "stem.json"] {
            let at = if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") };
            if root.join(&at).is_file() {
                found.push(at);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_targets_are_out_of_reach_and_near_ones_are_not() {
        let reach = reach();
        let at = |height: f64| reach.iter().find(|[y, _]| *y >= height).map_or(0.0, |[_, x]| *x);
        // The paper's targets were reached by real plants.
        for target in Targets::default().targets {
            assert!(at(target.y) > target.x.abs(), "{target:?}: {}", at(target.y));
        }
        assert!(at(5.0) < 9.0, "{reach:?}");
    }

    #[test]
    fn targets_are_sorted_and_checked() {
        let text = task_text(&[[-5.0, 9.0], [3.0, 6.0]]).unwrap();
        let task: TaskSpec = toml::from_str(&text).unwrap();
        assert_eq!(task.targets(), [Point::new(3.0, 6.0), Point::new(-5.0, 9.0)]);
        assert_eq!(task.as_targets().unwrap().end_height_cm, 9.3);
        for targets in [
            &[][..],
            &[[f64::NAN, 6.0]],
            &[[0.0, 2.0]],
            &[[0.0, 1e9]],
            &[[1.0, 6.0], [2.0, 6.0]],
            &[[0.0, 5.0]; 9],
        ] {
            assert!(super::task(targets).is_err(), "{targets:?}");
        }
    }

    #[test]
    fn names_are_plain() {
        assert!(check_name("my-task_2").is_ok());
        for name in ["", "a/b", "..", "-x", "a b", "<b>", "ä", &"x".repeat(61)] {
            assert!(check_name(name).is_err(), "{name}");
        }
    }
}
