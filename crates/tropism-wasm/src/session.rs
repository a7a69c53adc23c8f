//! Answers to the page's questions, and what is remembered between them.

use std::ops::ControlFlow;

use serde_json::{Value, json};
use tropism::control::{Controller, Greedy, ShapeError};
use tropism::evolve::{
    Champion, ChampionError, Choice, EvolutionConfig, EvolutionError, Trial as TrialOf, TunedRule,
    TunedRuleError,
};
use tropism::lamps::Layout;
#[cfg(feature = "photographs")]
use tropism::nodes::{NodeWall, StateMachineSettings, WallPath};
use tropism::plant::ModelError;
use tropism::plant::tip::TipModelConfig;
use tropism::simulation::{AnyModel, ModelKind};
use tropism::task::Task;
use tropism::track::{Track, TrackError};
#[cfg(feature = "photographs")]
use tropism_bean::wall::WallTrial;
use tropism_bean::{Species, Trial};
use tropism_page::{
    self as page, Drawing, MOST_STEPS, Method, PageError, ShownGeneration, curves, model_of, rule_file,
    schedule_of,
};
use tropism_report::Plants;

use crate::beans::OpenLoop;
use crate::evolution::{Job, simulate};
use crate::question::{Answer, By, Question};
use crate::{beans, paper};
#[cfg(feature = "photographs")]
use crate::{measure, photographs, photographs::Series, tent::Tent};

/// Simulated plants that a champion steers on the page.
const PLANTS: u32 = 6;

/// What the page remembers: the beans that have grown, their model, and an evolution.
#[derive(Default)]
pub struct Session {
    tracks: Option<(OpenLoop, Vec<Track>)>,
    model: Option<AnyModel>,
    job: Option<Job>,
    #[cfg(feature = "photographs")]
    series: Option<Series>,
    #[cfg(feature = "photographs")]
    tent: Option<Tent>,
}

/// Why a question has no answer: a sentence for people.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// No question that is known.
    #[error("found no question: {0}")]
    Question(#[from] serde_json::Error),
    /// Something that cannot be done.
    #[error("{0}")]
    Refused(String),
    /// A drawing.
    #[error(transparent)]
    Page(#[from] PageError),
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] tropism::check::OutOfRange),
    /// Tracks of which no model can be made.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A track.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// An evolution that cannot be done.
    #[error(transparent)]
    Evolution(#[from] EvolutionError),
    /// NEAT's parameters.
    #[error(transparent)]
    Neat(#[from] tropism_neat::NeatError),
    /// A champion's file.
    #[error(transparent)]
    Champion(#[from] ChampionError),
    /// A network that does not fit its sensors and lamps.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A picture.
    #[cfg(feature = "photographs")]
    #[error(transparent)]
    Photo(#[from] tropism::photo::PhotoError),
    /// Vision.
    #[cfg(feature = "photographs")]
    #[error(transparent)]
    Vision(#[from] tropism::vision::VisionError),
    /// A track without enough stems.
    #[cfg(feature = "photographs")]
    #[error(transparent)]
    Record(#[from] tropism::measure::RecordError),
    /// A wall of nodes.
    #[cfg(feature = "photographs")]
    #[error(transparent)]
    Wall(#[from] tropism::nodes::WallError),
    /// A tent.
    #[cfg(feature = "photographs")]
    #[error(transparent)]
    Rig(#[from] tropism::rig::RigError),
    /// A rule's file.
    #[error(transparent)]
    Rule(#[from] TunedRuleError),
}

impl Session {
    /// Answers what was written: never fails, for what is wrong is the answer.
    pub fn answer_bytes(&mut self, written: &[u8]) -> Vec<u8> {
        let answer = Question::split(written).and_then(|(question, bytes)| self.answer(question, bytes));
        Answer::from(answer).to_bytes()
    }

    /// Answers a question with the bytes after it.
    ///
    /// # Errors
    /// [`SessionError`] says what cannot be done.
    #[cfg_attr(
        not(feature = "photographs"),
        expect(unused_variables, reason = "bytes are photographs and tracks")
    )]
    pub fn answer(&mut self, question: Question, bytes: &[u8]) -> Result<Answer, SessionError> {
        let json = match question {
            Question::Settings {} => json!({
                "beans": OpenLoop::default(),
                "model": TipModelConfig::default(),
                "evolution": EvolutionConfig::default(),
                "task": Task::default(),
            }),
            Question::Style {} => json!(tropism_report::style()),
            Question::Reach {} => serde_json::to_value(Species::common_reach())?,
            Question::Task { drawing } => task_of(&drawing)?,
            Question::Commands { name, drawing, evolution, seed, method } => {
                commands(&name, &drawing, evolution.as_deref(), seed, method).into()
            }
            Question::Try { drawing, by, seed, from } => {
                let task = drawing.task()?;
                let steps = match &by {
                    By::Lights(letters) => letters.len() as u32,
                    By::Greedy | By::File(_) => MOST_STEPS,
                };
                json!(page::try_out(&task, by.controller(&task)?.as_mut(), seed, steps, from))
            }
            Question::Fit { kind, model, beans } => self.fit(kind, &model, beans)?,
            Question::Model { file } => {
                self.model = Some(AnyModel::from_json(&file)?);
                json!({})
            }
            Question::Begin { task, evolution, seed, own } => {
                self.job = Some(Job::begin(self.model()?, *task, *evolution, seed, &own)?);
                json!({})
            }
            Question::Advance { generations } => {
                self.job.as_mut().ok_or_else(no_evolution)?.advance(generations)?
            }
            Question::Best {} => self.job()?.best()?,
            Question::Finish {} => self.job()?.finish()?,
            Question::Choose { trials } if trials.is_empty() => {
                return Err(SessionError::Refused("there are no trials".to_owned()));
            }
            Question::Choose { trials } => json!({ "run": Choice::of(trials).run }),
            Question::Curves { runs } => {
                let runs: Vec<&[ShownGeneration]> = runs.iter().map(Vec::as_slice).collect();
                json!(curves(&runs))
            }
            Question::Champion { champion, seed } => self.champion(&champion, seed)?,
            Question::Unseen { drawing, by, seeds } => unseen(&drawing, &by, &seeds)?,
            Question::Tracks { beans } => paper::tracks(self.tracks(beans)?),
            Question::Steered { champion, task, seed } => {
                let champion = read_champion(&champion)?;
                paper::steered(&champion, self.model()?, &task, seed)?
            }
            Question::Fitness { best, mean } => paper::fitness(&best, &mean),
            #[cfg(feature = "photographs")]
            Question::Order { names } => photographs::order(&names),
            #[cfg(feature = "photographs")]
            Question::Size {} => photographs::size(bytes)?,
            #[cfg(feature = "photographs")]
            Question::Track { px_per_cm, base, region, period_min, first } => {
                let mut rest = bytes;
                let mut parts = Vec::new();
                for length in first {
                    let short = || SessionError::Refused("found too few bytes of photographs".to_owned());
                    let (one, more) = rest.split_at_checked(length).ok_or_else(short)?;
                    parts.push(one);
                    rest = more;
                }
                self.series = Some(Series::begin(px_per_cm, base, region, period_min, &parts)?);
                json!({})
            }
            #[cfg(feature = "photographs")]
            Question::Next { name } => self.series.as_mut().ok_or_else(no_series)?.next(&name, bytes),
            #[cfg(feature = "photographs")]
            Question::Csv {} => {
                let bytes = self.series.as_ref().ok_or_else(no_series)?.csv()?;
                return Ok(Answer { json: json!({}), bytes });
            }
            #[cfg(feature = "photographs")]
            Question::Measure { name, tilt_deg } if bytes.is_empty() => {
                let track = self.series.as_ref().ok_or_else(no_series)?.track()?;
                measure::plant(&name, &track, tilt_deg)?
            }
            #[cfg(feature = "photographs")]
            Question::Measure { name, tilt_deg } => {
                measure::plant(&name, &Track::read_csv(bytes)?, tilt_deg)?
            }
            #[cfg(feature = "photographs")]
            Question::Means { values } => measure::means(&values),
            #[cfg(feature = "photographs")]
            Question::Tent { seed, drawing, by } => {
                let task = drawing.task()?;
                let controller = by.map(|by| by.controller(&task)).transpose()?;
                self.tent = Some(Tent::open(seed, task, controller)?);
                json!({})
            }
            #[cfg(feature = "photographs")]
            Question::Step { light } => {
                let none = || SessionError::Refused("open a tent first".to_owned());
                let (json, bytes) = self.tent.as_mut().ok_or_else(none)?.step(light)?;
                return Ok(Answer { json, bytes });
            }
            #[cfg(feature = "photographs")]
            Question::Nodes {} => json!(tropism_page::shown(&NodeWall::three_levels())),
            #[cfg(feature = "photographs")]
            Question::Wall { path, rule, seed } => {
                let wall = NodeWall { path: WallPath::Drawn(path), ..NodeWall::three_levels() };
                wall.check()?;
                let trial = WallTrial { wall, ..WallTrial::new(Species::default()) };
                json!(tropism_page::grow_before_wall(&trial, StateMachineSettings::default(), rule, seed))
            }
        };
        Ok(json.into())
    }

    fn tracks(&mut self, beans: OpenLoop) -> Result<&[Track], SessionError> {
        if self.tracks.as_ref().is_none_or(|(known, _)| *known != beans) {
            self.tracks = Some((beans, beans.tracks()?));
        }
        Ok(self.tracks.as_ref().map_or(&[], |(_, tracks)| tracks))
    }

    fn model(&self) -> Result<&AnyModel, SessionError> {
        let none = || SessionError::Refused("fit a model first".to_owned());
        self.model.as_ref().ok_or_else(none)
    }

    fn job(&self) -> Result<&Job, SessionError> {
        self.job.as_ref().ok_or_else(no_evolution)
    }

    fn fit(
        &mut self,
        kind: ModelKind,
        config: &TipModelConfig,
        beans: OpenLoop,
    ) -> Result<Value, SessionError> {
        self.model = Some(beans::fit(self.tracks(beans)?, kind, config)?);
        let model = self.model()?;
        Ok(
            json!({ "kind": kind, "steps": model.steps(), "is_virtual": model.is_virtual(), "file": model.to_json() }),
        )
    }

    fn champion(&self, file: &str, seed: u64) -> Result<Value, SessionError> {
        let champion = read_champion(file)?;
        let task = champion.task.clone().unwrap_or_default();
        let model = self.model()?;
        let track = |episode| simulate(&champion, model, &task, seed, episode);
        let tracks = (0..PLANTS).map(track).collect::<Result<Vec<_>, _>>()?;
        Ok(json!(page::champion(&champion.genome, &task, &tracks, Plants::ModelOfVirtual)))
    }
}

fn no_evolution() -> SessionError {
    SessionError::Refused("begin an evolution first".to_owned())
}

#[cfg(feature = "photographs")]
fn no_series() -> SessionError {
    SessionError::Refused("there are no photographs".to_owned())
}

fn read_champion(file: &str) -> Result<Champion, SessionError> {
    let champion = Champion::from_json(file)?;
    champion.check()?;
    Ok(champion)
}

impl By {
    /// The controller for `task`, at rest.
    fn controller(&self, task: &Task) -> Result<Box<dyn Controller>, SessionError> {
        Ok(match self {
            Self::Greedy => Box::new(Greedy::new(task, &Layout::default())),
            Self::Lights(letters) => Box::new(schedule_of(letters)?),
            Self::File(text) if TunedRule::is_named_in(text) => {
                let tuned = TunedRule::from_json(text)?;
                tuned.check()?;
                Box::new(tuned.controller(task))
            }
            Self::File(text) => Box::new(read_champion(text)?.controller(task)?),
        })
    }
}

fn task_of(drawing: &Drawing) -> Result<Value, SessionError> {
    let (model, _) = model_of(drawing, Method::Evolve);
    let [_, stem] = page::MODELS;
    Ok(json!({
        "task": drawing.to_toml()?,
        "data": drawing.task()?,
        "best": drawing.best()?,
        "kind": if model == stem { ModelKind::STEM } else { ModelKind::TIP },
    }))
}

/// The commands that do in a terminal what the page does: with settings those of this evolution, else what may be done next.
fn commands(
    name: &str,
    drawing: &Drawing,
    evolution: Option<&EvolutionConfig>,
    seed: u64,
    method: Method,
) -> Vec<String> {
    let Some(EvolutionConfig { runs, generations, .. }) = evolution else {
        return page::commands(name, drawing);
    };
    let (model, [grow, fit]) = model_of(drawing, method);
    let last = match method {
        Method::Evolve => format!("evolve --model {model} --task {name}.toml --out {name} --runs {runs}"),
        Method::Tune => format!("tune --model {model} --task {name}.toml --out {}", rule_file(name)),
    };
    let last = format!("{last} --generations {generations} --seed {seed}");
    [grow, fit, last].map(|words| format!("tropism {words}")).into()
}

/// Fitness of a controller and of the greedy rule on the beans of `seeds`, in cm.
fn unseen(drawing: &Drawing, by: &By, seeds: &[u64]) -> Result<Value, SessionError> {
    let task = drawing.task()?;
    let species = Species::default();
    let trial = Trial { solids: task.solids(), ..Trial::new(&species) };
    let scores = |by: &By| -> Result<Vec<f64>, SessionError> {
        let controllers = seeds.iter().map(|_| by.controller(&task)).collect::<Result<Vec<_>, _>>()?;
        let mut controllers = controllers.into_iter().map(Some).collect::<Vec<_>>();
        let take = |place: usize| controllers[place].take().unwrap_or_else(|| unreachable!("one a bean"));
        let tracks = trial.grow_all(seeds, take, &task, &mut |_, _| ControlFlow::Continue(()));
        Ok(tracks.iter().map(|track| task.fitness(track)).collect())
    };
    let (own, greedy) = (scores(by)?, scores(&By::Greedy)?);
    let mean = |scores: &[f64]| json!({ "scores": scores, "trial": TrialOf::of(scores) });
    Ok(json!({ "own": mean(&own), "greedy": mean(&greedy) }))
}
