//! Whole numbers of a rig file that are checked while they are read: for `deserialize_with`, so that an error has its line.

use std::ops::RangeInclusive;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// Further attempts after a failure: 0 to 10. Chosen: what ten do not mend is not mended by more within a step.
pub(crate) fn retries<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
    within(from, 0..=10)
}

/// Frames that are discarded: 0 to 1000. Chosen: half a minute of video.
pub(crate) fn frames<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
    within(from, 0..=1000)
}

/// A TCP port: 1 to 65535.
pub(crate) fn port<'de, D: Deserializer<'de>>(from: D) -> Result<u16, D::Error> {
    within(from, 1..=65_535)
}

/// A number in `range`, which lies in that of `N`.
fn within<'de, D: Deserializer<'de>, N: TryFrom<i64>>(
    from: D,
    range: RangeInclusive<i64>,
) -> Result<N, D::Error> {
    let found = i64::deserialize(from)?;
    let number = Some(found).filter(|found| range.contains(found)).and_then(|found| N::try_from(found).ok());
    number.ok_or_else(|| {
        D::Error::custom(format!("found {found}, wanted {} to {}", range.start(), range.end()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize, PartialEq)]
    struct File {
        #[serde(deserialize_with = "retries")]
        retries: u32,
        #[serde(deserialize_with = "port")]
        port: u16,
    }

    #[test]
    fn a_number_outside_its_range_is_refused_where_it_stands() {
        let read = |retries: &str, port: &str| {
            toml::from_str::<File>(&format!("retries = {retries}\nport = {port}"))
                .map_err(|error| error.to_string())
        };
        assert_eq!(read("0", "1"), Ok(File { retries: 0, port: 1 }));
        assert_eq!(read("10", "65535"), Ok(File { retries: 10, port: 65_535 }));
        for (retries, port, line, problem) in [
            ("-1", "1883", "line 1", "found -1, wanted 0 to 10"),
            ("11", "1883", "line 1", "found 11, wanted 0 to 10"),
            ("4294967296", "1883", "line 1", "found 4294967296, wanted 0 to 10"),
            ("2", "0", "line 2", "found 0, wanted 1 to 65535"),
            ("2", "65536", "line 2", "found 65536, wanted 1 to 65535"),
        ] {
            let error = read(retries, port).unwrap_err();
            assert!(error.contains(line) && error.contains(problem), "{error}");
        }
        assert!(read("2.5", "1883").is_err());
    }
}
