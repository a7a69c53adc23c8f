//! The virtual tent under lamps and other periods.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

use tropism::control::Periodic;
use tropism::environment::{run, unwatched};
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::observation::Quality;
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

#[test]
fn a_tip_is_found_under_each_of_four_lamps() {
    let scene = Scene { width: 432, height: 324, ..Scene::default() };
    let tent = Greenhouse { layout: Layout::four_sides(), scene, ..Greenhouse::default() };
    for light in tent.layout.lights() {
        let (handle, tracker) = tent.open(2, 5.0, &VisionConfig::default()).unwrap();
        let hand = || handle.clone();
        let mut rig = Rig::new(hand(), hand(), hand(), hand(), tracker, Duration::from_secs(300))
            .with_layout(tent.layout.clone());
        let mut controller = Periodic::new(1000, &tent.layout).starting_with(light);
        let task = Task::open_loop(20);
        let track = run(&mut rig, &mut controller, &task, &mut unwatched).unwrap();
        let truth = String::from_utf8(handle.truth_csv()).unwrap();
        let tops: BTreeMap<u32, Point> = truth.lines().skip(1).map(top).collect();
        let mut off: Vec<f64> = track
            .samples
            .iter()
            .filter(|sample| sample.quality == Quality::Measured)
            .map(|sample| sample.tip.distance(tops[&sample.step]))
            .collect();
        off.sort_by(f64::total_cmp);
        let (median, most) = (off[off.len() / 2], off[off.len() * 95 / 100]);
        assert!(off.len() > 18 && median < 0.1, "{light}: median {median:.3}, 95 % {most:.3} cm");
    }
}
