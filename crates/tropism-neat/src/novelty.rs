//! Novelty search: individuals are scored by the novelty of their behaviour, not by an objective.
//!
//! In: a behaviour descriptor of each individual, such as the final position of a robot. Out: scores for
//! [`tell`](crate::Neat::tell). The one idea: where the objective is deceptive, a search for new behaviours gets further
//! than a search for better ones.
//!
//! # References
//!
//! J. Lehman and K. O. Stanley, *Abandoning objectives: evolution through the search for novelty alone*, Evolutionary
//! Computation 19(2), 2011, [doi:10.1162/EVCO_a_00025](https://doi.org/10.1162/EVCO_a_00025).

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::limits::DESCRIPTOR_LIMIT;

/// Parameters of novelty search.
///
/// The defaults are Lehman and Stanley's (2011), except the threshold, which has to suit the descriptors: it is 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoveltyConfig {
    /// Number k of nearest neighbours over which novelty is averaged (15).
    pub neighbours: usize,
    /// Archive threshold at the start: behaviours of greater novelty are archived (1, in units of the descriptors).
    pub threshold: f64,
    /// With more additions to the archive in one generation than this, the threshold rises (4).
    pub crowd: usize,
    /// Factor by which the threshold rises (1.2).
    pub raise: f64,
    /// After this many evaluations without an addition to the archive, the threshold falls (2500).
    pub patience: u64,
    /// Factor by which the threshold falls (0.95).
    pub lower: f64,
}

impl Default for NoveltyConfig {
    fn default() -> Self {
        Self { neighbours: 15, threshold: 1.0, crowd: 4, raise: 1.2, patience: 2500, lower: 0.95 }
    }
}

impl NoveltyConfig {
    /// Checks that every parameter lies in its range.
    ///
    /// # Errors
    ///
    /// [`NoveltyError::Range`] names the first parameter that does not, its value and its range.
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

/// The state of a novelty search: the archive and its threshold.
///
/// It draws no random numbers. Serialised beside its run and restored, it continues bit for bit. The run's
/// [`champion`](crate::Neat::champion) is then the individual of greatest novelty; the caller has to keep the individual
/// that comes closest to an objective.
///
/// ```
/// use tropism_neat::{Config, Neat, Network, Novelty, NoveltyConfig};
/// let mut neat = Neat::new(Config::wahby2016(), 2, 1, 42)?;
/// let mut novelty = Novelty::new(NoveltyConfig { threshold: 0.5, ..NoveltyConfig::default() })?;
/// for _ in 0..10 {
///     // The behaviour of a network: its outputs for three inputs.
///     let behaviours = neat.evaluate(|genome, _| {
///         let mut network = Network::new(genome);
///         [[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]].map(|inputs| network.activate(&inputs)[0]).to_vec()
///     });
///     let scores = novelty.scores(&behaviours)?;
///     neat.tell(&scores)?;
/// }
/// assert!(novelty.archive().len() > 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedNovelty")]
pub struct Novelty {
    config: NoveltyConfig,
    threshold: f64,
    /// Evaluations since the last addition to the archive, or since the threshold last fell.
    #[serde(rename = "waited")]
    evaluations_without_addition: u64,
    archive: Vec<Vec<f64>>,
}

impl Novelty {
    /// Starts a search with an empty archive.
    ///
    /// # Errors
    ///
    /// [`NoveltyError::Range`] if a parameter is out of range.
    pub fn new(config: NoveltyConfig) -> Result<Self, NoveltyError> {
        config.check()?;
        let (threshold, archive) = (config.threshold, Vec::new());
        Ok(Self { threshold, evaluations_without_addition: 0, archive, config })
    }

    /// Returns the novelty of each behaviour of a generation, and archives the behaviours of sufficient novelty.
    ///
    /// Novelty is the mean Euclidean distance to the `neighbours` nearest other behaviours in the generation and in the
    /// archive. If there are fewer others, all of them count; without any, novelty is 0.
    ///
    /// # Errors
    ///
    /// [`NoveltyError::Length`] if a descriptor is empty or has another length than the others, [`NoveltyError::Value`] if
    /// it has a number that is not finite or too large. Nothing is archived then.
    pub fn scores(&mut self, behaviours: &[Vec<f64>]) -> Result<Vec<f64>, NoveltyError> {
        let length = self.archive.iter().chain(behaviours).map(Vec::len).next().unwrap_or(0);
        behaviours.iter().enumerate().try_for_each(|(index, found)| check(index, found, length))?;
        let scores: Vec<f64> = (0..behaviours.len()).map(|index| self.novelty(behaviours, index)).collect();
        let new = behaviours.iter().zip(&scores).filter(|(_, score)| **score > self.threshold);
        let new: Vec<Vec<f64>> = new.map(|(behaviour, _)| behaviour.clone()).collect();
        self.adapt_threshold(new.len(), behaviours.len() as u64);
        self.archive.extend(new);
        Ok(scores)
    }

    /// Novelty of behaviour number `index` of a generation.
    fn novelty(&self, behaviours: &[Vec<f64>], index: usize) -> f64 {
        let own = &behaviours[index];
        let others = behaviours[..index].iter().chain(&behaviours[index + 1..]).chain(&self.archive);
        let mut distances: Vec<f64> = others.map(|other| distance(own, other)).collect();
        let count = self.config.neighbours.min(distances.len());
        if count == 0 {
            return 0.0;
        }
        // Sorted, so that the sum does not depend on the order of the individuals.
        distances.sort_unstable_by(f64::total_cmp);
        distances[..count].iter().sum::<f64>() / count as f64
    }

    /// Adapts the threshold: raises it after many additions, lowers it after many evaluations without any.
    fn adapt_threshold(&mut self, added: usize, evaluated: u64) {
        let waited = self.evaluations_without_addition;
        self.evaluations_without_addition = if added > 0 { 0 } else { waited + evaluated };
        if added > self.config.crowd {
            self.threshold = (self.threshold * self.config.raise).min(DESCRIPTOR_LIMIT);
        } else if self.evaluations_without_addition >= self.config.patience {
            self.threshold *= self.config.lower;
            self.evaluations_without_addition = 0;
        }
    }

    /// The archived behaviours, in the order of their addition.
    #[must_use]
    pub fn archive(&self) -> &[Vec<f64>] {
        &self.archive
    }

    /// The present archive threshold.
    #[must_use]
    pub fn threshold(&self) -> f64 {
        self.threshold
    }
}

/// Euclidean distance between two descriptors.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Checks descriptor number `index`.
fn check(index: usize, found: &[f64], length: usize) -> Result<(), NoveltyError> {
    if found.is_empty() || found.len() != length {
        return Err(NoveltyError::Length { index, found: found.len(), wanted: length.max(1) });
    }
    match found.iter().find(|value| !(-DESCRIPTOR_LIMIT..=DESCRIPTOR_LIMIT).contains(*value)) {
        Some(&value) => Err(NoveltyError::Value { index, value }),
        None => Ok(()),
    }
}

/// A deserialised search, not yet checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UncheckedNovelty {
    config: NoveltyConfig,
    threshold: f64,
    waited: u64,
    archive: Vec<Vec<f64>>,
}

impl TryFrom<UncheckedNovelty> for Novelty {
    type Error = NoveltyError;

    fn try_from(unchecked: UncheckedNovelty) -> Result<Self, NoveltyError> {
        let UncheckedNovelty { config, threshold, waited, archive } = unchecked;
        NoveltyConfig { threshold, ..config.clone() }.check()?;
        config.check()?;
        let length = archive.first().map_or(0, Vec::len);
        archive.iter().enumerate().try_for_each(|(index, found)| check(index, found, length))?;
        // Beyond its patience, a search would have lowered its threshold.
        let evaluations_without_addition = waited.min(config.patience);
        Ok(Self { config, threshold, evaluations_without_addition, archive })
    }
}

/// An error of novelty search.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum NoveltyError {
    /// A parameter lies outside its range.
    #[error("found {key} = {value}, wanted {low} to {high}")]
    Range {
        /// Name of the field.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
    /// A descriptor is empty or has another length than those before it.
    #[error("found behaviour {index} with {found} numbers, wanted {wanted}, the same for all")]
    Length {
        /// Index in the generation, or in a restored archive.
        index: usize,
        /// Its length.
        found: usize,
        /// Length wanted.
        wanted: usize,
    },
    /// A number in a descriptor is not finite or too large.
    #[error(
        "found behaviour {index} with the number {value}, wanted a magnitude of at most {DESCRIPTOR_LIMIT:e}"
    )]
    Value {
        /// Index in the generation, or in a restored archive.
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
    fn novelty_is_the_mean_distance_to_the_nearest_neighbours() {
        let mut novelty = search(2, 1e9);
        assert_eq!(novelty.scores(&points(&[0.0, 1.0, 3.0, 10.0])).unwrap(), [2.0, 1.5, 2.5, 8.0]);
        assert_eq!(search(1, 1e9).scores(&[vec![0.0, 0.0], vec![3.0, 4.0]]).unwrap(), [5.0, 5.0]);
        assert_eq!(search(5, 1e9).scores(&points(&[7.0])).unwrap(), [0.0]);
    }

    #[test]
    fn archived_behaviours_are_no_longer_novel() {
        let mut novelty = search(1, 4.0);
        assert_eq!(novelty.scores(&points(&[0.0, 0.5, 9.0])).unwrap(), [0.5, 0.5, 8.5]);
        assert_eq!(novelty.archive(), points(&[9.0]));
        assert_eq!(novelty.scores(&points(&[0.0, 0.5, 9.0])).unwrap(), [0.5, 0.5, 0.0]);
        assert_eq!(novelty.archive().len(), 1);
    }

    #[test]
    fn the_threshold_rises_after_many_additions_and_falls_without_any() {
        let config = NoveltyConfig { neighbours: 1, crowd: 2, patience: 6, ..NoveltyConfig::default() };
        let mut novelty = Novelty::new(config).unwrap();
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!((novelty.threshold(), novelty.archive().len()), (1.2, 3));
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!(novelty.threshold(), 1.2);
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!(novelty.threshold(), 1.2 * 0.95);
        novelty.scores(&points(&[0.0, 10.0, 20.0])).unwrap();
        assert_eq!(novelty.threshold(), 1.2 * 0.95, "the count starts again");
    }

    #[test]
    fn invalid_descriptors_are_refused_and_change_nothing() {
        let mut novelty = search(1, 0.1);
        novelty.scores(&points(&[0.0, 1.0])).unwrap();
        let before = novelty.clone();
        let mut refusal = |behaviours: &[Vec<f64>]| novelty.scores(behaviours).unwrap_err().to_string();
        assert_eq!(
            refusal(&[vec![1.0], vec![]]),
            "found behaviour 1 with 0 numbers, wanted 1, the same for all"
        );
        assert_eq!(
            refusal(&[vec![1.0, 2.0]]),
            "found behaviour 0 with 2 numbers, wanted 1, the same for all"
        );
        assert!(
            refusal(&points(&[5.0, f64::NAN])).starts_with("found behaviour 1 with the number NaN, wanted")
        );
        assert!(refusal(&points(&[1e80])).starts_with("found behaviour 0 with the number 1000"));
        assert_eq!(novelty, before);
        assert!(search(1, 1.0).scores(&[vec![]]).is_err());
        let error = Novelty::new(NoveltyConfig { neighbours: 0, ..NoveltyConfig::default() }).unwrap_err();
        assert_eq!(error.to_string(), "found neighbours = 0, wanted 1 to 1000000");
    }

    #[test]
    fn a_damaged_file_is_refused() {
        let mut novelty = search(1, 0.5);
        novelty.scores(&[vec![0.0, 1.0], vec![2.0, 3.0]]).unwrap();
        let json = serde_json::to_string(&novelty).unwrap();
        let refusal =
            |from, to| serde_json::from_str::<Novelty>(&json.replace(from, to)).unwrap_err().to_string();
        assert!(refusal("[2.0,3.0]", "[2.0]").contains("found behaviour 1 with 1 numbers, wanted 2"));
        assert!(refusal("3.0", "1e200").contains("found behaviour 1 with the number"));
        assert!(refusal("\"raise\":1.2", "\"raise\":0.2").contains("found raise = 0.2"));
        assert!(refusal("\"waited\"", "\"waits\"").contains("unknown field `waits`"));
    }

    proptest! {
        #[test]
        fn a_restored_search_continues_bit_for_bit(
            generations in prop::collection::vec(prop::collection::vec(prop::array::uniform2(-5.0..5.0), 6), 1..12),
        ) {
            let mut novelty = search(3, 1.0);
            let mut restored = novelty.clone();
            for behaviours in generations {
                let behaviours: Vec<Vec<f64>> = behaviours.iter().map(|pair| pair.to_vec()).collect();
                restored = serde_json::from_str(&serde_json::to_string(&restored).unwrap()).unwrap();
                prop_assert_eq!(novelty.scores(&behaviours).unwrap(), restored.scores(&behaviours).unwrap());
                prop_assert_eq!(&novelty, &restored);
            }
        }
    }
}
