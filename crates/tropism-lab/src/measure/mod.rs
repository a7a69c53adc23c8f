//! The constants of plants from their stems over time.
//!
//! In: tracks with stems, or virtual plants; what the plants respond to; groups. Out: each constant of each plant with its interval
//! and what can be said of it, means of groups, groups compared, and what the same experiment recovers of virtual plants with
//! the constants that were found.

mod angle_file;
mod demo;
mod page;
mod species_file;
mod files_of;
mod light_file;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::measure::estimate::QUANTITIES;
use tropism::measure::group::{self, Comparison};
use tropism::measure::{
    AngleRecord, Estimate, FrameCounts, Law, Measurement, Options, Quantity, Recovery, Sharpening, Status,
    StemRecord, Stimulus, measure, self_check, sharpenings,
};
use tropism::observation::Quality;
use tropism::parallel;

use crate::{Error, Monitor, Workflow, files};
use light_file::LightRecord;

/// Most virtual plants of the self-check.
const MAX_CHECK_PLANTS: u64 = 1000;

/// Measures the constants of plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasurePlan {
    /// Track files (CSV) with stems, and folders of runs or of track files.
    pub tracks: Vec<PathBuf>,
    /// Groups of further tracks, such as genotypes.
    pub groups: Vec<PlantGroup>,
    /// Angle by which the pots were tipped at the first frame, in degrees: 1 to 180. Without it, and without `lamps`, the plants
    /// stand upright.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tilt_deg: Option<f64>,
    /// Whether the plants respond to the lamps of their tracks.
    pub lamps: bool,
    /// A CSV file with the columns `time_h` and `light`, hours from the first photograph on: the plants respond to these lamps, and
    /// not to those of their tracks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<PathBuf>,
    /// Radius of the stems in the zone that bends, in cm: gives constants in growth units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_cm: Option<f64>,
    /// How elongation carries curvature.
    pub law: Law,
    /// Hours of each record that are measured; all by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hours: Option<f64>,
    /// Virtual plants of the self-check, 0 to 1000; 0 leaves it out.
    pub check_plants: u32,
    /// Measures virtual beans instead of tracks: six, tipped in the dark.
    pub demo: bool,
    /// Seed of the virtual plants and of permutations.
    pub seed: u64,
    /// Folder for the report, its tables and figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
    /// Whether results that are there are replaced.
    pub replace: bool,
}

impl Default for MeasurePlan {
    fn default() -> Self {
        Self {
            tracks: Vec::new(),
            groups: Vec::new(),
            tilt_deg: None,
            lamps: false,
            light: None,
            radius_cm: None,
            law: Law::default(),
            hours: None,
            check_plants: 30,
            demo: false,
            seed: 1,
            out: None,
            replace: false,
        }
    }
}

/// Plants that belong together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlantGroup {
    /// Name, such as a genotype.
    pub name: String,
    /// Track files and folders.
    pub tracks: Vec<PathBuf>,
}

/// The constants of plants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasureResults {
    /// Whether the plants are virtual.
    pub is_virtual: bool,
    /// The equation that the numbers are of.
    pub equation: &'static str,
    /// The plants, group by group.
    pub plants: Vec<PlantConstants>,
    /// The groups; one without a name for plants without a group.
    pub groups: Vec<GroupConstants>,
    /// Each pair of groups, each constant.
    pub comparisons: Vec<GroupComparison>,
    /// What the same experiment recovers of virtual plants with these constants.
    pub self_check: Vec<Recovery>,
    /// What changes of the experiment would do to the intervals, on such virtual plants.
    pub sharpenings: Vec<Sharpening>,
    /// Tracks that could not be measured, and why.
    pub left_out: Vec<String>,
}

/// The constants of one plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlantConstants {
    /// Name: the file without its extension.
    pub name: String,
    /// Group; empty without one.
    pub group: String,
    /// Frames, and those left out.
    pub frames: FrameCounts,
    /// Length of the record, in h.
    pub duration_h: f64,
    /// Twice the logarithm of the ratio of likelihoods with and without a response.
    /// `None` where only angles are known.
    pub response: Option<f64>,
    /// Whether the record shows a response.
    pub responds: bool,
    /// Noise of the points across the stem, in cm.
    pub noise_cm: Option<f64>,
    /// Root mean square distance of the stems from the rod, across: with and without the plant's own forcing, in cm.
    pub rms_cm: Option<[f64; 2]>,
    /// The constants.
    pub estimates: Vec<Estimate>,
}

/// The constants of a group.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupConstants {
    /// Name; empty for plants without a group.
    pub name: String,
    /// Number of plants.
    pub plants: usize,
    /// Means with t intervals over plants.
    pub estimates: Vec<Estimate>,
}

/// A constant of two groups compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupComparison {
    /// Symbol.
    pub symbol: String,
    /// Names of the groups.
    pub groups: [String; 2],
    /// Numbers of plants of which it is measured.
    pub plants: [usize; 2],
    /// Geometric mean of the first over that of the second; `None` where a value is not positive.
    pub ratio: Option<f64>,
    /// The permutation test: of the means of logarithms where there is a ratio, else of the means.
    pub test: Comparison,
}

/// A value with its interval and unit as text, or what can be said instead.
#[must_use]
pub fn estimate_text(estimate: &Estimate) -> String {
    page::with_unit(estimate, Quantity::of(&estimate.symbol).unit)
}

/// The equation of the fit, as reports print it.
pub const EQUATION: &str = "D kappa/Dt = z(a) (-beta sin A - gamma kappa + nu m cos A + f(t)), z = (1 - exp(-a/D))/(1 + exp((a - Lgz)/W))/n, \
                            n the mean of 1 - exp(-a/D) over Lgz; stretch does not change kappa";

/// A plant on its way through the workflow.
struct Plant {
    name: String,
    group: String,
    is_virtual: bool,
    data: Data,
}

/// What is known of a plant.
enum Data {
    /// Its stems over time.
    Stems(StemRecord),
    /// Angles alone.
    Angles(AngleRecord),
}

/// A plant with stems, measured.
struct MeasuredStems<'a> {
    name: &'a str,
    record: &'a StemRecord,
    measurement: Measurement,
}

impl Workflow for MeasurePlan {
    type Results = MeasureResults;

    const SCHEMA: &'static str = "tropism.measure/1";

    fn check(&self) -> Result<(), Error> {
        let has_tracks = !self.tracks.is_empty() || !self.groups.is_empty();
        if has_tracks == self.demo {
            return Err(Error::Plan("name tracks or groups of tracks, or ask for `demo`".to_owned()));
        }
        if let Some(tilt) = self.tilt_deg.filter(|tilt| !(1.0..=180.0).contains(tilt)) {
            return Err(Error::Plan(format!("found `tilt_deg` {tilt}, wanted 1 to 180 degrees")));
        }
        if self.tilt_deg.is_some() && (self.lamps || self.light.is_some()) {
            return Err(Error::Plan(
                "`tilt_deg` and lamps cannot be measured together: tip the pots in the dark or in light from above".to_owned(),
            ));
        }
        if let Some(radius) = self.radius_cm.filter(|radius| !(0.001..=10.0).contains(radius)) {
            return Err(Error::Plan(format!("found `radius_cm` {radius}, wanted 0.001 to 10 cm")));
        }
        if let Some(hours) = self.hours.filter(|hours| !(0.01..=10_000.0).contains(hours)) {
            return Err(Error::Plan(format!("found `hours` {hours}, wanted 0.01 to 10000 h")));
        }
        if u64::from(self.check_plants) > MAX_CHECK_PLANTS {
            return Err(Error::Plan(format!(
                "found `check_plants` {}, wanted 0 to {MAX_CHECK_PLANTS}",
                self.check_plants
            )));
        }
        for (number, group) in self.groups.iter().enumerate() {
            if group.name.is_empty() || self.groups[..number].iter().any(|other| other.name == group.name) {
                return Err(Error::Plan(format!(
                    "two groups have the name {:?}: give each its own",
                    group.name
                )));
            }
        }
        let inputs: Vec<PathBuf> =
            self.tracks.iter().chain(self.groups.iter().flat_map(|group| &group.tracks)).cloned().collect();
        files::check_outputs(&self.outputs(), &inputs)?;
        self.outputs().iter().try_for_each(|output| files::check_free(output, self.replace))
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<MeasureResults, Error> {
        let (plants, left_out) = if self.demo { demo::plants(self.seed) } else { self.plants()? };
        if plants.is_empty() {
            return Err(Error::Failed(format!("no track could be measured: {}", left_out.join("; "))));
        }
        let options = Options { law: self.law, stimulus: self.stimulus(), radius_cm: self.radius_cm };
        monitor.stage("measure", plants.len() as u64);
        let measured: Vec<(PlantConstants, Option<MeasuredStems>)> =
            parallel::try_map(plants.len(), |number| {
                if !monitor.may_go_on() {
                    return Err(Error::cancelled());
                }
                let measured = self.measure(&plants[number], &options);
                monitor.advance(1);
                Ok(measured)
            })?;
        let (mut constants, stems): (Vec<PlantConstants>, Vec<Option<MeasuredStems>>) =
            measured.into_iter().unzip();
        let stems: Vec<MeasuredStems> = stems.into_iter().flatten().collect();
        let (self_check, sharpenings) = self.check_itself(&stems, &options, monitor)?;
        for estimate in constants.iter_mut().flat_map(|plant| &mut plant.estimates) {
            if let Some(found) = self_check.iter().find(|found| found.symbol == estimate.symbol) {
                *estimate = estimate.clone().widened(found.widening);
            }
        }
        let groups = groups(&constants);
        let results = MeasureResults {
            is_virtual: plants.iter().any(|plant| plant.is_virtual),
            equation: EQUATION,
            comparisons: comparisons(&constants, &groups, self.seed),
            groups,
            plants: constants,
            self_check,
            sharpenings,
            left_out,
        };
        if let Some(out) = &self.out {
            self.write(out, &stems, &results)?;
        }
        Ok(results)
    }
}

impl MeasurePlan {
    /// What the plants respond to.
    fn stimulus(&self) -> Stimulus {
        match self.tilt_deg {
            _ if self.demo => Stimulus::Tilt(demo::TILT_DEG),
            Some(tilt) => Stimulus::Tilt(tilt),
            None if self.lamps || self.light.is_some() => Stimulus::Lamps,
            None => Stimulus::None,
        }
    }

    /// The constants of one plant.
    fn measure<'a>(
        &self,
        plant: &'a Plant,
        options: &Options,
    ) -> (PlantConstants, Option<MeasuredStems<'a>>) {
        let (name, group) = (plant.name.clone(), plant.group.clone());
        match &plant.data {
            Data::Stems(record) => {
                let measurement = measure(record, options);
                let constants = PlantConstants {
                    name,
                    group,
                    frames: record.quality,
                    duration_h: record.duration_h(),
                    response: Some(measurement.response),
                    responds: measurement.responds,
                    noise_cm: Some(measurement.noise_cm),
                    rms_cm: Some(measurement.rms_cm),
                    estimates: measurement.estimates.clone(),
                };
                (constants, Some(MeasuredStems { name: &plant.name, record, measurement }))
            }
            Data::Angles(record) => {
                let estimates = record.estimates();
                let used = record.times_h.len();
                let has_turned =
                    |estimate: &Estimate| estimate.symbol == "lag" && estimate.status.has_value();
                let constants = PlantConstants {
                    name,
                    group,
                    frames: FrameCounts { all: used, used, ..FrameCounts::default() },
                    duration_h: record.times_h.last().copied().unwrap_or(0.0),
                    response: None,
                    responds: estimates.iter().any(has_turned),
                    noise_cm: None,
                    rms_cm: None,
                    estimates,
                };
                (constants, None)
            }
        }
    }

    /// The plants of the tracks, and why others are left out.
    fn plants(&self) -> Result<(Vec<Plant>, Vec<String>), Error> {
        let (mut plants, mut left_out) = (Vec::new(), Vec::new());
        let light = self.light.as_deref().map(LightRecord::read).transpose()?;
        let alone = PlantGroup { name: String::new(), tracks: self.tracks.clone() };
        for group in [&alone].into_iter().chain(&self.groups) {
            for path in files::track_files(&group.tracks)? {
                let plant = |is_virtual, data| Plant {
                    name: files_of::name_of(&path),
                    group: group.name.clone(),
                    is_virtual,
                    data,
                };
                if let Some(record) = angle_file::read(&path)? {
                    let record = self.hours.map_or(record.clone(), |hours| record.until(hours));
                    plants.push(plant(false, Data::Angles(record)));
                    continue;
                }
                let mut track = files::read_track(&path)?;
                if let (Some(hours), Some(first)) = (self.hours, track.samples.first()) {
                    let end = first.time_s + hours * 3600.0 + 1e-6;
                    track.samples.retain(|sample| sample.time_s <= end);
                }
                if let Some(light) = &light {
                    light.light(&mut track);
                }
                let is_virtual = track.samples.iter().any(|sample| sample.quality == Quality::Simulated);
                match StemRecord::of(&track) {
                    Ok(record) => plants.push(plant(is_virtual, Data::Stems(record))),
                    Err(error) => left_out.push(format!("{}: {error}", path.display())),
                }
            }
        }
        Ok((plants, left_out))
    }

    /// What the same experiment recovers of virtual plants. Without a plant that responds there is nothing to recover.
    fn check_itself(
        &self,
        plants: &[MeasuredStems],
        options: &Options,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<Recovery>, Vec<Sharpening>), Error> {
        let responding: Vec<_> = plants
            .iter()
            .filter(|plant| plant.measurement.responds)
            .map(|plant| (plant.record.clone(), *options, plant.measurement.clone()))
            .collect();
        if self.check_plants == 0 || responding.is_empty() {
            return Ok((Vec::new(), Vec::new()));
        }
        monitor.stage("self-check", 2);
        if !monitor.may_go_on() {
            return Err(Error::cancelled());
        }
        let recovered = self_check(&responding, self.check_plants as usize, self.seed);
        monitor.advance(1);
        if !monitor.may_go_on() {
            return Err(Error::cancelled());
        }
        let sharpenings = sharpenings(&responding, self.seed);
        monitor.advance(1);
        Ok((recovered, sharpenings))
    }
}

/// The groups in the order of the plants.
fn groups(plants: &[PlantConstants]) -> Vec<GroupConstants> {
    let mut names: Vec<&String> = plants.iter().map(|plant| &plant.group).collect();
    names.dedup();
    let of_name = |name: &String| {
        let members: Vec<&PlantConstants> = plants.iter().filter(|plant| plant.group == *name).collect();
        let mean = |symbol: &str| {
            let mean = group::mean_of(symbol, &values_of(&members, symbol));
            carried_over(mean, &members)
        };
        let has = |symbol: &str| {
            members.iter().any(|plant| plant.estimates.iter().any(|estimate| estimate.symbol == symbol))
        };
        let symbols = QUANTITIES.iter().map(|quantity| quantity.symbol).filter(|symbol| has(symbol));
        GroupConstants { name: name.clone(), plants: members.len(), estimates: symbols.map(mean).collect() }
    };
    names.into_iter().map(of_name).collect()
}

/// The mean of a group whose members' numbers are mostly provisional is provisional for the same reason.
fn carried_over(mean: Estimate, members: &[&PlantConstants]) -> Estimate {
    let of_members = members.iter().flat_map(|plant| &plant.estimates);
    let used: Vec<&Estimate> =
        of_members.filter(|estimate| estimate.symbol == mean.symbol && is_used(estimate)).collect();
    let provisional: Vec<&&Estimate> =
        used.iter().filter(|estimate| estimate.status == Status::Provisional).collect();
    match provisional.first() {
        Some(first) if mean.status == Status::Measured && 2 * provisional.len() > used.len() => {
            let reason = format!("{} of {} plants: {}", provisional.len(), used.len(), first.reason);
            Estimate { status: Status::Provisional, reason, ..mean }
        }
        _ => mean,
    }
}

/// The values of a constant that are identified.
fn values_of(plants: &[&PlantConstants], symbol: &str) -> Vec<f64> {
    let all = plants.iter().flat_map(|plant| &plant.estimates);
    all.filter(|estimate| estimate.symbol == symbol && is_used(estimate))
        .map(|estimate| estimate.value)
        .collect()
}

/// Whether a group uses a plant's number.
const fn is_used(estimate: &Estimate) -> bool {
    matches!(estimate.status, Status::Measured | Status::Provisional)
}

fn comparisons(plants: &[PlantConstants], groups: &[GroupConstants], seed: u64) -> Vec<GroupComparison> {
    let mut found = Vec::new();
    for (number, one) in groups.iter().enumerate() {
        for other in &groups[number + 1..] {
            for quantity in QUANTITIES {
                let values = |name: &String| -> Vec<f64> {
                    let members: Vec<&PlantConstants> =
                        plants.iter().filter(|plant| plant.group == *name).collect();
                    values_of(&members, quantity.symbol)
                };
                let (mut first, mut second) = (values(&one.name), values(&other.name));
                let is_positive = first.iter().chain(&second).all(|value| *value > 0.0);
                if is_positive {
                    first.iter_mut().chain(&mut second).for_each(|value| *value = tropism::math::ln(*value));
                }
                if first.len().min(second.len()) < group::MIN_PLANTS {
                    continue;
                }
                found.extend(group::compared(&first, &second, seed).map(|test| GroupComparison {
                    symbol: quantity.symbol.to_owned(),
                    groups: [one.name.clone(), other.name.clone()],
                    plants: [first.len(), second.len()],
                    ratio: is_positive.then(|| group::ratio(test.difference)),
                    test,
                }));
            }
        }
    }
    found
}
