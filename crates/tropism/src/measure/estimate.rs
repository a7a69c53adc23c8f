//! A number with its interval, and what can be said of it.

use serde::{Deserialize, Serialize};

/// What can be said of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Measured: the interval means what it says.
    Measured,
    /// Provisional: a value with an interval, of data that are fewer than wanted.
    Provisional,
    /// Only one end of the interval comes from the data.
    Bounded,
    /// These data cannot say it.
    NotIdentified,
}

impl Status {
    /// The word of tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Provisional => "provisional",
            Self::Bounded => "bounded",
            Self::NotIdentified => "not identified",
        }
    }

    /// Whether a table may show the number.
    #[must_use]
    pub const fn has_value(self) -> bool {
        !matches!(self, Self::NotIdentified)
    }
}

/// A constant of a plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Symbol of the literature, such as `Lc`.
    pub symbol: String,
    /// Value; also of what is not identified, where it says nothing.
    pub value: f64,
    /// 90 % interval.
    pub interval: [f64; 2],
    /// What can be said of it.
    pub status: Status,
    /// Why it is not measured; empty if it is.
    pub reason: String,
}

/// A quantity that is measured: its words and its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Symbol of the literature.
    pub symbol: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// What it is.
    pub words: &'static str,
}

/// All quantities, in the order of tables.
pub const QUANTITIES: [Quantity; 20] = [
    Quantity { symbol: "G", unit: "cm/h", words: "elongation rate" },
    Quantity { symbol: "Lgz", unit: "cm", words: "length of the zone that bends" },
    Quantity { symbol: "W", unit: "cm", words: "width of the edge of that zone" },
    Quantity { symbol: "D", unit: "cm", words: "depth over which sensitivity rises from the apex" },
    Quantity {
        symbol: "E",
        unit: "1/h",
        words: "mean relative elongation rate of the zone, if all elongation is in it",
    },
    Quantity { symbol: "Lc", unit: "cm", words: "convergence length gamma/beta" },
    Quantity { symbol: "B", unit: "", words: "balance number beta Lgz/gamma" },
    Quantity { symbol: "beta", unit: "1/(cm h)", words: "gravitropic sensitivity" },
    Quantity { symbol: "gamma", unit: "1/h", words: "proprioceptive (straightening) sensitivity" },
    Quantity { symbol: "beta~", unit: "", words: "gravitropic sensitivity in growth units, beta R/E" },
    Quantity { symbol: "gamma~", unit: "", words: "proprioceptive sensitivity in growth units, gamma/E" },
    Quantity { symbol: "nu", unit: "1/(cm h)", words: "phototropic sensitivity" },
    Quantity { symbol: "tau", unit: "h", words: "memory of light (time constant of a low pass)" },
    Quantity { symbol: "tau_g", unit: "h", words: "memory of gravity (time constant of a low pass)" },
    Quantity { symbol: "A_P", unit: "deg", words: "set point: the angle to the vertical at rest" },
    Quantity { symbol: "turn", unit: "deg", words: "net turn of the tip" },
    Quantity {
        symbol: "v_max",
        unit: "deg/h",
        words: "fastest turning of the tip, over a sixth of the record",
    },
    Quantity {
        symbol: "lag",
        unit: "h",
        words: "time at which the tangent of the fastest turning leaves the first angle",
    },
    Quantity { symbol: "T_cn", unit: "h", words: "period of circumnutation" },
    Quantity {
        symbol: "A_cn",
        unit: "deg",
        words: "amplitude of the tip's swing in the plane of the picture",
    },
];

impl Quantity {
    /// The quantity of a symbol.
    ///
    /// # Panics
    /// If no quantity has it.
    #[must_use]
    pub fn of(symbol: &str) -> Self {
        let found = QUANTITIES.into_iter().find(|quantity| quantity.symbol == symbol);
        found.unwrap_or_else(|| panic!("no quantity has the symbol {symbol}"))
    }
}

impl Estimate {
    /// A positive number, with a 90 % interval of `half` to either side of its logarithm.
    pub(super) fn log_normal(symbol: &str, ln_value: f64, half: f64) -> Self {
        Self {
            symbol: symbol.to_owned(),
            value: crate::math::exp(ln_value),
            interval: [crate::math::exp(ln_value - half), crate::math::exp(ln_value + half)],
            status: Status::Measured,
            reason: String::new(),
        }
    }

    /// A number that these data cannot say.
    pub(super) fn not_identified(symbol: &str, reason: &str) -> Self {
        Self {
            symbol: symbol.to_owned(),
            value: f64::NAN,
            interval: [f64::NAN; 2],
            status: Status::NotIdentified,
            reason: reason.to_owned(),
        }
    }

    /// The same number, which these data cannot say.
    pub(super) fn refused(self, reason: &str) -> Self {
        Self { status: Status::NotIdentified, reason: reason.to_owned(), ..self }
    }

    /// The number with an interval of its logarithm that is wider by `factor`; not identified where that spans too much.
    #[must_use]
    pub fn widened(self, factor: f64) -> Self {
        if self.status != Status::Measured || !(self.interval[0] > 0.0 && self.interval[1].is_finite()) {
            return self;
        }
        let half = factor * self.half();
        let wider = Self {
            interval: [self.value * crate::math::exp(-half), self.value * crate::math::exp(half)],
            ..self
        };
        if wider.factor() <= super::MAX_FACTOR {
            return wider;
        }
        let reason = format!("the 90 % interval spans a factor of {:.0}", wider.factor().min(1e6));
        wider.refused(&reason)
    }

    /// Half of the interval of the logarithm.
    pub(super) fn half(&self) -> f64 {
        0.5 * crate::math::ln(self.factor())
    }

    /// The factor between the ends of the interval.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.interval[1] / self.interval[0]
    }
}

/// The 95 % quantile of the normal distribution: its 90 % interval.
pub(super) const Z_90: f64 = 1.644_853_626_951_472_7;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wider_interval_keeps_its_value_and_may_say_too_little() {
        let estimate = Estimate::log_normal("Lc", 0.0, 0.2);
        let wider = estimate.clone().widened(2.0);
        assert_eq!((wider.value, wider.status), (1.0, Status::Measured));
        assert!((wider.half() / estimate.half() - 2.0).abs() < 1e-9);
        assert_eq!(estimate.widened(4.0).status, Status::NotIdentified);
        let refused = Estimate::not_identified("Lc", "why").widened(2.0);
        assert_eq!((refused.status, refused.reason.as_str()), (Status::NotIdentified, "why"));
    }
}
