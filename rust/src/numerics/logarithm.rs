//! Logarithms to seven digits, for comparing lengths of steps: half the cost of the standard ones.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_have_seven_digits_over_the_whole_range() {
        for k in -3000..=3000 {
            let value = (0.1 * f64::from(k)).exp();
            assert!((binary_logarithm(value) - value.log2()).abs() < 1e-7);
        }
    }

    #[test]
    fn ends_of_the_range_are_finite() {
        for value in [0.0, 5e-324, f64::MAX, f64::INFINITY] {
            assert!(binary_logarithm(value).abs() <= 1024.0);
        }
    }
}
