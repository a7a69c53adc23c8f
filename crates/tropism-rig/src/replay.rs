//! The photographs of a recorded run, in the order in which they were taken: to test a rig file or a controller without a
//! plant. The lamps do not affect them.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::photo::{Photo, natural_order};
use tropism::rig::{Camera, RigError};

use crate::failed;

/// A folder of photographs, read in the order of their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReplayCamera {
    /// A run folder, or a folder of photographs.
    pub folder: PathBuf,
}

impl ReplayCamera {
    pub(crate) fn open(&self) -> Result<OpenReplayCamera, RigError> {
        let of_a_run = self.folder.join("photographs");
        let folder = if of_a_run.is_dir() { of_a_run } else { self.folder.clone() };
        let files = photographs(&folder).map_err(|error| cannot_read(&folder, &error))?;
        if files.is_empty() {
            let problem = format!(
                "{}: found no .jpg, .jpeg, .png, .tif or .tiff file, wanted photographs",
                folder.display()
            );
            return Err(failed("camera (replay)", problem));
        }
        Ok(OpenReplayCamera { files, next: 0 })
    }
}

/// The photographs in `folder`, in the order of the numbers in their names.
fn photographs(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let is_photograph = |path: &PathBuf| {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        matches!(extension.as_deref(), Some("jpg" | "jpeg" | "png" | "tif" | "tiff"))
    };
    let paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    let mut files: Vec<PathBuf> = paths.into_iter().filter(is_photograph).collect();
    files.sort_by_cached_key(|path| natural_order(&path.file_name().unwrap_or_default().to_string_lossy()));
    Ok(files)
}

fn cannot_read(path: &Path, error: &std::io::Error) -> RigError {
    failed("camera (replay)", format!("{}: cannot read: {error}", path.display()))
}

/// An open recording.
pub(crate) struct OpenReplayCamera {
    files: Vec<PathBuf>,
    next: usize,
}

impl Camera for OpenReplayCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let Some(path) = self.files.get(self.next) else {
            let problem = format!("found only {} photographs, wanted one more", self.files.len());
            return Err(failed("camera (replay)", problem));
        };
        let bytes = fs::read(path).map_err(|error| cannot_read(path, &error))?;
        self.next += 1;
        Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
    }

    fn can_repeat(&self) -> bool {
        false
    }

    fn skip(&mut self) {
        self.next += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_the_photographs_in_order_and_goes_on_where_a_run_stopped() {
        let run = tempfile::tempdir().unwrap();
        let photographs = run.path().join("photographs");
        fs::create_dir(&photographs).unwrap();
        for name in ["000001.jpg", "000000.jpg", "000002.jpg", "notes.txt"] {
            fs::write(photographs.join(name), name).unwrap();
        }
        for folder in [run.path(), &photographs] {
            let mut camera = ReplayCamera { folder: folder.to_owned() }.open().unwrap();
            assert_eq!(camera.photograph().unwrap().bytes, b"000000.jpg");
            camera.skip();
            assert_eq!(camera.photograph().unwrap().bytes, b"000002.jpg");
            assert!(camera.photograph().unwrap_err().to_string().contains("found only 3"));
        }
        assert!(ReplayCamera { folder: "/no/such".into() }.open().is_err());
    }
}
