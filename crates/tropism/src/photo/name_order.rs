//! The order in which a person reads numbered file names.

/// Sort key of a file name: words and numbers in turn, so that `frame9.jpg` comes before `frame10.jpg`.
#[must_use]
pub fn natural_order(name: &str) -> Vec<(String, u128, String)> {
    let parts = words_and_numbers(name).into_iter();
    parts
        .map(|(word, digits)| (word.to_lowercase(), digits.parse().unwrap_or(u128::MAX), digits.to_owned()))
        .collect()
}

/// The parts of a name: each a word without digits and the digits behind it. The first word and the last digits may be
/// empty.
pub(super) fn words_and_numbers(name: &str) -> Vec<(&str, &str)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let word = rest.find(|letter: char| letter.is_ascii_digit()).unwrap_or(rest.len());
        let (word, after) = rest.split_at(word);
        let digits = after.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(after.len());
        let (digits, after) = after.split_at(digits);
        parts.push((word, digits));
        rest = after;
    }
    parts
}
