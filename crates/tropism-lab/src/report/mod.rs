//! Reports: one HTML page of figures and tables from runs, tracks, evolutions, studies, transfers, replicates or sweeps.
//! Several evolutions, several studies, the controllers of transfers, the methods of replicates and the settings of a sweep
//! are compared.

mod compare;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::text::plural;
use tropism::track::Track;
use tropism_report::{self as report, LeftOut, Page, Plants, Table};

use self::compare::Comparison;
use crate::comparison::SamplePair;
use crate::evolve::{EvolutionHistory, EvolutionRecord};
use crate::figures::{Figures, fitness_table, notes_table};
use crate::finished_run::FinishedRun;
use crate::fit::is_of_virtual_plant;
use crate::sweep::SweepPlan;
use crate::{Error, Monitor, Workflow, files, study};

/// Writes a report of folders and tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportPlan {
    /// Folders of runs, evolutions, studies, transfers and replicates and track files, or the folder of one study or of one
    /// sweep.
    pub sources: Vec<PathBuf>,
    /// HTML file of the report.
    pub out: PathBuf,
    /// Folder for the figures as files: SVG, PNG, PDF or JPEG, and CSV with their data.
    pub figures: Option<PathBuf>,
}

impl Default for ReportPlan {
    fn default() -> Self {
        Self { sources: vec!["tropism-study".into()], out: "report.html".into(), figures: None }
    }
}

/// A written report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportResults {
    /// HTML file of the report.
    pub report: PathBuf,
    /// Numbers of its figures, in order; as in the paper where it has such a figure.
    pub figures: Vec<String>,
    /// Figures for which there are no data.
    #[serde(default)]
    pub left_out: Vec<LeftOut>,
    /// Name in its files and title of each figure, for those who show them.
    #[serde(skip)]
    pub titles: Vec<(String, String)>,
    /// What is compared with what.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<ReportComparison>,
}

/// Things of one kind, compared pair by pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReportComparison {
    /// What is compared.
    pub title: String,
    /// Unit of the values: `cm`, `turns`, or both where tasks differ.
    pub unit: String,
    /// Each two of them; none where their tasks differ.
    pub pairs: Vec<SamplePair>,
}

impl Workflow for ReportPlan {
    type Results = ReportResults;

    const SCHEMA: &'static str = "tropism.report/1";

    fn check(&self) -> Result<(), Error> {
        if self.sources.is_empty() {
            return Err(Error::Plan("`sources` is empty: name a folder or a track".to_owned()));
        }
        // Their names are those of the figures that a report has: no photograph or track has such a name.
        let figures = self.figures.iter().flat_map(|folder| files::files_below(folder));
        let outputs: Vec<PathBuf> =
            [self.out.clone()].into_iter().chain(figures.filter(|file| is_figure(file))).collect();
        files::check_outputs_with(&outputs, || {
            self.sources.iter().flat_map(|source| inputs(source)).collect()
        })?;
        if self.out.is_file() && self.out.extension().is_none_or(|extension| extension != "html") {
            let out = self.out.display();
            return Err(Error::Plan(format!(
                "{out}: a file is here already that is no page: choose a name with .html"
            )));
        }
        Ok(())
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<ReportResults, Error> {
        let (page, comparisons) = match self.sources.as_slice() {
            [folder] if is_study(folder) => (study::page(folder)?, Vec::new()),
            sources => Sources::read(sources)?.page(sources)?,
        };
        files::write(&self.out, page.html().as_bytes())?;
        if let Some(folder) = &self.figures {
            files::make_folder(folder)?;
            for (name, bytes) in report::files(&page.figures) {
                files::write(&folder.join(name), &bytes)?;
            }
        }
        let figures = page.figures.iter().map(|figure| figure.number.to_owned()).collect();
        let titles = page.figures.iter().map(|figure| figure.title.clone());
        let titles = report::names(&page.figures).into_iter().zip(titles).collect();
        Ok(ReportResults { report: self.out.clone(), figures, titles, left_out: page.left_out, comparisons })
    }
}

/// The files that a report may read of a source: all of a folder but former reports and their figures.
fn inputs(source: &Path) -> Vec<PathBuf> {
    if !source.is_dir() {
        return vec![source.to_owned()];
    }
    let mut files = files::files_below(source);
    files.retain(|file| !is_figure(file) && file.extension().is_none_or(|extension| extension != "html"));
    files
}

fn is_study(folder: &Path) -> bool {
    folder.join("study.toml").exists()
}

/// Whether a file has the name of a figure of a report.
fn is_figure(file: &Path) -> bool {
    file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("figure-"))
}

/// The content of the sources of a report.
#[derive(Default)]
struct Sources {
    open_loop: Vec<FinishedRun>,
    steered: Vec<FinishedRun>,
    tracks: Vec<Track>,
    /// Each with the unit of its fitness.
    evolutions: Vec<(EvolutionHistory, &'static str, Plants)>,
    comparisons: Vec<Comparison>,
    is_virtual: bool,
}

impl Sources {
    fn read(paths: &[PathBuf]) -> Result<Self, Error> {
        let mut sources = Self::default();
        for path in paths {
            sources.add(path)?;
        }
        sources.compare(paths)?;
        Ok(sources)
    }

    /// Compares what there is more than one of.
    fn compare(&mut self, paths: &[PathBuf]) -> Result<(), Error> {
        let with = |file: &str| -> Vec<&Path> {
            paths.iter().map(PathBuf::as_path).filter(|path| path.join(file).exists()).collect()
        };
        let (evolutions, studies) = (with("evolution.toml"), with("study.toml"));
        if evolutions.len() > 1 {
            self.comparisons.push(Comparison::of_evolutions(&evolutions)?);
        }
        if let [study] = studies[..] {
            return Err(Error::Plan(format!(
                "{}: a study stands among other sources: name it alone, or several studies to compare",
                study.display()
            )));
        }
        if studies.len() > 1 {
            self.comparisons.extend(Comparison::of_studies(&studies)?);
        }
        let (transfers, replicates) = (with("transfer.toml"), with("replicates.toml"));
        if !transfers.is_empty() {
            self.comparisons.push(Comparison::of_transfers(&transfers)?);
        }
        self.comparisons.extend(Comparison::of_replicates(&replicates)?);
        for sweep in with("sweep.toml") {
            self.comparisons.extend(Comparison::of_sweep(sweep)?);
        }
        Ok(())
    }

    fn add(&mut self, path: &Path) -> Result<(), Error> {
        if path.is_file() {
            let track = files::read_track(path)?;
            self.is_virtual |= is_of_virtual_plant(path, &track);
            self.tracks.push(track);
        } else if path.join("run.toml").exists() {
            let run = FinishedRun::read(path)?;
            self.is_virtual |= run.config.is_virtual();
            let runs = if !run.config.task.has_goal() { &mut self.open_loop } else { &mut self.steered };
            runs.push(run);
        } else if path.join("history.csv").exists() {
            let EvolutionRecord { is_virtual, task, .. } = EvolutionRecord::read(path)?;
            self.is_virtual |= is_virtual;
            let plants = if is_virtual { Plants::ModelOfVirtual } else { Plants::ModelOfReal };
            let history = EvolutionHistory::read(&path.join("history.csv"))?;
            self.evolutions.push((history, task.kind.unit(), plants));
        } else if is_study(path)
            || path.join("transfer.toml").exists()
            || path.join("replicates.toml").exists()
        {
            // Only compared: a study alone has a page of its own. Their plants are always virtual.
            self.is_virtual = true;
        } else if path.join("sweep.toml").exists() {
            self.is_virtual |= SweepPlan::is_virtual(path)?;
        } else if !path.exists() {
            return Err(Error::Plan(format!("{}: there is no such folder or file", path.display())));
        } else if !files::list(path, "csv")?.is_empty() {
            return Err(Error::Plan(format!(
                "{0}: this is a folder of tracks: name the tracks ({0}/*.csv)",
                path.display()
            )));
        } else {
            return Err(Error::Plan(format!(
                "{}: this is not the folder of a finished run, evolution, study, sweep or comparison (run.toml, history.csv, \
                 study.toml, sweep.toml, transfer.toml or replicates.toml)",
                path.display()
            )));
        }
        Ok(())
    }

    fn figures(&self, plants: Plants) -> Result<Figures, Error> {
        let mut all = Figures::default();
        all.add_setup(self.open_loop.iter().chain(&self.steered).next());
        all.add_open_loop_runs(&self.open_loop)?;
        for (history, unit, plants) in &self.evolutions {
            all.add_evolution(history, unit, *plants);
        }
        for run in &self.steered {
            all.add_steered_run(run, "");
        }
        if let ([], [run]) = (&*self.open_loop, &*self.steered)
            && let notes = run.notes()?
            && (!notes.is_empty() || run.track.numbers("steered").is_some())
        {
            all.add_over_time(std::slice::from_ref(&run.track), &notes, plants);
        }
        all.add_stems(&self.open_loop)?;
        all.add_tracks(&self.tracks, plants);
        all.drawn.extend(self.comparisons.iter().flat_map(Comparison::figures));
        if self.comparisons.is_empty() {
            all.leave_out_the_missing();
        } else {
            // A comparison is not a paper with figures missing.
            all.left_out.clear();
        }
        Ok(all)
    }

    fn page(&self, paths: &[PathBuf]) -> Result<(Page, Vec<ReportComparison>), Error> {
        let Self { open_loop, steered, tracks, .. } = self;
        let plants = if self.is_virtual { Plants::Virtual } else { Plants::Real };
        let of_photographs = match tracks.len() {
            0 => String::new(),
            count => format!(", {} of photographs", plural(count, "track")),
        };
        let figures = self.figures(plants)?;
        let comparisons: Vec<ReportComparison> = self.comparisons.iter().map(Comparison::results).collect();
        let compared = self.comparisons.iter().zip(&comparisons);
        let mut tables: Vec<Table> = compared.flat_map(|(one, results)| one.tables(results)).collect();
        if !steered.is_empty() {
            tables.push(fitness_table(steered));
        }
        tables.extend(notes_table(open_loop.iter().chain(steered))?);
        let names: Vec<String> = paths.iter().map(|path| files::shell_word(path)).collect();
        let mut intro = format!(
            "{} open-loop and {} steered experiments{of_photographs}.",
            open_loop.len(),
            steered.len(),
        );
        if !self.comparisons.is_empty() {
            intro = if open_loop.len() + steered.len() + tracks.len() == 0 {
                String::new()
            } else {
                intro + "\n\n"
            };
            intro += "The tables say what differs by rank tests. They compare evolutions by their champions on unseen plants of \
                      the model: the best fitness over the generations is that of few plants, and selects for lucky growth \
                      noise. The command tropism transfer compares controllers on unseen virtual plants.";
        }
        let title = if self.comparisons.is_empty() { "Experiments" } else { "Comparison" };
        let page = Page {
            title: title.to_owned(),
            intro,
            plants,
            numbers: Vec::new(),
            tables,
            figures: figures.drawn,
            left_out: figures.left_out,
            command: format!("tropism report {}", names.join(" ")),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: open_loop
                .iter()
                .chain(steered)
                .map(|run| (run.path.display().to_string(), run.config.seed))
                .collect(),
            stages: Vec::new(),
            config: String::new(),
        };
        Ok((page, comparisons))
    }
}
