//! Checks of settings: one error that names the key, the value that was found, and the values that are allowed.

use std::fmt::Display;
use std::ops::RangeInclusive;

/// A setting with a value that is not allowed.
///
/// ```
/// use tropism::check;
/// let error = check::within("growth.sd", 3.0, 0.0..=1.0).unwrap_err();
/// assert_eq!(error.to_string(), "found growth.sd = 3, wanted 0 to 1");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("found {key} = {found}, wanted {wanted}")]
pub struct OutOfRange {
    /// The key with the tables around it, as in `growth.sd`.
    pub key: String,
    /// Its value, as text.
    pub found: String,
    /// The allowed values, in words.
    pub wanted: String,
}

impl OutOfRange {
    /// The error for `key`, whose value is `found`.
    #[must_use]
    pub fn new(key: impl Into<String>, found: impl Display, wanted: impl Into<String>) -> Self {
        Self { key: key.into(), found: short(found.to_string()), wanted: wanted.into() }
    }

    /// The same error for a setting inside `table`: its key becomes `table.key`.
    #[must_use]
    pub fn in_table(self, table: &str) -> Self {
        Self { key: format!("{table}.{}", self.key), ..self }
    }
}

/// A number of more digits than anybody reads, such as 1e-300 written out, with an exponent; any other text as it is.
fn short(text: String) -> String {
    const MOST_DIGITS: usize = 24;
    match text.parse::<f64>() {
        Ok(number) if text.len() > MOST_DIGITS => format!("{number:e}"),
        _ => text,
    }
}

/// Checks a condition on the value `found` of `key`; `wanted` says in words which values meet it.
///
/// # Errors
/// [`OutOfRange`] if the condition does not hold.
pub fn ensure(
    is_allowed: bool,
    key: impl Into<String>,
    found: impl Display,
    wanted: impl Into<String>,
) -> Result<(), OutOfRange> {
    if is_allowed { Ok(()) } else { Err(OutOfRange::new(key, found, wanted)) }
}

/// Checks that the value `found` of `key` lies in `range`, both ends included. NaN never does.
///
/// # Errors
/// [`OutOfRange`] if it lies outside.
pub fn within<T: PartialOrd + Display>(
    key: impl Into<String>,
    found: T,
    range: RangeInclusive<T>,
) -> Result<(), OutOfRange> {
    let is_inside = range.contains(&found);
    ensure(is_inside, key, found, format!("{} to {}", range.start(), range.end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_are_inside_and_nan_is_not() {
        for inside in [0.0, 0.5, 1.0] {
            assert_eq!(within("share", inside, 0.0..=1.0), Ok(()));
        }
        for outside in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
            assert!(within("share", outside, 0.0..=1.0).is_err(), "{outside}");
        }
        assert_eq!(within("step", 1e-300, 1.0..=2.0).unwrap_err().found, "1e-300");
        assert_eq!(within("runs", 0_u32, 1..=9).unwrap_err().to_string(), "found runs = 0, wanted 1 to 9");
    }

    #[test]
    fn a_table_stands_before_its_key() {
        let error = ensure(false, "sd", -1.0, "0 or more").unwrap_err().in_table("growth");
        assert_eq!(error, OutOfRange::new("growth.sd", -1.0, "0 or more"));
    }
}
