//! `tropism wall`: virtual plants before a wall of nodes that steer together.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use tropism::nodes::{NodeEvolutionConfig, NodeFaults};
use tropism_lab::files::shell_word;
use tropism_lab::wall::{
    EvolveNodesPlan, NodeRule, NodeRuleResults, NodesFile, WallFile, WallPlan, WallResults,
};

use crate::options::{BeanOption, SeedOption, checked_variation};
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Simulate plants before a wall of nodes that steer together
///
/// A node is a lamp with a proximity sensor. Nodes hear their neighbours only; they hand the light over from node to node
/// along a drawn path. A decision is right if the plant reaches the height of a node of the path on its side of the wall.
/// The plants are virtual, and the same for all rules.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism wall tasks/wall.toml --rules machine,dormant,path-lit --out wall\n  \
                  tropism wall tasks/wall.toml --cameras --faults lost=0.9,restarts-per-day=1\n  \
                  tropism wall tasks/wall.toml --evolve nodes.json --runs 4 --seed 1\n\n\
                  Rules: machine (the hand-written state machine), dormant, all-lit, path-lit, or a file of --evolve\n\
                  Faults: lost (share of messages), late-h, restarts-per-day, forgets=true, and numbers of nodes of\n\
                  the path: blind, silent, dead-lamps, killed"
)]
pub(crate) struct Wall {
    /// Wall file: nodes, links, path, sensor; by default three levels of two nodes, with random paths
    #[arg(value_name = "WALL.toml")]
    wall: Option<PathBuf>,

    /// Rules that run in the nodes
    #[arg(long, value_delimiter = ',', default_value = "machine,dormant", value_parser = parse_rule, value_name = "RULE,...")]
    rules: Vec<NodeRule>,

    /// Number of virtual plants
    #[arg(long, default_value_t = 90, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    plants: u32,

    /// Largest number of steps of five minutes with the plant
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    steps: u32,

    /// Hours for which the nodes learn the empty scene before
    #[arg(long, default_value_t = 24.0, value_name = "H")]
    learning: f64,

    /// A camera in each node instead of the proximity sensor: of [camera] in the wall file, or the default one
    #[arg(long)]
    cameras: bool,

    /// Faults of nodes and messages, such as blind=1,lost=0.3
    #[arg(long, value_parser = parse_faults, value_name = "NAME=VALUE,...")]
    faults: Option<NodeFaults>,

    #[command(flatten)]
    bean: BeanOption,

    /// Individual variation as a multiple of that of the species, 0 to 2
    #[arg(long, default_value_t = 1.0, value_name = "X")]
    variation: f64,

    /// Evolve a network for all nodes on a model of plants, and write it to FILE instead
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["rules", "plants", "steps", "learning", "cameras", "faults", "out"])]
    evolve: Option<PathBuf>,

    /// Model in space of plants before this wall, for --evolve; without it one is made of virtual plants
    #[arg(long, requires = "evolve", value_name = "model.json")]
    model: Option<PathBuf>,

    /// Evolutions of --evolve, of which the best network is kept
    #[arg(long, default_value_t = 4, requires = "evolve", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,

    /// Generations of each of them
    #[arg(long, default_value_t = 50, requires = "evolve", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    generations: u32,

    /// Folder for figures and for what each node said
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    seed: SeedOption,
}

impl Wall {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut file = self.wall.as_deref().map(WallFile::read).transpose()?.unwrap_or_default();
        if self.cameras {
            file.camera.get_or_insert_default();
        }
        for warning in file.warnings() {
            shell.note(&format!("warning: {warning}"));
        }
        let (species, variation) =
            (self.bean.load()?.unwrap_or_default(), checked_variation(self.variation)?);
        if let Some(out) = self.evolve {
            // By this ending --rules knows it from the names of rules.
            let is_json = out.extension().is_some_and(|extension| extension == "json");
            ensure!(is_json, "--evolve {}: wanted a file that ends in .json", out.display());
            let (runs, generations) = (self.runs, self.generations);
            let config = NodeEvolutionConfig { runs, generations, ..NodeEvolutionConfig::default() };
            let (seed, replace) = (self.seed.seed, self.force);
            let plan = EvolveNodesPlan {
                file,
                model: self.model,
                config,
                species,
                variation,
                seed,
                out,
                replace,
                ..Default::default()
            };
            return execute_and_print(&plan, shell, |results| text_of_evolution(&plan, results));
        }
        let plan = WallPlan {
            file,
            rules: self.rules,
            plants: self.plants,
            species,
            variation,
            faults: self.faults.unwrap_or_default(),
            learning_h: self.learning,
            max_steps: self.steps,
            seed: self.seed.seed,
            out: self.out,
            replace: self.force,
            ..WallPlan::default()
        };
        execute_and_print(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &WallPlan, results: &WallResults) -> String {
    let (plants, nodes) = (plan.plants, plan.file.wall.nodes.len());
    let mut text =
        format!("{plants} virtual plants before {nodes} nodes; 95 % intervals\n{}", table(&results.rules));
    if let Some(out) = &plan.out {
        text += &format!("wrote {} files into {}", results.files.len(), out.display());
    }
    text.trim_end().to_owned()
}

/// What became of the plants, a line for each rule.
pub(crate) fn table(rules: &[NodeRuleResults]) -> String {
    let width = rules.iter().map(|of| of.rule.name().chars().count()).fold(9, usize::max);
    let mut text = format!(
        "{:<width$} {:<30} {:<30} {:<30} {:>6}\n",
        "rule", "decisions right", "whole paths", "within 2 cm of the node", "lit h"
    );
    for of in rules {
        let [right, whole, near] = [of.right, of.whole, of.near].map(|share| share.in_words());
        text += &format!("{:<width$} {right:<30} {whole:<30} {near:<30} {:>6.1}\n", of.rule.name(), of.lit_h);
        if let Some(above) = of.above_dead_lamp {
            text += &format!("{:<width$} above the dead lamp: {}\n", "", above.in_words());
        }
    }
    text
}

fn text_of_evolution(plan: &EvolveNodesPlan, NodesFile { nodes, .. }: &NodesFile) -> String {
    let out = plan.out.display();
    format!(
        "fitness {:.2} on {} fresh plants of the model: {:.0} % of decisions right, {:.0} % of whole paths, {:.1} h of light\n\
         run {}, generation {}, {} networks scored, {} links\nwrote {out}\nnext: tropism wall WALL.toml --rules machine,{}",
        nodes.test.fitness,
        plan.config.test_plants,
        100.0 * nodes.test.right,
        100.0 * nodes.test.whole,
        nodes.test.lit_h,
        nodes.run + 1,
        nodes.generation + 1,
        nodes.evaluations,
        nodes.genome.links().len(),
        shell_word(&plan.out),
    )
}

fn parse_rule(text: &str) -> Result<NodeRule, String> {
    let all = [NodeRule::Machine, NodeRule::Dormant, NodeRule::AllLit, NodeRule::PathLit];
    let known = all.each_ref().map(NodeRule::name).join(", ");
    if text.ends_with(".json") {
        return Ok(NodeRule::Evolved(text.into()));
    }
    all.into_iter()
        .find(|rule| rule.name() == text)
        .ok_or_else(|| format!("wanted {known} or a file of --evolve (.json)"))
}

fn parse_faults(text: &str) -> Result<NodeFaults, String> {
    // Names alone: a value may be negative or have an exponent.
    let with_name = |setting: &str| match setting.split_once('=') {
        Some((name, value)) => format!("{}={value}", name.replace('-', "_")),
        None => setting.to_owned(),
    };
    let settings = text.split(',').map(with_name).collect::<Vec<_>>().join("\n");
    let faults: NodeFaults = toml::from_str(&settings).map_err(|error| {
        format!("{}; wanted names and values such as blind=1,lost=0.3", error.message().trim())
    })?;
    faults.check().map_err(|error| error.to_string())?;
    Ok(faults)
}
