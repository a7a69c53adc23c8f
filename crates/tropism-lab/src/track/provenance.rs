//! Whether photographs and tracks are of a virtual plant, as the files beside them say.

use std::path::Path;

use serde::Deserialize;

use super::series::Frame;
use crate::files;

/// The part of a run's `run.toml` and of a track's JSON file that says what kind of plant it is.
#[derive(Deserialize)]
struct Provenance {
    is_virtual: bool,
}

/// Whether the JSON file beside a track says that the plant is virtual.
#[must_use]
pub fn is_virtual(track: &Path) -> bool {
    let text = files::read_text(&track.with_extension("json"));
    text.is_ok_and(|text| serde_json::from_str::<Provenance>(&text).is_ok_and(|file| file.is_virtual))
}

/// Whether photographs lie in the run folder of a virtual plant or in a folder inside it, or say themselves that they are of the
/// virtual tent.
pub(super) fn are_virtual(frames: &[Frame]) -> bool {
    let mut folders: Vec<&Path> = frames.iter().filter_map(|frame| frame.path.parent()).collect();
    folders.dedup();
    let with_parents = folders.iter().flat_map(|folder| [Some(*folder), folder.parent()]).flatten();
    with_parents
        .map(|folder| files::read_toml::<Provenance>(&folder.join("run.toml")))
        .any(|run| run.is_ok_and(|run| run.is_virtual))
        || frames.iter().any(|frame| files::read_header(&frame.path).is_ok_and(|header| header.is_virtual))
}
