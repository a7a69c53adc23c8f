//! Tracks as columns of numpy arrays.

use std::path::PathBuf;

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use tropism::geometry::STEM_POINTS;
use tropism::task::Task;
use tropism::track::Values;
use tropism_lab::files;

use crate::error::{parsed, refused};
use crate::parts;

/// The path of a tip over an experiment. It does not change.
#[pyclass(frozen, eq, module = "tropism._core")]
#[derive(PartialEq)]
pub(crate) struct Track(pub(crate) tropism::track::Track);

#[pymethods]
impl Track {
    /// Reads a track file, with its lamps and stems where files beside it tell them.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        files::read_track(&path).map(Self).map_err(|error| refused(crate::error::with_causes(&error)))
    }

    /// Reads the bytes of a track file.
    #[staticmethod]
    fn from_csv(bytes: &[u8]) -> PyResult<Self> {
        tropism::track::Track::read_csv(bytes).map(Self).map_err(refused)
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
        Ok(parsed::<Task>("task", task)?.fitness(&self.0))
    }
}
