//! An evolution, live: its checkpoints, thinned to what a page can draw.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use serde::{Deserialize, Serialize};
use tropism::obstacle::Obstacle;
use tropism_lab::controller::ControllerSpec;
use tropism_lab::evolve::{EvolutionRecord, EvolutionRunSummary, EvolveResults};
use tropism_lab::{files, holder, simulate};
use tropism_page::{self as page, Curves, Drawing, ShownChampion, ShownGeneration, curves};
use tropism_report::Plants;

use crate::error::Refusal;
use crate::items::WorkState;
use crate::stream::{Listened, Message};

/// How often an evolution is looked at.
pub(crate) const PAUSE: Duration = Duration::from_millis(500);

/// Simulated plants that a champion steers on the page.
const PLANTS: u32 = 6;

/// An evolution at a time.
pub(crate) struct EvolutionView {
    version: u64,
    /// JSON.
    data: String,
}

impl Listened for EvolutionView {
    fn since(&self, id: Option<&str>) -> Vec<Message> {
        let id_now = self.version.to_string();
        if id == Some(id_now.as_str()) {
            return Vec::new();
        }
        vec![Message { id: id_now, event: "evolution", data: self.data.clone() }]
    }
}

/// What a page that watches an evolution is sent.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct EvolutionNews {
    #[serde(flatten)]
    curves: Curves,
    state: WorkState,
    /// Number of the process that works on it.
    process: Option<u32>,
    /// Generations of each run.
    generations: usize,
    /// Generations of all runs.
    total: usize,
    /// Evaluations a second.
    rate: Option<f64>,
    /// Seconds until it is over.
    left_s: Option<f64>,
    /// Once it is over.
    results: Option<ShownResults>,
    /// Seconds since 1970.
    now: f64,
}

/// The runs of an evolution that is over.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShownResults {
    /// The run whose champion is to be used on plants.
    champion: usize,
    runs: Vec<ShownRun>,
    seconds: f64,
}

/// A run of an evolution, as its champion was judged; fitness in the unit of the task.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShownRun {
    run: usize,
    /// Fitness when it was evaluated.
    best: f64,
    /// Mean fitness on unseen plants of the model.
    mean: f64,
    /// Expected fitness on an unseen plant.
    expected: Option<f64>,
    /// Standard deviation of it.
    sd: Option<f64>,
    /// Number of links.
    links: usize,
    /// Why nothing is expected.
    withheld: Option<String>,
}

/// The history of one run, as its checkpoint had it.
#[derive(Clone, Default)]
struct Known {
    stamp: Option<(u64, SystemTime)>,
    history: Vec<ShownGeneration>,
}

/// Reads an evolution again and again.
pub(crate) struct EvolutionReader {
    folder: PathBuf,
    runs: Vec<Known>,
    holder: Option<Option<u32>>,
    is_over: bool,
    /// When so many evaluations were done: their rate.
    rate: Option<(Instant, u64, f64)>,
    read: Instant,
    /// How long it took.
    cost: Duration,
}

/// What stands before the generations in a checkpoint, and nowhere else: genomes hold no text.
const HISTORY: &str = "\"history\":";

/// The history of a checkpoint, without its population and its check sum: those who go on with it check it. No more of the
/// file is parsed than that.
fn history(path: &Path) -> Option<Vec<ShownGeneration>> {
    let text = files::read_text(path).ok()?;
    let begin = text.find(HISTORY)? + HISTORY.len();
    Vec::deserialize(&mut serde_json::Deserializer::from_str(&text[begin..])).ok()
}

impl EvolutionReader {
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            runs: Vec::new(),
            holder: None,
            is_over: false,
            rate: None,
            read: Instant::now(),
            cost: Duration::ZERO,
        }
    }

    /// The evolution after `before`; `None` if nothing changed, or nothing can be read just now.
    pub(crate) fn read(&mut self, before: Option<&Arc<EvolutionView>>) -> Option<EvolutionView> {
        use rayon::prelude::*;

        let (at_work, is_over) = (holder(&self.folder).ok()?, self.folder.join("summary.json").exists());
        let is_as_before = self.holder == Some(at_work) && self.is_over == is_over;
        if is_as_before && self.read.elapsed() < crate::REST * self.cost {
            return None;
        }
        let began = Instant::now();
        let record = EvolutionRecord::read(&self.folder).ok()?;
        self.runs.resize_with(record.evolution.runs as usize, Known::default);
        let folder = &self.folder;
        let fresh = |index: usize, known: &mut Known| {
            let data = folder.join(format!("run-{index:02}.json")).metadata().ok();
            let stamp = data.and_then(|data| Some((data.len(), data.modified().ok()?)));
            if stamp.is_none() || stamp == known.stamp {
                return false;
            }
            let Some(history) = history(&folder.join(format!("run-{index:02}.json"))) else { return false };
            *known = Known { stamp, history };
            true
        };
        let is_fresh = self.runs.par_iter_mut().enumerate().map(|(index, known)| fresh(index, known));
        let is_fresh = is_fresh.reduce(|| false, |one, other| one || other);
        (self.read, self.cost) = (Instant::now(), began.elapsed());
        if !is_fresh && is_as_before && before.is_some() {
            return None;
        }
        (self.holder, self.is_over) = (Some(at_work), is_over);
        let evaluations: u64 =
            self.runs.iter().filter_map(|run| run.history.last()).map(|last| last.evaluations).sum();
        self.measure(evaluations, at_work.is_some());
        let version = before.map_or(1, |before| before.version + 1);
        let data = serde_json::to_string(&self.news(&record, at_work, is_over)).ok()?;
        Some(EvolutionView { version, data })
    }

    /// Evaluations a second since the last look at which there were fewer.
    fn measure(&mut self, evaluations: u64, is_at_work: bool) {
        let now = Instant::now();
        self.rate = match self.rate {
            _ if !is_at_work => None,
            None => Some((now, evaluations, 0.0)),
            Some((then, fewer, rate)) if evaluations > fewer => {
                let latest = (evaluations - fewer) as f64 / now.duration_since(then).as_secs_f64().max(1e-3);
                Some((now, evaluations, if rate > 0.0 { 0.6 * rate + 0.4 * latest } else { latest }))
            }
            known => known,
        };
    }

    fn news(&self, record: &EvolutionRecord, holder: Option<u32>, is_over: bool) -> EvolutionNews {
        let histories: Vec<&[ShownGeneration]> = self.runs.iter().map(|run| run.history.as_slice()).collect();
        let generations = record.evolution.generations as usize;
        let total = generations * self.runs.len();
        let done: usize = self.runs.iter().map(|run| run.history.len()).sum();
        let population =
            record.evolution.neat.population as f64 * f64::from(record.evolution.episodes.max(1));
        let rate = self.rate.map(|(.., rate)| rate).filter(|rate| *rate > 0.0 && !is_over);
        EvolutionNews {
            curves: curves(&histories),
            state: WorkState::of(holder, is_over),
            process: holder,
            generations,
            total,
            rate: rate.map(f64::round),
            left_s: rate.map(|rate| ((total - done.min(total)) as f64 * population / rate).round()),
            results: results(&self.folder).filter(|_| is_over),
            now: crate::unix_s(),
        }
    }
}

/// The runs as their champions were judged, the one to use on plants first.
fn results(folder: &Path) -> Option<ShownResults> {
    let results: EvolveResults =
        files::read_as(&folder.join("summary.json"), |text| serde_json::from_str(text)).ok()?;
    let row = |(number, run): (usize, &EvolutionRunSummary)| ShownRun {
        run: number,
        best: run.best_fitness,
        mean: run.trial.mean,
        expected: run.expected().map(|trial| trial.mean),
        sd: run.expected().map(|trial| trial.sd),
        links: run.links,
        withheld: run.withheld.clone(),
    };
    let runs = results.runs.iter().enumerate().map(row).collect();
    Some(ShownResults { champion: results.champion, runs, seconds: results.wall_seconds })
}

/// What does not change in an evolution.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct AboutEvolution {
    name: String,
    is_virtual: bool,
    seed: u64,
    runs: u32,
    /// Generations of each run.
    generations: u32,
    population: usize,
    /// What the task is, in words.
    task: String,
    /// In cm.
    targets: Vec<[f64; 2]>,
    obstacles: Vec<Obstacle>,
    drawing: Drawing,
    /// The best fitness that there can be.
    best: Option<f64>,
    /// Unit of the fitness.
    unit: &'static str,
    /// Whether there is a model to simulate plants with.
    has_model: bool,
    commands: EvolutionCommands,
}

/// What a person types to do with an evolution what the page does.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct EvolutionCommands {
    status: String,
    stop: String,
    resume: String,
    extend: String,
    run: String,
}

/// What does not change in the evolution `name` in `folder`, which lies `at` below the folder of the studio.
pub(crate) fn about(folder: &Path, at: &str, name: String) -> Result<AboutEvolution, Refusal> {
    let record = EvolutionRecord::read(folder)?;
    let word = files::shell_word(Path::new(if at.is_empty() { "." } else { at }));
    Ok(AboutEvolution {
        name,
        is_virtual: record.is_virtual,
        seed: record.seed,
        runs: record.evolution.runs,
        generations: record.evolution.generations,
        population: record.evolution.neat.population,
        task: record.task.title(),
        targets: record.task.targets.iter().map(|&target| target.into()).collect(),
        drawing: Drawing::of(&record.task),
        best: record.task.best_fitness(),
        unit: record.task.kind.unit(),
        obstacles: record.task.obstacles,
        has_model: folder.join("model.json").exists(),
        commands: EvolutionCommands {
            status: format!("tropism status {word}"),
            stop: format!("tropism stop {word}"),
            resume: format!("tropism evolve --out {word} --resume"),
            extend: format!("tropism evolve --out {word} --resume --generations N"),
            run: format!("tropism run --rig greenhouse --controller {word}/champion.json --out steered"),
        },
    })
}

/// A champion: its file if it is chosen, or the best so far of run `index`.
pub(crate) fn controller(folder: &Path, index: Option<u32>) -> Result<ControllerSpec, Refusal> {
    let file = match index {
        None => folder.join("champion.json"),
        Some(index) => folder.join("champions").join(format!("run-{index:02}.json")),
    };
    if file.exists() {
        return Ok(ControllerSpec::read(&file)?);
    }
    let record = EvolutionRecord::read(folder)?;
    let runs = match index {
        Some(index) => index..index.saturating_add(1).min(record.evolution.runs),
        None => 0..record.evolution.runs,
    };
    let best = runs
        .filter_map(|index| record.checkpoint(folder, index))
        .filter_map(|run| run.champion().map(|(genome, fitness)| (genome.clone(), fitness)));
    let (genome, _) = best
        .max_by(|(_, one), (_, other)| one.total_cmp(other))
        .ok_or_else(|| Refusal::missing("no champion yet: the evolution has just begun"))?;
    Ok(ControllerSpec::network(record.champion_of(genome))?)
}

/// The network of a champion, its decisions, and its paths on simulated plants.
pub(crate) fn champion(folder: &Path, index: Option<u32>) -> Result<ShownChampion, Refusal> {
    let record = EvolutionRecord::read(folder)?;
    let controller = controller(folder, index)?;
    let genome = controller.champion().map(|champion| champion.genome.clone());
    let genome = genome.ok_or_else(|| Refusal::missing("found no network"))?;
    let model = folder.join("model.json");
    let tracks = if model.exists() {
        simulate::tracks(&model, &controller, &record.task, PLANTS, record.seed)?
    } else {
        Vec::new()
    };
    let plants = if record.is_virtual { Plants::ModelOfVirtual } else { Plants::ModelOfReal };
    Ok(page::champion(&genome, &record.task, &tracks, plants))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_history_of_a_checkpoint_is_read_without_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run-00.json");
        let generation =
            r#"{"generation":0,"best":1.5,"best_ever":1.5,"species":2,"links_mean":3.5,"evaluations":50}"#;
        let text = format!(r#"{{"run":{{"neat":[1,2],"history":[{generation},{generation}],"rest":[}}"#);
        std::fs::write(&path, &text).unwrap();
        let found = history(&path).unwrap();
        assert_eq!(
            (found.len(), found[1].best_ever, found[1].species, found[1].evaluations),
            (2, 1.5, 2.0, 50)
        );
        // One that is being written.
        std::fs::write(&path, &text[..text.len() - 30]).unwrap();
        assert!(history(&path).is_none());
    }
}
