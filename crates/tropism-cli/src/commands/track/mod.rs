//! `tropism track`: tracks from photographs.

mod text;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use tropism::geometry::{Pixel, Region};
use tropism::vision::{Calibration, Direction, Mode, VisionConfig};
use tropism_lab::files;
use tropism_lab::track::{
    GuidePlan, LightSource, PlantClick, PlantClicks, PlantPlan, TimeSource, TrackPlan, TrackScale,
    numbered_plants, read_plants,
};

use crate::options::{parse_click, parse_minutes, parse_pair, parse_region, parse_scale};
use crate::progress::{check_outputs, execute, execute_and_print, for_user, with_options};
use crate::shell::Shell;

/// Track the tip and the stem of plants in a folder of photographs
///
/// In a frame without a detected plant the last tip is carried forward, and `class` says why. Beside track.csv are
/// written track.json (settings, counts, bad files) and track.frames.jsonl (each detection).
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism track tent/1/photographs --calibration tent/1/calibration.toml --out track.csv\n  \
    tropism track my-photos --guide guide.html\n  \
    tropism track my-photos --roi 250,150,200,185 --scale 11 --base 364,336 --out track.csv\n  \
    tropism track two-plants --plant-file plants.toml --scale 30,420,195,421=15 --out track.csv")]
pub(crate) struct Track {
    /// Photographs (JPEG, PNG, TIFF), a film, or folders of them
    #[arg(required = true, value_name = "PHOTOS")]
    photographs: Vec<PathBuf>,

    /// File for the track; of several plants track-1.csv, ...
    #[arg(
        long,
        value_name = "track.csv",
        required_unless_present = "guide",
        default_value = "track.csv",
        hide_default_value = true
    )]
    out: PathBuf,

    /// Write a page on which to click base, scale and region: begin here
    #[arg(long, value_name = "PAGE.html", conflicts_with_all = ["out", "resume", "overlay", "sheet"])]
    guide: Option<PathBuf>,

    /// Calibration file, from `tropism calibrate-camera`
    #[arg(long, value_name = "FILE", conflicts_with = "scale")]
    calibration: Option<PathBuf>,

    /// Pixels per cm at the plant, or a ruler from pixel to pixel, X,Y,X,Y=CM; else the
    /// paper's camera is assumed, whose picture is 74 cm wide
    #[arg(long, value_name = "PX_PER_CM", value_parser = parse_scale, allow_hyphen_values = true)]
    scale: Option<f64>,

    /// Pixel where the stem leaves the soil, once a plant; else the middle of the region's lower edge
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    base: Vec<Pair>,

    /// Region with the plant alone, once a plant; else the plant that moves is found
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    roi: Vec<Region>,

    /// Click on the tip in a photograph, by name or number from 1
    #[arg(long, value_name = "PHOTO,X,Y", value_parser = parse_click, conflicts_with_all = ["plants", "each", "guide"])]
    tip: Vec<PlantClick>,

    /// Click on the end of the stem, below the leaves
    #[arg(long, value_name = "PHOTO,X,Y", value_parser = parse_click, requires = "tip")]
    node: Vec<PlantClick>,

    /// Click on the root, where camera or plant are moved; else --base
    #[arg(long, value_name = "PHOTO,X,Y", value_parser = parse_click, requires = "tip")]
    root: Vec<PlantClick>,

    /// Several plants by name: a file of [[plant]] with name, region, base
    #[arg(long = "plant-file", value_name = "PLANTS.toml", conflicts_with_all = ["roi", "base"])]
    plants: Option<PathBuf>,

    /// Lit lamp: auto (seen), none, or a CSV with frame and light
    #[arg(long, value_name = "LIGHT", default_value = "auto", value_parser = parse_light)]
    light: LightSource,

    /// Source of the times
    #[arg(long, value_enum, default_value = "auto")]
    time: TimeName,

    /// Time of a step; by default the median interval, or five minutes
    #[arg(long, value_name = "TIME", value_parser = parse_minutes)]
    period: Option<f64>,

    /// Detection: robust, or the paper's to the letter
    #[arg(long, value_name = "MODE", default_value = "robust", value_parser = parse_mode)]
    mode: Mode,

    /// Direction of growth: up, left, right, down; else it is found
    #[arg(long, value_name = "DIRECTION")]
    up: Option<Direction>,

    /// Take the photographs as unrelated: none is compared with another
    #[arg(long, conflicts_with_all = ["guide", "period"])]
    each: bool,

    /// Folder for copies of the photographs with the detections drawn in
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,

    /// File for a sheet of up to 24 photographs with the detections
    #[arg(long, value_name = "SHEET.jpg")]
    sheet: Option<PathBuf>,

    /// Continue where the same command stopped, or add new photographs
    #[arg(long)]
    resume: bool,

    /// Replace results that exist already
    #[arg(long, conflicts_with = "resume")]
    force: bool,
}

type Pair = [f64; 2];

#[derive(Clone, Copy, ValueEnum)]
enum TimeName {
    /// Exif headers, else names, else neither
    Auto,
    /// The camera's clock
    Exif,
    /// Names of the files
    Name,
    /// One photograph every --period
    Even,
}

fn parse_mode(text: &str) -> Result<Mode, String> {
    match text {
        "robust" => Ok(Mode::Robust),
        "paper" => Ok(Mode::Paper),
        _ => Err("wanted robust or paper".to_owned()),
    }
}

fn parse_light(text: &str) -> Result<LightSource, String> {
    Ok(match text {
        "auto" => LightSource::Auto,
        "none" => LightSource::None,
        file => LightSource::File(file.into()),
    })
}

impl Track {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        match self.guide.clone() {
            Some(page) => {
                let plan = self.guide_plan(page)?;
                execute_and_print(&plan, shell, text::guide)
            }
            None => self.track(shell),
        }
    }

    fn track(self, shell: &Shell) -> Result<()> {
        let inputs = [self.calibration.clone(), self.plants.clone()];
        let plan = self.plan()?;
        check_outputs(&plan.outputs(), inputs.iter().map(Option::as_ref))?;
        let results = execute(&plan, shell)?;
        shell.result(&text::tracks(&plan, &results), &results)?;
        match results.undetected.as_slice() {
            [] => Ok(()),
            undetected => bail!(with_options(&undetected.join("; "))),
        }
    }

    fn plan(self) -> Result<TrackPlan> {
        Ok(TrackPlan {
            scale: self.scale()?,
            plants: self.plants()?,
            photographs: self.photographs,
            out: self.out,
            light: self.light,
            time: self.time.into(),
            period_min: self.period,
            vision: VisionConfig {
                mode: self.mode,
                up: self.up.unwrap_or_default(),
                ..VisionConfig::default()
            },
            find_up: self.up.is_none(),
            each: self.each,
            overlay: self.overlay,
            sheet: self.sheet,
            resume: self.resume,
            replace: self.force,
            ..TrackPlan::default()
        })
    }

    fn guide_plan(self, page: PathBuf) -> Result<GuidePlan> {
        let is_placed = !self.roi.is_empty() || self.plants.is_some();
        Ok(GuidePlan {
            scale: self.scale()?,
            plants: if is_placed { self.plants()? } else { Vec::new() },
            photographs: self.photographs,
            page,
            time: self.time.into(),
            period_min: self.period,
            vision: VisionConfig {
                mode: self.mode,
                up: self.up.unwrap_or_default(),
                ..VisionConfig::default()
            },
            ..GuidePlan::default()
        })
    }

    fn plants(&self) -> Result<Vec<PlantPlan>> {
        let bases: Vec<Pixel> = self.base.iter().map(|&[x, y]| Pixel::new(x, y)).collect();
        let plants = match &self.plants {
            Some(path) => read_plants(path),
            None => {
                let [tip, node, root] = [&self.tip, &self.node, &self.root].map(Clone::clone);
                numbered_plants(&self.roi, &bases, PlantClicks { tip, node, root })
            }
        };
        plants.map_err(for_user)
    }

    fn scale(&self) -> Result<TrackScale> {
        match (&self.calibration, self.scale) {
            (Some(path), _) => {
                let calibration: Calibration = files::read_toml(path)?;
                calibration.check().with_context(|| path.display().to_string())?;
                Ok(TrackScale::Calibration(calibration))
            }
            (None, Some(px_per_cm)) => Ok(TrackScale::PxPerCm(px_per_cm)),
            (None, None) => Ok(TrackScale::PaperCamera),
        }
    }
}

impl From<TimeName> for TimeSource {
    fn from(name: TimeName) -> Self {
        match name {
            TimeName::Auto => Self::Auto,
            TimeName::Exif => Self::Exif,
            TimeName::Name => Self::Name,
            TimeName::Even => Self::Even,
        }
    }
}
