//! An evolved network as text, page, picture or graph, with a map of its decisions.
//!
//! In: a genome file, or the folder of an evolution, a study or a run. Out: the properties of the network and a
//! drawing. If a plant that it steered is at hand, its path is drawn on the map.

mod source;
mod drawing;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::control::network_analysis::{Boundary, NetworkAnalysis};
use tropism::evolve::Champion;
use tropism::task::Task;
use tropism::text::plural;
use tropism_neat::Genome;
use tropism_report as report;

use self::source::ShownChampion;
use crate::{Error, Monitor, Workflow, files};

/// Shows a champion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShowPlan {
    /// Genome file; or the folder of an evolution (finished or at work), a study or a run.
    pub source: PathBuf,
    /// File for the drawing. Without one it is only in the results.
    pub out: Option<PathBuf>,
    /// Format of the drawing; `None`: as the extension of `out` says, or text.
    pub format: Option<ShowFormat>,
    /// File of a tip-motion model on which the network steers a plant; `None`: the model that it evolved on, if it is
    /// found.
    pub model: Option<PathBuf>,
    /// Task of the plant; `None`: the one that the network evolved for, or the paper's.
    pub task: Option<Task>,
}

impl Default for ShowPlan {
    fn default() -> Self {
        Self { source: "tropism-study".into(), out: None, format: None, model: None, task: None }
    }
}

/// Format of a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShowFormat {
    /// Plain text, with the map in letters.
    Text,
    /// HTML page.
    Html,
    /// SVG picture.
    Svg,
    /// Graph for Graphviz.
    Dot,
}

/// The properties of a network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShowResults {
    /// File of the genome.
    pub genome: PathBuf,
    /// Number of inputs without the bias.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Number of hidden neurons.
    pub hidden: usize,
    /// Number of links.
    pub links: usize,
    /// Number of links to a neuron of the same or a lower depth.
    pub recurrent_links: usize,
    /// Number of hidden neurons from which a path leads to the output.
    pub live_hidden: usize,
    /// Number of links from which a path leads to the output.
    pub live_links: usize,
    /// Whether the output is a weighted sum of the inputs.
    pub is_linear: bool,
    /// Whether live links form a cycle.
    pub has_memory: bool,
    /// Factors of x, y and 1 of a linear controller: the right lamp is lit where their sum is above 0.
    pub boundary: Option<[f64; 3]>,
    /// Fitness of the plant whose path is drawn: in cm, or round a pole in turns.
    pub fitness: Option<f64>,
    /// Whether that plant is virtual, or its model made from virtual plants.
    pub is_virtual: Option<bool>,
    /// File of the drawing.
    pub out: Option<PathBuf>,
    /// Whether the network is too large for a picture.
    #[serde(skip)]
    pub is_too_large: bool,
    /// The drawing, in the format of the plan.
    #[serde(skip)]
    pub drawing: String,
}

impl Workflow for ShowPlan {
    type Results = ShowResults;

    const SCHEMA: &'static str = "tropism.show/1";

    fn check(&self) -> Result<(), Error> {
        if let Some(task) = &self.task {
            task.check().map_err(Error::in_plan("task"))?;
        }
        self.drawing_format()?;
        let inputs = || {
            let files = if self.source.is_dir() {
                files::files_below(&self.source)
            } else {
                vec![self.source.clone()]
            };
            files.into_iter().filter(|file| !is_drawing(file)).chain(self.model.clone()).collect()
        };
        files::check_outputs_with(self.out.as_slice(), inputs)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<ShowResults, Error> {
        let champion = ShownChampion::find(self, monitor)?;
        let mut results = ShowResults::new(&champion);
        results.drawing = champion.draw(self.drawing_format()?, &results)?;
        if let Some(path) = &self.out {
            files::write(path, results.drawing.as_bytes())?;
            results.out = Some(path.clone());
        }
        Ok(results)
    }
}

impl ShowPlan {
    /// The format of the plan, or by the extension of its file.
    fn drawing_format(&self) -> Result<ShowFormat, Error> {
        let Some(path) = self.out.as_ref().filter(|_| self.format.is_none()) else {
            return Ok(self.format.unwrap_or(ShowFormat::Text));
        };
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "html" | "htm" => Ok(ShowFormat::Html),
            "svg" => Ok(ShowFormat::Svg),
            "dot" | "gv" => Ok(ShowFormat::Dot),
            "txt" => Ok(ShowFormat::Text),
            _ => Err(Error::Plan(format!(
                "`out` {}: wanted .html, .svg, .dot or .txt, or a `format`",
                path.display()
            ))),
        }
    }
}

impl ShowResults {
    fn new(champion: &ShownChampion) -> Self {
        let ShownChampion { champion: Champion { genome, .. }, steered, .. } = champion;
        let analysis = NetworkAnalysis::of(genome);
        Self {
            genome: champion.file.clone(),
            inputs: genome.inputs(),
            outputs: genome.outputs(),
            hidden: genome.hidden(),
            links: genome.links().len(),
            recurrent_links: recurrent_links(genome),
            live_hidden: analysis.hidden,
            live_links: analysis.links,
            is_linear: analysis.is_linear,
            has_memory: analysis.has_memory,
            boundary: Boundary::of(genome).map(|line| [line.x, line.y, line.constant]),
            fitness: steered.as_ref().map(|(track, _)| champion.task.fitness(track)),
            is_virtual: steered.as_ref().map(|(_, plants)| plants.is_virtual()),
            out: None,
            is_too_large: report::too_large_to_draw(genome).is_some(),
            drawing: String::new(),
        }
    }

    /// The properties of the network in a few lines.
    #[must_use]
    pub fn summary(&self) -> String {
        let Self { inputs, outputs, hidden, links, recurrent_links, .. } = self;
        let kind = match (self.is_linear, self.has_memory) {
            (true, _) => "linear: the output is a weighted sum of the inputs",
            (false, false) => "not linear, without memory: no links form a cycle",
            (false, true) => "not linear, with memory: links form a cycle",
        };
        let rule = self.boundary.map_or_else(String::new, |[x, y, constant]| {
            format!("\n{}", report::rule(Boundary { x, y, constant }))
        });
        let idle = match (hidden - self.live_hidden, links - self.live_links) {
            (0, 0) => String::new(),
            (neurons, links) => {
                let (neurons, links) = (plural(neurons, "hidden neuron"), plural(links, "link"));
                format!("\nwithout a way to the output: {neurons} and {links}")
            }
        };
        format!(
            "{} and the bias, {}, {}, {}, {recurrent_links} of them recurrent\n{kind}{rule}{idle}",
            plural(*inputs, "input"),
            plural(*outputs, "output"),
            plural(*hidden, "hidden neuron"),
            plural(*links, "link")
        )
    }
}

/// Whether a file that lies in a folder of networks is a drawing: none is read, so one may be drawn again.
fn is_drawing(file: &Path) -> bool {
    let extension = file.extension().unwrap_or_default().to_ascii_lowercase();
    ["html", "htm", "svg", "dot", "gv", "txt"].iter().any(|drawing| extension == *drawing)
}

fn recurrent_links(genome: &Genome) -> usize {
    let depth = |id| genome.position(id).map_or(0.0, |place| genome.neurons()[place].depth);
    genome.links().iter().filter(|link| depth(link.from) >= depth(link.to)).count()
}
