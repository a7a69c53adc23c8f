//! `tropism track`: photographs into tracks.

mod drawing;
mod guide;
mod journal;
mod outcome;
mod plants;
mod series;
mod table;
mod work;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde::{Deserialize, Serialize};
use tropism::geometry::Region;
use tropism::lamps::{self, Light};
use tropism::photo::Image;
use tropism::vision::{Calibration, Mode, TipTracker, VisionConfig, lamp_state};
use tropism_lab::files;

use self::drawing::{Drawings, Drawn};
use self::journal::Journal;
use self::outcome::Settings;
use self::plants::{PAPER_WIDTH_CM, Plant, Scale};
use self::series::{Series, Shot, TimeFrom};
use self::table::Table;
use self::work::Work;
use crate::options::{parse_minutes, parse_pair, parse_region, parse_scale};
use crate::shell::{Interrupted, Shell};

/// Find the tip and the stem in photographs: ours, or anybody's folder of them
///
/// Photographs are taken in the order of their times, or of the numbers in their names. One in which no plant is seen
/// holds the last sighting and says so (`quality` is `held`, `class` tells why); a bad file never ends the batch.
///
/// Beside track.csv stand track.json (calibration, settings, counts, what was wrong with which file) and
/// track.frames.jsonl (what each photograph shows by itself, with the whole midline), by which --resume goes on.
///
/// Without --calibration or --scale, centimetres assume the paper's camera, whose picture is 74 cm wide at the plant.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism track tent/1/photographs --calibration tent/1/calibration.toml --out track.csv\n  \
    tropism track my-photos --guide guide.html\n  \
    tropism track my-photos --roi 250,150,200,185 --scale 11 --base 364,336 --out track.csv --overlay look\n  \
    tropism track two-plants --roi 50,80,200,300 --roi 300,80,200,300 --scale 30,420,195,421=15 --out track.csv")]
pub(crate) struct Track {
    /// Photographs (JPEG or PNG), or folders of them
    #[arg(required = true, value_name = "PHOTOS")]
    photographs: Vec<PathBuf>,

    /// Where the track goes; with several plants track-1.csv, track-2.csv and so on
    #[arg(
        long,
        value_name = "track.csv",
        required_unless_present = "guide",
        default_value = "track.csv",
        hide_default_value = true
    )]
    out: PathBuf,

    /// Begin here: a page to open in a browser, on which root, scale and region are clicked and the command copied. With
    /// --roi, what is found there is drawn in
    #[arg(long, value_name = "PAGE.html", conflicts_with_all = ["out", "resume", "overlay", "sheet"])]
    guide: Option<PathBuf>,

    /// Where the root is and how many pixels make a cm (base, px_per_cm, width, height)
    #[arg(long, value_name = "FILE", conflicts_with = "scale")]
    calibration: Option<PathBuf>,

    /// Pixels per cm in the plane of the stem, or two pixels and the cm between them: a ruler's ends, the pot's rim
    #[arg(long, value_name = "PX_PER_CM|X,Y,X,Y=CM", value_parser = parse_scale, allow_hyphen_values = true)]
    scale: Option<f64>,

    /// Pixel where the stem leaves the soil; the middle of the region's lower edge by default. Once a plant
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    base: Vec<Pair>,

    /// Region of interest: the plant without pot and lamps; the whole picture by default. Once a plant
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    roi: Vec<Region>,

    /// Several plants by name: a TOML file with [[plant]] tables of name, region and base
    #[arg(long, value_name = "PLANTS.toml", conflicts_with_all = ["roi", "base"])]
    plants: Option<PathBuf>,

    /// Which lamp is lit: read from the pictures, none (no lamps in view), or from a CSV with the columns frame and light
    #[arg(long, value_name = "auto|none|FILE.csv", default_value = "auto")]
    light: PathBuf,

    /// What tells when a photograph was taken
    #[arg(long, value_enum, default_value = "auto")]
    time: TimeFrom,

    /// Time from one photograph to the next, a step; by default the usual one, or five minutes where no times are known
    #[arg(long, value_name = "TIME", value_parser = parse_minutes)]
    period: Option<f64>,

    /// The robust method, or the paper's to the letter
    #[arg(long, value_name = "robust|paper", default_value = "robust", value_parser = parse_mode)]
    mode: Mode,

    /// Folder for a copy of each photograph with what was seen drawn in
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,

    /// Up to 24 photographs from first to last on one sheet, with what was seen drawn in
    #[arg(long, value_name = "SHEET.jpg")]
    sheet: Option<PathBuf>,

    /// Go on where the same command stopped, or take new photographs in
    #[arg(long)]
    resume: bool,

    /// Replace results that are there already
    #[arg(long, conflicts_with = "resume")]
    force: bool,
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
const BATCH: usize = 64;

/// Whether the JSON file beside a track says that the plant is virtual.
pub(crate) fn is_virtual(track: &Path) -> bool {
    #[derive(Deserialize)]
    struct Sidecar {
        is_virtual: bool,
    }
    let text = files::read_text(&track.with_extension("json"));
    text.is_ok_and(|text| serde_json::from_str::<Sidecar>(&text).is_ok_and(|sidecar| sidecar.is_virtual))
}

impl Track {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let paths = files::photographs(&self.photographs)?;
        let series = Series::read(&paths, self.time, self.period)?;
        if let Some(page) = &self.guide {
            return self.guide(page, &series, shell);
        }
        let plants = self.plants(&series.shots)?;
        let lights = self.lights(&series.shots)?;
        let settings = self.settings(&plants);
        let settings_sha256 = files::sha256(&serde_json::to_vec(&settings)?);
        self.check_is_free(&plants)?;
        if self.assumes_scale() {
            let px_per_cm = plants[0].calibration.px_per_cm;
            shell.note(&format!(
                "no --calibration or --scale: assuming a picture {PAPER_WIDTH_CM} cm wide at the plant \
                 ({px_per_cm:.2} px/cm)"
            ));
        }
        if let Some(folder) = &self.overlay {
            files::make_folder(folder)?;
        }
        let journal = self.out.with_extension("frames.jsonl");
        let mut work = Work {
            series: &series,
            plants: &plants,
            lights,
            trackers: plants
                .iter()
                .map(|plant| TipTracker::new(plant.calibration, plant.vision(self.mode)))
                .collect::<Result<_, _>>()?,
            tables: plants.iter().map(|plant| Table::new(plant.calibration)).collect(),
            journal: Journal::open(&journal, &settings_sha256, self.resume)?,
            drawings: Drawings::new(
                self.overlay.as_deref(),
                self.sheet.as_deref(),
                &plants,
                series.shots.len(),
            ),
            sha256: String::new(),
            problems: BTreeMap::new(),
        };
        // What stands still in the first pictures tells how far the camera has moved in later ones.
        let readable =
            series.shots.iter().filter_map(|shot| files::read_photo(&shot.path, 0.0).ok()?.open().ok());
        for picture in readable.take(TipTracker::REFERENCE_FRAMES) {
            work.trackers.iter_mut().for_each(|tracker| tracker.set_reference(&picture));
        }
        let progress = shell.progress("track", series.shots.len() as u64);
        for start in (0..series.shots.len()).step_by(BATCH) {
            work.batch(start..(start + BATCH).min(series.shots.len()), &progress)?;
            if Shell::is_interrupted() {
                return Err(Interrupted::resumable(&journal));
            }
        }
        drop(progress);
        work.drawings.finish()?;
        self.finish(&work, &settings, &settings_sha256, shell)
    }

    /// Writes the page, with what is found where a region is known.
    fn guide(&self, page: &Path, series: &Series, shell: &Shell) -> Result<()> {
        #[derive(Serialize)]
        struct Outcome<'a> {
            guide: &'a Path,
            shown: Vec<String>,
        }
        let is_placed = !self.roi.is_empty() || self.plants.is_some();
        let plants = if is_placed { self.plants(&series.shots)? } else { Vec::new() };
        let draw = |image: Image| {
            let look = |plant: &Plant| {
                let mut tracker = TipTracker::new(plant.calibration, plant.vision(self.mode)).ok()?;
                let found = tracker.detect(Ok(&image));
                Some((found.clone().ok(), tracker.update_next(found)))
            };
            let seen: Vec<_> = plants.iter().filter_map(look).collect();
            let drawn: Vec<Drawn<'_>> = plants
                .iter()
                .zip(&seen)
                .map(|(plant, (sighting, seen))| Drawn { plant, sighting: sighting.as_ref(), seen })
                .collect();
            drawing::drawn(&image, &drawn, lamp_state(&image, None))
        };
        let shown = guide::write(page, &self.photographs, &series.shots, &plants, self.scale, draw)?;
        let text = format!(
            "{} photographs, {}\nwrote {}: open it in a browser, click, and copy the command",
            series.shots.len(),
            series.words(),
            page.display()
        );
        shell.result(&text, &Outcome { guide: page, shown })
    }

    /// The plants that were asked for, with their calibrations.
    fn plants(&self, shots: &[Shot]) -> Result<Vec<Plant>> {
        let entries = match &self.plants {
            Some(path) => plants::read(path)?,
            None => plants::of_options(&self.roi, &self.base)?,
        };
        let scale = match &self.calibration {
            None => Scale::PerCm(self.scale),
            Some(path) => {
                let calibration: Calibration = files::read_toml(path)?;
                calibration.check().with_context(|| path.display().to_string())?;
                Scale::Known(calibration)
            }
        };
        plants::place(entries, &scale, shots)
    }

    const fn assumes_scale(&self) -> bool {
        self.calibration.is_none() && self.scale.is_none()
    }

    fn settings<'a>(&self, plants: &'a [Plant]) -> Settings<'a> {
        Settings {
            version: env!("CARGO_PKG_VERSION"),
            vision: VisionConfig { mode: self.mode, ..VisionConfig::default() },
            plants,
            time: self.time,
            period_min: self.period,
            light: self.light.display().to_string(),
        }
    }

    /// The track of a plant: `track.csv`, or `track-NAME.csv` where there are several.
    fn out(&self, plant: &Plant) -> PathBuf {
        let Some(name) = &plant.name else { return self.out.clone() };
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        let file = format!("{stem}-{name}");
        match self.out.extension() {
            Some(extension) => self.out.with_file_name(format!("{file}.{}", extension.to_string_lossy())),
            None => self.out.with_file_name(file),
        }
    }

    /// Checks that no result of another command is in the way.
    fn check_is_free(&self, plants: &[Plant]) -> Result<()> {
        ensure!(
            self.out.extension().is_none_or(|extension| extension != "json" && extension != "jsonl"),
            "--out {}: found the name of the file beside the track, wanted one that ends in .csv",
            self.out.display()
        );
        if self.resume || self.force {
            return Ok(());
        }
        let tracks = plants.iter().map(|plant| self.out(plant));
        let beside = tracks.flat_map(|track| [track.with_extension("json"), track]);
        let overlays = self.overlay.iter().filter(|folder| files::photographs(&[(*folder).clone()]).is_ok());
        let all = beside.chain([self.out.with_extension("frames.jsonl")]).chain(self.sheet.clone());
        if let Some(taken) = all.filter(|path| path.exists()).chain(overlays.cloned()).next() {
            bail!(
                "{}: found results here already, wanted a new name, --resume to go on with them or --force to replace \
                 them",
                taken.display()
            );
        }
        Ok(())
    }

    /// The lights of a file, one a photograph; `None` if they are to be read from the pictures.
    fn lights(&self, shots: &[Shot]) -> Result<Option<Vec<Option<Light>>>> {
        if self.light == Path::new("auto") {
            return Ok(None);
        }
        if self.light == Path::new("none") {
            return Ok(Some(vec![None; shots.len()]));
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
            named.insert(frame.trim(), lamps::parse(word.trim()).ok().with_context(wanted)?);
        }
        let of = |shot: &Shot| {
            let name = series::file_name(&shot.path);
            let stem = shot.path.file_stem().unwrap_or_default().to_string_lossy();
            let light =
                [shot.name.as_str(), &name, stem.as_ref()].into_iter().find_map(|name| named.get(name));
            light.copied().with_context(|| format!("{file}: found no row for frame {name}, wanted one"))
        };
        Ok(Some(shots.iter().map(of).collect::<Result<_>>()?))
    }
}
