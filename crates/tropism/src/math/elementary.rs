//! Elementary functions with the same bits on every machine, for one number or several in lanes.
//!
//! They are branchless: argument reduction, a polynomial, and the way back. Arguments that would need more, such as angles
//! beyond 2^20, leave the common path together. Errors are stated in units in the last place (ulp) against the crate `libm`,
//! which itself errs by less than one; a test measures them on a million points each.
//!
//! # References
//! Constants and error analysis of the polynomials: FreeBSD's msun (fdlibm, Sun Microsystems 1993). Cody and Waite 1980,
//! "Software Manual for the Elementary Functions": argument reduction. Dekker 1971, doi:10.1007/BF01397083: exact splitting.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, LOG2_E, PI, SQRT_2, TAU};

use super::real::{Mask, Real};

/// Adding this to a number below 2^51 rounds it to an integer, which then stands in the low bits: 1.5 * 2^52.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// The integer nearest to `x`, whose magnitude is below 2^51.
#[inline(always)]
fn nearest<R: Real>(x: R) -> R {
    (x + ROUNDER) - ROUNDER
}

/// `x` without the lower half of its significand (Dekker 1971); its magnitude is below 2^996.
#[inline(always)]
fn high<R: Real>(x: R) -> R {
    /// 2^27 + 1.
    const SPLIT: f64 = 134_217_729.0;
    let shifted = x * SPLIT;
    shifted - (shifted - x)
}

/// A polynomial with the lowest coefficient first (Horner's scheme).
#[inline(always)]
fn polynomial<R: Real, const N: usize>(x: R, coefficients: [f64; N]) -> R {
    let mut sum = R::splat(coefficients[N - 1]);
    for coefficient in coefficients[..N - 1].iter().rev() {
        sum = sum * x + *coefficient;
    }
    sum
}

/// ln 2 in two parts, of which the first has trailing zeros (fdlibm).
const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Taylor series of `(e^x - 1 - x) / x^2`: the next term is below 2^-60 of e^x up to ln 2 / 2.
const EXP: [f64; 12] = {
    let mut coefficients = [0.5; 12];
    let mut power = 1;
    while power < 12 {
        coefficients[power] = coefficients[power - 1] / (power + 2) as f64;
        power += 1;
    }
    coefficients
};

/// `k` and `e^r - 1` of `x = k ln 2 + r` with r from -ln 2 / 2 to ln 2 / 2.
#[inline(always)]
fn reduced_exp_m1<R: Real>(x: R) -> (R, R) {
    let k = nearest(x * LOG2_E);
    let r = (x - k * LN2[0]) - k * LN2[1];
    let r2 = r * r;
    // Two halves by even and odd powers do not wait for each other.
    let even = polynomial(r2, [EXP[0], EXP[2], EXP[4], EXP[6], EXP[8], EXP[10]]);
    let odd = polynomial(r2, [EXP[1], EXP[3], EXP[5], EXP[7], EXP[9], EXP[11]]);
    (k, r + r2 * (even + r * odd))
}

/// `e` to the power of `x`, to 1 ulp.
#[inline(always)]
#[must_use]
pub fn exp<R: Real>(x: R) -> R {
    // Beyond, the result is infinite or 0.
    let (k, rest) = reduced_exp_m1(x.clamp(R::splat(-800.0), R::splat(800.0)));
    let half = nearest(k * 0.5);
    (rest + 1.0) * half.power_of_two() * (k - half).power_of_two()
}

/// The logistic function `1 / (1 + e^-x)`, to 3 ulp where e^-x is finite, else 0.
#[inline(always)]
#[must_use]
pub fn logistic<R: Real>(x: R) -> R {
    R::splat(1.0) / (exp(-x) + 1.0)
}

/// The hyperbolic tangent, to 4 ulp.
#[inline(always)]
#[must_use]
pub fn tanh<R: Real>(x: R) -> R {
    // From 20 on it is 1.
    let (k, rest) = reduced_exp_m1((x.abs() * 2.0).min(R::splat(40.0)));
    let power = k.power_of_two();
    let exp_m1 = power * rest + (power - 1.0);
    (exp_m1 / (exp_m1 + 2.0)).copysign(x)
}

/// Polynomial of `ln((1 + s) / (1 - s)) / s` without its first term, 2 (Remez, fdlibm).
const LN: [f64; 7] = [
    0.666_666_666_666_673_5,
    0.399_999_999_994_094_2,
    0.285_714_287_436_623_9,
    0.222_221_984_321_497_84,
    0.181_835_721_616_180_5,
    0.153_138_376_992_093_73,
    0.147_981_986_051_165_86,
];

/// 2^54 makes each subnormal number normal.
const TWO_54: f64 = 18_014_398_509_481_984.0;
/// Below, numbers are scaled before their exponent is taken. Chosen: far enough from subnormal ones.
const SMALLEST: f64 = 1e-290;

/// The natural logarithm, to 1 ulp.
#[inline(always)]
#[must_use]
pub fn ln<R: Real>(x: R) -> R {
    let is_small = x.lt(R::splat(SMALLEST));
    let normal = R::select(is_small, x * TWO_54, x);
    // x = 2^k (1 + f) with 1 + f from the square root of 1/2 to that of 2.
    let k = (normal * (0.5 * SQRT_2)).exponent() + 1.0;
    let half = nearest(k * 0.5);
    let f = normal * (-half).power_of_two() * (half - k).power_of_two() - 1.0;
    let k = R::select(is_small, k - 54.0, k);
    let s = f / (f + 2.0);
    let z = s * s;
    let half = f * f * 0.5;
    let r = z * polynomial(z, LN);
    let result = k * LN2[0] - ((half - (s * (half + r) + k * LN2[1])) - f);
    let result = R::select(x.lt(R::splat(f64::INFINITY)), result, x);
    let result = R::select(x.eq(R::splat(0.0)), R::splat(f64::NEG_INFINITY), result);
    R::select(x.lt(R::splat(0.0)), R::splat(f64::NAN), result)
}

/// Half of pi in three parts, of which the first two have 33 bits (fdlibm).
const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
/// Polynomials of cosine and sine up to pi / 4 (Remez, fdlibm).
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

/// The magnitude of an angle up to which its multiple of pi / 2 times a part of [`HALF_PI`] is exact: 2^20.
const FARTHEST_ANGLE: f64 = 1_048_576.0;

/// Sine and cosine, to 1 ulp for magnitudes up to 2^20, and near their zeros to 2^-95.
///
/// Beyond, the angle is reduced by the `f64` next to 2 pi, which shifts it by up to 4e-17 of its magnitude.
#[inline(always)]
#[must_use]
pub fn sin_cos<R: Real>(x: R) -> (R, R) {
    let x = if x.abs().le(R::splat(FARTHEST_ANGLE)).all() { x } else { wrapped(x) };
    // x = n pi / 2 + y + tail, with y from -pi / 4 to pi / 4.
    let n = nearest(x * FRAC_2_PI);
    let above = x - n * HALF_PI[0];
    let middle = n * HALF_PI[1];
    let rough = above - middle;
    let below = n * HALF_PI[2] - ((above - rough) - middle);
    let y = rough - below;
    let tail = (rough - y) - below;

    let y2 = y * y;
    let half = y2 * 0.5;
    let w = R::splat(1.0) - half;
    let cosine = w + (((R::splat(1.0) - w) - half) + (y2 * y2 * polynomial(y2, COS) - y * tail));
    let [s1, s2, s3, s4, s5, s6] = SIN;
    let v = y2 * y;
    let sine = y - ((y2 * (tail * 0.5 - v * polynomial(y2, [s2, s3, s4, s5, s6])) - tail) - v * s1);

    // n modulo 4, from -2 to 2.
    let quarter = n - nearest(n * 0.25) * 4.0;
    let (is_odd, is_half_turn) = (quarter.abs().eq(R::splat(1.0)), quarter.abs().eq(R::splat(2.0)));
    let (sin, cos) = (R::select(is_odd, cosine, sine), R::select(is_odd, sine, cosine));
    let is_negative_sin = is_half_turn | quarter.eq(R::splat(-1.0));
    let is_negative_cos = is_half_turn | quarter.eq(R::splat(1.0));
    (R::select(is_negative_sin, -sin, sin), R::select(is_negative_cos, -cos, cos))
}

/// Angles beyond [`FARTHEST_ANGLE`] without whole turns.
#[cold]
#[inline(never)]
fn wrapped<R: Real>(x: R) -> R {
    R::from_fn(|lane| match x.lane(lane) {
        x if x.abs() <= FARTHEST_ANGLE => x,
        far => far % TAU,
    })
}

/// The sine: see [`sin_cos`].
#[inline(always)]
#[must_use]
pub fn sin<R: Real>(x: R) -> R {
    sin_cos(x).0
}

/// The cosine: see [`sin_cos`].
#[inline(always)]
#[must_use]
pub fn cos<R: Real>(x: R) -> R {
    sin_cos(x).1
}

/// The tangent, to 3 ulp where [`sin_cos`] is precise.
#[inline(always)]
#[must_use]
pub fn tan<R: Real>(x: R) -> R {
    let (sin, cos) = sin_cos(x);
    sin / cos
}

/// Polynomial of `1 - atan(x) / x`, over x^2, up to 7/16 (Remez, fdlibm).
const ATAN: [f64; 11] = [
    3.333_333_333_333_293e-1,
    -1.999_999_999_987_648_3e-1,
    1.428_571_427_250_346_6e-1,
    -1.111_111_040_546_235_6e-1,
    9.090_887_133_436_507e-2,
    -7.691_876_205_044_83e-2,
    6.661_073_137_387_531e-2,
    -5.833_570_133_790_573_5e-2,
    4.976_877_994_615_932_4e-2,
    -3.653_157_274_421_691_6e-2,
    1.628_582_011_536_578_2e-2,
];

/// The angle of the point (`x`, `y`) from the x axis, from -pi to pi, to 3 ulp.
#[inline(always)]
#[must_use]
pub fn atan2<R: Real>(y: R, x: R) -> R {
    /// tan(pi / 8).
    const MIDDLE: f64 = SQRT_2 - 1.0;
    let (zero, infinity) = (R::splat(0.0), R::splat(f64::INFINITY));
    let (right, up) = (x.abs(), y.abs());
    let (long, short) = (right.max(up), right.min(up));
    // Two infinities are equal; beside one, all else is 0. Sums of great numbers must not overflow.
    let is_infinite = long.eq(infinity);
    let short = R::select(is_infinite, R::select(short.eq(infinity), R::splat(1.0), zero), short);
    let long = R::select(is_infinite, R::splat(1.0), long);
    let scale = R::select(long.gt(R::splat(1e300)), R::splat(0.25), R::splat(1.0));
    let (long, short) = (long * scale, short * scale);
    let is_middle = short.gt(long * MIDDLE);
    let above = R::select(is_middle, short - long, short);
    let below = R::select(is_middle, short + long, long);
    let z = R::select(above.eq(zero), zero, above / below);
    let z2 = z * z;
    let angle = z - z * (z2 * polynomial(z2, ATAN));
    let angle = R::select(is_middle, angle + FRAC_PI_4, angle);
    let angle = R::select(up.gt(right), R::splat(FRAC_PI_2) - angle, angle);
    let angle = R::select(R::splat(1.0).copysign(x).lt(zero), R::splat(PI) - angle, angle);
    let angle = R::select(x.eq(x) & y.eq(y), angle, x + y);
    angle.copysign(y)
}

/// Chebyshev coefficients of `ln(e^(x^2) erfc(x) / t)` over `t = 2 / (2 + x)` (Press et al. 2007, "Numerical Recipes", 6.2.2).
const ERFC: [f64; 28] = [
    -1.302_653_719_781_709_4,
    6.419_697_923_564_902e-1,
    1.947_647_320_418_583_6e-2,
    -9.561_514_786_808_63e-3,
    -9.465_953_444_820_36e-4,
    3.668_394_978_527_61e-4,
    4.252_332_480_690_7e-5,
    -2.027_857_811_253_4e-5,
    -1.624_290_004_647e-6,
    1.303_655_835_580e-6,
    1.562_644_172_2e-8,
    -8.523_809_591_5e-8,
    6.529_054_439e-9,
    5.059_343_495e-9,
    -9.913_641_56e-10,
    -2.273_651_22e-10,
    9.646_791_1e-11,
    2.394_038e-12,
    -6.886_027e-12,
    8.944_87e-13,
    3.130_92e-13,
    -1.127_08e-13,
    3.81e-16,
    7.106e-15,
    -1.523e-15,
    -9.4e-17,
    1.21e-16,
    -2.8e-17,
];

/// The complementary error function, to 2e-13 of its value for arguments up to 26.
#[inline(always)]
#[must_use]
pub fn erfc<R: Real>(x: R) -> R {
    let size = x.abs();
    let t = R::splat(2.0) / (size + 2.0);
    // Clenshaw's recurrence.
    let twice = t * 4.0 - 2.0;
    let (mut sum, mut before) = (R::splat(0.0), R::splat(0.0));
    for coefficient in ERFC[1..].iter().rev() {
        (sum, before) = (twice * sum - before + *coefficient, sum);
    }
    let result = t * exp((twice * sum + ERFC[0]) * 0.5 - before - size * size);
    R::select(x.lt(R::splat(0.0)), R::splat(2.0) - result, result)
}

/// The length of the hypotenuse over `x` and `y`, to 1 ulp.
#[inline(always)]
#[must_use]
pub fn hypot<R: Real>(x: R, y: R) -> R {
    let (x, y) = (x.abs(), y.abs());
    let long = x.max(y);
    // 2^-600 and 2^600: squares neither overflow nor lose bits.
    let scale = R::select(long.gt(R::splat(1e150)), R::splat(2.409_919_865_102_884e-181), R::splat(1.0));
    let scale = R::select(long.lt(R::splat(1e-120)), R::splat(4.149_515_568_880_993e180), scale);
    let (scaled_x, scaled_y) = (x * scale, y * scale);
    let length = (scaled_x * scaled_x + scaled_y * scaled_y).sqrt() / scale;
    let is_infinite = x.eq(R::splat(f64::INFINITY)) | y.eq(R::splat(f64::INFINITY));
    R::select(is_infinite, R::splat(f64::INFINITY), length)
}

/// `x` to the power of `y`, to 2 ulp; a negative `x` has powers of integers only.
#[inline(always)]
#[must_use]
pub fn pow<R: Real>(x: R, y: R) -> R {
    let is_common = x.ge(R::splat(SMALLEST)) & x.lt(R::splat(f64::INFINITY)) & y.eq(y);
    if is_common.all() { pow_of_normal(x, y, R::splat(0.0)) } else { special_pow(x, y) }
}

/// [`pow`] of all numbers, lane by lane (IEEE 754-2019, section 9.2.1).
#[cold]
#[inline(never)]
fn special_pow<R: Real>(x: R, y: R) -> R {
    R::from_fn(|lane| {
        let (x, y) = (x.lane(lane), y.lane(lane));
        if y == 0.0 || x == 1.0 {
            return 1.0;
        }
        if x.is_nan() || y.is_nan() {
            return f64::NAN;
        }
        let size = x.abs();
        let power = if size == 0.0 || size == f64::INFINITY {
            if (size == 0.0) == (y < 0.0) { f64::INFINITY } else { 0.0 }
        } else if size < SMALLEST {
            pow_of_normal(size * TWO_54, y, -54.0)
        } else {
            pow_of_normal(size, y, 0.0)
        };
        let is_integer = y.trunc() == y;
        match (x.is_sign_negative(), is_integer && (0.5 * y).trunc() != 0.5 * y) {
            (true, true) => -power,
            (true, false) if !is_integer && size != 0.0 && size != f64::INFINITY => f64::NAN,
            _ => power,
        }
    })
}

/// Polynomial of `3 / 2 (ln((1 + s) / (1 - s)) - 2 s - 2 / 3 s^3) / s^5` (Remez, fdlibm).
const POW: [f64; 6] = [
    0.599_999_999_999_994_6,
    0.428_571_428_578_550_2,
    0.333_333_329_818_377_43,
    0.272_728_123_808_534,
    0.230_660_745_775_561_75,
    0.206_975_017_800_338_42,
];

/// The positive normal number `x`, times 2^`further`, to the power of `y`.
///
/// The logarithm of x is a sum of two numbers: its error, which the product with y and the exponential function magnify,
/// is some 2^-68.
#[inline(always)]
fn pow_of_normal<R: Real>(x: R, y: R, further: R) -> R {
    const SQRT_3: f64 = 1.732_050_807_568_877_2;
    // ln 1.5 / ln 2, 2 / (3 ln 2) and ln 2, in two parts and whole (fdlibm).
    const LOG2_1_5: [f64; 2] = [0.584_962_487_220_764_2, 1.350_039_202_129_749e-8];
    const PER: f64 = 0.961_796_693_925_975_6;
    const PER_PARTS: [f64; 2] = [0.961_796_700_954_437_3, -7.028_461_650_952_758e-9];
    const LN2_WHOLE: f64 = core::f64::consts::LN_2;
    const LN2_PARTS: [f64; 2] = [0.693_147_182_464_599_6, -1.904_654_299_957_768e-9];
    /// Beyond, each power of 2 is infinite or 0.
    const FARTHEST: f64 = 1200.0;

    // log2 x = n + log2 a with a from sqrt(3) / 2 to sqrt(3); centre is 1, or 1.5 above sqrt(3 / 2).
    let n = (x * (1.0 / SQRT_3)).exponent() + 1.0;
    let half = nearest(n * 0.5);
    let a = x * (-half).power_of_two() * (half - n).power_of_two();
    let n = n + further;
    let is_high = a.ge(R::splat(SQRT_3 / SQRT_2));
    let centre = R::select(is_high, R::splat(1.5), R::splat(1.0));
    let [offset_high, offset_low] = LOG2_1_5.map(|part| R::select(is_high, R::splat(part), R::splat(0.0)));

    // s = (a - centre) / (a + centre) in two parts.
    let u = a - centre;
    let v = R::splat(1.0) / (a + centre);
    let s = u * v;
    let s_high = high(s);
    let sum_high = high(a + centre);
    let sum_low = a - (sum_high - centre);
    let s_low = v * ((u - s_high * sum_high) - s_high * sum_low);

    let s2 = s * s;
    let r = s2 * s2 * polynomial(s2, POW);
    let r = r + s_low * (s_high + s);
    let s2 = s_high * s_high;
    let t_high = high(s2 + 3.0 + r);
    let t_low = r - ((t_high - 3.0) - s2);
    let u = s_high * t_high;
    let v = s_low * t_high + t_low * s;
    let p_high = high(u + v);
    let p_low = v - (p_high - u);
    let z_high = p_high * PER_PARTS[0];
    let z_low = p_high * PER_PARTS[1] + p_low * PER + offset_low;
    let log_high = high(((z_high + z_low) + offset_high) + n);
    let log_low = z_low - (((log_high - n) - offset_high) - z_high);

    // y log2 x in two parts, and the integer nearest to it. A greater y than 2^64 changes no power.
    let y = y.clamp(R::splat(-18_446_744_073_709_551_616.0), R::splat(18_446_744_073_709_551_616.0));
    let y_high = high(y);
    let low = (y - y_high) * log_high + y * log_low;
    let product = y_high * log_high;
    let is_far = (low + product).abs().gt(R::splat(FARTHEST));
    let product = R::select(is_far, R::splat(FARTHEST).copysign(low + product), product);
    let low = R::select(is_far, R::splat(0.0), low);
    let n = nearest(low + product);
    let rest = product - n;

    let t = high(low + rest);
    let u = t * LN2_PARTS[0];
    let v = (low - (t - rest)) * LN2_WHOLE + t * LN2_PARTS[1];
    let (k, exp_m1) = reduced_exp_m1(u + v);
    // A rest of ln 2 / 2 may be rounded to the next integer.
    let n = n + k;
    let power = (exp_m1 + 1.0) + (v - ((u + v) - u));
    let half = nearest(n * 0.5);
    power * half.power_of_two() * (n - half).power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real::Lanes;
    use crate::random::{Purpose, stream, uniform};

    /// Distance of two numbers in units in the last place of the reference; 0 for equal specials.
    fn ulps(found: f64, wanted: f64) -> f64 {
        if found == wanted || (found.is_nan() && wanted.is_nan()) {
            return 0.0;
        }
        let unit = f64::from_bits(wanted.abs().to_bits() + 1) - wanted.abs();
        ((found - wanted) / unit).abs()
    }

    /// A million arguments: of all sizes, and uniform ones, both signs.
    fn arguments(seed: u64, limit: f64) -> impl Iterator<Item = f64> {
        let mut rng = stream(seed, Purpose::Trial, 0);
        (0..1_000_000).map(move |number| {
            let (share, size) = (uniform(&mut rng) - 0.5, uniform(&mut rng));
            let size = if number % 2 == 0 { libm::exp2(60.0 * (size - 0.9)) } else { size };
            (limit * size).min(limit).copysign(share)
        })
    }

    /// The largest error of `of` on arguments up to `limit`.
    fn worst(limit: f64, of: impl Fn(f64) -> f64, reference: impl Fn(f64) -> f64) -> f64 {
        let errors = arguments(1, limit).map(|x| ulps(of(x), reference(x)));
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn functions_of_one_number_err_by_at_most_the_stated_units() {
        let logistic_reference = |x: f64| 1.0 / (1.0 + libm::exp(-x));
        let errors = [
            ("exp", worst(745.0, exp, libm::exp), 1.0),
            ("logistic", worst(700.0, logistic, logistic_reference), 3.0),
            ("tanh", worst(25.0, tanh, libm::tanh), 4.0),
            ("ln", worst(1e300, |x| ln(x.abs()), |x| libm::log(x.abs())), 1.0),
            ("ln near 1", worst(0.5, |x| ln(1.0 + x), |x| libm::log(1.0 + x)), 1.0),
            ("sin", worst(FARTHEST_ANGLE, sin, libm::sin), 1.0),
            ("cos", worst(FARTHEST_ANGLE, cos, libm::cos), 1.0),
            ("tan", worst(FARTHEST_ANGLE, tan, libm::tan), 3.0),
            ("sin of a turn", worst(TAU, sin, libm::sin), 1.0),
            ("cos of a turn", worst(TAU, cos, libm::cos), 1.0),
        ];
        println!("{errors:?}");
        for (name, error, most) in errors {
            assert!(error <= most, "{name}: {error} ulp");
        }
    }

    #[test]
    fn the_complementary_error_function_errs_by_at_most_the_stated_share() {
        let share = |x: f64| (erfc(x) / libm::erfc(x) - 1.0).abs();
        let worst = arguments(6, 26.0).map(share).fold(0.0, f64::max);
        assert!(worst < 2e-13, "{worst}");
        assert_eq!([f64::INFINITY, f64::NEG_INFINITY].map(erfc), [0.0, 2.0]);
    }

    #[test]
    fn functions_of_two_numbers_err_by_at_most_the_stated_units() {
        let [mut of_atan2, mut of_hypot, mut of_pow] = [0.0_f64; 3];
        for (x, y) in arguments(2, 1e200).zip(arguments(3, 1e200)) {
            of_atan2 = of_atan2.max(ulps(atan2(y, x), libm::atan2(y, x)));
            of_hypot = of_hypot.max(ulps(hypot(x, y), libm::hypot(x, y)));
            let (base, exponent) = (x.abs(), 600.0 / libm::log(x.abs()).abs() * (y / 1e200));
            of_pow = of_pow.max(ulps(pow(base, exponent), libm::pow(base, exponent)));
        }
        println!("atan2 {of_atan2}, hypot {of_hypot}, pow {of_pow}");
        assert!(of_atan2 <= 3.0 && of_hypot <= 1.0 && of_pow <= 2.0);
    }

    #[test]
    fn ends_of_the_domain_are_those_of_libm() {
        let small = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 1e-310, 5e-324, f64::MIN_POSITIVE];
        let large = [710.0, 745.2, 1e16, 2.0_f64.powi(53) - 1.0, 1e308, f64::MAX, f64::INFINITY, f64::NAN];
        let all: Vec<f64> = small.iter().chain(&large).flat_map(|x| [*x, -x]).collect();
        let is_same = |found: f64, wanted: f64| {
            let near = ulps(found, wanted) <= 4.0 && (wanted == 0.0) <= (found == 0.0);
            near && (wanted.is_nan() || found.is_sign_negative() == wanted.is_sign_negative())
        };
        for &x in &all {
            for (name, found, wanted) in
                [("exp", exp(x), libm::exp(x)), ("tanh", tanh(x), libm::tanh(x)), ("ln", ln(x), libm::log(x))]
            {
                assert!(is_same(found, wanted), "{name} {x:e}: {found:e}, {wanted:e}");
            }
            if x.abs() <= FARTHEST_ANGLE || !x.is_finite() {
                assert!(is_same(sin(x), libm::sin(x)) && is_same(cos(x), libm::cos(x)), "{x:e}");
            }
            for &y in &all {
                for (name, found, wanted) in [
                    ("atan2", atan2(x, y), libm::atan2(x, y)),
                    ("hypot", hypot(x, y), libm::hypot(x, y)),
                    ("pow", pow(x, y), libm::pow(x, y)),
                ] {
                    assert!(is_same(found, wanted), "{name} {x:e} {y:e}: {found:e}, {wanted:e}");
                }
            }
        }
        assert!((sin(1e9) - libm::sin(1e9)).abs() < 1e-7);
    }

    #[test]
    fn lanes_have_the_bits_of_each_number() {
        let specials = [0.0, -0.0, 1e-310, -3.0, f64::INFINITY, f64::NAN, 2e6, 1.0];
        let mut numbers: Vec<f64> =
            arguments(4, 30.0).take(20_000).chain(arguments(5, 1e300).take(8)).collect();
        numbers.extend(specials);
        for (x, y) in numbers.as_chunks::<8>().0.iter().zip(numbers.as_chunks::<8>().0.iter().rev()) {
            macro_rules! check {
                ($($name:ident)+) => {$(
                    let one: fn(f64) -> f64 = $name;
                    let eight: fn(Lanes<8>) -> Lanes<8> = $name;
                    let four: fn(Lanes<4>) -> Lanes<4> = $name;
                    let (together, half) = (eight(Lanes(*x)), four(Lanes([x[0], x[1], x[2], x[3]])));
                    for lane in 0..8 {
                        let wanted = one(x[lane]).to_bits();
                        assert_eq!(together.lane(lane).to_bits(), wanted, stringify!($name));
                        assert!(lane >= 4 || half.lane(lane).to_bits() == wanted, stringify!($name));
                    }
                )+};
                (two: $($name:ident)+) => {$(
                    let one: fn(f64, f64) -> f64 = $name;
                    let eight: fn(Lanes<8>, Lanes<8>) -> Lanes<8> = $name;
                    let together = eight(Lanes(*x), Lanes(*y));
                    for lane in 0..8 {
                        let wanted = one(x[lane], y[lane]).to_bits();
                        assert_eq!(together.lane(lane).to_bits(), wanted, stringify!($name));
                    }
                )+};
            }
            check!(exp logistic tanh ln sin cos tan erfc);
            check!(two: atan2 hypot pow);
        }
    }
}
