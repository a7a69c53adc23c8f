//! `tropism measure`: the constants of plants.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use tropism::measure::{Estimate, Law, Quantity};
use tropism_lab::measure::{MeasurePlan, MeasureResults, PlantConstants, PlantGroup, estimate_text};
use tropism_lab::units::plural;

use crate::options::SeedOption;
use crate::progress::{check_outputs, execute_and_print};
use crate::shell::Shell;

/// Measure growth, bending zone, tropisms and circumnutation of plants from their stems over time
#[derive(Args)]
#[command(
    disable_help_flag = true,
    // Without empty lines between the options.
    arg = clap::Arg::new("help").short('h').long("help").action(clap::ArgAction::HelpShort).help("Print help"),
    before_help = "Example: tropism measure --demo --out measure    (six virtual beans, tipped in the dark)",
    after_help = "Each constant has a 90 % interval, or the reason why these data cannot say it. For gravity tip the\n\
                  pots by 45 degrees or more at the first frame, in the dark or in light from above.\n\n\
                  Examples:\n  \
                  tropism measure track.csv --tilt 60 --out measure\n  \
                  tropism measure --group wt='wt/*.csv' --group mutant='mutant/*.csv' --tilt 90 --out measure\n  \
                  tropism grow --bean measure/species.toml --out beans    virtual plants with what was measured"
)]
pub(crate) struct Measure {
    /// Tracks with stems (of `tropism track`), folders of them, and files of angles (time_h,tip_angle_deg,...)
    #[arg(value_name = "TRACK.csv|DIR", required_unless_present_any = ["demo", "groups"], conflicts_with = "demo")]
    tracks: Vec<PathBuf>,

    /// Tracks of a group, such as a genotype: a file, a folder, or file names with * in quotation marks
    #[arg(long = "group", value_name = "NAME=TRACKS", value_parser = parse_group, conflicts_with = "demo")]
    groups: Vec<(String, PathBuf)>,

    /// Angle by which the pots were tipped at the first frame, in degrees
    #[arg(long, value_name = "DEG", conflicts_with = "lamps")]
    tilt: Option<f64>,

    /// The plants respond to the lamps of their tracks
    #[arg(long)]
    lamps: bool,

    /// The plants respond to the lamps of this table: time_h,light, hours from the first photograph on
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["tilt", "lamps", "demo"])]
    light: Option<PathBuf>,

    /// Radius of the stems in the zone that bends, in cm: gives beta~
    #[arg(long, value_name = "CM")]
    radius: Option<f64>,

    /// Elongation: ace carries curvature with the tissue of the zone, ac elongates at the apex only
    #[arg(long, value_name = "ac|ace", default_value = "ace", value_parser = parse_law)]
    law: Law,

    /// Hours of each record that are measured; all by default
    #[arg(long, value_name = "H")]
    hours: Option<f64>,

    /// Virtual plants with the constants found, measured again; 0 for none
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(0..=1000))]
    check_plants: u32,

    /// Measure six virtual beans, tipped in the dark
    #[arg(long)]
    demo: bool,

    /// Folder for report.html, constants.csv, constants.json, kymograph.csv, species.toml and the figures
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Replace existing results
    #[arg(long, requires = "out")]
    force: bool,

    #[command(flatten)]
    seed: SeedOption,
}

fn parse_law(text: &str) -> Result<Law, String> {
    match text {
        "ac" => Ok(Law::Ac),
        "ace" => Ok(Law::Ace),
        _ => Err("wanted ac or ace".to_owned()),
    }
}

fn parse_group(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, tracks)) if !name.trim().is_empty() && !tracks.is_empty() => {
            Ok((name.trim().to_owned(), tracks.into()))
        }
        _ => Err("wanted a name and tracks, such as wt='wt/*.csv'".to_owned()),
    }
}

/// The files that a path names: with * in its last part those of the folder that match, else itself.
fn matching(path: &Path) -> Result<Vec<PathBuf>> {
    let pattern = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    if path.exists() || !pattern.contains('*') {
        return Ok(vec![path.to_owned()]);
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries =
        std::fs::read_dir(folder).map_err(|error| anyhow::anyhow!("{}: {error}", folder.display()))?;
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.file_name().is_some_and(|name| is_match(&pattern, &name.to_string_lossy())))
        .collect();
    found.sort_by_cached_key(|path| tropism::photo::natural_order(&path.to_string_lossy()));
    anyhow::ensure!(!found.is_empty(), "{}: no file matches", path.display());
    Ok(found)
}

/// Whether `name` matches a pattern in which * stands for any letters.
fn is_match(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((start, rest)) => name.strip_prefix(start).is_some_and(|name| {
            name.char_indices().map(|(at, _)| at).chain([name.len()]).any(|at| is_match(rest, &name[at..]))
        }),
    }
}

impl Measure {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut groups: Vec<PlantGroup> = Vec::new();
        for (name, tracks) in &self.groups {
            let tracks = matching(tracks)?;
            match groups.iter_mut().find(|group| group.name == *name) {
                Some(group) => group.tracks.extend(tracks),
                None => groups.push(PlantGroup { name: name.clone(), tracks }),
            }
        }
        let plan = MeasurePlan {
            tracks: self.tracks,
            groups,
            tilt_deg: self.tilt,
            lamps: self.lamps,
            light: self.light,
            radius_cm: self.radius,
            law: self.law,
            hours: self.hours,
            check_plants: self.check_plants,
            demo: self.demo,
            seed: self.seed.seed,
            out: self.out,
            replace: self.force,
        };
        check_outputs(&plan.outputs(), [])?;
        execute_and_print(&plan, shell, |results| text(&plan, results))
    }
}

/// Plants that are printed one by one.
const MAX_PRINTED: usize = 12;

fn text(plan: &MeasurePlan, results: &MeasureResults) -> String {
    let mut text = String::new();
    if results.is_virtual {
        text += "The plants are virtual.\n";
    }
    for plant in results.plants.iter().take(MAX_PRINTED) {
        text += &text_of_plant(plant);
    }
    if results.plants.len() > MAX_PRINTED {
        text += &format!("and {} more\n", results.plants.len() - MAX_PRINTED);
    }
    for group in results.groups.iter().filter(|group| group.plants > 1) {
        let name = if group.name.is_empty() { "all plants" } else { &group.name };
        text += &format!(
            "{name}: mean of {} with its 90 % interval over plants\n",
            plural(group.plants, "plant")
        );
        for estimate in &group.estimates {
            text += &line(estimate);
        }
    }
    for comparison in &results.comparisons {
        let [one, other] = &comparison.groups;
        let by = match comparison.ratio {
            Some(ratio) => format!("ratio {ratio:.2}"),
            None => format!("difference {:.2}", comparison.test.difference),
        };
        text += &format!(
            "{:<8}{one} / {other}: {by}, probability above {:.2}, p {:.5} by permutation\n",
            comparison.symbol, comparison.test.auc, comparison.test.p
        );
    }
    if let Some(first) = results.self_check.first() {
        text += &format!(
            "the same experiment on {} with these constants:\n",
            plural(first.plants, "virtual plant")
        );
        for recovery in results.self_check.iter().filter(|recovery| recovery.measured > 0) {
            text += &format!(
                "  {:<8}measured of {}, recovered / true {:.2} \u{b1} {:.2}, intervals that hold it {:.0} %\n",
                recovery.symbol,
                recovery.measured,
                recovery.ratio,
                recovery.spread,
                100.0 * recovery.coverage
            );
        }
    }
    for left_out in &results.left_out {
        text += &format!("left out: {left_out}\n");
    }
    match &plan.out {
        Some(out) => text + &format!("wrote {}", out.display()),
        None => text.trim_end().to_owned(),
    }
}

fn text_of_plant(plant: &PlantConstants) -> String {
    let group = if plant.group.is_empty() { String::new() } else { format!(" ({})", plant.group) };
    let responds = if plant.responds { "responds" } else { "no response" };
    let mut text = format!(
        "{}{group}: {} of {} frames, {:.1} h, {responds}\n",
        plant.name, plant.frames.used, plant.frames.all, plant.duration_h
    );
    for estimate in &plant.estimates {
        text += &line(estimate);
    }
    text
}

fn line(estimate: &Estimate) -> String {
    let because = match estimate.reason.as_str() {
        "" => Quantity::of(&estimate.symbol).words,
        reason => reason,
    };
    format!("  {:<8}{:<38} {because}\n", estimate.symbol, estimate_text(estimate))
}

#[cfg(test)]
mod tests {
    use super::is_match;

    #[test]
    fn a_star_stands_for_any_letters() {
        for (pattern, name, matches) in [
            ("*.csv", "a.csv", true),
            ("wt-*-1.csv", "wt-x-1.csv", true),
            ("*.csv", "a.toml", false),
            ("a*b", "ab", true),
        ] {
            assert_eq!(is_match(pattern, name), matches, "{pattern} {name}");
        }
    }
}
