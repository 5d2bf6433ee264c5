//! A number with its first three derivatives with respect to one variable, and those of elementary functions.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::numerics::dual::Scalar;

/// A value and its first three derivatives with respect to one variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet(pub [f64; 4]);

impl Jet {
    /// The variable itself.
    pub fn variable(value: f64) -> Self {
        Jet([value, 1.0, 0.0, 0.0])
    }
}

/// Derivatives of orders 0 to 3 of elementary functions at a number.
pub mod derivatives {
    /// Inverse sine.
    pub fn asin(x: f64) -> [f64; 4] {
        let rest = 1.0 - x * x;
        let root = rest.sqrt();
        [x.asin(), 1.0 / root, x / (rest * root), (1.0 + 2.0 * x * x) / (rest * rest * root)]
    }

    /// Inverse cosine.
    pub fn acos(x: f64) -> [f64; 4] {
        let [_, first, second, third] = asin(x);
        [x.acos(), -first, -second, -third]
    }

    /// Inverse tangent.
    pub fn atan(x: f64) -> [f64; 4] {
        let inverse = 1.0 / (1.0 + x * x);
        let square = inverse * inverse;
        [x.atan(), inverse, -2.0 * x * square, (6.0 * x * x - 2.0) * square * inverse]
    }

    /// Sine.
    pub fn sin(x: f64) -> [f64; 4] {
        let (sine, cosine) = (x.sin(), x.cos());
        [sine, cosine, -sine, -cosine]
    }

    /// Cosine.
    pub fn cos(x: f64) -> [f64; 4] {
        let (sine, cosine) = (x.sin(), x.cos());
        [cosine, -sine, -cosine, sine]
    }

    /// Exponential.
    pub fn exp(x: f64) -> [f64; 4] {
        [x.exp(); 4]
    }

    /// Natural logarithm.
    pub fn ln(x: f64) -> [f64; 4] {
        let inverse = 1.0 / x;
        [x.ln(), inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse]
    }

    /// Square root.
    pub fn sqrt(x: f64) -> [f64; 4] {
        let root = x.sqrt();
        [root, 0.5 / root, -0.25 / (root * x), 0.375 / (root * x * x)]
    }

    /// Tangent.
    pub fn tan(x: f64) -> [f64; 4] {
        let tangent = x.tan();
        let square = 1.0 + tangent * tangent;
        [tangent, square, 2.0 * tangent * square, square * (2.0 * square + 4.0 * tangent * tangent)]
    }

    /// Hyperbolic tangent.
    pub fn tanh(x: f64) -> [f64; 4] {
        let tangent = x.tanh();
        let rest = 1.0 - tangent * tangent;
        [tangent, rest, -2.0 * tangent * rest, rest * (6.0 * tangent * tangent - 2.0)]
    }

    /// The power 3/2.
    pub fn three_halves(x: f64) -> [f64; 4] {
        let root = x.sqrt();
        [x * root, 1.5 * root, 0.75 / root, -0.375 / (x * root)]
    }

    /// A power with a constant exponent; a factor of zero is zero, also at zero.
    pub fn power(x: f64, exponent: f64) -> [f64; 4] {
        let mut factor = 1.0;
        [0.0, 1.0, 2.0, 3.0].map(|order| {
            let derivative = if factor == 0.0 { 0.0 } else { factor * x.powf(exponent - order) };
            factor *= exponent - order;
            derivative
        })
    }
}

impl Scalar for Jet {
    fn constant(value: f64) -> Self {
        Jet([value, 0.0, 0.0, 0.0])
    }
    fn value(self) -> f64 {
        self.0[0]
    }
    fn continued(self, inside: [f64; 4], _beyond: [f64; 4]) -> Self {
        self.compose(inside)
    }
    /// The rule of Faà di Bruno.
    fn compose(self, [value, first, second, third]: [f64; 4]) -> Self {
        let Jet([_, x1, x2, x3]) = self;
        Jet([
            value,
            first * x1,
            second * x1 * x1 + first * x2,
            third * x1 * x1 * x1 + 3.0 * second * x1 * x2 + first * x3,
        ])
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Jet([0, 1, 2, 3].map(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Jet([0, 1, 2, 3].map(|k| self.0[k] - other.0[k]))
    }
}

impl Mul for Jet {
    type Output = Self;
    /// The rule of Leibniz.
    fn mul(self, other: Self) -> Self {
        let (Jet([a, a1, a2, a3]), Jet([b, b1, b2, b3])) = (self, other);
        Jet([
            a * b,
            a1 * b + a * b1,
            a2 * b + 2.0 * a1 * b1 + a * b2,
            a3 * b + 3.0 * (a2 * b1 + a1 * b2) + a * b3,
        ])
    }
}

impl Div for Jet {
    type Output = Self;
    /// From (a / b) b = a, order by order.
    fn div(self, other: Self) -> Self {
        let (Jet([a, a1, a2, a3]), Jet([b, b1, b2, b3])) = (self, other);
        let value = a / b;
        let first = (a1 - value * b1) / b;
        let second = (a2 - 2.0 * first * b1 - value * b2) / b;
        Jet([value, first, second, (a3 - 3.0 * (second * b1 + first * b2) - value * b3) / b])
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Jet(self.0.map(|derivative| -derivative))
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(mut self, other: f64) -> Self {
        self.0[0] += other;
        self
    }
}

impl Sub<f64> for Jet {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        self + (-other)
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        Jet(self.0.map(|derivative| derivative * other))
    }
}
