//! Ranges of numbers and of elementary functions over them. Rounding errors are not enclosed: they are far below the
//! differences that the ranges are compared with.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All numbers from the lower to the upper one, both included; from minus to plus infinity where nothing is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

impl Interval {
    /// What is known of a number of which nothing is known.
    pub const WHOLE: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    /// A single number.
    pub fn point(value: f64) -> Self {
        Self::of([value, value])
    }

    /// The interval between two numbers, in any order.
    pub fn between(a: f64, b: f64) -> Self {
        Self::of([a.min(b), a.max(b)])
    }

    /// The interval with these ends; the whole line where one of them is not a number.
    fn of([lower, upper]: [f64; 2]) -> Self {
        if lower <= upper { Self { lower, upper } } else { Self::WHOLE }
    }

    /// The least interval that holds all these numbers.
    fn hull<const N: usize>(numbers: [f64; N]) -> Self {
        // max and min would drop a NaN.
        if numbers.iter().any(|number| number.is_nan()) {
            return Self::WHOLE;
        }
        let [lower, upper] = numbers
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| [low.min(x), high.max(x)]);
        Self { lower, upper }
    }

    /// The least interval that holds both.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// Whether it holds a number.
    pub fn holds(self, value: f64) -> bool {
        self.lower <= value && value <= self.upper
    }

    /// Largest absolute value in it.
    pub fn magnitude(self) -> f64 {
        self.lower.abs().max(self.upper.abs())
    }

    /// Its part in a domain; the whole line if there is none.
    fn within(self, lower: f64, upper: f64) -> Option<Self> {
        (self.upper >= lower && self.lower <= upper)
            .then(|| Self { lower: self.lower.max(lower), upper: self.upper.min(upper) })
    }

    /// A function that grows.
    fn growing(self, function: impl Fn(f64) -> f64) -> Self {
        Self::of([function(self.lower), function(self.upper)])
    }

    /// Square.
    #[must_use]
    pub fn square(self) -> Self {
        let [a, b] = [self.lower * self.lower, self.upper * self.upper];
        Self::of([if self.holds(0.0) { 0.0 } else { a.min(b) }, a.max(b)])
    }

    /// Exponential.
    #[must_use]
    pub fn exp(self) -> Self {
        self.growing(f64::exp)
    }

    /// Natural logarithm of what is positive.
    #[must_use]
    pub fn ln(self) -> Self {
        self.within(0.0, f64::INFINITY).map_or(Self::WHOLE, |x| x.growing(f64::ln))
    }

    /// A power with a constant exponent, of what is positive if the exponent is not whole.
    #[must_use]
    pub fn power(self, exponent: f64) -> Self {
        if exponent == 0.0 {
            return Self::point(1.0);
        }
        if exponent.fract() != 0.0 {
            let domain = self.within(0.0, f64::INFINITY);
            return domain.map_or(Self::WHOLE, |x| Self::hull([x.lower, x.upper].map(|x| x.powf(exponent))));
        }
        if !self.holds(0.0) || exponent > 0.0 {
            let ends = [self.lower.powf(exponent), self.upper.powf(exponent)];
            let passes_zero = self.holds(0.0) && exponent % 2.0 == 0.0;
            return if passes_zero { Self::hull([ends[0], ends[1], 0.0]) } else { Self::hull(ends) };
        }
        Self::WHOLE
    }

    /// Sine.
    #[must_use]
    pub fn sin(self) -> Self {
        (self - Self::point(FRAC_PI_2)).cos()
    }

    /// Cosine.
    #[must_use]
    pub fn cos(self) -> Self {
        let width = self.upper - self.lower;
        if width.is_nan() || width >= 2.0 * PI {
            return Self { lower: -1.0, upper: 1.0 };
        }
        // Whole half turns in it: even ones are maxima, odd ones minima.
        let (first, last) = ((self.lower / PI).ceil(), (self.upper / PI).floor());
        let [a, b] = [self.lower.cos(), self.upper.cos()];
        let has = |odd: bool| first <= last && (last > first || (first.rem_euclid(2.0) == 1.0) == odd);
        Self {
            lower: if has(true) { -1.0 } else { a.min(b) },
            upper: if has(false) { 1.0 } else { a.max(b) },
        }
    }

    /// Tangent.
    #[must_use]
    pub fn tan(self) -> Self {
        let piece = |x: f64| (x / PI + 0.5).floor();
        if self.upper - self.lower < PI && piece(self.lower) == piece(self.upper) {
            self.growing(f64::tan)
        } else {
            Self::WHOLE
        }
    }

    /// Hyperbolic tangent.
    #[must_use]
    pub fn tanh(self) -> Self {
        self.growing(f64::tanh)
    }

    /// Inverse tangent.
    #[must_use]
    pub fn atan(self) -> Self {
        self.growing(f64::atan)
    }

    /// Inverse sine.
    #[must_use]
    pub fn asin(self) -> Self {
        self.within(-1.0, 1.0).map_or(Self::WHOLE, |x| x.growing(f64::asin))
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::of([self.lower + other.lower, self.upper + other.upper])
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + (-other)
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        // Zero times what has no bound is zero: the factor is zero everywhere.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        Self::hull([
            product(self.lower, other.lower),
            product(self.lower, other.upper),
            product(self.upper, other.lower),
            product(self.upper, other.upper),
        ])
    }
}

impl Mul<f64> for Interval {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self * Self::point(factor)
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.holds(0.0) {
            return if self == Self::point(0.0) { self } else { Self::WHOLE };
        }
        self * Self::hull([1.0 / other.lower, 1.0 / other.upper])
    }
}
