//! Which plants are looked for, where in the picture, and how pixels are centimetres there.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Region};
use tropism::vision::{Calibration, Mode, VisionConfig};
use tropism_lab::files;

use super::series::Shot;

/// Width of the paper's camera's picture in the plane of the stem, in cm; see `tropism::greenhouse::view`.
pub(crate) const PAPER_WIDTH_CM: f64 = tropism::greenhouse::view::Frame::WIDTH_CM;

/// A plant, and the part of the picture that is its own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Plant {
    /// `None` where it is the only one.
    pub(crate) name: Option<String>,
    pub(crate) region: Option<Region>,
    pub(crate) calibration: Calibration,
}

impl Plant {
    /// How it is looked for.
    pub(crate) fn vision(&self, mode: Mode) -> VisionConfig {
        VisionConfig { mode, crop: self.region, ..VisionConfig::default() }
    }
}

/// A file that names plants.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantsFile {
    plant: Vec<PlantEntry>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlantEntry {
    name: String,
    region: Option<Region>,
    base: Option<Pixel>,
}

/// The plants that `path` names.
pub(crate) fn read(path: &Path) -> Result<Vec<PlantEntry>> {
    let PlantsFile { plant: plants } = files::read_toml(path)?;
    let file = path.display();
    ensure!(!plants.is_empty(), "{file}: found no [[plant]], wanted at least one");
    for (index, plant) in plants.iter().enumerate() {
        let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
        ensure!(
            !plant.name.is_empty() && plant.name.chars().all(is_word),
            "{file}: found name {:?}, wanted letters, digits, - and _, for it becomes part of a file's name",
            plant.name
        );
        let is_new = plants[..index].iter().all(|other| other.name != plant.name);
        ensure!(is_new, "{file}: found two plants of the name {:?}, wanted a name for each", plant.name);
    }
    Ok(plants)
}

/// The plants of the options `--roi` and `--base`: one a region, numbered from 1 where there are several.
pub(crate) fn of_options(regions: &[Region], bases: &[[f64; 2]]) -> Result<Vec<PlantEntry>> {
    let count = regions.len().max(bases.len()).max(1);
    for (option, found) in [("--roi", regions.len()), ("--base", bases.len())] {
        ensure!(
            found == 0 || found == count,
            "found {found} x {option} for {count} plants, wanted one a plant, in the same order, or none"
        );
    }
    let plant = |index: usize| PlantEntry {
        name: (index + 1).to_string(),
        region: regions.get(index).copied(),
        base: bases.get(index).map(|&[x, y]| Pixel::new(x, y)),
    };
    Ok((0..count).map(plant).collect())
}

/// How pixels are to become centimetres.
pub(crate) enum Scale {
    /// By a file.
    Known(Calibration),
    /// By so many pixels a cm; `None` assumes the paper's camera.
    PerCm(Option<f64>),
}

/// The plants with their calibrations, for photographs of the size of the first that is whole.
pub(crate) fn place(entries: Vec<PlantEntry>, scale: &Scale, shots: &[Shot]) -> Result<Vec<Plant>> {
    let (width, height) = match scale {
        Scale::Known(calibration) => (calibration.width, calibration.height),
        Scale::PerCm(_) => size(shots)?,
    };
    let is_alone = entries.len() == 1;
    let place = |entry: PlantEntry| {
        let region = entry.region.unwrap_or(Region { x: 0, y: 0, width, height });
        let foot = Pixel::new(
            region.x as f64 + (region.width as f64 - 1.0) / 2.0,
            region.y as f64 + region.height as f64 - 1.0,
        );
        let calibration = match *scale {
            Scale::Known(known) if is_alone && entry.base.is_none() => known,
            Scale::Known(known) => Calibration { base: entry.base.unwrap_or(foot), ..known },
            Scale::PerCm(scale) => {
                let px_per_cm = scale.unwrap_or(width as f64 / PAPER_WIDTH_CM);
                Calibration::from_scale(entry.base.unwrap_or(foot), px_per_cm, width, height)
            }
        };
        calibration.check().context("--scale")?;
        let plant = Plant { name: Some(entry.name).filter(|_| !is_alone), region: entry.region, calibration };
        plant.vision(Mode::default()).check(width, height).map_err(|error| match &plant.name {
            None => anyhow::anyhow!("--roi: {error}"),
            Some(name) => anyhow::anyhow!("plant {name}: {error}"),
        })?;
        Ok(plant)
    };
    entries.into_iter().map(place).collect()
}

/// Columns and rows of the first whole photograph.
fn size(shots: &[Shot]) -> Result<(usize, usize)> {
    let mut first_problem = None;
    for shot in shots {
        match files::read_photo(&shot.path, shot.time_s).map(|photo| photo.decode()) {
            Ok(Ok(image)) => return Ok((image.width, image.height)),
            Ok(Err(error)) => {
                first_problem.get_or_insert_with(|| format!("{}: {error}", shot.path.display()));
            }
            Err(error) => {
                first_problem.get_or_insert_with(|| error.to_string());
            }
        }
    }
    bail!("{}; none of {} files is a whole photograph", first_problem.unwrap_or_default(), shots.len());
}
