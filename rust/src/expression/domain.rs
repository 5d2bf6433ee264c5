//! Which functions of an expression its motion may ask for outside their domains, by intervals of what their arguments can
//! be: a root of an absolute value has no end that must be watched.

use std::f64::consts::{FRAC_PI_2, PI};

use super::grammar::{Binary, Function, Switching, Syntax};

/// The numbers for which a function has a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Domain {
    /// Those that are not negative.
    NotNegative,
    /// Those from -1 to 1.
    WithinOne,
}

const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The domain of the outermost function of a part, if its argument may leave it; `named` gives the range of a name.
pub(super) fn domain_left(syntax: &Syntax, named: &dyn Fn(&str) -> [f64; 2]) -> Option<Domain> {
    let of = |part: &Syntax| range(part, named);
    let (domain, [least, largest]) = match syntax {
        Syntax::Call(Function::Sqrt | Function::Log, inner) => (Domain::NotNegative, of(inner)),
        Syntax::Call(Function::Acos | Function::Asin, inner) => (Domain::WithinOne, of(inner)),
        Syntax::Binary(Binary::Power, pair) => {
            let [base, exponent] = [of(&pair[0]), of(&pair[1])];
            if is_whole(exponent) {
                return None;
            }
            (Domain::NotNegative, base)
        }
        _ => return None,
    };
    let stays = match domain {
        Domain::NotNegative => least >= 0.0,
        Domain::WithinOne => least >= -1.0 && largest <= 1.0,
    };
    (!stays).then_some(domain)
}

/// Whether a range is a whole number.
fn is_whole([least, largest]: [f64; 2]) -> bool {
    least == largest && least.fract() == 0.0
}

/// Least and largest value that a part can have, or less and more.
fn range(syntax: &Syntax, named: &dyn Fn(&str) -> [f64; 2]) -> [f64; 2] {
    let of = |part: &Syntax| range(part, named);
    let found = match syntax {
        Syntax::Number(value) => [*value; 2],
        Syntax::Name(name, _) => named(name),
        Syntax::Negative(inner) => negative(of(inner)),
        Syntax::Call(function, inner) => of_function(*function, of(inner)),
        Syntax::Binary(operation, pair) => {
            let is_square = *operation == Binary::Multiply && pair[0] == pair[1];
            let [left, right] = [of(&pair[0]), of(&pair[1])];
            if is_square { power(left, 2.0) } else { of_pair(*operation, left, right) }
        }
        Syntax::Switch(switching, arguments) => {
            let parts = arguments.iter().map(of);
            match switching {
                Switching::Sign => [-1.0, 1.0],
                Switching::Abs => parts.fold(ALL, |_, range| absolute(range)),
                Switching::Min => parts.fold([f64::INFINITY; 2], |a, b| [a[0].min(b[0]), a[1].min(b[1])]),
                Switching::Max => parts.fold([f64::NEG_INFINITY; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]),
                Switching::If => hull(parts.skip(2).flatten()),
            }
        }
    };
    // What infinite ends leave undetermined.
    if found.iter().any(|end| end.is_nan()) { ALL } else { found }
}

fn hull(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, largest], value| {
        // The product of zero and infinity is none.
        if value.is_nan() { ALL } else { [least.min(value), largest.max(value)] }
    })
}

fn negative([least, largest]: [f64; 2]) -> [f64; 2] {
    [-largest, -least]
}

fn absolute([least, largest]: [f64; 2]) -> [f64; 2] {
    let ends = [least.abs(), largest.abs()];
    let least = if least <= 0.0 && largest >= 0.0 { 0.0 } else { ends[0].min(ends[1]) };
    [least, ends[0].max(ends[1])]
}

fn power(base: [f64; 2], exponent: f64) -> [f64; 2] {
    let [least, largest] = match exponent {
        _ if exponent % 2.0 == 0.0 => absolute(base),
        _ if exponent.fract() == 0.0 && exponent > 0.0 => base,
        // A power has no value of negative numbers.
        _ if exponent.fract() != 0.0 => base.map(|end| end.max(0.0)),
        _ => return ALL,
    };
    hull([least, largest].into_iter().map(|end| end.powf(exponent)))
}

fn of_pair(operation: Binary, left: [f64; 2], right: [f64; 2]) -> [f64; 2] {
    let products = |right: [f64; 2]| hull(left.into_iter().flat_map(|a| right.map(|b| a * b)));
    match operation {
        Binary::Add => [left[0] + right[0], left[1] + right[1]],
        Binary::Subtract => [left[0] - right[1], left[1] - right[0]],
        Binary::Multiply => products(right),
        Binary::Divide if right[0] > 0.0 || right[1] < 0.0 => products([1.0 / right[1], 1.0 / right[0]]),
        Binary::Divide => ALL,
        Binary::Power if right[0] == right[1] => power(left, right[0]),
        // exp(y ln x)
        Binary::Power => [0.0, f64::INFINITY],
        Binary::Atan2 => [-PI, PI],
        Binary::Hypot => {
            let [a, b] = [absolute(left), absolute(right)];
            [a[0].hypot(b[0]), a[1].hypot(b[1])]
        }
    }
}

fn of_function(function: Function, [least, largest]: [f64; 2]) -> [f64; 2] {
    let rising = |of: fn(f64) -> f64| [of(least), of(largest)];
    match function {
        Function::Acos => [0.0, PI],
        Function::Asin | Function::Atan => [-FRAC_PI_2, FRAC_PI_2],
        Function::Sin | Function::Cos | Function::Tanh => [-1.0, 1.0],
        Function::Exp => rising(f64::exp),
        Function::Log => [least.max(0.0).ln(), largest.max(0.0).ln()],
        Function::Sqrt => [least.max(0.0).sqrt(), largest.max(0.0).sqrt()],
        Function::Tan => ALL,
    }
}
