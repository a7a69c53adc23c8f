//! The path of a tip over an experiment: one row a step, the same for measured and simulated plants.
//!
//! A track of N lights has N + 1 observations: the light of a row is lit from that row's observation to the next, and
//! the last row's light is `dark`.

use std::io::Read;

use crate::geometry::path::resampled;
use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::lamps::{Layout, Light};
use crate::lighting::{Lighting, LightingError};
use crate::math::statistics::median;
use crate::math::vector::Vec3;
use crate::observation::{Depth, Observation, Quality};
use crate::text::{csv_cell, of_csv_cell};

/// Minutes between two steps in the paper (section 2.2.1): the default of a track, a rig and a model.
pub const PAPER_PERIOD_MIN: f64 = 5.0;

/// Intervals of photographs are the same within this share. Chosen: six seconds of five minutes, far above what a clock
/// drifts by, far below what moves a tip.
pub const SAME_PERIOD: f64 = 0.02;

/// One step of a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Step, from 0.
    pub step: u32,
    /// Seconds since the start.
    pub time_s: f64,
    /// Tip, in cm.
    pub tip: Point,
    /// Stem from the base up, in cm, where one was seen. In a file: the columns of [`Track::add_stem_columns`].
    pub stem: Option<Polyline>,
    /// The third coordinate of tip and stem, where it is known. In a file: `tip_z_cm`, and z beside x and y of the stem.
    pub depth: Option<Depth>,
    /// The one lamp at full power from this step to the next; `None` is dark, or `levels`.
    pub light: Option<Light>,
    /// The levels of the lamps from this step to the next, where `light` cannot say them. In a file both stand in `light`.
    pub levels: Option<Lighting>,
    /// How the tip came about.
    pub quality: Quality,
}

impl Sample {
    /// Whether the way of the tip from here to `after` is the movement of a step: both tips are measured, and `after` is the next
    /// step. A held value is no measurement.
    #[must_use]
    pub fn shifts_to(&self, after: &Self) -> bool {
        let are_measured = [self, after].iter().all(|sample| sample.quality != Quality::CarriedForward);
        are_measured && after.step == self.step.wrapping_add(1)
    }

    /// What was `seen` at a step, and the lighting decided for it.
    #[must_use]
    pub fn of(seen: Observation, step: u32, time_s: f64, lighting: impl Into<Lighting>) -> Self {
        let Observation { tip, stem, depth, quality } = seen;
        let mut sample = Self { step, time_s, tip, stem, depth, light: None, levels: None, quality };
        sample.set_lighting(lighting.into());
        sample
    }

    /// The levels of all lamps from this step to the next.
    #[must_use]
    pub fn lighting(&self) -> Lighting {
        self.levels.unwrap_or(self.light.into())
    }

    /// Whether no lamp is lit from this step to the next, as at the last one of a track.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        self.lighting() == Lighting::DARK
    }

    /// Sets the levels of all lamps from this step to the next.
    pub fn set_lighting(&mut self, lighting: Lighting) {
        let single = lighting.single();
        (self.light, self.levels) = (single.flatten(), single.is_none().then_some(lighting));
    }

    /// What was seen at this step.
    #[must_use]
    pub fn observation(&self) -> Observation {
        Observation {
            tip: self.tip,
            stem: self.stem.clone(),
            depth: self.depth.clone(),
            quality: self.quality,
        }
    }
}

/// A column beside the required ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Header, with the unit in it.
    pub name: String,
    /// One value a sample.
    pub values: Values,
}

/// The values of a column.
#[derive(Clone, Debug)]
pub enum Values {
    /// Numbers, written with a fixed number of decimals; NaN is an empty cell.
    Numbers {
        /// The values, rounded to `decimals`.
        values: Vec<f64>,
        /// Decimals in a file.
        decimals: usize,
    },
    /// Words.
    Text(Vec<String>),
}

impl PartialEq for Values {
    /// Empty cells are equal.
    fn eq(&self, other: &Self) -> bool {
        let same = |a: &f64, b: &f64| a == b || a.is_nan() && b.is_nan();
        match (self, other) {
            (Self::Numbers { values: a, .. }, Self::Numbers { values: b, .. }) => {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
            }
            (Self::Text(a), Self::Text(b)) => a == b,
            _ => false,
        }
    }
}

impl Values {
    /// Numbers, if every text is one that would be written the same; else text.
    fn of_texts(texts: Vec<String>) -> Self {
        /// Chosen: more than any program writes, and far fewer than the standard library can format.
        const MOST_DECIMALS: usize = 40;
        let decimals = texts.iter().filter_map(|text| Some(text.split_once('.')?.1.len())).max().unwrap_or(0);
        if decimals > MOST_DECIMALS {
            return Self::Text(texts);
        }
        let number = |text: &String| {
            let value = if text.is_empty() {
                f64::NAN
            } else {
                text.parse().ok().filter(|value: &f64| value.is_finite())?
            };
            (cell(value, decimals) == *text).then_some(value)
        };
        match texts.iter().map(number).collect::<Option<Vec<f64>>>() {
            Some(values) if values.iter().any(|value| !value.is_nan()) => Self::Numbers { values, decimals },
            _ => Self::Text(texts),
        }
    }

    /// The text of a row, as it stands in a file but for the apostrophe of [`csv_cell`].
    #[must_use]
    pub fn text(&self, row: usize) -> String {
        match self {
            Self::Numbers { values, decimals } => cell(values[row], *decimals),
            Self::Text(texts) => texts[row].clone(),
        }
    }
}

/// A number as it stands in a file.
fn cell(value: f64, decimals: usize) -> String {
    let mut text = Vec::new();
    push_number(&mut text, value, decimals);
    String::from_utf8(text).expect("digits are ASCII")
}

/// Appends a number with `decimals` decimals; NaN is an empty cell.
///
/// Fixed-point: several times as fast as the formatter of the standard library, which is exact for any number of decimals.
fn push_number(out: &mut Vec<u8>, value: f64, decimals: usize) {
    /// Powers of ten that numbers in tracks need, and all of them exact.
    const UNITS: [f64; 10] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9];
    /// Below 2^50 units the product with a unit is exact to a quarter.
    const MOST_UNITS: f64 = 1_125_899_906_842_624.0;
    if value.is_nan() {
        return;
    }
    let units = UNITS.get(decimals).map(|unit| value.abs() * unit);
    let Some(units) = units.filter(|units| *units < MOST_UNITS) else {
        out.extend_from_slice(format!("{value:.decimals$}").as_bytes());
        return;
    };
    // Digits from the last to the first; room for those of the largest number, its point and its sign.
    let mut text = [0; 20];
    let (mut at, mut left) = (text.len(), (units + 0.5) as i64);
    let mut push = |byte| {
        at -= 1;
        text[at] = byte;
    };
    for _ in 0..decimals {
        push(b'0' + (left % 10) as u8);
        left /= 10;
    }
    if decimals > 0 {
        push(b'.');
    }
    loop {
        push(b'0' + (left % 10) as u8);
        left /= 10;
        if left == 0 {
            break;
        }
    }
    if value.is_sign_negative() {
        push(b'-');
    }
    out.extend_from_slice(&text[at..]);
}

/// Appends a cell of CSV, in quotation marks where it needs them (RFC 4180).
fn push_cell(out: &mut Vec<u8>, text: &str) {
    if text.contains([',', '"', '\r', '\n']) {
        out.extend_from_slice(format!("\"{}\"", text.replace('"', "\"\"")).as_bytes());
    } else {
        out.extend_from_slice(text.as_bytes());
    }
}

impl Column {
    /// A column of text.
    #[must_use]
    pub fn text(name: &str, values: Vec<String>) -> Self {
        Self { name: name.to_owned(), values: Values::Text(values) }
    }

    /// A column of what stands in the cells of a file: numbers if all of them are, else text.
    #[must_use]
    pub fn parsed(name: &str, cells: Vec<String>) -> Self {
        Self { name: name.to_owned(), values: Values::of_texts(cells) }
    }

    /// A column of numbers, kept as a file keeps them: rounded to `decimals`. NaN is an empty cell.
    pub fn numbers(name: &str, decimals: usize, values: impl IntoIterator<Item = f64>) -> Self {
        let unit = 10_f64.powi(decimals as i32);
        let values = values.into_iter().map(|value| (value * unit).round() / unit).collect();
        Self { name: name.to_owned(), values: Values::Numbers { values, decimals } }
    }
}

/// The path of a tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The lamps, which give the lights of the samples their names and places.
    pub layout: Layout,
    /// Minutes between two steps.
    pub period_min: f64,
    /// Steps in order.
    pub samples: Vec<Sample>,
    /// Further columns, such as `frame` and `tip_x_px`.
    pub columns: Vec<Column>,
}

/// Why bytes are not a track.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// A required column is missing.
    #[error("found columns {found}, wanted {wanted:?} among them")]
    Header {
        /// The header as it stands.
        found: String,
        /// The missing column.
        wanted: &'static str,
    },
    /// A value that cannot be one.
    #[error("line {line}: found {column} {found:?}, wanted {wanted}")]
    Value {
        /// Line of the file, the header being line 1.
        line: u64,
        /// Column.
        column: &'static str,
        /// The text that stands there.
        found: String,
        /// What should stand there.
        wanted: &'static str,
    },
    /// A lamp that the layout does not name.
    #[error("line {line}: {source}")]
    Light {
        /// Line of the file, the header being line 1.
        line: u64,
        /// The word that stands there.
        source: LightingError,
    },
    /// No rows.
    #[error("the track has no rows")]
    Empty,
    /// Not CSV at all.
    #[error("found a broken table: {0}")]
    Csv(#[from] csv::Error),
}

const REQUIRED: [&str; 6] = ["step", "time_s", "tip_x_cm", "tip_y_cm", "light", "quality"];

impl Default for Track {
    /// No samples, with the paper's lamps and period.
    fn default() -> Self {
        Self {
            layout: Layout::default(),
            period_min: PAPER_PERIOD_MIN,
            samples: Vec::new(),
            columns: Vec::new(),
        }
    }
}

impl Track {
    /// A track of `samples` under the paper's lamps, five minutes apart.
    #[must_use]
    pub fn of(samples: Vec<Sample>) -> Self {
        Self { samples, ..Self::default() }
    }

    /// A track of photographs, of samples that have the lamp which their photograph shows: it was lit until then. So each sample has
    /// that of the next photograph, and the last one none.
    #[must_use]
    pub fn of_photographs(mut samples: Vec<Sample>) -> Self {
        for next in 1..samples.len() {
            samples[next - 1].light = samples[next].light;
        }
        if let Some(last) = samples.last_mut() {
            last.light = None;
        }
        Self::of(samples)
    }

    /// The same experiment in a mirror: x changes sign, and each lamp becomes the lamp at the mirrored place (section
    /// 2.2.3). `None` where a lamp that was lit has no mirror image in the layout.
    ///
    /// Columns beside the required ones are left out: what they mean in a mirror is not known here.
    #[must_use]
    pub fn mirrored(&self) -> Option<Self> {
        let image = |sample: &Sample| {
            let mut image = Sample {
                tip: sample.tip.mirrored(),
                stem: sample.stem.as_ref().map(Polyline::mirrored),
                ..sample.clone()
            };
            image.set_lighting(sample.lighting().mirrored(&self.layout)?);
            Some(image)
        };
        let samples = self.samples.iter().map(image).collect::<Option<_>>()?;
        Some(Self { layout: self.layout.clone(), period_min: self.period_min, samples, columns: Vec::new() })
    }

    /// Pairs of samples one step apart, with the light that was lit between them.
    ///
    /// Left out are pairs with a gap between them, pairs in the dark or under several lamps that steer or their levels, and
    /// pairs of which either tip was carried forward: a held value is no measurement.
    pub fn shifts(&self) -> impl Iterator<Item = (Point, Point, Light)> {
        self.samples.windows(2).filter_map(move |pair| {
            let (before, after) = (&pair[0], &pair[1]);
            let light = before.lighting().bending(&self.layout).flatten()?;
            before.shifts_to(after).then_some((before.tip, after.tip, light))
        })
    }

    /// The values of a further column, as numbers; `None` where the column is missing, NaN where a value is no number.
    #[must_use]
    pub fn numbers(&self, column: &str) -> Option<Vec<f64>> {
        let column = self.columns.iter().find(|candidate| candidate.name == column)?;
        Some(match &column.values {
            Values::Numbers { values, .. } => values.clone(),
            Values::Text(texts) => texts.iter().map(|text| text.parse().unwrap_or(f64::NAN)).collect(),
        })
    }

    /// Adds a column of numbers, rounded to `decimals`.
    pub fn add_numbers(&mut self, name: &str, decimals: usize, values: impl IntoIterator<Item = f64>) {
        self.columns.push(Column::numbers(name, decimals, values));
    }

    /// Adds the stems of the samples as columns of ten points each, `stem_1_x_cm` to `stem_10_y_cm` from the base up, and where
    /// depth is known `tip_z_cm` and `stem_1_z_cm` to `stem_10_z_cm`. Rows without a stem are empty.
    pub fn add_stem_columns(&mut self) {
        if self.samples.iter().any(|sample| sample.depth.is_some()) {
            let tip = |sample: &Sample| sample.depth.as_ref().map_or(f64::NAN, |depth| depth.tip_cm);
            let tips: Vec<f64> = self.samples.iter().map(tip).collect();
            self.add_numbers("tip_z_cm", 5, tips);
        }
        let stems: Vec<Vec<Vec3>> = self.samples.iter().map(ten_points).collect();
        for vertex in 0..STEM_POINTS {
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                let value = |stem: &Vec<Vec3>| stem.get(vertex).map_or(f64::NAN, |point| point[axis]);
                let values: Vec<f64> = stems.iter().map(value).collect();
                if axis < 2 || values.iter().any(|value| value.is_finite()) {
                    self.add_numbers(&stem_column(vertex, name), 5, values);
                }
            }
        }
    }

    /// Takes stems and depths of the samples from the columns of [`Self::add_stem_columns`]; rows that lack a number have
    /// none.
    fn take_stems(&mut self) {
        let axis = |name: &str| -> Option<Vec<Vec<f64>>> {
            (0..STEM_POINTS).map(|vertex| self.numbers(&stem_column(vertex, name))).collect()
        };
        let at = |columns: &Option<Vec<Vec<f64>>>, row: usize| -> Option<Vec<f64>> {
            let values: Vec<f64> = columns.as_ref()?.iter().map(|values| values[row]).collect();
            values.iter().all(|value| value.is_finite()).then_some(values)
        };
        let (xs, ys, zs, tips) = (axis("x"), axis("y"), axis("z"), self.numbers("tip_z_cm"));
        for (row, sample) in self.samples.iter_mut().enumerate() {
            let stem = at(&xs, row).zip(at(&ys, row));
            sample.stem = stem
                .map(|(xs, ys)| Polyline(xs.into_iter().zip(ys).map(|(x, y)| Point::new(x, y)).collect()));
            let tip = tips.as_ref().map(|tips| tips[row]).filter(|tip| tip.is_finite());
            let stem_cm = at(&zs, row).filter(|_| sample.stem.is_some()).unwrap_or_default();
            sample.depth = tip.map(|tip_cm| Depth { tip_cm, stem_cm });
        }
    }

    /// CSV: `step,time_s,tip_x_cm,tip_y_cm,light,quality`, then the further columns. Lengths have five places (a tenth of a
    /// micrometre). In columns of text, an apostrophe stands before what a spreadsheet would execute.
    #[must_use]
    pub fn to_csv(&self) -> Vec<u8> {
        let mut out = REQUIRED.join(",").into_bytes();
        for column in &self.columns {
            out.push(b',');
            push_cell(&mut out, &csv_cell(&column.name));
        }
        for (row, sample) in self.samples.iter().enumerate() {
            out.extend_from_slice(format!("\n{},{},", sample.step, sample.time_s).as_bytes());
            push_number(&mut out, sample.tip.x, 5);
            out.push(b',');
            push_number(&mut out, sample.tip.y, 5);
            let levels = sample.levels.map(|levels| levels.word(&self.layout));
            let light = levels.as_deref().unwrap_or(self.layout.name(sample.light));
            for word in [light, sample.quality.name()] {
                out.push(b',');
                push_cell(&mut out, word);
            }
            for column in &self.columns {
                out.push(b',');
                match &column.values {
                    Values::Numbers { values, decimals } => push_number(&mut out, values[row], *decimals),
                    Values::Text(texts) => push_cell(&mut out, &csv_cell(&texts[row])),
                }
            }
        }
        out.push(b'\n');
        out
    }

    /// Reads CSV with a header; `tip_x_cm`, `tip_y_cm` and `light` are required. Stems and depths come from the columns of
    /// [`Self::add_stem_columns`], where they are there.
    ///
    /// Where `step`, `time_s` or `quality` are missing, rows are numbered from 0 by their times, five minutes apart, and measured. The
    /// lamps are the paper's two, or those of [`Layout::four_sides`] where `front` or `back` is lit.
    ///
    /// # Errors
    /// [`TrackError`] names the line and the column.
    pub fn read_csv(input: impl Read) -> Result<Self, TrackError> {
        let mut track = Self::read_csv_of(input, &Layout::four_sides())?;
        let paper = Layout::wahby2016();
        if track.samples.iter().all(|sample| sample.lighting().within(&paper) == sample.lighting()) {
            track.layout = paper;
        }
        Ok(track)
    }

    /// Reads CSV as [`Self::read_csv`], with the lamps of `layout`.
    ///
    /// # Errors
    /// [`TrackError`] names the line and the column.
    pub fn read_csv_of(input: impl Read, layout: &Layout) -> Result<Self, TrackError> {
        let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(input);
        let header = table.headers()?.clone();
        let find = |name: &str| header.iter().position(|column| column == name);
        let need = |name: &'static str| {
            let found: String = header.iter().collect::<Vec<_>>().join(",").chars().take(200).collect();
            let found = if found.starts_with('{') { "of no table: this is JSON".to_owned() } else { found };
            find(name).ok_or(TrackError::Header { found, wanted: name })
        };
        let (x, y, lit) = (need("tip_x_cm")?, need("tip_y_cm")?, need("light")?);
        let (step, time, quality) = (find("step"), find("time_s"), find("quality"));
        let further: Vec<usize> = (0..header.len()).filter(|&at| !REQUIRED.contains(&&header[at])).collect();
        let mut track = Self { layout: layout.clone(), ..Self::default() };
        let mut texts = vec![Vec::new(); further.len()];
        for record in table.records() {
            let record = record?;
            let line = record.position().map_or(0, csv::Position::line);
            let refused = |column, found: &str, wanted| TrackError::Value {
                line,
                column,
                found: found.to_owned(),
                wanted,
            };
            let number = |at: usize, column, wanted| {
                let value = record[at].parse().ok().filter(|value: &f64| value.is_finite());
                value.ok_or_else(|| refused(column, &record[at], wanted))
            };
            let cm = "a finite number of cm";
            let tip = Point::new(number(x, "tip_x_cm", cm)?, number(y, "tip_y_cm", cm)?);
            let number_of_step = match step {
                None => track.samples.len() as u32,
                Some(at) => record[at].parse().map_err(|_| refused("step", &record[at], "a whole number"))?,
            };
            if track.samples.last().is_some_and(|last: &Sample| last.step >= number_of_step) {
                return Err(refused("step", &number_of_step.to_string(), "a step after the row above"));
            }
            let lighting =
                Lighting::parse(&record[lit], layout).map_err(|source| TrackError::Light { line, source })?;
            let mut sample = Sample {
                step: number_of_step,
                time_s: match time {
                    None => f64::from(number_of_step) * PAPER_PERIOD_MIN * 60.0,
                    Some(at) => number(at, "time_s", "a finite number of seconds")?,
                },
                tip,
                stem: None,
                depth: None,
                light: None,
                levels: None,
                quality: match quality {
                    None => Quality::Measured,
                    Some(at) => {
                        let refusal =
                            |_| refused("quality", &record[at], "measured, carried_forward or simulated");
                        record[at].parse().map_err(refusal)?
                    }
                },
            };
            sample.set_lighting(lighting);
            track.samples.push(sample);
            for (column, &at) in texts.iter_mut().zip(&further) {
                column.push(of_csv_cell(&record[at]).to_owned());
            }
        }
        if track.samples.is_empty() {
            return Err(TrackError::Empty);
        }
        let columns = further.iter().zip(texts);
        track.columns = columns.map(|(&at, texts)| Column::parsed(of_csv_cell(&header[at]), texts)).collect();
        track.period_min = period_of(&track.samples).unwrap_or(PAPER_PERIOD_MIN);
        if step.is_none() && time.is_some() {
            track.number_by_time();
        }
        track.take_stems();
        Ok(track)
    }

    /// Numbers the steps by their times: what was not seen for hours is not one step.
    fn number_by_time(&mut self) {
        let period_s = 60.0 * self.period_min;
        let gap = |pair: &[Sample]| ((pair[1].time_s - pair[0].time_s) / period_s).round().max(1.0);
        let gaps: Vec<f64> = self.samples.windows(2).map(gap).collect();
        // Times of no calendar leave the rows as they are.
        if gaps.iter().sum::<f64>() < f64::from(u32::MAX) {
            let mut step = 0;
            for (sample, gap) in self.samples[1..].iter_mut().zip(gaps) {
                step += gap as u32;
                sample.step = step;
            }
        }
    }
}

/// Column of the coordinate `axis` of the point `vertex` of a stem, from 0 at the base.
fn stem_column(vertex: usize, axis: &str) -> String {
    format!("stem_{}_{axis}_cm", vertex + 1)
}

/// Ten points along the stem of a sample, at equal distances unless it has ten points already; z is NaN where it is not
/// known. None without a stem.
fn ten_points(sample: &Sample) -> Vec<Vec3> {
    let Some(stem) = &sample.stem else { return Vec::new() };
    let is_ten = stem.0.len() == STEM_POINTS;
    match &sample.depth {
        Some(depth) if depth.stem_cm.len() == stem.0.len() => {
            let points: Vec<Vec3> =
                stem.0.iter().zip(&depth.stem_cm).map(|(at, &z)| [at.x, at.y, z]).collect();
            if is_ten { points } else { resampled(&points, STEM_POINTS) }
        }
        _ => {
            let even = if is_ten { stem } else { &stem.resampled(STEM_POINTS) };
            even.0.iter().map(|at| [at.x, at.y, f64::NAN]).collect()
        }
    }
}

/// Minutes between two steps: the median of the times between rows a step apart, to a tenth of a second.
fn period_of(samples: &[Sample]) -> Option<f64> {
    let apart: Vec<f64> = samples
        .windows(2)
        .filter(|pair| pair[1].step == pair[0].step + 1)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .filter(|&seconds| seconds > 0.0)
        .collect();
    (!apart.is_empty()).then(|| ((median(&apart) * 10.0).round() / 600.0).max(1.0 / 600.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_track() -> impl Strategy<Value = Track> {
        let sample = (-3_000_000..3_000_000, -10_000..3_000_000, 0..4_usize, 0..3_usize);
        prop::collection::vec(sample, 1..20).prop_map(|rows| {
            let samples = rows.into_iter().enumerate().map(|(step, (x, y, light, quality))| Sample {
                step: step as u32,
                time_s: step as f64 * 300.0,
                tip: Point::new(f64::from(x) / 1e5, f64::from(y) / 1e5),
                stem: None,
                depth: None,
                light: [Some(Light::LEFT), Some(Light::RIGHT), None, None][light],
                levels: (light == 3).then(|| Lighting::only(Light::LEFT).with(Light::RIGHT, 7)),
                quality: [Quality::Measured, Quality::CarriedForward, Quality::Simulated][quality],
            });
            Track::of(samples.collect())
        })
    }

    proptest! {
        #[test]
        fn csv_comes_back(mut track in any_track()) {
            let rows = track.samples.len();
            track.add_numbers("length_cm", 3, (0..rows).map(|row| if row % 3 == 1 { f64::NAN } else { 0.1 * row as f64 }));
            track.columns.push(Column::text("frame", (0..rows).map(|row| format!("{row:04}.jpg")).collect()));
            track.columns.push(Column::text("code", (0..rows).map(|row| format!("{row:04}")).collect()));
            prop_assert_eq!(Track::read_csv(track.to_csv().as_slice()).unwrap(), track);
        }

        #[test]
        fn a_rounded_number_has_the_digits_of_the_standard_library(units in any::<i64>(), size in 0..60_u32, decimals in 0..12_usize) {
            let value = (units >> size) as f64 / 10_f64.powi(decimals as i32);
            prop_assert_eq!(cell(value, decimals), format!("{value:.decimals$}"));
        }

        #[test]
        fn a_mirror_of_a_mirror_is_the_track(track in any_track()) {
            prop_assert_eq!(track.mirrored().unwrap().mirrored().unwrap(), track);
        }

        #[test]
        fn any_bytes_are_a_track_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = Track::read_csv(bytes.as_slice());
        }
    }

    fn error(text: &str) -> String {
        Track::read_csv(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn errors_name_the_place() {
        assert!(error("").contains("tip_x_cm"));
        assert!(error("tip_x_cm,light\n1,left\n").contains("wanted \"tip_y_cm\""));
        assert!(error("tip_x_cm,tip_y_cm,light\n").contains("no rows"));
        let nan = error("tip_x_cm,tip_y_cm,light\n0,4,left\n0,NaN,left\n");
        assert!(nan.contains("line 3") && nan.contains("tip_y_cm \"NaN\""), "{nan}");
        assert!(
            error("tip_x_cm,tip_y_cm,light\n0,4,up\n")
                .contains("light \"up\", wanted left, right, front, back or dark")
        );
        assert!(
            error("step,tip_x_cm,tip_y_cm,light\n3,0,4,left\n3,0,4,left\n").contains("after the row above")
        );
    }

    #[test]
    fn a_number_of_very_many_digits_comes_back_as_text() {
        let digits = format!("0.{}", "3".repeat(70_000));
        let file = format!("tip_x_cm,tip_y_cm,light,more\n0,4,left,{digits}\n");
        let track = Track::read_csv(file.as_bytes()).unwrap();
        assert!(String::from_utf8(track.to_csv()).unwrap().contains(&digits));
    }

    #[test]
    fn formulas_in_text_are_quoted_and_come_back() {
        let rows = [0.0, -1.0, 2.0].into_iter().enumerate().map(|(step, x)| Sample {
            step: step as u32,
            time_s: 300.0 * step as f64,
            tip: Point::new(x, 4.0),
            stem: None,
            depth: None,
            light: None,
            levels: None,
            quality: Quality::Measured,
        });
        let mut track = Track::of(rows.collect());
        track.add_numbers("dx_cm", 1, [0.0, -1.0, 3.0]);
        let names = ["=HYPERLINK(1).jpg", "'=2.jpg", "-3"].map(str::to_owned);
        track.columns.push(Column::text("frame", names.to_vec()));
        track
            .columns
            .push(Column::text("a \"note\", free", ["", "a,\nb", "\"c\""].map(str::to_owned).to_vec()));
        let bytes = track.to_csv();
        let text = String::from_utf8(bytes.clone()).unwrap();
        assert!(
            text.contains(",-1.0,''=2.jpg,\"a,\nb\"\n") && text.contains(",'=HYPERLINK(1).jpg,\n"),
            "{text}"
        );
        assert!(text.contains(",3.0,-3,\"\"\"c\"\"\"\n"), "{text}");
        assert_eq!(Track::read_csv(bytes.as_slice()).unwrap(), track);
    }

    #[test]
    fn three_columns_are_enough() {
        let track = Track::read_csv("light,tip_y_cm,tip_x_cm\nleft,4,0\ndark,4.5,-1\n".as_bytes()).unwrap();
        assert_eq!(track.samples[1].tip, Point::new(-1.0, 4.5));
        assert_eq!(track.samples[1].time_s, 300.0);
        assert_eq!(track.shifts().count(), 1);
        let rows = "time_s,light,tip_y_cm,tip_x_cm\n0,left,4,0\n310,left,4.1,0\n600,left,4.2,0\n29400,left,9,0\n29700,left,9.1,0\n";
        let track = Track::read_csv(rows.as_bytes()).unwrap();
        let steps: Vec<u32> = track.samples.iter().map(|sample| sample.step).collect();
        assert_eq!(
            (steps, track.shifts().count()),
            (vec![0, 1, 2, 96, 97], 3),
            "eight hours are not one step"
        );
        let never = rows.replace("29400", "1e300").replace("29700", "1e300");
        assert_eq!(Track::read_csv(never.as_bytes()).unwrap().samples[4].step, 4);
    }

    #[test]
    fn tips_carried_forward_gaps_and_darkness_give_no_shift() {
        let text = "step,tip_x_cm,tip_y_cm,light,quality\n0,0,4,left,measured\n1,0,4,left,carried_forward\n2,0,4,dark,measured\n\
                    3,0,4,right,measured\n5,0,4,right,measured\n6,0,4,dark,measured\n";
        let track = Track::read_csv(text.as_bytes()).unwrap();
        assert_eq!(track.shifts().count(), 1);
    }
}
