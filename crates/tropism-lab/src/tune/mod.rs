//! A rule for a task, tuned on a model or on virtual beans themselves.
//!
//! The search is saved after each generation in a file beside the rule, until that is written: a search that is resumed takes
//! the fitness of what it tried before from there, and ends in the same bits.

mod saved;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::control::{PredictiveGreedy, PredictiveRule};
use tropism::environment;
use tropism::evolve::{RuleGeneration, RuleSearch, RuleSearchResult, RuleTrial, Trial, TunedRule};
use tropism::math::statistics::standard_deviation;
use tropism::parallel;
use tropism::plant::PlantModel;
use tropism::random::{self, Purpose};
use tropism::task::{TargetOutlook, Task, outlook};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::Species;
use tropism_bean::tent::Greenhouse;

use self::saved::SavedSearch;
use crate::files::FileError;
use crate::model::Model;
use crate::reach::note_out_of_reach;
use crate::stopwatch::Stopwatch;
use crate::task::check_goal;
use crate::work::{PartStatus, WorkStatus};
use crate::{Error, Monitor, Workflow, files, model, sequences};

/// Plants that grow side by side in a thread: some milliseconds of work.
const PLANTS_AT_ONCE: usize = 64;

/// Tunes the nine parameters of a rule on simulated plants of a model, and writes the rule to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TunePlan {
    /// File of the model.
    pub model: PathBuf,
    /// Virtual beans to tune on instead of a model: species, variation and lamps count. What is found is the best that such a
    /// rule can be expected to reach on them, which no replicate could know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beans: Option<Greenhouse>,
    /// Time from one step of virtual beans to the next, in min. A model has its own.
    pub period_min: f64,
    /// Task of the rule.
    pub task: Task,
    /// Generations, rules a generation, and plants a rule.
    pub search: RuleSearch,
    /// Seed of all random numbers.
    pub seed: u64,
    /// File for the rule.
    pub out: PathBuf,
    /// Whether a rule that is there is replaced.
    pub replace: bool,
    /// Whether to continue a search for `out`.
    pub resume: bool,
}

impl Default for TunePlan {
    fn default() -> Self {
        Self {
            model: "model.json".into(),
            beans: None,
            period_min: PAPER_PERIOD_MIN,
            task: Task::default(),
            search: RuleSearch::default(),
            seed: 1,
            out: "rule.json".into(),
            replace: false,
            resume: false,
        }
    }
}

/// A tuned rule, and what to expect of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TuneResults {
    /// File of the rule.
    pub out: PathBuf,
    /// Whether the plants were virtual.
    pub is_virtual: bool,
    /// The numbers.
    pub rule: PredictiveRule,
    /// Its fitness on simulated plants that had no part in the search.
    pub in_model: Trial,
    /// The fitness that is expected on unseen plants: the same, unless it is withheld.
    pub expected: Option<Trial>,
    /// Why no fitness is expected on unseen plants; `None` where one is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub withheld: Option<String>,
    /// The probability that an unseen plant passes each target under the rule; empty for a rule tuned on virtual beans, and where no
    /// fitness is expected.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outlook: Vec<TargetOutlook>,
    /// Fitness of the greedy rule on the same plants.
    pub greedy: Trial,
    /// Processor time, in s.
    pub cpu_seconds: f64,
}

impl Workflow for TunePlan {
    type Results = TuneResults;

    const SCHEMA: &'static str = "tropism.tune/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        if let Some(beans) = &self.beans {
            beans.check().map_err(Error::in_plan("beans"))?;
        }
        self.search.check().map_err(Error::in_plan("search"))?;
        let inputs = if self.beans.is_some() { &[][..] } else { std::slice::from_ref(&self.model) };
        files::check_outputs(std::slice::from_ref(&self.out), inputs)?;
        // Whoever began an interrupted search was asked then.
        let goes_on = self.resume && saved::path(&self.out).exists();
        files::check_free(&self.out, self.replace || goes_on || self.out.is_dir())
    }

    fn prepare(&mut self) -> Result<(), Error> {
        match &self.beans {
            None => sequences::draw_for(&mut self.task, &self.model, self.seed),
            Some(beans) => sequences::draw(&mut self.task, beans, self.period_min, self.seed),
        }
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<TuneResults, Error> {
        let stopwatch = Stopwatch::start();
        monitor.stage("tune", self.search.generations.into());
        let Tuned { tuned, found, withheld, outlook } = match &self.beans {
            None => self.tune_on_model(monitor)?,
            Some(greenhouse) => self.tune_on_beans(greenhouse, monitor)?,
        };
        files::write(&self.out, tuned.to_json().as_bytes())?;
        files::remove(&saved::path(&self.out))?;
        if tuned.is_virtual {
            monitor.note("the rule was tuned on virtual plants, or on a model of such");
        }
        Ok(TuneResults {
            out: self.out.clone(),
            is_virtual: tuned.is_virtual,
            rule: found.rule,
            in_model: found.expected,
            expected: tuned.expected,
            withheld,
            outlook,
            greedy: found.greedy,
            cpu_seconds: stopwatch.cpu_seconds(),
        })
    }
}

/// A rule as it is written, what the search found, why no fitness is expected, and the outlook for each target.
struct Tuned {
    tuned: TunedRule,
    found: RuleSearchResult,
    withheld: Option<String>,
    outlook: Vec<TargetOutlook>,
}

/// Simulated seedlings of an outlook. Chosen: the standard error of a probability is 0.025 at most.
const OUTLOOK_PLANTS: u32 = 400;

/// The probability that an unseen plant of `model` passes each target under `rule`. The interval is that of the mean over models of
/// the single plants: how well so few plants can say it.
fn seedling_outlook(
    model: &Model,
    task: &Task,
    rule: PredictiveRule,
    seed: u64,
) -> Result<Vec<TargetOutlook>, Error> {
    if task.targets.is_empty() {
        return Ok(Vec::new());
    }
    let on = |model: &Model, plants: u32| {
        let steered = |plant: usize| {
            let mut controller = PredictiveGreedy::new(rule, task, model.layout());
            model::simulate(model, &mut controller, task, seed, plant as u32, &mut environment::unwatched)
        };
        outlook(task, &[], &parallel::map(plants as usize, steered))
    };
    let mut of_all = on(model, OUTLOOK_PLANTS);
    let alone = model.of_each_plant(usize::MAX).map_err(|error| Error::Plan(error.to_string()))?;
    if alone.len() < 2 {
        return Ok(of_all);
    }
    let each: Vec<Vec<TargetOutlook>> =
        alone.iter().map(|model| on(model, OUTLOOK_PLANTS / alone.len() as u32 + 1)).collect();
    for (number, target) in of_all.iter_mut().enumerate() {
        let probabilities: Vec<f64> = each.iter().map(|targets| targets[number].probability).collect();
        let error = standard_deviation(&probabilities) / (probabilities.len() as f64).sqrt();
        let [least, most] = [-1.96, 1.96].map(|errors| target.probability + errors * error);
        target.interval = Some([least.max(0.0), most.min(1.0)]);
    }
    Ok(of_all)
}

/// The status of the search for the rule `out`; `None` if there is neither search nor file.
///
/// # Errors
/// [`Error`] if the search cannot be read, or the file is no rule.
pub(crate) fn status(out: &Path) -> Result<Option<WorkStatus>, Error> {
    let path = saved::path(out);
    let of = |parts: Vec<PartStatus>| WorkStatus {
        work: "tune",
        folder: out.to_owned(),
        is_over: parts.is_empty(),
        is_virtual: None,
        process: None,
        is_shared: false,
        saved_ago_s: files::age_s(&path),
        parts,
    };
    if !path.exists() {
        if !out.is_file() {
            return Ok(None);
        }
        if !TunedRule::is_named_in(&files::read_text(out)?) {
            let problem = "this is no rule of `tune`: name one, or the folder of other work".to_owned();
            return Err(FileError::content(out, problem).into());
        }
        files::read_as(out, TunedRule::from_json)?;
        return Ok(Some(of(Vec::new())));
    }
    let (done, plan, best) = saved::read_progress(out)?;
    let part = PartStatus::new("search", done as u64, plan.search.generations.into(), "generations");
    Ok(Some(of(vec![PartStatus { best, best_unit: Some(plan.task.kind.unit()), ..part }])))
}

impl TunePlan {
    /// The plan that goes on with the interrupted search for the rule `out`.
    ///
    /// # Errors
    /// [`Error`] if there is none, or it cannot be read.
    pub fn of_search(out: &Path) -> Result<Self, Error> {
        let plan = saved::read_plan(out)?;
        Ok(Self { out: out.to_owned(), resume: true, ..plan })
    }

    /// Searches by `scores`, from where the search was interrupted if it is to go on.
    fn search(
        &self,
        scores: impl Fn(&[RuleTrial], f64) -> Vec<f64>,
        model_sha256: Option<String>,
        monitor: &dyn Monitor,
    ) -> Result<RuleSearchResult, Error> {
        let saved = SavedSearch::begin(self, model_sha256)?;
        let mut watch = |generation: &RuleGeneration| {
            monitor.advance(1);
            monitor.status(&format!("best {:.2}", generation.best));
            if saved.has_failed() { ControlFlow::Break(()) } else { monitor.answer() }
        };
        let scores = |trials: &[RuleTrial], beyond_cost_cm: f64| {
            saved.scores(trials.len(), || scores(trials, beyond_cost_cm), monitor)
        };
        let found = self.search.tune_by(scores, &self.task, self.seed, &mut watch);
        saved.end()?;
        // What was left out at the end of the search counted for nothing.
        let interrupted = || Error::Interrupted { folder: saved::path(&self.out) };
        found.filter(|_| monitor.may_go_on()).ok_or_else(interrupted)
    }

    /// Searches on simulated plants of the model. One that knows the plane of the front camera alone knows no depth: a rule for
    /// targets in space is then tuned to reach them as that camera sees them, and steers by it along x and z.
    fn tune_on_model(&self, monitor: &dyn Monitor) -> Result<Tuned, Error> {
        let is_in_plane = || model::read(&self.model).is_ok_and(|model| !model.kind().is_in_space());
        if let Some(task) = self.task.in_front().filter(|_| is_in_plane()) {
            monitor
                .note("the model is one of the plane: the rule is tuned for the targets without their depth");
            let plan = Self { task, ..self.clone() };
            let Tuned { tuned, found, .. } = plan.tune_on_model(monitor)?;
            let withheld = "the model knows nothing of the depth of the targets".to_owned();
            let tuned = TunedRule { task: Some(self.task.clone()), expected: None, ..tuned };
            return Ok(Tuned { tuned, found, withheld: Some(withheld), outlook: Vec::new() });
        }
        let model = model::read_for(&self.model, &self.task, monitor)?;
        note_out_of_reach(&self.task, &Species::default(), monitor);
        let json = model.to_json();
        let scores = RuleSearch::scores_on(&model, &self.task, self.seed);
        let found = self.search(scores, Some(files::sha256(json.as_bytes())), monitor)?;
        let tuned = TunedRule::of_model(found.rule, &model, &json, model.is_virtual(), None);
        let mut controller = tuned.controller(&self.task);
        let unwatched = &mut environment::unwatched;
        let track = model::simulate(&model, &mut controller, &self.task, self.seed, 0, unwatched);
        let without_data = model.share_without_data(&track.samples);
        // Two plants are enough to tell whether there is more than one.
        let withheld = model::reason_to_withhold(model.of_each_plant(2)?.len(), without_data);
        let expected = withheld.is_none().then_some(found.expected);
        let outlook = match &withheld {
            None => seedling_outlook(&model, &self.task, found.rule, self.seed)?,
            Some(_) => Vec::new(),
        };
        let tuned = TunedRule { task: Some(self.task.clone()), expected, ..tuned };
        Ok(Tuned { tuned, found, withheld, outlook })
    }

    /// Searches on virtual beans, which grow side by side in all threads.
    fn tune_on_beans(&self, greenhouse: &Greenhouse, monitor: &dyn Monitor) -> Result<Tuned, Error> {
        note_out_of_reach(&self.task, &greenhouse.bean, monitor);
        let tent = greenhouse.clone().among(&self.task.solids());
        let trial = tent.trial(self.period_min);
        let layout = &greenhouse.layout;
        let seed = |trial: &RuleTrial| {
            let plant = u64::from(trial.set) << 32 | u64::from(trial.plant);
            random::derive(self.seed, Purpose::Tuning, plant) >> 1
        };
        let grow = |trials: &[RuleTrial]| {
            // What is left out here counts for nothing: the search hears of the end, too.
            if !monitor.may_go_on() {
                return vec![0.0; trials.len()];
            }
            let seeds: Vec<u64> = trials.iter().map(seed).collect();
            let controller = |place: usize| PredictiveGreedy::new(trials[place].rule, &self.task, layout);
            let tracks = trial
                .grow_all(&seeds, controller, &self.task, &mut |_, sample| environment::unwatched(sample));
            tracks.iter().map(|track| self.task.fitness(track)).collect::<Vec<f64>>()
        };
        // Plants themselves have no end of data.
        let scores = |trials: &[RuleTrial], _: f64| {
            let parts: Vec<&[RuleTrial]> = trials.chunks(PLANTS_AT_ONCE).collect();
            parallel::map(parts.len(), |part| grow(parts[part])).concat()
        };
        let found = self.search(scores, None, monitor)?;
        let tuned = TunedRule {
            rule: found.rule,
            layout: layout.clone(),
            period_min: self.period_min,
            task: Some(self.task.clone()),
            model_sha256: None,
            is_virtual: true,
            expected: Some(found.expected),
        };
        Ok(Tuned { tuned, found, withheld: None, outlook: Vec::new() })
    }
}
