//! The photographs of a recorded run, in the order in which they were taken: to try a rig file or a controller without a
//! plant. What the lamps do changes nothing in them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::experiment::files;
use tropism::photo::Photo;
use tropism::rig::{Camera, RigError};

use crate::failed;

/// A folder of photographs, taken up by their names.
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
        let files =
            files::photographs(&[folder]).map_err(|error| failed("camera (replay)", error.to_string()))?;
        Ok(OpenReplayCamera { files, next: 0 })
    }
}

/// The photographs that are left.
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
        let bytes = files::read(path).map_err(|error| failed("camera (replay)", error.to_string()))?;
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
    use std::fs;

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
