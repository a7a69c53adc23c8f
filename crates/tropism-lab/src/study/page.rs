//! The report of a study.

use std::path::Path;

use tropism::evolve::Champion;
use tropism_report::{self as report, Figure, Goals, Page, Plants, Table};

use super::results::{RealityNumbers, StudyFolder, StudyResults};
use crate::figures::{Figures, fitness_table};
use crate::finished_run::FinishedRun;
use crate::{Error, champion, files};

/// The stages of a study, in order, by their keys in `seconds.json`.
const STAGES: [&str; 7] =
    ["open-loop experiments", "model", "evolution", "random controllers", "reality", "many plants", "report"];

/// The report of the finished study in `folder`.
pub(crate) fn page(folder: &Path) -> Result<Page, Error> {
    let folder = StudyFolder::read(folder)?;
    folder.page(&folder.results()?)
}

impl StudyFolder {
    /// The report of the study, with its `results`.
    pub(super) fn page(&self, results: &StudyResults) -> Result<Page, Error> {
        let stages = STAGES.iter().filter_map(|&name| Some((name.to_owned(), *self.seconds.get(name)?)));
        let plant_seeds = |name: &'static str, runs: &[FinishedRun]| {
            let seeds: Vec<u64> = runs.iter().map(|run| run.config.seed).collect();
            (1..).zip(seeds).map(move |(number, seed)| (format!("{name} bean {number}"), seed))
        };
        let figures = self.figures()?;
        Ok(Page {
            title: "Steering beans with light".to_owned(),
            intro: self.intro(results),
            plants: Plants::Virtual,
            numbers: results.rows(),
            tables: vec![self.controller_table(results), fitness_table(&self.reality["champion"])],
            figures: figures.drawn,
            left_out: figures.left_out,
            command: format!("tropism study {}/study.toml", self.path.display()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: std::iter::once(("study".to_owned(), self.config.seed))
                .chain(plant_seeds("open-loop", &self.open_loop))
                .chain(plant_seeds("unseen", &self.reality["champion"]))
                .collect(),
            stages: stages.collect(),
            config: files::toml_of(&self.path.join("study.toml"), &self.config)?,
        })
    }

    fn intro(&self, results: &StudyResults) -> String {
        let period_min = self.config.rig().period_min;
        format!(
            "{} virtual beans were photographed every {period_min} minutes while the lamp to their left and the lamp to their \
             right were switched every {:.1} hours. Vision measured their tips in the photographs. The tracks gave a model \
             of the motion of a tip, and NEAT evolved neural networks on this model that decide which lamp is lit. The \
             champion was chosen before it steered a bean: it has the highest mean fitness over models of single plants, \
             which is also the prediction for unseen plants. It then steered {} unseen beans, of which neither the model \
             nor the evolution had data, by their photographs.\n\nIn the model its mean fitness is {:.2} cm of {:.2} \
             possible. For unseen beans {:.2} cm were predicted, and {:.2} cm were measured.",
            self.open_loop.len(),
            f64::from(self.config.switch_steps) * period_min / 60.0,
            results.reality_champion.plants,
            results.champion_mean_in_model,
            results.best_possible,
            results.champion_expected_in_reality,
            results.reality_champion.mean
        )
    }

    fn controller_table(&self, results: &StudyResults) -> Table {
        let row = |name: &str, model: f64, reality: RealityNumbers| {
            let RealityNumbers { mean, sd, worst, best, .. } = reality;
            vec![
                name.to_owned(),
                format!("{model:.2}"),
                format!("{mean:.2}"),
                format!("{sd:.2}"),
                format!("{worst:.2} to {best:.2}"),
            ]
        };
        let head = ["Controller", "Mean in the model", "Mean on unseen beans", "sd", "Range"];
        Table {
            title: "Controllers in the model and on unseen beans".to_owned(),
            caption: format!(
                "Fitness after eq. (9), in cm: over {} simulated plants, and over the same {} virtual beans for each \
                 controller. Chase lights the lamp on the side of the next target.",
                self.config.trial_plants, results.reality_champion.plants
            ),
            head: head.map(str::to_owned).to_vec(),
            rows: vec![
                row("evolved champion", results.champion_mean_in_model, results.reality_champion),
                row("best random network", results.random_mean_in_model, results.reality_random),
                row("periodic", results.periodic_mean_in_model, results.reality_periodic),
                row("chase (by hand)", results.chase_mean_in_model, results.reality_chase),
            ],
        }
    }

    fn figures(&self) -> Result<Figures, Error> {
        let mut all = Figures::default();
        let typical = self.typical_run();
        all.add_setup(typical.or(self.open_loop.first()));
        all.add_open_loop_runs(&self.open_loop)?;
        all.add_evolution(&self.history, self.config.task.kind.unit(), Plants::ModelOfVirtual);
        let runs = &self.evolution.runs;
        let mut order: Vec<usize> = (0..runs.len()).collect();
        order.sort_by(|&a, &b| runs[b].trial.mean.total_cmp(&runs[a].trial.mean));
        let (chosen, worst) = (self.evolution.champion, order[order.len() - 1]);
        let second = order.iter().copied().find(|&run| run != chosen).unwrap_or(chosen);
        for (number, title, champion) in [
            ("7a", "In simulation: the chosen champion", &self.champions[chosen]),
            ("7b", "In simulation: the champion of another run", &self.champions[second]),
            ("7c", "In simulation: the worst champion", &self.champions[worst]),
            ("7d", "In simulation: the best random network", &self.random_champion),
        ] {
            all.drawn.push(self.simulated(number, title, champion)?);
        }
        if let Some(run) = typical {
            let plants = self.reality["champion"].len();
            all.add_steered_run(
                run,
                &format!(", whose fitness is nearest to the mean of {plants} unseen ones"),
            );
        }
        all.add_stems(&self.open_loop)?;
        Ok(all)
    }

    /// The track of a simulated plant that `champion` steers.
    fn simulated(&self, number: &'static str, title: &str, champion: &Champion) -> Result<Figure, Error> {
        let task = &self.config.task;
        let track =
            champion::simulate(champion, &self.model, task, self.config.seed).map_err(Error::at(title))?;
        let fitness = (task.fitness(&track), task.best_fitness());
        Ok(report::steering(number, title, &track, &Goals::of(task), fitness, Plants::ModelOfVirtual))
    }

    /// The champion's run whose fitness is nearest to the mean: as in the paper, Figure 8 shows one experiment.
    fn typical_run(&self) -> Option<&FinishedRun> {
        let mean = self.in_reality("champion").mean;
        let distance = |run: &FinishedRun| (self.config.task.fitness(&run.track) - mean).abs();
        self.reality["champion"].iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}
