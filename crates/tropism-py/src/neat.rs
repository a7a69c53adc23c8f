//! NEAT by ask and tell, and networks over numpy arrays.

use numpy::ndarray::{Array2, Array3, Axis};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use rayon::prelude::*;
use tropism_neat::{Config, Novelty as CoreNovelty, NoveltyConfig};

use crate::error::{WrongTypeError, parsed, refused};
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

    /// A drawing of its neurons and links.
    fn _repr_svg_(&self) -> PyResult<String> {
        crate::figure::draw_genome(&self.0)
    }

    fn __getnewargs__(&self) -> (String,) {
        (self.to_json(),)
    }

    #[new]
    fn new(text: &str) -> PyResult<Self> {
        Self::from_json(text)
    }
}

/// An array of float64 of anything that numpy makes one of: other types, lists, slices. None of its numbers is NaN.
fn array_of<'py>(values: &Bound<'py, PyAny>, what: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let py = values.py();
    let array = match values.cast::<PyArrayDyn<f64>>() {
        Ok(array) => array.clone(),
        Err(_) => {
            let numpy = py.import("numpy")?;
            let kind = || values.get_type().name().map_or_else(|_| String::new(), |name| name.to_string());
            let array = numpy.call_method1("asarray", (values, "float64")).map_err(|error| {
                WrongTypeError::new_err(format!("{what}: found {}, wanted numbers: {error}", kind()))
            })?;
            array.cast_into::<PyArrayDyn<f64>>().map_err(PyErr::from)?
        }
    };
    let array = array.try_readonly()?;
    if let Some(place) = array.as_array().iter().position(|value| value.is_nan()) {
        return Err(refused(format!(
            "{what}: found NaN at place {place} of the flattened array, wanted numbers"
        )));
    }
    Ok(array)
}

/// A shape as Python writes it: (50, 2).
fn tuple_of(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        many => format!("({})", many.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
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
    let array = array_of(values, "numbers")?;
    if array.ndim() != 1 {
        return Err(refused(format!(
            "found an array of shape {}, wanted one row of numbers",
            tuple_of(array.shape())
        )));
    }
    use_them(&array.as_array().iter().copied().collect::<Vec<f64>>())
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
    genome: tropism_neat::Genome,
    inputs: usize,
}

#[pymethods]
impl Network {
    /// The network of a genome; `state` is that of a saved one.
    #[new]
    #[pyo3(signature = (genome, state=None))]
    fn new(genome: &Genome, state: Option<Vec<f64>>) -> PyResult<Self> {
        let mut network = tropism_neat::Network::new(&genome.0);
        if let Some(state) = state {
            check_count(state.len(), network.state().len(), "activations of the state")?;
            network.set_state(&state);
        }
        Ok(Self { network, genome: genome.0.clone(), inputs: genome.0.inputs() })
    }

    /// The genome of the network.
    #[getter]
    fn genome(&self) -> Genome {
        Genome(self.genome.clone())
    }

    fn __getnewargs__(&self) -> (Genome, Vec<f64>) {
        (self.genome(), self.state())
    }

    fn __repr__(&self) -> String {
        let (genome, kind) =
            (&self.genome, if self.is_feed_forward() { "feed-forward" } else { "recurrent" });
        let (inputs, outputs) = (genome.inputs(), genome.outputs());
        format!("Network({inputs} inputs, {outputs} outputs, {} links, {kind})", genome.links().len())
    }

    fn _repr_svg_(&self) -> PyResult<String> {
        crate::figure::draw_genome(&self.genome)
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
    genomes: Vec<tropism_neat::Genome>,
    networks: Vec<tropism_neat::Network>,
    inputs: usize,
    outputs: usize,
}

impl Networks {
    fn of(genomes: Vec<tropism_neat::Genome>, inputs: usize, outputs: usize) -> Self {
        Self { networks: genomes.iter().map(tropism_neat::Network::new).collect(), genomes, inputs, outputs }
    }
}

/// Fewer activations than this are not worth other threads. Chosen: about 50 microseconds of work.
const WORTH_THREADS: usize = 1000;

#[pymethods]
impl Networks {
    #[new]
    fn new(genomes: Vec<PyRef<'_, Genome>>) -> PyResult<Self> {
        let Some(first) = genomes.first() else {
            return Err(refused("there are no genomes"));
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
        let genomes: Vec<_> = genomes.iter().map(|genome| genome.0.clone()).collect();
        Ok(Self::of(genomes, inputs, outputs))
    }

    /// The genomes, in order.
    #[getter]
    fn genomes(&self) -> Vec<Genome> {
        self.genomes.iter().cloned().map(Genome).collect()
    }

    /// The activations of each network, in the order of its genome's neurons.
    #[getter]
    fn states(&self) -> Vec<Vec<f64>> {
        self.networks.iter().map(|network| network.state().to_vec()).collect()
    }

    fn __getnewargs__(&self) -> (Vec<Genome>,) {
        (self.genomes(),)
    }

    fn __getstate__(&self) -> Vec<Vec<f64>> {
        self.states()
    }

    fn __setstate__(&mut self, states: Vec<Vec<f64>>) -> PyResult<()> {
        check_count(states.len(), self.networks.len(), "states")?;
        for (network, state) in self.networks.iter_mut().zip(&states) {
            check_count(state.len(), network.state().len(), "activations of a state")?;
            network.set_state(state);
        }
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!(
            "Networks({} networks of {} inputs, {} outputs)",
            self.networks.len(),
            self.inputs,
            self.outputs
        )
    }

    fn __len__(&self) -> usize {
        self.networks.len()
    }

    /// Runs every network, from rest, on the rows of `inputs`, one after the other.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        inputs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        check_fork()?;
        let inputs = array_of(inputs, "inputs")?;
        let inputs = inputs.as_array();
        let count = self.networks.len();
        let is_shared = match inputs.shape() {
            &[_, width] if width == self.inputs => true,
            &[networks, _, width] if width == self.inputs && networks == count => false,
            shape => {
                let wanted = format!("(rows, {}) or ({count}, rows, {})", self.inputs, self.inputs);
                return Err(refused(format!("found inputs of shape {}, wanted {wanted}", tuple_of(shape))));
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
        inputs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = array_of(inputs, "inputs")?;
        let inputs = inputs.as_array();
        if inputs.shape() != [self.networks.len(), self.inputs] {
            let wanted = (self.networks.len(), self.inputs);
            return Err(refused(format!(
                "found inputs of shape {}, wanted {wanted:?}",
                tuple_of(inputs.shape())
            )));
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
        Networks::of(population.to_vec(), inputs, outputs)
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
        behaviours: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let behaviours = array_of(behaviours, "behaviours")?;
        if behaviours.ndim() != 2 {
            let shape = tuple_of(behaviours.shape());
            return Err(refused(format!("found behaviours of shape {shape}, wanted (individuals, numbers)")));
        }
        let rows: Vec<Vec<f64>> =
            behaviours.as_array().outer_iter().map(|row| row.iter().copied().collect()).collect();
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
