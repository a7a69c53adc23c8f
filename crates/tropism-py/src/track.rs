//! Tracks as columns of numpy arrays.

use std::path::PathBuf;

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use tropism::geometry::STEM_POINTS;
use tropism::geometry::path::resampled;
use tropism::track::Values;
use tropism_lab::files;

use serde::{Deserialize, Serialize};
use tropism::geometry::{Point, Polyline};
use tropism::lamps::{Layout, Light};
use tropism::observation::{Depth, Quality};
use tropism::track::{Column, Sample};

use crate::error::{of_file, parsed, refused};
use crate::parts;
use crate::tent::task_of;

/// All of a track, to the bit: what `pickle` and constructors exchange. Numbers that are missing are null.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Whole {
    layout: Layout,
    period_min: f64,
    step: Vec<u32>,
    time_s: Vec<f64>,
    tips: Vec<Point>,
    /// Numbers of the lamps.
    lights: Vec<Option<usize>>,
    quality: Vec<Quality>,
    #[serde(default)]
    stems: Vec<Option<Vec<[f64; 2]>>>,
    #[serde(default)]
    depths: Vec<Option<Depth>>,
    #[serde(default)]
    columns: Vec<WholeColumn>,
}

/// A further column: numbers, or words.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WholeColumn {
    name: String,
    #[serde(default)]
    numbers: Option<Vec<Option<f64>>>,
    #[serde(default)]
    words: Option<Vec<String>>,
    /// Decimals of the numbers in a file.
    #[serde(default)]
    decimals: usize,
}

impl Whole {
    fn of(track: &tropism::track::Track) -> Self {
        let samples = &track.samples;
        let points = |stem: &Polyline| stem.0.iter().map(|point| [point.x, point.y]).collect();
        let columns = track.columns.iter().map(|column| {
            let name = column.name.clone();
            let finite = |value: &f64| Some(*value).filter(|value| value.is_finite());
            match &column.values {
                Values::Numbers { values, decimals } => {
                    let numbers = Some(values.iter().map(finite).collect());
                    WholeColumn { name, numbers, words: None, decimals: *decimals }
                }
                Values::Text(words) => {
                    WholeColumn { name, numbers: None, words: Some(words.clone()), decimals: 0 }
                }
            }
        });
        Self {
            layout: track.layout.clone(),
            period_min: track.period_min,
            step: samples.iter().map(|sample| sample.step).collect(),
            time_s: samples.iter().map(|sample| sample.time_s).collect(),
            tips: samples.iter().map(|sample| sample.tip).collect(),
            lights: samples.iter().map(|sample| sample.light.map(Light::index)).collect(),
            quality: samples.iter().map(|sample| sample.quality).collect(),
            stems: samples.iter().map(|sample| sample.stem.as_ref().map(points)).collect(),
            depths: samples.iter().map(|sample| sample.depth.clone()).collect(),
            columns: columns.collect(),
        }
    }

    fn track(mut self) -> PyResult<tropism::track::Track> {
        let rows = self.step.len();
        if rows == 0 {
            return Err(refused("the track has no rows"));
        }
        self.stems.resize(rows, None);
        self.depths.resize(rows, None);
        let counts = [
            ("time_s", self.time_s.len()),
            ("tips", self.tips.len()),
            ("lights", self.lights.len()),
            ("quality", self.quality.len()),
        ];
        if let Some((name, count)) = counts.into_iter().find(|(_, count)| *count != rows) {
            return Err(refused(format!("found {count} values of {name} for {rows} rows")));
        }
        if let Some(row) = (1..rows).find(|&row| self.step[row] <= self.step[row - 1]) {
            return Err(refused(format!(
                "row {row}: found step {}, wanted a step after the row above",
                self.step[row]
            )));
        }
        let mut samples = Vec::with_capacity(rows);
        for row in 0..rows {
            let light = self.lights[row].map(|number| {
                let light = Light::new(number).filter(|light| self.layout.contains(*light));
                light.ok_or_else(|| {
                    refused(format!("row {row}: found lamp {number}, wanted 0 to {}", self.layout.len() - 1))
                })
            });
            let stem = self.stems[row].take();
            samples.push(Sample {
                step: self.step[row],
                time_s: self.time_s[row],
                tip: self.tips[row],
                stem: stem.map(ten_points),
                depth: self.depths[row].take(),
                light: light.transpose()?,
                levels: None,
                quality: self.quality[row],
            });
        }
        let mut columns = Vec::new();
        for WholeColumn { name, numbers, words, decimals } in self.columns {
            let values = match (numbers, words) {
                (Some(numbers), None) if numbers.len() == rows => Values::Numbers {
                    values: numbers.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect(),
                    decimals,
                },
                (None, Some(words)) if words.len() == rows => Values::Text(words),
                _ => return Err(refused(format!("column {name:?}: wanted {rows} numbers or words"))),
            };
            columns.push(Column { name, values });
        }
        Ok(tropism::track::Track { layout: self.layout, period_min: self.period_min, samples, columns })
    }
}

/// A stem of ten points, as track files have it.
fn ten_points(points: Vec<[f64; 2]>) -> Polyline {
    let points: Vec<Point> = points.into_iter().map(Point::from).collect();
    if points.len() == STEM_POINTS || points.len() < 2 {
        Polyline(points)
    } else {
        Polyline(resampled(&points, STEM_POINTS))
    }
}

/// The path of a tip over an experiment. It does not change.
#[pyclass(frozen, eq, module = "tropism._core")]
#[derive(PartialEq)]
pub(crate) struct Track(pub(crate) tropism::track::Track);

#[pymethods]
impl Track {
    /// Reads a track file, with its lamps and stems where files beside it tell them.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        files::read_track(&path).map(Self).map_err(|error| of_file(&error))
    }

    /// Reads the bytes of a track file.
    #[staticmethod]
    fn from_csv(bytes: &[u8]) -> PyResult<Self> {
        tropism::track::Track::read_csv(bytes).map(Self).map_err(refused)
    }

    /// The track that `to_json` wrote, with the same bits.
    #[new]
    fn new(text: &str) -> PyResult<Self> {
        parsed::<Whole>("track", text)?.track().map(Self)
    }

    /// All of the track as JSON.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&Whole::of(&self.0)).map_err(refused)
    }

    fn __getnewargs__(&self) -> PyResult<(String,)> {
        Ok((self.to_json()?,))
    }

    /// The rows from `start` to `end`, as a track.
    fn rows(&self, start: usize, end: usize) -> PyResult<Self> {
        let samples = self.0.samples.get(start..end).filter(|samples| !samples.is_empty());
        let samples = samples.ok_or_else(|| refused("the slice has no rows"))?.to_vec();
        let columns = self.0.columns.iter().map(|column| {
            let values = match &column.values {
                Values::Numbers { values, decimals } => {
                    Values::Numbers { values: values[start..end].to_vec(), decimals: *decimals }
                }
                Values::Text(words) => Values::Text(words[start..end].to_vec()),
            };
            Column { name: column.name.clone(), values }
        });
        let (layout, period_min) = (self.0.layout.clone(), self.0.period_min);
        Ok(Self(tropism::track::Track { layout, period_min, columns: columns.collect(), samples }))
    }

    /// The lamps with their places, as JSON.
    #[getter]
    fn layout(&self) -> PyResult<String> {
        serde_json::to_string(&self.0.layout).map_err(refused)
    }

    /// Writes a track file, with its stems as columns and its lamps in a file beside it where they are not the paper's.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let has_stems = self.0.samples.iter().any(|sample| sample.stem.is_some());
        let mut track = self.0.clone();
        if has_stems && !track.columns.iter().any(|column| column.name.starts_with("stem_1_")) {
            track.add_stem_columns();
        }
        files::write_track(&path, &track).map_err(|error| of_file(&error))
    }

    fn to_csv<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_csv())
    }

    fn __len__(&self) -> usize {
        self.0.samples.len()
    }

    #[getter]
    fn period_min(&self) -> f64 {
        self.0.period_min
    }

    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.0.layout.lamps().iter().map(|lamp| lamp.name.clone()).collect()
    }

    /// All columns, in the order of the file: arrays of numbers, lists of words.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let samples = &self.0.samples;
        let columns = PyDict::new(py);
        columns.set_item("step", samples.iter().map(|s| s.step).collect::<Vec<u32>>().into_pyarray(py))?;
        columns
            .set_item("time_s", samples.iter().map(|s| s.time_s).collect::<Vec<f64>>().into_pyarray(py))?;
        columns
            .set_item("tip_x_cm", samples.iter().map(|s| s.tip.x).collect::<Vec<f64>>().into_pyarray(py))?;
        columns
            .set_item("tip_y_cm", samples.iter().map(|s| s.tip.y).collect::<Vec<f64>>().into_pyarray(py))?;
        columns.set_item("light", samples.iter().map(|s| self.0.layout.name(s.light)).collect::<Vec<_>>())?;
        columns.set_item("quality", samples.iter().map(|s| s.quality.name()).collect::<Vec<_>>())?;
        for column in &self.0.columns {
            match &column.values {
                Values::Numbers { values, .. } => {
                    columns.set_item(&column.name, values.clone().into_pyarray(py))?
                }
                Values::Text(words) => columns.set_item(&column.name, words)?,
            }
        }
        Ok(columns)
    }

    /// The stems, ten points each from the base up, in cm: (rows, 10, 2), NaN where none was seen.
    fn stems<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray3<f64>> {
        let stems: Vec<_> = self.0.samples.iter().map(|sample| sample.stem.as_ref()).collect();
        parts::stems(py, &stems, STEM_POINTS)
    }

    /// The fitness for a task (JSON), eq. (9) for one with targets, in cm.
    fn fitness(&self, task: &str) -> PyResult<f64> {
        let task = task_of(task)?;
        match task.unscorable(&self.0) {
            Some(reason) => Err(refused(reason)),
            None => Ok(task.fitness(&self.0)),
        }
    }
}
