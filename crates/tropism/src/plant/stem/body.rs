//! The state of simulated stems, of one plant or of several side by side in vector lanes, and how it moves.

use super::history::History;
use super::shape::{Angles, MODES, Modes, Place, SEGMENTS, Scores, Stem, size, stem_of, tilts, top_of};
use super::terms::Windows;
use crate::geometry::STEM_POINTS;
use crate::math::{Real, exp};

/// Minutes in which a simulated tip comes back by 63 % to where the replayed tip is seen beside the stem. Chosen: the top
/// leaves, which make most of this distance, take their time.
const OFFSET_MIN: f64 = 60.0;

/// What the line does not say of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residual<const AXES: usize, R = f64> {
    /// What is left of the change of the scores.
    pub(super) scores: [Scores<R>; AXES],
    /// Growth in length, in cm.
    pub(super) growth_cm: R,
    /// From the highest point of the stem to the tip, after the step: the tip is of the top leaves.
    pub(super) offset: Place<AXES, R>,
}

/// The state of stems, of as many as a number has lanes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body<const AXES: usize, R = f64> {
    pub(crate) tip: Place<AXES, R>,
    /// The stem without noise, and its highest point.
    pub(crate) stem: Stem<AXES, R>,
    pub(super) top: Place<AXES, R>,
    pub(super) scores: [Scores<R>; AXES],
    /// What the principal components leave of the tilts: it stays as it is, but for contact.
    pub(super) rest: [Angles<R>; AXES],
    pub(super) length_cm: R,
    /// Gain of the light.
    pub(super) gain: R,
    /// The light of each step so far, and the changes of the scores.
    pub(super) light: History<AXES, 1, R>,
    pub(super) changes: History<AXES, MODES, R>,
    /// From where the tip is replayed beside the stem to where it is.
    apart: Place<AXES, R>,
    /// What is replayed in this step.
    pub(super) drawn: Residual<AXES, R>,
}

impl<const AXES: usize, R: Real> Body<AXES, R> {
    /// Straight stems from `base` to the tip at `start`, all with the same `gain`.
    pub(super) fn upright(
        modes: &Modes,
        windows: &Windows,
        gain: f64,
        base: Place<AXES>,
        start: Place<AXES>,
    ) -> Self {
        let mut points = [start; STEM_POINTS];
        points[0] = base;
        let scores = modes.scores(tilts(&points).map(|tilts| [tilts[0]; SEGMENTS]));
        let straight = start - base;
        let square =
            straight.aside.iter().map(|aside| aside * aside).sum::<f64>() + straight.up * straight.up;
        let nothing = Place { aside: [R::splat(0.0); AXES], up: R::splat(0.0) };
        let mut body = Self {
            tip: Place::splat(start),
            stem: [Place::splat(base); STEM_POINTS],
            top: Place::splat(base),
            scores: scores.map(|scores| scores.map(R::splat)),
            rest: [[R::splat(0.0); SEGMENTS]; AXES],
            length_cm: R::splat(square.sqrt()),
            gain: R::splat(gain),
            light: History::new(windows.oldest_light()),
            changes: History::new(windows.oldest_change()),
            apart: nothing,
            drawn: Residual {
                scores: [[R::splat(0.0); MODES]; AXES],
                growth_cm: R::splat(0.0),
                offset: nothing,
            },
        };
        body.pose(modes);
        body
    }

    /// Puts a seedling into a lane.
    pub(super) fn refill(&mut self, lane: usize, seedling: &Body<AXES>) {
        self.tip.set_lane(lane, seedling.tip);
        self.stem.iter_mut().zip(seedling.stem).for_each(|(point, place)| point.set_lane(lane, place));
        self.top.set_lane(lane, seedling.top);
        for axis in 0..AXES {
            let scores = self.scores[axis].iter_mut().zip(seedling.scores[axis]);
            let rest = self.rest[axis].iter_mut().zip(seedling.rest[axis]);
            scores.chain(rest).for_each(|(number, value)| number.set_lane(lane, value));
        }
        self.length_cm.set_lane(lane, seedling.length_cm);
        self.gain.set_lane(lane, seedling.gain);
        self.apart.set_lane(lane, seedling.apart);
        self.light.forget(lane);
        self.changes.forget(lane);
    }

    /// What is replayed in this step in a lane. `begun` is the offset of the tip before the step where a block begins: the tip of
    /// the simulated plant comes to that of the measured one little by little.
    pub(super) fn replay(&mut self, lane: usize, drawn: &Residual<AXES>, begun: Option<Place<AXES>>) {
        if let Some(offset) = begun {
            self.apart.set_lane(lane, self.tip.lane(lane) - self.top.lane(lane) - offset);
        }
        for (scores, drawn) in self.drawn.scores.iter_mut().zip(drawn.scores) {
            scores.iter_mut().zip(drawn).for_each(|(score, value)| score.set_lane(lane, value));
        }
        self.drawn.growth_cm.set_lane(lane, drawn.growth_cm);
        self.drawn.offset.set_lane(lane, drawn.offset);
    }

    /// First scores: how far the stems lean.
    #[inline(always)]
    pub(super) fn lean(&self) -> [R; AXES] {
        let mut lean = [R::splat(0.0); AXES];
        for axis in 0..AXES {
            lean[axis] = self.scores[axis][0];
        }
        lean
    }

    /// The scores, none larger than `most`: beyond all data a plant answers as at their edge.
    #[inline(always)]
    pub(super) fn scores_within(&self, most: &Scores) -> [Scores<R>; AXES] {
        let mut scores = self.scores;
        for mode in 0..MODES {
            let mut of_mode = [R::splat(0.0); AXES];
            for axis in 0..AXES {
                of_mode[axis] = scores[axis][mode];
            }
            let (size, most) = (size(of_mode), R::splat(most[mode]));
            let share = R::select(size.gt(most), most / size, R::splat(1.0));
            for axis in 0..AXES {
                scores[axis][mode] *= share;
            }
        }
        scores
    }

    /// The tilts of the segments.
    #[inline(always)]
    pub(super) fn tilts(&self, modes: &Modes) -> [Angles<R>; AXES] {
        let mut tilts = modes.tilts(self.scores);
        for axis in 0..AXES {
            for segment in 0..SEGMENTS {
                tilts[axis][segment] += self.rest[axis][segment];
            }
        }
        tilts
    }

    /// Sets the points of the stem by scores, rest and length.
    #[inline(always)]
    fn pose(&mut self, modes: &Modes) {
        self.stem = stem_of(self.stem[0], self.tilts(modes), self.length_cm);
        self.top = top_of(&self.stem);
    }

    /// Bends by a `change` of the scores, and grows.
    #[inline(always)]
    pub(super) fn bend(&mut self, change: &[Scores<R>; AXES]) {
        for axis in 0..AXES {
            for mode in 0..MODES {
                self.scores[axis][mode] += change[axis][mode];
            }
        }
        self.length_cm += self.drawn.growth_cm;
    }

    /// Ends a step of `period_min` minutes: remembers the change of the scores, and moves stem and tip.
    #[inline(always)]
    pub(super) fn settle(&mut self, change: [Scores<R>; AXES], modes: &Modes, period_min: f64) {
        self.changes.add(change);
        self.pose(modes);
        self.apart = self.apart.scaled(R::splat(exp(-period_min / OFFSET_MIN)));
        self.tip = self.top + self.drawn.offset + self.apart;
    }
}

impl<const AXES: usize> Body<AXES> {
    /// Puts the stem where one was observed.
    pub(super) fn take(
        &mut self,
        modes: &Modes,
        base: Place<AXES>,
        scores: [Scores; AXES],
        rest: [Angles; AXES],
        length_cm: f64,
    ) {
        (self.stem[0], self.scores, self.rest, self.length_cm) = (base, scores, rest, length_cm);
        self.pose(modes);
    }
}
