//! Logarithms and powers to seven digits, against those of the standard library.

use chebclear::numerics::logarithm::{binary_logarithm, binary_power, power};

#[test]
fn logarithms_have_seven_digits_over_the_whole_range() {
    for k in -3000..=3000 {
        let value = (0.1 * f64::from(k)).exp();
        assert!((binary_logarithm(value) - value.log2()).abs() < 1e-7);
    }
}

#[test]
fn powers_have_seven_digits_over_the_whole_range() {
    for k in -10220..=10220 {
        let exponent = 0.1 * f64::from(k);
        assert!((binary_power(exponent) / exponent.exp2() - 1.0).abs() < 1e-7, "{exponent}");
    }
    assert_eq!([binary_power(f64::INFINITY), binary_power(1e9)], [f64::exp2(1023.0); 2]);
    assert_eq!([binary_power(f64::NEG_INFINITY), binary_power(-1e9)], [f64::exp2(-1022.0); 2]);
    for (value, exponent) in [(1e-8, -0.2), (3.0, 0.5), (1e300, -1.0 / 13.0)] {
        assert!((power(value, exponent) / value.powf(exponent) - 1.0).abs() < 2e-7);
    }
}

#[test]
fn ends_of_the_range_are_finite() {
    for value in [0.0, 5e-324, f64::MAX, f64::INFINITY] {
        assert!(binary_logarithm(value).abs() <= 1024.0);
    }
}
