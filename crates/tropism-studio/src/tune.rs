//! Tune vision: what other settings see in photographs of a run or a folder.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Point, Region};
use tropism::vision::{Calibration, FrameStatus, Mode, TipTracker, TrackedFrame, VisionConfig};
use tropism_lab::RunConfig;
use tropism_lab::files::{self, shell_word};

use crate::error::Refusal;
use crate::{Studio, draw, found};

/// Photographs that are looked at.
const SAMPLES: usize = 12;

/// Below this confidence a tip is uncertain, as is one that may be hidden; chosen by hand.
const DOUBTFUL: f64 = 0.5;

/// The settings that the page changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TuneSettings {
    mode: Mode,
    /// Column, row, columns and rows; the whole picture if it is left out.
    roi: Option<[usize; 4]>,
    /// Pixel at which the stem leaves the soil.
    base: [f64; 2],
    px_per_cm: f64,
    contrast: f64,
    threshold: f64,
}

/// What a page asks for.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TuneRequest {
    pub(crate) at: String,
    pub(crate) settings: TuneSettings,
    /// Names of the photographs to look at; taken evenly from all by default.
    #[serde(default)]
    photographs: Vec<String>,
    /// Name of the file that is written, without its ending.
    #[serde(default)]
    pub(crate) name: String,
}

/// Photographs, the settings of vision that they have, and what these see in some of them.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct TuneBegin {
    settings: TuneSettings,
    /// Columns of a photograph.
    width: usize,
    /// Rows of a photograph.
    height: usize,
    /// How many photographs there are.
    photographs: usize,
    is_virtual: bool,
    seen: Vec<SeenPhoto>,
}

/// What other settings see in the same photographs.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct TuneLook {
    seen: Vec<SeenPhoto>,
    text: TuneText,
}

/// What settings see in a photograph.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct SeenPhoto {
    /// Its name.
    photo: String,
    state: SeenState,
    status: FrameStatus,
    /// 0 to 1.
    confidence: f64,
    /// The tip, in pixels.
    tip: Option<[f64; 2]>,
    /// The tip, in cm.
    cm: Option<[f64; 2]>,
    /// Points of the stem, in pixels.
    stem: Option<Vec<[f64; 2]>>,
}

/// Whether a plant is seen in a photograph.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
enum SeenState {
    Missed,
    Uncertain,
    Found,
}

/// Settings as the text of a file, and the command that tracks with them.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct TuneText {
    toml: String,
    command: String,
}

/// The file that settings were written into.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct TuneFile {
    file: String,
    text: TuneText,
}

/// Photographs of a run or a folder, with their settings.
struct Source {
    photographs: Vec<PathBuf>,
    calibration: Calibration,
    vision: VisionConfig,
    is_virtual: bool,
    /// The folder of the photographs, below that of the studio.
    folder: String,
}

fn source(root: &Path, at: &str) -> Result<Source, Refusal> {
    let path = found::resolve(root, at)?;
    let below = |name: &str| if at.is_empty() { name.to_owned() } else { format!("{at}/{name}") };
    if found::Kind::of(&path) == Some(found::Kind::Run) {
        let config = RunConfig::follow(&path)?;
        let calibration = config
            .calibration()
            .ok_or_else(|| Refusal::bad(format!("{at}: found a run without a calibration")))?;
        let crop = config.rig.vision.crop.or_else(|| config.rig.greenhouse.as_ref().map(|tent| tent.crop()));
        let vision = VisionConfig { crop, ..config.rig.vision.clone() };
        let photographs = files::photographs(&[path.join("photographs")])?;
        return Ok(Source {
            photographs,
            calibration,
            vision,
            is_virtual: config.is_virtual(),
            folder: below("photographs"),
        });
    }
    let photographs = files::photographs(std::slice::from_ref(&path))?;
    let first = photographs.first().ok_or_else(|| Refusal::missing(format!("{at}: found no photographs")))?;
    let image = files::read_photo(first, 0.0)?.decode().map_err(|error| Refusal::bad(error.to_string()))?;
    let base = Pixel::new(image.width as f64 / 2.0, 0.9 * image.height as f64);
    let calibration = Calibration::from_scale(base, image.width as f64 / 60.0, image.width, image.height);
    Ok(Source {
        photographs,
        calibration,
        vision: VisionConfig::default(),
        is_virtual: false,
        folder: at.to_owned(),
    })
}

impl Source {
    /// The photographs of these names, or some taken evenly.
    fn sample(&self, names: &[String]) -> Vec<&PathBuf> {
        let is_named = |path: &&PathBuf| {
            names.iter().any(|name| path.file_name().is_some_and(|own| own == name.as_str()))
        };
        if !names.is_empty() {
            return self.photographs.iter().filter(is_named).take(SAMPLES).collect();
        }
        let count = self.photographs.len();
        let wanted = SAMPLES.min(count);
        (0..wanted).map(|place| &self.photographs[place * (count - 1) / (wanted - 1).max(1)]).collect()
    }

    fn settings(&self) -> TuneSettings {
        let VisionConfig { mode, contrast, threshold, crop, .. } = self.vision;
        TuneSettings {
            mode,
            roi: crop.map(|crop| [crop.x, crop.y, crop.width, crop.height]),
            base: [self.calibration.base.x, self.calibration.base.y],
            px_per_cm: self.calibration.px_per_cm,
            contrast,
            threshold,
        }
    }

    fn with(&self, settings: &TuneSettings) -> (Calibration, VisionConfig) {
        let TuneSettings { mode, roi, base, px_per_cm, contrast, threshold } = *settings;
        let crop = roi.map(|[x, y, width, height]| Region { x, y, width, height });
        let calibration = Calibration { base: Pixel::new(base[0], base[1]), px_per_cm, ..self.calibration };
        (calibration, VisionConfig { mode, crop, contrast, threshold, ..self.vision.clone() })
    }
}

/// The settings of the photographs that lie `at`, and what they see.
pub(crate) fn begin(root: &Path, at: &str) -> Result<TuneBegin, Refusal> {
    let source = source(root, at)?;
    let settings = source.settings();
    Ok(TuneBegin {
        seen: seen(&source, &settings, &[])?,
        settings,
        width: source.calibration.width,
        height: source.calibration.height,
        photographs: source.photographs.len(),
        is_virtual: source.is_virtual,
    })
}

/// What other settings see in the same photographs.
pub(crate) fn look(root: &Path, request: &TuneRequest) -> Result<TuneLook, Refusal> {
    let source = source(root, &request.at)?;
    let seen = seen(&source, &request.settings, &request.photographs)?;
    Ok(TuneLook { seen, text: text(&source, &request.settings)? })
}

fn seen(source: &Source, settings: &TuneSettings, names: &[String]) -> Result<Vec<SeenPhoto>, Refusal> {
    let (calibration, vision) = source.with(settings);
    let tracker = TipTracker::new(calibration, vision).map_err(|error| Refusal::bad(error.to_string()))?;
    let one = |path: &&PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let photo = files::read_photo(path, 0.0)?;
        // Each by itself, so that one photograph does not hide what the settings do to another.
        let mut alone = tracker.clone().for_unrelated();
        let picture = photo.open();
        let detection = alone.detect(picture.as_ref());
        let pixels = detection.as_ref().ok().map(|seen| (seen.tip, seen.stem.clone()));
        let may_be_hidden =
            detection.as_ref().is_ok_and(|seen| seen.is_occluded || seen.clipped_at.is_some());
        let frame = alone.update_next(detection);
        let is_found = frame.is_measured();
        let pair = |pixel: &Pixel| [(10.0 * pixel.x).round() / 10.0, (10.0 * pixel.y).round() / 10.0];
        let tip = pixels.as_ref().map(|(tip, _)| pair(tip));
        let cm = pixels.as_ref().map(|(tip, _)| <[f64; 2]>::from(calibration.point(*tip)));
        let stem = pixels.as_ref().and_then(|(_, stem)| stem.as_ref()).map(|stem| {
            let every = stem.len().div_ceil(20).max(1);
            stem.iter().step_by(every).map(pair).collect::<Vec<_>>()
        });
        let state = if !is_found {
            SeenState::Missed
        } else if may_be_hidden || frame.confidence < DOUBTFUL {
            SeenState::Uncertain
        } else {
            SeenState::Found
        };
        let TrackedFrame { status, confidence, .. } = frame;
        Ok(SeenPhoto { photo: name, state, status, confidence, tip, cm, stem })
    };
    // One core stays free for other requests.
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let pool = rayon::ThreadPoolBuilder::new().num_threads((cores - 1).max(1)).build();
    let pool = pool.map_err(|error| Refusal::bad(error.to_string()))?;
    pool.install(|| source.sample(names).par_iter().map(one).collect())
}

/// The text of the file of the settings, and the command that tracks with them.
fn text(source: &Source, settings: &TuneSettings) -> Result<TuneText, Refusal> {
    #[derive(Serialize)]
    struct Rig<'a> {
        calibration: &'a Calibration,
        vision: &'a VisionConfig,
    }
    let (calibration, vision) = source.with(settings);
    let toml = toml::to_string(&Rig { calibration: &calibration, vision: &vision });
    let roi = settings
        .roi
        .map_or_else(String::new, |[x, y, width, height]| format!(" --roi {x},{y},{width},{height}"));
    let Point { x, y } = Point::from(settings.base);
    let photographs = shell_word(Path::new(&source.folder));
    let command = format!(
        "tropism track {photographs}{roi} --scale {} --base {x},{y} --out track.csv",
        settings.px_per_cm
    );
    Ok(TuneText { toml: toml.map_err(|error| Refusal::bad(error.to_string()))?, command })
}

/// Writes the settings into a new file in the folder of the studio.
pub(crate) fn write(studio: &Studio, request: &TuneRequest) -> Result<TuneFile, Refusal> {
    draw::check_name(&request.name)?;
    let source = source(&studio.root, &request.at)?;
    let text = text(&source, &request.settings)?;
    let file = format!("{}.toml", request.name);
    let path = studio.root.join(&file);
    if path.exists() {
        return Err(Refusal::bad(format!("{file}: a file of this name is here already: choose a new name")));
    }
    files::write(&path, text.toml.as_bytes())?;
    Ok(TuneFile { file, text })
}
