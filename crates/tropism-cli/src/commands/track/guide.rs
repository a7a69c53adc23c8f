//! A page on which a newcomer clicks root, scale and region, and copies the command that follows from it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use tropism::geometry::{Pixel, Region};
use tropism::photo::Image;
use tropism::vision::raster::filter;
use tropism_lab::files;

use super::plants::Plant;
use super::series::Shot;

/// The page; what begins it tells that a file is such a page.
const PAGE: &str = include_str!("guide.html");

/// Columns of a picture on the page, at most.
const COLUMNS: usize = 1_600;

const JPEG_QUALITY: u8 = 82;

/// A photograph on the page.
#[derive(Serialize)]
struct Shown {
    name: String,
    /// Pixels of the photograph for one of the page's.
    factor: usize,
    columns: usize,
    rows: usize,
    data: String,
}

/// What the page needs to know.
#[derive(Serialize)]
struct Content<'a> {
    photographs: &'a [PathBuf],
    width: usize,
    height: usize,
    /// What is known already.
    plants: Vec<Placed>,
    px_per_cm: Option<f64>,
    shown: Vec<Shown>,
}

/// A plant that is known already.
#[derive(Serialize)]
struct Placed {
    base: Pixel,
    region: Option<Region>,
}

/// Writes the page for the first, the middle and the last photograph that are whole. `draw` marks what is seen in one of
/// the plants that are known already; `px_per_cm` is a scale that is.
pub(crate) fn write(
    path: &Path,
    photographs: &[PathBuf],
    shots: &[Shot],
    plants: &[Plant],
    px_per_cm: Option<f64>,
    draw: impl Fn(Image) -> Image,
) -> Result<Vec<String>> {
    let is_ours = || files::read_text(path).is_ok_and(|text| text.lines().next() == PAGE.lines().next());
    ensure!(
        !path.exists() || is_ours(),
        "{}: found another file here already, wanted a new name for the page",
        path.display()
    );
    let decode = |shot: &Shot| files::read_photo(&shot.path, shot.time_s).ok()?.decode().ok();
    let Some((first, image)) = shots.iter().enumerate().find_map(|(at, shot)| Some((at, decode(shot)?)))
    else {
        bail!(
            "{}: found no whole photograph among {} files, wanted one",
            shots[0].path.display(),
            shots.len()
        );
    };
    let (width, height) = (image.width, image.height);
    let mut wanted = vec![first, usize::midpoint(first, shots.len() - 1), shots.len() - 1];
    wanted.dedup();
    let mut shown = vec![show(&shots[first], draw(image))?];
    for &at in &wanted[1..] {
        // In place of a damaged one, the next whole one before it.
        let whole = (first + 1..=at).rev().find_map(|at| Some((at, decode(&shots[at])?)));
        let Some((at, image)) = whole.filter(|(_, image)| (image.width, image.height) == (width, height))
        else {
            continue;
        };
        if shown.last().is_none_or(|last| last.name != shots[at].name) {
            shown.push(show(&shots[at], draw(image))?);
        }
    }
    let names = shown.iter().map(|shown| shown.name.clone()).collect();
    let plants =
        plants.iter().map(|plant| Placed { base: plant.calibration.base, region: plant.region }).collect();
    let content = Content { photographs, width, height, plants, px_per_cm, shown };
    // As a string of a script: a name must not end it.
    let json = serde_json::to_string(&content)?.replace('<', "\\u003c");
    files::write(path, PAGE.replacen("/*CONTENT*/", &json, 1).as_bytes())?;
    Ok(names)
}

fn show(shot: &Shot, image: Image) -> Result<Shown> {
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let factor = image.width.div_ceil(COLUMNS).min(image.height);
    let small = filter::downscale(&image, whole, factor);
    let jpeg = small.to_jpeg(JPEG_QUALITY).with_context(|| shot.path.display().to_string())?;
    Ok(Shown {
        name: shot.name.clone(),
        factor,
        columns: small.width,
        rows: small.height,
        data: STANDARD.encode(jpeg),
    })
}
