//! Sizes and times as text for people.

pub use tropism::text::plural;

/// A number of bytes as text, such as `1.5 GB`.
#[must_use]
pub fn bytes(count: u64) -> String {
    let count = count as f64;
    match count {
        1e9.. => format!("{:.1} GB", count / 1e9),
        1e6.. => format!("{:.0} MB", count / 1e6),
        1e3.. => format!("{:.0} kB", count / 1e3),
        _ => format!("{count} bytes"),
    }
}

/// A number of seconds as text, such as `40 s`, `12 min`, `6.2 h` or `3.5 days`.
#[must_use]
pub fn time(seconds: f64) -> String {
    match seconds {
        172_800.0.. => format!("{:.1} days", seconds / 86_400.0),
        7200.0.. => format!("{:.1} h", seconds / 3600.0),
        120.0.. => format!("{:.0} min", seconds / 60.0),
        _ => format!("{seconds:.0} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_times_are_in_units_that_people_use() {
        assert_eq!(
            [0, 999, 1_500_000, 29_300_000_000].map(bytes),
            ["0 bytes", "999 bytes", "2 MB", "29.3 GB"]
        );
        assert_eq!(
            [0.4, 119.0, 600.0, 7200.0, 302_400.0].map(time),
            ["0 s", "119 s", "10 min", "2.0 h", "3.5 days"]
        );
    }
}
