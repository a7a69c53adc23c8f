//! Models that are made of measured plants and kept in files, and why there may be none.

use super::config::TipModelConfig;
use crate::check::OutOfRange;
use crate::geometry::Point;
use crate::lamps::Layout;
use crate::track::{PAPER_PERIOD_MIN, SAME_PERIOD, Sample, Track};

/// Distance within which data count as around a place, in cm: half the height of the paper's window, eq. (1).
const NEAR_CM: f64 = 1.0;

/// A model that is made of measured plants: what it says of its data. How its plants move is a
/// [`PlantModel`](super::PlantModel).
pub trait FittedModel: Send + Sync {
    /// A model of tracks. `config` is for the tip-motion model; the others have no settings.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable, where the tracks differ in lamps or period, or where they lack what the kind needs.
    fn of_tracks(tracks: &[&Track], config: &TipModelConfig) -> Result<Self, ModelError>
    where
        Self: Sized;

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    fn from_json(text: &str) -> Result<Self, ModelError>
    where
        Self: Sized;

    /// Readable JSON with all data; see `docs/reference/models.md`.
    fn to_json(&self) -> String;

    /// The same model, labelled as made of virtual plants or not. Results of evolution carry the label.
    #[must_use]
    fn of_virtual_plants(self, is_virtual: bool) -> Self
    where
        Self: Sized;

    /// Whether it was made of virtual plants.
    fn is_virtual(&self) -> bool;

    /// One model for each plant, made of its steps alone. Plants without a usable step are left out. Of more than `most`
    /// plants, as many as that are taken, evenly in their order.
    ///
    /// The fitness of a controller on these models estimates its fitness on unseen plants.
    ///
    /// # Errors
    /// None that [`Self::of_tracks`] would not have given for the same data.
    fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError>
    where
        Self: Sized;

    /// How many measured steps it is made of, without their mirror images.
    fn steps(&self) -> usize;

    /// The measured tips, as the front camera sees them, in cm.
    fn tips(&self) -> Vec<Point>;

    /// Distance from a place in the plane of the front camera to the nearest data or an image of them, in cm.
    fn gap_cm(&self, place: Point) -> f64 {
        let nearest =
            |least: f64, tip: &Point| least.min(tip.distance(place)).min(tip.mirrored().distance(place));
        self.tips().iter().fold(f64::INFINITY, nearest)
    }

    /// Whether there are data around a place.
    fn has_data(&self, place: Point) -> bool {
        self.gap_cm(place) <= NEAR_CM
    }

    /// How simulated plants move where there are no data, for a note to the user.
    fn without_data(&self) -> &'static str {
        "simulated plants move there as at the nearest data"
    }

    /// The share of the lit steps of a track, 0 to 1, that begin where there are no data.
    fn share_without_data(&self, samples: &[Sample]) -> f64;
}

/// Why there is no model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A setting out of its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// Tracks without a single usable step.
    #[error(
        "no step of {tracks} tracks can be used: it takes successive measured tips with a lit lamp between them"
    )]
    NoShifts {
        /// How many tracks were read.
        tracks: usize,
    },
    /// A track without stems.
    #[error("track {track} has no stems, as those of `tropism track` and `tropism grow` have")]
    NoStem {
        /// Position of the track, from 1.
        track: usize,
    },
    /// A track without stems in space.
    #[error("track {track} has no stems in space, as those of `tropism grow --cameras 2 --lamps 4` have")]
    NoDepth {
        /// Position of the track, from 1.
        track: usize,
    },
    /// Tracks of different intervals: a shift of one is no shift of the other.
    #[error("track {track}: found {found} minutes between steps, wanted {wanted} as in the first track")]
    Period {
        /// Position of the track, from 1.
        track: usize,
        /// Its period, in minutes.
        found: f64,
        /// The period of the first track, in minutes.
        wanted: f64,
    },
    /// Steps that are too long for a model of the stem.
    #[error(
        "found {found} minutes between steps, wanted at most {most} for a model of the stem: it tells the last five minutes of \
         light from those before"
    )]
    Slow {
        /// Minutes between steps.
        found: f64,
        /// The most that the model can take.
        most: f64,
    },
    /// Tracks under different lamps.
    #[error("track {track}: found lamps {found}, wanted {wanted} as in another track")]
    Lamps {
        /// Position of the track, from 1.
        track: usize,
        /// The names of its lamps.
        found: String,
        /// The names of the other track's lamps.
        wanted: String,
    },
    /// A value in the file that cannot be one.
    #[error("shift {index}: found {found}, wanted finite numbers below 1000 cm in size")]
    Shift {
        /// Position in the file, from 0.
        index: usize,
        /// What stands there.
        found: String,
    },
    /// The lists of the file differ in length.
    #[error("found {found} lists of different lengths, wanted one entry a step in each")]
    Lengths {
        /// Their lengths.
        found: String,
    },
    /// The plants' shares do not make up the whole.
    #[error("found {found}, wanted plants to add up to the shifts")]
    Plants {
        /// The shares and the whole.
        found: String,
    },
    /// A schema that this version does not know.
    #[error("found schema {found:?}, wanted {wanted:?}")]
    Schema {
        /// The schema of the file.
        found: String,
        /// The one that this version writes.
        wanted: &'static str,
    },
    /// A model of the stem in the plane, where one in space is wanted, or the other way round.
    #[error("found a model of {found} axes, wanted {wanted}: 1 in the plane of the front camera, 2 in space")]
    Axes {
        /// The number of axes in the file.
        found: usize,
        /// The number that is wanted.
        wanted: usize,
    },
    /// Lamps that are not two mirror images.
    #[error(
        "found lamps {found}, wanted two at mirrored places, one on each side of the plant: a model of the stem knows a lamp \
         by its side"
    )]
    Sides {
        /// The names of the lamps.
        found: String,
    },
    /// Not JSON of a model.
    #[error("found no model: {0}")]
    Json(#[from] serde_json::Error),
}

/// The lamps and the period, in minutes, that all of `tracks` have.
///
/// # Errors
/// [`ModelError::Period`] or [`ModelError::Lamps`] where they differ.
pub(super) fn shared_layout_and_period(tracks: &[&Track]) -> Result<(Layout, f64), ModelError> {
    let layouts = tracks.iter().map(|track| &track.layout);
    let layout = layouts.max_by_key(|layout| layout.len()).cloned().unwrap_or_default();
    let period_min = tracks.first().map_or(PAPER_PERIOD_MIN, |track| track.period_min);
    for (index, track) in tracks.iter().enumerate() {
        if (track.period_min - period_min).abs() > SAME_PERIOD * period_min {
            let (found, wanted) = (track.period_min, period_min);
            return Err(ModelError::Period { track: index + 1, found, wanted });
        }
        if !layout.lamps().starts_with(track.layout.lamps()) {
            let names = |layout: &Layout| {
                layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect::<Vec<_>>().join(", ")
            };
            let (found, wanted) = (names(&track.layout), names(&layout));
            return Err(ModelError::Lamps { track: index + 1, found, wanted });
        }
    }
    Ok((layout, period_min))
}
