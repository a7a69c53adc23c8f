//! The reference runs of MultiNEAT, ours beside them, and how likely the difference is if both are one algorithm.
//!
//! Of eight reference runs only a summary is known: least, quartiles, median and greatest best fitness, and one middle
//! value each of links and species. No test can be better than that. What the summary leaves open is shown, not assumed:
//! see [`compare`] and [`p_of_median`].

use std::path::PathBuf;

use serde::Serialize;
use std::ops::ControlFlow;

use tropism::evolve::{Evolution, EvolutionConfig};
use tropism::math::rank_test::mann_whitney;
use tropism::math::statistics::five_numbers;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::task::{Reading, Task};
use tropism::track::Track;
use tropism_neat::{Config, Generation};

/// Runs behind every row of [`TABLE`].
pub(crate) const REFERENCE_RUNS: usize = 8;

/// Generations evaluated after which both are compared.
pub(crate) const GENERATIONS: [u32; 6] = [50, 100, 200, 500, 1000, 2000];

/// What MultiNEAT did with a preset after some generations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Reference {
    /// Least, first quartile, median, third quartile and greatest best fitness so far, in cm, over eight runs.
    pub(crate) best: [f64; 5],
    /// Links of a network, on average.
    pub(crate) links: f64,
    /// Species.
    pub(crate) species: Option<f64>,
}

/// A preset and what MultiNEAT did with it after each of [`GENERATIONS`]: MultiNEAT of 2016, built natively, on the data of
/// `synthetic-swing`, one activation a step, nothing flushed, step neurons everywhere.
pub(crate) struct Preset {
    /// Its name.
    pub(crate) name: &'static str,
    /// Our parameters.
    pub(crate) config: fn() -> Config,
    /// Their results.
    pub(crate) reference: [Reference; 6],
}

const fn row(best: [f64; 5], links: f64, species: Option<f64>) -> Reference {
    Reference { best, links, species }
}

/// The reference runs.
pub(crate) const TABLE: [Preset; 2] = [
    Preset {
        name: "wahby2016",
        config: Config::wahby2016,
        reference: [
            row([3.0, 5.7, 6.2, 6.9, 8.1], 8.0, Some(23.0)),
            row([3.0, 6.0, 6.8, 7.0, 9.9], 10.0, Some(16.0)),
            row([3.9, 7.0, 7.3, 10.8, 11.2], 15.0, Some(12.0)),
            row([6.0, 11.2, 11.5, 11.6, 14.1], 34.0, Some(16.0)),
            row([6.6, 11.4, 11.6, 12.7, 14.4], 68.0, Some(14.0)),
            row([7.0, 11.6, 11.9, 12.7, 14.4], 139.0, Some(12.0)),
        ],
    },
    Preset {
        name: "ball_keeper",
        config: Config::ball_keeper,
        reference: [
            row([3.7, 4.1, 5.3, 6.5, 10.5], 8.0, None),
            row([4.1, 5.0, 6.1, 6.9, 11.1], 9.0, None),
            row([4.5, 6.5, 7.0, 10.5, 11.4], 12.0, None),
            row([4.7, 11.3, 11.3, 11.5, 12.7], 24.0, None),
            row([4.8, 11.5, 11.6, 11.6, 13.1], 47.0, None),
            row([11.5, 11.6, 11.6, 12.0, 13.7], 97.0, None),
        ],
    },
];

/// What to say where there is no data set.
pub(crate) const SKIPPED: &str = "skipped: TROPISM_DATA is not set, so there is no synthetic-swing to read";

/// The model of `synthetic-swing` in the folder that `TROPISM_DATA` names; `None` where it names none.
pub(crate) fn model() -> Option<Result<TipModel, String>> {
    let folder = PathBuf::from(std::env::var_os("TROPISM_DATA")?).join("synthetic-swing");
    let track = |number| {
        let file = folder.join(format!("experiment-{number}.csv"));
        let failed = |error: &dyn std::error::Error| format!("{}: {error}", file.display());
        Track::read_csv(std::fs::File::open(&file).map_err(|error| failed(&error))?)
            .map_err(|error| failed(&error))
    };
    let tracks = (1..=6).map(track).collect::<Result<Vec<_>, String>>();
    Some(tracks.and_then(|tracks| {
        TipModel::fit(&tracks, TipModelConfig::default()).map_err(|error| error.to_string())
    }))
}

/// The histories of `runs` runs of so many generations.
pub(crate) fn histories(
    model: &TipModel,
    neat: Config,
    seed: u64,
    runs: u32,
    generations: u32,
) -> Vec<Vec<Generation>> {
    let config = EvolutionConfig { runs, generations, neat, ..EvolutionConfig::default() };
    // MultiNEAT was given eq. (9) to the letter.
    let task = Task::default().by(Reading::Letter);
    let evolution = Evolution::new(model, &task, config, seed).expect("a preset is sound");
    let runs = evolution.evolve(&|_run, _generation| ControlFlow::Continue(())).expect("a preset is sound");
    runs.expect("never broken off").into_iter().map(|run| run.history).collect()
}

/// Our runs beside the reference after some generations.
#[derive(Debug, Serialize)]
pub(crate) struct Comparison {
    /// Name of the preset.
    pub(crate) preset: &'static str,
    /// Generations printed.
    pub(crate) generations: u32,
    /// What MultiNEAT did.
    pub(crate) reference: Reference,
    /// Least, first quartile, median, third quartile and greatest best fitness of ours.
    pub(crate) best: [f64; 5],
    /// Two-sided p of the rank-sum test on best fitness, the reference's quarters filled in the middle way: each quartile
    /// twice.
    pub(crate) p_best: f64,
    /// The same with all that the summary leaves open at one end and at the other, or 1 if the difference changes sign between.
    pub(crate) p_best_range: [f64; 2],
    /// Median over our runs of the mean number of links.
    pub(crate) links: f64,
    /// Bound on the two-sided p that the reference's links are a median of eight of ours.
    pub(crate) p_links: f64,
    /// Median number of species.
    pub(crate) species: f64,
    /// The same bound for species.
    pub(crate) p_species: Option<f64>,
}

/// Compares runs with the reference after each of [`GENERATIONS`] that they have reached.
///
/// Eight values with a known summary are known up to intervals: the second lies between the least and the first quartile, the
/// third and fourth between that and the median, and so on, whichever way quartiles are reckoned. The rank sum is greatest
/// with all of them at the upper ends and least with all at the lower ends; p is given for both, and for each quartile taken
/// twice. Ours are rounded to a tenth like the reference, so that equal plateaus are ties.
pub(crate) fn compare(preset: &Preset, histories: &[Vec<Generation>]) -> Vec<Comparison> {
    let reached = histories.iter().map(Vec::len).min().unwrap_or(0);
    let rows = GENERATIONS.iter().zip(&preset.reference).filter(|row| *row.0 as usize <= reached);
    rows.map(|(&generations, reference)| {
        let column = |value: fn(&Generation) -> f64| -> Vec<f64> {
            histories.iter().map(|history| value(&history[generations as usize - 1])).collect()
        };
        let best = column(|g| (10.0 * g.best_ever).round() / 10.0);
        let (links, species) = (column(|g| g.links_mean), column(|g| g.species as f64));
        let [least, lower, middle, upper, greatest] = reference.best;
        let p_with = |eight: [f64; REFERENCE_RUNS]| p_of_rank_sum(&eight, &best);
        let low = [least, least, lower, lower, middle, middle, upper, greatest];
        let between = [least, lower, lower, middle, middle, upper, upper, greatest];
        let high = [least, lower, middle, middle, upper, upper, greatest, greatest];
        let ([p_low, side_low], [p_high, side_high]) = (p_with(low), p_with(high));
        let p_best = p_with(between)[0];
        let p_most = if side_low * side_high <= 0.0 { 1.0 } else { p_low.max(p_best).max(p_high) };
        Comparison {
            preset: preset.name,
            generations,
            reference: *reference,
            best: summary(&best),
            p_best,
            p_best_range: [p_low.min(p_best).min(p_high), p_most],
            links: summary(&links)[2],
            p_links: p_of_median(reference.links, &links),
            species: summary(&species)[2],
            p_species: reference.species.map(|median| p_of_median(median, &species)),
        }
    })
    .collect()
}

/// Minimum, quartiles and maximum of at least one value.
pub(crate) fn summary(values: &[f64]) -> [f64; 5] {
    five_numbers(values).expect("at least one value")
}

/// The two-sided p of the Mann-Whitney U test, ties counted, and how far U of `few` lies above what is expected.
pub(crate) fn p_of_rank_sum(few: &[f64], others: &[f64]) -> [f64; 2] {
    let test = mann_whitney(few, others).expect("finite values");
    [test.p, test.u - (few.len() * others.len()) as f64 / 2.0]
}

/// A bound from above on the two-sided p that `median` is the median of eight values from the distribution of `ours`.
///
/// The median lies between the fourth and the fifth of eight. How many of ours fall below the fifth, and above the fourth,
/// has a known distribution whatever that of the values; at least as many of ours as lie below (above) the median must.
/// Equal values count on both sides.
pub(crate) fn p_of_median(median: f64, ours: &[f64]) -> f64 {
    // In whole numbers, as the reference is.
    let ours: Vec<f64> = ours.iter().map(|value| value.round()).collect();
    let below = ours.iter().filter(|value| **value < median).count();
    let above = ours.iter().filter(|value| **value > median).count();
    let choose = |n: usize, k: usize| (0..k).fold(1.0, |ways, i| ways * (n - i) as f64 / (i + 1) as f64);
    let (n, half) = (ours.len(), REFERENCE_RUNS / 2);
    // Exactly `count` of ours lie below the fifth: they mingle with four, the rest with the three above.
    let exactly = |count: usize| choose(count + half, half) * choose(n - count + half - 1, half - 1);
    let tail: f64 = (below.max(above)..=n).map(exactly).sum();
    (2.0 * tail / choose(n + REFERENCE_RUNS, REFERENCE_RUNS)).min(1.0)
}
