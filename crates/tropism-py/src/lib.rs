//! The compiled part of the Python package `tropism`: plans and settings come in as JSON, numbers as numpy arrays.

mod error;
mod threads;
mod workflow;
mod neat;
mod parts;
mod track;
mod model;
mod figure;
mod batch;
mod tent;
mod wall;
mod closed_loop;

use pyo3::prelude::*;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    workflow::add(module)?;
    neat::add(module)?;
    module.add_class::<parts::PyObservation>()?;
    module.add_class::<parts::Noise>()?;
    module.add_class::<track::Track>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<model::Plant>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<tent::Tent>()?;
    module.add_class::<tent::TentBatch>()?;
    module.add_class::<wall::Wall>()?;
    module.add_class::<closed_loop::Decider>()?;
    module.add_function(wrap_pyfunction!(figure::draw_tracks, module)?)?;
    module.add_function(wrap_pyfunction!(tent::decode, module)?)?;
    module.add_function(wrap_pyfunction!(tent::greenhouse_for, module)?)?;
    module.add_function(wrap_pyfunction!(batch::seen_from, module)?)?;
    module.add_function(wrap_pyfunction!(workflow::read_species, module)?)?;
    module.add_function(wrap_pyfunction!(workflow::read_task, module)?)?;
    module.add_function(wrap_pyfunction!(workflow::read_settings, module)?)?;
    module.add_function(wrap_pyfunction!(workflow::champion_of, module)?)?;
    module.add_function(wrap_pyfunction!(closed_loop::simulate_loop, module)?)?;
    module.add_function(wrap_pyfunction!(closed_loop::grow_loop, module)?)?;
    module.add_function(wrap_pyfunction!(closed_loop::rig_loop, module)?)?;
    module.add_function(wrap_pyfunction!(closed_loop::evolve_loop, module)?)
}
