//! What was seen, drawn over photographs for people to look at.

use std::path::{Path, PathBuf};

use anyhow::Result;
use tropism::geometry::{Pixel, Region};
use tropism::lamps::Light;
use tropism::photo::Image;
use tropism::vision::overlay::{OverlayMarks, contact_sheet, draw_overlay};
use tropism::vision::raster::filter;
use tropism::vision::{Detection, TrackedFrame};
use tropism_lab::files;

use super::plants::Plant;

/// Pictures of a contact sheet.
const CELLS: usize = 24;

/// Pictures in a row of a contact sheet.
const COLUMNS: usize = 6;

/// Columns of one of its pictures, at most.
const CELL_COLUMNS: usize = 320;

const JPEG_QUALITY: u8 = 85;

/// What is drawn of one plant.
pub(crate) struct Drawn<'a> {
    pub(crate) plant: &'a Plant,
    pub(crate) sighting: Option<&'a Detection>,
    pub(crate) seen: &'a TrackedFrame,
}

/// The folder of overlays and the contact sheet, as far as they are wanted.
pub(crate) struct Drawings {
    folder: Option<PathBuf>,
    sheet: Option<PathBuf>,
    /// Photographs that the sheet shows.
    chosen: Vec<usize>,
    cells: Vec<Image>,
    /// What the sheet shows of each: the plants' regions with a margin.
    view: Option<Region>,
}

impl Drawings {
    pub(crate) fn new(
        folder: Option<&Path>,
        sheet: Option<&Path>,
        plants: &[Plant],
        photographs: usize,
    ) -> Self {
        let count = CELLS.min(photographs);
        // Evenly from the first to the last.
        let chosen = (0..count).map(|cell| cell * (photographs - 1) / (count - 1).max(1)).collect();
        Self {
            folder: folder.map(Path::to_owned),
            sheet: sheet.map(Path::to_owned),
            chosen,
            cells: Vec::new(),
            view: view(plants),
        }
    }

    /// Whether the photograph itself is needed to draw it.
    pub(crate) fn needs(&self, index: usize, name: &str) -> bool {
        let is_drawn = |folder: &PathBuf| folder.join(file_name(name)).exists();
        self.folder.as_ref().is_some_and(|folder| !is_drawn(folder))
            || self.sheet.is_some() && self.chosen.contains(&index)
    }

    /// NoiseStream a photograph.
    pub(crate) fn add(
        &mut self,
        index: usize,
        name: &str,
        image: &Image,
        drawn: &[Drawn<'_>],
        light: Option<Light>,
    ) -> Result<()> {
        if let Some(folder) = &self.folder {
            let jpeg = self::drawn(image, drawn, light).to_jpeg(JPEG_QUALITY)?;
            files::write(&folder.join(file_name(name)), &jpeg)?;
        }
        if self.sheet.is_some() && self.chosen.contains(&index) {
            let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
            let view = self.view.filter(|view| view.fits(image.width, image.height)).unwrap_or(whole);
            let factor = view.width.div_ceil(CELL_COLUMNS).min(view.height);
            let small = filter::downscale(image, view, factor);
            let middle = (factor as f64 - 1.0) / 2.0;
            let place = |pixel: Pixel| {
                let along = |at: f64, start: usize| (at - start as f64 - middle) / factor as f64;
                Pixel::new(along(pixel.x, view.x), along(pixel.y, view.y))
            };
            self.cells.push(draw(&small, drawn, light, place, false));
        }
        Ok(())
    }

    /// Writes the contact sheet, if one is wanted.
    pub(crate) fn finish(&self) -> Result<()> {
        let Some(path) = &self.sheet else { return Ok(()) };
        let sheet = contact_sheet(&self.cells, COLUMNS);
        Ok(files::write(path, &sheet.to_jpeg(JPEG_QUALITY)?)?)
    }
}

/// A photograph with what is seen drawn in.
pub(crate) fn drawn(image: &Image, drawn: &[Drawn<'_>], light: Option<Light>) -> Image {
    draw(image, drawn, light, |pixel| pixel, true)
}

/// A photograph's name as that of an overlay, a JPEG.
fn file_name(name: &str) -> String {
    let flat = name.replace(['/', '\\'], "_");
    let is_jpeg = Path::new(&flat).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("jpg"));
    if is_jpeg { flat } else { flat + ".jpg" }
}

/// The regions of all plants with a margin of an eighth; `None` where a plant has none.
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

/// The marks of all plants over a picture in which the photograph's pixels stand where `place` says.
fn draw(
    image: &Image,
    drawn: &[Drawn<'_>],
    light: Option<Light>,
    place: impl Fn(Pixel) -> Pixel,
    has_regions: bool,
) -> Image {
    let mut picture = image.clone();
    for Drawn { plant, sighting, seen } in drawn {
        let believed = sighting.filter(|_| seen.is_measured()).map(|sighting| {
            let mut sighting = sighting.clone();
            sighting.tip = place(sighting.tip);
            sighting.apex = sighting.apex.map(&place);
            sighting.stem = sighting.stem.map(|stem| stem.into_iter().map(&place).collect());
            sighting
        });
        let held = seen.observation.as_ref().filter(|_| !seen.is_measured());
        let marks = OverlayMarks {
            detection: believed.as_ref(),
            held: held.map(|observation| place(plant.calibration.pixel(observation.tip))),
            crop: plant.region.filter(|_| has_regions),
            base: Some(place(plant.calibration.base)),
            light,
        };
        picture = draw_overlay(&picture, &marks);
    }
    picture
}
