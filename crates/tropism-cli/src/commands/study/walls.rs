//! Nodes on many walls as text.

use std::fmt::Write;
use std::path::Path;

use tropism_lab::units::plural;
use tropism_lab::wall::WallStudyResults;

use crate::commands::wall::table;

pub(super) fn text(results: &WallStudyResults, out: &Path) -> String {
    let mut text = format!("{} before each wall; 95 % intervals\n", plural(results.plants, "virtual plant"));
    for rule in &results.evolved {
        let _ = writeln!(
            text,
            "{}: evolved with seed {}; the model expects {:.0} % of whole paths",
            rule.name,
            rule.seed,
            100.0 * rule.test.whole
        );
    }
    for wall in &results.walls {
        let _ = write!(text, "\n{} ({})\n{}", wall.name, plural(wall.nodes, "node"), table(&wall.rules));
    }
    let _ = write!(text, "\nwrote {out}/walls.json; figures: {out}/*/*-wall.svg", out = out.display());
    text
}
