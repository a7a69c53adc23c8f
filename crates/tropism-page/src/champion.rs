//! A champion as a page shows it: its network, its decisions, and its paths on simulated plants.

use serde_json::{Value, json};
use tropism::task::Task;
use tropism::track::Track;
use tropism_neat::Genome;
use tropism_report::{self as report, Body, Figure, Plants, SteeredTrack};

use crate::{rounded, thinned};

/// The network `genome`, its decisions, and its paths on `tracks`, which are of `plants`.
#[must_use]
pub fn champion(genome: &Genome, task: &Task, tracks: &[Track], plants: Plants) -> Value {
    let too_large = report::too_large_to_draw(genome);
    let steered = tracks.first().map(|track| SteeredTrack { track, plants });
    let (network, decision) = if too_large.is_some() {
        (None, None)
    } else {
        let map = report::decision(genome, &task.targets, steered).ok();
        (figure(report::network(genome)), map.and_then(figure))
    };
    let path = |track: &Track| {
        let (points, lamps) = thinned(track);
        json!({ "points": points, "lamps": lamps, "fitness": rounded(task.fitness(track), 3) })
    };
    json!({
        "hidden": genome.hidden(),
        "links": genome.links().len(),
        "too_large": too_large,
        "network": network,
        "decision": decision,
        "paths": tracks.iter().map(path).collect::<Vec<_>>(),
        "label": plants.sentence(),
    })
}

/// A figure that is one drawing; `None` for pictures and plants in space.
#[must_use]
pub fn figure(figure: Figure) -> Option<Value> {
    let Body::Svg(svg) = figure.body else { return None };
    Some(json!({ "number": figure.number, "svg": svg, "title": figure.title, "caption": figure.caption }))
}
