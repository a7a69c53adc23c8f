//! NEAT by ask and tell, and networks over numpy arrays.

use numpy::ndarray::{Array2, Array3, Axis};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArrayDyn,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use rayon::prelude::*;
use tropism_neat::{Config, Novelty as CoreNovelty, NoveltyConfig};

use crate::error::{parsed, refused};
use crate::threads::check_fork;

/// A neuron in Python's words: id, kind, depth, activation, slope and shift.
type NeuronRow = (u32, String, f64, String, f64, f64);

/// A genome: neurons and links, as NEAT breeds them. It does not change.
#[pyclass(frozen, eq, module = "tropism.neat")]
#[derive(PartialEq)]
pub(crate) struct Genome(pub(crate) tropism_neat::Genome);

#[pymethods]
impl Genome {
    /// Reads what `to_json` wrote, or a champion's network.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        tropism_neat::Genome::from_json(text).map(Self).map_err(refused)
    }

    fn to_json(&self) -> String {
        self.0.to_json()
    }

    #[getter]
    fn inputs(&self) -> usize {
        self.0.inputs()
    }

    #[getter]
    fn outputs(&self) -> usize {
        self.0.outputs()
    }

    #[getter]
    fn is_feed_forward(&self) -> bool {
        self.0.is_feed_forward()
    }

    /// Neurons: (id, kind, depth, activation, a, b) each.
    #[getter]
    fn neurons(&self) -> PyResult<Vec<NeuronRow>> {
        let word = |value: serde_json::Result<serde_json::Value>| {
            value.map(|word| word.as_str().unwrap_or_default().to_owned()).map_err(refused)
        };
        let neurons = self.0.neurons().iter();
        neurons
            .map(|neuron| {
                let activation = word(serde_json::to_value(neuron.activation))?;
                Ok((neuron.id, neuron.kind.to_string(), neuron.depth, activation, neuron.a, neuron.b))
            })
            .collect()
    }

    /// Links: (innovation, from, to, weight) each.
    #[getter]
    fn links(&self) -> Vec<(u32, u32, u32, f64)> {
        let links = self.0.links().iter();
        links.map(|link| (link.innovation, link.from, link.to, link.weight)).collect()
    }

    fn __repr__(&self) -> String {
        let genome = &self.0;
        format!("Genome({} neurons, {} links)", genome.neurons().len(), genome.links().len())
    }

    fn __getnewargs__(&self) -> (String,) {
        (self.to_json(),)
    }

    #[new]
    fn new(text: &str) -> PyResult<Self> {
        Self::from_json(text)
    }
}

/// Numbers from a list, a tuple or a one-dimensional array of float64, which is not copied twice.
fn with_numbers<T>(values: &Bound<'_, PyAny>, use_them: impl FnOnce(&[f64]) -> PyResult<T>) -> PyResult<T> {
    if values.is_exact_instance_of::<PyList>() || values.is_exact_instance_of::<PyTuple>() {
        return use_them(&values.extract::<Vec<f64>>()?);
    }
    if let Ok(array) = values.cast::<PyArray1<f64>>() {
        let array = array.try_readonly()?;
        return match array.as_slice() {
            Ok(slice) => use_them(slice),
            Err(_) => use_them(&array.as_array().to_vec()),
        };
    }
    let numbers: PyResult<Vec<f64>> = values.try_iter()?.map(|value| value?.extract()).collect();
    use_them(&numbers?)
}

fn check_count(found: usize, wanted: usize, what: &str) -> PyResult<()> {
    if found == wanted {
        return Ok(());
    }
    Err(refused(format!("found {found} {what}, wanted {wanted}")))
}

/// The network of a genome, with the state of its neurons.
#[pyclass(module = "tropism.neat")]
pub(crate) struct Network {
    network: tropism_neat::Network,
    inputs: usize,
}

#[pymethods]
impl Network {
    #[new]
    fn new(genome: &Genome) -> Self {
        Self { network: tropism_neat::Network::new(&genome.0), inputs: genome.0.inputs() }
    }

    #[getter]
    fn is_feed_forward(&self) -> bool {
        self.network.is_feed_forward()
    }

    /// Runs the network once: a whole pass if it is feed-forward, else one synchronous step.
    fn run<'py>(&mut self, inputs: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyList>> {
        with_numbers(inputs, |values| {
            check_count(values.len(), self.inputs, "inputs")?;
            PyList::new(inputs.py(), self.network.run(values).iter().copied())
        })
    }

    /// Advances the network by one synchronous step.
    fn activate<'py>(&mut self, inputs: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyList>> {
        with_numbers(inputs, |values| {
            check_count(values.len(), self.inputs, "inputs")?;
            PyList::new(inputs.py(), self.network.activate(values).iter().copied())
        })
    }

    /// Sets every activation to 0.
    fn flush(&mut self) {
        self.network.flush();
    }

    /// All activations, in the order of the genome's neurons.
    #[getter]
    fn state(&self) -> Vec<f64> {
        self.network.state().to_vec()
    }
}

/// The networks of many genomes, evaluated side by side on all threads.
#[pyclass(module = "tropism.neat")]
pub(crate) struct Networks {
    networks: Vec<tropism_neat::Network>,
    inputs: usize,
    outputs: usize,
}

/// Fewer activations than this are not worth other threads. Chosen: about 50 microseconds of work.
const WORTH_THREADS: usize = 1000;

#[pymethods]
impl Networks {
    #[new]
    fn new(genomes: Vec<PyRef<'_, Genome>>) -> PyResult<Self> {
        let Some(first) = genomes.first() else {
            return Err(refused("found no genomes, wanted at least one"));
        };
        let (inputs, outputs) = (first.0.inputs(), first.0.outputs());
        if let Some(other) =
            genomes.iter().find(|genome| (genome.0.inputs(), genome.0.outputs()) != (inputs, outputs))
        {
            return Err(refused(format!(
                "found genomes of {inputs} inputs and {outputs} outputs, and of {} and {}, wanted one shape",
                other.0.inputs(),
                other.0.outputs()
            )));
        }
        let networks = genomes.iter().map(|genome| tropism_neat::Network::new(&genome.0)).collect();
        Ok(Self { networks, inputs, outputs })
    }

    fn __len__(&self) -> usize {
        self.networks.len()
    }

    /// Runs every network, from rest, on the rows of `inputs`, one after the other.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        inputs: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        check_fork()?;
        let inputs = inputs.as_array();
        let count = self.networks.len();
        let is_shared = match inputs.shape() {
            &[_, width] if width == self.inputs => true,
            &[networks, _, width] if width == self.inputs && networks == count => false,
            shape => {
                let wanted = format!("(rows, {}) or ({count}, rows, {})", self.inputs, self.inputs);
                return Err(refused(format!("found inputs of shape {shape:?}, wanted {wanted}")));
            }
        };
        let rows = inputs.shape()[inputs.ndim() - 2];
        let mut outputs = Array3::zeros((count, rows, self.outputs));
        let shared = is_shared.then(|| inputs.as_standard_layout());
        py.detach(|| {
            let work = |(number, (network, mut outputs)): (
                usize,
                (&mut tropism_neat::Network, numpy::ndarray::ArrayViewMut2<'_, f64>),
            )| {
                network.flush();
                let own = if let Some(shared) = &shared {
                    shared.view()
                } else {
                    inputs.index_axis(Axis(0), number)
                };
                let mut values = vec![0.0; self.inputs];
                for (row, mut output) in own.outer_iter().zip(outputs.outer_iter_mut()) {
                    values.iter_mut().zip(row.iter()).for_each(|(value, input)| *value = *input);
                    output.iter_mut().zip(network.run(&values)).for_each(|(slot, value)| *slot = *value);
                }
            };
            let views: Vec<_> = outputs.outer_iter_mut().collect();
            let lanes: Vec<_> = self.networks.iter_mut().zip(views).enumerate().collect();
            if count * rows < WORTH_THREADS {
                lanes.into_iter().for_each(work);
            } else {
                lanes.into_par_iter().for_each(work);
            }
        });
        Ok(outputs.into_pyarray(py))
    }

    /// Advances every network by one synchronous step, each with its own row of `inputs`.
    fn activate<'py>(
        &mut self,
        py: Python<'py>,
        inputs: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = inputs.as_array();
        if inputs.shape() != [self.networks.len(), self.inputs] {
            let wanted = (self.networks.len(), self.inputs);
            return Err(refused(format!("found inputs of shape {:?}, wanted {wanted:?}", inputs.shape())));
        }
        let mut outputs = Array2::zeros((self.networks.len(), self.outputs));
        py.detach(|| {
            let mut values = vec![0.0; self.inputs];
            for ((network, row), mut output) in
                self.networks.iter_mut().zip(inputs.outer_iter()).zip(outputs.outer_iter_mut())
            {
                values.iter_mut().zip(row.iter()).for_each(|(value, input)| *value = *input);
                output.iter_mut().zip(network.activate(&values)).for_each(|(slot, value)| *slot = *value);
            }
        });
        Ok(outputs.into_pyarray(py))
    }

    /// Sets every activation to 0; with a mask of booleans, those of the chosen networks.
    #[pyo3(signature = (mask=None))]
    fn flush(&mut self, mask: Option<PyReadonlyArray1<'_, bool>>) -> PyResult<()> {
        let Some(mask) = mask else {
            self.networks.iter_mut().for_each(tropism_neat::Network::flush);
            return Ok(());
        };
        check_count(mask.as_array().len(), self.networks.len(), "values of the mask")?;
        for (network, is_chosen) in self.networks.iter_mut().zip(mask.as_array()) {
            if *is_chosen {
                network.flush();
            }
        }
        Ok(())
    }
}

/// A run of NEAT.
#[pyclass(module = "tropism._core")]
pub(crate) struct Neat(tropism_neat::Neat);

#[pymethods]
impl Neat {
    #[new]
    fn new(config: &str, inputs: usize, outputs: usize, seed: u64) -> PyResult<Self> {
        tropism_neat::Neat::new(parsed("config", config)?, inputs, outputs, seed).map(Self).map_err(refused)
    }

    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        py.detach(|| tropism_neat::Neat::from_json(text)).map(Self).map_err(refused)
    }

    fn to_json(&self, py: Python<'_>) -> String {
        py.detach(|| self.0.to_json())
    }

    /// The population to score.
    fn ask(&self) -> Vec<Genome> {
        self.0.ask().iter().cloned().map(Genome).collect()
    }

    /// The networks of the population.
    fn networks(&self) -> Networks {
        let population = self.0.ask();
        let (inputs, outputs) = (population[0].inputs(), population[0].outputs());
        Networks { networks: population.iter().map(tropism_neat::Network::new).collect(), inputs, outputs }
    }

    /// Takes a score for each individual, larger is better; returns statistics of the generation (JSON).
    fn tell(&mut self, scores: &Bound<'_, PyAny>) -> PyResult<String> {
        if scores.is_none() {
            return Err(PyTypeError::new_err("found None, wanted one score for each genome of `ask`"));
        }
        with_numbers(scores, |scores| {
            let generation = self.0.tell(scores).map_err(refused)?;
            serde_json::to_string(&generation).map_err(refused)
        })
    }

    #[getter]
    fn config(&self) -> PyResult<String> {
        serde_json::to_string(self.0.config()).map_err(refused)
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed()
    }

    #[getter]
    fn generation(&self) -> u32 {
        self.0.generation()
    }

    #[getter]
    fn evaluations(&self) -> u64 {
        self.0.evaluations()
    }

    /// The best individual so far: (genome, fitness, generation); `None` before the first `tell`.
    #[getter]
    fn champion(&self) -> Option<(Genome, f64, u32)> {
        let champion = self.0.champion()?;
        Some((Genome(champion.genome.clone()), champion.fitness, champion.generation))
    }

    /// The species: (id, age, stagnation, best fitness, members) each.
    #[getter]
    fn species(&self) -> Vec<(u32, u32, u32, f64, Vec<u32>)> {
        let species = self.0.species().iter();
        species.map(|s| (s.id(), s.age(), s.stagnation(), s.best_fitness(), s.members().to_vec())).collect()
    }
}

/// Novelty search: behaviours become scores.
#[pyclass(module = "tropism._core")]
pub(crate) struct Novelty(CoreNovelty);

#[pymethods]
impl Novelty {
    #[new]
    fn new(config: &str) -> PyResult<Self> {
        CoreNovelty::new(parsed::<NoveltyConfig>("config", config)?).map(Self).map_err(refused)
    }

    /// The novelty of each behaviour, a row each; the archive grows.
    fn scores<'py>(
        &mut self,
        py: Python<'py>,
        behaviours: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let rows: Vec<Vec<f64>> = behaviours.as_array().outer_iter().map(|row| row.to_vec()).collect();
        let scores = py.detach(|| self.0.scores(&rows)).map_err(refused)?;
        Ok(scores.into_pyarray(py))
    }
}

/// The parameters of a preset, as JSON.
#[pyfunction]
fn neat_config(preset: &str) -> PyResult<String> {
    let config = match preset {
        "multineat" => Config::multineat(),
        "stanley2002" => Config::stanley2002(),
        "wahby2016" => Config::wahby2016(),
        "ball_keeper" => Config::ball_keeper(),
        other => {
            let wanted = "multineat, stanley2002, wahby2016 or ball_keeper";
            return Err(refused(format!("found preset {other:?}, wanted {wanted}")));
        }
    };
    serde_json::to_string(&config).map_err(refused)
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Genome>()?;
    module.add_class::<Network>()?;
    module.add_class::<Networks>()?;
    module.add_class::<Neat>()?;
    module.add_class::<Novelty>()?;
    module.add_function(wrap_pyfunction!(neat_config, module)?)
}
