//! Where a champion comes from: a genome file, an evolution, a study or a run.

use std::path::{Path, PathBuf};

use tropism::evolve::Champion;
use tropism::task::Task;
use tropism::text::plural;
use tropism::track::PAPER_PERIOD_MIN;
use tropism::track::Track;
use tropism_bean::tent::Greenhouse;
use tropism_report::Plants;

use super::ShowPlan;
use crate::controller::ControllerSpec;
use crate::evolve::EvolutionRecord;
use crate::model::Model;
use crate::run::RunConfig;
use crate::sequences;
use crate::{Error, Monitor, champion, files, model};

/// A champion, the file that it was read from, its task, and a plant that it steered.
pub(super) struct ShownChampion {
    pub(super) champion: Champion,
    pub(super) file: PathBuf,
    pub(super) task: Task,
    pub(super) steered: Option<(Track, Plants)>,
}

impl ShownChampion {
    /// The champion that `plan` names, with the plant that it steered or one that is simulated now.
    pub(super) fn find(plan: &ShowPlan, monitor: &dyn Monitor) -> Result<Self, Error> {
        if plan.source.join("run.toml").exists() {
            return Self::find_in_run(plan);
        }
        let file = genome_file(&plan.source)?;
        // `evolution.toml` lies beside `champion.json`, or above `champions/run-00.json`.
        // Beside a file that was named, settings for another evolution may have its name.
        let has_record = |folder: &&Path| {
            EvolutionRecord::is_in(folder) || plan.source.is_dir() && EvolutionRecord::path(folder).exists()
        };
        let folder = file.ancestors().skip(1).take(2).find(has_record);
        let record = folder.map(EvolutionRecord::read).transpose()?;
        let champion = match &record {
            Some(record) if !file.exists() => best_so_far(record, &file, monitor)?,
            _ => champion::read(&file)?,
        };
        let mut task = match (&plan.task, &champion.task, &record) {
            (Some(task), ..) | (None, Some(task), _) => task.clone(),
            (None, None, Some(record)) => record.task.clone(),
            (None, None, None) => Task::default(),
        };
        let seed = record.as_ref().map_or(1, |record| record.seed);
        match &plan.model {
            Some(path) => sequences::draw_for(&mut task, path, seed)?,
            None => sequences::draw(&mut task, &Greenhouse::default(), PAPER_PERIOD_MIN, seed)?,
        }
        let model = match &plan.model {
            Some(path) => Some(model::read_for(path, &task, monitor)?),
            None => own_model(folder, record.as_ref())?,
        };
        let steered = match model.map(|model| simulate(&champion, &model, &task, seed)) {
            Some(Ok(plant)) => Some(plant),
            // A network with other inputs is drawn without a plant, unless the plan asks for one.
            Some(Err(error)) if plan.model.is_some() => return Err(Error::at(file.display())(error)),
            _ => None,
        };
        Ok(Self { champion, file, task, steered })
    }

    /// The network that steered a run, with the track of the run if it is finished.
    fn find_in_run(plan: &ShowPlan) -> Result<Self, Error> {
        let (file, run) = (plan.source.join("run.toml"), RunConfig::read(&plan.source)?);
        if plan.model.is_some() {
            return Err(Error::Plan(
                "`model`: the plant of this run is drawn, which needs no model".to_owned(),
            ));
        }
        let Some(champion) = run.controller.champion() else {
            return Err(Error::Plan(format!(
                "{}: found the controller \"{}\", wanted a network",
                file.display(),
                run.controller_description()
            )));
        };
        let track = plan.source.join("track.csv");
        let steered = match track.exists() {
            true => Some((files::read_track(&track)?, run.plants())),
            false => None,
        };
        let task = plan.task.clone().unwrap_or_else(|| run.task.clone());
        Ok(Self { champion: champion.clone(), file, task, steered })
    }
}

/// The genome file that `source` is, or that lies in it; the latter need not exist while an evolution is at work.
fn genome_file(source: &Path) -> Result<PathBuf, Error> {
    if !source.is_dir() {
        return Ok(source.to_owned());
    }
    let files = ["champion.json", "evolution/champion.json"].map(|name| source.join(name));
    let is_there = |file: &PathBuf| file.exists() || file.with_file_name("evolution.toml").exists();
    files.into_iter().find(is_there).ok_or_else(|| {
        Error::Plan(format!(
            "{}: found no champion.json, evolution/champion.json or run.toml, wanted the folder of a finished evolution or \
             study, or of a run",
            source.display()
        ))
    })
}

/// The best champion so far of an evolution that has not written its `file` yet.
fn best_so_far(record: &EvolutionRecord, file: &Path, monitor: &dyn Monitor) -> Result<Champion, Error> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let just_begun = || {
        Error::Plan(format!(
            "{}: this evolution has just begun: wait for its first checkpoint",
            folder.display()
        ))
    };
    let (number, run) = record.best_so_far(folder).ok_or_else(just_begun)?;
    let (champion, fitness) = run.champion().ok_or_else(just_begun)?;
    monitor.note(&format!(
        "{}: an evolution that is not over; the best so far: run {number}, {fitness:.2} {} after {}",
        folder.display(),
        record.task.kind.unit(),
        plural(run.search.generation(), "generation")
    ));
    Ok(record.champion_of(champion.clone()))
}

/// The model of the study around an evolution, if it is the one that the network evolved on.
fn own_model(folder: Option<&Path>, record: Option<&EvolutionRecord>) -> Result<Option<Model>, Error> {
    let (Some(study), Some(record)) = (folder.and_then(Path::parent), record) else { return Ok(None) };
    let path = study.join("model.json");
    if !path.exists() {
        return Ok(None);
    }
    Ok(Some(model::read(&path)?).filter(|model| record.is_on(model)))
}

/// The track of one plant of `model` that the network steers, and its label in figures.
fn simulate(champion: &Champion, model: &Model, task: &Task, seed: u64) -> Result<(Track, Plants), Error> {
    ControllerSpec::network(champion.clone())?.check_on(model)?;
    let plants = if model.is_virtual() { Plants::ModelOfVirtual } else { Plants::ModelOfReal };
    Ok((champion::simulate(champion, model, task, seed)?, plants))
}
