//! The files of a measurement: tables, kymographs and the page.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use tropism::measure::Quantity;
use tropism::text::csv_cell;

use super::page::page;
use super::species_file::species_file;
use super::{MeasurePlan, MeasureResults, MeasuredStems};
use crate::{Error, files};

/// Names of the files in the folder of a measurement.
const REPORT: &str = "report.html";
const TABLE: &str = "constants.csv";
const RESULTS: &str = "constants.json";
const KYMOGRAPHS: &str = "kymograph.csv";
/// Only where constants of a bean were measured, of one group.
const SPECIES: &str = "species.toml";

impl MeasurePlan {
    /// The files that are written.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        self.out
            .iter()
            .flat_map(|out| [REPORT, TABLE, RESULTS, KYMOGRAPHS, SPECIES].map(|name| out.join(name)))
            .collect()
    }

    pub(super) fn write(
        &self,
        out: &Path,
        plants: &[MeasuredStems],
        results: &MeasureResults,
    ) -> Result<(), Error> {
        files::make_folder(out)?;
        files::write_json(&out.join(RESULTS), results)?;
        files::write(&out.join(TABLE), table(results).as_bytes())?;
        files::write(&out.join(KYMOGRAPHS), kymographs(plants).as_bytes())?;
        if let Some(species) = species_file(&out.join(SPECIES), results)? {
            files::write(&out.join(SPECIES), species.as_bytes())?;
        }
        let page = page(self, plants, results)?;
        files::write(&out.join(REPORT), page.html().as_bytes())?;
        for (name, bytes) in tropism_report::files(&page.figures) {
            files::write(&out.join(name), &bytes)?;
        }
        Ok(())
    }
}

/// The name of a plant: that of its track, or of the folder of a run.
pub(super) fn name_of(path: &Path) -> String {
    let stem = |path: &Path| path.file_stem().map_or_else(String::new, files::name_text);
    let name = stem(path);
    let folder = path.parent().map(stem).filter(|folder| name == "track" && !folder.is_empty());
    folder.unwrap_or(name)
}

/// One row a constant of a plant, and of a group.
fn table(results: &MeasureResults) -> String {
    let mut text = "plant,group,symbol,value,low_90,high_90,unit,status,reason\n".to_owned();
    let number = |value: f64| if value.is_nan() { String::new() } else { format!("{value:.6}") };
    let plants =
        results.plants.iter().map(|plant| (plant.name.as_str(), plant.group.as_str(), &plant.estimates));
    let groups = results.groups.iter().map(|group| ("(mean)", group.name.as_str(), &group.estimates));
    for (plant, group, estimates) in plants.chain(groups) {
        for estimate in estimates {
            let unit = Quantity::of(&estimate.symbol).unit;
            let [low, high] = estimate.interval.map(number);
            let value = if estimate.status.has_value() { number(estimate.value) } else { String::new() };
            let [low, high] =
                if estimate.status.has_value() { [low, high] } else { [String::new(), String::new()] };
            let _ = writeln!(
                text,
                "{},{},{},{value},{low},{high},{unit},{},{}",
                csv_cell(plant),
                csv_cell(group),
                estimate.symbol,
                estimate.status.name(),
                csv_cell(&format!("\"{}\"", estimate.reason.replace('"', "'")))
            );
        }
    }
    text
}

/// Angle and curvature along each stem over time, measured and fitted without the plant's own forcing.
fn kymographs(plants: &[MeasuredStems]) -> String {
    let mut text =
        "plant,time_h,s_cm,angle_deg,curvature_per_cm,fitted_angle_deg,fitted_curvature_per_cm\n".to_owned();
    for plant in plants {
        let response = &plant.measurement.response_stems;
        let frames = plant.record.times_h.iter().zip(&plant.record.stems).zip(response);
        for ((time, seen), rod) in frames {
            let piece = tropism::geometry::path::length(&seen[..]) / (seen.len() - 1) as f64;
            let angle = |stem: &[tropism::geometry::Point], k: usize| {
                tropism::math::atan2(stem[k + 1].x - stem[k].x, stem[k + 1].y - stem[k].y)
            };
            for k in 0..seen.len() - 2 {
                let both = [&seen[..], &rod[..]].map(|stem| {
                    let (below, above) = (angle(stem, k), angle(stem, k + 1));
                    let turn = above
                        - below
                        - std::f64::consts::TAU * ((above - below) / std::f64::consts::TAU).round();
                    (above.to_degrees(), turn / piece)
                });
                let [(angle, curvature), (fitted, of_fit)] = both;
                let _ = writeln!(
                    text,
                    "{},{time:.4},{:.4},{angle:.3},{curvature:.5},{fitted:.3},{of_fit:.5}",
                    csv_cell(plant.name),
                    (k + 1) as f64 * piece
                );
            }
        }
    }
    text
}
