//! Activation functions of neurons: those of MultiNEAT, under its definitions.

use serde::{Deserialize, Serialize};

/// Activation function of a neuron.
///
/// `x` is the weighted sum of the neuron's inputs, `a` its slope and `b` its shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// `1` if `x > 0.5 + b`, else `0`. As in MultiNEAT, the threshold is 0.5, not 0.
    UnsignedStep,
    /// `1` if `x > b`, else `-1`.
    SignedStep,
    /// `1 / (1 + exp(-a x - b))`.
    UnsignedSigmoid,
    /// `2 / (1 + exp(-a x - b)) - 1`.
    SignedSigmoid,
    /// `tanh(a x)`.
    Tanh,
    /// `exp(-a x^2 + b)`.
    UnsignedGauss,
    /// `2 exp(-a x^2 + b) - 1`.
    SignedGauss,
    /// `|x + b|`.
    Abs,
    /// `sin(a x + b)`.
    Sine,
    /// `x + b`.
    Linear,
    /// `x` if positive, else `0`.
    Relu,
    /// `ln(1 + exp(x))`, a smooth [`Relu`](Self::Relu).
    Softplus,
}

impl Activation {
    /// Applies the function to the weighted sum `x`, with slope `a` and shift `b`.
    ///
    /// ```
    /// use tropism_neat::Activation;
    /// assert_eq!(Activation::UnsignedStep.apply(0.5, 1.0, 0.0), 0.0);
    /// assert_eq!(Activation::UnsignedStep.apply(0.51, 1.0, 0.0), 1.0);
    /// ```
    #[must_use]
    #[inline]
    pub fn apply(self, x: f64, a: f64, b: f64) -> f64 {
        let sigmoid = || 1.0 / (1.0 + libm::exp(-a * x - b));
        let gauss = || libm::exp(-a * x * x + b);
        match self {
            Self::UnsignedStep => f64::from(u8::from(x > 0.5 + b)),
            Self::SignedStep => {
                if x > b {
                    1.0
                } else {
                    -1.0
                }
            }
            Self::UnsignedSigmoid => sigmoid(),
            Self::SignedSigmoid => 2.0 * sigmoid() - 1.0,
            Self::Tanh => libm::tanh(a * x),
            Self::UnsignedGauss => gauss(),
            Self::SignedGauss => 2.0 * gauss() - 1.0,
            Self::Abs => (x + b).abs(),
            Self::Sine => libm::sin(a * x + b),
            Self::Linear => x + b,
            Self::Relu => x.max(0.0),
            // Above 40, ln(1 + exp(x)) rounds to x; exp(x) itself overflows above 709.
            Self::Softplus => {
                if x > 40.0 {
                    x
                } else {
                    libm::log1p(libm::exp(x))
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_function_has_known_values() {
        use Activation::*;
        let e = core::f64::consts::E;
        let table = [
            (UnsignedStep, 0.5, 0.0),
            (UnsignedStep, 0.5 + 1e-9, 1.0),
            (SignedStep, 0.0, -1.0),
            (SignedStep, 1e-9, 1.0),
            (UnsignedSigmoid, 0.0, 0.5),
            (UnsignedSigmoid, 1.0, e / (1.0 + e)),
            (SignedSigmoid, 0.0, 0.0),
            (Tanh, 0.0, 0.0),
            (Tanh, 1.0, (e - 1.0 / e) / (e + 1.0 / e)),
            (UnsignedGauss, 1.0, 1.0 / e),
            (SignedGauss, 0.0, 1.0),
            (Abs, -2.0, 2.0),
            (Sine, core::f64::consts::FRAC_PI_2, 1.0),
            (Linear, -3.0, -3.0),
            (Relu, -3.0, 0.0),
            (Relu, 3.0, 3.0),
            (Softplus, 0.0, core::f64::consts::LN_2),
            (Softplus, 1000.0, 1000.0),
        ];
        for (function, x, wanted) in table {
            let found = function.apply(x, 1.0, 0.0);
            assert!((found - wanted).abs() < 1e-12, "{function:?}({x}) = {found}, wanted {wanted}");
        }
    }

    #[test]
    fn slope_and_shift_move_the_sigmoid_and_the_step() {
        let sigmoid = Activation::UnsignedSigmoid;
        assert_eq!(sigmoid.apply(1.0, 4.9, 0.0), sigmoid.apply(4.9, 1.0, 0.0));
        assert_eq!(sigmoid.apply(0.0, 1.0, 2.0), sigmoid.apply(2.0, 1.0, 0.0));
        assert_eq!(Activation::UnsignedStep.apply(0.6, 1.0, 0.2), 0.0);
    }
}
