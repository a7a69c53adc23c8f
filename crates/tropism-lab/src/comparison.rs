//! Independent samples compared pair by pair: which of several settings, evolutions or studies differ.

use serde::{Deserialize, Serialize};
use tropism::math::rank_test::{self, RankTest};
use tropism::math::statistics::median;
use tropism_report::Table;

/// Corrected p-values below this one are called a difference: the convention.
pub const SIGNIFICANT: f64 = 0.05;

/// Values of one kind under a name, such as the best fitness of each run of an evolution.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NamedSample {
    pub(crate) name: String,
    pub(crate) values: Vec<f64>,
}

/// Two samples compared by a Mann-Whitney U test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SamplePair {
    /// Name of the first sample.
    pub one: String,
    /// Name of the second.
    pub other: String,
    /// Number of values of each.
    pub sizes: [usize; 2],
    /// Median of the first minus that of the second.
    pub median_difference: f64,
    /// U of the first sample.
    pub u: f64,
    /// Two-sided p-value.
    pub p: f64,
    /// Whether `p` is exact, and no normal approximation.
    pub is_exact: bool,
    /// `p` after Holm's correction over all pairs of this comparison.
    pub p_holm: f64,
    /// Vargha and Delaney's A: the probability that a value of the first is greater than one of the second, ties as half.
    pub superiority: f64,
}

impl SamplePair {
    /// Whether the two differ, at 5 % after Holm's correction.
    #[must_use]
    pub fn is_different(&self) -> bool {
        self.p_holm < SIGNIFICANT
    }
}

/// Compares each two of `samples`. A sample without values is in no pair.
pub(crate) fn all_pairs(samples: &[NamedSample]) -> Vec<SamplePair> {
    let mut pairs: Vec<SamplePair> = (samples.iter().enumerate())
        .flat_map(|(place, one)| samples[place + 1..].iter().filter_map(move |other| pair(one, other)))
        .collect();
    let corrected = rank_test::holm(&pairs.iter().map(|pair| pair.p).collect::<Vec<f64>>());
    for (pair, p_holm) in pairs.iter_mut().zip(corrected) {
        pair.p_holm = p_holm;
    }
    pairs
}

fn pair(one: &NamedSample, other: &NamedSample) -> Option<SamplePair> {
    let RankTest { u, p, is_exact, superiority } = rank_test::mann_whitney(&one.values, &other.values)?;
    Some(SamplePair {
        one: one.name.clone(),
        other: other.name.clone(),
        sizes: [one.values.len(), other.values.len()],
        median_difference: median(&one.values) - median(&other.values),
        u,
        p,
        is_exact,
        p_holm: p,
        superiority,
    })
}

/// The pairs as a table of a report. `what` is what the values are, in the plural, and `unit` theirs.
pub(crate) fn pair_table(pairs: &[SamplePair], what: &str, unit: &str) -> Table {
    let row = |pair: &SamplePair| {
        vec![
            format!("{} and {}", pair.one, pair.other),
            pair.sizes.map(|size| size.to_string()).join(", "),
            format!("{:+.2}", pair.median_difference),
            format!("{}", pair.u),
            format!("{}{}", p_text(pair.p), if pair.is_exact { "" } else { " (approximate)" }),
            p_text(pair.p_holm),
            format!("{:.2}", pair.superiority),
            if pair.is_different() { "yes" } else { "no" }.to_owned(),
        ]
    };
    let difference = format!("Difference of medians ({unit})");
    let head = ["Pair", "Sizes", &difference, "U", "p", "p after Holm", "A", "They differ"];
    Table {
        title: "Which differ".to_owned(),
        caption: format!(
            "Two-sided Mann-Whitney U tests of {what}; p is exact where the product of the sizes is at most 1600, else by the normal \
             approximation with correction for ties. Holm's correction is over all pairs of this table; pairs below 0.05 are said to differ. A \
             (Vargha and Delaney) is the probability that a value of the first is greater than one of the second: 0.5 is no \
             effect, 0.56, 0.64 and 0.71 or as far below are small, medium and large ones. No difference found is not \
             equality: few values find large effects only."
        ),
        head: head.map(str::to_owned).to_vec(),
        rows: pairs.iter().map(row).collect(),
    }
}

/// A p-value for people.
#[must_use]
pub fn p_text(p: f64) -> String {
    if p < 0.0001 { "< 0.0001".to_owned() } else { format!("{p:.4}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(name: &str, from: f64) -> NamedSample {
        let values = (0..8).map(|index| from + f64::from(index) / 10.0).collect();
        NamedSample { name: name.to_owned(), values }
    }

    #[test]
    fn pairs_are_corrected_together() {
        let empty = NamedSample { name: "none".to_owned(), values: Vec::new() };
        let pairs = all_pairs(&[sample("a", 0.0), sample("b", 5.0), empty, sample("c", 0.05)]);
        let names: Vec<_> = pairs.iter().map(|pair| (pair.one.as_str(), pair.other.as_str())).collect();
        assert_eq!(names, [("a", "b"), ("a", "c"), ("b", "c")]);
        assert_eq!(pairs.iter().map(SamplePair::is_different).collect::<Vec<_>>(), [true, false, true]);
        // Two of all 12870 deals are as far apart.
        assert!(
            (pairs[0].p - 2.0 / 12870.0).abs() < 1e-15 && (pairs[0].p_holm - 6.0 / 12870.0).abs() < 1e-15
        );
        assert_eq!((pairs[0].superiority, pairs[0].median_difference), (0.0, -5.0));
        let table = pair_table(&pairs, "values", "cm");
        assert_eq!(table.rows[0][5..], ["0.0005", "0.00", "yes"]);
        assert!(table.rows.iter().all(|row| row.len() == table.head.len()));
    }
}
