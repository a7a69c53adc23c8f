//! The parameters of NEAT, with the paper's Table 1 as their default.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Activation;
use crate::genome::WEIGHT_LIMIT;

/// Parameters of a run of NEAT.
///
/// The default is the paper: its Table 1, and MultiNEAT's defaults for whatever Table 1 does not list. MultiNEAT's own
/// spelling stands in brackets; a probability is a number from 0 to 1.
///
/// ```
/// use tropism_neat::{Activation, Config};
/// let config = Config { population: 150, hidden_activation: Activation::UnsignedSigmoid, ..Config::paper() };
/// assert!(config.check().is_ok());
/// assert!(Config { population: 1, ..config }.check().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Individuals that every generation aims at (`PopulationSize`; Table 1: 50). Rounding makes it drift up by a few.
    pub population: usize,

    /// Largest weight of an initial population: each is a signed draw times this (`RandomizationRange`; 1).
    pub initial_weight_range: f64,
    /// Activation of output neurons (argument of MultiNEAT's `Genome`; the paper: unsigned step).
    pub output_activation: Activation,
    /// Activation of hidden neurons (`ActivationFunction_*_Prob`). The paper says "an unsigned step activation function";
    /// MultiNEAT's own default is the unsigned sigmoid.
    pub hidden_activation: Activation,
    /// Slope `a` of every activation (`MinActivationA` = `MaxActivationA`; 1).
    pub activation_a: f64,
    /// Shift `b` of every activation (`MinActivationB` = `MaxActivationB`; 0).
    pub activation_b: f64,

    /// Whether the compatibility threshold follows the number of species (`DynamicCompatibility`; Table 1: true).
    pub dynamic_compatibility: bool,
    /// Below this many species the threshold falls (`MinSpecies`; Table 1: 5).
    pub min_species: usize,
    /// Above this many species the threshold rises (`MaxSpecies`; Table 1: 25).
    pub max_species: usize,
    /// Distance up to which two genomes are of one species, at the start (`CompatTreshold`; 5).
    pub compat_threshold: f64,
    /// The threshold never falls below this (`MinCompatTreshold`; 0.2).
    pub min_compat_threshold: f64,
    /// How far the threshold moves at once (`CompatTresholdModifier`; 0.3).
    pub compat_threshold_modifier: f64,
    /// Generations between two moves of the threshold (`CompatTreshChangeInterval_Generations`; 1).
    pub compat_threshold_interval: u32,
    /// Distance that an excess link adds (`ExcessCoeff`; 1).
    pub excess_coeff: f64,
    /// Distance that a disjoint link adds (`DisjointCoeff`; 1).
    pub disjoint_coeff: f64,
    /// Distance that a mean weight difference of 1 in the matching links adds (`WeightDiffCoeff`; 0.5).
    pub weight_diff_coeff: f64,
    /// Whether excess and disjoint links are divided by the longer genome's links (`NormalizeGenomeSize`; false).
    pub normalize_genome_size: bool,

    /// Species younger than this have their fitness boosted (`YoungAgeTreshold`; Table 1: 15 generations).
    pub young_age_threshold: u32,
    /// The boost of young species (`YoungAgeFitnessBoost`; Table 1: 1, which is none).
    pub young_age_fitness_boost: f64,
    /// Species older than this are punished (`OldAgeTreshold`; 30 generations).
    pub old_age_threshold: u32,
    /// The factor on the fitness of old species (`OldAgePenalty`; 1, which is none).
    pub old_age_penalty: f64,
    /// A species without improvement for longer than this all but dies out (`SpeciesMaxStagnation`; 50 generations).
    pub species_max_stagnation: u32,

    /// Share of a species that may become parents (`SurvivalRate`; Table 1: 0.6).
    pub survival_rate: f64,
    /// Probability that a child has two parents (`CrossoverRate`; Table 1: 0.5).
    pub crossover_rate: f64,
    /// Probability that a child of two parents is mutated as well (`OverallMutationRate`; Table 1: 0.5).
    pub overall_mutation_rate: f64,
    /// Probability that the second parent may come from any species (`InterspeciesCrossoverRate`; 0.0001).
    pub interspecies_crossover_rate: f64,
    /// Probability that matching links are taken from either parent rather than averaged (`MultipointCrossoverRate`; 0.75).
    pub multipoint_crossover_rate: f64,
    /// Whether parents are drawn in proportion to fitness over the whole species (`RouletteWheelSelection`; false).
    /// Asks for a [`fitness_floor`](Self::fitness_floor).
    pub roulette_wheel_selection: bool,
    /// Rivals that a parent has to beat (`TournamentSize`; 4).
    pub tournament_size: usize,
    /// Share of a species that is copied unchanged, at least one individual (`EliteFraction`; Table 1's `Elitism`: 0.1).
    pub elite_fraction: f64,

    /// Weight of the mutation that splits a link by a new neuron (`MutateAddNeuronProb`; Table 1: 0.04).
    pub mutate_add_neuron_prob: f64,
    /// Weight of the mutation that adds a link (`MutateAddLinkProb`; 0.03).
    pub mutate_add_link_prob: f64,
    /// Weight of the mutation that changes link weights (`MutateWeightsProb`; Table 1: 0.9).
    pub mutate_weights_prob: f64,
    /// Weight of the mutation that removes a link (`MutateRemLinkProb`; 0).
    pub mutate_rem_link_prob: f64,
    /// Weight of the mutation that replaces a neuron with one link in and one out by a link
    /// (`MutateRemSimpleNeuronProb`; 0).
    pub mutate_rem_neuron_prob: f64,

    /// Whether recurrent links may be split (`SplitRecurrent`; true).
    pub split_recurrent: bool,
    /// Whether links from a neuron to itself may be split (`SplitLoopedRecurrent`; true).
    pub split_looped_recurrent: bool,
    /// Whether links only ever lead to greater depth, so that networks can be run by
    /// [`activate_feed_forward`](crate::Network::activate_feed_forward) without any delay; `recurrent_prob` is then without
    /// effect. (Not in MultiNEAT, where two neurons of equal depth may be linked both ways.)
    pub feed_forward: bool,
    /// One more than the random picks that adding a neuron or a link may take (`LinkTries`; 32).
    pub link_tries: u32,
    /// Probability that an added link is recurrent (`RecurrentProb`; 0.25).
    pub recurrent_prob: f64,
    /// Probability that an added recurrent link joins a neuron to itself (`RecurrentLoopProb`; 0.25).
    pub recurrent_loop_prob: f64,

    /// Probability that a weight mutation is severe (`MutateWeightsSevereProb`; 0.25).
    pub mutate_weights_severe_prob: f64,
    /// Share of the weights that a mild weight mutation perturbs (`WeightMutationRate`; Table 1: 0.75).
    pub weight_mutation_rate: f64,
    /// Largest change of a perturbed weight (`WeightMutationMaxPower`; 1).
    pub weight_mutation_max_power: f64,
    /// Largest size of a replaced weight (`WeightReplacementMaxPower`; Table 1's `WeightReplacementMax`: 5).
    pub weight_replacement_max_power: f64,
    /// Largest size of any weight (`MaxWeight`; 8).
    pub max_weight: f64,

    /// Smallest fitness that selection sees; smaller scores count as this much. Without it negative fitness is legal: it is
    /// ranked as it is and shared as 0.0001. (MultiNEAT leaves this to the caller.)
    pub fitness_floor: Option<f64>,
    /// What every link costs in fitness, before the floor; 0 is none. Scores are reported without it. (Not in MultiNEAT.)
    pub complexity_penalty: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self::paper()
    }
}

impl Config {
    /// The paper's Table 1, and MultiNEAT's defaults for everything that it does not list.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            population: 50,
            initial_weight_range: 1.0,
            output_activation: Activation::UnsignedStep,
            hidden_activation: Activation::UnsignedStep,
            activation_a: 1.0,
            activation_b: 0.0,
            dynamic_compatibility: true,
            min_species: 5,
            max_species: 25,
            compat_threshold: 5.0,
            min_compat_threshold: 0.2,
            compat_threshold_modifier: 0.3,
            compat_threshold_interval: 1,
            excess_coeff: 1.0,
            disjoint_coeff: 1.0,
            weight_diff_coeff: 0.5,
            normalize_genome_size: false,
            young_age_threshold: 15,
            young_age_fitness_boost: 1.0,
            old_age_threshold: 30,
            old_age_penalty: 1.0,
            species_max_stagnation: 50,
            survival_rate: 0.6,
            crossover_rate: 0.5,
            overall_mutation_rate: 0.5,
            interspecies_crossover_rate: 0.0001,
            multipoint_crossover_rate: 0.75,
            roulette_wheel_selection: false,
            tournament_size: 4,
            elite_fraction: 0.1,
            mutate_add_neuron_prob: 0.04,
            mutate_add_link_prob: 0.03,
            mutate_weights_prob: 0.9,
            mutate_rem_link_prob: 0.0,
            mutate_rem_neuron_prob: 0.0,
            split_recurrent: true,
            split_looped_recurrent: true,
            feed_forward: false,
            link_tries: 32,
            recurrent_prob: 0.25,
            recurrent_loop_prob: 0.25,
            mutate_weights_severe_prob: 0.25,
            weight_mutation_rate: 0.75,
            weight_mutation_max_power: 1.0,
            weight_replacement_max_power: 5.0,
            max_weight: 8.0,
            fitness_floor: None,
            complexity_penalty: 0.0,
        }
    }

    /// Table 1 with what MultiNEAT's ball-keeper example sets beyond it, and from which Table 1 seems to descend.
    #[must_use]
    pub fn ball_keeper() -> Self {
        Self {
            old_age_threshold: 35,
            species_max_stagnation: 100,
            roulette_wheel_selection: true,
            recurrent_prob: 0.0,
            mutate_weights_severe_prob: 0.01,
            max_weight: 20.0,
            mutate_add_link_prob: 0.02,
            fitness_floor: Some(1e-4),
            ..Self::paper()
        }
    }

    /// Whether every parameter lies in its range, and all of them go together.
    ///
    /// # Errors
    ///
    /// The first parameter that does not, with its value and what was wanted.
    pub fn check(&self) -> Result<(), ConfigError> {
        let weight = |size: f64| (size, 0.0, WEIGHT_LIMIT);
        let probability = |p: f64| (p, 0.0, 1.0);
        let factor = |f: f64| (f, 0.0, 1e6);
        let count = |n: usize, low: f64| (n as f64, low, 1e6);
        let generations = |n: u32, low: f64| (f64::from(n), low, f64::from(u32::MAX));
        for (key, (value, low, high)) in [
            ("population", count(self.population, 2.0)),
            ("initial_weight_range", (self.initial_weight_range, 0.0, self.max_weight)),
            ("activation_a", (self.activation_a, -1e6, 1e6)),
            ("activation_b", (self.activation_b, -1e6, 1e6)),
            ("min_species", count(self.min_species, 0.0)),
            ("max_species", count(self.max_species, self.min_species as f64)),
            ("compat_threshold", factor(self.compat_threshold)),
            ("min_compat_threshold", factor(self.min_compat_threshold)),
            ("compat_threshold_modifier", factor(self.compat_threshold_modifier)),
            ("compat_threshold_interval", generations(self.compat_threshold_interval, 1.0)),
            ("excess_coeff", factor(self.excess_coeff)),
            ("disjoint_coeff", factor(self.disjoint_coeff)),
            ("weight_diff_coeff", factor(self.weight_diff_coeff)),
            ("young_age_threshold", generations(self.young_age_threshold, 0.0)),
            ("young_age_fitness_boost", (self.young_age_fitness_boost, 1e-6, 1e6)),
            ("old_age_threshold", generations(self.old_age_threshold, 0.0)),
            ("old_age_penalty", (self.old_age_penalty, 1e-6, 1e6)),
            ("survival_rate", probability(self.survival_rate)),
            ("crossover_rate", probability(self.crossover_rate)),
            ("overall_mutation_rate", probability(self.overall_mutation_rate)),
            ("interspecies_crossover_rate", probability(self.interspecies_crossover_rate)),
            ("multipoint_crossover_rate", probability(self.multipoint_crossover_rate)),
            ("tournament_size", count(self.tournament_size, 0.0)),
            ("elite_fraction", probability(self.elite_fraction)),
            ("mutate_add_neuron_prob", probability(self.mutate_add_neuron_prob)),
            ("mutate_add_link_prob", probability(self.mutate_add_link_prob)),
            ("mutate_weights_prob", (self.mutate_weights_prob, 1e-6, 1.0)),
            ("mutate_rem_link_prob", probability(self.mutate_rem_link_prob)),
            ("mutate_rem_neuron_prob", probability(self.mutate_rem_neuron_prob)),
            ("link_tries", (f64::from(self.link_tries), 1.0, 1e4)),
            ("recurrent_prob", probability(self.recurrent_prob)),
            ("recurrent_loop_prob", probability(self.recurrent_loop_prob)),
            ("mutate_weights_severe_prob", probability(self.mutate_weights_severe_prob)),
            ("weight_mutation_rate", probability(self.weight_mutation_rate)),
            ("weight_mutation_max_power", weight(self.weight_mutation_max_power)),
            ("weight_replacement_max_power", weight(self.weight_replacement_max_power)),
            ("max_weight", weight(self.max_weight)),
            ("complexity_penalty", factor(self.complexity_penalty)),
            ("fitness_floor", (self.fitness_floor.unwrap_or(0.0), 0.0, 1e6)),
        ] {
            if !(low..=high).contains(&value) {
                return Err(ConfigError::Range { key, value, low, high });
            }
        }
        if self.roulette_wheel_selection && self.fitness_floor.is_none() {
            return Err(ConfigError::RouletteWithoutFloor);
        }
        Ok(())
    }
}

/// A parameter that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
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
    /// Roulette wheel selection needs fitness that is not negative.
    #[error("`roulette_wheel_selection` is true without a `fitness_floor`: wanted a floor of 0 or more")]
    RouletteWithoutFloor,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_presets_are_sound_and_the_paper_is_the_default() {
        assert_eq!(Config::paper().check(), Ok(()));
        assert_eq!(Config::ball_keeper().check(), Ok(()));
        assert_eq!(Config::default(), Config::paper());
    }

    #[test]
    fn a_parameter_out_of_range_is_named_with_its_value() {
        let error = Config { survival_rate: 1.5, ..Config::paper() }.check().unwrap_err();
        assert_eq!(error.to_string(), "`survival_rate` is 1.5: wanted 0 to 1");
        assert!(Config { max_weight: f64::NAN, ..Config::paper() }.check().is_err());
        assert!(Config { max_weight: 1e308, ..Config::paper() }.check().is_err());
        assert!(Config { max_species: 4, ..Config::paper() }.check().is_err());
        let roulette = Config { roulette_wheel_selection: true, ..Config::paper() };
        assert_eq!(roulette.check(), Err(ConfigError::RouletteWithoutFloor));
    }

    #[test]
    fn missing_keys_are_the_paper_and_unknown_ones_are_refused() {
        let config: Config = serde_json::from_str(r#"{"population": 80}"#).unwrap();
        assert_eq!(config, Config { population: 80, ..Config::paper() });
        let error = serde_json::from_str::<Config>(r#"{"popluation": 80}"#).unwrap_err().to_string();
        assert!(error.contains("popluation"), "{error}");
    }
}
