//! `tropism transfer`: controllers compared on the same unseen virtual plants.

use std::ops::Range;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::Work;
use tropism_lab::transfer::{OverPlants, TEST_PLANTS, TransferPlan, TransferResults, read_controllers};
use tropism_lab::units::plural;

use crate::controller::{ControllerName, conditions_of, note_other_task};
use crate::options::{BeanOption, SeedOption, TaskOption, checked_variation};
use crate::progress::{check_outputs, for_user};
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Compare controllers on the same many unseen virtual plants
///
/// Each controller steers every plant. Results are fitness with intervals, distance at each target, differences between
/// controllers on the same plants, and likely causes of missed targets: as text, transfer.json, plants.csv and
/// report.html. Ctrl-C saves; --resume continues with the same results as without an interruption.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism transfer --controllers greedy periodic:6h --out transfer\n  \
    tropism transfer --controllers evolution greedy --model model.json --optimum --out transfer\n  \
    tropism transfer --out transfer --resume")]
pub(crate) struct Transfer {
    /// periodic[:6h], greedy, files of champions or rules, or folders of champions
    #[arg(long, required_unless_present = "resume", num_args = 1.., value_name = "CONTROLLER")]
    controllers: Vec<ControllerName>,

    /// Number of virtual plants; none of them is a plant of another command, whatever the seed
    #[arg(long, default_value_t = TEST_PLANTS, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    plants: u32,

    /// Seeds of the plants, from A to the one before B, instead of --plants
    #[arg(long, value_name = "A..B", value_parser = parse_seeds, conflicts_with = "plants")]
    plant_seeds: Option<Range<u64>>,

    /// Individual variation of the plants: 0 for the average, 1 as between real plants, up to 2
    #[arg(long, default_value_t = 1.0, value_name = "X")]
    variation: f64,

    /// Give each plant a random sequence of targets of its own, in reach of a typical plant, instead of those of the task
    #[arg(long)]
    random_targets: bool,

    /// Measure the tip in photographs of the virtual camera, instead of placing it with the detector's noise
    #[arg(long)]
    photographs: bool,

    /// Search a clairvoyant schedule of lamps for each plant, all its noise known: the optimum is at least that good
    #[arg(long)]
    optimum: bool,

    /// Controller that stands for what a rule without knowledge of the future can reach; others are shown as shares of it
    #[arg(long, value_name = "NAME")]
    reference: Option<String>,

    /// Model on which the controllers were made, to mark misses where it has no data
    #[arg(long, value_name = "model.json")]
    model: Option<PathBuf>,

    /// Folder to write to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Continue the comparison in DIR; without --controllers with its own settings
    #[arg(long)]
    resume: bool,

    #[command(flatten)]
    bean: BeanOption,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,

    #[command(flatten)]
    units: UnitsOption,
}

impl Transfer {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        if self.controllers.is_empty() {
            shell.check_resumes_alone(&self.out, &["--optimum", "--reference", "--model"])?;
            let found = TransferPlan::of_folder(&self.out).map_err(for_user)?;
            let plan = TransferPlan {
                optimum: self.optimum || found.optimum,
                reference: self.reference.or(found.reference),
                model: self.model.or(found.model),
                ..found
            };
            return self.units.execute(&plan, shell, |results| text(&plan, results));
        }
        let variation = checked_variation(self.variation)?;
        let sources: Vec<_> = self.controllers.iter().map(ControllerName::source).collect();
        let controllers = read_controllers(&sources)?;
        let conditions = conditions_of(controllers.iter().map(|one| &one.controller), &self.task)?;
        if self.task.task.is_some() {
            controllers.iter().for_each(|one| note_other_task(&one.controller, &conditions.task, shell));
        }
        let mut plan = TransferPlan {
            controllers,
            plants: self.plants,
            plant_seeds: self.plant_seeds,
            task: conditions.task,
            random_targets: self.random_targets,
            period_min: conditions.period_min,
            photographs: self.photographs,
            model: self.model,
            optimum: self.optimum,
            reference: self.reference,
            seed: self.seed.seed,
            resume: self.resume,
            out: self.out,
            ..TransferPlan::default()
        };
        plan.greenhouse.variation = variation;
        plan.greenhouse.layout = conditions.layout;
        if let Some(bean) = self.bean.load()? {
            plan.greenhouse.bean = bean;
        }
        plan.greenhouse = plan.greenhouse.for_task(&plan.task);
        let files = self.controllers.iter().map(ControllerName::file);
        check_outputs(&plan.outputs(), files.chain([self.task.task.as_ref(), self.bean.bean.as_ref()]))?;
        self.units.execute(&plan, shell, |results| text(&plan, results))
    }
}

/// `A..B`, two whole numbers.
fn parse_seeds(text: &str) -> Result<Range<u64>, String> {
    let wanted = || format!("found {text:?}, wanted two whole numbers such as 1000..1090");
    let (start, end) = text.split_once("..").ok_or_else(wanted)?;
    let number = |part: &str| part.trim().parse().ok().filter(|&seed: &u64| i64::try_from(seed).is_ok());
    Ok(number(start).ok_or_else(wanted)?..number(end).ok_or_else(wanted)?)
}

/// How near each controller comes to the targets, and by how much nearer than the first one.
fn arrival_text(results: &TransferResults, longest: usize) -> String {
    let mut text = format!(
        "{:<longest$}  sum of distances  over the first, 95 %       all 1 cm  0.5 cm  median at each\n",
        "arrival"
    );
    for (one, arrival) in results.controllers.iter().filter_map(|one| Some((one, one.arrival.as_ref()?))) {
        let over = arrival.over_first.as_ref().map_or_else(
            || "-".to_owned(),
            |over| format!("{:+.2} ({:+.2} to {:+.2})", over.mean, over.interval[0], over.interval[1]),
        );
        let medians: Vec<String> = (one.targets.iter())
            .map(|target| target.median_cm.map_or_else(|| "-".to_owned(), |median| format!("{median:.2}")))
            .collect();
        let [one_cm, half_cm] =
            [&arrival.within_1_cm, &arrival.within_half_cm].map(|share| 100.0 * share.share);
        text += &format!(
            "{:<longest$}  {:>13.2} cm  {over:<24}  {one_cm:>6.0} %  {half_cm:>4.0} %  {} cm\n",
            one.name,
            arrival.sum.mean,
            medians.join(", "),
        );
    }
    text
}

fn text(plan: &TransferPlan, results: &TransferResults) -> String {
    let longest = results.controllers.iter().map(|one| one.name.len()).max().unwrap_or(0).max(10);
    let has_low_shares = plan.has_low_shares();
    let has_way = plan.task.pole.is_none();
    let unit = plan.task.kind.unit();
    let best = results.best_possible.map(|best| format!(" of at most {best:.2}"));
    let shares = if has_low_shares { "  under 9  under 6" } else { "" };
    let near = if has_way { "  at targets" } else { "" };
    let mut text = format!(
        "{}, fitness in {unit}{}\n{:<longest$}   mean   95 % interval     sd{shares}  kept{near}\n",
        plural(results.plants, "virtual plant"),
        best.unwrap_or_default(),
        "controller"
    );
    for one in &results.controllers {
        let [low, high] = one.interval;
        let kept =
            one.share_of_expected.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let near = one.median_cm.map_or_else(|| "  -".to_owned(), |median| format!("  {median:.2} cm"));
        let near = if has_way { near } else { String::new() };
        let shares = [one.under_9, one.under_6].map(|share| format!("  {:>5.0} %", 100.0 * share));
        let shares = if has_low_shares { shares.concat() } else { String::new() };
        text += &format!(
            "{:<longest$}  {:>5.2}  {low:>5.2} to {high:>5.2}  {:>5.2}{shares}  {kept:>4}{near}\n",
            one.name, one.mean, one.sd,
        );
    }
    for (one, readings) in
        results.controllers.iter().filter_map(|one| Some((one, one.both_readings.as_ref()?)))
    {
        let [letter, approach] = readings.each_ref().map(OverPlants::in_words);
        text += &format!("{:<longest$}  eq. (9) to the letter {letter}, by approach {approach}\n", one.name);
    }
    for (one, done) in results.controllers.iter().filter_map(|one| Some((one, one.done?))) {
        let [low, high] = done.interval.map(|share| 100.0 * share);
        text += &format!(
            "{:<longest$}  does the whole task on {:.0} % of the plants ({low:.0} to {high:.0} %)\n",
            one.name,
            100.0 * done.share
        );
    }
    if results.controllers.iter().any(|one| one.arrival.is_some()) {
        text += &arrival_text(results, longest);
    }
    for (one, seen) in results.controllers.iter().filter_map(|one| Some((one, one.by_photographs.as_ref()?)))
    {
        text += &format!(
            "{:<longest$}  turns are those of the true stem; the photographs alone say {:.2}\n",
            one.name, seen.mean
        );
    }
    if let Some(optimum) = results.mean_optimum {
        let done = results.optimum_done.map_or_else(String::new, |done| {
            let [low, high] = done.interval.map(|share| 100.0 * share);
            format!("; the whole task on {:.0} % of the plants ({low:.0} to {high:.0} %)", 100.0 * done.share)
        });
        text += &format!("best schedules found with all noise known: {optimum:.2} on average{done}\n");
    }
    text += if !has_way {
        "mean: turns of the stem round the pole\n"
    } else if plan.task.line.is_empty() {
        "at targets: median distance between tip and target when the tip first reached its height\n"
    } else {
        "at targets: median over the plants of the mean distance between stem and line at the end\n"
    };
    text + &format!("wrote {0}; report: {0}/report.html", plan.out.display())
}
