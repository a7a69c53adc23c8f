//! CMA-ES on test functions.

use tropism::CmaEs;
use tropism::math;

/// Searches with restarts until the cost is below `wanted`; returns the evaluations.
fn evaluations_until(cost: impl Fn(&[f64]) -> f64, mut search: CmaEs, wanted: f64, most: usize) -> usize {
    let mut evaluations = 0;
    while evaluations < most {
        let points = search.ask();
        let costs: Vec<f64> = points.iter().map(|point| cost(point)).collect();
        evaluations += points.len();
        if costs.iter().any(|&cost| cost < wanted) {
            return evaluations;
        }
        search.tell(&points, &costs);
        if search.is_over() {
            search = search.restarted();
        }
    }
    panic!("not below {wanted} after {evaluations} evaluations: {search:?}");
}

fn sphere(point: &[f64]) -> f64 {
    point.iter().map(|x| x * x).sum()
}

/// Axes of lengths 1 to 1000 (Hansen's `felli`).
fn ellipsoid(point: &[f64]) -> f64 {
    let weight = |at: usize| math::pow(1e6, at as f64 / (point.len() - 1) as f64);
    point.iter().enumerate().map(|(at, x)| weight(at) * x * x).sum()
}

fn rosenbrock(point: &[f64]) -> f64 {
    let pair = |pair: &[f64]| 100.0 * (pair[0] * pair[0] - pair[1]).powi(2) + (pair[0] - 1.0).powi(2);
    point.windows(2).map(pair).sum()
}

/// Two basins, of which the shallow one holds the start.
fn two_basins(point: &[f64]) -> f64 {
    let around = |centre: f64| point.iter().map(|x| (x - centre) * (x - centre)).sum::<f64>();
    f64::min(around(2.0), 1.0 + around(-1.0))
}

#[test]
fn smooth_functions_are_solved() {
    for seed in 0..5 {
        let start = |at| CmaEs::new(&[at; 9], 0.5, 12, seed);
        // Evaluations that leave room: chosen.
        evaluations_until(sphere, start(1.0), 1e-10, 4000);
        evaluations_until(ellipsoid, start(1.0), 1e-10, 16_000);
        // One of several searches ends in the local minimum near (-1, 1, ..., 1).
        evaluations_until(rosenbrock, start(0.0), 1e-10, 60_000);
    }
}

#[test]
fn a_rotated_ellipsoid_is_as_easy_as_a_straight_one() {
    let angle: f64 = 0.7;
    let (sine, cosine) = (math::sin(angle), math::cos(angle));
    let turned = |point: &[f64]| {
        let &[a, b, c, d] = point else { panic!("four dimensions") };
        ellipsoid(&[
            cosine * a - sine * d,
            cosine * b - sine * c,
            sine * b + cosine * c,
            sine * a + cosine * d,
        ])
    };
    let start = || CmaEs::new(&[1.0; 4], 0.5, 8, 3);
    let (plain, turned) = (
        evaluations_until(ellipsoid, start(), 1e-10, 10_000),
        evaluations_until(turned, start(), 1e-10, 10_000),
    );
    assert!(turned < 2 * plain && plain < 2 * turned, "{turned} against {plain}");
}

#[test]
fn a_search_that_is_over_begins_anew_elsewhere() {
    let search = CmaEs::new(&[-1.0; 4], 3.0, 8, 1);
    let first = evaluations_until(two_basins, search.clone(), 1.0 + 1e-6, 20_000);
    let deep = evaluations_until(two_basins, search.clone(), 1e-6, 200_000);
    assert!(deep >= first);
    assert_ne!(search.ask(), search.restarted().ask());
}

#[test]
fn costs_decide_and_nothing_else() {
    let run = |scale: f64| {
        let mut search = CmaEs::new(&[1.0; 5], 0.5, 10, 4);
        for _ in 0..50 {
            let points = search.ask();
            assert_eq!(points, search.ask(), "asking changes nothing");
            // Only the order of the costs matters.
            search.tell(&points, &points.iter().map(|point| scale * rosenbrock(point)).collect::<Vec<_>>());
        }
        search.mean().to_vec()
    };
    assert_eq!(run(1.0), run(4.0));
    let mut search = CmaEs::new(&[0.0; 2], 1.0, 4, 1);
    let points = search.ask();
    search.tell(&points, &[f64::NAN, 1.0, 2.0, -f64::NAN]);
    assert!(search.mean().iter().all(|value| value.is_finite()));
}
