//! The comparison of recipes as text.

use std::fmt::Write;
use std::path::Path;

use tropism_lab::laboratories::{
    BaselineResults, LaboratoriesResults, MeanAndInterval, RecipeResults, WorldResults,
};
use tropism_lab::units::plural;

pub(super) fn text(results: &LaboratoriesResults, out: &Path) -> String {
    let mut text = match results.laboratories {
        0 => "virtual plants: rules by hand alone, without open-loop experiments, models or search\n"
            .to_owned(),
        count => format!("virtual plants: {}\n", plural(count, "laboratory")),
    };
    results.worlds.iter().for_each(|world| add_world(&mut text, world));
    let _ = write!(
        text,
        "\nwrote {out}/laboratories.json; reports: {out}/*/judged/report.html",
        out = out.display()
    );
    text
}

fn add_world(text: &mut String, world: &WorldResults) {
    let best = world.best_possible.map_or_else(String::new, |best| format!(", fitness of at most {best:.2}"));
    let WorldResults { name, species, scale, task, judging_plants, photographs, .. } = world;
    let plants = plural(*judging_plants, "unseen plant");
    let tips = if *photographs { "through photographs" } else { "true tips with the detector's noise" };
    let _ = writeln!(text, "\n{name}: {task} ({species}, variation {scale}, {plants}, {tips}{best})");
    let first = match &world.recipes[..] {
        [first, _, ..] => format!("over {}", first.name),
        _ => String::new(),
    };
    let _ = writeln!(
        text,
        "  {:<12} {:<22} {:<24} {:<24} {first:<24} {:>9}  {:<19} s a laboratory",
        "",
        "mean and interval",
        "over chase",
        "over the bound",
        if world.chase.done.is_some() { "all done" } else { "under 6" },
        "prediction off by"
    );
    add_baseline(text, "constant", &world.constant);
    add_baseline(text, "chase", &world.chase);
    if let Some(bound) = &world.bound {
        add_baseline(text, "bound", bound);
    }
    world.recipes.iter().for_each(|recipe| add_recipe(text, recipe));
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

fn add_recipe(text: &mut String, recipe: &RecipeResults) {
    let prediction = match (recipe.over_expected, recipe.worst_prediction) {
        (Some(mean), Some(worst)) => format!("{mean:+.2}, at worst {worst:.2}"),
        _ => "-".to_owned(),
    };
    let _ = writeln!(
        text,
        "  {:<12} {:<22} {:<24} {:<24} {:<24} {:>7.0} %  {prediction:<19} {:.0}",
        recipe.name,
        of(&recipe.fitness),
        signed(&recipe.over_chase),
        recipe.over_bound.as_ref().map_or_else(String::new, signed),
        recipe.over_first.as_ref().map_or_else(String::new, signed),
        100.0 * recipe.done.unwrap_or(recipe.under_6),
        recipe.cpu_seconds,
    );
}

fn of(MeanAndInterval { mean, interval: [low, high] }: &MeanAndInterval) -> String {
    format!("{mean:>5.2}  {low:>5.2} to {high:>5.2}")
}

fn signed(MeanAndInterval { mean, interval: [low, high] }: &MeanAndInterval) -> String {
    format!("{mean:+.2}  {low:+.2} to {high:+.2}")
}
