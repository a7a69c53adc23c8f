//! Plants that were left out: what was observed of them, and what is taken for true.

use std::convert::Infallible;
use std::path::PathBuf;

use tropism::control::{Controller, Periodic, Schedule};
use tropism::environment::{self, Environment};
use tropism::geometry::path;
use tropism::geometry::space::SpacePoint;
use tropism::geometry::{Point, STEM_POINTS};
use tropism::lamps::{Layout, Light};
use tropism::observation::{Observation, Quality};
use tropism::parallel;
use tropism::random::{self, NoiseStream, Purpose};
use tropism::task::Task;
use tropism::track::Track;
use tropism_bean::{Specimen, Trial};

use super::ForecastPlan;
use crate::controller::PAPER_SWITCH_MIN;
use crate::fit::is_of_virtual_plant;
use crate::simulate::without_gaps;
use crate::{Error, Monitor, files};

/// Forecasts start below this height, in cm: models of the stem are made of data below it.
pub(super) const HIGHEST_START_CM: f64 = 16.0;

/// Minutes of observation before the first start: the longest memory of the model of the stem.
const MEMORY_MIN: f64 = 70.0;

/// How long a virtual bean grows, in minutes: as much of a track as models of the stem use.
const GROWN_MIN: f64 = 2500.0;

/// Least and greatest time for which a random lamp is lit, in minutes.
const RANDOM_MIN: [f64; 2] = [30.0, 360.0];

/// In what forecasts are judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    /// In the plane of the front camera.
    Front,
    /// In space, as two cameras know the plant.
    Space,
}

impl View {
    /// Number of coordinates of a point.
    pub(super) const fn axes(self) -> usize {
        match self {
            Self::Front => 2,
            Self::Space => 3,
        }
    }
}

/// Ten points of a stem.
pub(super) type Points = [SpacePoint; STEM_POINTS];

/// A plant at one step, in cm. In the plane of the front camera all depths are 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) tip: SpacePoint,
    pub(super) stem: Option<Points>,
}

impl State {
    /// What is `seen` of a plant; `None` in space where the depth of the tip is not known.
    pub(super) fn of(seen: &Observation, view: View) -> Option<Self> {
        let flat = |point: Point| [point.x, point.y, 0.0];
        match view {
            View::Front => {
                Some(Self { tip: flat(seen.tip), stem: seen.ten_points().map(|points| points.map(flat)) })
            }
            View::Space => {
                let stem = seen.stem_in_space().filter(|stem| path::length(stem) > 0.0);
                let stem = stem.and_then(|stem| path::resampled(&stem, STEM_POINTS).try_into().ok());
                Some(Self { tip: seen.tip_in_space()?, stem })
            }
        }
    }
}

/// A plant that was left out.
pub(super) struct LeftOut {
    /// The file, or the number of a virtual bean.
    pub(super) name: String,
    pub(super) is_virtual: bool,
    /// What was observed; its samples are one step apart.
    pub(super) observed: Track,
    /// What is taken for true at each sample; `None` where nothing was measured.
    pub(super) truth: Vec<Option<Observation>>,
}

impl LeftOut {
    /// The plant as it is taken to be at sample `at`; `None` where it was not measured.
    pub(super) fn truth(&self, at: usize, view: View) -> Option<State> {
        State::of(self.truth[at].as_ref()?, view)
    }

    /// Whether the depth of its tip is known at any step.
    pub(super) fn is_in_space(&self) -> bool {
        self.truth.iter().flatten().any(|seen| seen.depth.is_some())
    }

    /// The samples from which all horizons can be judged: `every_min` apart, after the memory of the models.
    pub(super) fn starts(&self, horizons_min: &[f64], every_min: f64, view: View) -> Vec<usize> {
        let steps = |minutes: f64| steps_of(minutes, self.observed.period_min);
        let longest = horizons_min.iter().map(|&minutes| steps(minutes)).max().unwrap_or(1);
        let samples = &self.observed.samples;
        let is_start = |&start: &usize| {
            let is_known = |minutes: &f64| {
                let after = self.truth(start + steps(*minutes), view);
                // Of a plant with a stem the stem is judged, too.
                after.is_some_and(|after| after.stem.is_some() || samples[start].stem.is_none())
            };
            let is_low = samples[start].tip.y < HIGHEST_START_CM && self.truth(start, view).is_some();
            let is_lit = || samples[start..start + longest].iter().all(|sample| sample.light.is_some());
            is_low && is_lit() && horizons_min.iter().all(is_known)
        };
        let last = samples.len().saturating_sub(longest);
        (steps(MEMORY_MIN)..last).step_by(steps(every_min)).filter(is_start).collect()
    }
}

/// Minutes in steps, at least one.
pub(super) fn steps_of(minutes: f64, period_min: f64) -> usize {
    ((minutes / period_min).round() as usize).max(1)
}

/// The plants of tracks that were measured. Steps that are missing in a track are carried forward.
pub(super) fn measured(paths: &[PathBuf]) -> Result<Vec<LeftOut>, Error> {
    let read = |path: &PathBuf| {
        let track = files::read_track(path)?;
        let is_virtual = is_of_virtual_plant(path, &track);
        Ok(of_measured(path.display().to_string(), track, is_virtual))
    };
    files::track_files(paths)?.iter().map(read).collect()
}

fn of_measured(name: String, track: Track, is_virtual: bool) -> LeftOut {
    let samples = without_gaps(track.samples.iter().cloned());
    let truth = samples.iter().map(|sample| {
        let is_measured = sample.quality != Quality::CarriedForward;
        is_measured.then(|| sample.observation())
    });
    LeftOut { name, is_virtual, truth: truth.collect(), observed: Track { samples, ..track } }
}

/// Virtual beans, `in_space` seen by two cameras, under both kinds of light: the lamps in turn for six hours each, and for random times.
pub(super) fn grown(
    plan: &ForecastPlan,
    layout: &Layout,
    period_min: f64,
    in_space: bool,
    monitor: &dyn Monitor,
) -> Result<Vec<(String, Vec<LeftOut>)>, Error> {
    monitor.stage("growing unseen beans", u64::from(2 * plan.plants));
    let trial = plan.greenhouse.trial(period_min);
    let trial = Trial { layout: layout.clone(), in_space: in_space || trial.in_space, ..trial };
    let steps = steps_of(GROWN_MIN, period_min);
    let grow = |light: &str, make: &(dyn Fn(u32) -> Box<dyn Controller> + Sync)| {
        let plant = |plant: u32| {
            if !monitor.may_go_on() {
                return Err(Error::cancelled());
            }
            let seed = random::derive(plan.seed, Purpose::Judge, plant.into()) >> 1;
            let grown = grow(&trial, seed, &mut *make(plant), steps, format!("virtual bean {}", plant + 1));
            monitor.advance(1);
            Ok(grown)
        };
        parallel::try_map(plan.plants as usize, |number| plant(number as u32))
            .map(|plants| (light.to_owned(), plants))
    };
    let six_hours =
        |_| -> Box<dyn Controller> { Box::new(Periodic::every(PAPER_SWITCH_MIN / period_min, layout)) };
    let random = |plant| -> Box<dyn Controller> {
        Box::new(random_schedule(plan.seed, plant, layout, steps, period_min))
    };
    Ok(vec![grow("six-hour", &six_hours)?, grow("random", &random)?])
}

fn grow(
    trial: &Trial<'_>,
    seed: u64,
    controller: &mut dyn Controller,
    steps: usize,
    name: String,
) -> LeftOut {
    let mut world = Witnessed { specimen: trial.specimen(seed), truth: Vec::new() };
    let task = Task::open_loop(steps as u32);
    let Ok(observed) = environment::run(&mut world, controller, &task, &mut environment::unwatched);
    LeftOut { name, is_virtual: true, observed, truth: world.truth }
}

/// A virtual bean of which the truth is kept beside what is observed.
struct Witnessed {
    specimen: Specimen,
    truth: Vec<Option<Observation>>,
}

impl Environment for Witnessed {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        self.truth.push(Some(self.specimen.without_noise()));
        self.specimen.observe()
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.specimen.step(light)
    }

    fn period_min(&self) -> f64 {
        self.specimen.period_min()
    }

    fn layout(&self) -> &Layout {
        self.specimen.layout()
    }
}

/// The lamps of `layout` in turn from a random one on, each for a random time.
fn random_schedule(seed: u64, plant: u32, layout: &Layout, steps: usize, period_min: f64) -> Schedule {
    let all: Vec<Light> = layout.steering().collect();
    let mut draws = NoiseStream::new(seed, Purpose::Schedule, [plant, 0, 0]).of_seedling();
    let mut lamp = (draws.uniform() * all.len() as f64) as usize;
    let mut lights = Vec::with_capacity(steps + 1);
    while lights.len() <= steps {
        let minutes = RANDOM_MIN[0] + (RANDOM_MIN[1] - RANDOM_MIN[0]) * draws.uniform();
        lights.extend(std::iter::repeat_n(all[lamp % all.len()], steps_of(minutes, period_min)));
        lamp += 1;
    }
    Schedule::new(lights)
}
