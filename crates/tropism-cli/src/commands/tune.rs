//! `tropism tune`: a rule with nine parameters for a model.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use tropism::control::Avoidance;
use tropism::evolve::RuleSearch;
use tropism_bean::tent::Greenhouse;
use tropism_lab::files::shell_word;
use tropism_lab::tune::{TunePlan, TuneResults};

use super::status::outlook_text;
use crate::options::{BeanOption, SeedOption, TaskOption, checked_variation};
use crate::progress::{check_outputs, execute_and_print, for_user};
use crate::shell::Shell;

/// Tune a rule on a model: greedy with foresight, nine parameters
///
/// The rule lights the lamp towards the next target, as greedy does, but by where the tip is expected, and with an aim that
/// may lie beyond the target or towards the one after it. An evolution strategy (CMA-ES) searches the numbers on simulated
/// plants. In a task with obstacles six more numbers keep the stem clear of them. The model of the stem, `tropism fit --kind
/// stem`, is made for this: its plants answer late, as beans do, and differ from each other. Ctrl-C saves; --resume continues
/// to the same rule, and `tropism status rule.json` shows how far the search is.
#[derive(Args)]
#[command(after_help = "Example, from six tracks to a steered plant:\n  \
    tropism grow --plants 6 --out open-loop\n  \
    tropism fit open-loop/*.csv --kind stem --out stem.json\n  \
    tropism tune --model stem.json --out rule.json\n  \
    tropism run --rig greenhouse --controller rule.json --out steered\n\
    A search that was interrupted goes on by\n  \
    tropism tune --out rule.json --resume")]
pub(crate) struct Tune {
    /// Model of the plant, from `tropism fit`
    #[arg(long, value_name = "stem.json", required_unless_present_any = ["beans", "resume"])]
    model: Option<PathBuf>,

    /// Tune on virtual beans themselves instead of a model: what a rule can reach on them at best. Takes minutes
    #[arg(long, conflicts_with = "model")]
    beans: bool,

    /// Individual variation of virtual beans: 0 for the average, 1 as between real plants (the default), up to 2
    #[arg(long, value_name = "X")]
    variation: Option<f64>,

    #[command(flatten)]
    bean: BeanOption,

    /// File to write the rule to
    #[arg(long, value_name = "rule.json")]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,

    /// Continue an interrupted search for rule.json; it needs no other option
    #[arg(long)]
    resume: bool,

    #[command(flatten)]
    task: TaskOption,

    /// Generations of the search
    #[arg(long, default_value_t = 60, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    generations: u32,

    /// Rules of a generation
    #[arg(long, default_value_t = 24, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=10_000))]
    population: u32,

    /// Simulated plants that each rule steers; its fitness is the mean
    #[arg(long, default_value_t = 96, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    episodes: u32,

    /// Searches that begin side by side and share the generations; the better half goes on after each round. Among obstacles 4
    /// are better than one
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    starts: u32,

    #[command(flatten)]
    seed: SeedOption,
}

impl Tune {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        if self.resume && self.model.is_none() && !self.beans {
            shell.check_resumes_alone(&self.out, &[])?;
            let plan = TunePlan::of_search(&self.out).map_err(for_user)?;
            return execute_and_print(&plan, shell, |results| text(&plan, results));
        }
        let Self { generations, population, episodes, starts, .. } = self;
        let bean = self.bean.load()?;
        ensure!(
            self.beans || (bean.is_none() && self.variation.is_none()),
            "--bean and --variation go with --beans: a model has plants of its own"
        );
        let variation = checked_variation(self.variation.unwrap_or(1.0))?;
        let task = self.task.load()?;
        let beans = self.beans.then(|| {
            Greenhouse { bean: bean.unwrap_or_default(), variation, ..Greenhouse::default() }.for_task(&task)
        });
        let defaults = TunePlan::default();
        let plan = TunePlan {
            task,
            model: self.model.unwrap_or(defaults.model),
            beans,
            search: RuleSearch { generations, population, episodes, starts },
            seed: self.seed.seed,
            out: self.out,
            replace: self.force,
            period_min: defaults.period_min,
            resume: self.resume,
        };
        check_outputs(std::slice::from_ref(&plan.out), [self.task.task.as_ref(), self.bean.bean.as_ref()])?;
        execute_and_print(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &TunePlan, results: &TuneResults) -> String {
    let TuneResults { in_model, greedy, .. } = results;
    let mut text = String::new();
    let avoidance = results.rule.avoidance.iter().flat_map(Avoidance::named);
    for (name, value) in results.rule.named().into_iter().chain(avoidance) {
        let _ = writeln!(text, "{name:16}{value:8.2}");
    }
    for target in &results.outlook {
        let _ = writeln!(text, "target          {}", outlook_text(target));
    }
    let withheld = results
        .withheld
        .as_ref()
        .map_or_else(String::new, |reason| format!("expected on unseen plants: withheld, for {reason}\n"));
    let _ = write!(
        text,
        "{} (sd {:.2}) on {} unseen plants{of}; greedy {:.2} (sd {:.2}); {:.1} s of processor time\n\
         {withheld}wrote {out}\nnext: tropism run --rig greenhouse --controller {word} --out steered",
        plan.task.fitness_in_words(in_model.mean),
        in_model.sd,
        in_model.plants,
        greedy.mean,
        greedy.sd,
        results.cpu_seconds,
        of = if plan.beans.is_some() { "" } else { " of the model" },
        out = results.out.display(),
        word = shell_word(&results.out),
    );
    text
}
