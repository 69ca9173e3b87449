//! Elementary functions in f32 as straight-line code that compilers turn into vector instructions:
//! no branches, no calls, selects only.
//!
//! Errors stated are relative, over the ranges named, without the rounding of the last operation.
//! Coefficients interpolate the function at the Chebyshev nodes of its reduced interval.

use std::ops::AddAssign;

/// How a product is added: the one difference between instruction sets that bits show.
pub trait Arithmetic {
    /// a·b + c.
    fn mul_add(a: f32, b: f32, c: f32) -> f32;
}

/// One rounding, for targets whose hardware fuses.
#[derive(Clone, Copy, Debug)]
pub struct Fused;

/// Two roundings; a fused operation in software would cost a call each.
#[derive(Clone, Copy, Debug)]
pub struct Separate;

impl Arithmetic for Fused {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
}

impl Arithmetic for Separate {
    #[inline(always)]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
}

/// Adding and subtracting 1.5·2²³ rounds to an integer, which then stands in the low bits.
const ROUNDER: f32 = 12_582_912.0;
const MANTISSA_BITS: u32 = 23;

/// The smaller of the two; `b` where `a` is NaN.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    // One `minps` on x86; `f32::min` ignores a NaN on either side, which takes a select more.
    if a < b { a } else { b }
}

/// The larger of the two; `b` where `a` is NaN.
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn polynomial<A: Arithmetic, const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
    let mut sum = coefficients[N - 1];
    for k in (0..N - 1).rev() {
        sum = A::mul_add(sum, x, coefficients[k]);
    }
    sum
}

/// 2ⁿ for the integer n = `rounded` − [`ROUNDER`], −126 ≤ n ≤ 127.
#[inline(always)]
fn power_of_two(rounded: f32) -> f32 {
    // The difference of the bits is n, also below 0; 127 is the bias of the exponent.
    f32::from_bits(
        rounded.to_bits().wrapping_sub(ROUNDER.to_bits()).wrapping_add(127) << MANTISSA_BITS,
    )
}

/// 2^x for x ≤ 127, 0 for x < −125: below, products with it would be denormal and slow. 2e-7.
#[inline(always)]
pub fn exp2<A: Arithmetic>(x: f32) -> f32 {
    const LOWEST: f32 = -125.0;
    let clamped = max(x, LOWEST);
    let rounded = clamped + ROUNDER;
    // |f| ≤ ½; the polynomial is (2^f − 1)/f, so that an integer x gives the exact power.
    let f = clamped - (rounded - ROUNDER);
    let r = polynomial::<A, 5>(
        f,
        [std::f32::consts::LN_2, 0.240_223_5, 0.055_503_81, 0.009_666_368, 0.001_338_130_3],
    );
    let value = power_of_two(rounded) * A::mul_add(f, r, 1.0);
    if x < LOWEST { 0.0 } else { value }
}

/// e^x − 1 for x ≤ 0, to full relative accuracy at x → 0. 2e-7.
#[inline(always)]
pub fn exp_m1<A: Arithmetic>(x: f32) -> f32 {
    const LN_2_HIGH: f32 = 0.693_359_4;
    const LN_2_LOW: f32 = -2.121_944_4e-4;
    // e^{−80} is lost against 1; further down 2ⁿ would leave its range.
    let x = max(x, -80.0);
    let rounded = A::mul_add(x, std::f32::consts::LOG2_E, ROUNDER);
    // x − n ln 2 in two parts (Cody and Waite): n times the first is exact.
    let n = rounded - ROUNDER;
    let r = A::mul_add(n, -LN_2_LOW, A::mul_add(n, -LN_2_HIGH, x));
    let q =
        polynomial::<A, 5>(r, [0.5, 0.166_665_77, 0.041_666_555, 0.008_363_173, 0.001_392_617_6]);
    // 2ⁿ (e^r − 1) + (2ⁿ − 1): for n = 0, near x = 0, the second term vanishes exactly.
    let scale = power_of_two(rounded);
    A::mul_add(scale, A::mul_add(r * r, q, r), scale - 1.0)
}

/// log₂ x for normal x > 0. 1e-7 absolute.
#[inline(always)]
pub fn log2<A: Arithmetic>(x: f32) -> f32 {
    let (exponent, f) = exponent_and_fraction(x);
    A::mul_add(ln_1p_fraction::<A>(f), std::f32::consts::LOG2_E, exponent)
}

/// ln(1 + x) for −1 < x ≤ 0, to full relative accuracy at x → 0. 2e-7.
#[inline(always)]
pub fn ln_1p<A: Arithmetic>(x: f32) -> f32 {
    let (exponent, f) = exponent_and_fraction(1.0 + x);
    // Where no power of two was taken out the fraction is x itself, not its rounding in 1 + x.
    let f = if exponent == 0.0 { x } else { f };
    A::mul_add(exponent, std::f32::consts::LN_2, ln_1p_fraction::<A>(f))
}

/// x = 2^exponent · (1 + f) with 1 + f in [√½, √2).
#[inline(always)]
fn exponent_and_fraction(x: f32) -> (f32, f32) {
    const SQRT_HALF: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    // Counted from √½, so that x just below 1 has exponent 0 and a small f, not a cancelled one.
    let exponent = x.to_bits().wrapping_sub(SQRT_HALF).cast_signed() >> MANTISSA_BITS;
    let mantissa = x.to_bits().wrapping_sub((exponent << MANTISSA_BITS).cast_unsigned());
    (exponent as f32, f32::from_bits(mantissa) - 1.0)
}

#[inline(always)]
fn ln_1p_fraction<A: Arithmetic>(f: f32) -> f32 {
    let s = polynomial::<A, 8>(
        f,
        [
            -0.5,
            0.333_336_7,
            -0.250_011_48,
            0.199_720_5,
            -0.165_884_9,
            0.148_347_87,
            -0.141_596_47,
            0.087_872_655,
        ],
    );
    A::mul_add(f * f, s, f)
}

/// atan(y/x) for x, y ≥ 0, not both 0, to full relative accuracy at y → 0. 2e-7.
#[inline(always)]
pub fn atan2<A: Arithmetic>(y: f32, x: f32) -> f32 {
    // The octant next to the smaller coordinate's axis, where |t| ≤ 1; the select mirrors it back.
    let t = min(x, y) / max(x, y);
    let series = polynomial::<A, 8>(
        t * t,
        [
            0.999_999_9,
            -0.333_318_1,
            0.199_669_62,
            -0.140_032_9,
            0.098_688_655,
            -0.058_829_753,
            0.023_780_52,
            -0.004_559_792,
        ],
    );
    let angle = t * series;
    if y > x { std::f32::consts::FRAC_PI_2 - angle } else { angle }
}

/// (sin 2πx, cos 2πx) for 0 ≤ x ≤ 1. 2e-7 absolute.
#[inline(always)]
pub fn sin_cos_turns<A: Arithmetic>(x: f32) -> (f32, f32) {
    let rounded = A::mul_add(x, 4.0, ROUNDER);
    let quadrant = rounded.to_bits().wrapping_sub(ROUNDER.to_bits());
    // A quarter turn is 1; f is within half of one.
    let f = A::mul_add(x, 4.0, ROUNDER - rounded);
    let f2 = f * f;
    let sin = f * polynomial::<A, 4>(f2, [1.570_796_4, -0.645_963_5, 0.079_680_22, -0.004_602_149]);
    let cos =
        polynomial::<A, 5>(f2, [1.0, -1.233_700_5, 0.253_669_2, -0.020_860_07, 0.000_903_628]);
    // Quadrants 1 and 3 swap sine and cosine; sine is negative in 2 and 3, cosine in 1 and 2.
    let swap = quadrant & 1 != 0;
    let (s, c) = if swap { (cos, sin) } else { (sin, cos) };
    (signed(quadrant >> 1 & 1, s), signed((quadrant + 1) >> 1 & 1, c))
}

/// −value where `negative` is 1, value where it is 0.
#[inline(always)]
fn signed(negative: u32, value: f32) -> f32 {
    f32::from_bits(value.to_bits() ^ (negative << 31))
}

/// The sum of N numbers, N a power of two: the upper half is added to the lower until one is left.
/// The chains of sums are short, and their order does not depend on the instruction set.
#[inline(always)]
pub fn sum_in_pairs<T: Copy + AddAssign, const N: usize>(mut numbers: [T; N]) -> T {
    let mut half = N / 2;
    while half > 0 {
        for k in 0..half {
            let other = numbers[k + half];
            numbers[k] += other;
        }
        half /= 2;
    }
    numbers[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relative(value: f32, expected: f64) -> f64 {
        (f64::from(value) - expected).abs() / expected.abs().max(1e-300)
    }

    fn check<A: Arithmetic>() {
        for i in 1..20_000_i32 {
            let z = f64::from(i) / 20_000.0;
            let x = (-120.0 * z) as f32;
            assert!(relative(exp2::<A>(x), f64::from(x).exp2()) < 3e-7, "exp2 {x}");
            let x = -(f64::from(i) / 600.0 - 32.0).exp2() as f32;
            assert!(relative(exp_m1::<A>(x), f64::from(x).exp_m1()) < 3e-7, "expm1 {x}");
            let x = -(-40.0 * z).exp2() as f32;
            assert!(relative(ln_1p::<A>(x), f64::from(x).ln_1p()) < 4e-7, "ln1p {x}");
            let x = (100.0 * z).exp2() as f32;
            assert!((f64::from(log2::<A>(x)) - f64::from(x).log2()).abs() < 1e-6 * (1.0 + 5.0 * z));
            let (sin, cos) = sin_cos_turns::<A>(z as f32);
            let turn = std::f64::consts::TAU * f64::from(z as f32);
            assert!((f64::from(sin) - turn.sin()).abs() < 2e-7, "sin {z}");
            assert!((f64::from(cos) - turn.cos()).abs() < 2e-7, "cos {z}");
            let (x, y) = (1.0, (60.0 * z - 40.0).exp2() as f32);
            assert!(relative(atan2::<A>(y, x), f64::from(y).atan()) < 3e-7, "atan2 {y}");
        }
    }

    #[test]
    fn elementary_functions_keep_their_stated_errors() {
        check::<Fused>();
        check::<Separate>();
    }

    #[test]
    fn ends_of_the_ranges() {
        assert_eq!(exp2::<Fused>(-1e30), 0.0);
        assert_eq!(exp2::<Fused>(0.0), 1.0);
        assert_eq!(exp_m1::<Fused>(f32::NEG_INFINITY), -1.0);
        assert_eq!(exp_m1::<Fused>(0.0), 0.0);
        assert_eq!(atan2::<Fused>(0.0, 1.0), 0.0);
        assert_eq!(atan2::<Fused>(1.0, 0.0), std::f32::consts::FRAC_PI_2);
    }
}
