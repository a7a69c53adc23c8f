//! A record of the light of an experiment: which lamp was lit from when on, for plants whose tracks do not say.

use std::path::Path;

use tropism::lamps;
use tropism::lighting::Lighting;
use tropism::track::Track;

use crate::Error;
use crate::files::{self, FileError};

/// Hours from the first photograph on, and the lighting from then on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LightRecord(Vec<(f64, Lighting)>);

/// The columns.
const HEADER: &str = "time_h,light";

impl LightRecord {
    /// Reads a CSV file with the columns `time_h` and `light`.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let problem = |text: String| FileError::content(path, text);
        let text = files::read_text(path)?;
        // Spreadsheets write a byte order mark.
        let mut lines = text.strip_prefix('\u{feff}').unwrap_or(&text).lines();
        let header = lines.next().unwrap_or_default().trim();
        if header != HEADER {
            return Err(problem(format!("found the header {header:?}, wanted {HEADER:?}")).into());
        }
        let mut rows: Vec<(f64, Lighting)> = Vec::new();
        for (number, line) in (2..).zip(lines).filter(|(_, line)| !line.trim().is_empty()) {
            let row = line.split_once(',').and_then(|(time, word)| {
                let time: f64 = time.trim().parse().ok().filter(|time: &f64| time.is_finite())?;
                Some((time, lamps::parse(word.trim()).ok()?))
            });
            let (time, light) = row.ok_or_else(|| {
                problem(format!("line {number}: found {line:?}, wanted hours and left, right or dark"))
            })?;
            if rows.last().is_some_and(|&(before, _)| before >= time) {
                return Err(
                    problem(format!("line {number}: time_h must be later than in the row before")).into()
                );
            }
            rows.push((time, light.into()));
        }
        if rows.is_empty() {
            return Err(problem("there is no row: give the light from 0 h on".to_owned()).into());
        }
        Ok(Self(rows))
    }

    /// Lights the samples of a track by this record; before its first row they are dark. Times of both begin with the first
    /// photograph, in which the plant may not have been seen yet.
    pub(super) fn light(&self, track: &mut Track) {
        for sample in &mut track.samples {
            let time_h = sample.time_s / 3600.0;
            let past = self.0.partition_point(|&(from, _)| from <= time_h + 1e-9);
            sample.set_lighting(past.checked_sub(1).map_or(Lighting::DARK, |row| self.0[row].1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_row_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.csv");
        for (text, wanted) in [
            ("time,light\n", "wanted \"time_h,light\""),
            ("time_h,light\n0,up\n", "line 2: found \"0,up\", wanted hours and left, right or dark"),
            ("time_h,light\n0,left\n0,dark\n", "line 3: time_h must be later"),
            ("time_h,light\n", "there is no row"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = LightRecord::read(&path).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
    }
}
