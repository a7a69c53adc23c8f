//! A champion as a page shows it: its network, its decisions, and its paths on simulated plants.

use serde::Serialize;
use tropism::task::Task;
use tropism::track::Track;
use tropism_neat::Genome;
use tropism_report::{self as report, Body, Figure, Plants, SteeredTrack};

use crate::{rounded, thinned};

/// A champion as a page shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ShownChampion {
    /// Number of hidden neurons.
    pub hidden: usize,
    /// Number of links.
    pub links: usize,
    /// Why its network is not drawn; `None` if it is.
    pub too_large: Option<String>,
    /// Its network.
    pub network: Option<ShownFigure>,
    /// What it decides where the tip may be.
    pub decision: Option<ShownFigure>,
    /// Its paths on simulated plants.
    pub paths: Vec<ShownPath>,
    /// A sentence that says what these plants are.
    pub label: &'static str,
}

/// The path of a simulated plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ShownPath {
    /// Tips, in cm.
    pub points: Vec<[f64; 2]>,
    /// The lamp at each of them.
    pub lamps: Vec<Option<String>>,
    /// Fitness, in the unit of the task.
    pub fitness: f64,
}

/// A figure that is one drawing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ShownFigure {
    /// The paper's number, such as `4a`.
    pub number: &'static str,
    /// The drawing.
    pub svg: String,
    /// Title.
    pub title: String,
    /// Caption.
    pub caption: String,
}

/// The network `genome`, its decisions, and its paths on `tracks`, which are of `plants`.
#[must_use]
pub fn champion(genome: &Genome, task: &Task, tracks: &[Track], plants: Plants) -> ShownChampion {
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
        ShownPath { points, lamps, fitness: rounded(task.fitness(track), 3) }
    };
    ShownChampion {
        hidden: genome.hidden(),
        links: genome.links().len(),
        too_large,
        network,
        decision,
        paths: tracks.iter().map(path).collect(),
        label: plants.sentence(),
    }
}

/// A figure that is one drawing; `None` for pictures and plants in space.
#[must_use]
pub fn figure(figure: Figure) -> Option<ShownFigure> {
    let Figure { number, title, caption, body: Body::Svg(svg), .. } = figure else { return None };
    Some(ShownFigure { number, svg, title, caption })
}
