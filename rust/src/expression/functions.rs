//! The functions of expressions on any number type, not inlined: the loop over the operations of a tape should stay small.

use super::grammar::{Binary, Function};
use crate::numerics::dual::Scalar;
use crate::numerics::jet::derivatives;

impl Function {
    // Not inlined, so that the loop over the operations stays small.
    #[inline(never)]
    pub(super) fn of<S: Scalar>(self, x: S) -> S {
        let at = x.value();
        x.compose(match self {
            Function::Acos => derivatives::acos(at),
            Function::Asin => derivatives::asin(at),
            Function::Atan => derivatives::atan(at),
            Function::Cos => derivatives::cos(at),
            Function::Exp => derivatives::exp(at),
            Function::Log => derivatives::ln(at),
            Function::Sin => derivatives::sin(at),
            Function::Sqrt => derivatives::sqrt(at),
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
            // x^y = exp(y ln x)
            Binary::Power => {
                let exponent = right * left.compose(derivatives::ln(left.value()));
                exponent.compose(derivatives::exp(exponent.value()))
            }
            Binary::Atan2 => left.atan2(right),
            Binary::Hypot => (left * left + right * right).sqrt(),
        }
    }
}

/// A power with a constant exponent.
// Not inlined for the same reason.
#[inline(never)]
pub(super) fn power_by<S: Scalar>(x: S, exponent: f64) -> S {
    x.compose(derivatives::power(x.value(), exponent))
}
