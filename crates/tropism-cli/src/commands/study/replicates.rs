//! The comparison of methods as text.

use std::fmt::Write;
use std::path::Path;

use tropism_lab::replicates::{MeanAndInterval, Measures, MethodResults, ReplicatesResults, ScenarioResults};
use tropism_lab::units::plural;

pub(super) fn text(results: &ReplicatesResults, out: &Path) -> String {
    let mut text = match results.replicates {
        0 => "virtual plants: rules by hand alone, without open-loop experiments, models or search\n"
            .to_owned(),
        count => format!("virtual plants: {}\n", plural(count, "replicate")),
    };
    results.scenarios.iter().for_each(|scenario| add_scenario(&mut text, scenario));
    let _ = write!(
        text,
        "\nwrote {out}/replicates.json; reports: {out}/*/judged/report.html",
        out = out.display()
    );
    text
}

fn add_scenario(text: &mut String, scenario: &ScenarioResults) {
    let best =
        scenario.best_possible.map_or_else(String::new, |best| format!(", fitness of at most {best:.2}"));
    let ScenarioResults { name, species, variation, task, test_plants, photographs, .. } = scenario;
    let plants = plural(*test_plants, "unseen plant");
    let tips = if *photographs { "through photographs" } else { "true tips with the detector's noise" };
    let _ = writeln!(text, "\n{name}: {task} ({species}, variation {variation}, {plants}, {tips}{best})");
    let names = scenario.methods.iter().map(|method| method.name.chars().count());
    // As wide as the longest of our own names at least.
    let width = names.fold("reference".len(), usize::max);
    let columns = Columns::of(&scenario.greedy.measures, width);
    let has_targets = !scenario.greedy.target_medians_cm.is_empty();
    columns.add_head(text, "mean and interval", if has_targets { "median at each (cm)" } else { "" });
    let baselines = [("constant", Some(&scenario.constant)), ("greedy", Some(&scenario.greedy))];
    for (name, one) in baselines.into_iter().chain([("reference", scenario.reference.as_ref())]) {
        let Some(one) = one else { continue };
        columns.add(text, name, &one.measures, false, &at_targets(&one.target_medians_cm));
        if let Some(seen) = &one.by_photographs {
            let share =
                seen.done.map_or_else(String::new, |done| format!(", all done {:.0} %", 100.0 * done.share));
            let _ = writeln!(
                text,
                "  {:<width$}  true stems; the photographs alone say {:.2} turns{share}",
                "", seen.mean
            );
        }
    }
    for method in &scenario.methods {
        columns.add(text, &method.name, &method.measures, false, &at_targets(&method.target_medians_cm));
    }
    let first = scenario.methods.first().map_or("", |first| first.name.as_str());
    let over = |other: &str, measures: fn(&MethodResults) -> Option<Measures>| {
        let methods = scenario.methods.iter().filter_map(|method| Some((&method.name, measures(method)?)));
        let rows: Vec<(&String, Measures)> = methods.collect();
        let mut text = String::new();
        if !rows.is_empty() {
            columns.add_head(&mut text, &format!("over {other}, paired"), "");
        }
        rows.iter().for_each(|(name, measures)| columns.add(&mut text, name, measures, true, ""));
        text
    };
    *text += &over("greedy", |method| Some(method.over_greedy));
    *text += &over("the reference controller", |method| method.over_reference);
    *text += &over(first, |method| method.over_first);
    for method in &scenario.methods {
        let prediction = match (method.over_expected, method.worst_prediction) {
            (Some(mean), Some(worst)) => {
                format!("fitness {mean:+.2} over what the replicates predicted, at worst {worst:.2}; ")
            }
            _ => String::new(),
        };
        let _ =
            writeln!(text, "  {:<width$}  {prediction}{:.0} s a replicate", method.name, method.cpu_seconds);
    }
}

/// `0.28, 0.42, 0.59`: medians at the targets, in cm.
fn at_targets(medians_cm: &[Option<f64>]) -> String {
    let median = |median: &Option<f64>| median.map_or_else(|| "-".to_owned(), |cm| format!("{cm:.2}"));
    let medians: Vec<String> = medians_cm.iter().map(median).collect();
    medians.join(", ")
}

/// The columns of a table.
struct Columns {
    /// Which measures it has: those of the task.
    is_shown: [bool; 5],
    /// Characters of a name.
    width: usize,
}

impl Columns {
    fn of(measures: &Measures, width: usize) -> Self {
        let own = all(measures).map(|one| one.is_some());
        // The score of targets is a reading of eq. (9), or follows from the distances.
        Self { is_shown: [measures.to_the_letter.is_none(), own[1], own[2], own[3], own[4]], width }
    }

    fn shown<'a, T>(&'a self, cells: impl IntoIterator<Item = T> + 'a) -> impl Iterator<Item = T> + 'a {
        cells.into_iter().zip(self.is_shown).filter_map(|(cell, is_shown)| is_shown.then_some(cell))
    }

    fn add_head(&self, text: &mut String, what: &str, more: &str) {
        let names = ["fitness", "eq. (9), letter", "eq. (9), approach", "distances (cm)", "whole task (%)"];
        let cells: Vec<String> = self.shown(names).map(|name| format!("{name:<23}")).collect();
        let head = format!("  {what}\n  {:<width$}  {}{more}", "", cells.concat(), width = self.width);
        let _ = writeln!(text, "{}", head.trim_end());
    }

    fn add(&self, text: &mut String, name: &str, measures: &Measures, is_signed: bool, more: &str) {
        let share = |MeanAndInterval { mean, interval }| MeanAndInterval {
            mean: 100.0 * mean,
            interval: interval.map(|end: f64| 100.0 * end),
        };
        let [fitness, letter, approach, distances, done] = all(measures);
        let cell = |digits: usize| {
            move |MeanAndInterval { mean, interval: [low, high] }| {
                if is_signed {
                    format!("{mean:+.digits$} ({low:+.digits$} to {high:+.digits$})")
                } else {
                    format!("{mean:.digits$} ({low:.digits$} to {high:.digits$})")
                }
            }
        };
        let cells = [fitness, letter, approach, distances].map(|one| one.map(cell(2)));
        let cells = cells.into_iter().chain([done.map(share).map(cell(0))]);
        let cells: Vec<String> =
            self.shown(cells).map(|cell| format!("{:<23}", cell.unwrap_or_default())).collect();
        let row = format!("  {name:<width$}  {}{more}", cells.concat(), width = self.width);
        let _ = writeln!(text, "{}", row.trim_end());
    }
}

fn all(measures: &Measures) -> [Option<MeanAndInterval>; 5] {
    let Measures { fitness, to_the_letter, by_approach, distances, done } = *measures;
    [Some(fitness), to_the_letter, by_approach, distances, done]
}
