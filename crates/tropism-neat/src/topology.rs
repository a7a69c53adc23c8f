//! Cycles in networks: whether there are any, and an order of evaluation where there are none.
//!
//! # References
//!
//! A. B. Kahn, *Topological sorting of large networks*, Communications of the ACM 5(11), 1962,
//! [doi:10.1145/368996.369025](https://doi.org/10.1145/368996.369025).

use crate::genome::Genome;

impl Genome {
    /// Whether the network is feed-forward: whether its links form no cycle.
    ///
    /// Neither depths nor the `recurrent` flags of links matter. In a network evolved with
    /// [`Config::feed_forward`](crate::Config::feed_forward), links form no cycle.
    ///
    /// ```
    /// use tropism_neat::{Config, random_genome};
    /// assert!(random_genome(&Config::multineat(), 2, 1, 42, 0).is_feed_forward());
    /// ```
    #[must_use]
    pub fn is_feed_forward(&self) -> bool {
        let index = |id| self.position(id).expect("a genome's links join its own neurons");
        let links: Vec<_> = self.links().iter().map(|link| (index(link.from), index(link.to))).collect();
        topological_order(&links, self.inputs() + 1, self.neurons().len()).is_some()
    }
}

/// Orders the neurons `first..count` so that the source of every link precedes its target; `None` if links form a cycle.
///
/// A link is a pair of the indices of its source and its target. The neurons before `first` are inputs and bias, which no
/// link enters. The algorithm is Kahn's: it takes neurons all of whose sources have been taken.
///
/// # Panics
/// If a link has an index of `count` or above, or enters a neuron before `first`.
#[must_use]
pub fn topological_order(links: &[(usize, usize)], first: usize, count: usize) -> Option<Vec<usize>> {
    // Evolved recurrent networks mostly have a loop, which is quicker to find.
    if links.iter().any(|(from, to)| from == to) {
        return None;
    }
    // Targets of neuron n are targets[starts[n]..starts[n + 1]].
    let (mut starts, mut pending) = (vec![0; count + 1], vec![0_usize; count]);
    let internal = || links.iter().filter(|&&(from, _)| from >= first);
    for &(from, to) in internal() {
        starts[from + 1] += 1;
        pending[to] += 1;
    }
    for index in 0..count {
        starts[index + 1] += starts[index];
    }
    let (mut next, mut targets) = (starts.clone(), vec![0; starts[count]]);
    for &(from, to) in internal() {
        targets[next[from]] = to;
        next[from] += 1;
    }
    let mut order: Vec<usize> = (first..count).filter(|&neuron| pending[neuron] == 0).collect();
    let mut taken = 0;
    while let Some(&neuron) = order.get(taken) {
        for &target in &targets[starts[neuron]..starts[neuron + 1]] {
            pending[target] -= 1;
            if pending[target] == 0 {
                order.push(target);
            }
        }
        taken += 1;
    }
    (order.len() == count - first).then_some(order)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Config;
    use crate::testing::{genome, mutants};

    #[test]
    fn cycles_are_found_whatever_the_depths() {
        let is_feed_forward =
            |links: &[(u32, u32, f64)]| genome(1, 1, &[(4, 0.5), (5, 0.5)], links).is_feed_forward();
        assert!(is_feed_forward(&[]));
        assert!(is_feed_forward(&[(1, 4, 1.0), (4, 3, 1.0), (2, 3, 1.0)]));
        // Links between equal depths, and one that leads back, form no cycle by themselves.
        assert!(is_feed_forward(&[(1, 4, 1.0), (4, 5, 1.0), (5, 3, 1.0)]));
        assert!(is_feed_forward(&[(1, 3, 1.0), (3, 4, 1.0)]));
        assert!(!is_feed_forward(&[(1, 3, 1.0), (3, 3, 1.0)]), "a loop");
        assert!(!is_feed_forward(&[(1, 4, 1.0), (4, 5, 1.0), (5, 4, 1.0), (5, 3, 1.0)]), "two neurons");
        assert!(!is_feed_forward(&[(1, 4, 1.0), (4, 5, 1.0), (5, 3, 1.0), (3, 4, 1.0)]), "three neurons");
    }

    /// Whether a path of at least one link leads from a neuron to itself, by search from every neuron.
    fn has_cycle(genome: &Genome) -> bool {
        genome.neurons().iter().any(|start| {
            let (mut reached, mut open) = (Vec::new(), vec![start.id]);
            while let Some(id) = open.pop() {
                for link in genome.links().iter().filter(|link| link.from == id) {
                    if !reached.contains(&link.to) {
                        reached.push(link.to);
                        open.push(link.to);
                    }
                }
            }
            reached.contains(&start.id)
        })
    }

    proptest! {
        #[test]
        fn feed_forward_means_that_no_neuron_reaches_itself(seed in 0_u64..10_000, recurrent_prob in 0.0..0.2) {
            let config = Config { recurrent_prob, ..Config::wahby2016() };
            for genome in mutants(&config, seed, 60).iter().step_by(7) {
                prop_assert_eq!(genome.is_feed_forward(), !has_cycle(genome));
            }
        }

        #[test]
        fn networks_evolved_as_feed_forward_are_feed_forward(seed in 0_u64..10_000) {
            let config = Config { feed_forward: true, recurrent_prob: 1.0, ..Config::multineat() };
            prop_assert!(mutants(&config, seed, 80).iter().all(Genome::is_feed_forward));
        }
    }
}
