//! What a study found: its numbers beside the paper's, and its report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};
use tropism::control::network::NetworkController;
use tropism::evolve::{self, Trial};
use tropism::plant::tip::TipModel;
use tropism::random::{Draws, Purpose};
use tropism::simulation::simulate;
use tropism::track::PERIOD_MIN;
use tropism_lab::{ControllerSpec, FinishedRun, files};
use tropism_neat::Genome;
use tropism_report::{self as report, Figure, NumberRow, Page, Plants, Table};

use super::super::evolve::Outcome as Evolved;
use super::super::report::scores;
use super::{IN_REALITY, StudyPlan};
use crate::findings::{self, History};
use crate::options::load_model;

/// What a study found: the numbers beside the paper's.
#[derive(Serialize)]
pub(super) struct Numbers {
    seed: u64,
    is_virtual: bool,
    best_possible: f64,
    best_evolved: f64,
    champion_mean_in_model: f64,
    champion_expected_in_reality: f64,
    saturation_generation: Option<usize>,
    best_random: f64,
    median_random: f64,
    random_mean_in_model: f64,
    periodic_mean_in_model: f64,
    chase_mean_in_model: f64,
    reality_champion: Reality,
    reality_random: Reality,
    reality_periodic: Reality,
    reality_chase: Reality,
    share_kept: f64,
    hours_to_end: f64,
    pub(super) report: PathBuf,
}

/// How a controller did on plants that nobody met.
#[derive(Clone, Copy, Serialize)]
struct Reality {
    mean: f64,
    sd: f64,
    best: f64,
    worst: f64,
    plants: usize,
}

/// What the random controllers did: `random.json`.
#[derive(Serialize, Deserialize)]
pub(super) struct RandomFound {
    pub(super) count: u64,
    pub(super) best: f64,
    pub(super) median: f64,
}

pub(super) fn read_seconds(out: &Path) -> BTreeMap<String, f64> {
    // Times are for people to read; a study without them is whole.
    files::read_as(&out.join("seconds.json"), |text| serde_json::from_str(text)).unwrap_or_default()
}

/// The report of the study in `folder`.
pub(crate) fn page(folder: &Path) -> Result<Page> {
    Found::read(folder)?.page()
}

/// All that lies in the folder of a study.
pub(super) struct Found {
    out: PathBuf,
    plan: StudyPlan,
    model: TipModel,
    open_loop: Vec<FinishedRun>,
    history: History,
    evolved: Evolved,
    champions: Vec<Genome>,
    random: RandomFound,
    random_champion: Genome,
    reality: BTreeMap<&'static str, Vec<FinishedRun>>,
}

impl Found {
    pub(super) fn read(out: &Path) -> Result<Self> {
        let evolution = out.join("evolution");
        let evolved: Evolved =
            files::read_as(&evolution.join("summary.json"), |text| serde_json::from_str::<Evolved>(text))?;
        let champion = |index| {
            let file = evolution.join("champions").join(format!("run-{index:02}.json"));
            files::read_as(&file, Genome::from_json)
        };
        let mut reality = BTreeMap::new();
        for name in IN_REALITY {
            let runs = FinishedRun::read_numbered(&out.join("reality").join(name))?;
            ensure!(!runs.is_empty(), "{}: found no reality/{name}, wanted a finished study", out.display());
            reality.insert(name, runs);
        }
        Ok(Self {
            out: out.to_owned(),
            plan: files::read_toml(&out.join("study.toml"))?,
            model: load_model(&out.join("model.json"))?,
            open_loop: FinishedRun::read_numbered(&out.join("open-loop"))?,
            history: History::read(&evolution.join("history.csv"))?,
            champions: (0..evolved.runs.len()).map(champion).collect::<Result<_, _>>()?,
            evolved,
            random: files::read_as(&out.join("random.json"), |text| serde_json::from_str(text))?,
            random_champion: files::read_as(&out.join("random-champion.json"), Genome::from_json)?,
            reality,
        })
    }

    fn trial(&self, controller: &ControllerSpec) -> Trial {
        let task = &self.plan.task;
        let build = || controller.build(task, PERIOD_MIN);
        evolve::trial(std::slice::from_ref(&self.model), task, build, self.plan.seed, self.plan.trial_plants)
    }

    pub(super) fn numbers(&self, report: PathBuf) -> Numbers {
        let best_evolved =
            self.evolved.runs.iter().map(|run| run.best_fitness).fold(f64::NEG_INFINITY, f64::max);
        let champion = &self.evolved.runs[self.evolved.champion];
        let reality = IN_REALITY.map(|name| self.in_reality(name));
        Numbers {
            seed: self.plan.seed,
            is_virtual: true,
            best_possible: self.plan.task.best(),
            best_evolved,
            champion_mean_in_model: champion.trial.mean,
            champion_expected_in_reality: champion.transfer.mean,
            saturation_generation: self.history.saturation(0.98),
            best_random: self.random.best,
            median_random: self.random.median,
            random_mean_in_model: self
                .trial(&ControllerSpec::Network { genome: Box::new(self.random_champion.clone()) })
                .mean,
            periodic_mean_in_model: self.trial(&self.plan.periodic()).mean,
            chase_mean_in_model: self.trial(&ControllerSpec::Greedy).mean,
            share_kept: reality[0].mean / champion.trial.mean,
            hours_to_end: self.hours_to_end(),
            reality_champion: reality[0],
            reality_random: reality[1],
            reality_periodic: reality[2],
            reality_chase: reality[3],
            report,
        }
    }

    fn in_reality(&self, name: &str) -> Reality {
        let runs = &self.reality[name];
        let scores: Vec<f64> = runs.iter().map(|run| self.plan.task.fitness(&run.track)).collect();
        let Trial { mean, sd, .. } = Trial::of(&scores);
        Reality {
            mean,
            sd,
            best: scores.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            worst: scores.iter().copied().fold(f64::INFINITY, f64::min),
            plants: scores.len(),
        }
    }

    /// Mean time of the champion's plants until the end of their experiments, in hours.
    fn hours_to_end(&self) -> f64 {
        let runs = &self.reality["champion"];
        let steps: usize = runs.iter().map(|run| run.track.samples.len() - 1).sum();
        steps as f64 / runs.len() as f64 * PERIOD_MIN / 60.0
    }

    /// The simulated track of a network, and its fitness.
    fn simulated(&self, number: &'static str, title: &str, genome: &Genome) -> Result<Figure> {
        let task = &self.plan.task;
        let draws = Draws::new(self.plan.seed, Purpose::Trial, [0; 3]);
        let track = simulate(&self.model, &mut NetworkController::new(genome)?, task, draws);
        let fitness = task.fitness(&track);
        Ok(report::steering(number, title, &track, &task.targets, fitness, Plants::ModelOfVirtual))
    }

    fn figures(&self) -> Result<Vec<Figure>> {
        let mut figures = findings::open_loop_figures(&self.open_loop)?;
        figures.extend(findings::evolution_figures(&self.history, Plants::ModelOfVirtual));
        let mut order: Vec<usize> = (0..self.champions.len()).collect();
        order.sort_by(|&a, &b| self.evolved.runs[b].trial.mean.total_cmp(&self.evolved.runs[a].trial.mean));
        let (best, worst) = (self.evolved.champion, order[order.len() - 1]);
        let second = order.iter().copied().find(|&run| run != best).unwrap_or(best);
        for (number, title, run) in [
            ("7a", "In simulation: the chosen champion", best),
            ("7b", "In simulation: the champion of another run", second),
            ("7c", "In simulation: the poorest champion", worst),
        ] {
            figures.push(self.simulated(number, title, &self.champions[run])?);
        }
        figures.push(self.simulated(
            "7d",
            "In simulation: the best random network",
            &self.random_champion,
        )?);
        // As in the paper, one experiment is shown: the one whose fitness is nearest to the mean.
        let runs = &self.reality["champion"];
        let mean = self.in_reality("champion").mean;
        let distance = |run: &FinishedRun| (self.plan.task.fitness(&run.track) - mean).abs();
        if let Some(typical) = runs.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            figures.push(findings::steered_figure(typical));
        }
        figures.extend(findings::stem_figure(&self.open_loop)?);
        Ok(figures)
    }

    pub(super) fn page(&self) -> Result<Page> {
        let numbers = self.numbers(self.out.join("report.html"));
        let seconds = read_seconds(&self.out);
        let stages =
            ["open-loop experiments", "model", "evolution", "random controllers", "reality", "report"];
        let stages = stages.iter().filter_map(|&name| Some((name.to_owned(), *seconds.get(name)?)));
        let plants = (1..)
            .zip(&self.open_loop)
            .map(|(number, run)| (format!("open-loop bean {number}"), run.config.seed));
        let fresh = (1..)
            .zip(&self.reality["champion"])
            .map(|(number, run)| (format!("fresh bean {number}"), run.config.seed));
        Ok(Page {
            title: "Steering beans with light".to_owned(),
            intro: self.intro(&numbers),
            plants: Plants::Virtual,
            numbers: numbers.rows(),
            tables: self.tables(&numbers),
            figures: self.figures()?,
            command: format!("tropism study {}/study.toml", self.out.display()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: std::iter::once(("study".to_owned(), self.plan.seed)).chain(plants).chain(fresh).collect(),
            stages: stages.collect(),
            config: toml::to_string(&self.plan)?,
        })
    }

    fn intro(&self, numbers: &Numbers) -> String {
        format!(
            "{} virtual beans were photographed every five minutes while lamps to their left and right changed every \
             {:.1} hours. The photographs gave the paths of their tips, the paths a model of how a tip moves, and \
             evolution on that model networks that decide which lamp is lit. The champion was chosen before it met a \
             bean: by its mean fitness over models that were each made of a single plant, which is also what was to be \
             expected of it. It then steered {} beans that neither the model nor evolution had met, through photographs \
             alone.\n\nIn the model it scores {:.2} cm of {:.2} possible; on the fresh beans {:.2} cm were expected and \
             {:.2} cm were reached.",
            self.open_loop.len(),
            f64::from(self.plan.switch_steps) * PERIOD_MIN / 60.0,
            numbers.reality_champion.plants,
            numbers.champion_mean_in_model,
            numbers.best_possible,
            numbers.champion_expected_in_reality,
            numbers.reality_champion.mean
        )
    }

    fn tables(&self, numbers: &Numbers) -> Vec<Table> {
        let row = |name: &str, model: f64, reality: Reality| {
            let Reality { mean, sd, worst, best, .. } = reality;
            vec![
                name.to_owned(),
                format!("{model:.2}"),
                format!("{mean:.2}"),
                format!("{sd:.2}"),
                format!("{worst:.2} to {best:.2}"),
            ]
        };
        let head = ["Controller", "Mean in the model", "Mean on fresh beans", "sd", "Range"];
        let controllers = Table {
            title: "Controllers in the model and on fresh beans".to_owned(),
            caption: format!(
                "Fitness after eq. (9), in cm: over {} simulated plants, and over the same {} virtual beans for each \
                 controller. Chase lights the lamp on the side of the next target.",
                self.plan.trial_plants, numbers.reality_champion.plants
            ),
            head: head.map(str::to_owned).to_vec(),
            rows: vec![
                row("evolved champion", numbers.champion_mean_in_model, numbers.reality_champion),
                row("best random network", numbers.random_mean_in_model, numbers.reality_random),
                row("periodic", numbers.periodic_mean_in_model, numbers.reality_periodic),
                row("chase (by hand)", numbers.chase_mean_in_model, numbers.reality_chase),
            ],
        };
        vec![controllers, scores(&self.reality["champion"])]
    }
}

impl Numbers {
    /// What stands beside what the paper prints.
    fn rows(&self) -> Vec<NumberRow> {
        let row = |what: &str, paper: &str, ours: String, note: &str| NumberRow {
            what: what.to_owned(),
            paper: paper.to_owned(),
            ours,
            note: note.to_owned(),
        };
        let reality = &self.reality_champion;
        let saturation =
            self.saturation_generation.map_or("-".to_owned(), |generation| generation.to_string());
        vec![
            row(
                "Best possible fitness (cm)",
                "15",
                format!("{:.2}", self.best_possible),
                "The way in x to all targets.",
            ),
            row(
                "Best evolved fitness (cm)",
                "14.97",
                format!("{:.2}", self.best_evolved),
                "Best single evaluation.",
            ),
            row(
                "The champion's mean in the model (cm)",
                "",
                format!("{:.2}", self.champion_mean_in_model),
                "Over fresh simulated plants.",
            ),
            row(
                "Expected in reality, said before (cm)",
                "",
                format!("{:.2}", self.champion_expected_in_reality),
                "Mean over models of single plants; the champion is chosen by it.",
            ),
            row(
                "Generation at which the median saturates",
                "1000",
                saturation,
                "Within 2 % of its last value.",
            ),
            row(
                "Best random controller (cm)",
                "8.72",
                format!("{:.2}", self.best_random),
                "Best single evaluation.",
            ),
            row(
                "Mean in reality (cm)",
                "9.96",
                format!("{:.2} (sd {:.2})", reality.mean, reality.sd),
                "Reality is six real plants there, virtual beans here.",
            ),
            row(
                "Share kept in reality",
                "67 %",
                format!("{:.0} %", 100.0 * self.share_kept),
                "Mean in reality over fitness in the model.",
            ),
            row(
                "Hours to the end of an experiment",
                "about 25",
                format!("{:.1}", self.hours_to_end),
                "Until the tip is 13.8 cm high.",
            ),
        ]
    }

    pub(super) fn text(&self) -> String {
        let mut text = format!("{:<42}  {:>8}  ours (virtual plants)\n", "", "paper");
        for row in self.rows() {
            text += &format!("{:<42}  {:>8}  {}\n", row.what, row.paper, row.ours);
        }
        let others = [
            ("random", &self.reality_random),
            ("periodic", &self.reality_periodic),
            ("chase", &self.reality_chase),
        ];
        let others: Vec<String> =
            others.iter().map(|(name, reality)| format!("{name} {:.2}", reality.mean)).collect();
        text += &format!("on the same fresh beans: {}\n", others.join(", "));
        text + &format!("\nreport: {}", self.report.display())
    }
}
