//! Units of expressions, as far as they are known: those of names are, those of plain numbers are not.

use super::grammar::{Binary, Function, Switching, Syntax};

/// Exponents of kilogram, meter and second; angles count as plain numbers.
pub type Dimension = [i8; 3];

/// A plain number, such as an angle.
pub const PLAIN: Dimension = [0; 3];

/// A force.
pub const FORCE: Dimension = [1, 1, -2];

/// A torque.
pub const TORQUE: Dimension = [1, 2, -2];

/// A dimension as a unit.
pub fn unit(dimension: Dimension) -> String {
    match dimension {
        PLAIN => return "-".to_owned(),
        FORCE => return "N".to_owned(),
        TORQUE => return "N m".to_owned(),
        _ => {}
    }
    let parts = ["kg", "m", "s"].into_iter().zip(dimension).filter(|(_, exponent)| *exponent != 0);
    let written = parts
        .map(|(name, exponent)| if exponent == 1 { name.to_owned() } else { format!("{name}^{exponent}") });
    written.collect::<Vec<_>>().join(" ")
}

/// The dimension of an expression, `None` where it depends on plain numbers, which may stand for anything.
///
/// # Errors
/// Sums, comparisons or arguments whose dimensions differ.
pub fn dimension(
    syntax: &Syntax,
    of_name: &dyn Fn(&str) -> Option<Dimension>,
) -> Result<Option<Dimension>, String> {
    let of = |part: &Syntax| dimension(part, of_name);
    Ok(match syntax {
        Syntax::Number(_) => None,
        Syntax::Name(name, _) => of_name(name),
        Syntax::Negative(inner) => of(inner)?,
        Syntax::Binary(operation, pair) => {
            let (left, right) = (of(&pair[0])?, of(&pair[1])?);
            match operation {
                Binary::Add | Binary::Subtract => same("adds or subtracts", left, right)?,
                Binary::Hypot => same("compares", left, right)?,
                Binary::Atan2 => same("compares", left, right)?.and(Some(PLAIN)),
                Binary::Multiply => left.zip(right).map(|(a, b)| combined(a, b, 1)),
                Binary::Divide => left.zip(right).map(|(a, b)| combined(a, b, -1)),
                Binary::Power => {
                    plain("the exponent", right)?;
                    match (&pair[1], left) {
                        (_, Some(PLAIN)) => Some(PLAIN),
                        (&Syntax::Number(exponent), Some(base))
                            if exponent.fract() == 0.0 && exponent.abs() < 8.0 =>
                        {
                            Some(combined(PLAIN, base, exponent as i8))
                        }
                        _ => None,
                    }
                }
            }
        }
        Syntax::Call(Function::Sqrt, inner) => of(inner)?
            .filter(|dimension| dimension.iter().all(|exponent| exponent % 2 == 0))
            .map(|dimension| dimension.map(|exponent| exponent / 2)),
        Syntax::Call(function, inner) => {
            plain(&format!("the argument of {}", format!("{function:?}").to_lowercase()), of(inner)?)?;
            Some(PLAIN)
        }
        Syntax::Switch(switching, arguments) => {
            let found = arguments.iter().map(of).collect::<Result<Vec<_>, _>>()?;
            match switching {
                Switching::Sign => Some(PLAIN),
                Switching::If => {
                    same("compares", found[0], found[1])?;
                    same("chooses between", found[2], found[3])?
                }
                Switching::Abs | Switching::Min | Switching::Max => {
                    found.into_iter().try_fold(None, |one, other| {
                        same("compares", one, other).map(|both| both.or(one).or(other))
                    })?
                }
            }
        }
    })
}

/// The dimension that both have; unknown if one of them is.
fn same(verb: &str, left: Option<Dimension>, right: Option<Dimension>) -> Result<Option<Dimension>, String> {
    match (left, right) {
        (Some(a), Some(b)) if a != b => Err(format!("{verb} [{}] and [{}]", unit(a), unit(b))),
        (Some(a), Some(_)) => Ok(Some(a)),
        // A number beside a length is a length.
        (known, other) => Ok(known.or(other)),
    }
}

fn plain(what: &str, dimension: Option<Dimension>) -> Result<(), String> {
    match dimension {
        Some(known) if known != PLAIN => Err(format!(
            "has [{}] as {what}, which must be a number or an angle: divide it by a constant",
            unit(known)
        )),
        _ => Ok(()),
    }
}

fn combined(a: Dimension, b: Dimension, times: i8) -> Dimension {
    [0, 1, 2].map(|k| a[k].saturating_add(b[k].saturating_mul(times)))
}
