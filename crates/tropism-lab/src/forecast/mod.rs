//! How well models predict plants that were left out.
//!
//! In: models, and tracks of plants of which no model was made; without tracks, virtual beans that no other command grows.
//! Out: by how much the predicted tip and stem miss the plant after some time, as the front camera sees them, and how often it
//! is where the model expects it. From each start a model runs on by itself, under the lights of the track: it never sees the plant again.

mod left_out;
mod score;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::math::statistics::{mean, standard_deviation};
use tropism::parallel;
use tropism::plant::PlantModel;
use tropism::track::SAME_PERIOD;
use tropism_bean::tent::Greenhouse;
use tropism_report::{self as report, ForecastErrors, ForecastPanel, Plants};

use self::left_out::{LeftOut, View, grown, measured, steps_of};
use self::score::{PlantScore, score, score_still};
use crate::model::{self, Model};
use crate::statistics::{Bootstrap, interval_over_replicates};
use crate::units::plural;
use crate::work::{self, Input, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, files};

/// Compares models by their forecasts of plants that were left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForecastPlan {
    /// Model files. Those of one file name are one model of several replicates.
    pub models: Vec<PathBuf>,
    /// Tracks of plants that were left out: track files (CSV), and folders of runs or of track files. Without any, virtual
    /// beans are grown, under two kinds of light.
    pub tracks: Vec<PathBuf>,
    /// Number of virtual beans, 1 to 10000, the same ones under each kind of light.
    pub plants: u32,
    /// Time of the forecasts, in minutes after the start; rounded to whole steps.
    pub horizons_min: Vec<f64>,
    /// Time from one start to the next, in minutes; rounded to whole steps.
    pub interval_min: f64,
    /// Species and variation of the virtual beans, and their lamps.
    pub greenhouse: Greenhouse,
    /// Seed of the virtual beans and of the forecasts.
    pub seed: u64,
    /// Whether to continue forecasts in `out`.
    pub resume: bool,
    /// Folder for the scores of each model, `forecast.json` and the figure; without one nothing is kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
}

impl Default for ForecastPlan {
    fn default() -> Self {
        Self {
            models: Vec::new(),
            tracks: Vec::new(),
            plants: 12,
            horizons_min: vec![5.0, 60.0, 360.0],
            interval_min: 60.0,
            greenhouse: Greenhouse::default(),
            seed: 1,
            resume: false,
            out: None,
        }
    }
}

/// What forecasts are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Truth {
    /// The virtual plant as a detector without noise sees it.
    NoiseFree,
    /// Measured tips and stems, with their noise.
    Measured,
}

/// How well models predict plants that were left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForecastResults {
    /// Whether the plants are virtual.
    pub is_virtual: bool,
    /// What forecasts are compared with.
    pub truth: Truth,
    /// Whether distances are in space; else in the plane of the front camera.
    pub in_space: bool,
    /// Time of the forecasts, in minutes after the start.
    pub horizons_min: Vec<f64>,
    /// One entry for each kind of light; one for tracks.
    pub lights: Vec<LightForecasts>,
}

/// Forecasts under one kind of light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightForecasts {
    /// `six-hour`, `random` or `tracks`.
    pub light: String,
    /// Number of plants with a start.
    pub plants: usize,
    /// Number of starts, over all plants.
    pub starts: usize,
    /// The plant that stands still first, then one row for each file name of models.
    pub models: Vec<ModelForecasts>,
}

/// How well a model predicts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelForecasts {
    /// Its name: the file without its extension, or `standing still`.
    pub name: String,
    /// Number of models of this name.
    pub replicates: usize,
    /// Of the tip, at each horizon.
    pub tip: Vec<ForecastError>,
    /// Of the ten points of the stem, at each horizon; `None` for a model of the tip.
    pub stem: Option<Vec<ForecastError>>,
}

/// The error of forecasts at one horizon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ForecastError {
    /// Distance from the mean forecast to the truth, in cm: mean over starts, then over plants and replicates.
    pub mean_cm: f64,
    /// 95 % interval of that mean, by bootstrap over plants and replicates.
    pub interval_cm: [f64; 2],
    /// Standard deviation over the plants, in cm.
    pub sd_cm: f64,
    /// Share of true coordinates in the 90 % interval of the forecasts, 0 to 1; `None` for the plant that stands still.
    pub within_90: Option<f64>,
}

impl Workflow for ForecastPlan {
    type Results = ForecastResults;

    const SCHEMA: &'static str = "tropism.forecast/1";

    fn check(&self) -> Result<(), Error> {
        if self.models.is_empty() {
            return Err(Error::Plan("`models` is empty: name at least one".to_owned()));
        }
        Error::check_range("plants", self.plants, 10_000)?;
        let is_time = |minutes: &f64| (1.0..=10_000.0).contains(minutes);
        if self.horizons_min.is_empty() || !self.horizons_min.iter().all(is_time) {
            return Err(Error::Plan(format!(
                "found `horizons_min` {:?}, wanted at least one time of 1 to 10000 minutes",
                self.horizons_min
            )));
        }
        if !is_time(&self.interval_min) {
            return Err(Error::Plan(format!(
                "found `interval_min` {}, wanted 1 to 10000 minutes",
                self.interval_min
            )));
        }
        let inputs: Vec<PathBuf> = self.models.iter().chain(&self.tracks).cloned().collect();
        files::check_outputs(&self.outputs(), &inputs)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<ForecastResults, Error> {
        work::perform_in(self.out.as_deref(), |out| Self { out: Some(out), ..self.clone() }, monitor)
    }
}

/// What decides the results of forecasts: the content of `forecast.toml`.
#[derive(Serialize, Deserialize)]
struct ForecastRecord {
    schema: String,
    version: String,
    plants: u32,
    horizons_min: Vec<f64>,
    interval_min: f64,
    seed: u64,
    models: Vec<Input>,
    tracks: Vec<Input>,
    greenhouse: Greenhouse,
}

impl Work for ForecastPlan {
    const WORKFLOW: &'static str = "forecast";
    const NAME: &'static str = "a comparison of forecasts";
    const RECORD: &'static str = "forecast.toml";
    const RESULTS: &'static [&'static str] = &["forecast.json"];

    type Begun<'p> = Forecasting<'p>;

    fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        self.out.iter_mut().chain(&mut self.models).chain(&mut self.tracks).collect()
    }

    /// Models and tracks must still be where they were.
    fn of_folder(out: &Path) -> Result<Self, Error> {
        let ForecastRecord { plants, horizons_min, interval_min, seed, models, tracks, greenhouse, .. } =
            files::read_toml(&out.join(Self::RECORD))?;
        let [models, tracks] =
            [models, tracks].map(|inputs| inputs.into_iter().map(|input| input.file).collect());
        let (resume, out) = (true, Some(out.to_owned()));
        Ok(Self { models, tracks, plants, horizons_min, interval_min, greenhouse, seed, resume, out })
    }

    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let ForecastRecord { models, tracks, .. } = files::read_toml(&folder.join(Self::RECORD))?;
        let done = files::list(&folder.join("scores"), "json").map_or(0, |files| files.len());
        // Virtual beans grow under two kinds of light.
        let lights = if tracks.is_empty() { 2 } else { 1 };
        let part = PartStatus::new("forecast", done as u64, lights * models.len() as u64, "models");
        let is_virtual = tracks.is_empty().then_some(true);
        Ok(WorkStatus { is_virtual, ..WorkStatus::of::<Self>(folder, vec![part])? })
    }

    fn begin(&self, monitor: &dyn Monitor) -> Result<Forecasting<'_>, Error> {
        let models: Vec<Model> =
            self.models.iter().map(|path| model::read(path)).collect::<Result<_, _>>()?;
        let first = models.first().expect("at least one model, as checked");
        let (truth, lights) = if self.tracks.is_empty() {
            let period_min = first.period_min();
            (Truth::NoiseFree, grown(self, first.layout(), period_min, first.kind().is_in_space(), monitor)?)
        } else {
            (Truth::Measured, vec![("tracks".to_owned(), measured(&self.tracks)?)])
        };
        let horizons_min = whole_steps(&self.horizons_min, first.period_min(), monitor);
        let plants = || lights.iter().flat_map(|(_, plants)| plants);
        let in_space =
            models.iter().all(|model| model.kind().is_in_space()) && plants().all(LeftOut::is_in_space);
        let view = if in_space { View::Space } else { View::Front };
        for model in &models {
            plants().try_for_each(|plant| check_fits(model, plant))?;
        }
        let lights =
            lights.into_iter().map(|(name, plants)| self.starts_under(name, plants, &horizons_min, view));
        let lights = lights.collect::<Result<_, _>>()?;
        Ok(Forecasting { plan: self, truth, lights, horizons_min, view, models })
    }

    fn collect(&self, work: &Forecasting<'_>, _monitor: &dyn Monitor) -> Result<ForecastResults, Error> {
        let results = ForecastResults {
            is_virtual: work.lights.iter().flat_map(|light| &light.plants).any(|plant| plant.is_virtual),
            truth: work.truth,
            in_space: work.view == View::Space,
            horizons_min: work.horizons_min.clone(),
            lights: (0..work.lights.len()).map(|light| work.results(light)).collect::<Result<_, _>>()?,
        };
        files::write_json(&self.out().join("forecast.json"), &results)?;
        let (name, bytes) = figure(&results).files().remove(0);
        files::write(&self.out().join(name), &bytes)?;
        Ok(results)
    }
}

/// Plants under one kind of light, and from where they are forecast.
struct UnderLight {
    name: String,
    plants: Vec<LeftOut>,
    /// The starts of each plant.
    starts: Vec<Vec<usize>>,
}

impl UnderLight {
    /// Those with a start, and their numbers: others judge nothing.
    fn judged(&self) -> Vec<(u32, &LeftOut, &Vec<usize>)> {
        let numbered = (0..)
            .zip(&self.plants)
            .zip(&self.starts)
            .map(|((number, plant), starts)| (number, plant, starts));
        numbered.filter(|(.., starts)| !starts.is_empty()).collect()
    }
}

/// Forecasts at work.
pub struct Forecasting<'p> {
    plan: &'p ForecastPlan,
    truth: Truth,
    lights: Vec<UnderLight>,
    /// Those of the plan in whole steps.
    horizons_min: Vec<f64>,
    view: View,
    /// In the order of the plan.
    models: Vec<Model>,
}

impl Forecasting<'_> {
    /// The file with the scores of a model, from 0, under a kind of light.
    fn path(&self, light: usize, model: usize) -> PathBuf {
        self.plan.out().join("scores").join(format!("{}-{:04}.json", self.lights[light].name, model + 1))
    }

    /// The kind of light and the model of a unit.
    fn of_unit(&self, unit: usize) -> (usize, usize) {
        (unit / self.models.len(), unit % self.models.len())
    }

    /// The numbers of the models by their names, in the order in which the names come first.
    fn groups(&self) -> Vec<(String, Vec<usize>)> {
        let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
        for (number, path) in self.plan.models.iter().enumerate() {
            let name = name_of(path);
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, models)) => models.push(number),
                None => groups.push((name, vec![number])),
            }
        }
        groups
    }

    fn results(&self, light: usize) -> Result<LightForecasts, Error> {
        let (plan, under) = (self.plan, &self.lights[light]);
        let judged = under.judged();
        let still = (judged.iter())
            .map(|(_, plant, starts)| score_still(plant, starts, &self.horizons_min, self.view));
        let mut models = vec![plan.row("standing still", &[still.collect()], self.horizons_min.len())];
        for (name, replicates) in self.groups() {
            let read = |&model: &usize| {
                files::read_as(&self.path(light, model), |text| serde_json::from_str::<Vec<PlantScore>>(text))
            };
            let scores: Vec<Vec<PlantScore>> = replicates.iter().map(read).collect::<Result<_, _>>()?;
            models.push(plan.row(&name, &scores, self.horizons_min.len()));
        }
        let starts = under.starts.iter().map(Vec::len).sum();
        Ok(LightForecasts { light: under.name.clone(), plants: judged.len(), starts, models })
    }
}

impl Units for Forecasting<'_> {
    fn record(&self) -> Result<Record, Error> {
        let plan = self.plan.clone();
        let content = ForecastRecord {
            schema: ForecastPlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            plants: plan.plants,
            horizons_min: plan.horizons_min,
            interval_min: plan.interval_min,
            seed: plan.seed,
            models: Input::all(plan.models)?,
            tracks: Input::all(files::track_files(&plan.tracks)?)?,
            greenhouse: plan.greenhouse,
        };
        Record::of(self.plan, &content)
    }

    fn stages(&self) -> Vec<Stage> {
        let unit = |unit: usize| {
            let (light, model) = self.of_unit(unit);
            let (under, path) = (&self.lights[light], &self.plan.models[model]);
            let name = format!("{}-{:04}", under.name, model + 1);
            let about = format!("{} on plants under {} light", path.display(), under.name);
            Unit { size: under.judged().len() as u64, ..Unit::new(name, about) }
        };
        let units = (0..self.lights.len() * self.models.len()).map(unit).collect();
        vec![Stage { name: "forecast".to_owned(), pace: Pace::Sequential, units }]
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        let (light, model) = self.of_unit(place.unit);
        Ok(self.path(light, model).exists())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let (seed, out, horizons_min) = (self.plan.seed, self.plan.out(), &self.horizons_min);
        let (light, model) = self.of_unit(place.unit);
        let judged = self.lights[light].judged();
        let of_plant = |&(number, plant, starts): &(u32, &LeftOut, &Vec<usize>)| {
            if !monitor.may_go_on() {
                return Err(Error::Interrupted { folder: out.to_owned() });
            }
            let scored = score(&self.models[model], plant, starts, horizons_min, self.view, seed, number);
            monitor.advance(1);
            Ok(scored)
        };
        let scores: Vec<PlantScore> = parallel::try_map(judged.len(), |number| of_plant(&judged[number]))?;
        files::make_folder(&out.join("scores"))?;
        Ok(files::write_json(&self.path(light, model), &scores)?)
    }
}

impl ForecastPlan {
    /// The files that are written to [`out`](Self::out), but for those of single models.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        let names = [Self::RECORD, "forecast.json", "figure-forecast.svg"];
        self.out.iter().flat_map(|out| names.map(|name| out.join(name))).collect()
    }

    fn starts_under(
        &self,
        name: String,
        plants: Vec<LeftOut>,
        horizons_min: &[f64],
        view: View,
    ) -> Result<UnderLight, Error> {
        let starts: Vec<Vec<usize>> =
            plants.iter().map(|plant| plant.starts(horizons_min, self.interval_min, view)).collect();
        if starts.iter().all(Vec::is_empty) {
            let longest = horizons_min.iter().copied().fold(0.0, f64::max);
            return Err(Error::Plan(format!(
                "found no start in {}, wanted a measured tip below {} cm with {longest} minutes of lit steps after it, \
                 at least one",
                plural(plants.len(), "plant"),
                left_out::HIGHEST_START_CM
            )));
        }
        Ok(UnderLight { name, plants, starts })
    }

    /// The row of a model, from the scores of each replicate on each plant.
    fn row(&self, name: &str, scores: &[Vec<PlantScore>], horizons: usize) -> ModelForecasts {
        let errors = |of: &dyn Fn(&PlantScore) -> Option<Vec<score::Miss>>| -> Option<Vec<ForecastError>> {
            let misses: Vec<Vec<Vec<score::Miss>>> =
                scores.iter().map(|plants| plants.iter().map(of).collect()).collect::<Option<_>>()?;
            Some((0..horizons).map(|horizon| self.error(&misses, horizon)).collect())
        };
        ModelForecasts {
            name: name.to_owned(),
            replicates: scores.len(),
            tip: errors(&|plant| Some(plant.tip.clone())).unwrap_or_default(),
            stem: errors(&|plant| plant.stem.clone()),
        }
    }

    fn error(&self, misses: &[Vec<Vec<score::Miss>>], horizon: usize) -> ForecastError {
        let values = |of: fn(&score::Miss) -> f64| -> Vec<Vec<f64>> {
            misses.iter().map(|plants| plants.iter().map(|plant| of(&plant[horizon])).collect()).collect()
        };
        let distances = values(|miss| miss.distance_cm);
        let plants = distances[0].len();
        let of_plants: Vec<f64> =
            (0..plants).map(|plant| mean(distances.iter().map(|replicate| replicate[plant]))).collect();
        let interval_cm = match distances.as_slice() {
            [one] => Bootstrap::new(self.seed, plants).interval_of_mean(one),
            many => interval_over_replicates(many, self.seed),
        };
        let is_forecast = misses[0][0][horizon].within_90.is_some();
        let within = values(|miss| miss.within_90.unwrap_or_default());
        ForecastError {
            mean_cm: mean(of_plants.iter().copied()),
            interval_cm,
            sd_cm: standard_deviation(&of_plants),
            within_90: is_forecast.then(|| mean(within.into_iter().flatten())),
        }
    }
}

/// The times in whole steps of `period_min`, each once; what is not, is noted.
fn whole_steps(minutes: &[f64], period_min: f64, monitor: &dyn Monitor) -> Vec<f64> {
    let mut steps = Vec::new();
    for &wanted in minutes {
        let found = steps_of(wanted, period_min) as f64 * period_min;
        let found = if (found / wanted - 1.0).abs() <= SAME_PERIOD { wanted } else { found };
        if !steps.contains(&found) {
            steps.push(found);
        }
    }
    if steps != minutes {
        let list = |times: &[f64]| times.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
        let (wanted, found) = (list(minutes), list(&steps));
        monitor.note(&format!(
            "horizons are whole steps of {period_min} minutes: {found} in place of {wanted} minutes"
        ));
    }
    steps
}

/// The name of a model: its file without the extension.
fn name_of(path: &Path) -> String {
    path.file_stem().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Checks that a model is of the lamps and the period of a track.
fn check_fits(model: &Model, plant: &LeftOut) -> Result<(), Error> {
    let (found, wanted) = (plant.observed.period_min, model.period_min());
    if (found / wanted - 1.0).abs() > SAME_PERIOD || plant.observed.layout.len() != model.layout().len() {
        return Err(Error::Plan(format!(
            "{}: found {} lamps and {found} minutes between steps, wanted {} lamps and {wanted} minutes as in the models",
            plant.name,
            plant.observed.layout.len(),
            model.layout().len()
        )));
    }
    Ok(())
}

/// The figure of the errors: a panel for the tip and one for the stem under each kind of light.
fn figure(results: &ForecastResults) -> tropism_report::Figure {
    let hours: Vec<f64> = results.horizons_min.iter().map(|minutes| minutes / 60.0).collect();
    let mut panels = Vec::new();
    for light in &results.lights {
        let lines = |of: &dyn Fn(&ModelForecasts) -> Option<Vec<ForecastError>>| -> Vec<ForecastErrors> {
            let line = |model: &ModelForecasts| {
                let errors = of(model)?;
                let at = hours.iter().zip(errors);
                Some(ForecastErrors {
                    name: model.name.clone(),
                    errors_cm: at.map(|(&hours, error)| (hours, error.mean_cm, error.interval_cm)).collect(),
                })
            };
            light.models.iter().filter_map(line).collect()
        };
        for (what, lines) in
            [("tip", lines(&|model| Some(model.tip.clone()))), ("stem", lines(&|model| model.stem.clone()))]
        {
            if !lines.is_empty() {
                let of_light =
                    if light.light == "tracks" { String::new() } else { format!(", {} light", light.light) };
                let place = if results.in_space { " in space" } else { "" };
                panels.push(ForecastPanel { title: format!("{what}{place}{of_light}"), lines });
            }
        }
    }
    report::forecast_errors(&panels, if results.is_virtual { Plants::Virtual } else { Plants::Real })
}
