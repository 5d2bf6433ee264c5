//! The functions of expressions on any number type, not inlined: the loop over the operations of a tape should stay small.
//!
//! Beyond its domain a function is continued, for the trial states of a step: a root, a power and an inverse sine or cosine
//! keep the value at the end of the domain, and what has a pole at zero is mirrored there. Where a slope is infinite it
//! counts as none: methods then take that point as explicit ones do.

use super::grammar::{Binary, Function};
use crate::numerics::dual::Scalar;
use crate::numerics::jet::derivatives;

impl Function {
    // Not inlined, so that the loop over the operations stays small.
    #[inline(never)]
    pub(super) fn of<S: Scalar>(self, x: S) -> S {
        let at = x.value();
        x.compose(match self {
            Function::Acos if at.abs() >= 1.0 => {
                return x.continued(derivatives::acos(at), level(at.clamp(-1.0, 1.0).acos()));
            }
            Function::Asin if at.abs() >= 1.0 => {
                return x.continued(derivatives::asin(at), level(at.clamp(-1.0, 1.0).asin()));
            }
            Function::Log if at < 0.0 => {
                let [_, slope, curvature, third] = derivatives::ln(at);
                return x.continued(derivatives::ln(at), [(-at).ln(), slope, curvature, third]);
            }
            Function::Sqrt => return root(x),
            Function::Acos => derivatives::acos(at),
            Function::Asin => derivatives::asin(at),
            Function::Atan => derivatives::atan(at),
            Function::Cos => derivatives::cos(at),
            Function::Exp => derivatives::exp(at),
            Function::Log => derivatives::ln(at),
            Function::Sin => derivatives::sin(at),
            Function::Tan => derivatives::tan(at),
            Function::Tanh => derivatives::tanh(at),
        })
    }
}

impl Binary {
    // Not inlined for the same reason; arithmetic has operations of its own.
    #[inline(never)]
    pub(super) fn of<S: Scalar>(self, left: S, right: S) -> S {
        match self {
            Binary::Add => left + right,
            Binary::Subtract => left - right,
            Binary::Multiply => left * right,
            Binary::Divide => left / right,
            Binary::Power if left.value() <= 0.0 && right.value() > 0.0 => {
                let value = if left.value() < 0.0 { f64::NAN } else { 0.0 };
                left.continued([value, f64::NAN, f64::NAN, f64::NAN], level(0.0))
            }
            // x^y = exp(y ln x)
            Binary::Power => {
                let exponent = right * Function::Log.of(left);
                exponent.compose(derivatives::exp(exponent.value()))
            }
            Binary::Atan2 if left.value() == 0.0 && right.value() == 0.0 => {
                let angle = left.value().atan2(right.value());
                left.continued([angle, f64::NAN, f64::NAN, f64::NAN], level(angle))
            }
            Binary::Atan2 => left.atan2(right),
            Binary::Hypot => root(left * left + right * right),
        }
    }
}

/// Square root.
#[inline]
pub(super) fn root<S: Scalar>(x: S) -> S {
    let at = x.value();
    if at <= 0.0 { x.continued(derivatives::sqrt(at), level(0.0)) } else { x.sqrt() }
}

/// The power 3/2.
#[inline]
pub(super) fn three_halves<S: Scalar>(x: S) -> S {
    let (at, inside) = (x.value(), derivatives::three_halves(x.value()));
    if at < 0.0 { x.continued(inside, level(0.0)) } else { x.compose(inside) }
}

/// A power with a constant exponent.
// Not inlined for the same reason.
#[inline(never)]
pub(super) fn power_by<S: Scalar>(x: S, exponent: f64) -> S {
    let (at, inside) = (x.value(), derivatives::power(x.value(), exponent));
    if at > 0.0 || exponent.fract() == 0.0 || at == 0.0 && exponent > 1.0 {
        return x.compose(inside);
    }
    if exponent > 0.0 {
        return x.continued(inside, level(0.0));
    }
    let [value, slope, curvature, third] = derivatives::power(-at, exponent);
    x.continued(inside, [value, -slope, curvature, -third])
}

/// A function that keeps a value.
fn level(value: f64) -> [f64; 4] {
    [value, 0.0, 0.0, 0.0]
}
