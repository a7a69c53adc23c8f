//! The best way along a bar.

use crate::math;
use crate::vision::detect::curve::Place;
use crate::vision::detect::ridge::bar::{SmoothedImage, THINNEST};

pub(super) const BROADEST: f64 = 0.08;

const RATIO: f64 = 1.15;

/// A stem leaves the soil at up to so many degrees from upright, and a first piece of so many half widths is looked at,
/// of which the better ones count: the foot may stand in the pot's rim.
const LEAN: i32 = 60;

const LEAN_STEP: i32 = 6;

const FIRST: usize = 9;

const BETTER: usize = 6;

/// The thinnest bar that stands out by this share of the most that any does is the stem: a broader one is a leaf above it.
const STANDS_OUT: f64 = 0.6;

/// First pieces that are less than so many times as broad as the thinnest may be the stem's, too.
const SIMILAR: f64 = 1.4;

/// ShortestPaths that are followed at a time, and half widths that any goes on for at most.
const BEAM: usize = 32;

const STEPS: usize = 400;

/// Degrees that a stem turns by in half a width, and factors that its width changes by.
const TURNS: [f64; 7] = [-15.0, -9.0, -4.0, 0.0, 4.0, 9.0, 15.0];

const TAPERS: [f64; 3] = [1.0 / 1.06, 1.0, 1.06];

/// How far a stem's width may get from its first, as a factor.
const TAPERED: (f64, f64) = (0.7, 1.35);

/// What half a width of a way must stand out by to be worth it, as a share of the first piece, and what a turn of one
/// radian, squared, and a change of width cost.
const WORTH: f64 = 0.4;

const TURN_COST: f64 = 3.0;

const TAPER_COST: f64 = 0.5;

/// What stands out by more than this many times as much as the first piece is something else: a lamp.
const GLARING: f64 = 1.25;

/// One place on a way along a stem.
#[derive(Clone, Copy, Debug)]
struct SearchNode {
    at: Place,
    /// Where it goes: radians from upright to the right.
    heading: f64,
    width: f64,
    /// What the way is worth up to here.
    worth: f64,
    /// The width that the way began with.
    first: f64,
    /// The step before, but for the first.
    before: Option<usize>,
}

impl SearchNode {
    /// Whether two ways are about to go on alike.
    fn is_like(&self, other: &Self) -> bool {
        let cell = |at: f64| (at / (0.3 * self.first)).floor();
        let turn = |heading: f64| (heading / 0.17).floor();
        cell(self.at.0) == cell(other.at.0)
            && cell(self.at.1) == cell(other.at.1)
            && turn(self.heading) == turn(other.heading)
    }
}

impl SmoothedImage {
    /// First steps that a stem may leave `base` with, and how much they stand out.
    fn seed_nodes(&self, base: Place) -> (Vec<SearchNode>, f64) {
        let broadest = BROADEST * self.width.min(self.height) as f64;
        let widths =
            std::iter::successors(Some(THINNEST), |width| Some(width * RATIO)).take_while(|&w| w <= broadest);
        let mut found: Vec<(f64, SearchNode)> = Vec::new();
        for width in widths {
            for degrees in (-LEAN..=LEAN).step_by(LEAN_STEP as usize) {
                let heading = f64::from(degrees).to_radians();
                let (sin, cos) = (math::sin(heading), math::cos(heading));
                for aside in [-0.5, -0.25, 0.0, 0.25, 0.5] {
                    let at = (base.0 + aside * width, base.1);
                    let mut bars: [f64; FIRST] = std::array::from_fn(|i| {
                        let far = 0.5 * i as f64 * width;
                        self.bar_contrast((at.0 + far * sin, at.1 - far * cos), heading, width)
                    });
                    bars.sort_by(f64::total_cmp);
                    let stands_out = bars[FIRST - BETTER..].iter().sum::<f64>() / BETTER as f64;
                    let step = SearchNode { at, heading, width, worth: 0.0, first: width, before: None };
                    found.push((stands_out, step));
                }
            }
        }
        let most = found.iter().map(|one| one.0).fold(0.0, f64::max);
        let thinnest =
            found.iter().filter(|one| one.0 > STANDS_OUT * most).map(|one| one.1.width).fold(1e9, f64::min);
        found.retain(|one| (thinnest..SIMILAR * thinnest).contains(&one.1.width));
        found.sort_by(|one, other| other.0.total_cmp(&one.0));
        found.truncate(BEAM);
        let best = found.first().map_or(0.0, |one| one.0);
        let steps = found.into_iter().filter(|one| one.0 > STANDS_OUT * best).map(|one| one.1).collect();
        (steps, best)
    }

    /// The way from `base` that is worth most, and the stem's width along it.
    pub(super) fn trace_ridge(&self, base: Place) -> Option<(Vec<Place>, f64)> {
        let (mut steps, clear) = self.seed_nodes(base);
        if clear <= 0.0 {
            return None;
        }
        let mut open: Vec<usize> = (0..steps.len()).collect();
        let mut best = 0;
        for _ in 0..STEPS {
            let mut next: Vec<SearchNode> =
                open.iter().flat_map(|&from| self.successors(&steps, from, clear)).collect();
            next.sort_by(|one, other| other.worth.total_cmp(&one.worth));
            open.clear();
            for step in next {
                if open.len() < BEAM && !open.iter().any(|&other: &usize| steps[other].is_like(&step)) {
                    open.push(steps.len());
                    steps.push(step);
                }
            }
            let Some(&first) = open.first() else { break };
            if steps[first].worth > steps[best].worth {
                best = first;
            } else if steps[first].worth < steps[best].worth - 3.0 * steps[first].first - 8.0 {
                break;
            }
        }
        let mut way = vec![steps[best]];
        while let Some(before) = way[way.len() - 1].before {
            way.push(steps[before]);
        }
        way.reverse();
        let widths: Vec<f64> = way.iter().map(|step| step.width).collect();
        let line: Vec<Place> = way.iter().map(|step| step.at).collect();
        (line.len() > 2).then(|| (line, math::statistics::quantile_nearest(&widths, 0.5)))
    }

    /// The steps that may follow one.
    fn successors(&self, steps: &[SearchNode], from: usize, clear: f64) -> Vec<SearchNode> {
        let step = steps[from];
        let far = 0.5 * step.first;
        let mut next = Vec::new();
        for turn in TURNS.map(f64::to_radians) {
            let (heading, middle) = (step.heading + turn, step.heading + turn / 2.0);
            let at = (step.at.0 + far * math::sin(middle), step.at.1 - far * math::cos(middle));
            if !self.holds(at) || heading.abs() > std::f64::consts::PI {
                continue;
            }
            for taper in TAPERS {
                let width = step.width * taper;
                if width < TAPERED.0 * step.first || width > TAPERED.1 * step.first {
                    continue;
                }
                let clearness = self.bar_contrast(at, heading, width) / clear;
                let clearness =
                    if clearness > GLARING { GLARING / clearness } else { clearness.clamp(-0.5, 1.0) };
                let cost = WORTH + TURN_COST * turn * turn + TAPER_COST * math::ln(taper).abs();
                let worth = step.worth + far * (clearness - cost);
                next.push(SearchNode { at, heading, width, worth, before: Some(from), ..step });
            }
        }
        next
    }
}
