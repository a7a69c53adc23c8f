//! Which lamp is lit in each photograph: read from the picture, or from a table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::lamps::{self, Light};
use tropism::text::of_csv_cell;

use super::series::{Frame, file_name};
use crate::{Error, files};

/// What says which lamp is lit.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightSource {
    /// The pictures: the lamps are in view.
    #[default]
    Auto,
    /// Nothing: no lamp is in view, and no row of the track names one.
    None,
    /// A CSV file with the columns `frame` and `light`.
    File(PathBuf),
}

impl LightSource {
    /// The light of each photograph; `None` if the pictures are to say.
    pub(super) fn read(&self, frames: &[Frame]) -> Result<Option<Vec<Option<Light>>>, Error> {
        match self {
            Self::Auto => Ok(None),
            Self::None => Ok(Some(vec![None; frames.len()])),
            Self::File(path) => read_table(path, frames).map(Some),
        }
    }
}

impl std::fmt::Display for LightSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.pad("auto"),
            Self::None => f.pad("none"),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

fn read_table(path: &Path, frames: &[Frame]) -> Result<Vec<Option<Light>>, Error> {
    let file = path.display();
    let text = files::read_text(path)?;
    // Spreadsheets write a byte order mark.
    let mut lines = text.strip_prefix('\u{feff}').unwrap_or(&text).lines();
    let header = lines.next().unwrap_or_default().trim();
    if header != "frame,light" {
        return Err(Error::Plan(format!("{file}: found the header {header:?}, wanted \"frame,light\"")));
    }
    let mut lights = BTreeMap::new();
    for (index, line) in lines.enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        // Lines are counted from 1, and the first is the header.
        let number = index + 2;
        let row = line.split_once(',').and_then(|(frame, word)| {
            let light = lamps::parse(word.trim()).ok()?;
            Some((of_csv_cell(frame.trim()), light))
        });
        let (frame, light) = row.ok_or_else(|| {
            Error::Plan(format!(
                "{file}, line {number}: found {line:?}, wanted a frame and left, right or dark"
            ))
        })?;
        if let Some((_, first)) = lights.insert(frame, (light, number)) {
            return Err(Error::Plan(format!(
                "{file}, line {number}: the frame of line {first} again, wanted one row a photograph"
            )));
        }
    }
    let light_of = |frame: &Frame| {
        let name = file_name(&frame.path);
        let stem = frame.path.file_stem().unwrap_or_default().to_string_lossy();
        let names = [frame.name.as_str(), &name, stem.as_ref()];
        let light = names.into_iter().find_map(|name| lights.get(name)).map(|(light, _)| *light);
        light.ok_or_else(|| Error::Plan(format!("{file}: there is no row for frame {name}")))
    };
    frames.iter().map(light_of).collect()
}
