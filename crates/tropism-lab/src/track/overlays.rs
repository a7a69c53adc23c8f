//! Overlays: photographs with the detections drawn in, one by one and on a contact sheet.

use std::path::{Path, PathBuf};

use tropism::geometry::{Pixel, Region};
use tropism::lamps::Light;
use tropism::photo::Image;
use tropism::vision::raster::filter;
use tropism::vision::{Detection, TrackedFrame};
use tropism_report::{OverlayMarks, contact_sheet, draw_overlay};

use super::plants::Plant;
use crate::{Error, files};

/// Pictures of a contact sheet: four rows.
const CELLS: usize = 24;

/// Pictures in a row of a contact sheet.
const COLUMNS: usize = 6;

/// Pixel columns of one picture of a contact sheet, at most: a row of six is 1920 wide.
const CELL_COLUMNS: usize = 320;

/// Of overlays and contact sheets. Chosen by hand.
const JPEG_QUALITY: u8 = 85;

/// What to draw of one plant in one photograph.
pub(super) struct Annotation<'a> {
    pub(super) plant: &'a Plant,
    pub(super) detection: Option<&'a Detection>,
    pub(super) seen: &'a TrackedFrame,
}

/// The folder of overlays and the contact sheet, each of them if the plan names it.
pub(super) struct Overlays {
    folder: Option<PathBuf>,
    sheet: Option<PathBuf>,
    /// Indices of the photographs on the sheet.
    chosen: Vec<usize>,
    cells: Vec<Image>,
    /// The part of a photograph that the sheet shows: the plants' regions with a margin.
    view: Option<Region>,
}

impl Overlays {
    pub(super) fn new(
        folder: Option<&Path>,
        sheet: Option<&Path>,
        plants: &[Plant],
        photographs: usize,
    ) -> Self {
        let count = CELLS.min(photographs);
        // At equal distances from the first to the last.
        let chosen = (0..count).map(|cell| cell * (photographs - 1) / (count - 1).max(1)).collect();
        Self {
            folder: folder.map(Path::to_owned),
            sheet: sheet.map(Path::to_owned),
            chosen,
            cells: Vec::new(),
            view: view(plants),
        }
    }

    /// Whether the pixels of a photograph are needed, because it is still to be drawn.
    pub(super) fn needs(&self, index: usize, name: &str) -> bool {
        let is_drawn = |folder: &PathBuf| folder.join(file_name(name)).exists();
        self.folder.as_ref().is_some_and(|folder| !is_drawn(folder))
            || self.sheet.is_some() && self.chosen.contains(&index)
    }

    /// Draws the detections into a photograph.
    pub(super) fn add(
        &mut self,
        index: usize,
        name: &str,
        image: &Image,
        annotations: &[Annotation<'_>],
        light: Option<Light>,
    ) -> Result<(), Error> {
        if let Some(folder) = &self.folder {
            let jpeg = annotate(image, annotations, light).to_jpeg(JPEG_QUALITY).map_err(Error::at(name))?;
            files::write(&folder.join(file_name(name)), &jpeg)?;
        }
        if self.sheet.is_some() && self.chosen.contains(&index) {
            let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
            let view = self.view.filter(|view| view.fits(image.width, image.height)).unwrap_or(whole);
            let factor = view.width.div_ceil(CELL_COLUMNS).min(view.height);
            let small = filter::downscale(image, view, factor);
            let middle = (factor as f64 - 1.0) / 2.0;
            let to_cell = |pixel: Pixel| {
                let along = |at: f64, start: usize| (at - start as f64 - middle) / factor as f64;
                Pixel::new(along(pixel.x, view.x), along(pixel.y, view.y))
            };
            self.cells.push(draw(&small, annotations, light, to_cell, false));
        }
        Ok(())
    }

    /// Writes the contact sheet, if one is wanted.
    pub(super) fn finish(&self) -> Result<(), Error> {
        let Some(path) = &self.sheet else { return Ok(()) };
        let sheet = contact_sheet(&self.cells, COLUMNS);
        let jpeg = sheet.to_jpeg(JPEG_QUALITY).map_err(Error::at(path.display()))?;
        Ok(files::write(path, &jpeg)?)
    }
}

/// A copy of a photograph with the detections drawn in.
pub(super) fn annotate(image: &Image, annotations: &[Annotation<'_>], light: Option<Light>) -> Image {
    draw(image, annotations, light, |pixel| pixel, true)
}

/// The name of a photograph's overlay, which is a JPEG.
fn file_name(name: &str) -> String {
    let flat = name.replace(['/', '\\'], "_");
    let is_jpeg = Path::new(&flat).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("jpg"));
    if is_jpeg { flat } else { flat + ".jpg" }
}

/// The bounding box of all plants' regions, each with a margin of an eighth; `None` if a plant has no region.
fn view(plants: &[Plant]) -> Option<Region> {
    let mut all: Option<Region> = None;
    for plant in plants {
        let (region, calibration) = (plant.region?, &plant.calibration);
        let (across, down) = (region.width / 8, region.height / 8);
        let (left, top) = (region.x.saturating_sub(across), region.y.saturating_sub(down));
        let right = (region.x + region.width + across).min(calibration.width);
        let bottom = (region.y + region.height + down).min(calibration.height);
        let united = all.map_or((left, top, right, bottom), |all| {
            (left.min(all.x), top.min(all.y), right.max(all.x + all.width), bottom.max(all.y + all.height))
        });
        let (x, y, right, bottom) = united;
        all = Some(Region { x, y, width: right - x, height: bottom - y });
    }
    all
}

/// Draws the annotations of all plants. `to_picture` maps a pixel of the photograph to one of `image`.
fn draw(
    image: &Image,
    annotations: &[Annotation<'_>],
    light: Option<Light>,
    to_picture: impl Fn(Pixel) -> Pixel,
    has_regions: bool,
) -> Image {
    let mut picture = image.clone();
    for Annotation { plant, detection, seen } in annotations {
        let accepted = detection.filter(|_| seen.is_measured()).map(|detection| {
            let mut detection = detection.clone();
            detection.tip = to_picture(detection.tip);
            detection.apex = detection.apex.map(&to_picture);
            detection.stem = detection.stem.map(|stem| stem.into_iter().map(&to_picture).collect());
            detection
        });
        let held = seen.observation.as_ref().filter(|_| !seen.is_measured());
        let marks = OverlayMarks {
            detection: accepted.as_ref(),
            carried_forward: held.map(|observation| to_picture(plant.calibration.pixel(observation.tip))),
            crop: plant.region.filter(|_| has_regions),
            base: Some(to_picture(plant.calibration.base)),
            light,
        };
        picture = draw_overlay(&picture, &marks);
    }
    picture
}
