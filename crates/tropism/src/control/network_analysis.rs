//! Analysis of an evolved network: which neurons matter, whether it can remember, and what it decides at each place.

use tropism_neat::{Activation, Genome, Network, topological_order};

use super::network::{ShapeError, is_of_tip, is_right};
use super::{Sensors, TIP_INPUTS};
use crate::geometry::Point;
use crate::lamps::Layout;

/// Which neurons and links of a network take part in its output, and what class of network they form.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkAnalysis {
    /// Whether a path leads from a neuron to an output, in the order of the genome's neurons.
    pub is_live: Vec<bool>,
    /// Live hidden neurons.
    pub hidden: usize,
    /// Links between live neurons.
    pub links: usize,
    /// Whether live links form a cycle. Without one a network cannot remember for longer than it is deep.
    pub has_memory: bool,
    /// Whether the output is a function of one weighted sum of the inputs.
    pub is_linear: bool,
}

impl NetworkAnalysis {
    /// Analyses `genome`: a backward search from the outputs, then a topological sort of the live links.
    #[must_use]
    pub fn of(genome: &Genome) -> Self {
        let neurons = genome.neurons().len();
        let place = |id| genome.position(id).expect("a genome's links join its own neurons");
        let links: Vec<(usize, usize)> =
            genome.links().iter().map(|link| (place(link.from), place(link.to))).collect();
        let outputs = genome.inputs() + 1..genome.inputs() + 1 + genome.outputs();
        let mut is_live: Vec<bool> = (0..neurons).map(|place| outputs.contains(&place)).collect();
        let sources = grouped(neurons, links.iter().map(|&(from, to)| (to, from)));
        let mut reached: Vec<usize> = outputs.clone().collect();
        while let Some(place) = reached.pop() {
            for &source in &sources[place] {
                if !std::mem::replace(&mut is_live[source], true) {
                    reached.push(source);
                }
            }
        }
        let links: Vec<(usize, usize)> = links.into_iter().filter(|&(_, to)| is_live[to]).collect();
        let hidden = (outputs.end..neurons).filter(|&place| is_live[place]).count();
        let is_linear = hidden == 0 && links.iter().all(|(from, _)| !outputs.contains(from));
        Self {
            hidden,
            links: links.len(),
            has_memory: topological_order(&links, 0, neurons).is_none(),
            is_linear,
            is_live,
        }
    }
}

/// The second of each pair, by the first.
fn grouped(count: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Vec<Vec<usize>> {
    let mut groups = vec![Vec::new(); count];
    for (of, other) in pairs {
        groups[of].push(other);
    }
    groups
}

/// The decision boundary of a linear controller: it lights the right lamp where `x * tip.x + y * tip.y + constant > 0`, with
/// the tip in cm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boundary {
    /// Factor of x.
    pub x: f64,
    /// Factor of y.
    pub y: f64,
    /// Constant term.
    pub constant: f64,
}

impl Boundary {
    /// The boundary of a controller that is linear and whose output neuron is an unsigned step; `None` of all others.
    #[must_use]
    pub fn of(genome: &Genome) -> Option<Self> {
        let output = genome.neurons().get(TIP_INPUTS + 1).filter(|_| is_of_tip(genome))?;
        if output.activation != Activation::UnsignedStep || !NetworkAnalysis::of(genome).is_linear {
            return None;
        }
        let weight = |place: usize| {
            let from = genome.neurons()[place].id;
            genome
                .links()
                .iter()
                .find(|link| (link.from, link.to) == (from, output.id))
                .map_or(0.0, |l| l.weight)
        };
        Some(Self { x: weight(0), y: weight(1), constant: weight(TIP_INPUTS) - 0.5 - output.b })
    }
}

/// Activations for a network to settle, and again as many over which its output is then averaged. Chosen: more than the
/// depth of any network seen in evolution, few enough to draw a map quickly.
const SETTLING: usize = 64;

/// Decisions of a controller at each place, after its state has settled there.
///
/// A network keeps its state, so its decision at a place may depend on what it saw before. Here the tip stands still until
/// the state of the network no longer changes. It starts from five states: at rest, and settled at each of four corners.
/// Where all five end in the same lamp, the decision does not depend on the past.
#[derive(Clone, Debug)]
pub struct Decisions {
    pasts: Vec<Network>,
}

impl Decisions {
    /// The decisions of `genome`, with `corners` as its pasts.
    ///
    /// # Errors
    /// [`ShapeError`] if the genome has not two inputs and one output.
    pub fn new(genome: &Genome, corners: [Point; 4]) -> Result<Self, ShapeError> {
        ShapeError::check(genome, &Sensors::default(), &Layout::wahby2016())?;
        let rest = Network::new(genome);
        let settled = corners.map(|corner| {
            let mut network = rest.clone();
            settle(&mut network, corner);
            network
        });
        Ok(Self { pasts: [&[rest], &settled[..]].concat() })
    }

    /// The share of time for which the right lamp is lit when the tip stands still at `tip` (cm), averaged over the five
    /// states: 0 is always left, 1 always right; between them the network oscillates or depends on its past.
    #[must_use]
    pub fn share_right(&self, tip: Point) -> f64 {
        let shares = self.pasts.iter().map(|past| settle(&mut past.clone(), tip).0);
        shares.sum::<f64>() / self.pasts.len() as f64
    }

    /// Activations of the network that [`Self::share_right`] takes at `tip`.
    #[must_use]
    pub fn activations(&self, tip: Point) -> usize {
        self.pasts.iter().map(|past| settle(&mut past.clone(), tip).1).sum()
    }
}

/// Activates with the tip at `tip` until the state no longer changes. Returns the share of activations that say right, and the
/// number of activations.
fn settle(network: &mut Network, tip: Point) -> (f64, usize) {
    let mut before = network.state().to_vec();
    let mut right = 0;
    for activation in 0..2 * SETTLING {
        let is_right = is_right(network.activate(&[tip.x, tip.y]));
        if network.state() == before {
            return (f64::from(u8::from(is_right)), activation + 1);
        }
        right += usize::from(is_right && activation >= SETTLING);
        before.copy_from_slice(network.state());
    }
    (right as f64 / SETTLING as f64, 2 * SETTLING)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A controller with step neurons: hidden ones from id 5, links as (from, to, weight).
    fn controller(hidden: u32, links: &[(u32, u32, f64)]) -> Genome {
        let neuron = |id: u32| {
            let (kind, depth) = match id {
                1 | 2 => ("input", 0.0),
                3 => ("bias", 0.0),
                4 => ("output", 1.0),
                _ => ("hidden", 0.5),
            };
            format!(
                r#"{{"id":{id},"kind":"{kind}","depth":{depth:?},"activation":"unsigned_step","a":1.0,"b":0.0}}"#
            )
        };
        let neurons: Vec<String> = (1..5 + hidden).map(neuron).collect();
        let link = |(index, (from, to, weight)): (usize, &(u32, u32, f64))| {
            let innovation = index + 1;
            format!(
                r#"{{"innovation":{innovation},"from":{from},"to":{to},"weight":{weight:?},"recurrent":false}}"#
            )
        };
        let links: Vec<String> = links.iter().enumerate().map(link).collect();
        Genome::from_json(&format!(
            r#"{{"schema":"tropism.genome/1","inputs":2,"outputs":1,"neurons":[{}],"links":[{}]}}"#,
            neurons.join(","),
            links.join(",")
        ))
        .unwrap()
    }

    fn decisions(genome: &Genome) -> Decisions {
        let corners = [(-8.0, 4.0), (8.0, 4.0), (-8.0, 16.0), (8.0, 16.0)].map(|(x, y)| Point::new(x, y));
        Decisions::new(genome, corners).unwrap()
    }

    #[test]
    fn a_linear_controller_decides_by_its_boundary() {
        let genome = controller(0, &[(1, 4, -1.0), (2, 4, 0.5), (3, 4, 2.0)]);
        let analysis = NetworkAnalysis::of(&genome);
        assert!(analysis.is_linear && !analysis.has_memory);
        assert_eq!((analysis.hidden, analysis.links), (0, 3));
        let boundary = Boundary::of(&genome).unwrap();
        assert_eq!(boundary, Boundary { x: -1.0, y: 0.5, constant: 1.5 });
        let decisions = decisions(&genome);
        for (x, y) in [(-3.0, 4.0), (3.4, 4.0), (3.6, 4.0), (6.0, 10.0), (7.0, 10.0)] {
            let is_right = boundary.x * x + boundary.y * y + boundary.constant > 0.0;
            assert_eq!(decisions.share_right(Point::new(x, y)), f64::from(u8::from(is_right)), "{x}, {y}");
        }
    }

    #[test]
    fn neurons_that_lead_nowhere_do_not_count() {
        let genome = controller(2, &[(1, 4, 1.0), (1, 5, 1.0), (5, 6, 1.0), (6, 5, 1.0)]);
        let analysis = NetworkAnalysis::of(&genome);
        assert_eq!((analysis.hidden, analysis.links), (0, 1));
        assert!(analysis.is_linear && !analysis.has_memory);
        assert_eq!(analysis.is_live, [true, false, false, true, false, false]);
    }

    #[test]
    fn a_delay_is_waited_for_and_is_no_memory() {
        let genome = controller(1, &[(1, 5, 1.0), (5, 4, 1.0)]);
        let analysis = NetworkAnalysis::of(&genome);
        assert!(!analysis.is_linear && !analysis.has_memory);
        assert_eq!(Boundary::of(&genome), None);
        let decisions = decisions(&genome);
        assert_eq!([0.4, 0.6].map(|x| decisions.share_right(Point::new(x, 4.0))), [0.0, 1.0]);
    }

    #[test]
    fn a_latch_depends_on_its_past_and_an_oscillator_changes_for_ever() {
        // Once on, the output keeps itself on until x falls below -0.5.
        let latch = controller(0, &[(1, 4, 1.0), (4, 4, 1.0)]);
        assert!(NetworkAnalysis::of(&latch).has_memory && !NetworkAnalysis::of(&latch).is_linear);
        let decisions_of_latch = decisions(&latch);
        let shares = [-1.0, 0.0, 1.0].map(|x| decisions_of_latch.share_right(Point::new(x, 4.0)));
        assert_eq!(shares, [0.0, 0.4, 1.0], "two corners of five pasts switch it on");
        let oscillator = controller(0, &[(3, 4, 1.0), (4, 4, -1.0)]);
        assert_eq!(decisions(&oscillator).share_right(Point::new(0.0, 4.0)), 0.5);
    }

    #[test]
    fn a_genome_of_another_shape_has_an_analysis_but_no_decisions() {
        let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 3, 2, 1, 0);
        assert!(NetworkAnalysis::of(&genome).is_linear);
        assert!(Decisions::new(&genome, [Point::new(0.0, 0.0); 4]).is_err());
        assert_eq!(Boundary::of(&genome), None);
    }
}
