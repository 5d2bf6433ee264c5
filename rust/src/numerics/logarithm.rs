//! Logarithms and powers to seven digits, for lengths of steps: half the cost of the standard ones, and the same
//! bits on every machine.

/// Base-2 logarithm of a number above zero, to 1e-7. Zero and infinity count as the least and the largest
/// number.
#[inline]
pub const fn binary_logarithm(value: f64) -> f64 {
    let bits = value.clamp(f64::MIN_POSITIVE, f64::MAX).to_bits();
    // A fraction within a factor √2 of 1, times a power of two.
    let upper = bits & 0xF_FFFF_FFFF_FFFF > 0x6_A09E_667F_3BCC;
    let exponent = (bits >> 52) as i64 - 1023 + upper as i64;
    let fraction = f64::from_bits(bits & 0xF_FFFF_FFFF_FFFF | (1023 - upper as u64) << 52);
    // ln x = 2 artanh((x - 1) / (x + 1)).
    let s = (fraction - 1.0) / (fraction + 1.0);
    let square = s * s;
    let series = 1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0)));
    exponent as f64 + 2.0 * std::f64::consts::LOG2_E * s * series
}

/// 2 to a power, to 1e-7 of itself. Beyond the range of normal numbers the power is that at its ends.
#[inline]
pub fn binary_power(exponent: f64) -> f64 {
    let exponent = exponent.clamp(-1022.0, 1023.0);
    let whole = (exponent + if exponent < 0.0 { -0.5 } else { 0.5 }) as i64;
    let x = (exponent - whole as f64) * std::f64::consts::LN_2;
    // Lengths of steps wait for this sum: its parts do not wait for each other.
    let square = x * x;
    let low = (1.0 + x) + square * (1.0 / 2.0 + x * (1.0 / 6.0));
    let high = (1.0 / 24.0 + x * (1.0 / 120.0)) + square * (1.0 / 720.0 + x * (1.0 / 5040.0));
    (low + square * square * high) * f64::from_bits(((whole + 1023) as u64) << 52)
}

/// A number above zero to a power, to 1e-7 of itself times one and the size of the exponent.
#[inline]
pub fn power(value: f64, exponent: f64) -> f64 {
    binary_power(exponent * binary_logarithm(value))
}
