//! Parameters of NEAT, and presets with their sources.
//!
//! # References
//!
//! - P. Chervenski and S. Ryan, *MultiNEAT* (C++ and Python library), as of November 2015 to June 2016.
//! - K. O. Stanley and R. Miikkulainen (2002), [doi:10.1162/106365602320169811](https://doi.org/10.1162/106365602320169811).
//! - M. Wahby et al. (2016), *An evolutionary robotics approach to the control of plant growth and motion*, Table 1.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::activation::Activation;
use crate::limits::WEIGHT_LIMIT;

/// Parameters of a run of NEAT.
///
/// Start from a preset and change what the task needs:
///
/// | preset | parameters |
/// |---|---|
/// | [`wahby2016`](Self::wahby2016), the [`Default`] | Wahby et al. (2016), Table 1, over MultiNEAT's defaults |
/// | [`multineat`](Self::multineat) | MultiNEAT's defaults |
/// | [`stanley2002`](Self::stanley2002) | Stanley and Miikkulainen (2002), section 4.1 |
/// | [`ball_keeper`](Self::ball_keeper) | `wahby2016` with the further values of MultiNEAT's ball-keeper example |
///
/// The documentation of each field ends with its name and its default value in MultiNEAT. A probability is a number from
/// 0 to 1. Weights of mutations are relative: a mutation has exactly one kind, drawn in proportion to them.
///
/// # Serialisation
///
/// A serialised configuration may omit fields, which then have their value in the [`Default`]: an empty file is the
/// paper's Table 1. Unknown fields are refused.
///
/// ```
/// use tropism_neat::{Activation, Config};
/// let config = Config { population: 150, hidden_activation: Activation::Tanh, ..Config::multineat() };
/// assert!(config.check().is_ok());
/// assert!(Config { population: 1, ..config }.check().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Number of individuals that each generation aims at. Rounding makes populations a few larger. `PopulationSize`, 300.
    pub population: usize,

    /// Largest magnitude of an initial weight; weights are triangular around 0. Argument `RandomizationRange`, 1.
    pub initial_weight_range: f64,
    /// Activation function of output neurons. An argument of MultiNEAT's `Genome`, without a default.
    pub output_activation: Activation,
    /// Activation function of hidden neurons. `ActivationFunction_*_Prob`, unsigned sigmoid.
    pub hidden_activation: Activation,
    /// Slope `a` of every activation function. `MinActivationA` and `MaxActivationA`, 1.
    pub activation_a: f64,
    /// Shift `b` of every activation function. `MinActivationB` and `MaxActivationB`, 0.
    pub activation_b: f64,

    /// Whether the compatibility threshold adapts to the number of species. `DynamicCompatibility`, true.
    pub dynamic_compatibility: bool,
    /// With fewer species than this, the threshold falls. `MinSpecies`, 5.
    pub min_species: usize,
    /// With more species than this, the threshold rises. `MaxSpecies`, 10.
    pub max_species: usize,
    /// Compatibility threshold at the start: the largest distance within a species. `CompatTreshold`, 5.
    pub compat_threshold: f64,
    /// Smallest compatibility threshold. `MinCompatTreshold`, 0.2.
    pub min_compat_threshold: f64,
    /// Amount by which the threshold rises or falls. `CompatTresholdModifier`, 0.3.
    pub compat_threshold_modifier: f64,
    /// Generations between two changes of the threshold. `CompatTreshChangeInterval_Generations`, 1.
    pub compat_threshold_interval: u32,
    /// Distance for each excess link. `ExcessCoeff`, 1.
    pub excess_coeff: f64,
    /// Distance for each disjoint link. `DisjointCoeff`, 1.
    pub disjoint_coeff: f64,
    /// Distance for a mean weight difference of 1 between matching links. `WeightDiffCoeff`, 0.5.
    pub weight_diff_coeff: f64,
    /// Whether excess and disjoint links are divided by the number of links of the larger genome. MultiNEAT never does
    /// this, whatever its `NormalizeGenomeSize` says.
    pub normalize_genome_size: bool,

    /// Species younger than this many generations have their fitness boosted. `YoungAgeTreshold`, 5.
    pub young_age_threshold: u32,
    /// Factor on the fitness of young species. `YoungAgeFitnessBoost`, 1.1.
    pub young_age_fitness_boost: f64,
    /// Species older than this many generations have their fitness reduced. `OldAgeTreshold`, 30.
    pub old_age_threshold: u32,
    /// Factor on the fitness of old species; 1 reduces nothing. `OldAgePenalty`, 1.
    pub old_age_penalty: f64,
    /// A species without improvement for more than this many generations has its fitness multiplied by 1e-7, unless it is
    /// the best species. `SpeciesMaxStagnation`, 50.
    pub species_max_stagnation: u32,

    /// Fraction of a species that may become parents. Of `n` members, ranks 0 to `floor(fraction * n + 1)` may.
    /// `SurvivalRate`, 0.25.
    pub survival_rate: f64,
    /// Probability that a child has two parents. `CrossoverRate`, 0.7.
    pub crossover_rate: f64,
    /// Probability that a child of two parents is mutated; a child of one parent always is. `OverallMutationRate`, 0.25.
    pub overall_mutation_rate: f64,
    /// Probability that the second parent is drawn from a random species. `InterspeciesCrossoverRate`, 0.0001.
    pub interspecies_crossover_rate: f64,
    /// Probability that crossover takes each matching link from either parent; otherwise it averages their weights.
    /// `MultipointCrossoverRate`, 0.75.
    pub multipoint_crossover_rate: f64,
    /// Whether parents are drawn in proportion to fitness from the whole species. Requires a
    /// [`fitness_floor`](Self::fitness_floor). `RouletteWheelSelection`, false.
    pub roulette_wheel_selection: bool,
    /// Tournament selection draws one candidate and this many rivals. 0 draws parents uniformly. `TournamentSize`, 4.
    pub tournament_size: usize,
    /// Fraction of a species that is copied unchanged; at least one member is. `EliteFraction`, 0.01.
    pub elite_fraction: f64,

    /// Weight of the mutation that splits a link by a new neuron. `MutateAddNeuronProb`, 0.01.
    pub mutate_add_neuron_prob: f64,
    /// Weight of the mutation that adds a link. `MutateAddLinkProb`, 0.03.
    pub mutate_add_link_prob: f64,
    /// Weight of the mutation that changes link weights. `MutateWeightsProb`, 0.9.
    pub mutate_weights_prob: f64,
    /// Weight of the mutation that removes a link. `MutateRemLinkProb`, 0.
    pub mutate_rem_link_prob: f64,
    /// Weight of the mutation that replaces a hidden neuron with one incoming and one outgoing link by a link.
    /// `MutateRemSimpleNeuronProb`, 0.
    pub mutate_rem_neuron_prob: f64,

    /// Whether a link that is split stays as a disabled gene, which is inherited and counts in the distance of genomes, as in
    /// Stanley and Miikkulainen (2002). Else it is removed, as in MultiNEAT, and the distance of a split from its parent is
    /// greater by one gene.
    pub disable_split_links: bool,
    /// Whether recurrent links may be split. `SplitRecurrent`, true.
    pub split_recurrent: bool,
    /// Whether links from a neuron to itself may be split. `SplitLoopedRecurrent`, true.
    pub split_looped_recurrent: bool,
    /// Whether links may only lead to greater depth. All networks are then
    /// [feed-forward](crate::Genome::is_feed_forward), and `recurrent_prob` has no effect. MultiNEAT has no such parameter:
    /// with its `RecurrentProb` at 0, two neurons of equal depth may still be linked both ways.
    pub feed_forward: bool,
    /// Adding a neuron or a link makes one random attempt fewer than this. `LinkTries`, 32.
    pub link_tries: u32,
    /// Probability that an added link is recurrent. `RecurrentProb`, 0.25.
    pub recurrent_prob: f64,
    /// Probability that an added recurrent link leads from a neuron to itself. `RecurrentLoopProb`, 0.25.
    pub recurrent_loop_prob: f64,

    /// Probability that a weight mutation is severe: it then perturbs 70 % and replaces 20 % of the weights.
    /// `MutateWeightsSevereProb`, 0.25.
    pub mutate_weights_severe_prob: f64,
    /// Fraction of the weights that any other weight mutation perturbs; it replaces half of the rest, but at most 5 % of
    /// all. `WeightMutationRate`, 1.
    pub weight_mutation_rate: f64,
    /// Largest change of a perturbed weight; changes are triangular around 0. `WeightMutationMaxPower`, 1.
    pub weight_mutation_max_power: f64,
    /// Largest magnitude of a new or replaced weight; such weights are triangular around 0. `WeightReplacementMaxPower`, 1.
    pub weight_replacement_max_power: f64,
    /// Largest magnitude of any weight. `MaxWeight`, 8.
    pub max_weight: f64,

    /// Smallest fitness that selection sees: lower scores are raised to it. Without a floor, negative fitness is legal: it
    /// ranks as it is, and fitness sharing counts it as 0.0001. MultiNEAT leaves this to its caller.
    pub fitness_floor: Option<f64>,
    /// Fitness that each link costs, subtracted before the floor applies. Reported scores do not include it. Not in
    /// MultiNEAT.
    pub complexity_penalty: f64,
}

impl Default for Config {
    /// [`Config::wahby2016`]: what this program is for.
    fn default() -> Self {
        Self::wahby2016()
    }
}

impl Config {
    /// MultiNEAT's defaults of 2015 and 2016.
    ///
    /// MultiNEAT has no default activation function for outputs; here outputs are unsigned sigmoids, as its hidden neurons
    /// are by default.
    #[must_use]
    pub fn multineat() -> Self {
        Self {
            population: 300,
            initial_weight_range: 1.0,
            output_activation: Activation::UnsignedSigmoid,
            hidden_activation: Activation::UnsignedSigmoid,
            activation_a: 1.0,
            activation_b: 0.0,
            dynamic_compatibility: true,
            min_species: 5,
            max_species: 10,
            compat_threshold: 5.0,
            min_compat_threshold: 0.2,
            compat_threshold_modifier: 0.3,
            compat_threshold_interval: 1,
            excess_coeff: 1.0,
            disjoint_coeff: 1.0,
            weight_diff_coeff: 0.5,
            normalize_genome_size: false,
            young_age_threshold: 5,
            young_age_fitness_boost: 1.1,
            old_age_threshold: 30,
            old_age_penalty: 1.0,
            species_max_stagnation: 50,
            survival_rate: 0.25,
            crossover_rate: 0.7,
            overall_mutation_rate: 0.25,
            interspecies_crossover_rate: 0.0001,
            multipoint_crossover_rate: 0.75,
            roulette_wheel_selection: false,
            tournament_size: 4,
            elite_fraction: 0.01,
            mutate_add_neuron_prob: 0.01,
            mutate_add_link_prob: 0.03,
            mutate_weights_prob: 0.9,
            mutate_rem_link_prob: 0.0,
            mutate_rem_neuron_prob: 0.0,
            disable_split_links: false,
            split_recurrent: true,
            split_looped_recurrent: true,
            feed_forward: false,
            link_tries: 32,
            recurrent_prob: 0.25,
            recurrent_loop_prob: 0.25,
            mutate_weights_severe_prob: 0.25,
            weight_mutation_rate: 1.0,
            weight_mutation_max_power: 1.0,
            weight_replacement_max_power: 1.0,
            max_weight: 8.0,
            fitness_floor: None,
            complexity_penalty: 0.0,
        }
    }

    /// The parameters of Stanley and Miikkulainen (2002) for populations of 150, as far as this algorithm has them.
    ///
    /// | field | value | source |
    /// |---|---|---|
    /// | `population` | 150 | section 4.1 |
    /// | `output_activation`, `hidden_activation`, `activation_a` | unsigned sigmoid, 4.9 | section 4.1: 1 / (1 + exp(-4.9 x)) |
    /// | `excess_coeff`, `disjoint_coeff`, `weight_diff_coeff` | 1, 1, 0.4 | section 4.1: c1, c2, c3 |
    /// | `compat_threshold`, `dynamic_compatibility` | 3, false | section 4.1: a fixed threshold of 3 |
    /// | `normalize_genome_size` | false | section 3.3: N may be 1 for genomes of fewer than 20 genes |
    /// | `species_max_stagnation` | 15 | section 4.1 |
    /// | `crossover_rate` | 0.75 | section 4.1: 25 % of the offspring without crossover |
    /// | `interspecies_crossover_rate` | 0.001 | section 4.1 |
    /// | `multipoint_crossover_rate` | 1 | section 3.2: matching genes are inherited randomly |
    /// | `mutate_weights_prob` | 0.8 | section 4.1 |
    /// | `mutate_add_neuron_prob`, `mutate_add_link_prob` | 0.03, 0.05 | section 4.1 |
    /// | `overall_mutation_rate` | 0.88 | sum of these three: a child of two parents then has each mutation with its probability |
    /// | `mutate_weights_severe_prob`, `weight_mutation_rate` | 0, 0.9 | section 4.1: 90 % of the weights are perturbed |
    /// | `weight_mutation_max_power`, `weight_replacement_max_power` | 2.5, 2.5 | `test.ne`: `weigh_mut_power` |
    /// | `survival_rate` | 0.2 | `test.ne`: `survival_thresh` |
    /// | `disable_split_links` | true | section 3.1: the connection gene being split is disabled |
    /// | `recurrent_prob` | 0 | `test.ne`: `recur_only_prob` |
    /// | `link_tries` | 21 (20 attempts) | `test.ne`: `newlink_tries` |
    /// | `young_age_fitness_boost` | 1 | `test.ne`: `age_significance` |
    /// | `tournament_size` | 0 | the article has no tournament: parents are drawn uniformly from the survivors |
    /// | `elite_fraction` | 0 (one champion) | section 4.1 |
    ///
    /// `test.ne` is the parameter file for XOR in the authors' NEAT C++ software. Fields that neither source determines
    /// have MultiNEAT's values. For double pole balancing without velocities the article used `population` 1000,
    /// `weight_diff_coeff` 3, `compat_threshold` 4 and `mutate_add_link_prob` 0.3.
    ///
    /// The algorithm remains MultiNEAT's, so some rules of the article have no counterpart here:
    ///
    /// - A mutation has exactly one kind; the article's kinds are independent of each other.
    /// - Weight changes are triangular, not uniform. Of the weights 5 % are replaced, not 10 %; the other 5 % are kept.
    /// - Every species keeps its champion, not only those with more than five members.
    /// - A stagnant species has its fitness multiplied by 1e-7 instead of losing its offspring.
    #[must_use]
    pub fn stanley2002() -> Self {
        Self {
            population: 150,
            activation_a: 4.9,
            excess_coeff: 1.0,
            disjoint_coeff: 1.0,
            weight_diff_coeff: 0.4,
            compat_threshold: 3.0,
            dynamic_compatibility: false,
            normalize_genome_size: false,
            species_max_stagnation: 15,
            crossover_rate: 0.75,
            interspecies_crossover_rate: 0.001,
            multipoint_crossover_rate: 1.0,
            mutate_weights_prob: 0.8,
            mutate_add_neuron_prob: 0.03,
            mutate_add_link_prob: 0.05,
            overall_mutation_rate: 0.88,
            mutate_weights_severe_prob: 0.0,
            weight_mutation_rate: 0.9,
            weight_mutation_max_power: 2.5,
            weight_replacement_max_power: 2.5,
            survival_rate: 0.2,
            disable_split_links: true,
            recurrent_prob: 0.0,
            link_tries: 21,
            young_age_fitness_boost: 1.0,
            tournament_size: 0,
            elite_fraction: 0.0,
            ..Self::multineat()
        }
    }

    /// The parameters of Wahby et al. (2016): their Table 1, and MultiNEAT's defaults for everything that it omits.
    ///
    /// The article says "an unsigned step activation function"; output and hidden neurons are therefore unsigned steps.
    /// Its `Elitism` is taken for MultiNEAT's `EliteFraction`.
    #[must_use]
    pub fn wahby2016() -> Self {
        Self {
            population: 50,
            output_activation: Activation::UnsignedStep,
            hidden_activation: Activation::UnsignedStep,
            dynamic_compatibility: true,
            min_species: 5,
            max_species: 25,
            young_age_threshold: 15,
            young_age_fitness_boost: 1.0,
            survival_rate: 0.6,
            crossover_rate: 0.5,
            overall_mutation_rate: 0.5,
            elite_fraction: 0.1,
            mutate_add_neuron_prob: 0.04,
            mutate_weights_prob: 0.9,
            weight_mutation_rate: 0.75,
            weight_replacement_max_power: 5.0,
            ..Self::multineat()
        }
    }

    /// [`wahby2016`](Self::wahby2016) with the values of MultiNEAT's example `ball_keeper.py` that Table 1 does not list.
    ///
    /// Table 1 seems to descend from that example, with which it shares five unusual values. The fitness floor of 0.0001 is
    /// ours: roulette wheel selection needs one.
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
            ..Self::wahby2016()
        }
    }

    /// Checks that every parameter lies in its range and that all are consistent.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] names the first wrong parameter, its value and its range.
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
    /// Roulette wheel selection needs fitness that is not negative.
    #[error(
        "found roulette_wheel_selection = true without a fitness_floor, wanted a fitness_floor of 0 or more"
    )]
    RouletteWithoutFloor,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid() {
        let presets =
            [Config::multineat(), Config::stanley2002(), Config::wahby2016(), Config::ball_keeper()];
        for preset in presets {
            assert_eq!(preset.check(), Ok(()));
        }
    }

    #[test]
    fn a_parameter_out_of_range_is_named_with_its_value() {
        let error = Config { survival_rate: 1.5, ..Config::wahby2016() }.check().unwrap_err();
        assert_eq!(error.to_string(), "found survival_rate = 1.5, wanted 0 to 1");
        assert!(Config { max_weight: f64::NAN, ..Config::wahby2016() }.check().is_err());
        assert!(Config { max_weight: 1e308, ..Config::wahby2016() }.check().is_err());
        assert!(Config { max_species: 4, ..Config::wahby2016() }.check().is_err());
        let roulette = Config { roulette_wheel_selection: true, ..Config::wahby2016() };
        assert_eq!(roulette.check(), Err(ConfigError::RouletteWithoutFloor));
    }

    #[test]
    fn omitted_keys_have_their_defaults_and_unknown_keys_are_refused() {
        let config: Config = serde_json::from_str(r#"{"population": 80}"#).unwrap();
        assert_eq!(config, Config { population: 80, ..Config::wahby2016() });
        assert_eq!(serde_json::from_str::<Config>("{}").unwrap(), Config::default());
        assert_eq!(Config::default(), Config::wahby2016());
        let error = serde_json::from_str::<Config>(r#"{"popluation": 80}"#).unwrap_err().to_string();
        assert!(error.contains("popluation"), "{error}");
    }

    #[test]
    fn wahby2016_has_the_values_of_table_1_and_else_of_multineat() {
        let json = serde_json::to_string(&Config::wahby2016()).unwrap();
        assert_eq!(
            json,
            concat!(
                r#"{"population":50,"initial_weight_range":1.0,"output_activation":"unsigned_step","#,
                r#""hidden_activation":"unsigned_step","activation_a":1.0,"activation_b":0.0,"#,
                r#""dynamic_compatibility":true,"min_species":5,"max_species":25,"compat_threshold":5.0,"#,
                r#""min_compat_threshold":0.2,"compat_threshold_modifier":0.3,"compat_threshold_interval":1,"#,
                r#""excess_coeff":1.0,"disjoint_coeff":1.0,"weight_diff_coeff":0.5,"normalize_genome_size":false,"#,
                r#""young_age_threshold":15,"young_age_fitness_boost":1.0,"old_age_threshold":30,"#,
                r#""old_age_penalty":1.0,"species_max_stagnation":50,"survival_rate":0.6,"crossover_rate":0.5,"#,
                r#""overall_mutation_rate":0.5,"interspecies_crossover_rate":0.0001,"#,
                r#""multipoint_crossover_rate":0.75,"roulette_wheel_selection":false,"tournament_size":4,"#,
                r#""elite_fraction":0.1,"mutate_add_neuron_prob":0.04,"mutate_add_link_prob":0.03,"#,
                r#""mutate_weights_prob":0.9,"mutate_rem_link_prob":0.0,"mutate_rem_neuron_prob":0.0,"disable_split_links":false,"#,
                r#""split_recurrent":true,"split_looped_recurrent":true,"feed_forward":false,"link_tries":32,"#,
                r#""recurrent_prob":0.25,"recurrent_loop_prob":0.25,"mutate_weights_severe_prob":0.25,"#,
                r#""weight_mutation_rate":0.75,"weight_mutation_max_power":1.0,"#,
                r#""weight_replacement_max_power":5.0,"max_weight":8.0,"fitness_floor":null,"#,
                r#""complexity_penalty":0.0}"#,
            )
        );
    }
}
