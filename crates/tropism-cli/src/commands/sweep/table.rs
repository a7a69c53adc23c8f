//! The results of a sweep as text.

use std::fmt::Write;
use std::path::Path;

use tropism::math::rank_test;
use tropism_lab::comparison::{SIGNIFICANT, p_text};
use tropism_lab::files::shell_word;
use tropism_lab::sweep::{SettingPair, SweepResults, SweepRow};
use tropism_lab::units::plural;

use crate::python::is_address;

/// Most pairs that are printed; all stand in `sweep.json`. Chosen: eight settings make as many.
const MOST_PAIRS: usize = 28;

pub(super) fn sweep(results: &SweepResults, out: &Path) -> String {
    let kind = if results.is_virtual { "virtual plants or a model of them, " } else { "" };
    let name = |row: &SweepRow| named(&row.case, &row.setting);
    let longest = results.rows.iter().map(|row| name(row).chars().count()).max().unwrap_or(0).max(7);
    // Replicates know distances at targets, evolutions their generations.
    let has_methods = results.rows.iter().any(|row| !row.case.is_empty());
    let mut text = format!(
        "{kind}fitness in cm (of tasks with a pole in turns); {}\n{:<longest$}  values   mean     sd  quartile  median  quartile  {}  s a seed\n",
        plural(results.seeds.len(), "seed"),
        "setting",
        if has_methods { "distances  whole task" } else { "in model  saturates  evaluations" },
    );
    for row in &results.rows {
        let [_, low, median, high, _] = row.five_numbers;
        let further = if has_methods {
            let done = row.done.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
            format!("{:>9}  {done:>10}", or_dash(row.distances, 2))
        } else {
            format!(
                "{:>8}  {:>9}  {:>11}",
                or_dash(row.mean_in_model, 2),
                or_dash(row.saturation_generation, 0),
                or_dash(row.evaluations, 0)
            )
        };
        let _ = writeln!(
            text,
            "{:<longest$}  {:>6}  {:>5.2}  {:>5.2}  {low:>8.2}  {median:>6.2}  {high:>8.2}  {further}  {:>8}",
            name(row),
            row.runs,
            row.mean,
            row.sd,
            or_dash(row.cpu_seconds, 1),
        );
    }
    text += &differences(&results.pairs);
    let folder = out.display();
    let _ = write!(text, "wrote {folder}/sweep.csv, {folder}/sweep.json");
    // Reports read folders alone.
    if !is_address(out) {
        let _ =
            write!(text, "\nnext: tropism report {} --out report.html --figures figures", shell_word(out));
    }
    text
}

/// Which settings differ, and how many pairs show no difference.
fn differences(pairs: &[SettingPair]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let what = if pairs[0].case.is_empty() { "champions in the model" } else { "fitness of each seed" };
    // Holm's correction is over the pairs of one case.
    let of_case = pairs.iter().filter(|pair| pair.case == pairs[0].case).count();
    let least = rank_test::least_size(of_case, SIGNIFICANT);
    let most = pairs.iter().map(|pair| pair.pair.sizes[0].min(pair.pair.sizes[1])).max().unwrap_or(0);
    if most < least {
        return format!(
            "pairs that differ: none can: a rank test of {} needs {least} values of each setting, and there are {most}\n",
            plural(of_case, "pair")
        );
    }
    let different: Vec<&SettingPair> = pairs.iter().filter(|pair| pair.pair.is_different()).collect();
    let mut text = format!(
        "pairs that differ: {} of {} ({what}: Mann-Whitney U test, p < 0.05 after Holm's correction)\n",
        different.len(),
        pairs.len()
    );
    for SettingPair { case, pair } in different.iter().take(MOST_PAIRS) {
        let word = if pair.superiority > 0.5 { "over" } else { "under" };
        let _ = writeln!(
            text,
            "  {} {word} {}: {:+.2} between medians, p {}, A {:.2}",
            named(case, &pair.one),
            pair.other,
            pair.median_difference,
            p_text(pair.p_holm),
            pair.superiority
        );
    }
    if different.len() > MOST_PAIRS {
        text += "  and more in sweep.json\n";
    }
    text
}

fn named(case: &str, setting: &str) -> String {
    if case.is_empty() { setting.to_owned() } else { format!("{case}: {setting}") }
}

fn or_dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}
