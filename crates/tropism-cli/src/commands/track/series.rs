//! Photographs in order, and when each was taken.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::ValueEnum;
use rayon::prelude::*;
use serde::Serialize;
use tropism::math::statistics::upper_median;
use tropism::photo::time_in_name;
use tropism::track::PAPER_PERIOD_MIN;
use tropism_lab::files;

/// What tells when a photograph was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TimeFrom {
    /// Exif headers, else names, else neither
    Auto,
    /// The camera's clock, in the Exif headers
    Exif,
    /// The names of the files
    Name,
    /// Neither: one photograph every --period, in the order of the numbers in their names
    Even,
}

/// A photograph of a series.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shot {
    pub(crate) path: PathBuf,
    /// The file's name, or the path as given where two files have the same.
    pub(crate) name: String,
    /// Periods since the first: 1 more than the photograph before, or more where some are missing between them.
    pub(crate) step: u32,
    pub(crate) time_s: f64,
}

/// Photographs in the order in which they were taken.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    pub(crate) shots: Vec<Shot>,
    /// What the times are from; never [`TimeFrom::Auto`].
    pub(crate) time_from: TimeFrom,
    pub(crate) period_min: f64,
    /// How many stand elsewhere than by the numbers in their names.
    pub(crate) moved: usize,
}

impl Series {
    /// The photographs of `paths`, which stand in the order of their names.
    pub(crate) fn read(paths: &[PathBuf], wanted: TimeFrom, period_min: Option<f64>) -> Result<Self> {
        let exif = || -> Vec<Option<f64>> {
            paths.par_iter().map(|path| files::read_header(path).ok()?.taken_s).collect()
        };
        let named =
            || -> Vec<Option<f64>> { paths.iter().map(|path| time_in_name(&file_name(path))).collect() };
        let (time_from, times) = match wanted {
            TimeFrom::Even => (TimeFrom::Even, None),
            TimeFrom::Exif => (TimeFrom::Exif, Some(exif())),
            TimeFrom::Name => (TimeFrom::Name, Some(named())),
            TimeFrom::Auto => [(TimeFrom::Exif, exif()), (TimeFrom::Name, named())]
                .into_iter()
                .find(|(_, times)| are_telling(times))
                .map_or((TimeFrom::Even, None), |(from, times)| (from, Some(times))),
        };
        let Some(times) = times else { return Ok(Self::even(paths, period_min.unwrap_or(PAPER_PERIOD_MIN))) };
        if !are_telling(&times) {
            let found = times.iter().flatten().count();
            let place = if time_from == TimeFrom::Exif { "Exif headers" } else { "names" };
            bail!(
                "found times in the {place} of {found} of {} photographs, wanted different ones in most",
                paths.len()
            );
        }
        Ok(Self::timed(paths, time_from, &times, period_min))
    }

    fn even(paths: &[PathBuf], period_min: f64) -> Self {
        let shots = names(paths).into_iter().zip(paths).enumerate().map(|(index, (name, path))| Shot {
            path: path.clone(),
            name,
            step: index as u32,
            time_s: index as f64 * period_min * 60.0,
        });
        Self { shots: shots.collect(), time_from: TimeFrom::Even, period_min, moved: 0 }
    }

    fn timed(paths: &[PathBuf], time_from: TimeFrom, times: &[Option<f64>], period_min: Option<f64>) -> Self {
        let period_min = period_min.or_else(|| median_interval(times).map(|seconds| seconds / 60.0));
        let period_min = period_min.unwrap_or(PAPER_PERIOD_MIN);
        let times = complete(times, period_min * 60.0);
        let mut order: Vec<usize> = (0..paths.len()).collect();
        order.sort_by(|&a, &b| times[a].total_cmp(&times[b]).then(a.cmp(&b)));
        let names = names(paths);
        let mut shots: Vec<Shot> = Vec::with_capacity(paths.len());
        for &index in &order {
            let time_s = times[index] - times[order[0]];
            // Photographs that follow each other faster are a step each: no two rows of a track are the same step.
            let step = shots.last().map_or(0, |last| {
                last.step + ((time_s - last.time_s) / (period_min * 60.0)).round().max(1.0) as u32
            });
            shots.push(Shot { path: paths[index].clone(), name: names[index].clone(), step, time_s });
        }
        let moved = order.iter().enumerate().filter(|&(place, &index)| place != index).count();
        Self { shots, time_from, period_min, moved }
    }

    /// Steps of which there is no photograph.
    pub(crate) fn missing(&self) -> u32 {
        self.shots.last().map_or(0, |last| last.step + 1 - self.shots.len() as u32)
    }

    /// A few words on order and time.
    pub(crate) fn words(&self) -> String {
        let source = match self.time_from {
            TimeFrom::Exif => "by their Exif headers",
            TimeFrom::Name => "by their names",
            TimeFrom::Auto | TimeFrom::Even => "by counting",
        };
        let mut words = format!("one every {} min {source}", rounded(self.period_min));
        if self.missing() > 0 {
            words += &format!(", {} missing", self.missing());
        }
        if self.moved > 0 {
            words += &format!("; {} stand elsewhere than their names are numbered", self.moved);
        }
        words
    }
}

fn rounded(minutes: f64) -> f64 {
    (minutes * 100.0).round() / 100.0
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The files' names, or their paths where two have the same name.
fn names(paths: &[PathBuf]) -> Vec<String> {
    let names: Vec<String> = paths.iter().map(|path| file_name(path)).collect();
    let mut sorted = names.clone();
    sorted.sort();
    sorted.dedup();
    if sorted.len() == names.len() {
        return names;
    }
    paths.iter().map(|path| path.display().to_string()).collect()
}

/// Whether most photographs have a time and most of these differ.
fn are_telling(times: &[Option<f64>]) -> bool {
    let mut known: Vec<f64> = times.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    known.dedup();
    2 * known.len() > times.len()
}

/// The median of the intervals between different times.
fn median_interval(times: &[Option<f64>]) -> Option<f64> {
    let mut known: Vec<f64> = times.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    let intervals: Vec<f64> =
        known.windows(2).map(|pair| pair[1] - pair[0]).filter(|&interval| interval > 0.0).collect();
    upper_median(&intervals, f64::total_cmp)
}

/// The times of all: a photograph without one, a damaged file say, was taken one `interval` after the one before it in
/// the order of their names.
fn complete(times: &[Option<f64>], interval: f64) -> Vec<f64> {
    let first = times.iter().position(Option::is_some).unwrap_or(0);
    let start = times.get(first).copied().flatten().unwrap_or(0.0) - first as f64 * interval;
    let mut last = start - interval;
    times
        .iter()
        .map(|time| {
            last = time.unwrap_or(last + interval);
            last
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    fn series(names: &[&str], period_min: Option<f64>) -> Series {
        Series::read(&paths(names), TimeFrom::Auto, period_min).unwrap()
    }

    fn steps(series: &Series) -> Vec<(&str, u32, f64)> {
        series.shots.iter().map(|shot| (shot.name.as_str(), shot.step, shot.time_s)).collect()
    }

    #[test]
    fn counters_are_evenly_spaced() {
        let series = series(&["a/1.jpg", "a/2.jpg", "a/10.jpg"], None);
        assert_eq!(series.time_from, TimeFrom::Even);
        assert_eq!(steps(&series), [("1.jpg", 0, 0.0), ("2.jpg", 1, 300.0), ("10.jpg", 2, 600.0)]);
        assert_eq!((series.missing(), series.moved), (0, 0));
    }

    #[test]
    fn times_in_names_order_and_leave_gaps() {
        let names = [
            "b_20240501_120000.jpg",
            "b_20240501_121000.jpg",
            "b_20240501_120500.jpg",
            "b_20240501_123000.jpg",
        ];
        let series = series(&names, None);
        assert_eq!(series.time_from, TimeFrom::Name);
        let found: Vec<(u32, f64)> = series.shots.iter().map(|shot| (shot.step, shot.time_s)).collect();
        assert_eq!(found, [(0, 0.0), (1, 300.0), (2, 600.0), (6, 1800.0)]);
        assert_eq!((series.missing(), series.moved), (3, 2));
        assert!(
            series.words().contains("every 5 min by their names, 3 missing; 2 stand"),
            "{}",
            series.words()
        );
    }

    #[test]
    fn a_burst_is_a_step_each_and_a_nameless_file_follows_its_neighbour() {
        let names = ["20240501_120000.jpg", "20240501_120001.jpg", "broken.jpg", "20240501_121001.jpg"];
        let series = series(&names, Some(5.0));
        assert_eq!(series.period_min, 5.0);
        assert_eq!(
            steps(&series).iter().map(|step| (step.1, step.2)).collect::<Vec<_>>(),
            [(0, 0.0), (1, 1.0), (2, 301.0), (3, 601.0)]
        );
        assert_eq!(complete(&[None, None, Some(100.0), None], 10.0), [80.0, 90.0, 100.0, 110.0]);
    }

    #[test]
    fn the_same_time_everywhere_tells_nothing() {
        let names = ["a_20240501_1200_1.jpg", "a_20240501_1200_2.jpg", "a_20240501_1200_3.jpg"];
        assert_eq!(series(&names, None).time_from, TimeFrom::Even);
        let error = Series::read(&paths(&names), TimeFrom::Name, None).unwrap_err().to_string();
        assert!(error.contains("names of 3 of 3 photographs, wanted different ones"), "{error}");
        assert!(Series::read(&paths(&names), TimeFrom::Exif, None).is_err());
    }

    #[test]
    fn two_files_of_one_name_keep_their_folders() {
        assert_eq!(names(&paths(&["a/1.jpg", "b/1.jpg"])), ["a/1.jpg", "b/1.jpg"]);
    }
}
