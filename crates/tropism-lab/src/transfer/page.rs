//! The report of a comparison of controllers.

use tropism::text::plural;
use tropism_report::{
    self as report, ControllerScores, Figure, Goals, Page, Plants, SteeredPlant, Surroundings, Table,
};

use super::TransferPlan;
use super::causes::Cause;
use super::results::{ControllerResults, Scores, TransferResults};
use crate::{Error, files};

/// Most pairs of controllers that the page shows; with more, it shows those with the best controller. Chosen: eight
/// controllers make as many.
const MAX_PAIRS: usize = 28;

impl TransferPlan {
    /// The page of the comparison.
    pub(super) fn page(&self, scores: &Scores, results: &TransferResults) -> Result<Page, Error> {
        let mut tables = vec![self.controller_table(results)];
        let has_targets = results.controllers.iter().any(|controller| !controller.targets.is_empty());
        tables.extend(has_targets.then(|| arrival_table(results)));
        if !results.pairs.is_empty() {
            tables.push(pair_table(results, self.task.kind.unit()));
        }
        tables.extend(has_targets.then(|| cause_table(results)));
        let strips: Vec<ControllerScores> = (results.controllers.iter().enumerate())
            .map(|(number, controller)| ControllerScores {
                name: controller.name.clone(),
                fitness: scores.fitness(number),
                interval: controller.interval,
            })
            .collect();
        let mut figures = vec![
            report::score_strips(
                &strips,
                self.task.kind.unit(),
                results.best_possible.unwrap_or(0.0),
                Plants::Virtual,
            ),
            report::steering_panels(&self.examples(scores)?, Plants::Virtual),
        ];
        figures.extend(self.median_plants_in_space(scores)?);
        Ok(Page {
            title: "Transfer to unseen virtual plants".to_owned(),
            intro: self.intro(results),
            plants: Plants::Virtual,
            numbers: Vec::new(),
            tables,
            figures,
            left_out: Vec::new(),
            command: String::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: vec![("plants and bootstrap".to_owned(), self.seed)],
            stages: Vec::new(),
            config: files::read_text(&self.out.join("transfer.toml"))?,
        })
    }

    fn intro(&self, results: &TransferResults) -> String {
        let tip = if self.photographs {
            "The tip was measured in photographs of the virtual camera."
        } else {
            "The tip is where the paper's detector would place it, with its noise; there were no photographs."
        };
        let each = if results.random_targets {
            " (on average: each plant had targets of its own, which a typical plant reached under random light)"
        } else {
            ""
        };
        let most = |before: &str, after: &str| {
            results.best_possible.map_or_else(String::new, |best| format!("{before}at most {best:.2}{after}"))
        };
        let fitness = if self.has_low_shares() {
            format!(
                "Fitness is that of eq. (9){}.\n\nFitness is not arrival: swings on the way cost fitness, and a plant may score \
                 well and pass a target far away.",
                most("; ", &format!(" cm are possible without swinging back{each}"))
            )
        } else {
            let most = most(": ", "");
            format!("Fitness is that of the task, {}, in {}{most}.", self.task.title(), self.task.kind.unit())
        };
        let arrival = if self.task.targets.is_empty() {
            ""
        } else {
            " The second table has the distance of the tip from each target at its height."
        };
        format!(
            "Each of {} controllers steered the same {} virtual plants ({}, {} times the variation of the species). {tip} \
             {fitness}{arrival}",
            results.controllers.len(),
            results.plants,
            results.species,
            results.variation,
        )
    }

    fn controller_table(&self, results: &TransferResults) -> Table {
        let mut head: Vec<String> =
            ["Controller", "Mean", "95 % interval", "sd", "5, 25, 50, 75, 95 %"].map(str::to_owned).to_vec();
        let has_low_shares = self.has_low_shares();
        head.extend(["Under 9", "Under 6"].map(str::to_owned).into_iter().filter(|_| has_low_shares));
        let has_readings = results.controllers.iter().any(|controller| controller.both_readings.is_some());
        head.extend(
            ["To the letter", "95 % interval", "By approach", "95 % interval"]
                .map(str::to_owned)
                .into_iter()
                .filter(|_| has_readings),
        );
        head.extend(["Expected", "Kept"].map(str::to_owned));
        let has_done = results.controllers.iter().any(|controller| controller.done.is_some());
        head.extend(has_done.then(|| "Whole task".to_owned()));
        let has_seen = results.controllers.iter().any(|controller| controller.by_photographs.is_some());
        head.extend(has_seen.then(|| "Turns by photographs".to_owned()));
        head.extend(results.reference.as_ref().map(|reference| format!("Of {reference}")));
        head.extend(results.mean_optimum.map(|_| "Of the optimum".to_owned()));
        let row = |controller: &ControllerResults| {
            let ControllerResults { name, mean, interval, sd, quantiles, under_9, under_6, .. } = controller;
            let mut row = vec![
                name.clone(),
                format!("{mean:.2}"),
                range(*interval),
                format!("{sd:.2}"),
                quantiles.map(|value| format!("{value:.1}")).join(", "),
            ];
            row.extend(
                [*under_9, *under_6].map(|share| percent(Some(share))).into_iter().filter(|_| has_low_shares),
            );
            let readings = controller.both_readings.iter().flatten();
            row.extend(readings.flat_map(|one| [format!("{:.2}", one.mean), range(one.interval)]));
            row.extend([cm(controller.expected), percent(controller.share_of_expected)]);
            row.extend(controller.done.map(|done| done.in_words()));
            row.extend(controller.by_photographs.as_ref().map(|seen| {
                let share = percent(seen.done.map(|done| done.share));
                format!("{:.2}, whole task {share}", seen.mean)
            }));
            row.extend(results.reference.as_ref().map(|_| percent(controller.share_of_reference)));
            row.extend(results.mean_optimum.map(|_| percent(controller.share_of_optimum)));
            row
        };
        let mut caption = format!(
            "Virtual plants. Fitness in {} over {};{} the fitness that the model predicted, and the share of it that was \
             kept. Intervals by bootstrap over the plants.",
            self.task.kind.unit(),
            plural(results.plants, "plant"),
            if has_low_shares { " shares of plants under 9 and 6;" } else { "" }
        );
        if has_readings {
            caption += " To the letter, by approach: the mean by both readings of eq. (9).";
        }
        if has_done {
            caption += match self.task.pole {
                Some(_) => {
                    " Whole task: plants with all turns that the task wants, with the interval by Wilson."
                }
                None if self.task.is_about_stem() => {
                    " Whole task: plants that reached all targets and touched nothing, with the interval by Wilson."
                }
                None => {
                    " Whole task: plants whose tip came within 1 cm of each target at its height, with the interval by Wilson."
                }
            };
        }
        if has_seen {
            caption += " Turns are those of the true stem in the tent; beside them is what the photographs alone say, in which \
                        the pole hides the end of the stem for hours.";
        }
        if let Some(optimum) = results.mean_optimum {
            caption += &format!(
                " A search over schedules of each very plant, with all its noise known, reached {optimum:.2} {} on average: a \
                 lower reference of what is possible.",
                self.task.kind.unit()
            );
            if let Some(done) = results.optimum_done {
                caption += &format!(" It did the whole task on {} of the plants.", percent(Some(done.share)));
            }
        }
        Table {
            title: "Controllers".to_owned(),
            caption,
            head,
            rows: results.controllers.iter().map(row).collect(),
        }
    }

    /// The median plant of each controller in space, where its depth is known.
    fn median_plants_in_space(&self, scores: &Scores) -> Result<Vec<Figure>, Error> {
        let figure = |number: usize| {
            let fitness = scores.fitness(number);
            let order = from_best_to_worst(&fitness);
            let plant = order[order.len() / 2];
            let track = self.read_track(&self.track_path(number, plant))?;
            let (name, unit) = (&self.controllers[number].name, self.task.kind.unit());
            let title = format!("Median plant of {name}: plant {}, {:.2} {unit}", plant + 1, fitness[plant]);
            let around = Surroundings::of(&scores.tasks[plant]);
            Ok(report::in_space("space", &title, &track, &around, Plants::Virtual))
        };
        (0..self.controllers.len()).filter_map(|number| figure(number).transpose()).collect()
    }

    /// The best, the median and the worst plant of each controller.
    fn examples(&self, scores: &Scores) -> Result<Vec<(String, Vec<SteeredPlant>)>, Error> {
        let row = |number: usize| {
            let fitness = scores.fitness(number);
            let order = from_best_to_worst(&fitness);
            let chosen = [("best", 0), ("median", order.len() / 2), ("worst", order.len() - 1)];
            let steered = |(word, place): (&str, usize)| {
                let plant = order[place];
                Ok(SteeredPlant {
                    title: format!(
                        "{word}: plant {}, {:.2} {}",
                        plant + 1,
                        fitness[plant],
                        self.task.kind.unit()
                    ),
                    track: self.read_track(&self.track_path(number, plant))?,
                    goals: Goals::of(&scores.tasks[plant]),
                })
            };
            let steered = chosen.into_iter().map(steered).collect::<Result<_, Error>>()?;
            Ok((self.controllers[number].name.clone(), steered))
        };
        (0..self.controllers.len()).map(row).collect()
    }
}

/// The numbers of the plants in descending order of their fitness.
fn from_best_to_worst(fitness: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..fitness.len()).collect();
    order.sort_by(|&a, &b| fitness[b].total_cmp(&fitness[a]));
    order
}

fn arrival_table(results: &TransferResults) -> Table {
    let rows = results.controllers.iter().flat_map(|controller| {
        (1..).zip(&controller.targets).map(|(number, target)| {
            vec![
                controller.name.clone(),
                target.target.map_or_else(
                    || format!("{number}, a place of its own for each plant"),
                    |target| format!("{number} at {:.1}, {:.1}", target.x, target.y),
                ),
                cm(target.median_cm),
                cm(target.far_cm),
                target.missed.to_string(),
                target.never.to_string(),
            ]
        })
    });
    let head = ["Controller", "Target", "Median distance", "90 %", "Missed", "Never so high"];
    Table {
        title: "Arrival at the targets".to_owned(),
        caption: format!(
            "Virtual plants. Distance between tip and target when the tip first reached the target's height, in cm, of the \
             plants that did. Missed: farther than {} cm, or never so high; of {} plants.",
            tropism::task::MISS_CM,
            results.plants
        ),
        head: head.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}

fn pair_table(results: &TransferResults, unit: &str) -> Table {
    let best = results.controllers.iter().max_by(|a, b| a.mean.total_cmp(&b.mean));
    let best = best.map_or("", |controller| controller.name.as_str());
    let is_shown = |one: &str, other: &str| results.pairs.len() <= MAX_PAIRS || one == best || other == best;
    let rows = results.pairs.iter().filter(|pair| is_shown(&pair.one, &pair.other)).map(|pair| {
        vec![
            format!("{} minus {}", pair.one, pair.other),
            format!("{:.2}", pair.difference.mean),
            range(pair.difference.interval),
            percent(Some(pair.difference.share_above)),
        ]
    });
    let left_out = if results.pairs.len() > MAX_PAIRS {
        format!(" Shown are pairs with {best}; all stand in transfer.json.")
    } else {
        String::new()
    };
    let head = ["Controllers", "Mean difference", "95 % interval", "Plants on which the first is better"];
    Table {
        title: "Differences on the same plants".to_owned(),
        caption: format!(
            "Virtual plants. Fitness in {unit}, plant by plant; an interval that holds 0 leaves open which is better.{left_out}"
        ),
        head: head.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}

fn cause_table(results: &TransferResults) -> Table {
    let head = std::iter::once("Controller").chain(["Targets"]).chain(Cause::ALL.map(Cause::words));
    let rows = results.controllers.iter().flat_map(|controller| {
        [("missed", &controller.missed), ("reached", &controller.reached)].map(|(word, causes)| {
            let all: u32 = causes.values().sum();
            let count = |cause| {
                let found = causes.get(&cause).copied().unwrap_or(0);
                let share = if all > 0 { 100.0 * f64::from(found) / f64::from(all) } else { 0.0 };
                if found > 0 { format!("{found} ({share:.0} %)") } else { "0".to_owned() }
            };
            let start = [controller.name.clone(), format!("{all} {word}")];
            start.into_iter().chain(Cause::ALL.map(count)).collect()
        })
    });
    Table {
        title: "Likely causes of missed targets".to_owned(),
        caption: "Virtual plants. By the rules of docs/explanation/transfer.md, which compare the plant with its species in the \
                  hours before the target. The same findings before targets that were reached show how common they are: a finding that is \
                  as frequent there explains nothing. A tip is misread only with photographs, and a model has data only if one \
                  is named."
            .to_owned(),
        head: head.map(str::to_owned).collect(),
        rows: rows.collect(),
    }
}

fn range([low, high]: [f64; 2]) -> String {
    format!("{low:.2} to {high:.2}")
}

fn cm(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share))
}
