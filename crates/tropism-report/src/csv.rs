//! Numbers in the CSV files beside figures.

use std::fmt;

/// A number with four decimals, in scientific notation from a million on; empty if it is not finite.
///
/// A number of 1e300 in decimals is 306 letters long, and takes a thousand times as long to write.
pub(super) struct Cell(pub(super) f64);

/// Numbers from here on are written in scientific notation.
const LARGE: f64 = 1e6;

impl fmt::Display for Cell {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.0;
        if !value.is_finite() {
            Ok(())
        } else if value.abs() < LARGE {
            write!(out, "{value:.4}")
        } else {
            write!(out, "{value:.6e}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_short() {
        let cells = [0.0, -1.5, 999_999.0, 1e6, -1.234_567_89e300, f64::NAN, f64::INFINITY];
        let texts = cells.map(|value| Cell(value).to_string());
        assert_eq!(texts, ["0.0000", "-1.5000", "999999.0000", "1.000000e6", "-1.234568e300", "", ""]);
        assert_eq!(Cell(-1.234e300).to_string().parse(), Ok(-1.234e300));
    }
}
