//! `tropism run`: the loop of photograph, decision and lamp, into a run folder.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde::{Deserialize, Serialize};
use tropism::environment;
use tropism::greenhouse::tent::{Greenhouse, TentHandle};
use tropism::observation::Quality;
use tropism::rig::Moment;
use tropism::rig::{Event, EventKind, HealthProblem, OnGap, RunMonitor};
use tropism::task::{Targets, Task};
use tropism::track::{Sample, Track};
use tropism::vision::{Calibration, Eye, VisionConfig};
use tropism_lab::{FolderError, Gap, Journal, RecordError, Recorded, RunFolder, Supervision, files};
use tropism_report::Plants;
use tropism_rig::alert::Kind;
use tropism_rig::clock::{SystemTimes, Time};
use tropism_rig::computer::Computer;
use tropism_rig::file::RigFile;

use crate::announce::Announcer;
use crate::controller::{ControllerName, LoadedController};
use crate::options::{SeedOption, TaskOption, TentOptions};
use crate::shell::{Interrupted, Progress, Shell};

/// Run an experiment: a photograph every five minutes, a decision, a lamp
///
/// In the virtual tent (`--rig greenhouse`) five minutes pass in milliseconds, and the plant is virtual. A run that was
/// broken off, by Ctrl-C, a kill or a power cut, goes on with the same command and ends as it would have ended. One that
/// paused, because it met something that its user must decide (exit code 3), goes on with --resume.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism run --rig greenhouse --controller periodic:6h --out tent/1 --seed 1\n  \
    tropism run --rig greenhouse --controller evolution/champion.json --out steered\n  \
    tropism run --rig greenhouse --bean beans/sunflower.toml --controller periodic:6h --out sunflower\n  \
    tropism run --rig rigs/command.toml --controller evolution/champion.json --out bean --resume")]
pub(crate) struct Run {
    /// `greenhouse`, the virtual tent, or a rig file
    #[arg(long, value_name = "greenhouse|RIG.toml")]
    rig: PathBuf,

    /// periodic[:6h], chase, or the file of an evolved network
    #[arg(long, value_name = "CONTROLLER")]
    controller: ControllerName,

    /// Run folder to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    #[command(flatten)]
    task: TaskOption,

    /// Steps at most; 1000 (83.3 hours) by default for a periodic controller
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    steps: Option<u32>,

    /// In the virtual tent, as fast as it can, or so many times as fast as real plants; the result is the same
    #[arg(long, value_name = "max|N", default_value = "max", value_parser = parse_speed)]
    speed: Speed,

    /// Go on with the run in DIR even if it paused or nobody looked after it for long
    #[arg(long)]
    resume: bool,

    #[command(flatten)]
    seed: SeedOption,

    #[command(flatten, next_help_heading = "The virtual tent (--rig greenhouse)")]
    tent: TentOptions,
}

/// How many times as fast as real plants virtual ones grow; as fast as the machine can if it says nothing.
#[derive(Clone, Copy)]
struct Speed(Option<f64>);

fn parse_speed(text: &str) -> Result<Speed, String> {
    match text.parse() {
        _ if text == "max" => Ok(Speed(None)),
        Ok(times) if (0.001..=1e9).contains(&times) => Ok(Speed(Some(times))),
        _ => Err("wanted max, or a number from 0.001 to 1000000000, such as 60".to_owned()),
    }
}

/// Holds the steps of a virtual tent back, so that people can watch it.
struct Pace {
    per_step: Duration,
    /// Steps that were taken before: they are not held back again.
    past: u32,
    started: Option<Instant>,
}

impl Pace {
    /// Returns when the step is due, or when the user asks for an end.
    fn wait_for(&mut self, step: u32) {
        let Some(due) = step.checked_sub(self.past) else { return };
        let started = *self.started.get_or_insert_with(Instant::now);
        while let Some(left) = (self.per_step * due).checked_sub(started.elapsed())
            && !Shell::is_interrupted()
        {
            std::thread::sleep(left.min(Duration::from_millis(50)));
        }
    }
}

/// All that decides a run's outcome: the text of `run.toml`.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct RunPlan {
    schema: String,
    version: String,
    /// Whether the plant is virtual.
    pub(crate) is_virtual: bool,
    pub(crate) seed: u64,
    /// Words for people.
    pub(crate) controller: String,
    /// The whole network, so that the run can be resumed and understood without other files.
    #[serde(skip_serializing_if = "Option::is_none")]
    network: Option<String>,
    pub(crate) task: Targets,
    rig: RigFile,
}

impl RunPlan {
    /// A run of `controller` in `rig`.
    pub(crate) fn new(rig: RigFile, controller: &LoadedController, task: Targets, seed: u64) -> Self {
        Self {
            schema: "tropism.run/1".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: rig.is_virtual(),
            seed,
            controller: controller.name(),
            network: match controller {
                LoadedController::Network(genome) => Some(genome.to_json()),
                _ => None,
            },
            task,
            rig,
        }
    }

    /// An eye for the run's photographs.
    pub(crate) fn eye(&self) -> Option<Eye> {
        let vision = &self.rig.vision;
        let crop = vision.crop.or_else(|| self.rig.greenhouse.as_ref().map(Greenhouse::crop));
        Eye::new(self.rig.calibration()?, VisionConfig { crop, ..vision.clone() }).ok()
    }

    /// The plan of a run folder.
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        Ok(files::read_toml(&folder.join("run.toml"))?)
    }

    /// The network that steers, as JSON, if one does.
    pub(crate) fn network(&self) -> Option<&str> {
        self.network.as_deref()
    }

    /// What kind of plant it has.
    pub(crate) const fn plants(&self) -> Plants {
        if self.is_virtual { Plants::Virtual } else { Plants::Real }
    }

    /// How its photographs map to centimetres.
    pub(crate) fn calibration(&self) -> Option<Calibration> {
        self.rig.calibration()
    }

    /// Its folder at `out`, where it may go on if there is a run that is not over, or with `is_resumed` whatever it is.
    pub(crate) fn folder(&self, out: &Path, is_resumed: bool) -> Result<RunFolder> {
        Ok(RunFolder::open(out, &toml::to_string(self)?, self.rig.durability(), is_resumed)?)
    }

    /// Runs it in `folder`, or goes on there if it has begun, after a pause only with `is_resumed`. `watchers` hear of what happens. `watch` sees every sample, recorded ones included, and may break off; then the
    /// track so far is complete in the folder's journal and `None` is returned.
    pub(crate) fn execute(
        &self,
        controller: &LoadedController,
        folder: RunFolder,
        is_resumed: bool,
        mut watchers: Vec<Box<dyn RunMonitor>>,
        watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Result<Option<Track>> {
        let out = &*folder.path().to_owned();
        watchers.push(Box::new(Ears));
        let mut since_start = Duration::ZERO;
        if !self.rig.is_virtual() {
            watchers.push(Box::new(Host { computer: Computer::here(), hot_c: self.rig.patience().hot_c }));
            since_start = self.since_start(&folder, is_resumed, &mut watchers)?;
        }
        let open = self.rig.open(self.seed, since_start)?;
        let care = Supervision {
            patience: self.rig.patience(),
            lamps_in_view: self.rig.lamps_in_view.clone(),
            watcher: Box::new(watchers),
        };
        let mut recorded = Recorded::new(open.rig, folder, care)?;
        let mut is_over = true;
        let mut beside = Ok(());
        let mut watch = |sample: &Sample| {
            if let Some(device) = open.truth.as_ref().filter(|_| beside.is_ok()) {
                beside = keep_side(device, &out.join("side"));
            }
            let flow = watch(sample);
            is_over &= flow.is_continue() || sample.light.is_none();
            flow
        };
        let controller = &mut *controller.build(&self.task);
        let track = match environment::run(&mut recorded, controller, &self.task, &mut watch) {
            Err(RecordError::Stopped) => return Ok(None),
            Err(RecordError::Paused(why)) => return Err(Paused::at(out, &why)),
            other => other?,
        };
        beside?;
        if !is_over {
            recorded.tell(EventKind::Stopped, "asked to end".to_owned())?;
            return Ok(None);
        }
        if let Some(device) = &open.truth {
            files::write(&out.join("truth.csv"), &device.truth_csv())?;
            files::write(&out.join("truth.jsonl"), &device.truth_json())?;
        }
        if let Some(calibration) = self.rig.calibration() {
            let text = toml::to_string(&calibration)?;
            files::write(&out.join("calibration.toml"), text.as_bytes())?;
            if out.join("side").exists() {
                files::write(&out.join("side/calibration.toml"), text.as_bytes())?;
            }
        }
        recorded.folder().write_track(&track)?;
        if recorded.folder().journal().state()?.is_none_or(|state| state.kind != EventKind::Finished) {
            recorded.tell(EventKind::Finished, format!("{} steps", track.samples.len() - 1))?;
        }
        Ok(Some(track))
    }

    /// How long ago the experiment of a real rig began. An error if a run that goes on must ask first.
    fn since_start(
        &self,
        folder: &RunFolder,
        is_resumed: bool,
        watchers: &mut Vec<Box<dyn RunMonitor>>,
    ) -> Result<Duration> {
        let (patience, journal, times) = (self.rig.patience(), folder.journal(), SystemTimes);
        let state = journal.state()?;
        if let Some(Event { kind: EventKind::Paused, text, .. }) = state.as_ref().filter(|_| !is_resumed) {
            return Err(Paused::at(folder.path(), text));
        }
        let gap = Gap::of(journal, &times.boot_id(), times.boot_s(), times.unix_s(), times.is_wall_set())?;
        let goes_on = is_resumed || patience.on_gap == OnGap::Resume;
        let why = match gap {
            // One that has no step yet has lost none.
            _ if journal.count()? == 0 => {
                let (free, wanted) = (folder.free_bytes(), u64::from(patience.free_mb) << 20);
                if let Some(free) = free.filter(|&free| free < wanted) {
                    bail!(
                        "{}: found {} MB of disk free, wanted {}: make room, or change patience.free_mb",
                        folder.path().display(),
                        free >> 20,
                        patience.free_mb
                    );
                }
                return Ok(Duration::ZERO);
            }
            Gap::New => return Ok(Duration::ZERO),
            Gap::Known { away, since_start } if goes_on || away.as_secs_f64() <= 60.0 * patience.gap_min => {
                return Ok(since_start);
            }
            Gap::Unknown { last } if goes_on => {
                // As if no time had passed: the next step is due now.
                let period_s = 60.0 * self.rig.period_min;
                return Ok(Duration::from_secs_f64(
                    period_s * ((last.as_secs_f64() / period_s).floor() + 1.0),
                ));
            }
            Gap::Known { away, .. } => format!(
                "nobody looked after the plant for {:.0} minutes, more than patience.gap_min = {}",
                away.as_secs_f64() / 60.0,
                patience.gap_min
            ),
            Gap::Unknown { .. } => {
                "the computer was started again, and its clock was not known to be right then \
                                    or is not now: nobody knows for how long"
                    .to_owned()
            }
        };
        let at = journal.latest_moment()?.map(|last| Moment { unix_s: times.unix_s(), ..last });
        let step = journal.rows()?.last().map_or(0, |row| row.step);
        let event = Event { step, kind: EventKind::Paused, text: why.clone(), at };
        journal.happened(&event)?;
        watchers.event(&event);
        Err(Paused::at(folder.path(), &why))
    }
}

/// A run has met something that its user must decide.
#[derive(Debug, thiserror::Error)]
#[error("paused: {0}")]
pub(crate) struct Paused(String);

impl Paused {
    fn at(folder: &Path, why: &str) -> anyhow::Error {
        Self(format!("{}: {why}; the same command with --resume goes on", folder.display())).into()
    }
}

/// Hears Ctrl-C and SIGTERM.
struct Ears;

impl RunMonitor for Ears {
    fn event(&mut self, _event: &Event) {}

    fn heartbeat(&mut self) -> ControlFlow<()> {
        if Shell::is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Looks after the computer.
struct Host {
    computer: Computer,
    hot_c: f64,
}

impl RunMonitor for Host {
    fn event(&mut self, _event: &Event) {}

    fn health(&mut self) -> Vec<HealthProblem> {
        self.computer.health(self.hot_c)
    }
}

/// Passes on what happens to a run.
struct Told(Rc<Announcer>);

impl RunMonitor for Told {
    fn event(&mut self, event: &Event) {
        self.0.happened(event.kind.into(), Some(event.step), &event.text);
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        self.0.heartbeat();
        ControlFlow::Continue(())
    }
}

/// Shows what happens to a run in a real tent.
struct Notes(Rc<Progress>);

impl RunMonitor for Notes {
    fn event(&mut self, event: &Event) {
        self.0.note(&format!("step {}: {}: {}", event.step, event.kind, event.text));
    }
}

/// Keeps this step's photograph from the side, where there is one and it is not there already.
fn keep_side(device: &TentHandle, folder: &Path) -> Result<()> {
    let Some((step, bytes)) = device.side_photograph() else { return Ok(()) };
    let path = folder.join(format!("{step:06}.jpg"));
    if path.exists() {
        return Ok(());
    }
    files::make_folder(folder)?;
    Ok(files::write(&path, &bytes)?)
}

#[derive(Serialize)]
struct Outcome {
    run: PathBuf,
    is_virtual: bool,
    steps: usize,
    held: usize,
    fitness: Option<f64>,
    track: PathBuf,
}

impl Run {
    /// What holds the steps of `rig` back, if anything does.
    fn pace(&self, rig: &RigFile) -> Result<Option<Pace>> {
        let Speed(Some(times)) = self.speed else { return Ok(None) };
        ensure!(
            rig.is_virtual(),
            "--speed {times}: found a real tent, wanted --rig greenhouse: plants take their time"
        );
        let journal = self.out.join("journal.sqlite");
        let past = match journal.exists() {
            true => Journal::open_to_read(&journal)
                .and_then(|journal| journal.count())
                .with_context(|| journal.display().to_string())?,
            false => 0,
        };
        let per_step = Duration::from_secs_f64(rig.period_min * 60.0 / times);
        Ok(Some(Pace { per_step, past, started: None }))
    }

    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let controller = self.controller.load()?;
        let tent = self.tent.load()?;
        let rig = if self.rig == Path::new("greenhouse") {
            RigFile::greenhouse(tent.unwrap_or_default(), VisionConfig::default())
        } else {
            ensure!(
                tent.is_none(),
                "found options of the virtual tent beside {}, wanted them in its [greenhouse]",
                self.rig.display()
            );
            let rig: RigFile = files::read_toml(&self.rig)?;
            rig.check().with_context(|| self.rig.display().to_string())?;
            rig
        };
        let mut pace = self.pace(&rig)?;
        let task = controller.task(&self.task, self.steps)?;
        let is_open_loop = task.targets.is_empty();
        let plan = RunPlan::new(rig, &controller, task, self.seed.seed);
        if plan.is_virtual {
            shell.note("a virtual plant in a virtual tent");
        }
        let folder = plan.folder(&self.out, self.resume);
        // Nothing has happened to a run that another program has, or that is not the one that was asked for.
        if let Err(error) = folder.as_ref()
            && error.downcast_ref().is_some_and(FolderError::is_refusal)
        {
            return folder.map(drop);
        }
        let progress = Rc::new(shell.progress("run", u64::from(plan.task.max_steps)));
        let announcer = Rc::new(Announcer::open(&plan.rig, &self.out)?);
        let mut watchers: Vec<Box<dyn RunMonitor>> = vec![Box::new(Told(Rc::clone(&announcer)))];
        if !plan.is_virtual {
            watchers.push(Box::new(Notes(Rc::clone(&progress))));
        }
        let mut watch = |sample: &Sample| {
            if let Some(pace) = &mut pace {
                pace.wait_for(sample.step);
            }
            progress.add(1);
            let place = format!("tip at {:.1}, {:.1} cm", sample.tip.x, sample.tip.y);
            announcer.step(sample.step, &place);
            progress.say(place);
            if Shell::is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let done =
            folder.and_then(|folder| plan.execute(&controller, folder, self.resume, watchers, &mut watch));
        drop(progress);
        // Of a pause people have heard as it came.
        if let Err(error) = done.as_ref()
            && !error.is::<Paused>()
        {
            announcer.happened(Kind::Fault, None, &format!("{error:#}"));
        }
        if let Some(announcer) = Rc::into_inner(announcer) {
            announcer.close(shell);
        }
        let Some(track) = done? else {
            return Err(Interrupted::resumable(&self.out));
        };
        let file = self.out.join("track.csv");
        let held = track.samples.iter().filter(|sample| sample.quality == Quality::Held).count();
        let outcome = Outcome {
            run: self.out.clone(),
            is_virtual: plan.is_virtual,
            steps: track.samples.len() - 1,
            held,
            fitness: (!is_open_loop).then(|| plan.task.fitness(&track)),
            track: file.clone(),
        };
        let last = track.samples[track.samples.len() - 1].tip;
        let kind = if plan.is_virtual { "virtual plant" } else { "plant" };
        let mut text = format!(
            "{} steps of a {kind}, {held} photographs without it; tip at {:.1}, {:.1} cm\n",
            outcome.steps, last.x, last.y
        );
        if let Some(fitness) = outcome.fitness {
            text += &format!("fitness {fitness:.2} cm of at most {:.2}\n", plan.task.best());
        }
        text += &format!("wrote {}\nnext: ", file.display());
        text += &if is_open_loop {
            format!("tropism fit {} --out model.json", file.display())
        } else {
            format!("tropism report {} --out report.html", self.out.display())
        };
        shell.result(&text, &outcome)
    }
}
