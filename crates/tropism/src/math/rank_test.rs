//! Mann-Whitney U test of two independent samples, its effect size, and Holm's correction over many tests.
//!
//! In: two samples. Out: U, a two-sided p-value, and the probability of superiority. Small samples have the exact distribution
//! over all ways to deal their ranks, also with ties; large ones the normal approximation with correction for ties and
//! continuity.
//!
//! # References
//! Mann and Whitney 1947, doi:10.1214/aoms/1177730491. Vargha and Delaney 2000, doi:10.3102/10769986025002101. Holm 1979,
//! doi:10.2307/4615733.

use super::erfc;

/// The greatest product of the sizes of two samples for which p is exact; chosen: counting takes some 15 ms then.
const MOST_EXACT: usize = 1600;

/// The outcome of a Mann-Whitney U test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankTest {
    /// U of the first sample: pairs in which its value is the greater one, ties counted as half.
    pub u: f64,
    /// Two-sided p-value, 0 to 1.
    pub p: f64,
    /// Whether p is exact, and no normal approximation.
    pub is_exact: bool,
    /// Vargha and Delaney's A: the probability that a value of the first sample is greater than one of the second, ties counted
    /// as half; 0.5 if neither tends to be.
    pub superiority: f64,
}

/// Compares two independent samples by their ranks; `None` if one is empty or has a value that is not finite.
///
/// ```
/// use tropism::math::rank_test::mann_whitney;
/// let test = mann_whitney(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]).unwrap();
/// assert_eq!((test.u, test.superiority), (0.0, 0.0));
/// assert!((test.p - 0.1).abs() < 1e-12);
/// ```
#[must_use]
pub fn mann_whitney(first: &[f64], second: &[f64]) -> Option<RankTest> {
    if first.is_empty() || second.is_empty() || first.iter().chain(second).any(|value| !value.is_finite()) {
        return None;
    }
    let pooled = Pooled::of(first, second);
    let pairs = first.len() as f64 * second.len() as f64;
    // Ranks are doubled: those of ties are then whole, too.
    let least = first.len() * (first.len() + 1);
    let u = (pooled.first - least) as f64 / 2.0;
    let is_exact = first.len() * second.len() <= MOST_EXACT;
    let p = if is_exact { pooled.exact_p(first.len()) } else { pooled.normal_p(first.len(), u) };
    Some(RankTest { u, p, is_exact, superiority: u / pairs })
}

/// The ranks of two samples together.
struct Pooled {
    /// Twice the rank of each value, in ascending order; values that tie share the mean of their ranks.
    ranks: Vec<usize>,
    /// Number of values in each group of ties.
    ties: Vec<usize>,
    /// Twice the sum of the ranks of the first sample.
    first: usize,
}

impl Pooled {
    fn of(first: &[f64], second: &[f64]) -> Self {
        let mut values: Vec<(f64, bool)> = first.iter().map(|&value| (value, true)).collect();
        values.extend(second.iter().map(|&value| (value, false)));
        values.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut pooled = Self { ranks: Vec::new(), ties: Vec::new(), first: 0 };
        for tied in values.chunk_by(|(a, _), (b, _)| a == b) {
            let rank = 2 * pooled.ranks.len() + tied.len() + 1;
            pooled.ranks.extend(tied.iter().map(|_| rank));
            pooled.ties.push(tied.len());
            pooled.first += rank * tied.iter().filter(|(_, is_first)| *is_first).count();
        }
        pooled
    }

    /// The share of all deals of the ranks in which the sum of a sample's is as far from its mean, or farther.
    fn exact_p(&self, first: usize) -> f64 {
        // The distance is the same for both samples; the smaller one has fewer sums.
        let away = self.first.abs_diff(first * (self.ranks.len() + 1));
        let size = first.min(self.ranks.len() - first);
        let most: usize = self.ranks.iter().rev().take(size).sum();
        // Number of ways to deal so many ranks with such a sum.
        let mut ways = vec![vec![0.0_f64; most + 1]; size + 1];
        ways[0][0] = 1.0;
        for &rank in &self.ranks {
            for count in (1..=size).rev() {
                let (fewer, these) = ways.split_at_mut(count);
                for sum in rank..=most {
                    these[0][sum] += fewer[count - 1][sum - rank];
                }
            }
        }
        let mean = size * (self.ranks.len() + 1);
        let all: f64 = ways[size].iter().sum();
        let as_far = ways[size].iter().enumerate().filter(|(sum, _)| sum.abs_diff(mean) >= away);
        as_far.map(|(_, ways)| ways).sum::<f64>() / all
    }

    fn normal_p(&self, first: usize, u: f64) -> f64 {
        let (all, first) = (self.ranks.len() as f64, first as f64);
        let pairs = first * (all - first);
        let tied: f64 = self.ties.iter().map(|&count| (count as f64).powi(3) - count as f64).sum();
        let variance = pairs / 12.0 * (all + 1.0 - tied / (all * (all - 1.0)));
        let away = ((u - pairs / 2.0).abs() - 0.5).max(0.0);
        if variance > 0.0 { erfc(away / (2.0 * variance).sqrt()) } else { 1.0 }
    }
}

/// The p-values of several tests, corrected so that the probability of any false finding among them is bounded (Holm 1979).
///
/// ```
/// use tropism::math::rank_test::holm;
/// assert_eq!(holm(&[0.04, 0.01]), [0.04, 0.02]);
/// ```
#[must_use]
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut corrected = vec![0.0; p.len()];
    let mut most = 0.0_f64;
    for (tested, index) in order.into_iter().enumerate() {
        most = most.max(p[index] * (p.len() - tested) as f64).min(1.0);
        corrected[index] = most;
    }
    corrected
}

/// The least number of values in each of two samples with which one of `pairs` comparisons can have a p-value below `level`, above 0,
/// after [Holm's correction](holm): with all values of one sample above all of the other, p is 2 of the (2n choose n) orders.
///
/// ```
/// use tropism::math::rank_test::least_size;
/// assert_eq!(least_size(1, 0.05), 4);
/// assert_eq!(least_size(6, 0.05), 5);
/// ```
#[must_use]
pub fn least_size(pairs: usize, level: f64) -> usize {
    let (mut size, mut orders) = (1, 2.0);
    while 2.0 * pairs as f64 / orders >= level {
        size += 1;
        orders *= (4 * size - 2) as f64 / size as f64;
    }
    size
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ages of the example in SciPy's documentation of `scipy.stats.mannwhitneyu`.
    const MALES: [f64; 5] = [19.0, 22.0, 16.0, 29.0, 24.0];
    const FEMALES: [f64; 4] = [20.0, 11.0, 17.0, 12.0];

    #[test]
    fn the_example_of_scipy_comes_out() {
        let test = mann_whitney(&MALES, &FEMALES).unwrap();
        assert_eq!((test.u, test.superiority, test.is_exact), (17.0, 17.0 / 20.0, true));
        assert!((test.p - 0.111_111_111_111_111_1).abs() < 1e-14);
        let normal = Pooled::of(&MALES, &FEMALES).normal_p(5, 17.0);
        assert!((normal - 0.111_346_886_533_140_41).abs() < 1e-14, "{normal}");
    }

    /// Every deal of the pooled values, by counting in binary.
    fn by_hand(first: &[f64], second: &[f64]) -> f64 {
        let values: Vec<f64> = first.iter().chain(second).copied().collect();
        let u = |is_first: u32| {
            let of =
                |wanted| values.iter().enumerate().filter(move |(at, _)| (is_first >> at & 1 == 1) == wanted);
            let beats = |a: f64, b: f64| 0.5 * (f64::from(u8::from(a > b)) + f64::from(u8::from(a >= b)));
            of(true).map(|(_, &a)| of(false).map(|(_, &b)| beats(a, b)).sum::<f64>()).sum::<f64>()
        };
        let deals = (0..1_u32 << values.len()).filter(|deal| deal.count_ones() as usize == first.len());
        let mean = first.len() as f64 * second.len() as f64 / 2.0;
        let found = (u((1 << first.len()) - 1) - mean).abs();
        let far: Vec<bool> = deals.map(|deal| (u(deal) - mean).abs() >= found).collect();
        far.iter().filter(|is_far| **is_far).count() as f64 / far.len() as f64
    }

    #[test]
    fn exact_p_is_that_of_all_deals_also_with_ties() {
        let cases: [(&[f64], &[f64]); 4] = [
            (&MALES, &FEMALES),
            (&[1.0, 2.0, 2.0, 5.0], &[2.0, 3.0, 3.0, 7.0, 8.0, 8.0]),
            (&[4.0, 4.0], &[4.0, 4.0, 4.0]),
            (&[9.0], &[1.0, 2.0, 2.0, 3.0]),
        ];
        for (first, second) in cases {
            let test = mann_whitney(first, second).unwrap();
            assert!((test.p - by_hand(first, second)).abs() < 1e-12, "{test:?}");
            let other = mann_whitney(second, first).unwrap();
            assert!(
                (test.p - other.p).abs() < 1e-12
                    && (test.superiority + other.superiority - 1.0).abs() < 1e-12
            );
        }
    }

    #[test]
    fn the_approximation_takes_over_where_counting_takes_long() {
        let first: Vec<f64> = (0..40).map(|index| f64::from(index * index % 31)).collect();
        let second: Vec<f64> = first.iter().map(|value| value + 6.0).collect();
        let exact = mann_whitney(&first, &second).unwrap();
        let normal = Pooled::of(&first, &second).normal_p(40, exact.u);
        assert!(exact.is_exact && (exact.p - normal).abs() < 1e-3, "{} {normal}", exact.p);
        let test = mann_whitney(&[&first[..], &[3.5]].concat(), &second).unwrap();
        assert!(!test.is_exact && (test.p - normal).abs() < 0.01, "{} {normal}", test.p);
        let same = [2.0; 50];
        assert_eq!(mann_whitney(&same, &same).unwrap().p, 1.0);
    }

    #[test]
    fn nothing_is_compared_with_nothing() {
        assert_eq!(mann_whitney(&[], &MALES), None);
        assert_eq!(mann_whitney(&MALES, &[f64::NAN]), None);
    }

    #[test]
    fn holm_is_that_of_r() {
        // p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm")
        for (found, wanted) in holm(&[0.01, 0.04, 0.03, 0.005]).into_iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - wanted).abs() < 1e-12, "{found}");
        }
        assert_eq!(holm(&[0.6, 0.9]), [1.0, 1.0]);
        assert!(holm(&[]).is_empty());
    }
}
