//! Novelty search: networks are scored by how unlike the others they behave, not by how well they do.
//!
//! In: a descriptor of each individual's behaviour, such as where a robot ended up. Out: scores to
//! [`tell`](crate::Neat::tell). The one idea: where the goal misleads, whoever does something new every time gets around
//! more than whoever gets closer every time.
//!
//! # References
//!
//! J. Lehman and K. O. Stanley, *Abandoning objectives: evolution through the search for novelty alone*, Evolutionary
//! Computation 19(2), 2011, [doi:10.1162/EVCO_a_00025](https://doi.org/10.1162/EVCO_a_00025).

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Largest size of a number in a descriptor, so that distances stay finite and can be told as scores.
pub const DESCRIPTOR_LIMIT: f64 = 1e70;

/// Parameters of novelty search. The defaults are usual ones; the threshold has to suit the descriptors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoveltyConfig {
    /// Nearest neighbours over which novelty is averaged: k (15).
    pub neighbours: usize,
    /// Novelty above which a behaviour is archived, at the start (1): a distance between descriptors.
    pub threshold: f64,
    /// Additions in one generation above which the threshold rises (4).
    pub crowd: usize,
    /// Factor by which it rises (1.2).
    pub raise: f64,
    /// Behaviours without an addition after which the threshold falls (2500).
    pub patience: u64,
    /// Factor by which it falls (0.95).
    pub lower: f64,
}

impl Default for NoveltyConfig {
    fn default() -> Self {
        Self { neighbours: 15, threshold: 1.0, crowd: 4, raise: 1.2, patience: 2500, lower: 0.95 }
    }
}

impl NoveltyConfig {
    /// Whether every parameter lies in its range.
    ///
    /// # Errors
    ///
    /// The first one that does not, with its value and what was wanted.
    pub fn check(&self) -> Result<(), NoveltyError> {
        for (key, value, low, high) in [
            ("neighbours", self.neighbours as f64, 1.0, 1e6),
            ("threshold", self.threshold, 0.0, DESCRIPTOR_LIMIT),
            ("crowd", self.crowd as f64, 0.0, 1e6),
            ("raise", self.raise, 1.0, 1e3),
            ("patience", self.patience as f64, 1.0, 1e12),
            ("lower", self.lower, 1e-3, 1.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(NoveltyError::Range { key, value, low, high });
            }
        }
        Ok(())
    }
}

/// A novelty search: what has been seen so far, and how new something has to be to be remembered.
///
/// It draws no random numbers. Saved beside its run and read again (with serde), it goes on to the same bits. The run's
/// [`champion`](crate::Neat::champion) is then the newest of all; who comes closest to a goal is for the caller to remember.
///
/// ```
/// use tropism_neat::{Config, Neat, Network, Novelty, NoveltyConfig};
/// let mut neat = Neat::new(Config::paper(), 2, 1, 42)?;
/// let mut novelty = Novelty::new(NoveltyConfig { threshold: 0.5, ..NoveltyConfig::default() })?;
/// for _ in 0..10 {
///     // What a network answers to three questions is its behaviour.
///     let behaviours = neat.evaluate(|genome, _trial| {
///         let mut network = Network::new(genome);
///         [[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]].map(|question| network.activate(&question)[0]).to_vec()
///     });
///     let scores = novelty.scores(&behaviours)?;
///     neat.tell(&scores)?;
/// }
/// assert!(novelty.archive().len() > 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
pub struct Novelty {
    config: NoveltyConfig,
    threshold: f64,
    /// Behaviours since the last addition to the archive, or since the threshold last fell.
    waited: u64,
    archive: Vec<Vec<f64>>,
}

impl Novelty {
    /// A search that has seen nothing.
    ///
    /// # Errors
    ///
    /// A parameter out of its range.
    pub fn new(config: NoveltyConfig) -> Result<Self, NoveltyError> {
        config.check()?;
        Ok(Self { threshold: config.threshold, waited: 0, archive: Vec::new(), config })
    }

    /// The novelty of each behaviour of a generation, to be told as its score; whatever is new enough is archived.
    ///
    /// Novelty is the mean Euclidean distance to the `neighbours` nearest others in the generation and the archive (to all of
    /// them, if there are fewer; 0 if there are none).
    ///
    /// # Errors
    ///
    /// A descriptor that is empty, of another length than the others, or has a number that is not finite or too large;
    /// nothing is archived then.
    pub fn scores(&mut self, behaviours: &[Vec<f64>]) -> Result<Vec<f64>, NoveltyError> {
        let length = self.archive.iter().chain(behaviours).map(Vec::len).next().unwrap_or(0);
        behaviours.iter().enumerate().try_for_each(|(index, found)| check(index, found, length))?;
        let scores: Vec<f64> = (0..behaviours.len()).map(|index| self.novelty(behaviours, index)).collect();
        let new = behaviours.iter().zip(&scores).filter(|(_, score)| **score > self.threshold);
        let new: Vec<Vec<f64>> = new.map(|(behaviour, _)| behaviour.clone()).collect();
        self.adapt(new.len(), behaviours.len() as u64);
        self.archive.extend(new);
        Ok(scores)
    }

    /// The novelty of behaviour number `index`.
    fn novelty(&self, behaviours: &[Vec<f64>], index: usize) -> f64 {
        let own = &behaviours[index];
        let others = behaviours[..index].iter().chain(&behaviours[index + 1..]).chain(&self.archive);
        let mut distances: Vec<f64> = others.map(|other| distance(own, other)).collect();
        let count = self.config.neighbours.min(distances.len());
        if count == 0 {
            return 0.0;
        }
        // In order, so that the sum does not depend on how they were found.
        distances.sort_unstable_by(f64::total_cmp);
        distances[..count].iter().sum::<f64>() / count as f64
    }

    /// Raises the threshold when too much was new, lowers it when nothing was for long.
    fn adapt(&mut self, added: usize, seen: u64) {
        self.waited = if added > 0 { 0 } else { self.waited + seen };
        if added > self.config.crowd {
            self.threshold = (self.threshold * self.config.raise).min(DESCRIPTOR_LIMIT);
        } else if self.waited >= self.config.patience {
            self.threshold *= self.config.lower;
            self.waited = 0;
        }
    }

    /// Behaviours that were new when they came up, in their order.
    #[must_use]
    pub fn archive(&self) -> &[Vec<f64>] {
        &self.archive
    }

    /// Novelty above which a behaviour is archived now.
    #[must_use]
    pub fn threshold(&self) -> f64 {
        self.threshold
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn check(index: usize, found: &[f64], length: usize) -> Result<(), NoveltyError> {
    if found.is_empty() || found.len() != length {
        return Err(NoveltyError::Length { index, found: found.len(), wanted: length.max(1) });
    }
    match found.iter().find(|value| !(-DESCRIPTOR_LIMIT..=DESCRIPTOR_LIMIT).contains(*value)) {
        Some(&value) => Err(NoveltyError::Value { index, value }),
        None => Ok(()),
    }
}

/// A search as it is written, before it is checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    config: NoveltyConfig,
    threshold: f64,
    waited: u64,
    archive: Vec<Vec<f64>>,
}

impl TryFrom<Saved> for Novelty {
    type Error = NoveltyError;

    fn try_from(Saved { config, threshold, waited, archive }: Saved) -> Result<Self, NoveltyError> {
        NoveltyConfig { threshold, ..config.clone() }.check()?;
        config.check()?;
        let length = archive.first().map_or(0, Vec::len);
        archive.iter().enumerate().try_for_each(|(index, found)| check(index, found, length))?;
        // A search that has waited for longer would have lowered its threshold.
        let waited = waited.min(config.patience);
        Ok(Self { config, threshold, waited, archive })
    }
}

/// What can go wrong in a novelty search.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum NoveltyError {
    /// A parameter lies outside its range.
    #[error("`{key}` is {value}: wanted {low} to {high}")]
    Range {
        /// Name of the field.
        key: &'static str,
        /// What was found.
        value: f64,
        /// Smallest value that can be used.
        low: f64,
        /// Largest value that can be used.
        high: f64,
    },
    /// A descriptor is empty or of another length than those before it.
    #[error("behaviour {index} has {found} numbers: wanted {wanted}, as many in all")]
    Length {
        /// Place in the generation, or in a saved archive.
        index: usize,
        /// Its length.
        found: usize,
        /// Length wanted.
        wanted: usize,
    },
    /// A number in a descriptor is NaN, infinite or absurdly large.
    #[error("behaviour {index} has the number {value}: wanted a size of at most {DESCRIPTOR_LIMIT:e}")]
    Value {
        /// Place in the generation, or in a saved archive.
        index: usize,
        /// The number.
        value: f64,
    },
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn search(neighbours: usize, threshold: f64) -> Novelty {
        Novelty::new(NoveltyConfig { neighbours, threshold, ..NoveltyConfig::default() }).unwrap()
    }

    fn points(values: &[f64]) -> Vec<Vec<f64>> {
        values.iter().map(|&value| vec![value]).collect()
    }

    #[test]
    fn novelty_is_the_mean_distance_to_the_nearest_others() {
        let mut novelty = search(2, 1e9);
        assert_eq!(novelty.scores(&points(&[0.0, 1.0, 3.0, 10.0])).unwrap(), [2.0, 1.5, 2.5, 8.0]);
        assert_eq!(search(1, 1e9).scores(&[vec![0.0, 0.0], vec![3.0, 4.0]]).unwrap(), [5.0, 5.0]);
        assert_eq!(search(5, 1e9).scores(&points(&[7.0])).unwrap(), [0.0]);
    }

    #[test]
    fn what_is_archived_is_no_longer_new() {
        let mut novelty = search(1, 4.0);
        assert_eq!(novelty.scores(&points(&[0.0, 0.5, 9.0])).unwrap(), [0.5, 0.5, 8.5]);
        assert_eq!(novelty.archive(), points(&[9.0]));
        assert_eq!(novelty.scores(&points(&[0.0, 0.5, 9.0])).unwrap(), [0.5, 0.5, 0.0]);
        assert_eq!(novelty.archive().len(), 1);
    }

    #[test]
    fn the_threshold_rises_with_a_crowd_and_falls_with_patience() {
        let config = NoveltyConfig { neighbours: 1, crowd: 2, patience: 6, ..NoveltyConfig::default() };
        let mut novelty = Novelty::new(config).unwrap();
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!((novelty.threshold(), novelty.archive().len()), (1.2, 3));
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!(novelty.threshold(), 1.2);
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!(novelty.threshold(), 1.2 * 0.95);
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!(novelty.threshold(), 1.2 * 0.95, "patience begins anew");
    }

    #[test]
    fn wrong_descriptors_are_refused_and_change_nothing() {
        let mut novelty = search(1, 0.1);
        novelty.scores(&points(&[0.0, 1.0])).unwrap();
        let before = novelty.clone();
        let mut refusal = |behaviours: &[Vec<f64>]| novelty.scores(behaviours).unwrap_err().to_string();
        assert_eq!(refusal(&[vec![1.0], vec![]]), "behaviour 1 has 0 numbers: wanted 1, as many in all");
        assert_eq!(refusal(&[vec![1.0, 2.0]]), "behaviour 0 has 2 numbers: wanted 1, as many in all");
        assert!(refusal(&points(&[5.0, f64::NAN])).starts_with("behaviour 1 has the number NaN: wanted"));
        assert!(refusal(&points(&[1e80])).starts_with("behaviour 0 has the number 1000"));
        assert_eq!(novelty, before);
        assert!(search(1, 1.0).scores(&[vec![]]).is_err());
        let error = Novelty::new(NoveltyConfig { neighbours: 0, ..NoveltyConfig::default() }).unwrap_err();
        assert_eq!(error.to_string(), "`neighbours` is 0: wanted 1 to 1000000");
    }

    #[test]
    fn a_damaged_file_is_refused() {
        let mut novelty = search(1, 0.5);
        novelty.scores(&[vec![0.0, 1.0], vec![2.0, 3.0]]).unwrap();
        let json = serde_json::to_string(&novelty).unwrap();
        let refusal =
            |from, to| serde_json::from_str::<Novelty>(&json.replace(from, to)).unwrap_err().to_string();
        assert!(refusal("[2.0,3.0]", "[2.0]").contains("behaviour 1 has 1 numbers: wanted 2"));
        assert!(refusal("3.0", "1e200").contains("behaviour 1 has the number"));
        assert!(refusal("\"raise\":1.2", "\"raise\":0.2").contains("`raise` is 0.2"));
        assert!(refusal("\"waited\"", "\"waits\"").contains("unknown field `waits`"));
    }

    proptest! {
        #[test]
        fn a_saved_search_goes_on_to_the_same_bits(
            generations in prop::collection::vec(prop::collection::vec(prop::array::uniform2(-5.0..5.0), 6), 1..12),
        ) {
            let mut novelty = search(3, 1.0);
            let mut again = novelty.clone();
            for behaviours in generations {
                let behaviours: Vec<Vec<f64>> = behaviours.iter().map(|pair| pair.to_vec()).collect();
                again = serde_json::from_str(&serde_json::to_string(&again).unwrap()).unwrap();
                prop_assert_eq!(novelty.scores(&behaviours).unwrap(), again.scores(&behaviours).unwrap());
                prop_assert_eq!(&novelty, &again);
            }
        }
    }
}
