//! `tropism track`: photographs into a track.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use tropism::experiment::files;
use tropism::geometry::{Pixel, Region};
use tropism::light::{self, Light};
use tropism::observation::Quality;
use tropism::photo::Image;
use tropism::track::{Column, Sample, Track as TipTrack};
use tropism::vision::overlay::{Marks, overlay};
use tropism::vision::{Calibration, Class, Eye, Mode, Seen, Sighting, VisionConfig, lit};

use crate::options::{parse_minutes, parse_pair, parse_region};
use crate::shell::{Interrupted, Shell};

/// Find the tip in photographs: ours, or anybody's folder of them
///
/// Photographs are taken in the order of the numbers in their names. One in which no plant is seen holds the last
/// sighting and says so (`quality` is `held`, `class` tells why); a bad file never ends the batch.
///
/// Without --calibration or --scale, centimetres assume the paper's camera, whose picture is 74 cm wide at the plant.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism track tent/1/photographs --calibration tent/1/calibration.toml --out track.csv\n  \
    tropism track my-photos --roi 250,150,200,185 --scale 11 --base 364,336 --out track.csv --overlay look")]
pub(crate) struct Track {
    /// Photographs (JPEG or PNG), or folders of them
    #[arg(required = true, value_name = "PHOTOS")]
    photographs: Vec<PathBuf>,

    /// Where the track goes
    #[arg(long, value_name = "track.csv")]
    out: PathBuf,

    /// Where the root is and how many pixels make a cm (base, px_per_cm, width, height)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scale", "base"])]
    calibration: Option<PathBuf>,

    /// Pixels per cm in the plane of the stem
    #[arg(long, value_name = "PX_PER_CM")]
    scale: Option<f64>,

    /// Pixel where the stem leaves the soil; the middle of the region's lower edge by default
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    base: Option<Pair>,

    /// Region of interest: the plant without pot and lamps; the whole picture by default
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    roi: Option<Region>,

    /// Which lamp is lit: read from the pictures, or from a CSV with the columns frame and light
    #[arg(long, value_name = "auto|FILE.csv", default_value = "auto")]
    light: PathBuf,

    /// Time between photographs
    #[arg(long, value_name = "TIME", value_parser = parse_minutes, default_value = "5m")]
    period: f64,

    /// The robust method, or the paper's to the letter
    #[arg(long, value_name = "robust|paper", default_value = "robust", value_parser = parse_mode)]
    mode: Mode,

    /// Folder for a copy of each photograph with the tip drawn in
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
}

type Pair = [f64; 2];

fn parse_mode(text: &str) -> Result<Mode, String> {
    match text {
        "robust" => Ok(Mode::Robust),
        "paper" => Ok(Mode::Paper),
        _ => Err("wanted robust or paper".to_owned()),
    }
}

/// Photographs that are decoded at a time, so that a folder of any size needs the same memory.
const BATCH: usize = 32;

/// Width of the paper's camera's picture in the plane of the stem, in cm; see `tropism::greenhouse::view`.
const PAPER_WIDTH_CM: f64 = tropism::greenhouse::view::Frame::WIDTH_CM;

#[derive(Serialize)]
struct Outcome {
    track: PathBuf,
    frames: usize,
    measured: usize,
    held: usize,
    classes: BTreeMap<&'static str, usize>,
    longest_gap: usize,
    lights: BTreeMap<&'static str, usize>,
    calibration: Calibration,
    calibration_is_assumed: bool,
}

/// One photograph, judged by itself.
struct Judged {
    name: String,
    sighting: Result<Sighting, Class>,
    light: Option<Light>,
    image: Option<Arc<Image>>,
}

impl Track {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let paths = files::photographs(&self.photographs)?;
        let config = VisionConfig { mode: self.mode, crop: self.roi, ..VisionConfig::default() };
        let (calibration, is_assumed) = self.calibration(&paths)?;
        config
            .check(calibration.width, calibration.height)
            .map_err(|error| anyhow::anyhow!("--roi: {error}"))?;
        if is_assumed {
            shell.note(&format!(
                "no --calibration or --scale: assuming a picture {PAPER_WIDTH_CM} cm wide at the plant ({:.2} px/cm)",
                calibration.px_per_cm
            ));
        }
        let lights = self.lights(&paths)?;
        if let Some(folder) = &self.overlay {
            files::make_folder(folder)?;
        }
        let mut eye = Eye::new(calibration, config)?;
        let progress = shell.progress("track", paths.len() as u64);
        let mut frames: Vec<(String, Seen, Option<Light>)> = Vec::new();
        for start in (0..paths.len()).step_by(BATCH) {
            let batch = start..(start + BATCH).min(paths.len());
            for (index, judged) in batch.clone().zip(self.judge(&eye, &paths, batch)?) {
                let seen = eye.settle(judged.sighting.clone());
                let light = lights.as_ref().map_or(judged.light, |lights| lights[index]);
                if let (Some(folder), Some(image)) = (&self.overlay, &judged.image) {
                    self.draw(folder, image, &judged, &seen, light, eye.calibration())?;
                }
                frames.push((judged.name, seen, light));
            }
            progress.add((frames.len() - start) as u64);
            if Shell::is_interrupted() {
                return Err(Interrupted("no track was written".to_owned()).into());
            }
        }
        drop(progress);
        let (track, outcome) = self.summarise(frames, calibration, is_assumed)?;
        files::write_track(&self.out, &track)?;
        self.tell(shell, &outcome)
    }

    fn judge(&self, eye: &Eye, paths: &[PathBuf], batch: Range<usize>) -> Result<Vec<Judged>> {
        let wants_image = self.overlay.is_some();
        paths[batch]
            .par_iter()
            .map(|path| {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                // A file that cannot be read is a damaged photograph, not the end of the batch.
                let Ok(photo) = files::read_photo(path, 0.0) else {
                    return Ok(Judged { name, sighting: Err(Class::Corrupt), light: None, image: None });
                };
                let picture = photo.decode();
                let sighting = eye.judge(picture.as_ref());
                let light = picture.as_ref().ok().and_then(|image| lit(image, None));
                let image = picture.ok().filter(|_| wants_image).map(Arc::new);
                Ok(Judged { name, sighting, light, image })
            })
            .collect()
    }

    fn draw(
        &self,
        folder: &Path,
        image: &Image,
        judged: &Judged,
        seen: &Seen,
        light: Option<Light>,
        calibration: &Calibration,
    ) -> Result<()> {
        let held = seen.observation.as_ref().filter(|_| seen.pixel.is_none());
        let marks = Marks {
            sighting: judged.sighting.as_ref().ok(),
            held: held.map(|observation| calibration.pixel(observation.tip)),
            crop: self.roi,
            base: Some(calibration.base),
            light,
        };
        let name = Path::new(&judged.name).with_extension("jpg");
        let jpeg = overlay(image, &marks).to_jpeg(85)?;
        Ok(files::write(&folder.join(name), &jpeg)?)
    }

    /// The calibration that was asked for, or the paper's camera, and whether it is assumed.
    fn calibration(&self, paths: &[PathBuf]) -> Result<(Calibration, bool)> {
        if let Some(path) = &self.calibration {
            let calibration: Calibration = files::read_toml(path)?;
            calibration.check().with_context(|| path.display().to_string())?;
            return Ok((calibration, false));
        }
        let first = paths.iter().find_map(|path| files::read_photo(path, 0.0).ok()?.decode().ok());
        let Some(first) = first else {
            let problem = files::read_photo(&paths[0], 0.0)?.decode().err();
            let problem = problem.map_or_else(String::new, |error| format!(": {error}"));
            bail!("{}{problem}; none of {} files is a whole photograph", paths[0].display(), paths.len());
        };
        let (width, height) = (first.width, first.height);
        let region = self.roi.unwrap_or(Region { x: 0, y: 0, width, height });
        let middle = Pixel::new(
            region.x as f64 + (region.width as f64 - 1.0) / 2.0,
            region.y as f64 + region.height as f64 - 1.0,
        );
        let base = self.base.map_or(middle, |[x, y]| Pixel::new(x, y));
        let px_per_cm = self.scale.unwrap_or(width as f64 / PAPER_WIDTH_CM);
        let calibration = Calibration { base, px_per_cm, width, height };
        calibration.check().context("--scale")?;
        Ok((calibration, self.scale.is_none()))
    }

    /// The lights of a file, one a photograph; `None` if they are to be read from the pictures.
    fn lights(&self, paths: &[PathBuf]) -> Result<Option<Vec<Option<Light>>>> {
        if self.light == Path::new("auto") {
            return Ok(None);
        }
        let file = self.light.display();
        let text = files::read_text(&self.light)?;
        let mut lines = text.lines();
        let header = lines.next().unwrap_or_default().trim();
        ensure!(header == "frame,light", "{file}: found the header {header:?}, wanted \"frame,light\"");
        let mut named = BTreeMap::new();
        for (number, line) in lines.enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let wanted = || {
                format!("{file}, line {}: found {line:?}, wanted a frame and left, right or dark", number + 2)
            };
            let (frame, word) = line.split_once(',').with_context(wanted)?;
            named.insert(frame.trim(), light::parse(word.trim()).ok().with_context(wanted)?);
        }
        let of = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let light = named.get(name.as_ref()).or_else(|| named.get(stem.as_ref()));
            light.copied().with_context(|| format!("{file}: found no row for frame {name}, wanted one"))
        };
        Ok(Some(paths.iter().map(of).collect::<Result<_>>()?))
    }

    fn summarise(
        &self,
        frames: Vec<(String, Seen, Option<Light>)>,
        calibration: Calibration,
        calibration_is_assumed: bool,
    ) -> Result<(TipTrack, Outcome)> {
        let mut outcome = Outcome {
            track: self.out.clone(),
            frames: frames.len(),
            measured: 0,
            held: 0,
            classes: BTreeMap::new(),
            longest_gap: 0,
            lights: BTreeMap::new(),
            calibration,
            calibration_is_assumed,
        };
        let column = |name: &str| Column { name: name.to_owned(), values: Vec::new() };
        let mut track = TipTrack {
            samples: Vec::new(),
            columns: ["frame", "tip_x_px", "tip_y_px", "class"].map(column).to_vec(),
        };
        let mut gap = 0;
        for (step, (name, seen, light)) in frames.into_iter().enumerate() {
            *outcome.classes.entry(seen.class.name()).or_default() += 1;
            *outcome.lights.entry(light::name(light)).or_default() += 1;
            gap = if seen.pixel.is_some() { 0 } else { gap + 1 };
            outcome.longest_gap = outcome.longest_gap.max(gap);
            // Before the first sighting there is nothing to hold: the track begins with it.
            let Some(observation) = seen.observation else { continue };
            let is_measured = observation.quality == Quality::Measured;
            outcome.measured += usize::from(is_measured);
            outcome.held += usize::from(!is_measured);
            track.samples.push(Sample {
                step: step as u32,
                time_s: step as f64 * self.period * 60.0,
                tip: observation.tip,
                light,
                quality: observation.quality,
            });
            let place = |value: fn(Pixel) -> f64| {
                seen.pixel.map_or_else(String::new, |pixel| format!("{:.2}", value(pixel)))
            };
            let values = [name, place(|pixel| pixel.x), place(|pixel| pixel.y), seen.class.to_string()];
            for (column, value) in track.columns.iter_mut().zip(values) {
                column.values.push(value);
            }
        }
        ensure!(
            !track.samples.is_empty(),
            "found no plant in any of {} photographs ({}), wanted one in the region of interest",
            outcome.frames,
            counts(&outcome.classes)
        );
        Ok((track, outcome))
    }

    fn tell(&self, shell: &Shell, outcome: &Outcome) -> Result<()> {
        let mut text = format!(
            "{} photographs: {} measured, {} held ({}); longest gap {}\nlamp lit: {}\nwrote {}",
            outcome.frames,
            outcome.measured,
            outcome.held,
            counts(&outcome.classes),
            outcome.longest_gap,
            counts(&outcome.lights),
            self.out.display(),
        );
        if let Some(folder) = &self.overlay {
            text += &format!("\nlook at {}: is the cross on the tip?", folder.display());
        }
        text += &format!("\nnext: tropism fit {} --out model.json", self.out.display());
        shell.result(&text, outcome)
    }
}

fn counts(of: &BTreeMap<&'static str, usize>) -> String {
    of.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}
