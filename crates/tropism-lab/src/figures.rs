//! The paper's figures, and the table of fitness, from runs, tracks and evolutions.

use std::path::Path;

use tropism::geometry::Region;
use tropism::math::statistics::median;
use tropism::parallel;
use tropism::task::Task;
use tropism::track::Track;
use tropism_bean::{scene, view};
use tropism_report::{
    self as report, Composite, Figure, Goals, LeftOut, LitStem, Plants, SetUp, Surroundings, Table,
};

use crate::Error;
use crate::evolve::EvolutionHistory;
use crate::finished_run::{FinishedRun, RunNote};

/// Most plants in space of one kind that a report shows: each is drawn from three sides. Chosen: as many as the paper's plants.
const MAX_IN_SPACE: usize = 6;

/// Figures, and which are left out because there are no data for them.
#[derive(Default)]
pub(crate) struct Figures {
    pub(crate) drawn: Vec<Figure>,
    pub(crate) left_out: Vec<LeftOut>,
}

impl Figures {
    fn leave_out(&mut self, figure: &str, reason: &str) {
        self.left_out.push(LeftOut { figure: figure.to_owned(), reason: reason.to_owned() });
    }

    /// Figure 1: the set-up of a run.
    pub(crate) fn add_setup(&mut self, run: Option<&FinishedRun>) {
        match run.and_then(|run| Some((run, run.config.rig.layout().ok()?))) {
            Some((run, layout)) => {
                let of_tent = |place: [f64; 3]| run.config.is_virtual().then_some(place);
                let setup = SetUp {
                    layout: &layout,
                    targets: &run.config.task.targets,
                    camera: of_tent(view::CAMERA),
                    flash: of_tent(scene::FLASH),
                    period_min: run.config.rig.period_min,
                };
                self.drawn.extend(report::setup(&setup, run.plants()));
            }
            None => self.leave_out("1", "only the folder of a run says where lamps and camera stand"),
        }
    }

    /// Figures 2 to 5 of open-loop runs, and the tracks over time.
    pub(crate) fn add_open_loop_runs(&mut self, runs: &[FinishedRun]) -> Result<(), Error> {
        let Some(first) = runs.first() else {
            self.leave_out("2", "it needs the folder of an open-loop run, with its photographs");
            return Ok(());
        };
        let plants = first.plants();
        let composites: Vec<Composite> = parallel::try_map(runs.len(), |run| runs[run].composite())?;
        let composites = cropped_alike(runs, composites);
        if composites.iter().any(|composite| composite.image().is_some()) {
            self.drawn.push(report::composite(&composites, plants));
        } else {
            self.leave_out("2", "the runs kept no photographs");
        }
        let tracks: Vec<Track> = runs.iter().map(|run| run.track.clone()).collect();
        // Notes of several plants would be lines of no plant in particular.
        let notes = if let [run] = runs { run.notes()? } else { Vec::new() };
        self.add_tips(&tracks, &notes, plants);
        self.add_in_space(runs.iter().map(|run| {
            let title = format!("Plant {} in space", short_name(&run.path));
            report::in_space("space", &title, &run.track, &surroundings(run), plants)
        }));
        Ok(())
    }

    /// Plants in space, as far as their depth is known.
    fn add_in_space(&mut self, figures: impl Iterator<Item = Option<Figure>>) {
        let mut figures = figures.flatten();
        self.drawn.extend(figures.by_ref().take(MAX_IN_SPACE));
        let further = figures.count();
        if further > 0 {
            let reason = format!("{further} further plants in space: the first {MAX_IN_SPACE} are shown");
            self.leave_out("space", &reason);
        }
    }

    /// Figures 3 to 5, and 9 if a track has stems, of tracks of photographs.
    pub(crate) fn add_tracks(&mut self, tracks: &[Track], plants: Plants) {
        if tracks.is_empty() {
            return;
        }
        self.add_tips(tracks, &[], plants);
        self.add_in_space((1..).zip(tracks).map(|(number, track)| {
            let title = format!("Track {number} in space");
            report::in_space("space", &title, track, &Surroundings::default(), plants)
        }));
        let mut stems = tracks.iter().map(|track| (stems_of_track(track), &track.layout));
        match stems.find(|(stems, _)| !stems.is_empty()) {
            Some((stems, layout)) => self.drawn.push(report::stems(&stems, layout, plants)),
            None => self.leave_out("9", "no stem is detected in the tracks"),
        }
    }

    /// Figures 3 to 5: speed, trajectories, directions and shifts of the tips; and the tracks over time.
    fn add_tips(&mut self, tracks: &[Track], notes: &[RunNote], plants: Plants) {
        let is_lit = tracks.iter().any(|track| track.shifts().next().is_some());
        if is_lit {
            self.drawn.push(report::speed(tracks, plants));
        }
        self.drawn.push(report::trajectories(tracks, plants));
        if is_lit {
            self.drawn.push(report::directions(tracks, plants));
            self.drawn.extend(report::shift_maps(tracks, plants));
        } else {
            self.leave_out("3, 4b, 5", "no lamp is lit between two measured tips of these tracks");
        }
        self.add_over_time(tracks, notes, plants);
    }

    /// Tracks over time, with marks at notes.
    pub(crate) fn add_over_time(&mut self, tracks: &[Track], notes: &[RunNote], plants: Plants) {
        let hours: Vec<f64> = notes.iter().map(|note| note.hours).collect();
        self.drawn.push(report::over_time(tracks, &hours, plants));
    }

    /// Figures 6a and 6b: fitness over the generations of all runs, and of the median one.
    pub(crate) fn add_evolution(
        &mut self,
        EvolutionHistory { best, mean }: &EvolutionHistory,
        unit: &str,
        plants: Plants,
    ) {
        if let Some(median) = report::fitness_median_run(best, mean, unit, plants) {
            self.drawn.extend([report::fitness_boxes(best, unit, plants), median]);
        }
    }

    /// Figure 8: the track of a steered plant between its targets, in space where its depth is known. `remark` follows the name
    /// of the plant.
    pub(crate) fn add_steered_run(&mut self, run: &FinishedRun, remark: &str) {
        let plant = short_name(&run.path);
        let plant = if run.config.is_virtual() {
            format!("Virtual plant {plant} (seed {})", run.config.seed)
        } else {
            format!("Plant {plant}")
        };
        let title = format!("{plant}{remark}, steered by {}", run.config.controller_description());
        let title_in_space = format!("{title}, fitness {}", run.config.task.fitness_in_words(run.fitness()));
        let around = surroundings(run);
        let in_space = report::in_space("8", &title_in_space, &run.track, &around, run.plants());
        self.drawn.push(in_space.unwrap_or_else(|| {
            let task = &run.config.task;
            let fitness = (run.fitness(), task.best_fitness_of(&run.track));
            let title = with_distances(&title, task, &run.track);
            report::steering("8", &title, &run.track, &Goals::of(task), fitness, run.plants())
        }));
    }

    /// Figure 9: the stems of the first run in whose photographs stems are detected.
    pub(crate) fn add_stems(&mut self, runs: &[FinishedRun]) -> Result<(), Error> {
        for run in runs {
            let stems = run.stems()?;
            if !stems.is_empty() {
                self.drawn.push(report::stems(&stems, &run.track.layout, run.plants()));
                return Ok(());
            }
        }
        if !runs.is_empty() {
            self.leave_out("9", "no stem is detected in the photographs of the runs");
        }
        Ok(())
    }

    /// Names the figures for which nothing was given.
    pub(crate) fn leave_out_the_missing(&mut self) {
        for (figure, reason) in [
            ("3", "3 to 5 need open-loop runs, or tracks of photographs"),
            ("6", "it needs the folder of an evolution"),
            ("7", "it needs the folder of a study"),
            ("8", "it needs the folder of a run with targets"),
            ("9", "it needs open-loop runs or tracks with stems"),
        ] {
            let is_told =
                self.left_out.iter().any(|left_out| left_out.figure.split(", ").any(|other| other == figure));
            if !is_told && !self.drawn.iter().any(|drawn| drawn.number.starts_with(figure)) {
                self.leave_out(figure, reason);
            }
        }
    }
}

/// What stands around the plant of a run: the goals of its task, and the solids of a virtual tent.
fn surroundings(run: &FinishedRun) -> Surroundings {
    let mut around = Surroundings::of(&run.config.task);
    if let Some(tent) = &run.config.rig.greenhouse {
        around.solids = tent.clone().among(&around.solids).solids;
    }
    around
}

/// The composites without what lies beyond all plants, so that they keep one scale. Those of cameras that differ are left whole.
fn cropped_alike(runs: &[FinishedRun], composites: Vec<Composite>) -> Vec<Composite> {
    let sizes = composites.iter().filter_map(Composite::image).map(|image| (image.width, image.height));
    let mut sizes: Vec<(usize, usize)> = sizes.collect();
    sizes.dedup();
    let regions: Option<Vec<Region>> = runs.iter().map(FinishedRun::region_of_plant).collect();
    let region = regions.and_then(|regions| regions.into_iter().reduce(around_both));
    match region {
        Some(region) if sizes.len() == 1 => {
            composites.into_iter().map(|composite| composite.cropped(region)).collect()
        }
        _ => composites,
    }
}

/// The least region that holds two.
fn around_both(a: Region, b: Region) -> Region {
    let (x, y) = (a.x.min(b.x), a.y.min(b.y));
    let right = (a.x + a.width).max(b.x + b.width);
    let bottom = (a.y + a.height).max(b.y + b.height);
    Region { x, y, width: right - x, height: bottom - y }
}

/// Largest number of stems of a track in Figure 9; chosen: some 150 bytes each.
const MAX_STEMS: usize = 4000;

/// The stems of a track, each with the light that followed; of a long track at equal distances.
fn stems_of_track(track: &Track) -> Vec<LitStem> {
    let stems: Vec<LitStem> =
        track.samples.iter().filter_map(|sample| Some((sample.stem.clone()?, sample.light))).collect();
    let stride = stems.len().div_ceil(MAX_STEMS).max(1);
    stems.into_iter().step_by(stride).collect()
}

/// The fitness of steered runs, and the distance of their tips to each target.
/// The notes of runs; `None` if there are none.
pub(crate) fn notes_table<'a>(runs: impl Iterator<Item = &'a FinishedRun>) -> Result<Option<Table>, Error> {
    let mut rows = Vec::new();
    for run in runs {
        rows.extend(run.notes()?.into_iter().map(|note| {
            vec![note.text, short_name(&run.path), note.step.to_string(), format!("{:.1}", note.hours)]
        }));
    }
    let table = Table {
        title: "Notes".to_owned(),
        caption: "What people wrote down of the runs.".to_owned(),
        head: ["Note", "Run", "Step", "Hour"].map(str::to_owned).to_vec(),
        rows,
    };
    Ok(Some(table).filter(|table| !table.rows.is_empty()))
}

pub(crate) fn fitness_table(runs: &[FinishedRun]) -> Table {
    let unit = |run: &FinishedRun| run.config.task.kind.unit();
    let has_one_unit = runs.windows(2).all(|pair| unit(&pair[0]) == unit(&pair[1]));
    let fitness = |run: &FinishedRun| match run.fitness() {
        fitness if has_one_unit => format!("{fitness:.2}"),
        fitness => format!("{fitness:.2} {}", unit(run)),
    };
    let row = |run: &FinishedRun| {
        vec![
            short_name(&run.path),
            run.config.controller_description(),
            fitness(run),
            (run.track.samples.len() - 1).to_string(),
            distances(&run.config.task, &[&run.track]),
        ]
    };
    let in_unit =
        runs.first().filter(|_| has_one_unit).map_or_else(String::new, |run| format!(" ({})", unit(run)));
    let fitness = format!("Fitness{in_unit}");
    let head = ["Run", "Controller", &fitness, "Steps", "Distance to each target at its height (cm)"];
    Table {
        title: "Steered experiments".to_owned(),
        caption: "Fitness by the task of each run, of targets after eq. (9). Tips are as the controller saw them in photographs.".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: runs.iter().map(row).collect(),
    }
}

/// A title with the distances of the tip of `track` from the targets of `task`, where it has any.
pub(crate) fn with_distances(title: &str, task: &Task, track: &Track) -> String {
    if task.targets.is_empty() {
        return title.to_owned();
    }
    format!("{title}; {} cm from the targets", distances(task, &[track]))
}

/// The median distance of the tips from each target at its height, in cm: `0.4, 1.2, -`.
pub(crate) fn distances(task: &Task, tracks: &[&Track]) -> String {
    let crossings: Vec<_> = tracks.iter().map(|track| task.crossings(track)).collect();
    let of_target = |target: usize| {
        let reached: Vec<f64> = crossings.iter().filter_map(|all| Some(all[target]?.distance_cm)).collect();
        if reached.is_empty() { "-".to_owned() } else { format!("{:.1}", median(&reached)) }
    };
    let texts: Vec<String> = (0..task.targets.len()).map(of_target).collect();
    texts.join(", ")
}

/// The last two parts of a path: `champion/1`.
fn short_name(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts[parts.len().saturating_sub(2)..].join("/")
}
