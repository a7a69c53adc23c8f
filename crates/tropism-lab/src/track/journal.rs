//! The detections of each photograph, written down as they come: a JSON line a photograph.
//!
//! A line depends on nothing but its photograph and the settings, so lines may be used again by a resumed plan.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tropism::lamps::Light;
use tropism::vision::{Detection, FrameStatus};

use crate::Error;
use crate::difference::differences;
use crate::files::{disk, make_folder_of};

const SCHEMA: &str = "tropism.frames/2";

/// The first line.
#[derive(Serialize)]
struct Head<'a, S> {
    schema: &'static str,
    /// What decides the detections.
    settings: &'a S,
}

/// The detections in one photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FrameDetections {
    pub(super) frame: String,
    /// Of the file's bytes; empty if the file could not be read.
    pub(super) sha256: String,
    /// The lamp that is lit in the picture.
    pub(super) light: Option<Light>,
    /// What is wrong with the file.
    pub(super) problem: Option<String>,
    /// One detection a plant.
    pub(super) plants: Vec<PlantDetection>,
}

impl FrameDetections {
    /// The line of the journal.
    pub(super) fn line(&self) -> Result<String, Error> {
        let line = serde_json::to_string(self).map_err(Error::at(&self.frame))?;
        Ok(line + "\n")
    }
}

/// The detection of one plant in one photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlantDetection {
    pub(super) class: FrameStatus,
    pub(super) detected: Option<Detection>,
}

impl PlantDetection {
    /// A detection [rounded](Detection::rounded), so that a line of the journal holds all of it.
    pub(super) fn new(detected: Result<Detection, FrameStatus>) -> Self {
        match detected {
            Err(class) => Self { class, detected: None },
            Ok(detected) => Self { class: FrameStatus::Ok, detected: Some(detected.rounded()) },
        }
    }

    /// The detection, or the reason why there is none.
    pub(super) fn result(&self) -> Result<Detection, FrameStatus> {
        self.detected.clone().ok_or(self.class)
    }
}

/// The journal's file, and where each photograph's line stands in it.
pub(super) struct FrameJournal {
    path: PathBuf,
    file: File,
    /// Offset and length of a line, by the name of its photograph.
    lines: BTreeMap<String, (u64, usize)>,
}

impl FrameJournal {
    /// Begins a journal at `path`, or with `is_resumed` opens the one there, if it has the same settings.
    pub(super) fn open(path: &Path, settings: &impl Serialize, is_resumed: bool) -> Result<Self, Error> {
        let head = serde_json::to_string(&Head { schema: SCHEMA, settings });
        let head = head.map_err(Error::at(path.display()))? + "\n";
        let exists = is_resumed && path.exists();
        make_folder_of(path)?;
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create(true).truncate(!exists).open(path);
        let file = file.map_err(disk("write", path))?;
        let mut journal = Self { path: path.to_owned(), file, lines: BTreeMap::new() };
        if exists {
            journal.index(&head)?;
        } else {
            journal.write(&head)?;
        }
        Ok(journal)
    }

    /// Finds the whole lines, of which the first must be `head`, and cuts off an incomplete one at the end.
    fn index(&mut self, head: &str) -> Result<(), Error> {
        let refuse = |problem: &str| Error::Plan(format!("{}: {problem}", self.path.display()));
        let mut lines = BufReader::new(&self.file);
        let (mut line, mut end) = (String::new(), 0);
        while lines.read_line(&mut line).unwrap_or(0) > 0 && line.ends_with('\n') {
            if end == 0 {
                let Ok(found) = serde_json::from_str::<Value>(&line) else { break };
                if line != head {
                    let wanted: Value = serde_json::from_str(head).map_err(Error::at(self.path.display()))?;
                    let differences = differences(&found, &wanted).replace("`settings.", "`");
                    return Err(refuse(&format!(
                        "found photographs that were judged with other settings{differences}; wanted the same for \
                         `resume`; use another name, or `replace` to begin anew"
                    )));
                }
            } else {
                let Ok(detections) = serde_json::from_str::<FrameDetections>(&line) else { break };
                self.lines.insert(detections.frame, (end, line.len()));
            }
            end += line.len() as u64;
            line.clear();
        }
        if end == 0 {
            return Err(refuse("there is no journal of photographs: `replace` begins anew"));
        }
        let cut = self.file.set_len(end).and_then(|()| self.file.seek(SeekFrom::End(0)));
        cut.map_err(disk("write", &self.path))?;
        Ok(())
    }

    /// The detections in the photograph `frame`, if its bytes are the same.
    pub(super) fn find(&mut self, frame: &str, sha256: &str) -> Result<Option<FrameDetections>, Error> {
        let Some(&(start, length)) = self.lines.get(frame) else { return Ok(None) };
        let mut line = vec![0; length];
        let mut read = || {
            self.file.seek(SeekFrom::Start(start))?;
            self.file.read_exact(&mut line)?;
            self.file.seek(SeekFrom::End(0))
        };
        read().map_err(disk("read", &self.path))?;
        let detections: FrameDetections =
            serde_json::from_slice(&line).map_err(Error::at(self.path.display()))?;
        Ok(Some(detections).filter(|found| found.sha256 == sha256 && !sha256.is_empty()))
    }

    /// Adds the lines of photographs. When it returns, the operating system has them.
    pub(super) fn add(&mut self, lines: &[&str]) -> Result<(), Error> {
        self.write(&lines.concat())
    }

    /// Removes the file, when nothing in it is worth resuming.
    pub(super) fn remove(&self) -> Result<(), Error> {
        Ok(std::fs::remove_file(&self.path).map_err(disk("remove", &self.path))?)
    }

    fn write(&mut self, text: &str) -> Result<(), Error> {
        Ok(self.file.write_all(text.as_bytes()).map_err(disk("write", &self.path))?)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use tropism::geometry::Pixel;

    use super::*;

    fn detections(frame: &str) -> FrameDetections {
        let detected = Detection {
            tip: Pixel::new(1.0 / 3.0, 2.0),
            apex: Some(Pixel::new(0.1, 0.2)),
            stem: Some(vec![Pixel::new(5.0, 6.123_456)]),
            contrast: 17.3,
            ..Detection::default()
        };
        FrameDetections {
            frame: frame.to_owned(),
            sha256: format!("of {frame}"),
            light: Some(Light::LEFT),
            problem: None,
            plants: vec![PlantDetection::new(Ok(detected)), PlantDetection::new(Err(FrameStatus::NoPlant))],
        }
    }

    #[test]
    fn what_was_written_is_found_again_and_half_a_line_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("track.frames.jsonl");
        let mut journal = FrameJournal::open(&path, &"settings", false).unwrap();
        journal.add(&[&detections("a").line().unwrap(), &detections("b").line().unwrap()]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        let mut journal = FrameJournal::open(&path, &"settings", true).unwrap();
        assert_eq!(journal.find("a", "of a").unwrap(), Some(detections("a")));
        assert_eq!(journal.find("a", "of another").unwrap(), None);
        assert_eq!(journal.find("b", "of b").unwrap(), None);
        journal.add(&[&detections("b").line().unwrap()]).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let mut journal = FrameJournal::open(&path, &"settings", true).unwrap();
        assert_eq!(journal.find("b", "of b").unwrap(), Some(detections("b")));
    }

    #[test]
    fn other_settings_and_other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("track.frames.jsonl");
        let settings = |sigma: f64| json!({ "vision": { "sigma": sigma }, "version": "0.1.0" });
        FrameJournal::open(&path, &settings(1.0), false).unwrap();
        let error = |sigma| FrameJournal::open(&path, &settings(sigma), true).err().unwrap().to_string();
        assert!(
            error(2.0).contains("with other settings: `vision.sigma` = 1.0, wanted 2.0;"),
            "{}",
            error(2.0)
        );
        for other in ["", "step,tip\n1,2\n"] {
            std::fs::write(&path, other).unwrap();
            assert!(error(1.0).contains("there is no journal"));
        }
        std::fs::write(&path, "{\"schema\":\"tropism.frames/1\"}\n").unwrap();
        assert!(error(1.0).contains("`schema` = \"tropism.frames/1\", wanted \"tropism.frames/2\";"));
    }
}
