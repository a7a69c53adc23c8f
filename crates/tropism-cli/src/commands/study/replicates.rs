//! The comparison of methods as text.

use std::fmt::Write;
use std::path::Path;

use tropism_lab::replicates::{
    BaselineResults, MeanAndInterval, MethodResults, ReplicatesResults, ScenarioResults,
};
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
    let first = match &scenario.methods[..] {
        [first, _, ..] => format!("over {}", first.name),
        _ => String::new(),
    };
    let _ = writeln!(
        text,
        "  {:<12} {:<22} {:<24} {:<24} {first:<24} {:>9}  {:<19} s a replicate",
        "",
        "mean and interval",
        "over greedy",
        "over the reference controller",
        if scenario.greedy.done.is_some() { "all done" } else { "under 6" },
        "prediction off by"
    );
    add_baseline(text, "constant", &scenario.constant);
    add_baseline(text, "greedy", &scenario.greedy);
    if let Some(reference) = &scenario.reference {
        add_baseline(text, "reference", reference);
    }
    scenario.methods.iter().for_each(|method| add_method(text, method));
}

fn add_baseline(text: &mut String, name: &str, one: &BaselineResults) {
    let share = 100.0 * one.done.map_or(one.under_6, |done| done.share);
    let _ = writeln!(text, "  {name:<12} {:<22} {:<74} {share:>7.0} %", of(&one.fitness), "");
    if let Some(seen) = &one.by_photographs {
        let share =
            seen.done.map_or_else(String::new, |done| format!(", all done {:.0} %", 100.0 * done.share));
        let _ = writeln!(
            text,
            "  {:<12} true stems; the photographs alone say {:.2} turns{share}",
            "", seen.mean
        );
    }
}

fn add_method(text: &mut String, method: &MethodResults) {
    let prediction = match (method.over_expected, method.worst_prediction) {
        (Some(mean), Some(worst)) => format!("{mean:+.2}, at worst {worst:.2}"),
        _ => "-".to_owned(),
    };
    let _ = writeln!(
        text,
        "  {:<12} {:<22} {:<24} {:<24} {:<24} {:>7.0} %  {prediction:<19} {:.0}",
        method.name,
        of(&method.fitness),
        signed(&method.over_greedy),
        method.over_reference.as_ref().map_or_else(String::new, signed),
        method.over_first.as_ref().map_or_else(String::new, signed),
        100.0 * method.done.unwrap_or(method.under_6),
        method.cpu_seconds,
    );
}

fn of(MeanAndInterval { mean, interval: [low, high] }: &MeanAndInterval) -> String {
    format!("{mean:>5.2}  {low:>5.2} to {high:>5.2}")
}

fn signed(MeanAndInterval { mean, interval: [low, high] }: &MeanAndInterval) -> String {
    format!("{mean:+.2}  {low:+.2} to {high:+.2}")
}
