//! Drawing of a network: neurons in columns by their depth, from the inputs on the left to the outputs on the right.
//!
//! # References
//! Sugiyama, Tagawa and Toda 1981, doi:10.1109/TSMC.1981.4308636: layered drawing; crossings are reduced by barycentres.

use std::fmt::Write;

use tropism_neat::{Activation, Genome, Neuron, NeuronKind};

use super::plot::{Path, Place, Plot, number};
use super::{Body, Figure};
use tropism::control::network_analysis::NetworkAnalysis;
use tropism::control::{OUTPUTS, TIP_INPUTS};

/// Radius of a neuron, in pixels.
const RADIUS: f64 = 11.0;

/// Distance between two neurons of a column, in pixels.
const ROW: f64 = 44.0;
/// Distance between two columns, in pixels.
const COLUMN: f64 = 84.0;

/// Above this number of links, weights are shown in tooltips only.
const MAX_WEIGHTS_WRITTEN: usize = 12;

/// Sweeps over the columns that reduce crossings; chosen by hand.
const SWEEPS: usize = 12;

/// Line segments of a curve.
const CURVE_SEGMENTS: usize = 16;

/// Neurons and links of the largest network that is drawn. Chosen: evolved controllers have some dozens; a map of the decisions
/// of one of this size takes a second or two, even if its state never settles.
const MAX_DRAWN: (usize, usize) = (200, 400);

/// Why a network is not drawn; `None` if it is small enough.
#[must_use]
pub fn too_large_to_draw(genome: &Genome) -> Option<String> {
    let (neurons, links) = (genome.neurons().len(), genome.links().len());
    (neurons > MAX_DRAWN.0 || links > MAX_DRAWN.1).then(|| {
        format!(
            "too large to draw: found {neurons} neurons and {links} links, wanted at most {} and {}",
            MAX_DRAWN.0, MAX_DRAWN.1
        )
    })
}

/// Draws the network of `genome`.
///
/// The width of a link is proportional to its weight. Recurrent links are arcs with an arrow. Neurons that do not reach an
/// output are faint.
#[must_use]
pub fn network(genome: &Genome) -> Figure {
    let anatomy = NetworkAnalysis::of(genome);
    let layout = Layout::of(genome);
    // Arcs reach above the highest neuron.
    let mut plot = Plot::bare(layout.size, 96.0, 76.0);
    draw_links(&mut plot, genome, &anatomy, &layout);
    for (index, neuron) in genome.neurons().iter().enumerate() {
        let class = if anatomy.is_live[index] { "neuron" } else { "neuron faint" };
        let place = layout.place(&plot, index);
        plot.disc_with_tooltip(class, place, RADIUS, &mark(genome, index), &tooltip(neuron));
        let label = label(genome, index);
        let (side, anchor) = match neuron.kind {
            NeuronKind::Output => (RADIUS + 6.0, "start"),
            _ => (-RADIUS - 6.0, "end"),
        };
        if !label.is_empty() {
            plot.text("tick", (place.0 + side, place.1 + 4.0), anchor, &label);
        }
    }
    plot.legend(&[("excites", "weight above 0"), ("inhibits", "below 0")]);
    let count = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let hidden = genome.hidden();
    Figure {
        number: "network",
        title: format!(
            "Network: {}, {}",
            count(hidden, "hidden neuron"),
            count(genome.links().len(), "link")
        ),
        caption: format!(
            "Signals pass one link a step, from left to right; arcs with an arrow lead back. The width of a link is \
             proportional to its weight. {}",
            description(genome, &anatomy)
        ),
        data: String::new(),
        body: Body::Svg(plot.finish()),
    }
}

/// A sentence on the kind of network.
fn description(genome: &Genome, anatomy: &NetworkAnalysis) -> String {
    let idle = genome.links().len() - anatomy.links;
    let idle = match idle {
        0 => String::new(),
        _ => format!(" {idle} of the links do not reach the output (faint)."),
    };
    let kind = match (anatomy.is_linear, anatomy.has_memory) {
        (true, _) => "The output is a weighted sum of the inputs, compared with a threshold.",
        (false, false) => "No cycle: the memory of the network is no longer than its depth.",
        (false, true) => "The links form a cycle: the network has memory.",
    };
    format!("{kind}{idle}")
}

fn is_controller(genome: &Genome) -> bool {
    (genome.inputs(), genome.outputs()) == (TIP_INPUTS, OUTPUTS)
}

/// The text inside a neuron.
fn mark(genome: &Genome, index: usize) -> String {
    let neuron = &genome.neurons()[index];
    match neuron.kind {
        NeuronKind::Bias => "1".to_owned(),
        NeuronKind::Input if is_controller(genome) => ["x", "y"][index].to_owned(),
        NeuronKind::Output if is_controller(genome) => "C".to_owned(),
        _ => neuron.id.to_string(),
    }
}

/// The text beside a neuron.
fn label(genome: &Genome, index: usize) -> String {
    match genome.neurons()[index].kind {
        NeuronKind::Hidden => String::new(),
        NeuronKind::Bias => "bias".to_owned(),
        NeuronKind::Input if is_controller(genome) => "tip".to_owned(),
        NeuronKind::Input => format!("in {}", index + 1),
        NeuronKind::Output if is_controller(genome) => "1: right lamp".to_owned(),
        NeuronKind::Output => format!("out {}", index - genome.inputs()),
    }
}

/// The name of an activation function in genome files.
fn activation_name(activation: Activation) -> String {
    serde_json::to_string(&activation).unwrap_or_default().trim_matches('"').to_owned()
}

fn tooltip(neuron: &Neuron) -> String {
    match neuron.kind {
        NeuronKind::Input => format!("neuron {}: input", neuron.id),
        NeuronKind::Bias => format!("neuron {}: bias, always 1", neuron.id),
        NeuronKind::Output | NeuronKind::Hidden => format!(
            "neuron {}: {}, slope {}, shift {}",
            neuron.id,
            activation_name(neuron.activation),
            number(neuron.a),
            number(neuron.b)
        ),
    }
}

/// The position of each neuron.
struct Layout {
    /// Column of each neuron.
    columns: Vec<usize>,
    /// The last column.
    last_column: usize,
    /// Height of each neuron above the lower edge, in pixels.
    heights: Vec<f64>,
    /// Distance between two columns, in pixels.
    spacing: f64,
    /// Width and height of the drawing, in pixels.
    size: (f64, f64),
}

impl Layout {
    fn of(genome: &Genome) -> Self {
        let neurons = genome.neurons();
        let mut depths: Vec<f64> = neurons.iter().map(|neuron| neuron.depth).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup();
        let columns: Vec<usize> = neurons
            .iter()
            .map(|neuron| depths.partition_point(|depth| depth.total_cmp(&neuron.depth).is_lt()))
            .collect();
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); depths.len()];
        for (index, &column) in columns.iter().enumerate() {
            members[column].push(index);
        }
        let most = members.iter().map(Vec::len).max().unwrap_or(1);
        let height = ROW * most.max(4).max(depths.len() / 3) as f64;
        let last_column = members.len().saturating_sub(1);
        let heights = vec![0.0; neurons.len()];
        let mut layout = Self { columns, last_column, heights, spacing: COLUMN, size: (0.0, height) };
        for (column, members) in members.iter().enumerate() {
            layout.spread(column, members);
        }
        layout.reduce_crossings(genome, &mut members);
        let last = last_column.max(1);
        // From 300 pixels wide for few columns to 840, the width of a page, for many.
        layout.spacing = COLUMN.min(840.0 / last as f64).max(300.0 / last as f64);
        layout.size.0 = layout.spacing * last as f64;
        layout
    }

    /// Spreads the neurons of a column over the height, in their order from the top.
    fn spread(&mut self, column: usize, members: &[usize]) {
        let height = self.size.1;
        // Inner columns are shifted by multiples of the golden ratio, so that fewer links pass through neurons.
        let is_inner = column > 0 && column < self.last_column;
        let shift = if is_inner { 0.15 + 0.7 * (0.618 * column as f64).fract() } else { 0.5 };
        let gap = height / members.len() as f64;
        for (row, &index) in members.iter().enumerate() {
            self.heights[index] = height - gap * (row as f64 + shift);
        }
    }

    /// Orders the inner columns by the mean height of the neurons that each neuron is linked with (barycentre heuristic).
    fn reduce_crossings(&mut self, genome: &Genome, members: &mut [Vec<usize>]) {
        let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); genome.neurons().len()];
        for link in genome.links() {
            if let (Some(from), Some(to)) = (genome.position(link.from), genome.position(link.to))
                && from != to
            {
                neighbours[from].push(to);
                neighbours[to].push(from);
            }
        }
        let inner = 1..members.len().saturating_sub(1).max(1);
        for _ in 0..SWEEPS {
            for column in inner.clone() {
                let mean = |index: usize| {
                    let heights = neighbours[index].iter().map(|&other| self.heights[other]);
                    (heights.sum::<f64>() / neighbours[index].len().max(1) as f64, index)
                };
                let mut means: Vec<(f64, usize)> = members[column].iter().map(|&index| mean(index)).collect();
                means.sort_by(|a, b| b.0.total_cmp(&a.0));
                members[column] = means.into_iter().map(|(_, index)| index).collect();
                self.spread(column, &members[column]);
            }
        }
    }

    fn place(&self, plot: &Plot, index: usize) -> Place {
        plot.place(self.columns[index] as f64 * self.spacing, self.heights[index])
    }
}

fn draw_links(plot: &mut Plot, genome: &Genome, anatomy: &NetworkAnalysis, layout: &Layout) {
    let largest = genome.links().iter().map(|link| link.weight.abs()).fold(1e-9, f64::max);
    let mut weights = Vec::new();
    for link in genome.links() {
        let (Some(from), Some(to)) = (genome.position(link.from), genome.position(link.to)) else { continue };
        let curve = Curve::between(layout, plot, from, to);
        let sign = if link.weight < 0.0 { "inhibits" } else { "excites" };
        let class = if anatomy.is_live[to] { sign.to_owned() } else { format!("{sign} faint") };
        let mut path = Path::default();
        path.line(
            &(0..=CURVE_SEGMENTS).map(|at| curve.at(at as f64 / CURVE_SEGMENTS as f64)).collect::<Vec<_>>(),
        );
        let width = 0.8 + 3.2 * link.weight.abs() / largest;
        let tooltip = format!("{} to {}: weight {}", link.from, link.to, number(link.weight));
        plot.path_with_tooltip(&class, width, &path, &tooltip);
        if curve.is_back {
            plot.fill(&class, &curve.arrow());
        }
        weights.push((curve.at(if curve.is_back { 0.5 } else { 0.35 }), number(link.weight)));
    }
    if weights.len() <= MAX_WEIGHTS_WRITTEN {
        for ((x, y), weight) in weights {
            plot.text("tick halo", (x, y + 4.0), "middle", &weight);
        }
    }
}

/// A cubic Bézier curve from the edge of one neuron to the edge of another.
struct Curve {
    points: [Place; 4],
    is_back: bool,
}

impl Curve {
    fn between(layout: &Layout, plot: &Plot, from: usize, to: usize) -> Self {
        let (start, end) = (layout.place(plot, from), layout.place(plot, to));
        if layout.columns[from] < layout.columns[to] {
            let reach = 0.45 * (end.0 - start.0);
            let (start, end) = ((start.0 + RADIUS, start.1), (end.0 - RADIUS, end.1));
            let points = [start, (start.0 + reach, start.1), (end.0 - reach, end.1), end];
            return Self { points, is_back: false };
        }
        if start.0 == end.0 && from != to {
            // Within a column: downwards on its right side, upwards on its left side.
            let side = if start.1 < end.1 { 1.0 } else { -1.0 };
            let edge =
                |place: Place, up: f64| (place.0 + side * 0.7 * RADIUS, place.1 + up * side * 0.7 * RADIUS);
            let (start, end) = (edge(start, 1.0), edge(end, -1.0));
            let bow = side * 22.0;
            return Self {
                points: [start, (start.0 + bow, start.1), (end.0 + bow, end.1), end],
                is_back: true,
            };
        }
        // A recurrent link is an arc above the neurons, higher for a longer distance; a self-connection is a loop.
        let columns = (layout.columns[from] - layout.columns[to]) as f64;
        let lift = 34.0 + 12.0 * columns.min(4.0);
        let spread = if from == to { 16.0 } else { 0.0 };
        let tip = |place: Place, side: f64| (place.0 + side * 0.5 * RADIUS, place.1 - 0.87 * RADIUS);
        let (start, end) = (tip(start, 1.0), tip(end, if from == to { -1.0 } else { 1.0 }));
        let points =
            [start, (start.0 + spread + 6.0, start.1 - lift), (end.0 - spread + 6.0, end.1 - lift), end];
        Self { points, is_back: true }
    }

    /// The point of the curve at parameter `share`, from 0 to 1.
    fn at(&self, share: f64) -> Place {
        let rest = 1.0 - share;
        let factors = [
            rest * rest * rest,
            3.0 * rest * rest * share,
            3.0 * rest * share * share,
            share * share * share,
        ];
        let sum =
            |of: fn(&Place) -> f64| self.points.iter().zip(factors).map(|(p, factor)| factor * of(p)).sum();
        (sum(|place| place.0), sum(|place| place.1))
    }

    /// The arrowhead at its end.
    fn arrow(&self) -> Path {
        let (before, end) = (self.at(0.86), self.points[3]);
        let (dx, dy) = (end.0 - before.0, end.1 - before.1);
        let length = (dx * dx + dy * dy).sqrt().max(1e-9);
        let (dx, dy) = (dx / length, dy / length);
        let mut path = Path::default();
        path.start(end);
        path.draw((end.0 - 8.0 * dx - 3.6 * dy, end.1 - 8.0 * dy + 3.6 * dx));
        path.draw((end.0 - 8.0 * dx + 3.6 * dy, end.1 - 8.0 * dy - 3.6 * dx));
        path
    }
}

/// The network of `genome` in the DOT language of Graphviz.
#[must_use]
pub fn network_dot(genome: &Genome) -> String {
    let anatomy = NetworkAnalysis::of(genome);
    let mut dot =
        "digraph network {\n  rankdir=LR;\n  node [shape=circle, fontname=\"sans-serif\"];\n".to_owned();
    let mut ranks = [("source", String::new()), ("sink", String::new())];
    for (index, neuron) in genome.neurons().iter().enumerate() {
        let id = neuron.id;
        let label = match label(genome, index) {
            beside if beside.is_empty() => mark(genome, index),
            beside => format!("{} ({beside})", mark(genome, index)),
        };
        let style = if anatomy.is_live[index] { "" } else { ", style=dotted" };
        let _ = writeln!(dot, "  n{id} [label=\"{label}\", tooltip=\"{}\"{style}];", tooltip(neuron));
        match neuron.kind {
            NeuronKind::Hidden => {}
            NeuronKind::Output => ranks[1].1 += &format!(" n{id};"),
            NeuronKind::Input | NeuronKind::Bias => ranks[0].1 += &format!(" n{id};"),
        }
    }
    for (rank, members) in ranks {
        let _ = writeln!(dot, "  {{ rank={rank};{members} }}");
    }
    let largest = genome.links().iter().map(|link| link.weight.abs()).fold(1e-9, f64::max);
    for link in genome.links() {
        let depth = |id| genome.position(id).map_or(0.0, |place| genome.neurons()[place].depth);
        let back = if depth(link.from) < depth(link.to) { "" } else { ", constraint=false" };
        let (colour, style) = if link.weight < 0.0 { ("#b0427a", "dashed") } else { ("#17794f", "solid") };
        let width = 0.8 + 3.2 * link.weight.abs() / largest;
        let _ = writeln!(
            dot,
            "  n{} -> n{} [label=\"{:.2}\", color=\"{colour}\", style={style}, penwidth={width:.1}{back}];",
            link.from, link.to, link.weight
        );
    }
    dot + "}\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use tropism_neat::{Config, Neat};

    /// A genome with hidden neurons and recurrent links, from an evolution whose fitness is the number of links.
    fn grown(generations: u32) -> Genome {
        let config = Config { mutate_add_neuron_prob: 0.4, mutate_add_link_prob: 0.4, ..Config::wahby2016() };
        let mut neat = Neat::new(config, 2, 1, 3).unwrap();
        for _ in 0..generations {
            let scores: Vec<f64> = neat.ask().iter().map(|genome| genome.links().len() as f64).collect();
            neat.tell(&scores).unwrap();
        }
        neat.champion().unwrap().genome.clone()
    }

    fn svg(figure: &Figure) -> &str {
        let Body::Svg(svg) = &figure.body else { panic!() };
        svg
    }

    #[test]
    fn a_network_is_golden() {
        testing::golden(&network(&grown(4)));
    }

    #[test]
    fn every_neuron_and_every_link_is_drawn_once() {
        for generations in [1, 10, 40] {
            let genome = grown(generations);
            let figure = network(&genome);
            testing::assert_well_formed(svg(&figure));
            assert_eq!(svg(&figure).matches("<circle").count(), genome.neurons().len());
            assert_eq!(svg(&figure).matches(": weight ").count(), genome.links().len());
            assert_eq!(network_dot(&genome).matches(" -> ").count(), genome.links().len());
        }
    }

    #[test]
    fn neurons_stand_apart() {
        let genome = grown(40);
        let layout = Layout::of(&genome);
        assert!(genome.neurons().len() > 12, "{}", genome.neurons().len());
        let plot = Plot::bare(layout.size, 0.0, 0.0);
        let places: Vec<Place> =
            (0..genome.neurons().len()).map(|index| layout.place(&plot, index)).collect();
        for (index, a) in places.iter().enumerate() {
            for b in &places[..index] {
                assert!((a.0 - b.0).abs().max((a.1 - b.1).abs()) > 2.0 * RADIUS, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn networks_that_are_no_controllers_have_numbers() {
        let genome = tropism_neat::random_genome(&Config::wahby2016(), 5, 3, 1, 0);
        let figure = network(&genome);
        testing::assert_well_formed(svg(&figure));
        assert!(svg(&figure).contains("out 3") && !svg(&figure).contains("right lamp"));
    }

    #[test]
    fn huge_weights_still_make_a_drawing() {
        let json = grown(4).to_json();
        let start = json.find("\"weight\":").unwrap() + 9;
        let end = start + json[start..].find(',').unwrap();
        let huge = Genome::from_json(&format!("{}-1e6{}", &json[..start], &json[end..])).unwrap();
        testing::assert_well_formed(svg(&network(&huge)));
    }
}
