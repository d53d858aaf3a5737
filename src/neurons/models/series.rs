//! Exponentials of many numbers in wide instructions, and loops that are compiled for several processors.

use multiversion::multiversion;

/// Returns exp(x) with a relative error of about 2e-7, without branches. x is limited to the range from -87 to 87.
///
/// `x = n ln 2 + r`; the exponent of the result is n, and a polynomial gives exp(r).
#[inline(always)]
pub(in crate::neurons) fn exp(x: f32) -> f32 {
    // Adding this number rounds to a whole number, which then stands in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let x = if x < 87.0 { x } else { 87.0 };
    let x = if x > -87.0 { x } else { -87.0 };
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    // ln 2 in two parts, so that the product with n is exact.
    let r = x - n * 0.693_359_4 + n * 2.121_944_4e-4;
    let tail = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)));
    let power = 1.0 + r * (1.0 + r * (1.0 / 2.0 + r * (1.0 / 6.0 + r * tail)));
    let exponent = shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127);
    power * f32::from_bits(exponent << 23)
}

/// Replaces each number by a function of it, which should have no branches.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn replace<F: Fn(f32) -> f32>(values: &mut [f32], function: F) {
    for value in values {
        *value = function(*value);
    }
}
