//! Elementary functions without branches, of which a compiler makes vectors: the bits of `libm` within stated ranges.
//!
//! `libm` follows FreeBSD's msun (fdlibm, Sun Microsystems 1993): argument reduction, a polynomial, and the way back. Each
//! function here takes the same steps in the same order on the same constants; only the branches are selections. Outside its
//! range a result means nothing; callers ask beforehand, and call `libm` there.

use core::f64::consts::FRAC_1_SQRT_2;

/// Adding this to a number below 2^51 rounds it to an integer, which then stands in the low bits: 1.5 * 2^52.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// Bits of the significand.
const SIGNIFICAND_BITS: u32 = 52;
const SIGNIFICAND: u64 = (1 << SIGNIFICAND_BITS) - 1;
/// The exponent of 1.
const BIAS: f64 = 1023.0;

/// ln 2 in two parts, of which the first has trailing zeros, and 1/ln 2.
const LN2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
const PER_LN2: f64 = core::f64::consts::LOG2_E;
/// Polynomial of `x (e^x + 1) / (e^x - 1)` (Remez).
const EXP: [f64; 5] = [
    0.166_666_666_666_666_02,
    -0.002_777_777_777_701_559_3,
    6.613_756_321_437_934e-5,
    -1.653_390_220_546_525_2e-6,
    4.138_136_797_057_238_5e-8,
];
/// Polynomial of `ln((1 + s) / (1 - s)) / s` (Remez).
const LN: [f64; 7] = [
    0.666_666_666_666_673_5,
    0.399_999_999_994_094_2,
    0.285_714_287_436_623_9,
    0.222_221_984_321_497_84,
    0.181_835_721_616_180_5,
    0.153_138_376_992_093_73,
    0.147_981_986_051_165_86,
];

/// The number of the high 32 bits `high`, and low bits of 0.
const fn of_high(high: u32) -> f64 {
    f64::from_bits((high as u64) << 32)
}

/// A number without its low 32 bits.
#[inline(always)]
fn high(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0xffff_ffff_0000_0000)
}

/// An integer from 0 to 2^52 - 1 as a number.
#[inline(always)]
fn number(integer: u64) -> f64 {
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    f64::from_bits(TWO_52.to_bits() | integer) - TWO_52
}

/// The number nearest to `x` towards 0 without decimals, for a magnitude below 2^51.
#[inline(always)]
fn truncated(x: f64) -> f64 {
    let nearest = (x.abs() + ROUNDER) - ROUNDER;
    let below = if nearest > x.abs() { nearest - 1.0 } else { nearest };
    below.copysign(x)
}

/// `x` times 2 to the power of the integer `n`, where the result is normal.
#[inline(always)]
fn scaled(x: f64, n: f64) -> f64 {
    x * f64::from_bits((n + BIAS + ROUNDER).to_bits() << SIGNIFICAND_BITS)
}

/// `e` to the power of `x`: that of `libm` for magnitudes up to [`EXP_LIMIT`].
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    // High parts of 0.5 ln 2, 1.5 ln 2 and 2^-28.
    const REDUCED: f64 = of_high(0x3fd6_2e43);
    const FAR: f64 = of_high(0x3ff0_a2b2);
    const TINY: f64 = of_high(0x3e30_0001);
    let size = x.abs();
    let far = truncated(PER_LN2 * x + 0.5_f64.copysign(x));
    let k = if size >= FAR { far } else { 1.0_f64.copysign(x) };
    let k = if size >= REDUCED { k } else { 0.0 };
    let (above, below) = (x - k * LN2[0], k * LN2[1]);
    let r = above - below;
    let r2 = r * r;
    let [p1, p2, p3, p4, p5] = EXP;
    let c = r - r2 * (p1 + r2 * (p2 + r2 * (p3 + r2 * (p4 + r2 * p5))));
    let result = scaled(1.0 + (r * c / (2.0 - c) - below + above), k);
    if size >= TINY { result } else { 1.0 + x }
}

/// The greatest magnitude for which [`exp`] is that of `libm`.
pub(crate) const EXP_LIMIT: f64 = 700.0;

/// The natural logarithm of `x`: that of `libm` for positive normal numbers.
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    // The significand is taken from the square root of 1/2 on, up to its high part.
    const FROM: u64 = high_bits(FRAC_1_SQRT_2);
    let bits = x.to_bits() + (1.0_f64.to_bits() - FROM);
    let k = number(bits >> SIGNIFICAND_BITS) - BIAS;
    let f = f64::from_bits((bits & SIGNIFICAND) + FROM) - 1.0;
    let half = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let [g1, g2, g3, g4, g5, g6, g7] = LN;
    let even = w * (g2 + w * (g4 + w * g6));
    let odd = z * (g1 + w * (g3 + w * (g5 + w * g7)));
    let r = odd + even;
    s * (half + r) + k * LN2[1] - half + f + k * LN2[0]
}

/// The bits of a number without its low 32 bits.
const fn high_bits(x: f64) -> u64 {
    x.to_bits() & 0xffff_ffff_0000_0000
}

/// Half of pi in two parts, of which the first has 33 bits.
const HALF_PI: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
/// Polynomials of cosine and sine up to pi / 4 (Remez).
const COS: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];
const SIN: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// `x` without the right angles to the nearest axis: their number, and the rest in two parts.
#[inline(always)]
fn reduced(x: f64) -> (f64, f64, f64) {
    // The bounds are high parts of pi / 4, 3 pi / 4 and so on.
    let axis = |bound: u32| if x >= of_high(bound) { 1.0 } else { 0.0 };
    let n = axis(0x3fe9_21fc) + axis(0x4002_d97d) + axis(0x400f_6a7b) + axis(0x4015_fdbd);
    let z = x - n * HALF_PI[0];
    let low = n * HALF_PI[1];
    let y = z - low;
    (n, y, (z - y) - low)
}

/// The cosine of an angle up to pi / 4 in two parts.
#[inline(always)]
fn reduced_cosine(y: f64, tail: f64) -> f64 {
    let y2 = y * y;
    let y4 = y2 * y2;
    let [c1, c2, c3, c4, c5, c6] = COS;
    let r = y2 * (c1 + y2 * (c2 + y2 * c3)) + y4 * y4 * (c4 + y2 * (c5 + y2 * c6));
    let half = 0.5 * y2;
    let w = 1.0 - half;
    w + (((1.0 - w) - half) + (y2 * r - y * tail))
}

/// The sine of an angle up to pi / 4 in two parts; the second value is that of the first part alone.
#[inline(always)]
fn reduced_sine(y: f64, tail: f64) -> (f64, f64) {
    let y2 = y * y;
    let y4 = y2 * y2;
    let [s1, s2, s3, s4, s5, s6] = SIN;
    let r = s2 + y2 * (s3 + y2 * s4) + y2 * y4 * (s5 + y2 * s6);
    let v = y2 * y;
    (y - ((y2 * (0.5 * tail - v * r) - tail) - v * s1), y + v * (s1 + y2 * r))
}

/// The cosine of `x`: that of `libm` from 0 to 2 pi, where [`is_between_zeros`].
#[inline(always)]
pub(crate) fn cos(x: f64) -> f64 {
    sin_cos(x).1
}

/// Sine and cosine of `x`: those of `libm` where [`is_sin_cos_angle`].
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    const SIGN: u64 = 1 << 63;
    let (n, y, tail) = reduced(x.abs());
    let cosine = reduced_cosine(y, tail);
    let (sine, sine_of_whole) = reduced_sine(y, tail);
    let sine = if n == 0.0 { sine_of_whole } else { sine };
    let (sin, cos) = if n == 1.0 || n == 3.0 { (cosine, sine) } else { (sine, cosine) };
    let sin = if n == 2.0 || n == 3.0 { -sin } else { sin };
    let cos = if n == 1.0 || n == 2.0 { -cos } else { cos };
    (f64::from_bits(sin.to_bits() ^ (x.to_bits() & SIGN)), cos)
}

/// Whether [`sin_cos`] takes `x`: up to a full turn to either side, and not at a multiple of pi / 2 but 0.
#[inline(always)]
pub(crate) fn is_sin_cos_angle(x: f64) -> bool {
    (x.abs() <= core::f64::consts::TAU) & is_between_zeros(x.abs())
}

/// The length of the hypotenuse over `x` and `y`: that of `libm` where [`is_hypot`].
#[inline(always)]
pub(crate) fn hypot(x: f64, y: f64) -> f64 {
    let (x, y) = (x.abs(), y.abs());
    let (long, short) = if x < y { (y, x) } else { (x, y) };
    let ((long, of_long), (short, of_short)) = (square(long), square(short));
    (of_short + of_long + short + long).sqrt()
}

/// Whether [`hypot`] found a length that it takes: 0, or 1e-100 to 1e100.
#[inline(always)]
pub(crate) fn is_hypot(length: f64) -> bool {
    (length == 0.0) | (1e-100..=1e100).contains(&length)
}

/// The square of `x`, and what rounding left of it (Dekker 1971, doi:10.1007/BF01397083).
#[inline(always)]
fn square(x: f64) -> (f64, f64) {
    /// 2^27 + 1.
    const SPLIT: f64 = 134_217_729.0;
    let shifted = x * SPLIT;
    let above = x - shifted + shifted;
    let below = x - above;
    let square = x * x;
    (square, above * above - square + 2.0 * above * below + below * below)
}

/// Whether `x` is so far from all multiples of pi / 2 but 0 that [`cos`] is that of `libm`.
#[inline(always)]
pub(crate) fn is_between_zeros(x: f64) -> bool {
    let near = |bits: u32| (x >= of_high(bits)) & (x < of_high(bits + 1));
    !(near(0x3ff9_21fb) | near(0x4009_21fb) | near(0x4012_d97c) | near(0x4019_21fb))
}

/// Polynomial of `3 / 2 (ln((1 + s) / (1 - s)) - 2 s - 2 / 3 s^3) / s^5` (Remez).
const POW: [f64; 6] = [
    0.599_999_999_999_994_6,
    0.428_571_428_578_550_2,
    0.333_333_329_818_377_43,
    0.272_728_123_808_534,
    0.230_660_745_775_561_75,
    0.206_975_017_800_338_42,
];

/// `x` to the power of `y`: that of `libm` where [`is_pow_base`] of `x` and [`is_pow_exponent`] of `y`.
#[inline(always)]
pub(crate) fn pow(x: f64, y: f64) -> f64 {
    // ln 1.5 / ln 2, and 2 / (3 ln 2), whole and in two parts.
    const LOG2_1_5: [f64; 2] = [0.584_962_487_220_764_2, 1.350_039_202_129_749e-8];
    const PER: f64 = 0.961_796_693_925_975_6;
    const PER_PARTS: [f64; 2] = [0.961_796_700_954_437_3, -7.028_461_650_952_758e-9];
    // ln 2, whole and in two parts.
    const LN2: f64 = core::f64::consts::LN_2;
    const LN2_PARTS: [f64; 2] = [0.693_147_182_464_599_6, -1.904_654_299_957_768e-9];

    // log2 x = n + log2 a with a from sqrt(3) / 2 to sqrt(3); centre is 1, or 1.5 above sqrt(3 / 2).
    let bits = x.to_bits();
    let one_to_two = f64::from_bits((bits & SIGNIFICAND) | 1.0_f64.to_bits());
    let is_low = one_to_two < of_high(0x3ff3_988f);
    let is_high = one_to_two >= of_high(0x3ffb_b67a);
    let exponent = number(bits >> SIGNIFICAND_BITS) - BIAS;
    let (a, n) = if is_high { (0.5 * one_to_two, exponent + 1.0) } else { (one_to_two, exponent) };
    let is_middle = !is_low && !is_high;
    let (centre, log_high, log_low) =
        if is_middle { (1.5, LOG2_1_5[0], LOG2_1_5[1]) } else { (1.0, 0.0, 0.0) };

    // s = (a - centre) / (a + centre) in two parts.
    let u = a - centre;
    let v = 1.0 / (a + centre);
    let s = u * v;
    let s_high = high(s);
    let top = (a.to_bits() >> 33) | 0x2000_0000;
    let sum_high = f64::from_bits((top + 0x0008_0000 + if is_middle { 1 << 18 } else { 0 }) << 32);
    let sum_low = a - (sum_high - centre);
    let s_low = v * ((u - s_high * sum_high) - s_high * sum_low);

    let s2 = s * s;
    let [l1, l2, l3, l4, l5, l6] = POW;
    let r = s2 * s2 * (l1 + s2 * (l2 + s2 * (l3 + s2 * (l4 + s2 * (l5 + s2 * l6)))));
    let r = r + s_low * (s_high + s);
    let s2 = s_high * s_high;
    let t_high = high(3.0 + s2 + r);
    let t_low = r - ((t_high - 3.0) - s2);
    let u = s_high * t_high;
    let v = s_low * t_high + t_low * s;
    let p_high = high(u + v);
    let p_low = v - (p_high - u);
    let z_high = PER_PARTS[0] * p_high;
    let z_low = PER_PARTS[1] * p_high + p_low * PER + log_low;
    let log_a = high(((z_high + z_low) + log_high) + n);
    let log_b = z_low - (((log_a - n) - log_high) - z_high);

    // y log2 x in two parts, and its integer.
    let y_high = high(y);
    let low = (y - y_high) * log_a + y * log_b;
    let product = y_high * log_a;
    let size = high((low + product).abs());
    let nearest = truncated(size + 0.5);
    let n = if size > 0.5 { nearest.copysign(low + product) } else { 0.0 };
    let rest = product - n;

    let t = high(low + rest);
    let u = t * LN2_PARTS[0];
    let v = (low - (t - rest)) * LN2 + t * LN2_PARTS[1];
    let z = u + v;
    let w = v - (z - u);
    let z2 = z * z;
    let [p1, p2, p3, p4, p5] = EXP;
    let t = z - z2 * (p1 + z2 * (p2 + z2 * (p3 + z2 * (p4 + z2 * p5))));
    let r = (z * t) / (t - 2.0) - (w + z * w);
    let power = 1.0 - (r - z);
    f64::from_bits(power.to_bits().wrapping_add((n + ROUNDER).to_bits() << SIGNIFICAND_BITS))
}

/// Whether [`pow`] takes `x`.
#[inline(always)]
pub(crate) fn is_pow_base(x: f64) -> bool {
    (1e-60..1e60).contains(&x) & (x != 1.0)
}

/// Whether [`pow`] takes the exponent `y`: `libm` has shorter ways for some.
#[inline(always)]
pub(crate) fn is_pow_exponent(y: f64) -> bool {
    (1e-9..4.0).contains(&y.abs()) & (y != 0.5) & (y.abs() != 1.0) & (y != 2.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math;

    /// Numbers of all sizes up to a limit, both signs.
    fn of_any_size(limit: f64) -> impl Strategy<Value = f64> {
        let size = (-40.0..math::ln(limit)).prop_map(math::exp);
        (size, prop::bool::ANY).prop_map(|(size, is_negative)| if is_negative { -size } else { size })
    }

    #[test]
    fn the_ends_of_all_branches_have_the_bits_of_libm() {
        let beside = |x: f64| {
            let bits = x.to_bits();
            (bits - 3..bits + 4).chain([bits - (1 << 32), bits + (1 << 32)]).map(f64::from_bits)
        };
        let bounds =
            [0x3fd6_2e43, 0x3ff0_a2b2, 0x3e30_0001, 0x3fe6_a09e, 0x3ff0_0000, 0x3ff3_988f, 0x3ffb_b67a];
        for x in bounds.map(of_high).into_iter().flat_map(beside) {
            assert_eq!(exp(x).to_bits(), math::exp(x).to_bits(), "exp {x:e}");
            assert_eq!(exp(-x).to_bits(), math::exp(-x).to_bits(), "exp -{x:e}");
            assert_eq!(ln(x).to_bits(), math::ln(x).to_bits(), "ln {x:e}");
            for y in [-0.3, 0.7, 3.3] {
                assert!(!is_pow_base(x) || pow(x, y).to_bits() == math::pow(x, y).to_bits(), "{x:e} to {y}");
            }
        }
        for x in
            [0x3fe9_21fc, 0x4002_d97d, 0x400f_6a7b, 0x4015_fdbd].map(of_high).into_iter().flat_map(beside)
        {
            assert_eq!(cos(x).to_bits(), math::cos(x).to_bits(), "cos {x:e}");
            assert!(is_sin_cos_angle(x));
            assert_eq!([sin_cos(x), sin_cos(-x)], [math::sin_cos(x), math::sin_cos(-x)], "sin {x:e}");
        }
        assert_eq!((exp(0.0), exp(-0.0), ln(1.0).to_bits(), cos(0.0)), (1.0, 1.0, 0, 1.0));
    }

    #[test]
    fn powers_near_halves_have_the_bits_of_libm() {
        // The integer of y log2 x changes at halves.
        for twice in -40..40 {
            for shift in -50..50 {
                let x = math::pow(2.0, (f64::from(twice) / 2.0 + f64::from(shift) * 1e-7) / 0.7);
                assert_eq!(pow(x, 0.7).to_bits(), math::pow(x, 0.7).to_bits(), "{x:e}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn all_have_the_bits_of_libm(
            power in of_any_size(EXP_LIMIT),
            positive in (-600.0..600.0_f64).prop_map(math::exp),
            base in (-130.0..130.0_f64).prop_map(math::exp),
            exponent in of_any_size(4.0),
            share in 0.0..1.0_f64,
        ) {
            prop_assert_eq!(exp(power).to_bits(), math::exp(power).to_bits(), "exp {}", power);
            prop_assert_eq!(ln(positive).to_bits(), math::ln(positive).to_bits(), "ln {}", positive);
            if is_pow_base(base) && is_pow_exponent(exponent) {
                prop_assert_eq!(pow(base, exponent).to_bits(), math::pow(base, exponent).to_bits(), "{} to {}", base, exponent);
            }
            let angle = core::f64::consts::TAU * share;
            if is_between_zeros(angle) {
                prop_assert_eq!(cos(angle).to_bits(), math::cos(angle).to_bits(), "cos {}", angle);
            }
            for angle in [angle, -angle, power] {
                let [both, wanted] = [sin_cos(angle), math::sin_cos(angle)];
                prop_assert!(!is_sin_cos_angle(angle) || both == wanted, "sine and cosine of {}", angle);
            }
            for (x, y) in [(angle, exponent), (-power, exponent), (base, base * exponent), (angle, 0.0)] {
                let [length, wanted] = [hypot(x, y), math::hypot(x, y)];
                prop_assert!(length == wanted, "hypotenuse over {} and {}", x, y);
            }
        }
    }
}
