//! The virtual tent under lamps and other periods.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

use tropism::control::{Controller, Periodic};
use tropism::environment::{run, unwatched};
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::lighting::{Allowed, FULL, Lighting};
use tropism::observation::{Observation, Quality};
use tropism::rig::{Lamps, Rig};
use tropism::task::Task;
use tropism::vision::VisionConfig;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;

#[test]
fn a_lamp_that_is_not_there_is_refused() {
    let (mut tent, _) = Greenhouse::default().open(1, 5.0, &VisionConfig::default()).unwrap();
    let error = tent.light(Some(Light::FRONT)).unwrap_err().to_string();
    assert_eq!(error, "virtual tent: found a light for lamp front, wanted left, right or dark");
    tent.light(Some(Light::RIGHT)).unwrap();
}

#[test]
fn ground_truth_is_kept_by_the_period_of_the_tent() {
    let tent = Greenhouse::default();
    let task = Task::open_loop(4);
    let mut truth = Vec::new();
    let track = tent.grow(1, 20.0, &mut Periodic::new(2, &tent.layout), &task, &mut |sample, handle| {
        truth = if sample.light.is_none() { handle.truth_csv() } else { Vec::new() };
        ControlFlow::Continue(())
    });
    assert_eq!((track.period_min, String::from_utf8(truth).unwrap().lines().count()), (20.0, 6));
}

/// Step and highest point of a row of ground truth.
fn top(row: &str) -> (u32, Point) {
    let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
    (cells[0] as u32, Point::new(cells[1], cells[2]))
}

/// Lights the same lamps at each step.
struct Constant(Lighting);

impl Controller for Constant {
    fn decide(&mut self, _seen: &Observation) -> Light {
        self.0.lit().next().expect("a lit lamp").0
    }

    fn lighting(&mut self, _seen: &Observation) -> Lighting {
        self.0
    }
}

/// How far measured tips are from the highest point of the plant of `seed`, in cm, in `steps` photographs under `lighting`.
fn off_tip(tent: &Greenhouse, lighting: Lighting, seed: u64, steps: u32) -> Vec<f64> {
    let (handle, tracker) = tent.open(seed, 5.0, &VisionConfig::default()).unwrap();
    let hand = || handle.clone();
    let mut rig = Rig::new(hand(), hand(), hand(), hand(), tracker, Duration::from_secs(300))
        .with_layout(tent.layout.clone());
    let task = Task::open_loop(steps);
    let track = run(&mut rig, &mut Constant(lighting), &task, &mut unwatched).unwrap();
    let truth = String::from_utf8(handle.truth_csv()).unwrap();
    let tops: BTreeMap<u32, Point> = truth.lines().skip(1).map(top).collect();
    let measured = track.samples.iter().filter(|sample| sample.quality == Quality::Measured);
    measured.map(|sample| sample.tip.distance(tops[&sample.step])).collect()
}

fn quantile(off: &mut [f64], share: f64) -> f64 {
    off.sort_by(f64::total_cmp);
    off[(off.len() as f64 * share) as usize]
}

#[test]
fn a_tip_is_found_under_each_of_four_lamps() {
    let scene = Scene { width: 432, height: 324, ..Scene::default() };
    let tent = Greenhouse { layout: Layout::four_sides(), scene, ..Greenhouse::default() };
    for light in tent.layout.lights() {
        let mut off = off_tip(&tent, Lighting::only(light), 2, 20);
        let median = quantile(&mut off, 0.5);
        assert!(off.len() > 18 && median < 0.1, "{light}: median {median:.3} cm");
    }
}

#[test]
fn tips_with_two_lamps_lit_are_as_near_as_with_one() {
    let scene = Scene { width: 432, height: 324, ..Scene::default() };
    let allowed = Allowed::Any { most_lit: 2, budget: 2.0 };
    let tent = Greenhouse { scene, allowed, ..Greenhouse::default() };
    let left = Lighting::only(Light::LEFT);
    let all = [left, Lighting::only(Light::RIGHT), left.with(Light::RIGHT, FULL)];
    let [one, other, both] = all.map(|lighting| {
        let mut off: Vec<f64> = (0..8).flat_map(|seed| off_tip(&tent, lighting, seed, 24)).collect();
        assert!(off.len() >= 8 * 23, "{} of {} tips measured", off.len(), 8 * 25);
        [0.5, 0.95].map(|share| quantile(&mut off, share))
    });
    println!(
        "median and 95 % of the error of the tip, in cm: left {one:.3?}, right {other:.3?}, both {both:.3?}"
    );
    for (place, name) in ["median", "95 %"].into_iter().enumerate() {
        let single = one[place].max(other[place]);
        assert!(both[place] <= 1.2 * single + 0.01, "{name}: {both:?} cm beside {one:?} and {other:?}");
    }
}
