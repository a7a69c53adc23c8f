//! The photographs of a recorded run, in the order in which they were taken: to test a rig file or a controller without a
//! plant. The lamps do not affect them.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::photo::{Photo, natural_order};
use tropism::rig::{Camera, RigError};

use crate::failed;
use crate::settings::CameraSettings;

/// A folder of photographs, read in the order of their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ReplayCamera {
    /// A run folder, or a folder of photographs.
    pub folder: PathBuf,
}

impl CameraSettings for ReplayCamera {
    fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        let of_a_run = self.folder.join("photographs");
        let folder = if of_a_run.is_dir() { of_a_run } else { self.folder.clone() };
        let photographs = photographs(&folder).map_err(|error| cannot_read(&folder, &error))?;
        if photographs.is_empty() {
            let problem =
                format!("{}: there are no photographs (.jpg, .jpeg, .png, .tif, .tiff)", folder.display());
            return Err(failed("camera (replay)", problem));
        }
        Ok(Box::new(OpenReplayCamera { photographs, next: 0 }))
    }

    fn timeout_s(&self) -> f64 {
        0.0
    }
}

/// The photographs in `folder`, in the order of the numbers in their names. Those of a run are named by their steps, in
/// six digits: a step without a photograph is `None`, unless most are missing, and the names mean something else.
fn photographs(folder: &Path) -> std::io::Result<Vec<Option<PathBuf>>> {
    let is_photograph = |path: &PathBuf| {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        matches!(extension.as_deref(), Some("jpg" | "jpeg" | "png" | "tif" | "tiff"))
    };
    let paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    let mut files: Vec<PathBuf> = paths.into_iter().filter(is_photograph).collect();
    files.sort_by_cached_key(|path| natural_order(&path.file_name().unwrap_or_default().to_string_lossy()));
    let step = |path: &PathBuf| path.file_stem()?.to_str().filter(|stem| stem.len() == 6)?.parse().ok();
    let steps: Vec<usize> = files.iter().map_while(step).collect();
    let span = steps.first().zip(steps.last()).map_or(0, |(first, last)| last - first + 1);
    if steps.len() < files.len() || span > 2 * files.len() {
        return Ok(files.into_iter().map(Some).collect());
    }
    let mut photographs = vec![None; span];
    for (step, file) in steps.iter().zip(files) {
        photographs[step - steps[0]] = Some(file);
    }
    Ok(photographs)
}

fn cannot_read(path: &Path, error: &std::io::Error) -> RigError {
    failed("camera (replay)", format!("{}: cannot read: {error}", path.display()))
}

/// An open recording.
pub(crate) struct OpenReplayCamera {
    photographs: Vec<Option<PathBuf>>,
    next: usize,
}

impl Camera for OpenReplayCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let device = "camera (replay)";
        let Some(photograph) = self.photographs.get(self.next) else {
            let problem = format!("the {} photographs are used up", self.photographs.len());
            return Err(failed(device, problem));
        };
        self.next += 1;
        let Some(path) = photograph else {
            return Err(failed(device, "found no photograph of this step in the recording".to_owned()));
        };
        let bytes = fs::read(path).map_err(|error| cannot_read(path, &error))?;
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
            assert!(camera.photograph().unwrap_err().to_string().contains("the 3 photographs are used up"));
        }
        assert!(ReplayCamera { folder: "/no/such".into() }.open().is_err());
    }

    #[test]
    fn a_step_without_a_photograph_stays_one() {
        let folder = tempfile::tempdir().unwrap();
        let names_at = |names: &[&str]| {
            for name in names {
                fs::write(folder.path().join(name), name).unwrap();
            }
            let mut camera = ReplayCamera { folder: folder.path().to_owned() }.open().unwrap();
            let photographs = (0..4).map(|_| camera.photograph().ok());
            let text = |photo: Photo| String::from_utf8(photo.bytes).unwrap();
            photographs.map(|photo| photo.map(text)).collect::<Vec<_>>()
        };
        let named = |name: &str| Some(name.to_owned());
        let run = names_at(&["000007.jpg", "000008.jpg", "000010.jpg"]);
        assert_eq!(run, [named("000007.jpg"), named("000008.jpg"), None, named("000010.jpg")]);
        // Times of the day: nothing is missing.
        let times = names_at(&["130500.jpg"]);
        assert_eq!(times[3], named("130500.jpg"));
    }
}
