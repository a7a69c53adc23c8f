//! What speaks against a track, and what to do about it: most often the region, the base or the scale is wrong.

use std::cmp::Reverse;
use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Region};
use tropism::math::statistics::upper_median;
use tropism::observation::Quality;
use tropism::text::plural;
use tropism::track::Track;
use tropism::vision::Direction;

use super::plants::{PAPER_WIDTH_CM, Plant};
use super::table::TrackCounts;
use crate::files;

/// Share of the photographs in which a tip must be measured; chosen by hand. Each fault of the virtual tent, at the rates
/// of docs/validation/vision-virtual.md, leaves 85 % or more.
const LEAST_MEASURED: f64 = 0.5;

/// Share of the photographs in which a plant may reach an edge of its region, or another plant may touch it; chosen by hand.
const OFTEN: f64 = 0.1;

/// Largest distance of the stem's foot from the base, in cm, sideways and upwards. Chosen by hand: a foot often lies in the
/// shade of the pot's rim.
const MOST_ASIDE_CM: f64 = 1.0;
const MOST_ABOVE_CM: f64 = 2.5;

/// Why a track is uncertain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WarningKind {
    /// The tip is measured in less than half of the photographs.
    FewMeasured,
    /// The stem does not begin at the base.
    RootElsewhere,
    /// The plant reaches an edge of its region in a tenth of the photographs or more.
    TipAtEdge,
    /// Another plant touches it in a tenth of the photographs or more.
    PlantsTouch,
    /// What was detected never moves.
    NeverMoves,
    /// Several things move, and the tip is of one in a tenth of the photographs or more, and of another in as many.
    SeveralPlants,
    /// The background is not found again in a tenth of the photographs or more: the camera was turned, or its lens moved.
    BackgroundLost,
    /// The scale is that of the paper's camera, because the plan gives none.
    ScaleAssumed,
    /// The photographs have nothing to do with each other, so their order is no motion.
    Unrelated,
    /// When the photographs were taken is uncertain.
    Times,
}

/// One warning about a track.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackWarning {
    /// Why the track is uncertain.
    pub kind: WarningKind,
    /// What was found, and what to do, in a sentence with the keys of a plan in backticks.
    pub advice: String,
}

/// What is known of a plant when its series ends.
pub(super) struct Evidence<'a> {
    pub(super) plant: &'a Plant,
    pub(super) counts: &'a TrackCounts,
    /// The lowest point of the stem in each photograph with a measured tip, in pixels of the first photograph.
    pub(super) feet: &'a [Pixel],
    pub(super) is_scale_assumed: bool,
    pub(super) is_unrelated: bool,
    /// What may be wrong with the times: a sentence each.
    pub(super) times: &'a [String],
    pub(super) never_moves: bool,
    /// The measured tip in each photograph.
    pub(super) tips: &'a [Option<Pixel>],
    /// The direction in which the plant grows.
    pub(super) up: Direction,
}

impl Evidence<'_> {
    /// The warnings, the gravest first.
    pub(super) fn warnings(&self) -> Vec<TrackWarning> {
        let all = [
            self.never_moves(),
            self.several_plants(),
            self.few_measured(),
            self.root_elsewhere(),
            self.tip_at_edge(),
            self.plants_touch(),
            self.background_lost(),
            self.scale_assumed(),
            self.unrelated(),
        ];
        let times = self.times.iter().map(|advice| TrackWarning::new(WarningKind::Times, advice.clone()));
        all.into_iter().flatten().chain(times).collect()
    }

    fn never_moves(&self) -> Option<TrackWarning> {
        let advice =
            "what was detected never moves: is it the plant? `guide` writes a page to click its tip on";
        self.never_moves.then(|| TrackWarning::new(WarningKind::NeverMoves, advice.to_owned()))
    }

    fn several_plants(&self) -> Option<TrackWarning> {
        let tips = || self.tips.iter().flatten();
        let count_in = |place: &Region| tips().filter(|tip| place.contains(**tip)).count();
        let mut found: Vec<(usize, &Region)> =
            self.plant.movers.iter().map(|place| (count_in(place), place)).collect();
        found.sort_by_key(|(count, _)| Reverse(*count));
        let [(_, first), (least, second), ..] = found[..] else { return None };
        is_often(least, self.counts.frames).then(|| {
            let advice = format!(
                "the tip is now that of what moves at {first}, and now at {second}: give the `region` of the plant, or of each"
            );
            TrackWarning::new(WarningKind::SeveralPlants, advice)
        })
    }

    fn few_measured(&self) -> Option<TrackWarning> {
        let TrackCounts { frames, measured, .. } = *self.counts;
        is_too_few(measured, frames).then(|| {
            TrackWarning::new(
                WarningKind::FewMeasured,
                format!(
                    "the tip is measured in {measured} of {}, less than half: is the plant in its `region`, and its root at \
                     `base`? Leave out photographs from before it emerged",
                    plural(frames, "photograph")
                ),
            )
        })
    }

    fn root_elsewhere(&self) -> Option<TrackWarning> {
        // Beside and above are those of a plant that grows upwards.
        if self.up != Direction::Up {
            return None;
        }
        let middle = |coordinates: Vec<f64>| upper_median(&coordinates, f64::total_cmp);
        let x = middle(self.feet.iter().map(|foot| foot.x).collect())?;
        let y = middle(self.feet.iter().map(|foot| foot.y).collect())?;
        let calibration = &self.plant.calibration;
        let base = calibration.base;
        // A stem cannot be seen below the region.
        let lowest =
            self.plant.region.map_or(base.y, |Region { y, height, .. }| base.y.min((y + height) as f64));
        let [aside_cm, above_cm] = [(x - base.x).abs(), lowest - y].map(|px| px / calibration.px_per_cm);
        (aside_cm > MOST_ASIDE_CM || above_cm > MOST_ABOVE_CM).then(|| {
            TrackWarning::new(
                WarningKind::RootElsewhere,
                format!(
                    "the stem begins at {x:.0},{y:.0}, {:.1} cm from the `base` at {:.0},{:.0}: the `base` is where the \
                     stem leaves the soil",
                    Pixel::new(x, y).distance(base) / calibration.px_per_cm,
                    base.x,
                    base.y
                ),
            )
        })
    }

    fn tip_at_edge(&self) -> Option<TrackWarning> {
        let clipped: usize = self.counts.leaves_view_at.values().sum();
        is_often(clipped, self.counts.frames).then(|| {
            let edges: Vec<&str> = self.counts.leaves_view_at.keys().copied().collect();
            TrackWarning::new(
                WarningKind::TipAtEdge,
                format!(
                    "in {clipped} of {} the plant reaches the edge of its region ({}), where its tip may lie \
                     outside: a `region` with more room there may help",
                    plural(self.counts.frames, "photograph"),
                    edges.join(", ")
                ),
            )
        })
    }

    fn plants_touch(&self) -> Option<TrackWarning> {
        let TrackCounts { frames, touched, .. } = *self.counts;
        is_often(touched, frames).then(|| {
            TrackWarning::new(
                WarningKind::PlantsTouch,
                format!(
                    "in {touched} of {} another plant touches it, whose tip may be taken for its own where it is higher: end \
                     the `region` between them",
                    plural(frames, "photograph")
                ),
            )
        })
    }

    fn background_lost(&self) -> Option<TrackWarning> {
        let TrackCounts { frames, camera, .. } = self.counts;
        is_often(camera.unknown, *frames).then(|| {
            TrackWarning::new(
                WarningKind::BackgroundLost,
                format!(
                    "the background of the first photographs is not found again in {} of {}: the camera may have been \
                     turned, so that all cm are wrong there. Track the photographs before and after apart",
                    camera.unknown,
                    plural(*frames, "photograph")
                ),
            )
        })
    }

    fn scale_assumed(&self) -> Option<TrackWarning> {
        self.is_scale_assumed.then(|| {
            TrackWarning::new(
                WarningKind::ScaleAssumed,
                format!(
                    "no scale is given, and the picture is taken to be {PAPER_WIDTH_CM} cm wide at the plant: give \
                     `px_per_cm` or `calibration`, or all cm are in an unknown unit"
                ),
            )
        })
    }

    fn unrelated(&self) -> Option<TrackWarning> {
        let advice = "the photographs are taken to have nothing to do with each other (`each`), so the track is a table, \
                      and no motion";
        self.is_unrelated.then(|| TrackWarning::new(WarningKind::Unrelated, advice.to_owned()))
    }
}

impl TrackWarning {
    fn new(kind: WarningKind, advice: String) -> Self {
        Self { kind, advice }
    }
}

/// Whether something is so in a tenth of the photographs or more.
fn is_often(count: usize, frames: usize) -> bool {
    count > 0 && count as f64 >= OFTEN * frames as f64
}

/// Whether a tip is measured in less than half of the photographs.
fn is_too_few(measured: usize, frames: usize) -> bool {
    (measured as f64) < LEAST_MEASURED * frames as f64
}

/// The warnings about the track in the file `path`: those in the JSON file beside it, or else whether less than half of its
/// rows are measured.
#[must_use]
pub fn warnings_of(path: &Path, track: &Track) -> Vec<TrackWarning> {
    #[derive(Deserialize)]
    struct Sidecar {
        warnings: Vec<TrackWarning>,
    }
    let text = files::read_text(&path.with_extension("json")).unwrap_or_default();
    if let Ok(Sidecar { warnings }) = serde_json::from_str(&text) {
        return warnings;
    }
    let rows = track.samples.len();
    let held = track.samples.iter().filter(|sample| sample.quality == Quality::CarriedForward).count();
    let advice = || format!("the tip is carried forward in {held} of {rows} rows, more than half");
    is_too_few(rows - held, rows)
        .then(|| TrackWarning::new(WarningKind::FewMeasured, advice()))
        .into_iter()
        .collect()
}

#[cfg(test)]
mod tests {
    use tropism::vision::Calibration;

    use super::*;

    #[test]
    fn a_tip_of_one_plant_and_of_another_is_said() {
        let at = |x| Region { x, y: 20, width: 60, height: 80 };
        let plant = Plant {
            name: None,
            region: None,
            calibration: Calibration::from_scale(Pixel::new(100.0, 150.0), 10.0, 200, 160),
            is_located: false,
            movers: vec![at(0), at(70), at(140)],
        };
        let kinds = |xs: &[f64]| {
            let tips: Vec<Option<Pixel>> =
                xs.iter().map(|&x| Some(Pixel::new(x, 30.0))).chain([None]).collect();
            let counts = TrackCounts { frames: tips.len(), measured: xs.len(), ..TrackCounts::default() };
            let evidence = Evidence {
                plant: &plant,
                counts: &counts,
                feet: &[],
                is_scale_assumed: false,
                is_unrelated: false,
                times: &[],
                never_moves: false,
                tips: &tips,
                up: Direction::Up,
            };
            evidence
                .warnings()
                .into_iter()
                .map(|TrackWarning { kind, advice }| (kind, advice))
                .collect::<Vec<_>>()
        };
        assert_eq!(kinds(&[100.0; 19]), []);
        let mut tips = [100.0; 19];
        tips[8] = 190.0;
        assert_eq!(kinds(&tips), [], "once in twenty photographs is an error");
        tips[9] = 190.0;
        let [(WarningKind::SeveralPlants, advice)] = &kinds(&tips)[..] else { panic!("{:?}", kinds(&tips)) };
        assert!(advice.contains("at 70,20,60,80, and now at 140,20,60,80"), "{advice}");
    }
}
