//! Which plants are tracked, where they stand in the picture, and how pixels become centimetres there.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Region};
use tropism::text::plural;
use tropism::vision::{Calibration, Direction, VisionConfig, VisionError};

use super::clicks::{PlantClick, PlantClicks};
use super::series::Frame;
use crate::{Error, files};

/// Width of the picture of the paper's camera in the plane of the stem, in cm.
pub(super) const PAPER_WIDTH_CM: f64 = tropism_bean::view::Frame::WIDTH_CM;

/// One plant to track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantPlan {
    /// Name in the files of its track, if there are several plants: letters, digits, `-` and `_`.
    pub name: String,
    /// The plant without pot and lamps; `None` is the whole picture.
    pub region: Option<Region>,
    /// Pixel where the stem leaves the soil; `None` is the middle of the region's lower edge, or of the edge opposite to
    /// the direction in which the plant grows.
    pub base: Option<Pixel>,
    /// Points that were clicked: the tip is followed from there.
    #[serde(default, skip_serializing_if = "PlantClicks::is_empty")]
    pub clicks: PlantClicks,
}

impl Default for PlantPlan {
    fn default() -> Self {
        Self { name: "1".to_owned(), region: None, base: None, clicks: PlantClicks::default() }
    }
}

/// How pixels become centimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrackScale {
    /// As in the picture of the paper's camera, whatever its pixels.
    #[default]
    PaperCamera,
    /// So many pixels a cm in the plane of the stem.
    PxPerCm(f64),
    /// As calibrated; with several plants its base is not used.
    Calibration(Calibration),
}

impl TrackScale {
    /// The root of the plant that was calibrated.
    pub(super) fn base(&self) -> Option<Pixel> {
        match self {
            Self::Calibration(calibration) => Some(calibration.base),
            Self::PaperCamera | Self::PxPerCm(_) => None,
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        match self {
            Self::PxPerCm(found) if !(found.is_finite() && *found > 0.0) => {
                Err(Error::Plan(format!("found `px_per_cm` {found}, wanted a number above 0")))
            }
            Self::Calibration(calibration) => calibration.check().map_err(Error::at("calibration")),
            _ => Ok(()),
        }
    }
}

/// A plant with its calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Plant {
    /// `None` if it is the only one.
    pub(super) name: Option<String>,
    pub(super) region: Option<Region>,
    pub(super) calibration: Calibration,
    /// Whether region and root were found by the plant's motion.
    #[serde(skip)]
    pub(super) is_located: bool,
    /// The things that move in the picture, where several do and nothing says which is the plant.
    #[serde(skip)]
    pub(super) movers: Vec<Region>,
}

impl Plant {
    /// How it is detected: as `vision` says, in its region.
    pub(super) fn vision(&self, vision: &VisionConfig) -> VisionConfig {
        VisionConfig { crop: self.region, ..vision.clone() }
    }
}

/// Reads a TOML file with one `[[plant]]` table a plant.
///
/// # Errors
/// [`Error`] if the file cannot be read, or names no plant, or one twice.
pub fn read_plants(path: &Path) -> Result<Vec<PlantPlan>, Error> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct PlantsFile {
        plant: Vec<PlantPlan>,
    }
    let PlantsFile { plant: plants } = files::read_toml(path)?;
    check_plants_in(&path.display().to_string(), &plants)?;
    Ok(plants)
}

/// Plants by their regions and bases, named by their numbers from 1. Either list may be empty. A click belongs to the plant in
/// whose region it lies.
///
/// # Errors
/// [`Error::Plan`] if the lists are of different lengths, or a click lies in the region of none or several of several plants.
pub fn numbered_plants(
    regions: &[Region],
    bases: &[Pixel],
    clicks: PlantClicks,
) -> Result<Vec<PlantPlan>, Error> {
    let count = regions.len().max(bases.len()).max(1);
    for (key, found) in [("region", regions.len()), ("base", bases.len())] {
        if found != 0 && found != count {
            return Err(Error::Plan(format!(
                "found {found} x `{key}` for {count} plants, wanted one a plant, in the same order, or none"
            )));
        }
    }
    let plant = |index: usize| PlantPlan {
        name: (index + 1).to_string(),
        region: regions.get(index).copied(),
        base: bases.get(index).copied(),
        clicks: PlantClicks::default(),
    };
    let mut plants: Vec<PlantPlan> = (0..count).map(plant).collect();
    assign(clicks, &mut plants)?;
    Ok(plants)
}

/// A list of clicks of one kind.
type ListOf = fn(&mut PlantClicks) -> &mut Vec<PlantClick>;

/// Gives each click to the only plant, or to the one in whose region it lies.
fn assign(clicks: PlantClicks, plants: &mut [PlantPlan]) -> Result<(), Error> {
    if let [only] = plants {
        only.clicks = clicks;
        return Ok(());
    }
    let lists: [(_, ListOf); 3] = [
        (clicks.tip, |clicks| &mut clicks.tip),
        (clicks.node, |clicks| &mut clicks.node),
        (clicks.root, |clicks| &mut clicks.root),
    ];
    for (clicks, list) in lists {
        for click in clicks {
            let holds = |plant: &PlantPlan| plant.region.is_some_and(|region| region.contains(click.at()));
            let mut holding = plants.iter_mut().filter(|plant| holds(plant));
            match (holding.next(), holding.next()) {
                (Some(plant), None) => list(&mut plant.clicks).push(click),
                _ => {
                    return Err(Error::Plan(format!(
                        "a click at {},{} lies in the `region` of none or several of the plants: wanted it in one, or \
                         `plants` that name their clicks",
                        click.x, click.y
                    )));
                }
            }
        }
    }
    Ok(())
}

pub(super) fn check_plants(plants: &[PlantPlan]) -> Result<(), Error> {
    check_plants_in("`plants`", plants)
}

fn check_plants_in(place: &str, plants: &[PlantPlan]) -> Result<(), Error> {
    let refuse = |problem: String| Err(Error::Plan(format!("{place}: {problem}")));
    if plants.is_empty() {
        return refuse("there is no [[plant]]: describe at least one".to_owned());
    }
    for (index, PlantPlan { name, .. }) in plants.iter().enumerate() {
        let is_allowed = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
        if name.is_empty() || !name.chars().all(is_allowed) {
            return refuse(format!(
                "found name {name:?}, wanted letters, digits, - and _, for it becomes part of a file's name"
            ));
        }
        if plants[..index].iter().any(|other| other.name == *name) {
            return refuse(format!("two plants have the name {name:?}: give each its own"));
        }
    }
    Ok(())
}

/// The middle of a region's edge that is opposite to `up`.
pub(super) fn foot(Region { x, y, width, height }: Region, up: Direction) -> Pixel {
    let (left, top) = (x as f64, y as f64);
    let (right, bottom) = (left + width as f64 - 1.0, top + height as f64 - 1.0);
    let (centre, middle) = ((left + right) / 2.0, (top + bottom) / 2.0);
    match up {
        Direction::Up => Pixel::new(centre, bottom),
        Direction::Left => Pixel::new(right, middle),
        Direction::Right => Pixel::new(left, middle),
        Direction::Down => Pixel::new(centre, top),
    }
}

/// The plants with their calibrations, for photographs of the size of the first whole one.
pub(super) fn place(
    plants: &[PlantPlan],
    scale: &TrackScale,
    vision: &VisionConfig,
    frames: &[Frame],
) -> Result<Vec<Plant>, Error> {
    let (width, height) = match scale {
        TrackScale::Calibration(known) => (known.width, known.height),
        TrackScale::PaperCamera | TrackScale::PxPerCm(_) => size_of_first(frames)?,
    };
    let is_alone = plants.len() == 1;
    let place = |plan: &PlantPlan| {
        let region = plan.region.unwrap_or(Region { x: 0, y: 0, width, height });
        let base = plan.base.or_else(|| plan.clicks.root.first().map(PlantClick::at));
        let is_given = base.is_some();
        let base = base.unwrap_or_else(|| foot(region, vision.up));
        let calibration = match *scale {
            TrackScale::Calibration(known) if is_alone && !is_given => known,
            TrackScale::Calibration(known) => Calibration { base, ..known },
            TrackScale::PxPerCm(px_per_cm) => Calibration::from_scale(base, px_per_cm, width, height),
            TrackScale::PaperCamera => {
                Calibration::from_scale(base, width as f64 / PAPER_WIDTH_CM, width, height)
            }
        };
        check_base(calibration.base, width, height)?;
        calibration.check().map_err(|error| Error::Plan(format!("`px_per_cm`: {error}")))?;
        let name = Some(plan.name.clone()).filter(|_| !is_alone);
        let region = plan.region.or_else(|| plan.clicks.surroundings(calibration.base, (width, height)));
        let plant = Plant { name, region, calibration, is_located: false, movers: Vec::new() };
        plant.vision(vision).check(width, height).map_err(|error| match (&error, &plant.name) {
            (VisionError::Region { .. }, None) => Error::Plan(format!("`region`: {error}")),
            (VisionError::Region { .. }, Some(name)) => Error::Plan(format!("plant {name}: {error}")),
            _ => Error::Plan(format!("`vision`: {error}")),
        })?;
        Ok(plant)
    };
    plants.iter().map(place).collect()
}

/// Checks that the root is in a picture, or no farther beside it than the picture is large: chosen, for a root may be out of
/// view, and what lies farther away is mistyped.
fn check_base(Pixel { x, y }: Pixel, width: usize, height: usize) -> Result<(), Error> {
    let is_near = |value: f64, size: usize| (-(size as f64)..=2.0 * size as f64).contains(&value);
    if is_near(x, width) && is_near(y, height) {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "`base`: found {x},{y}, wanted a pixel in a picture of {width} x {height}, or near it"
    )))
}

/// Columns and rows of the first whole photograph.
fn size_of_first(frames: &[Frame]) -> Result<(usize, usize), Error> {
    let mut first_problem = None;
    for frame in frames {
        match files::read_photo(&frame.path, frame.time_s).map(|photo| photo.decode()) {
            Ok(Ok(image)) => return Ok((image.width, image.height)),
            Ok(Err(error)) => {
                first_problem.get_or_insert_with(|| format!("{}: {error}", frame.path.display()));
            }
            Err(error) => {
                first_problem.get_or_insert_with(|| error.to_string());
            }
        }
    }
    Err(Error::Plan(format!(
        "{}; none of {} is a whole photograph",
        first_problem.unwrap_or_default(),
        plural(frames.len(), "file")
    )))
}
