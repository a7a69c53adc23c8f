//! Plants before a wall of nodes: the path that was drawn, and where the apex went.

use std::fmt::Write;

use super::csv::Cell;
use super::plot::{Axis, Path, Plot, number};
use super::{Body, Figure, Plants};

/// Panels in a row, and most panels.
const PANELS: (usize, usize) = (4, 8);
/// Width of a panel, and distance between two, in pixels. Chosen by hand: a row fills a page.
const PANEL: (f64, f64) = (180.0, 20.0);
/// Height of the line of text above each panel, in pixels.
const TITLE: f64 = 18.0;

/// One plant before the wall.
#[derive(Clone, Debug, PartialEq)]
pub struct WallPlant {
    /// Title of its panel.
    pub title: String,
    /// Numbers of the nodes on the path, lowest first.
    pub path: Vec<usize>,
    /// The apex from the first step to the last, in cm.
    pub apex: Vec<[f64; 3]>,
    /// Where it reached the height of each node of the path, in cm, and whether on the side of the node.
    pub decisions: Vec<([f64; 2], bool)>,
}

/// A panel for each of the first eight plants: nodes as circles, those of the drawn path filled and joined, the path of the
/// apex, and each decision, right or wrong.
#[must_use]
pub fn wall(nodes: &[[f64; 3]], plants: &[WallPlant], who: Plants) -> Figure {
    let shown = &plants[..plants.len().min(PANELS.1)];
    let places = || nodes.iter().map(|at| [at[0], at[1]]).chain(shown.iter().flat_map(all_places));
    let x = Axis::covering("x (cm)", (-8.0, 8.0), places().map(|[x, _]| x));
    let y = Axis::covering("y (cm)", (0.0, 20.0), places().map(|[_, y]| y));
    let (width, gap) = PANEL;
    let scale = width / (x.to - x.from);
    let height = scale * (y.to - y.from);
    let columns = shown.len().clamp(1, PANELS.0);
    let rows = shown.len().div_ceil(PANELS.0).max(1);
    let size = (columns as f64 * (width + gap) - gap, rows as f64 * (height + gap + TITLE) - gap);
    let mut plot = Plot::bare(size, 20.0, 34.0);
    for (index, plant) in shown.iter().enumerate() {
        let left = (index % PANELS.0) as f64 * (width + gap);
        let top = size.1 - (index / PANELS.0) as f64 * (height + gap + TITLE) - TITLE;
        let at =
            |[cm_x, cm_y]: [f64; 2]| (left + (cm_x - x.from) * scale, top - height + (cm_y - y.from) * scale);
        panel(&mut plot, nodes, plant, &at, (top, height, width, left));
    }
    plot.legend(&[
        ("dark", "nodes; the drawn path is dashed"),
        ("e0", "apex"),
        ("best", "right decision"),
        ("e5", "wrong decision"),
    ]);
    Figure {
        number: "wall",
        title: "Plants before a wall of nodes".to_owned(),
        caption: format!(
            "The apex of each plant, and the side on which it first reached the height of each node of the drawn path. Axes \
             from {} to {} cm and from {} to {} cm. {}",
            number(x.from),
            number(x.to),
            number(y.from),
            number(y.to),
            who.sentence()
        ),
        data: csv(plants),
        body: Body::Svg(plot.finish()),
    }
}

fn all_places(plant: &WallPlant) -> impl Iterator<Item = [f64; 2]> {
    plant.apex.iter().map(|at| [at[0], at[1]])
}

/// Draws one plant. `at` maps cm to units of the plot.
fn panel(
    plot: &mut Plot,
    nodes: &[[f64; 3]],
    plant: &WallPlant,
    at: &dyn Fn([f64; 2]) -> (f64, f64),
    (top, height, width, left): (f64, f64, f64, f64),
) {
    let title = plot.place(left, top + 5.0);
    plot.text("label", title, "start", &plant.title);
    let frame = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
    let corners: Vec<_> =
        frame.iter().map(|(x, y)| plot.place(left + x * width, top - height + y * height)).collect();
    let mut edge = Path::default();
    edge.line(&corners);
    plot.path("grid", &edge);
    let on_path: Vec<_> =
        plant.path.iter().map(|&node| place(plot, at, [nodes[node][0], nodes[node][1]])).collect();
    let mut path = Path::default();
    path.line(&on_path);
    plot.path("dark dashed", &path);
    for (number, node) in nodes.iter().enumerate() {
        let centre = place(plot, at, [node[0], node[1]]);
        let class = if plant.path.contains(&number) { "fill dark" } else { "start" };
        plot.disc(class, centre, 6.0);
    }
    let apex: Vec<_> = all_places(plant).map(|point| place(plot, at, point)).collect();
    let mut line = Path::default();
    line.line(&apex);
    plot.path("e0", &line);
    for (point, is_right) in &plant.decisions {
        let centre = place(plot, at, *point);
        plot.disc(if *is_right { "fill best" } else { "fill e5" }, centre, 3.5);
    }
}

/// Where a point in cm is drawn.
fn place(plot: &Plot, at: &dyn Fn([f64; 2]) -> (f64, f64), point: [f64; 2]) -> (f64, f64) {
    let (x, y) = at(point);
    plot.place(x, y)
}

fn csv(plants: &[WallPlant]) -> String {
    let mut text = "plant,step,apex_x_cm,apex_y_cm,apex_z_cm\n".to_owned();
    for (number, plant) in (1..).zip(plants) {
        for (step, at) in plant.apex.iter().enumerate() {
            let [x, y, z] = at.map(Cell);
            let _ = writeln!(text, "{number},{step},{x},{y},{z}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_decision_is_drawn_right_or_wrong_and_nodes_of_the_path_are_filled() {
        let plant = WallPlant {
            title: "plant 1".to_owned(),
            path: vec![0, 3],
            apex: vec![[0.0, 4.0, 0.0], [-3.0, 9.0, 0.0], [-2.0, 14.0, 1.0]],
            decisions: vec![([-3.0, 8.0], true), ([-2.0, 13.0], false)],
        };
        let nodes = [[-6.0, 8.0, -5.0], [6.0, 8.0, -5.0], [-6.0, 13.0, -5.0], [6.0, 13.0, -5.0]];
        let figure = wall(&nodes, &[plant], Plants::Virtual);
        let svg = figure.body.svg().unwrap();
        let count = |what: &str| svg.matches(what).count();
        assert_eq!([count("circle class=\"fill best\""), count("circle class=\"fill e5\"")], [1, 1]);
        assert_eq!([count("circle class=\"fill dark\""), count("circle class=\"start\"")], [2, 2]);
        assert!(figure.caption.ends_with("The plants are virtual.") && figure.data.lines().count() == 4);
        assert!(wall(&nodes, &[], Plants::Virtual).body.svg().is_some());
    }
}
