//! Parameters of virtual beans that move like the plants of open-loop tracks.
//!
//! In: tracks, a plant each. Out: estimates of five parameters with 90 % intervals, and a bean file. [`RecoveryPlan`]
//! measures on virtual plants, whose parameters are known, how well this works.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::math;
use tropism::parallel;
use tropism::random::{self, Purpose};
use tropism_bean::calibrate::{BeanCalibration, Estimate, PARAMETERS, calibrate};
use tropism_bean::{Individual, Species, acceptance};

use crate::work::{self, Input, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, files};

/// Half the width of a 90 % interval of a normal distribution, in standard deviations.
const NINETY_PERCENT: f64 = 1.645;

/// Estimates the parameters of plants from their open-loop tracks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CalibratePlan {
    /// Track files (CSV), a plant each, or folders of runs or tracks.
    pub tracks: Vec<PathBuf>,
    /// Minutes between the rows of the tracks, 0.1 to 120; as their times say if it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_min: Option<f64>,
    /// Species of the plants: the prior of the estimates.
    pub species: Species,
    /// Whether to continue a calibration in `out`.
    pub resume: bool,
    /// Folder for the estimates of each plant, and for the species with these estimates and their spread; without one nothing is
    /// kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
}

/// The estimates of one plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantEstimates {
    /// Its track file.
    pub track: PathBuf,
    /// Distance of the fitted plant's tip to the track's, root mean square, in cm.
    pub rms_cm: f64,
    /// One estimate a parameter, in the order of [`PARAMETERS`].
    pub estimates: Vec<ParameterEstimate>,
}

/// The estimate of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterEstimate {
    /// Key of the bean file.
    pub key: String,
    /// The estimate, in the unit of [`PARAMETERS`].
    pub value: f64,
    /// Lower end of the 90 % interval.
    pub low: f64,
    /// Upper end of the 90 % interval.
    pub high: f64,
    /// Share of the estimate that is the species' own and not the track's, 0 to 1.
    pub prior_share: f64,
}

/// Share of the prior from which on the track says nothing about a parameter; chosen by hand: its interval is then at most
/// a fortieth narrower than the species' spread.
const SILENT_SHARE: f64 = 0.95;

impl ParameterEstimate {
    /// Whether the track says nothing about the parameter: the estimate is the species' own.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.prior_share >= SILENT_SHARE
    }
}

/// One parameter over all plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PooledEstimate {
    /// Key of the bean file.
    pub key: String,
    /// Geometric mean over plants.
    pub mean: f64,
    /// Coefficient of variation between plants: of the estimates, and of what the tracks leave open, which is the species' own
    /// where they say nothing.
    pub spread: f64,
}

impl Workflow for CalibratePlan {
    /// The estimates of each plant, in the order of the plan.
    type Results = Vec<PlantEstimates>;

    const SCHEMA: &'static str = "tropism.calibrate/1";

    fn check(&self) -> Result<(), Error> {
        self.species.check().map_err(Error::in_plan("species"))?;
        if self.tracks.is_empty() {
            return Err(Error::Plan("`tracks` is empty: name at least one".to_owned()));
        }
        if let Some(found) = self.interval_min.filter(|found| !(0.1..=120.0).contains(found)) {
            return Err(Error::Plan(format!("found `interval_min` {found}, wanted 0.1 to 120 minutes")));
        }
        files::check_outputs(&self.outputs(), &self.tracks)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<Vec<PlantEstimates>, Error> {
        work::perform_in(self.out.as_deref(), |out| Self { out: Some(out), ..self.clone() }, monitor)
    }
}

/// File of the species in the folder of a calibration.
const BEAN: &str = "bean.toml";

/// What decides the results of a calibration: the content of `calibrate.toml`.
#[derive(Serialize, Deserialize)]
struct CalibrationRecord {
    schema: String,
    version: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    interval_min: Option<f64>,
    tracks: Vec<Input>,
    species: Species,
}

impl Work for CalibratePlan {
    const WORKFLOW: &'static str = "calibrate";
    const NAME: &'static str = "a calibration";
    const RECORD: &'static str = "calibrate.toml";
    const RESULTS: &'static [&'static str] = &[BEAN];

    type Begun<'p> = Calibrating<'p>;

    fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        self.out.iter_mut().chain(&mut self.tracks).collect()
    }

    /// The tracks must still be where they were.
    fn of_folder(out: &Path) -> Result<Self, Error> {
        let CalibrationRecord { interval_min, tracks, species, .. } =
            files::read_toml(&out.join(Self::RECORD))?;
        let tracks = tracks.into_iter().map(|track| track.file).collect();
        Ok(Self { tracks, interval_min, species, resume: true, out: Some(out.to_owned()) })
    }

    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let CalibrationRecord { tracks, .. } = files::read_toml(&folder.join(Self::RECORD))?;
        let done = files::list(&folder.join("plants"), "json").map_or(0, |files| files.len());
        let part = PartStatus::new("calibrate", done as u64, tracks.len() as u64, "plants");
        Ok(WorkStatus { is_virtual: None, ..WorkStatus::of::<Self>(folder, vec![part])? })
    }

    fn begin(&self, _monitor: &dyn Monitor) -> Result<Calibrating<'_>, Error> {
        Ok(Calibrating { plan: self, tracks: files::track_files(&self.tracks)? })
    }

    fn collect(
        &self,
        calibrating: &Calibrating<'_>,
        _monitor: &dyn Monitor,
    ) -> Result<Vec<PlantEstimates>, Error> {
        let read = |number| {
            files::read_as(&calibrating.path(number), |text| serde_json::from_str::<PlantEstimates>(text))
        };
        let plants: Vec<PlantEstimates> =
            (0..calibrating.tracks.len()).map(read).collect::<Result<_, _>>()?;
        let path = self.out().join(BEAN);
        let species = with_estimates(self.species.clone(), &pool(&plants), plants.len());
        files::write(&path, files::toml_of(&path, &species)?.as_bytes())?;
        Ok(plants)
    }
}

impl CalibratePlan {
    /// The files that are written to [`out`](Self::out), but for those of single plants.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        self.out.iter().flat_map(|out| [Self::RECORD, BEAN].map(|name| out.join(name))).collect()
    }

    /// The file of the species with the estimates; `None` if nothing is kept.
    #[must_use]
    pub fn bean(&self) -> Option<PathBuf> {
        self.out.as_ref().map(|out| out.join(BEAN))
    }
}

/// A calibration at work.
pub struct Calibrating<'p> {
    plan: &'p CalibratePlan,
    tracks: Vec<PathBuf>,
}

impl Calibrating<'_> {
    /// The file with the estimates of plant `number`, from 0.
    fn path(&self, number: usize) -> PathBuf {
        self.plan.out().join("plants").join(format!("{:04}.json", number + 1))
    }
}

impl Units for Calibrating<'_> {
    fn record(&self) -> Result<Record, Error> {
        let content = CalibrationRecord {
            schema: CalibratePlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            interval_min: self.plan.interval_min,
            tracks: Input::all(self.tracks.clone())?,
            species: self.plan.species.clone(),
        };
        Record::of(self.plan, &content)
    }

    fn stages(&self) -> Vec<Stage> {
        let unit = |(number, track): (usize, &PathBuf)| {
            Unit::new(format!("{number:04}"), track.display().to_string())
        };
        let units = (1..).zip(&self.tracks).map(unit).collect();
        vec![Stage { name: "calibrate".to_owned(), pace: Pace::Parallel, units }]
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        Ok(self.path(place.unit).exists())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let (CalibratePlan { interval_min, species, .. }, out) = (self.plan, self.plan.out());
        let file = &self.tracks[place.unit];
        let track = files::read_track(file)?;
        let period_min = interval_min.unwrap_or(track.period_min);
        let calibration = calibrate(&track, period_min, species, &|| monitor.may_go_on())
            .map_err(Error::at(file.display()))?
            .ok_or_else(|| Error::Interrupted { folder: out.to_owned() })?;
        files::make_folder(&out.join("plants"))?;
        files::write_json(&self.path(place.unit), &PlantEstimates::new(file.clone(), &calibration))?;
        monitor.advance(1);
        Ok(())
    }
}

impl PlantEstimates {
    fn new(track: PathBuf, calibration: &BeanCalibration) -> Self {
        let estimate = |((key, ..), estimate): ((&str, &str, &str), &Estimate)| {
            let Estimate { value, interval: [low, high], prior_share } = *estimate;
            ParameterEstimate { key: key.to_owned(), value, low, high, prior_share }
        };
        let estimates = PARAMETERS.into_iter().zip(&calibration.estimates).map(estimate).collect();
        Self { track, rms_cm: calibration.rms_cm, estimates }
    }
}

/// Pools the estimates of at least one plant: mean and variance of their logarithms, one row a parameter.
///
/// The estimates are posterior means, drawn to the species, so the variance between plants is that of the estimates and the
/// mean of their own variances (law of total variance).
#[must_use]
pub fn pool(plants: &[PlantEstimates]) -> Vec<PooledEstimate> {
    let count = plants.len() as f64;
    let pooled = |(parameter, (key, ..)): (usize, (&str, &str, &str))| {
        let estimates = || plants.iter().map(|plant| &plant.estimates[parameter]);
        let logs: Vec<f64> = estimates().map(|estimate| math::ln(estimate.value)).collect();
        let mean = logs.iter().sum::<f64>() / count;
        let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let own = estimates().map(|&ParameterEstimate { low, high, .. }| {
            (math::ln(high / low) / (2.0 * NINETY_PERCENT)).powi(2)
        });
        let between = variance + own.sum::<f64>() / count;
        PooledEstimate {
            key: key.to_owned(),
            mean: math::exp(mean),
            spread: (math::exp(between) - 1.0).sqrt(),
        }
    };
    PARAMETERS.into_iter().enumerate().map(pooled).collect()
}

/// The species with the pooled estimates; its spread only changes if there are several plants.
fn with_estimates(mut species: Species, pooled: &[PooledEstimate], plants: usize) -> Species {
    let typical = &mut species.typical;
    let values = [
        &mut typical.growth.rate,
        &mut typical.tropism.light,
        &mut typical.motility.zone,
        &mut typical.tropism.light_memory_h,
        &mut typical.nutation.period_h,
    ];
    for (value, pooled) in values.into_iter().zip(pooled) {
        *value = pooled.mean;
    }
    if plants > 1 {
        let spread = &mut species.spread;
        let values = [
            &mut spread.growth_rate,
            &mut spread.tropism_light,
            &mut spread.motility_zone,
            &mut spread.tropism_light_memory_h,
            &mut spread.nutation_period_h,
        ];
        for (value, pooled) in values.into_iter().zip(pooled) {
            *value = pooled.spread.min(1.0);
        }
    }
    species
}

/// Estimates the parameters of virtual plants, and compares them with the true ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecoveryPlan {
    /// Number of virtual plants, 2 to 10000.
    pub plants: u32,
    /// Their species.
    pub species: Species,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for RecoveryPlan {
    fn default() -> Self {
        Self { plants: 50, species: Species::default(), seed: 1 }
    }
}

/// How well one parameter is recovered, over all virtual plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterRecovery {
    /// Key of the bean file.
    pub key: String,
    /// Mean error, as a share of the true value.
    pub bias: f64,
    /// Root mean square error, as a share of the true value.
    pub error: f64,
    /// Root mean square error of the species' typical value, as a share of the true value: the error without any track.
    pub error_of_typical: f64,
    /// Share of the 90 % intervals that contain the true value.
    pub coverage: f64,
}

/// The true parameters of a virtual plant, in the order of [`PARAMETERS`], and their estimates.
struct RecoveredPlant {
    truth: [f64; 5],
    estimates: [Estimate; 5],
}

impl Workflow for RecoveryPlan {
    /// One row a parameter, in the order of [`PARAMETERS`].
    type Results = Vec<ParameterRecovery>;

    const SCHEMA: &'static str = "tropism.recovery/1";

    fn check(&self) -> Result<(), Error> {
        self.species.check().map_err(Error::in_plan("species"))?;
        if !(2..=10_000).contains(&self.plants) {
            return Err(Error::Plan(format!("found plants = {}, wanted 2 to 10000", self.plants)));
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<Vec<ParameterRecovery>, Error> {
        monitor.stage("calibrating virtual plants", self.plants.into());
        let recover = |plant: u32| {
            if !monitor.may_go_on() {
                return Err(Error::cancelled());
            }
            let seed = random::derive(self.seed, Purpose::Plant, plant.into());
            let track = acceptance::open_loop_experiment(&self.species, seed);
            let calibration = calibrate(&track, track.period_min, &self.species, &|| monitor.may_go_on())
                .map_err(Error::at(format!("virtual plant {}", plant + 1)))?
                .ok_or_else(Error::cancelled)?;
            monitor.advance(1);
            let truth = parameters(&self.species.draw(seed, 1.0));
            Ok::<_, Error>(RecoveredPlant { truth, estimates: calibration.estimates })
        };
        let plants: Vec<RecoveredPlant> =
            parallel::try_map(self.plants as usize, |plant| recover(plant as u32))?;
        let typical = parameters(&self.species.average());
        let row = |(parameter, (key, ..)): (usize, (&str, &str, &str))| {
            ParameterRecovery::new(key, parameter, &plants, typical[parameter])
        };
        Ok(PARAMETERS.into_iter().enumerate().map(row).collect())
    }
}

impl ParameterRecovery {
    fn new(key: &str, parameter: usize, plants: &[RecoveredPlant], typical: f64) -> Self {
        let count = plants.len() as f64;
        let mean = |value: &dyn Fn(&RecoveredPlant) -> f64| plants.iter().map(value).sum::<f64>() / count;
        let relative = |truth: f64, value: f64| value / truth - 1.0;
        let error =
            |plant: &RecoveredPlant| relative(plant.truth[parameter], plant.estimates[parameter].value);
        let is_covered = |plant: &RecoveredPlant| {
            let [low, high] = plant.estimates[parameter].interval;
            f64::from(u8::from((low..=high).contains(&plant.truth[parameter])))
        };
        Self {
            key: key.to_owned(),
            bias: mean(&error),
            error: mean(&|plant| error(plant).powi(2)).sqrt(),
            error_of_typical: mean(&|plant| relative(plant.truth[parameter], typical).powi(2)).sqrt(),
            coverage: mean(&is_covered),
        }
    }
}

/// The parameters of a plant in the order of [`PARAMETERS`].
fn parameters(plant: &Individual) -> [f64; 5] {
    [
        plant.growth.rate,
        plant.tropism.light,
        plant.motility.zone,
        plant.tropism.light_memory_h,
        plant.nutation.period_h,
    ]
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use tropism::control::Periodic;
    use tropism::environment::unwatched;
    use tropism::lamps::Layout;
    use tropism::task::Task;
    use tropism_bean::Trial;

    use super::*;

    /// Asks for an end after the first plant.
    #[derive(Default)]
    struct One(AtomicBool);

    impl Monitor for One {
        fn advance(&self, count: u64) {
            self.0.fetch_or(count > 0, Ordering::SeqCst);
        }

        fn may_go_on(&self) -> bool {
            !self.0.load(Ordering::SeqCst)
        }
    }

    #[test]
    fn plants_whose_tracks_say_nothing_have_the_spread_of_the_species() {
        let sd = math::ln(1.0 + 0.3 * 0.3).sqrt();
        let silent = |value: f64| {
            let [low, high] = [-1.0, 1.0].map(|sign| value * math::exp(sign * NINETY_PERCENT * sd));
            let estimate = ParameterEstimate { key: String::new(), value, low, high, prior_share: 1.0 };
            PlantEstimates { track: PathBuf::new(), rms_cm: 1.0, estimates: vec![estimate; PARAMETERS.len()] }
        };
        let pooled = pool(&[silent(2.0), silent(2.0), silent(2.0)]);
        assert!(pooled.iter().all(|one| (one.spread - 0.3).abs() < 1e-12 && (one.mean - 2.0).abs() < 1e-12));
    }

    #[test]
    fn an_interruption_leaves_the_plants_that_are_done() {
        let folder = tempfile::tempdir().unwrap();
        let species = Species::default();
        let task = Task::open_loop(60);
        let mut periodic = Periodic::new(12, &Layout::default());
        let track = Trial::new(&species).grow(1, &mut periodic, &task, &mut unwatched);
        let tracks = vec![folder.path().join("1.csv"), folder.path().join("2.csv")];
        tracks.iter().for_each(|path| files::write_track(path, &track).unwrap());
        let out = folder.path().join("mine");
        let plan = CalibratePlan { tracks, out: Some(out.clone()), ..CalibratePlan::default() };
        let bean = plan.bean().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let ended = pool.install(|| plan.execute(&One::default())).unwrap_err();
        assert!(matches!(ended, Error::Interrupted { folder } if folder == out));
        assert!(out.join("plants/0001.json").exists() && !bean.exists());
        let resumed = CalibratePlan::of_folder(&out).unwrap();
        assert_eq!(resumed.execute(&crate::Silent).unwrap().len(), 2);
        assert!(bean.exists());
        // The same plants as without an interruption.
        let whole = CalibratePlan { out: Some(folder.path().join("whole")), ..plan.clone() };
        whole.execute(&crate::Silent).unwrap();
        assert_eq!(files::read(&whole.bean().unwrap()).unwrap(), files::read(&bean).unwrap());
        files::write(&plan.tracks[1], b"changed").unwrap();
        let error = resumed.execute(&crate::Silent).unwrap_err().to_string();
        assert!(error.contains("a calibration with other settings is here"), "{error}");
    }
}
