//! Photographs that another program puts in a folder: a tethered camera (`gphoto2 --capture-tethered`), or replicate
//! software.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use serde::{Deserialize, Serialize};
use tropism::photo::Photo;
use tropism::rig::{Camera, RigError};

use crate::child::run;
use crate::seconds::{Seconds, one};
use crate::settings::CameraSettings;
use crate::{failed, picture};

/// A folder in which a photograph appears.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FolderCamera {
    /// The folder. Only files in it that end in `.jpg`, `.jpeg` or `.png` count.
    pub folder: PathBuf,
    /// A program that triggers the camera, and may wait for the photograph; none if the camera triggers itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trigger: Option<Vec<String>>,
    /// Seconds without a change after which a file is taken to be complete.
    #[serde(default = "one")]
    pub settle_s: Seconds,
    /// Time limit of one photograph, trigger included.
    #[serde(default = "sixty")]
    pub timeout_s: Seconds,
}

const fn sixty() -> Seconds {
    Seconds::new(60.0)
}

/// Polling interval, chosen by hand. Change notifications do not work on network file systems.
const POLL: Duration = Duration::from_millis(50);

/// Path, length and modification time of files: another state is another photograph.
type Known = Vec<(PathBuf, u64, SystemTime)>;

impl CameraSettings for FolderCamera {
    fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        Ok(Box::new(self.clone()))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }
}

impl FolderCamera {
    fn error(&self, problem: String) -> RigError {
        failed(format!("camera ({})", self.folder.display()), problem)
    }

    fn files(&self) -> Result<Known, RigError> {
        let entries =
            fs::read_dir(&self.folder).map_err(|error| self.error(format!("cannot be read: {error}")))?;
        let mut files = Known::new();
        for path in entries.flatten().map(|entry| entry.path()).filter(|path| is_picture(path)) {
            // A file may be renamed between listing and reading.
            // A pipe would be waited for without end, and a file of such a size is no photograph.
            let about = fs::metadata(&path).ok();
            if let Some(about) = about.filter(|about| about.is_file() && about.len() <= MOST_BYTES) {
                files.push((path, about.len(), about.modified().unwrap_or(SystemTime::UNIX_EPOCH)));
            }
        }
        Ok(files)
    }
}

/// The largest file that is taken for a photograph, in bytes: the bound of `max_bytes` of network cameras.
const MOST_BYTES: u64 = 100_000_000;

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| ["jpg", "jpeg", "png"].contains(&ending.as_str()))
}

impl Camera for FolderCamera {
    /// The newest file that was not there before, once it is complete and no longer changes.
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let deadline = Instant::now() + self.timeout_s.duration();
        let known = self.files()?;
        if let Some(words) = &self.trigger {
            run("camera", words, self.timeout_s.duration())?;
        }
        let mut problem = "found no new photograph".to_owned();
        let mut candidate: Option<((PathBuf, u64, SystemTime), Instant)> = None;
        while Instant::now() < deadline {
            let newest =
                self.files()?.into_iter().filter(|file| !known.contains(file)).max_by_key(|file| file.2);
            match (newest, &candidate) {
                (Some(file), Some((before, since))) if file == *before => {
                    if since.elapsed() >= self.settle_s.duration() {
                        let bytes = fs::read(&file.0)
                            .map_err(|error| self.error(format!("{}: {error}", file.0.display())))?;
                        match picture::check(&bytes) {
                            Ok(()) => return Ok(Photo { name: String::new(), bytes, time_s: 0.0 }),
                            // The writer may only have paused: continue until the deadline.
                            Err(cause) => problem = format!("{}: {cause}", file.0.display()),
                        }
                    }
                }
                (Some(file), _) => candidate = Some((file, Instant::now())),
                (None, _) => candidate = None,
            }
            thread::sleep(POLL.min(self.settle_s.duration().max(Duration::from_millis(1))));
        }
        Err(self.error(format!("{problem} after {:?}, wanted a whole one", self.timeout_s.duration())))
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::Write;

    use super::*;
    use crate::picture::tests::jpeg;

    fn camera(folder: &Path, more: &str) -> FolderCamera {
        toml::from_str(&format!("folder = {folder:?}\nsettle_s = 0.1\n{more}")).unwrap()
    }

    #[test]
    fn waits_for_a_new_file_until_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("old.jpg"), jpeg(1)).unwrap();
        let mut camera = camera(folder.path(), "timeout_s = 30");
        let (start, slow) = (path("new.JPG"), path("not-a-picture.txt"));
        let writer = thread::spawn(move || {
            fs::write(slow, "not this").unwrap();
            let (whole, mut file) = (jpeg(2), File::create(start).unwrap());
            // In two halves, with a pause longer than a whole file may take to settle.
            file.write_all(&whole[..300]).unwrap();
            thread::sleep(Duration::from_millis(400));
            file.write_all(&whole[300..]).unwrap();
        });
        assert_eq!(camera.photograph().unwrap().bytes, jpeg(2));
        writer.join().unwrap();
    }

    #[test]
    fn the_trigger_may_bring_the_photograph_under_the_name_of_the_last() {
        let folder = tempfile::tempdir().unwrap();
        let source = tempfile::tempdir().unwrap();
        let bring = |seed: usize| fs::write(source.path().join("next.jpg"), jpeg(seed)).unwrap();
        let words = format!(
            "trigger = [\"sh\", \"-c\", \"cp {0}/next.jpg {1}/tmp && mv {1}/tmp {1}/capt0000.jpg\"]\ntimeout_s = 30",
            source.path().display(),
            folder.path().display()
        );
        let mut camera = camera(folder.path(), &words);
        for seed in 1..3 {
            bring(seed);
            assert_eq!(camera.photograph().unwrap().bytes, jpeg(seed));
        }
    }

    #[test]
    fn a_photograph_that_does_not_come_or_stays_half_is_given_up() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("old.jpg"), jpeg(1)).unwrap();
        let error = camera(folder.path(), "timeout_s = 0.2").photograph().unwrap_err().to_string();
        assert!(error.contains("found no new photograph after 200ms"), "{error}");
        let half = folder.path().join("half.jpg");
        let words = format!("trigger = [\"sh\", \"-c\", \"printf abc > {}\"]\ntimeout_s = 1", half.display());
        let error = camera(folder.path(), &words).photograph().unwrap_err().to_string();
        assert!(error.contains("half.jpg: found \"abc\", wanted a JPEG"), "{error}");
        let error = camera(Path::new("/no/such/folder"), "").photograph().unwrap_err().to_string();
        assert!(error.contains("/no/such/folder") && error.contains("cannot be read"), "{error}");
    }
}
