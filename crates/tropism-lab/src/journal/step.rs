//! A recorded step, and the columns of the table `steps` that hold it.

use rusqlite::types::Value;
use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Point, Polyline};
use tropism::lamps::{self, Light};
use tropism::lighting::Lighting;
use tropism::observation::{Observation, Quality};
use tropism::programme::Acting;
use tropism::rig::Moment;
use tropism::vision::{FrameStatus, TrackedFrame};

use super::{JournalError, moment};
use crate::files::is_plain_name;

/// What a second camera at the side saw at a step.
#[derive(Clone, Debug, PartialEq)]
pub struct SideRecord {
    /// Size of its photograph, in bytes; 0 if the camera gave none.
    pub photo_bytes: u64,
    /// SHA-256 of its photograph, in hexadecimal.
    pub photo_sha256: String,
    /// What the tip tracker made of its photograph.
    pub seen: TrackedFrame,
    /// Tip and stem in space, from both cameras.
    pub observation: Observation,
}

/// What the programme of a rig made of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgrammeRecord {
    /// What acted.
    pub acting: Acting,
    /// The lighting that the lamps were commanded: the decision and the base light as they [act](Acting::lighting), or dark
    /// where the cap of light or a fault wanted it.
    pub commanded: Lighting,
}

/// A step as it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct StepRecord {
    /// Step, from 0. A missed step has no record.
    pub step: u32,
    /// Seconds since the start at which the step was due.
    pub time_s: f64,
    /// File name of the photograph in `photographs/`.
    pub photo: String,
    /// Size of the photograph, in bytes; 0 if the camera gave none.
    pub photo_bytes: u64,
    /// SHA-256 of the photograph, in hexadecimal.
    pub photo_sha256: String,
    /// What the tip tracker made of the photograph.
    pub seen: TrackedFrame,
    /// What a second camera saw at the side; `None` without one.
    pub side: Option<Box<SideRecord>>,
    /// The lighting that was decided; `None` before the decision, at the last step, and where the plant was not detected for
    /// so long that nothing was decided.
    pub decided: Option<Lighting>,
    /// What the programme of the rig made of it; `None` without one, and before the decision.
    pub programme: Option<ProgrammeRecord>,
    /// Whether the lamps confirmed what they were commanded.
    pub is_confirmed: bool,
    /// When the step began; `None` in the virtual tent.
    pub begun: Option<Moment>,
    /// The light that the photograph shows, `Some(None)` if no lamp or both; `None` if it was not looked for, as under several
    /// lamps or levels.
    pub lit: Option<Option<Light>>,
}

/// Columns that a photograph and its detection fill, in the order of [`StepRecord::values`].
macro_rules! columns {
    () => {
        "step, time_s, photo, photo_bytes, photo_sha256, tip_x_cm, tip_y_cm, tip_x_px, tip_y_px, quality, class, \
         confidence, begun_s, unix_s, lit, moved_x_px, moved_y_px, stem, side"
    };
}
pub(super) use columns;

/// The lighting that acted from each step to the next: the commanded one, or darkness where the lamps never confirmed it or the
/// photograph of the next step shows another light.
pub(crate) fn lights_that_acted(steps: &[StepRecord]) -> Vec<Lighting> {
    let is_contradicted = |index: usize, lighting: Lighting| {
        let next = steps.get(index + 1).filter(|next| next.step == steps[index].step + 1);
        next.and_then(|next| next.lit).is_some_and(|lit| Lighting::from(lit) != lighting)
    };
    let acted = |(index, step): (usize, &StepRecord)| {
        let acted =
            step.commanded().filter(|&lighting| step.is_confirmed && !is_contradicted(index, lighting));
        acted.unwrap_or(Lighting::DARK)
    };
    steps.iter().enumerate().map(acted).collect()
}

impl StepRecord {
    /// What the loop saw: tip and stem in space with two cameras, else those of the one; `None` where the plant was never seen.
    #[must_use]
    pub fn observation(&self) -> Option<&Observation> {
        self.side.as_deref().map(|side| &side.observation).or(self.seen.observation.as_ref())
    }

    /// The lighting that the lamps were commanded: what was decided, or what a programme made of it.
    #[must_use]
    pub fn commanded(&self) -> Option<Lighting> {
        self.programme.map(|programme| programme.commanded).or(self.decided)
    }

    /// Values of the `columns!` that a photograph and its detection fill.
    pub(super) fn values(&self) -> [Value; 19] {
        let text = |text: &str| Value::from(text.to_owned());
        let (seen, observation) = (&self.seen, self.seen.observation.as_ref());
        [
            self.step.into(),
            self.time_s.into(),
            text(&self.photo),
            (self.photo_bytes as i64).into(),
            text(&self.photo_sha256),
            observation.map(|seen| seen.tip.x).into(),
            observation.map(|seen| seen.tip.y).into(),
            seen.tip_px.map(|pixel| pixel.x).into(),
            seen.tip_px.map(|pixel| pixel.y).into(),
            observation.map(|seen| seen.quality.name().to_owned()).into(),
            text(seen.status.name()),
            seen.confidence.into(),
            self.begun.map(|begun| begun.since_start.as_secs_f64()).into(),
            self.begun.map(|begun| begun.unix_s).into(),
            self.lit.map(|lit| lamps::name(lit).to_owned()).into(),
            seen.camera_shift.map(|shift| shift.x).into(),
            seen.camera_shift.map(|shift| shift.y).into(),
            observation.and_then(|seen| seen.stem.as_ref()).map(stem_text).into(),
            self.side.as_deref().map(side_text).into(),
        ]
    }

    /// Reads a row of the `columns!`, `decided`, `done` and what a programme fills.
    pub(super) fn read(row: &rusqlite::Row<'_>) -> Result<Self, JournalError> {
        let (step, photo): (u32, String) = (row.get(0)?, row.get(2)?);
        if !is_plain_name(&photo) {
            let wanted = "the plain name of a file";
            return Err(JournalError::Value { step, column: "photo", found: photo, wanted });
        }
        Ok(Self {
            step,
            time_s: row.get(1)?,
            photo,
            photo_bytes: row.get::<_, i64>(3)? as u64,
            photo_sha256: row.get(4)?,
            seen: read_seen(step, row)?,
            side: row.get::<_, Option<String>>(18)?.map(|text| parse_side(step, text)).transpose()?,
            decided: read_lighting(step, "decided", row.get(19)?)?,
            programme: read_programme(step, row)?,
            is_confirmed: row.get(20)?,
            begun: moment(row.get(12)?, row.get(13)?),
            lit: read_light(step, "lit", row.get(14)?)?,
        })
    }
}

fn read_seen(step: u32, row: &rusqlite::Row<'_>) -> Result<TrackedFrame, JournalError> {
    let pair = |x, y| -> Result<Option<[f64; 2]>, rusqlite::Error> {
        Ok(row.get::<_, Option<f64>>(x)?.zip(row.get::<_, Option<f64>>(y)?).map(|(x, y)| [x, y]))
    };
    let quality: Option<String> = row.get(9)?;
    let quality: Option<Quality> = quality
        .map(|word| parse(step, "quality", word, "measured, carried_forward or simulated"))
        .transpose()?;
    let status: FrameStatus = parse(step, "class", row.get(10)?, "a class of photograph")?;
    let stem: Option<String> = row.get(17)?;
    let stem = stem.map(|text| parse_stem(step, text)).transpose()?;
    let observation = pair(5, 6)?.zip(quality).map(|(tip, quality)| Observation {
        tip: Point::from(tip),
        stem,
        depth: None,
        quality,
    });
    let pixel = |[x, y]: [f64; 2]| Pixel::new(x, y);
    Ok(TrackedFrame {
        observation,
        tip_px: pair(7, 8)?.map(pixel),
        status,
        confidence: row.get(11)?,
        camera_shift: pair(15, 16)?.map(pixel),
    })
}

fn parse<T: std::str::FromStr>(
    step: u32,
    column: &'static str,
    word: String,
    wanted: &'static str,
) -> Result<T, JournalError> {
    word.parse().map_err(|_| JournalError::Value { step, column, found: word, wanted })
}

/// The light of its [standard name](lamps::name); `None` for a column without a value.
fn read_light(
    step: u32,
    column: &'static str,
    word: Option<String>,
) -> Result<Option<Option<Light>>, JournalError> {
    let Some(word) = word else { return Ok(None) };
    let error = |_| JournalError::Value { step, column, found: word.clone(), wanted: "left, right or dark" };
    lamps::parse(&word).map(Some).map_err(error)
}

/// A lighting, with the standard names of its lamps; `None` for a column without a value.
fn read_lighting(
    step: u32,
    column: &'static str,
    word: Option<String>,
) -> Result<Option<Lighting>, JournalError> {
    word.map(|word| parse(step, column, word, "left, right, dark, or levels such as left:128+right"))
        .transpose()
}

fn read_programme(step: u32, row: &rusqlite::Row<'_>) -> Result<Option<ProgrammeRecord>, JournalError> {
    let Some(part) = row.get(21)? else { return Ok(None) };
    let base = read_lighting(step, "base", row.get(23)?)?.unwrap_or_default();
    let acting = Acting { part, is_steered: row.get(22)?, base };
    let commanded = read_lighting(step, "commanded", row.get(24)?)?.unwrap_or_default();
    Ok(Some(ProgrammeRecord { acting, commanded }))
}

/// The points of a stem as JSON, `[[x, y], ...]` in cm; exact to the bit.
fn stem_text(stem: &Polyline) -> String {
    serde_json::to_string(stem).expect("numbers are always written")
}

/// The stem of [`stem_text`].
fn parse_stem(step: u32, text: String) -> Result<Polyline, JournalError> {
    serde_json::from_str(&text).map_err(|_| {
        let wanted = "[[x, y], ...] in cm";
        JournalError::Value { step, column: "stem", found: text, wanted }
    })
}

/// What a camera at the side saw, as JSON; exact to the bit.
#[derive(Serialize, Deserialize)]
struct SideText {
    bytes: u64,
    sha256: String,
    /// The plant as the camera at the side sees it.
    plant: Option<Observation>,
    tip_px: Option<[f64; 2]>,
    class: String,
    confidence: f64,
    moved_px: Option<[f64; 2]>,
    /// The plant in space.
    space: Observation,
}

fn side_text(side: &SideRecord) -> String {
    let pair = |pixel: Pixel| [pixel.x, pixel.y];
    let text = SideText {
        bytes: side.photo_bytes,
        sha256: side.photo_sha256.clone(),
        plant: side.seen.observation.clone(),
        tip_px: side.seen.tip_px.map(pair),
        class: side.seen.status.name().to_owned(),
        confidence: side.seen.confidence,
        moved_px: side.seen.camera_shift.map(pair),
        space: side.observation.clone(),
    };
    serde_json::to_string(&text).expect("numbers are always written")
}

/// What [`side_text`] wrote.
fn parse_side(step: u32, text: String) -> Result<Box<SideRecord>, JournalError> {
    let found = match serde_json::from_str::<SideText>(&text) {
        Ok(found) => found,
        Err(_) => {
            let wanted = "what a camera at the side saw, as JSON";
            return Err(JournalError::Value { step, column: "side", found: text, wanted });
        }
    };
    let pixel = |[x, y]: [f64; 2]| Pixel::new(x, y);
    let seen = TrackedFrame {
        observation: found.plant,
        tip_px: found.tip_px.map(pixel),
        status: parse(step, "side", found.class, "a class of photograph")?,
        confidence: found.confidence,
        camera_shift: found.moved_px.map(pixel),
    };
    Ok(Box::new(SideRecord {
        photo_bytes: found.bytes,
        photo_sha256: found.sha256,
        seen,
        observation: found.space,
    }))
}

#[cfg(test)]
mod tests {
    use tropism::observation::Depth;

    use super::*;

    #[test]
    fn a_stem_comes_back_to_the_bit() {
        let stem = Polyline((1..=10).map(|point| Point::new(1.0 / f64::from(point), 1e-7 + 0.1)).collect());
        assert_eq!(parse_stem(3, stem_text(&stem)).unwrap(), stem);
        let depth = Depth { tip_cm: 1.0 / 3.0, stem_cm: vec![0.1, 1e-9] };
        let plant = Observation {
            tip: stem.0[3],
            stem: Some(stem),
            depth: Some(depth),
            quality: Quality::CarriedForward,
        };
        let side = SideRecord {
            photo_bytes: 7,
            photo_sha256: "ab".to_owned(),
            seen: TrackedFrame {
                observation: Some(Observation { depth: None, ..plant.clone() }),
                tip_px: Some(Pixel::new(0.1, 2.0 / 3.0)),
                status: FrameStatus::Dark,
                confidence: 0.7,
                camera_shift: None,
            },
            observation: plant,
        };
        assert_eq!(*parse_side(3, side_text(&side)).unwrap(), side);
        let error = parse_side(3, "{}".to_owned()).unwrap_err().to_string();
        assert!(error.starts_with("step 3: found side \"{}\""), "{error}");
        let error = parse_stem(3, "[[1]".to_owned()).unwrap_err().to_string();
        assert_eq!(error, "step 3: found stem \"[[1]\", wanted [[x, y], ...] in cm");
    }
}
