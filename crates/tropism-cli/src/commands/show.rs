//! `tropism show`: what an evolved controller is like.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use tropism::control::anatomy::{Anatomy, Boundary};
use tropism::control::network::NetworkController;
use tropism::plant::tip::TipModel;
use tropism::random::{Draws, Purpose};
use tropism::simulation::simulate;
use tropism::task::Task;
use tropism::track::Track;
use tropism_lab::files;
use tropism_neat::{Genome, NeuronKind};
use tropism_report::{self as report, Figure, Page, Plants, SteeredTrack};

use super::evolve::EvolutionPlan;
use super::run::RunPlan;
use crate::options::{TaskOption, load_model_for};
use crate::shell::Shell;

/// Show an evolved network, and which lamp it lights where
///
/// Without --out or --format it prints what the network is like, with its decisions in letters. The picture has the
/// network and a map: the lamp that is lit when the tip stands still at a place, and the path of a plant that it steered, if
/// one is found: that of a run folder, or one simulated on the model that it evolved on.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism show evolution/champion.json\n  \
    tropism show tropism-study --out champion.html\n  \
    tropism show evolution --format dot | dot -Tpdf > champion.pdf")]
pub(crate) struct Show {
    /// Genome file; or the folder of an evolution (also one at work), a study or a run, for its champion
    #[arg(value_name = "champion.json|DIR")]
    path: PathBuf,

    /// Where it goes: .html, .svg, .dot (Graphviz) or .txt
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Form of it, on stdout if there is no --out; that of the file's name by default
    #[arg(long, value_enum)]
    format: Option<Format>,

    /// Tip-motion model on which it steers a plant, instead of the one that it evolved on
    #[arg(long, value_name = "model.json")]
    model: Option<PathBuf>,

    #[command(flatten)]
    task: TaskOption,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Html,
    Svg,
    Dot,
}

/// A champion and where it comes from.
struct Found {
    genome: Genome,
    /// Where it was found.
    file: PathBuf,
    task: Task,
    steered: Option<(Track, Plants)>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Outcome {
    genome: PathBuf,
    inputs: usize,
    outputs: usize,
    hidden: usize,
    links: usize,
    recurrent_links: usize,
    /// Of the hidden neurons and links, those that lead to the output.
    live_hidden: usize,
    live_links: usize,
    is_linear: bool,
    has_memory: bool,
    /// Factors of x, y and 1: right where their sum is above 0.
    boundary: Option<[f64; 3]>,
    /// In cm, of the path that is drawn.
    fitness: Option<f64>,
    is_virtual: Option<bool>,
    out: Option<PathBuf>,
}

impl Show {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let format = self.format()?;
        let found = self.find(shell)?;
        let outcome = found.outcome(self.out.clone());
        if let Some(path) = &self.out {
            files::write(path, found.drawn(format)?.as_bytes())?;
            return shell.result(&format!("{}\nwrote {}", outcome.text(), path.display()), &outcome);
        }
        let mut text = found.drawn(format)?;
        if format == Format::Text {
            text += &format!("next: tropism show {} --out champion.html", self.path.display());
        }
        shell.result(text.trim_end(), &outcome)
    }

    fn format(&self) -> Result<Format> {
        let of_name = |path: &PathBuf| {
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            match extension.as_str() {
                "html" | "htm" => Ok(Format::Html),
                "svg" => Ok(Format::Svg),
                "dot" | "gv" => Ok(Format::Dot),
                "txt" => Ok(Format::Text),
                _ => bail!("--out {}: wanted .html, .svg, .dot or .txt, or a --format", path.display()),
            }
        };
        match (self.format, &self.out) {
            (Some(format), _) => Ok(format),
            (None, Some(path)) => of_name(path),
            (None, None) => Ok(Format::Text),
        }
    }

    fn find(&self, shell: &Shell) -> Result<Found> {
        if self.path.join("run.toml").exists() {
            return self.find_in_run();
        }
        let file = match self.path.is_dir() {
            false => self.path.clone(),
            true => ["champion.json", "evolution/champion.json"]
                .map(|name| self.path.join(name))
                .into_iter()
                .find(|file| file.exists() || file.with_file_name("evolution.toml").exists())
                .with_context(|| {
                    format!(
                        "{}: found no champion.json, evolution/champion.json or run.toml, wanted the folder of a \
                         finished evolution or study, or of a run",
                        self.path.display()
                    )
                })?,
        };
        // `evolution.toml` lies beside `champion.json`, or above `champions/run-00.json`.
        let folder = file.ancestors().skip(1).take(2).find(|folder| folder.join("evolution.toml").exists());
        let plan = match folder {
            Some(folder) => Some(files::read_toml::<EvolutionPlan>(&folder.join("evolution.toml"))?),
            None => None,
        };
        let genome = match &plan {
            Some(plan) if !file.exists() => so_far(plan, &file, shell)?,
            _ => files::read_as(&file, Genome::from_json)?,
        };
        let task = match (&plan, &self.task.task) {
            (Some(plan), None) => plan.task().clone(),
            _ => self.task.load()?,
        };
        let beside = folder.and_then(Path::parent).map(|study| study.join("model.json"));
        let model = match (&self.model, beside, &plan) {
            (Some(path), ..) => Some(load_model_for(path, &task, shell)?),
            (None, Some(path), Some(plan)) if path.exists() => {
                Some(files::read_as(&path, TipModel::from_json)?).filter(|model| plan.is_on(model))
            }
            _ => None,
        };
        let seed = plan.map_or(1, |plan| plan.seed);
        let steered = match (NetworkController::new(&genome), model) {
            (Ok(mut controller), Some(model)) => {
                let draws = Draws::new(seed, Purpose::Trial, [0; 3]);
                let plants = if model.is_virtual() { Plants::ModelOfVirtual } else { Plants::ModelOfReal };
                Some((simulate(&model, &mut controller, &task, draws), plants))
            }
            (Err(error), Some(_)) if self.model.is_some() => {
                return Err(error).with_context(|| file.display().to_string());
            }
            _ => None,
        };
        Ok(Found { genome, file, task, steered })
    }

    /// The network that steered a run, with the path of its plant as far as the run has come to an end.
    fn find_in_run(&self) -> Result<Found> {
        let (file, plan) = (self.path.join("run.toml"), RunPlan::read(&self.path)?);
        ensure!(
            self.model.is_none(),
            "--model: found the folder of a run, wanted none; its own plant is drawn"
        );
        let Some(network) = plan.network() else {
            bail!("{}: found the controller \"{}\", wanted a network", file.display(), plan.controller);
        };
        let genome = Genome::from_json(network).with_context(|| file.display().to_string())?;
        let track = self.path.join("track.csv");
        let steered = match track.exists() {
            true => Some((files::read_track(&track)?, plan.plants())),
            false => None,
        };
        let task = if self.task.task.is_some() { self.task.load()? } else { plan.task };
        Ok(Found { genome, file, task, steered })
    }
}

/// The best champion so far of an evolution that has not written the `file` of its champion yet.
fn so_far(plan: &EvolutionPlan, file: &Path, shell: &Shell) -> Result<Genome> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let (number, run) = plan.best_so_far(folder).with_context(|| {
        format!("{}: found an evolution that has just begun, wanted its first checkpoint", folder.display())
    })?;
    let (champion, fitness) = run.champion().context("a run that was chosen by its champion")?;
    shell.note(&format!(
        "{}: an evolution that is not over; the best so far: run {number}, {fitness:.2} cm after {} generations",
        folder.display(),
        run.neat.generation()
    ));
    Ok(champion.clone())
}

impl Found {
    fn outcome(&self, out: Option<PathBuf>) -> Outcome {
        let (genome, anatomy) = (&self.genome, Anatomy::of(&self.genome));
        let depth = |id| genome.position(id).map_or(0.0, |place| genome.neurons()[place].depth);
        Outcome {
            genome: self.file.clone(),
            inputs: genome.inputs(),
            outputs: genome.outputs(),
            hidden: genome.neurons().iter().filter(|neuron| neuron.kind == NeuronKind::Hidden).count(),
            links: genome.links().len(),
            recurrent_links: genome.links().iter().filter(|l| depth(l.from) >= depth(l.to)).count(),
            live_hidden: anatomy.hidden,
            live_links: anatomy.links,
            is_linear: anatomy.is_linear,
            has_memory: anatomy.has_memory,
            boundary: Boundary::of(genome).map(|line| [line.x, line.y, line.constant]),
            fitness: self.steered.as_ref().map(|(track, _)| self.task.fitness(track)),
            is_virtual: self.steered.as_ref().map(|(_, plants)| plants.is_virtual()),
            out,
        }
    }

    fn drawn(&self, format: Format) -> Result<String> {
        Ok(match format {
            Format::Dot => report::network_dot(&self.genome),
            Format::Svg => report::in_one_svg(&self.figures()),
            Format::Html => self.page().html(),
            Format::Text => {
                let path = self.steered.as_ref().map_or_else(String::new, |(track, plants)| {
                    let fitness = self.task.fitness(track);
                    format!("a plant that it steered: fitness {fitness:.2} cm. {}\n", plants.sentence())
                });
                let map = report::decision_text(&self.genome, &self.task.targets).unwrap_or_default();
                let key = if map.is_empty() {
                    ""
                } else {
                    "\nwhich lamp where: < left, > right, ~ depends on the past; digits: targets\n"
                };
                format!("{}\n{path}{key}{map}", self.outcome(None).text())
            }
        })
    }

    /// The network, and the map if it is a controller.
    fn figures(&self) -> Vec<Figure> {
        let steered = self.steered.as_ref().map(|(track, plants)| SteeredTrack { track, plants: *plants });
        let map = report::decision(&self.genome, &self.task.targets, steered).ok();
        [Some(report::network(&self.genome)), map].into_iter().flatten().collect()
    }

    fn page(&self) -> Page {
        Page {
            title: format!("The network of {}", self.file.display()),
            intro: self.outcome(None).text().replace('\n', "; ") + ".",
            plants: self.steered.as_ref().map_or(Plants::Real, |(_, plants)| *plants),
            numbers: Vec::new(),
            tables: Vec::new(),
            figures: self.figures(),
            command: format!("tropism show {}", self.file.display()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: Vec::new(),
            stages: Vec::new(),
            config: String::new(),
        }
    }
}

impl Outcome {
    fn text(&self) -> String {
        let Self { inputs, outputs, hidden, links, recurrent_links, .. } = self;
        let kind = match (self.is_linear, self.has_memory) {
            (true, _) => "linear: the output is a weighted sum of the inputs",
            (false, false) => "not linear, without memory: no links run in a circle",
            (false, true) => "not linear, with memory: links run in a circle",
        };
        let rule = self.boundary.map_or_else(String::new, |[x, y, constant]| {
            format!("\n{}", report::rule(Boundary { x, y, constant }))
        });
        let idle = match (hidden - self.live_hidden, links - self.live_links) {
            (0, 0) => String::new(),
            (neurons, links) => {
                format!("\n{neurons} hidden neurons and {links} links do not reach the output")
            }
        };
        format!(
            "{inputs} inputs and the bias, {outputs} output{}, {hidden} hidden neurons, {links} links, {recurrent_links} of them recurrent\n{kind}{rule}{idle}",
            if *outputs == 1 { "" } else { "s" }
        )
    }
}
