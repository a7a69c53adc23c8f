//! The pictures of a film, taken out by ffmpeg.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use super::{FileError, disk, list, name_text};

/// All pictures of a film in their order, as JPEG files of the best quality in a folder that goes with its handle.
///
/// # Errors
/// [`FileError`] if ffmpeg is not there, with how to get it, or cannot read the film, with its first line.
pub(super) fn pictures(film: &Path) -> Result<(TempDir, Vec<PathBuf>), FileError> {
    let folder = tempfile::Builder::new()
        .prefix("tropism-film-")
        .tempdir()
        .map_err(disk("make a folder for", film))?;
    let name = name_text(film.file_name().unwrap_or_default()).replace('%', "%%");
    // Each picture once, whatever its time says. Versions before 5.1 have another name for it, which 8 no longer knows.
    let mut problem = String::new();
    for timing in ["-fps_mode", "-vsync"] {
        let mut command = Command::new("ffmpeg");
        command.args(["-nostdin", "-v", "error", "-i"]).arg(film);
        command.args([
            "-map",
            "0:v:0",
            timing,
            "passthrough",
            "-q:v",
            "1",
            "-qmin",
            "1",
            "-start_number",
            "0",
        ]);
        command.arg(folder.path().join(format!("{name}#%06d.jpg")));
        let output = command.stdin(Stdio::null()).output().map_err(|error| match error.kind() {
            ErrorKind::NotFound => FileError::content(
                film,
                "found a film, which ffmpeg turns into photographs, but no ffmpeg: install it (`apt install ffmpeg`), or make \
                 photographs elsewhere with `ffmpeg -i FILM frames/%06d.jpg`",
            ),
            _ => disk("run ffmpeg on", film)(error),
        })?;
        if output.status.success() {
            let pictures = list(folder.path(), "jpg")?;
            if pictures.is_empty() {
                break;
            }
            return Ok((folder, pictures));
        }
        problem = String::from_utf8_lossy(&output.stderr).lines().next().unwrap_or_default().to_owned();
        if !problem.contains("fps_mode") {
            break;
        }
    }
    Err(FileError::content(film, format!("the film has no picture (ffmpeg: {problem})")))
}
