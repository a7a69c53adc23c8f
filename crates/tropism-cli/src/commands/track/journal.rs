//! What was made of each photograph by itself, written down as it comes: a line a photograph.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use tropism::geometry::Pixel;
use tropism::lamps::Light;
use tropism::vision::{Detection, FrameStatus};

const SCHEMA: &str = "tropism.frames/1";

/// The first line.
#[derive(PartialEq, Serialize, Deserialize)]
struct Head {
    schema: String,
    /// Of all that decides what is made of a photograph by itself.
    settings_sha256: String,
}

/// One photograph, judged by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Judged {
    pub(crate) frame: String,
    /// Of the file's bytes; empty where it could not be read.
    pub(crate) sha256: String,
    /// The lamp that is lit in the picture.
    pub(crate) light: Option<Light>,
    /// What is wrong with the file.
    pub(crate) problem: Option<String>,
    /// What is seen of each plant.
    pub(crate) plants: Vec<Looked>,
}

impl Judged {
    /// Its line in the journal.
    pub(crate) fn line(&self) -> Result<String> {
        Ok(serde_json::to_string(self)? + "\n")
    }
}

/// What a photograph shows of one plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Looked {
    pub(crate) class: FrameStatus,
    pub(crate) sighting: Option<Detection>,
}

impl Looked {
    /// What vision says, to a thousandth of a pixel, so that a line of the journal holds all of it.
    pub(crate) fn new(found: Result<Detection, FrameStatus>) -> Self {
        let rounded = |value: f64| (value * 1e3).round() / 1e3;
        let place = |pixel: Pixel| Pixel::new(rounded(pixel.x), rounded(pixel.y));
        match found {
            Err(class) => Self { class, sighting: None },
            Ok(mut sighting) => {
                sighting.tip = place(sighting.tip);
                sighting.apex = sighting.apex.map(place);
                sighting.stem = sighting.stem.map(|stem| stem.into_iter().map(place).collect());
                Self { class: FrameStatus::Ok, sighting: Some(sighting) }
            }
        }
    }

    pub(crate) fn found(&self) -> Result<Detection, FrameStatus> {
        self.sighting.clone().ok_or(self.class)
    }
}

/// The journal's file, and where in it the line of each photograph stands.
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
    lines: BTreeMap<String, (u64, usize)>,
}

impl Journal {
    /// A new journal in `path`, or with `is_resumed` the one that is there, if it was begun with the same settings.
    pub(crate) fn open(path: &Path, settings_sha256: &str, is_resumed: bool) -> Result<Self> {
        let wanted = Head { schema: SCHEMA.to_owned(), settings_sha256: settings_sha256.to_owned() };
        let is_there = is_resumed && path.exists();
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create(true).truncate(!is_there).open(path);
        let file = file.with_context(|| format!("{}: cannot write", path.display()))?;
        let mut journal = Self { path: path.to_owned(), file, lines: BTreeMap::new() };
        if is_there {
            journal.read(&wanted)?;
        } else {
            journal.write(&(serde_json::to_string(&wanted)? + "\n"))?;
        }
        Ok(journal)
    }

    /// Finds the lines that are whole, and cuts off one that is not.
    fn read(&mut self, wanted: &Head) -> Result<()> {
        let mut lines = BufReader::new(&self.file);
        let (mut line, mut end) = (String::new(), 0);
        while lines.read_line(&mut line).unwrap_or(0) > 0 && line.ends_with('\n') {
            if end == 0 {
                let is_same = serde_json::from_str::<Head>(&line).is_ok_and(|found| found == *wanted);
                ensure!(
                    is_same,
                    "{}: found photographs that were judged with other settings or by another version, wanted the same \
                     for --resume; use another name, or --force to begin anew",
                    self.path.display()
                );
            } else {
                let Ok(judged) = serde_json::from_str::<Judged>(&line) else { break };
                self.lines.insert(judged.frame, (end, line.len()));
            }
            end += line.len() as u64;
            line.clear();
        }
        ensure!(
            end > 0,
            "{}: found no line, wanted a journal of photographs; --force begins anew",
            self.path.display()
        );
        self.file
            .set_len(end)
            .and_then(|()| self.file.seek(SeekFrom::End(0)))
            .with_context(|| self.says("write"))?;
        Ok(())
    }

    /// What was made of the photograph `frame`, if its bytes are the same.
    pub(crate) fn find(&mut self, frame: &str, sha256: &str) -> Result<Option<Judged>> {
        let Some(&(start, length)) = self.lines.get(frame) else { return Ok(None) };
        let mut line = vec![0; length];
        let mut read = || {
            self.file.seek(SeekFrom::Start(start))?;
            self.file.read_exact(&mut line)?;
            self.file.seek(SeekFrom::End(0))
        };
        read().with_context(|| format!("{}: cannot read", self.path.display()))?;
        let judged: Judged = serde_json::from_slice(&line).with_context(|| self.says("read"))?;
        Ok(Some(judged).filter(|judged| judged.sha256 == sha256 && !sha256.is_empty()))
    }

    /// Adds the lines of photographs; they are with the system when it returns.
    pub(crate) fn add(&mut self, lines: &[&str]) -> Result<()> {
        self.write(&lines.concat())
    }

    /// Takes the file away: nothing in it is worth going on with.
    pub(crate) fn remove(&self) -> Result<()> {
        std::fs::remove_file(&self.path).with_context(|| self.says("remove"))
    }

    fn write(&mut self, text: &str) -> Result<()> {
        self.file.write_all(text.as_bytes()).with_context(|| self.says("write"))
    }

    fn says(&self, action: &str) -> String {
        format!("{}: cannot {action}", self.path.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(frame: &str) -> Judged {
        let sighting = Detection {
            tip: Pixel::new(1.0 / 3.0, 2.0),
            apex: Some(Pixel::new(0.1, 0.2)),
            stem: Some(vec![Pixel::new(5.0, 6.123_456)]),
            contrast: 17.3,
            ..Detection::default()
        };
        Judged {
            frame: frame.to_owned(),
            sha256: format!("of {frame}"),
            light: Some(Light::LEFT),
            problem: None,
            plants: vec![Looked::new(Ok(sighting)), Looked::new(Err(FrameStatus::NoPlant))],
        }
    }

    #[test]
    fn what_was_written_is_found_again_and_half_a_line_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("track.frames.jsonl");
        let mut journal = Journal::open(&path, "settings", false).unwrap();
        journal.add(&[&judged("a").line().unwrap(), &judged("b").line().unwrap()]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        let mut journal = Journal::open(&path, "settings", true).unwrap();
        assert_eq!(journal.find("a", "of a").unwrap(), Some(judged("a")));
        assert_eq!(journal.find("a", "of another").unwrap(), None);
        assert_eq!(journal.find("b", "of b").unwrap(), None);
        journal.add(&[&judged("b").line().unwrap()]).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let mut journal = Journal::open(&path, "settings", true).unwrap();
        assert_eq!(journal.find("b", "of b").unwrap(), Some(judged("b")));
    }

    #[test]
    fn other_settings_and_other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("track.frames.jsonl");
        Journal::open(&path, "settings", false).unwrap();
        let error = |settings| Journal::open(&path, settings, true).err().unwrap().to_string();
        assert!(error("others").contains("other settings"));
        std::fs::write(&path, "").unwrap();
        assert!(error("settings").contains("found no line"));
        std::fs::write(&path, "step,tip\n1,2\n").unwrap();
        assert!(error("settings").contains("other settings"));
    }
}
