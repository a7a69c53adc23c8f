//! The order in which a person reads numbered file names.

/// Sort key of a file name: words and numbers in turn, so that `frame9.jpg` comes before `frame10.jpg`.
#[must_use]
pub fn natural_order(name: &str) -> Vec<(String, u128, String)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let word = rest.find(|letter: char| letter.is_ascii_digit()).unwrap_or(rest.len());
        let (text, after) = rest.split_at(word);
        let digits = after.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(after.len());
        let (number, after) = after.split_at(digits);
        parts.push((text.to_lowercase(), number.parse().unwrap_or(u128::MAX), number.to_owned()));
        rest = after;
    }
    parts
}
