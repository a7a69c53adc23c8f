//! Photographs in the order of their times, each with its step.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::math::statistics::median;
use tropism::parallel;
use tropism::photo::{
    LazyImage, NameTimes, jump_of_clock, known_times, median_interval, natural_order, times_in_names,
};
use tropism::text::plural;

use crate::{Error, files, units};

/// What says when a photograph was taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeSource {
    /// Exif headers, else names, else neither.
    #[default]
    Auto,
    /// The camera's clock, in the Exif headers.
    Exif,
    /// The names of the files.
    Name,
    /// Neither: one photograph a period, in the order of the numbers in their names.
    Even,
}

/// One photograph of a series.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) path: PathBuf,
    /// The file's name, or the path as given where two files have the same name.
    pub(super) name: String,
    /// Step, from 0. It rises by 1 from one photograph to the next, or by more where photographs are missing.
    pub(super) step: u32,
    /// Seconds since the first photograph.
    pub(super) time_s: f64,
}

impl Frame {
    /// The photograph, of which no pixel is decoded yet; `None` if it cannot be read.
    pub(super) fn picture(&self) -> Option<LazyImage> {
        files::read_photo(&self.path, self.time_s).ok()?.open().ok()
    }
}

/// Photographs in the order of their times.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    pub(super) frames: Vec<Frame>,
    /// What the times are from; never [`TimeSource::Auto`].
    pub(super) time_from: TimeSource,
    /// Minutes from one step to the next.
    pub(super) period_min: f64,
    /// Photographs whose place in time is not the one that their names are numbered by.
    pub(super) reordered: usize,
    /// What may be wrong with the times: a sentence each.
    pub(super) warnings: Vec<String>,
    /// What was corrected: a sentence each.
    pub(super) notes: Vec<String>,
}

/// Order and times of a series in numbers. It displays as a few words.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeriesSummary {
    /// Photographs.
    pub photographs: usize,
    /// What the times are from; never [`TimeSource::Auto`].
    pub time_from: TimeSource,
    /// Minutes from one step to the next.
    pub period_min: f64,
    /// Steps without a photograph.
    pub missing_steps: u32,
    /// Photographs whose place in time is not the one that their names are numbered by.
    pub reordered: usize,
}

/// Share of a period by which a photograph may be off the whole periods since the one before. Chosen by hand: cameras are late,
/// and of two photographs within a period the second is off by more.
const MOST_OFF_PERIOD: f64 = 0.4;

/// Share of the photographs that may be off by more. Chosen by hand: some are taken by hand or repeated.
const OFTEN_BETWEEN: f64 = 0.1;

impl Series {
    /// Orders the photographs of `paths`, which come in the order of their names.
    ///
    /// The period is `period_min`, else the median interval, else `default_period_min`.
    pub(super) fn read(
        paths: &[PathBuf],
        source: TimeSource,
        period_min: Option<f64>,
        default_period_min: f64,
    ) -> Result<Self, Error> {
        let exif = || -> Vec<Option<f64>> {
            parallel::map(paths.len(), |photo| files::read_header(&paths[photo]).ok()?.taken_s)
        };
        let named = || {
            let texts: Vec<String> = paths.iter().map(|path| files::name_text(path.as_os_str())).collect();
            let mut found = times_in_names(&texts);
            if found.times.is_empty() {
                found.times = vec![None; paths.len()];
            }
            found
        };
        let (mut warnings, mut notes) = (Vec::new(), Vec::new());
        let (time_from, times) = match source {
            TimeSource::Even => (TimeSource::Even, None),
            TimeSource::Exif => (TimeSource::Exif, Some(exif())),
            TimeSource::Name => {
                let found = named();
                // Whoever names the source accepts its form, but not a clock that was set.
                warnings.extend(found.warnings.into_iter().filter(|warning| !warning.contains("ambiguous")));
                notes = found.notes;
                (TimeSource::Name, Some(found.times))
            }
            TimeSource::Auto => {
                let (exif, names) = (exif(), named());
                if are_informative(&exif) {
                    warnings.extend(disagreement(&exif, &names));
                    (TimeSource::Exif, Some(exif))
                } else {
                    let is_read = are_informative(&names.times);
                    (warnings, notes) = (names.warnings, names.notes);
                    (
                        if is_read { TimeSource::Name } else { TimeSource::Even },
                        is_read.then_some(names.times),
                    )
                }
            }
        };
        warnings.iter_mut().for_each(|warning| *warning += ": give `time` or `period_min`");
        let Some(times) = times else {
            let mut series = Self::even(paths, period_min.unwrap_or(default_period_min));
            if period_min.is_none() && paths.iter().any(|path| is_picture_of_film(path)) {
                warnings.push(format!(
                    "the pictures of a film or of a file of pages have no times, and are taken to be {default_period_min} min \
                     apart: give `period_min`"
                ));
            }
            // Whoever says that the photographs are counted has seen the names.
            series.warnings = if source == TimeSource::Even { Vec::new() } else { warnings };
            return Ok(series);
        };
        if !are_informative(&times) {
            let found = times.iter().flatten().count();
            let place = if time_from == TimeSource::Exif { "Exif headers" } else { "names" };
            return Err(Error::Plan(format!(
                "found times in the {place} of {found} of {} photographs, wanted different ones in most",
                paths.len()
            )));
        }
        let period_min =
            period_min.or_else(|| median_interval(&known_times(&times)).map(|seconds| seconds / 60.0));
        let mut series = Self::timed(paths, time_from, &times, period_min.unwrap_or(default_period_min));
        if time_from == TimeSource::Exif {
            warnings.extend(jump_of_clock(&times));
            warnings.extend(series.disorder());
        }
        warnings.extend(series.between_steps());
        series.warnings = warnings;
        series.notes = notes;
        Ok(series)
    }

    fn even(paths: &[PathBuf], period_min: f64) -> Self {
        let mut file_names: Vec<String> = paths.iter().map(|path| file_name(path)).collect();
        let mut named: Vec<(String, &PathBuf)> = names(paths).into_iter().zip(paths).collect();
        let mut notes = Vec::new();
        if let Some(first) = roll_over(&file_names) {
            notes.push(format!("the numbers begin anew after {}", file_names[file_names.len() - 1]));
            named.rotate_left(first);
            file_names.rotate_left(first);
        }
        let steps = numbered_steps(&file_names).unwrap_or_else(|| (0..paths.len() as u32).collect());
        let frames = named.into_iter().zip(steps).map(|((name, path), step)| Frame {
            path: path.clone(),
            name,
            step,
            time_s: f64::from(step) * period_min * 60.0,
        });
        let frames = frames.collect();
        Self { frames, time_from: TimeSource::Even, period_min, reordered: 0, warnings: Vec::new(), notes }
    }

    fn timed(paths: &[PathBuf], time_from: TimeSource, times: &[Option<f64>], period_min: f64) -> Self {
        let times = fill_in(times, period_min * 60.0);
        let mut order: Vec<usize> = (0..paths.len()).collect();
        order.sort_by(|&a, &b| times[a].total_cmp(&times[b]).then(a.cmp(&b)));
        let names = names(paths);
        let mut frames: Vec<Frame> = Vec::with_capacity(paths.len());
        for &index in &order {
            let time_s = times[index] - times[order[0]];
            // Photographs less than a period apart are a step each, because a step has one row in a track.
            let step = frames.last().map_or(0, |last| {
                last.step + ((time_s - last.time_s) / (period_min * 60.0)).round().max(1.0) as u32
            });
            frames.push(Frame { path: paths[index].clone(), name: names[index].clone(), step, time_s });
        }
        let reordered = order.iter().enumerate().filter(|&(place, &index)| place != index).count();
        Self { frames, time_from, period_min, reordered, warnings: Vec::new(), notes: Vec::new() }
    }

    /// Whether many photographs do not follow the one before by whole periods: several within a period, or a period that is not
    /// theirs. A step has one row in a track, so each of them is a step.
    fn between_steps(&self) -> Option<String> {
        let period_s = self.period_min * 60.0;
        let is_between = |pair: &&[Frame]| {
            let steps = f64::from(pair[1].step - pair[0].step);
            ((pair[1].time_s - pair[0].time_s) / period_s - steps).abs() >= MOST_OFF_PERIOD
        };
        let between: Vec<&[Frame]> = self.frames.windows(2).filter(is_between).collect();
        (between.len() as f64 > OFTEN_BETWEEN * self.frames.len() as f64).then(|| {
            format!(
                "{} do not follow the one before by whole periods of {}, such as {}: keep one photograph a period, or give \
                 another `period_min`",
                plural(between.len(), "photograph"),
                units::time(period_s),
                between[0][1].name
            )
        })
    }

    /// Whether numbers of names that count the photographs give another order than the times do.
    fn disorder(&self) -> Option<String> {
        let mut names: Vec<String> = self.frames.iter().map(|frame| file_name(&frame.path)).collect();
        let in_time = names.clone();
        names.sort_by_cached_key(|name| natural_order(name));
        let anew = roll_over(&names).unwrap_or(0);
        names.rotate_left(anew);
        let elsewhere = names.iter().zip(&in_time).filter(|(one, other)| one != other).count();
        (elsewhere > 0 && numbered_steps(&names).is_some()).then(|| {
            format!(
                "the Exif times of {} give another order than the numbers in their names: the camera's clock was set, or the \
                 files were numbered anew: give `time`",
                plural(elsewhere, "photograph")
            )
        })
    }

    /// Steps without a photograph.
    pub(super) fn missing(&self) -> u32 {
        self.frames.last().map_or(0, |last| last.step + 1 - self.frames.len() as u32)
    }

    pub(super) fn summary(&self) -> SeriesSummary {
        SeriesSummary {
            photographs: self.frames.len(),
            time_from: self.time_from,
            period_min: self.period_min,
            missing_steps: self.missing(),
            reordered: self.reordered,
        }
    }
}

impl fmt::Display for SeriesSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let source = match self.time_from {
            TimeSource::Exif => "by their Exif headers",
            TimeSource::Name => "by their names",
            TimeSource::Auto | TimeSource::Even => "by counting",
        };
        let minutes = (self.period_min * 100.0).round() / 100.0;
        write!(f, "one every {minutes} min {source}")?;
        if self.missing_steps > 0 {
            write!(f, ", {} missing", self.missing_steps)?;
        }
        if self.reordered > 0 {
            write!(f, "; {} stand elsewhere than their names are numbered", self.reordered)?;
        }
        Ok(())
    }
}

pub(super) fn file_name(path: &Path) -> String {
    files::name_text(path.file_name().unwrap_or_default())
}

/// The files' names, or their paths where two files have the same name.
fn names(paths: &[PathBuf]) -> Vec<String> {
    let names: Vec<String> = paths.iter().map(|path| file_name(path)).collect();
    let mut sorted = names.clone();
    sorted.sort();
    sorted.dedup();
    if sorted.len() == names.len() {
        return names;
    }
    paths.iter().map(|path| files::name_text(path.as_os_str())).collect()
}

/// Whether Exif headers and names disagree on more than a twentieth of the photographs, by more than half of the median
/// interval and a minute. By the same everywhere is no disagreement: a camera's clock may have another time zone.
fn disagreement(exif: &[Option<f64>], names: &NameTimes) -> Option<String> {
    let differences: Vec<f64> =
        exif.iter().zip(&names.times).filter_map(|(exif, name)| Some((*exif)? - (*name)?)).collect();
    if !names.is_plain || 2 * differences.len() <= exif.len() {
        return None;
    }
    let middle = median(&differences);
    let most = (0.5 * median_interval(&known_times(exif))?).max(60.0);
    let apart = differences.iter().filter(|difference| (*difference - middle).abs() > most).count();
    (20 * apart > differences.len()).then(|| {
        format!("Exif headers and names disagree on when {} were taken", plural(apart, "photograph"))
    })
}

/// Whether this is a page of a file, or a picture that was taken out of a film.
fn is_picture_of_film(path: &Path) -> bool {
    let name = file_name(path);
    let number = name.rsplit_once('#').map(|(_, number)| number.trim_end_matches(".jpg"));
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// The only part of names that differs, and each name's number there; `None` if they differ in more.
fn numbers_of(names: &[String]) -> Option<(usize, Vec<u64>)> {
    let keys: Vec<Vec<(String, u128, String)>> = names.iter().map(|name| natural_order(name)).collect();
    let first = keys.first()?;
    let differs = |at: &usize| keys.iter().any(|key| key.get(*at).map(|part| part.1) != Some(first[*at].1));
    let words = |key: &[(String, u128, String)]| key.iter().map(|part| part.0.clone()).collect::<Vec<_>>();
    let mut counters = (0..first.len()).filter(differs);
    let (Some(counter), None) = (counters.next(), counters.next()) else { return None };
    if keys.iter().any(|key| words(key) != words(first)) {
        return None;
    }
    let numbers = keys.iter().map(|key| key[counter].1.try_into().ok()).collect::<Option<_>>()?;
    let digits = keys.iter().map(|key| key[counter].2.len()).max()?;
    Some((digits, numbers))
}

/// The first photograph of a series whose numbers have begun anew, as cameras do after `DSC09999`: the numbers of names, in
/// their order, lie at both ends of the range, with one wide gap between them.
fn roll_over(names: &[String]) -> Option<usize> {
    let (digits, numbers) = numbers_of(names)?;
    let range = 10_u64.checked_pow(digits as u32)?;
    // `DSC09999` has five digits, of which four count.
    let range = if *numbers.last()? < range / 10 { range / 10 } else { range };
    let (wide, first) =
        numbers.windows(2).zip(1..).map(|(pair, at)| (pair[1].saturating_sub(pair[0]), at)).max()?;
    let is_at_ends = numbers[0] <= 1 && *numbers.last()? == range - 1;
    (is_at_ends && digits >= 3 && wide > range / 2).then_some(first)
}

/// Steps between two photographs on average, above which the numbers in their names count something else; chosen by hand.
const MAX_STEPS_EACH: u64 = 20;

/// The steps of photographs whose names differ in one number that rises by the same from most of them to the next: where it
/// rises by more, photographs are missing. `None` if the names are not numbered so.
fn numbered_steps(names: &[String]) -> Option<Vec<u32>> {
    let (_, mut numbers) = numbers_of(names)?;
    // Numbers that begin anew go on.
    if let Some(anew) = numbers.windows(2).position(|pair| pair[1] < pair[0]) {
        let offset = numbers[anew] + 1 - numbers[anew + 1];
        numbers[anew + 1..].iter_mut().for_each(|number| *number += offset);
    }
    let rises: Vec<u64> = numbers
        .windows(2)
        .map(|pair| pair[1].checked_sub(pair[0]).filter(|&rise| rise > 0))
        .collect::<Option<_>>()?;
    let mut counts = BTreeMap::new();
    rises.iter().for_each(|rise| *counts.entry(*rise).or_insert(0) += 1);
    // Of those that are equally common, the least.
    let (common, _) = counts.into_iter().rev().max_by_key(|&(_, count)| count)?;
    let mut steps = vec![0_u64];
    for rise in rises {
        steps.push(steps[steps.len() - 1] + ((rise + common / 2) / common).max(1));
    }
    let is_counted = steps[steps.len() - 1] <= MAX_STEPS_EACH * names.len() as u64;
    steps.into_iter().map(|step| step.try_into().ok().filter(|_| is_counted)).collect()
}

/// Whether most photographs have a time, and most of these times differ.
fn are_informative(times: &[Option<f64>]) -> bool {
    2 * known_times(times).len() > times.len()
}

/// The times of all photographs: one without a time, such as a damaged file, follows the one before it in the order of
/// their names after `interval`.
fn fill_in(times: &[Option<f64>], interval: f64) -> Vec<f64> {
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
        Series::read(&paths(names), TimeSource::Auto, period_min, 5.0).unwrap()
    }

    fn steps(series: &Series) -> Vec<(&str, u32, f64)> {
        series.frames.iter().map(|frame| (frame.name.as_str(), frame.step, frame.time_s)).collect()
    }

    #[test]
    fn counters_are_evenly_spaced() {
        let series = series(&["a/1.jpg", "a/2.jpg", "a/10.jpg"], None);
        assert_eq!(series.time_from, TimeSource::Even);
        assert_eq!(steps(&series), [("1.jpg", 0, 0.0), ("2.jpg", 1, 300.0), ("10.jpg", 9, 2_700.0)]);
        assert_eq!((series.missing(), series.reordered), (7, 0));
    }

    #[test]
    fn gaps_in_numbers_are_gaps() {
        let steps_of =
            |names: &[&str]| numbered_steps(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        assert_eq!(
            steps_of(&["a_0001.jpg", "a_0002.jpg", "a_0003.jpg", "a_0006.jpg"]),
            Some(vec![0, 1, 2, 5])
        );
        // Every tenth photograph of a camera, with one left out.
        assert_eq!(steps_of(&["i0.png", "i10.png", "i20.png", "i40.png"]), Some(vec![0, 1, 2, 4]));
        // Two numbers that differ, other words, and numbers that count no photographs.
        assert_eq!(steps_of(&["d1_f1.jpg", "d1_f2.jpg", "d2_f1.jpg"]), None);
        assert_eq!(steps_of(&["a1.jpg", "a2.jpg", "b3.jpg"]), None);
        assert_eq!(steps_of(&["1.jpg", "2.jpg", "90000.jpg"]), None);
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
        assert_eq!(series.time_from, TimeSource::Name);
        let found: Vec<(u32, f64)> = series.frames.iter().map(|frame| (frame.step, frame.time_s)).collect();
        assert_eq!(found, [(0, 0.0), (1, 300.0), (2, 600.0), (6, 1800.0)]);
        assert_eq!((series.missing(), series.reordered), (3, 2));
        assert!(
            series.summary().to_string().contains("every 5 min by their names, 3 missing; 2 stand"),
            "{}",
            series.summary().to_string()
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
        assert_eq!(fill_in(&[None, None, Some(100.0), None], 10.0), [80.0, 90.0, 100.0, 110.0]);
    }

    #[test]
    fn the_same_time_everywhere_tells_nothing() {
        let names = ["a_20240501_1200_1.jpg", "a_20240501_1200_2.jpg", "a_20240501_1200_3.jpg"];
        assert_eq!(series(&names, None).time_from, TimeSource::Even);
        let error = Series::read(&paths(&names), TimeSource::Name, None, 5.0).unwrap_err().to_string();
        assert!(error.contains("names of 0 of 3 photographs, wanted different ones"), "{error}");
        assert!(Series::read(&paths(&names), TimeSource::Exif, None, 5.0).is_err());
    }

    #[test]
    fn numbers_that_begin_anew_go_on() {
        let series =
            series(&["DSC00001.jpg", "DSC00002.jpg", "DSC09997.jpg", "DSC09998.jpg", "DSC09999.jpg"], None);
        let found: Vec<_> = steps(&series).iter().map(|step| (step.0, step.1)).collect();
        let wanted = ["DSC09997.jpg", "DSC09998.jpg", "DSC09999.jpg", "DSC00001.jpg", "DSC00002.jpg"];
        assert_eq!(found, wanted.into_iter().zip(0..).collect::<Vec<_>>());
        assert!(series.notes[0].contains("begin anew after DSC09999.jpg"), "{:?}", series.notes);
    }

    #[test]
    fn headers_and_names_are_compared() {
        let names: Vec<String> = (0..20).map(|minute| format!("b_20240501_12{minute:02}00.jpg")).collect();
        let names = times_in_names(&names);
        let zone: Vec<_> = names.times.iter().map(|time| time.map(|time| time + 7_200.0)).collect();
        assert_eq!(disagreement(&zone, &names), None);
        let copied: Vec<_> = (0..20).map(|second| Some(1.7e9 + 2.0 * f64::from(second))).collect();
        assert!(disagreement(&copied, &names).is_some_and(|problem| problem.contains("disagree")));
    }

    #[test]
    fn pages_and_pictures_of_films_need_a_period() {
        let pages = ["film.mp4#000000.jpg", "film.mp4#000001.jpg"];
        assert!(series(&pages, None).warnings[0].contains("give `period_min`"));
        assert_eq!(series(&pages, Some(1.0)).warnings, [""; 0]);
    }

    #[test]
    fn two_files_of_one_name_keep_their_folders() {
        assert_eq!(names(&paths(&["a/1.jpg", "b/1.jpg"])), ["a/1.jpg", "b/1.jpg"]);
    }
}
