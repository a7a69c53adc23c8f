//! Options that several commands share, and how they are spelt.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use tropism::geometry::{Pixel, Region};
use tropism::lamps::Layout;
use tropism::task::Task;
use tropism::vision::Calibration;
use tropism_bean::Species;
use tropism_bean::fault::Faults;
use tropism_bean::tent::Greenhouse;
use tropism_lab::calibrate_camera::{Mark, ScaleSource};
use tropism_lab::track::PlantClick;
use tropism_lab::{files, task};

/// The task.
#[derive(Args, Clone)]
pub(crate) struct TaskOption {
    /// Task file, champion, rule or run folder; else the paper's targets
    #[arg(long, value_name = "TASK.toml")]
    pub(crate) task: Option<PathBuf>,
}

impl TaskOption {
    /// The task of the file, or the paper's.
    pub(crate) fn load(&self) -> Result<Task> {
        Ok(self.named()?.unwrap_or_default())
    }

    /// The task of the file, if one is named.
    pub(crate) fn named(&self) -> Result<Option<Task>> {
        Ok(self.task.as_deref().map(task::read).transpose()?)
    }
}

/// The seed of a command.
#[derive(Args, Clone, Copy)]
pub(crate) struct SeedOption {
    /// Seed of all random numbers: the same seed gives the same results
    // TOML, in which it is kept, has no larger numbers.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: u64,
}

/// The species of plant in the virtual tent.
#[derive(Args, Clone)]
pub(crate) struct BeanOption {
    /// Bean file, the species (beans/*.toml); else the common bean
    #[arg(long, value_name = "BEAN.toml")]
    pub(crate) bean: Option<PathBuf>,
}

impl BeanOption {
    /// The species of the file; `None` without a file.
    pub(crate) fn load(&self) -> Result<Option<Species>> {
        let Some(path) = &self.bean else { return Ok(None) };
        let species: Species = files::read_toml(path)?;
        species.check().with_context(|| path.display().to_string())?;
        Ok(Some(species))
    }
}

/// The virtual tent: its plant, its cameras and their faults.
#[derive(Args, Clone)]
pub(crate) struct TentOptions {
    #[command(flatten)]
    pub(crate) bean: BeanOption,

    /// Scene file: camera, lens and lamps; else the paper's tent
    #[arg(long, value_name = "SCENE.toml")]
    pub(crate) scene: Option<PathBuf>,

    /// Lamps: 2 (left, right) or 4 (also in front and behind)
    #[arg(long, value_name = "N", value_parser = parse_lamps)]
    lamps: Option<Layout>,

    /// Variation of plants, 0 to 2; 1 as between real plants by default
    #[arg(long, value_name = "X")]
    variation: Option<f64>,

    /// Virtual cameras: 1 in front, 2 with one at the side (folder `side`)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=2))]
    cameras: Option<u8>,

    /// Faults of photographs and their rates: missed_flash=0.02,fly=0.01
    #[arg(long, value_name = "FAULT=RATE,...", value_parser = parse_faults)]
    faults: Option<Faults>,
}

impl TentOptions {
    /// The paper's tent, changed by the options; `None` without any.
    pub(crate) fn load(&self) -> Result<Option<Greenhouse>> {
        let mut greenhouse = Greenhouse::default();
        if let Some(bean) = self.bean.load()? {
            greenhouse.bean = bean;
        }
        if let Some(path) = &self.scene {
            greenhouse.scene = files::read_toml(path)?;
            greenhouse.scene.check().with_context(|| path.display().to_string())?;
        }
        if let Some(layout) = &self.lamps {
            greenhouse.layout = layout.clone();
        }
        if let Some(variation) = self.variation {
            greenhouse.variation = checked_variation(variation)?;
        }
        greenhouse.scene.cameras = self.cameras.unwrap_or(greenhouse.scene.cameras);
        greenhouse.faults = self.faults.clone().unwrap_or_default();
        Ok((greenhouse != Greenhouse::default()).then_some(greenhouse))
    }

    /// Checks that the options leave what `task` needs: a task in space, four lamps and two cameras.
    pub(crate) fn check_for(&self, task: &Task) -> Result<()> {
        let is_plane = self.cameras == Some(1) || self.lamps == Some(Layout::default());
        ensure!(
            !(task.is_in_space() && is_plane),
            "the task is in space, which takes 4 lamps and 2 cameras: leave --lamps and --cameras out"
        );
        Ok(())
    }
}

/// The individual variation of virtual plants, checked.
pub(crate) fn checked_variation(variation: f64) -> Result<f64> {
    ensure!((0.0..=2.0).contains(&variation), "found --variation {variation}, wanted 0 to 2");
    Ok(variation)
}

/// The layout of so many lamps.
fn parse_lamps(text: &str) -> Result<Layout, String> {
    match text {
        "2" => Ok(Layout::default()),
        "4" => Ok(Layout::four_sides()),
        _ => Err("wanted 2 or 4; other layouts stand in a rig file".to_owned()),
    }
}

/// Faults by name and rate.
fn parse_faults(text: &str) -> Result<Faults, String> {
    let settings = text.replace('-', "_").replace(',', "\n");
    let faults: Faults = toml::from_str(&settings).map_err(|error| {
        format!("{}; wanted names and rates such as missed_flash=0.02,fly=0.01", error.message().trim())
    })?;
    faults.check().map_err(|error| error.to_string())?;
    Ok(faults)
}

/// Keys of plans, and the options that set them.
const OPTIONS_OF_KEYS: &[(&str, &str)] = &[
    ("anyway", "--anyway"),
    ("base", "--base"),
    ("reference", "--reference"),
    ("calibration", "--calibration"),
    ("check_plants", "--check-plants"),
    ("controllers", "--controllers"),
    ("crop", "--crop"),
    ("dark", "--dark"),
    ("demo", "--demo"),
    ("distance_cm", "--distance"),
    ("dry", "--dry"),
    ("every", "--every"),
    ("format", "--format"),
    ("fps", "--fps"),
    ("guide", "--guide"),
    ("greenhouse.faults", "--faults"),
    ("greenhouse.scene", "--scene"),
    ("greenhouse.scene.cameras", "--cameras"),
    ("horizons_min", "--horizons"),
    ("hours", "--hours"),
    ("interval_min", "--interval"),
    ("keep_going", "--keep-going"),
    ("kind", "--kind"),
    ("lamps", "--lamps"),
    ("learning_h", "--learning"),
    ("max_steps", "--steps"),
    ("model", "--model"),
    ("models", "--models"),
    ("out", "--out"),
    ("period_min", "--period"),
    ("plant_seeds", "--plant-seeds"),
    ("plants", "--plants"),
    ("photographs", "--photographs"),
    ("px_per_cm", "--scale"),
    ("region", "--roi"),
    ("radius_cm", "--radius"),
    ("rehearsal", "--rehearse"),
    ("replace", "--force"),
    ("resume", "--resume"),
    ("rules", "--rules"),
    ("seed", "--seed"),
    ("speed", "--speed"),
    ("task", "--task"),
    ("tilt_deg", "--tilt"),
    ("time", "--time"),
    ("view_deg", "--view"),
    ("wait_min", "--wait"),
    ("width", "--width"),
];

/// The option that sets `key` of a plan; options of the same name have the same meaning in all commands.
pub(crate) fn option_of_key(key: &str) -> Option<&'static str> {
    OPTIONS_OF_KEYS.iter().find(|(known, _)| *known == key).map(|(_, option)| *option)
}

/// `X,Y,W,H` in pixels.
pub(crate) fn parse_region(text: &str) -> Result<Region, String> {
    let wanted = "wanted X,Y,WIDTH,HEIGHT in whole pixels, such as 250,150,200,185";
    let numbers: Vec<usize> =
        text.split(',').map(|part| part.trim().parse().map_err(|_| wanted)).collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, width, height] if width > 0 && height > 0 => Ok(Region { x, y, width, height }),
        _ => Err(wanted.to_owned()),
    }
}

/// Two numbers with a comma between them.
pub(crate) fn parse_pair(text: &str) -> Result<[f64; 2], String> {
    let wanted = "wanted two numbers with a comma between them, such as 364,336";
    let (first, second) = text.split_once(',').ok_or(wanted)?;
    let number = |part: &str| part.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or(wanted);
    Ok([number(first)?, number(second)?])
}

/// A click on a photograph: its name or number, and a pixel.
pub(crate) fn parse_click(text: &str) -> Result<PlantClick, String> {
    let wanted = "wanted a photograph's name or number and a pixel, such as 0001.jpg,364,336";
    let (rest, y) = text.rsplit_once(',').ok_or(wanted)?;
    let (photograph, x) = rest.rsplit_once(',').ok_or(wanted)?;
    let number = |part: &str| part.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or(wanted);
    if photograph.is_empty() {
        return Err(wanted.to_owned());
    }
    Ok(PlantClick { photograph: photograph.to_owned(), x: number(x)?, y: number(y)? })
}

/// Two pixels and the cm between them, `30,420,195,421=15`.
pub(crate) fn parse_mark(text: &str) -> Result<Mark, String> {
    let wanted = "wanted two pixels and the cm between them, such as 30,420,195,421=15";
    let number = |part: &str| part.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or(wanted);
    let (ends, cm) = text.split_once('=').ok_or(wanted)?;
    let ends: Vec<f64> = ends.split(',').map(number).collect::<Result<_, _>>()?;
    let [x, y, other_x, other_y] = ends[..] else { return Err(wanted.to_owned()) };
    let mark = Mark { ends: [Pixel::new(x, y), Pixel::new(other_x, other_y)], length_cm: number(cm)? };
    let has_length = mark.length_cm > 0.0 && mark.ends[0] != mark.ends[1];
    if has_length { Ok(mark) } else { Err(wanted.to_owned()) }
}

/// A checkerboard by its inner corners each way and the side of a square in cm, `9x6@1.5`.
pub(crate) fn parse_board(text: &str) -> Result<ScaleSource, String> {
    let wanted = || {
        "wanted inner corners each way, 3 to 100, and the side of a square in cm, such as 9x6@1.5".to_owned()
    };
    let (corners, side) = text.split_once('@').ok_or_else(wanted)?;
    let (columns, rows) = corners.split_once('x').ok_or_else(wanted)?;
    let count =
        |part: &str| part.trim().parse().ok().filter(|count| (3..=100).contains(count)).ok_or_else(wanted);
    let side = side.trim().trim_end_matches("cm").parse().ok();
    let square_cm = side.filter(|side: &f64| side.is_finite() && *side > 0.0).ok_or_else(wanted)?;
    Ok(ScaleSource::Checkerboard { columns: count(columns)?, rows: count(rows)?, square_cm })
}

/// Pixels per cm: `11`, or a [`Mark`].
pub(crate) fn parse_scale(text: &str) -> Result<f64, String> {
    let wanted =
        "wanted pixels per cm, such as 11, or two pixels and the cm between them, such as 30,420,195,421=15";
    let scale = match parse_mark(text) {
        Ok(Mark { ends, length_cm }) => Calibration::fit_scale(&[(ends, length_cm)]).map(|(scale, _)| scale),
        Err(_) => text.trim().parse().ok(),
    };
    scale.filter(|scale: &f64| scale.is_finite() && *scale > 0.0).ok_or_else(|| wanted.to_owned())
}

/// A time such as `6h`, `90m` or `2d`, in minutes.
pub(crate) fn parse_minutes(text: &str) -> Result<f64, String> {
    let minutes = [("m", 1.0), ("h", 60.0), ("d", 24.0 * 60.0)].iter().find_map(|(unit, minutes)| {
        let number: f64 = text.strip_suffix(unit)?.parse().ok()?;
        Some(number * minutes)
    });
    let minutes = minutes.filter(|minutes| *minutes > 0.0 && minutes.is_finite());
    minutes.ok_or_else(|| format!("found {text:?}, wanted a time such as 6h, 90m or 2d"))
}
