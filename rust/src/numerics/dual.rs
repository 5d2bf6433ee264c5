//! Forward-mode dual numbers: exact first derivatives of the contact and friction laws.
//!
//! The laws are written once, for any [`Scalar`]. They are evaluated on `f64` in every stage and on
//! [`Dual`] once per step, for the Jacobian, so that a new law needs no derivatives of its own.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::numerics::jet::derivatives;

/// A number type of the force laws: `f64` or [`Dual`].
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// A constant: its derivatives are zero.
    fn constant(value: f64) -> Self;
    /// The value without derivatives, on which branches depend.
    fn value(self) -> f64;
    /// A function f of the number, by its value and first three derivatives there.
    fn compose(self, derivatives: [f64; 4]) -> Self;
    /// The same at the end of the domain of the function or beyond it, where it is continued with other derivatives. A
    /// number whose three derivatives are asked for is not continued.
    fn continued(self, _inside: [f64; 4], beyond: [f64; 4]) -> Self {
        self.compose(beyond)
    }
    /// Square root.
    #[inline]
    fn sqrt(self) -> Self {
        self.compose(derivatives::sqrt(self.value()))
    }
    /// Power with a constant exponent.
    #[inline]
    fn powf(self, exponent: f64) -> Self {
        self.compose(derivatives::power(self.value(), exponent))
    }
    /// Sine.
    #[inline]
    fn sin(self) -> Self {
        self.compose(derivatives::sin(self.value()))
    }
    /// Cosine.
    #[inline]
    fn cos(self) -> Self {
        self.compose(derivatives::cos(self.value()))
    }
    /// Hyperbolic tangent.
    #[inline]
    fn tanh(self) -> Self {
        self.compose(derivatives::tanh(self.value()))
    }
    /// Angle of the vector with this number as its second component and `x` as its first.
    fn atan2(self, x: Self) -> Self {
        let angle = self.value().atan2(x.value());
        // Angles differ from the arc tangent of either ratio by a constant.
        let ratio = if x.value().abs() >= self.value().abs() { self / x } else { -(x / self) };
        let r = ratio.value();
        let slope = 1.0 / (1.0 + r * r);
        ratio.compose([angle, slope, -2.0 * r * slope * slope, (6.0 * r * r - 2.0) * slope * slope * slope])
    }
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn compose(self, derivatives: [f64; 4]) -> Self {
        derivatives[0]
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn powf(self, exponent: f64) -> Self {
        f64::powf(self, exponent)
    }
    fn sin(self) -> Self {
        f64::sin(self)
    }
    fn cos(self) -> Self {
        f64::cos(self)
    }
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
}

/// A value and its derivatives with respect to `N` inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// The derivative with respect to each input.
    pub gradient: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The input number `index` at `value`: its derivative with respect to itself is 1.
    pub fn input(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; N];
        gradient[index] = 1.0;
        Self { value, gradient }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    fn constant(value: f64) -> Self {
        Self { value, gradient: [0.0; N] }
    }
    fn value(self) -> f64 {
        self.value
    }
    /// The chain rule.
    fn compose(self, [value, slope, ..]: [f64; 4]) -> Self {
        Self { value, gradient: self.gradient.map(|g| slope * g) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let mut gradient = self.gradient;
        for k in 0..N {
            gradient[k] += other.gradient[k];
        }
        Self { value: self.value + other.value, gradient }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + (-other)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let mut gradient = [0.0; N];
        for k in 0..N {
            gradient[k] = self.gradient[k] * other.value + self.value * other.gradient[k];
        }
        Self { value: self.value * other.value, gradient }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let mut gradient = [0.0; N];
        for k in 0..N {
            gradient[k] = (self.gradient[k] - value * other.gradient[k]) / other.value;
        }
        Self { value, gradient }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, gradient: self.gradient }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        self + (-other)
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        Self { value: self.value * other, gradient: self.gradient.map(|g| other * g) }
    }
}
