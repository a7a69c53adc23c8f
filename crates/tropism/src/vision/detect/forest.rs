//! Random forest: a learned probability that a sample is plant.
//!
//! In: features of samples that are plant, and of samples that are not. Out: the share of plant among what resembles a sample.
//! The one idea: each tree learns from other examples and few of the features, so trees that err, err differently, and
//! their mean is right.
//!
//! Features are whole numbers, and the order of draws is fixed, so the same examples give the same bits everywhere.
//!
//! # References
//! Breiman 2001, *Random forests*, doi:10.1023/A:1010933404324.

use rand::{Rng, RngExt};

use crate::random::{Purpose, stream};

/// Number of features of a sample.
pub(super) const FEATURES: usize = 15;

/// Features of a sample.
pub(super) type Features = [u8; FEATURES];

/// Trees, and splits on the way through one. Chosen by hand, like the next two: the time of an answer grows with both.
const TREES: usize = 12;
const DEPTH: usize = 7;

/// Features among which a split is chosen: the square root of their number.
const TRIED_FEATURES: usize = 4;

/// Examples of each kind from which a tree learns. Chosen by hand.
const EXAMPLES: usize = 1_000;

const SPLITS: usize = (1 << DEPTH) - 1;

/// A complete binary tree: the children of split `i` are `2 i + 1` and `2 i + 2`.
#[derive(Clone, Debug)]
struct Tree {
    /// Feature of each split, and the greatest value that leads to the first child.
    splits: [(u8, u8); SPLITS],
    /// Share of plant in each leaf, 0 to 255.
    leaves: [u8; SPLITS + 1],
}

/// Features of a sample, and whether it is plant.
type Example = (Features, bool);

impl Tree {
    /// Grows the part of the tree from split `at` on.
    fn grow(&mut self, at: usize, examples: &mut [Example], rng: &mut impl Rng) {
        if let Some(leaf) = at.checked_sub(SPLITS) {
            let plant = examples.iter().filter(|(_, is_plant)| *is_plant).count();
            // Laplace's rule of succession: a leaf of few examples is not certain.
            self.leaves[leaf] = (255 * (plant + 1) / (examples.len() + 2)) as u8;
            return;
        }
        // Where no split helps, all examples go to the first child.
        let (feature, most) = best_split(examples, rng).unwrap_or((0, u8::MAX));
        self.splits[at] = (feature as u8, most);
        examples.sort_unstable_by_key(|(features, _)| features[feature] > most);
        let middle = examples.partition_point(|(features, _)| features[feature] <= most);
        let (first, second) = examples.split_at_mut(middle);
        self.grow(2 * at + 1, first, rng);
        self.grow(2 * at + 2, second, rng);
    }

    fn share(&self, features: &Features) -> u8 {
        let mut at = 0;
        for _ in 0..DEPTH {
            let (feature, most) = self.splits[at];
            at = 2 * at + 1 + usize::from(features[usize::from(feature)] > most);
        }
        self.leaves[at - SPLITS]
    }
}

/// Feature and value that separate plant best among some features (least Gini impurity); `None` where none separates anything.
fn best_split(examples: &[Example], rng: &mut impl Rng) -> Option<(usize, u8)> {
    // The sum of squares of both kinds' counts over the count of all: the greater, the purer.
    let purity = |[other, plant]: [u32; 2]| {
        let [other, plant] = [other, plant].map(f64::from);
        (other * other + plant * plant) / (other + plant).max(1.0)
    };
    let mut all = [0; 2];
    examples.iter().for_each(|&(_, is_plant)| all[usize::from(is_plant)] += 1);
    let mut best = (purity(all) + 1e-6, None);
    for _ in 0..TRIED_FEATURES {
        let feature = rng.random_range(0..FEATURES as u32) as usize;
        let mut counts = [[0; 2]; 256];
        for (features, is_plant) in examples {
            counts[usize::from(features[feature])][usize::from(*is_plant)] += 1;
        }
        let mut below = [0; 2];
        for (value, count) in (0..=u8::MAX).zip(counts) {
            below = [below[0] + count[0], below[1] + count[1]];
            let gained = purity(below) + purity([all[0] - below[0], all[1] - below[1]]);
            if count != [0; 2] && gained > best.0 {
                best = (gained, Some((feature, value)));
            }
        }
    }
    best.1
}

/// A forest that separates plant from background.
#[derive(Clone, Debug)]
pub(super) struct Forest {
    trees: Vec<Tree>,
}

impl Forest {
    /// Learns from samples that are plant, and others that are not; `None` without either.
    pub(super) fn learn(plant: &[Features], other: &[Features]) -> Option<Self> {
        if plant.is_empty() || other.is_empty() {
            return None;
        }
        let tree = |index: u64| {
            let mut rng = stream(0, Purpose::Forest, index);
            // As many of each kind, however many there are: bootstrap samples.
            let mut examples = Vec::with_capacity(2 * EXAMPLES);
            for (kind, is_plant) in [(plant, true), (other, false)] {
                examples.extend(
                    (0..EXAMPLES).map(|_| (kind[rng.random_range(0..kind.len() as u32) as usize], is_plant)),
                );
            }
            let mut tree = Tree { splits: [(0, 0); SPLITS], leaves: [0; SPLITS + 1] };
            tree.grow(0, &mut examples, &mut rng);
            tree
        };
        Some(Self { trees: (0..TREES as u64).map(tree).collect() })
    }

    /// Probability that a sample is plant, 0 to 1, where as many samples are plant as are not.
    pub(super) fn probability(&self, features: &Features) -> f32 {
        let sum: u32 = self.trees.iter().map(|tree| u32::from(tree.share(features))).sum();
        sum as f32 / (255 * TREES) as f32
    }
}
