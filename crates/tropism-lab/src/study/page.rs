//! The report of a study.

use std::path::Path;

use tropism::evolve::Champion;
use tropism::math::statistics::mean;
use tropism::task::{MISS_CM, Reading, Task};
use tropism::track::Track;
use tropism_report::{self as report, Figure, Goals, Page, Plants, Table};

use super::STAGES;
use super::config::PHOTOGRAPHED;
use super::results::{StudyFolder, StudyResults};
use crate::evolve::EvolutionHistory;
use crate::figures::{Figures, distances, fitness_table, with_distances};
use crate::finished_run::FinishedRun;
use crate::transfer::{ControllerResults, OverPlants};
use crate::{Error, champion, files};

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
            tables: vec![
                self.controller_table(results),
                self.many_table(),
                fitness_table(&self.reality["champion"]),
            ],
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
             possible. For unseen beans {:.2} cm were predicted, and {:.2} cm were measured.{}",
            self.open_loop.len(),
            f64::from(self.config.switch_steps) * period_min / 60.0,
            results.reality_champion.plants,
            results.champion_mean_in_model,
            results.best_possible,
            results.champion_expected_in_reality,
            results.reality_champion.mean,
            self.arrival(results)
        )
    }

    /// What the intro says about arrival at the targets, where there are any.
    fn arrival(&self, results: &StudyResults) -> String {
        let shares =
            [&results.many_champion, &results.many_greedy, &results.many_rule].map(|many| many.within_1_cm);
        let [Some(champion), Some(greedy), Some(rule)] = shares else { return String::new() };
        format!(
            "\n\nBeyond the paper: a rule that was tuned to arrive at the targets, on a model of the whole stem from the same tracks, \
             passes all of them within {MISS_CM} cm on {} of {} further unseen beans. The greedy controller does so on {}, the \
             champion on {}.",
            rule.in_words(),
            self.many.plants,
            greedy.in_words(),
            champion.in_words()
        )
    }

    /// Each controller in the model and on the unseen beans that were photographed, by both readings of eq. (9) and by what
    /// people see: how near the tip came to each target.
    fn controller_table(&self, results: &StudyResults) -> Table {
        const HEAD: [&str; 6] =
            ["Controller", "In the model", "To the letter", "By approach", "Distances (cm)", "Visited all"];
        let readings = [Reading::Letter, Reading::Approach].map(|reading| self.config.task.by(reading));
        let in_model =
            |model: Option<f64>| model.map_or_else(|| "-".to_owned(), |model| format!("{model:.2}"));
        let unseen = |title: &str, model: f64| {
            let mut cells = vec![title.to_owned(), in_model(Some(model))];
            cells.resize(HEAD.len(), "-".to_owned());
            cells
        };
        let row = |title: &str, name: &str, model: Option<f64>| {
            let runs = &self.reality[name];
            let tracks: Vec<&Track> = runs.iter().map(|run| &run.track).collect();
            let mean_by = |task: &Task| mean(tracks.iter().map(|track| task.fitness(track)));
            let visited = tracks.iter().filter(|track| self.config.task.is_done(track) == Some(true)).count();
            let [letter, approach] = readings.each_ref().map(|task| format!("{:.2}", mean_by(task)));
            let visited = format!("{visited} of {}", runs.len());
            vec![
                title.to_owned(),
                in_model(model),
                letter,
                approach,
                distances(&self.config.task, &tracks),
                visited,
            ]
        };
        let [champion, greedy, rule] = PHOTOGRAPHED;
        Table {
            title: "Controllers in the model and on unseen beans".to_owned(),
            caption: format!(
                "Mean fitness in cm: over {} simulated plants, scored as in evolution, and over the same {} photographed beans \
                 for each of three controllers, by both readings of eq. (9). Distances are medians of the tip from each target at its \
                 height; all are visited within {MISS_CM} cm. The greedy controller lights the lamp on the side of the next \
                 target. The rule is beyond the paper: it was tuned to arrive at the targets, on a model of the whole stem from \
                 the same tracks.",
                self.config.trial_plants, results.reality_champion.plants
            ),
            head: HEAD.map(str::to_owned).to_vec(),
            rows: vec![
                row("evolved champion", champion, Some(results.champion_mean_in_model)),
                unseen("best random network", results.random_mean_in_model),
                unseen("periodic", results.periodic_mean_in_model),
                row("greedy (by hand)", greedy, Some(results.greedy_mean_in_model)),
                row("tuned rule", rule, None),
            ],
        }
    }

    /// The same controllers on many more beans.
    fn many_table(&self) -> Table {
        let row = |one: &ControllerResults| {
            let distances: Vec<String> = one
                .targets
                .iter()
                .map(|target| target.median_cm.map_or_else(|| "-".to_owned(), |cm| format!("{cm:.1}")))
                .collect();
            let [letter, approach] = match &one.both_readings {
                Some(both) => both.each_ref().map(OverPlants::in_words),
                None => ["-", "-"].map(str::to_owned),
            };
            let visited = one.done.map_or_else(String::new, |done| done.in_words());
            vec![one.name.clone(), letter, approach, distances.join(", "), visited]
        };
        let head = ["Controller", "To the letter (cm)", "By approach (cm)", "Distances (cm)", "Visited all"];
        Table {
            title: "Controllers on many unseen beans".to_owned(),
            caption: format!(
                "{} virtual beans without photographs: means of eq. (9) by both readings, with 95 % intervals. Distances and \
                 visits are those of the table above.",
                self.many.plants
            ),
            head: head.map(str::to_owned).to_vec(),
            rows: self.many.controllers.iter().map(row).collect(),
        }
    }

    fn figures(&self) -> Result<Figures, Error> {
        let mut all = Figures::default();
        let typical = self.typical_run();
        all.add_setup(typical.or(self.open_loop.first()));
        all.add_open_loop_runs(&self.open_loop)?;
        let runs = &self.evolution.runs;
        let mut order: Vec<usize> = (0..runs.len()).collect();
        order.sort_by(|&a, &b| runs[b].trial.mean.total_cmp(&runs[a].trial.mean));
        let median = order[order.len() / 2];
        let task = &self.config.task;
        let steered = self.steered(&self.champions[median])?;
        let success = match task.is_done(&steered) {
            Some(true) => "successful: it visits all targets",
            _ => "not successful: it does not visit all targets",
        };
        let why = format!(
            "whose champion has the median of all means in the model, {:.2}, and is {success} ({} cm from them)",
            runs[median].trial.mean,
            distances(task, &[&steered])
        );
        let (EvolutionHistory { best, mean }, unit) = (&self.history, task.kind.unit());
        let of_median = [&best[median], &mean[median]].map(Vec::as_slice);
        all.drawn.push(report::fitness_boxes(best, unit, Plants::ModelOfVirtual));
        all.drawn.push(report::fitness_run(median, &why, of_median, unit, Plants::ModelOfVirtual));
        let (best, worst) = (order[0], order[order.len() - 1]);
        let second = order.get(1).copied().unwrap_or(best);
        for (number, title, champion) in [
            ("7a", "In simulation: the champion with the highest mean", &self.champions[best]),
            ("7b", "In simulation: the second", &self.champions[second]),
            ("7c", "In simulation: the champion with the lowest mean", &self.champions[worst]),
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
    fn steered(&self, champion: &Champion) -> Result<Track, Error> {
        let (task, seed) = (&self.config.task, self.config.seed);
        champion::simulate(champion, &self.model, task, seed).map_err(Error::at("champion"))
    }

    /// Figure 7: its picture.
    fn simulated(&self, number: &'static str, title: &str, champion: &Champion) -> Result<Figure, Error> {
        let task = &self.config.task;
        let track = self.steered(champion)?;
        let fitness = (task.fitness(&track), task.best_fitness_of(&track));
        let title = with_distances(title, task, &track);
        Ok(report::steering(number, &title, &track, &Goals::of(task), fitness, Plants::ModelOfVirtual))
    }

    /// The champion's run whose fitness is nearest to the mean: as in the paper, Figure 8 shows one experiment.
    fn typical_run(&self) -> Option<&FinishedRun> {
        let mean = self.in_reality("champion").mean;
        let distance = |run: &FinishedRun| (self.config.task.fitness(&run.track) - mean).abs();
        self.reality["champion"].iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}
