//! Angles of many turns, stored as an angle within half a turn and a number of full turns.
//!
//! A sum of angles has the rounding error of the largest one: after 10 000 revolutions the gap of a
//! closed loop of relative angles would be 1e-11 of its size.

use std::f64::consts::{PI, TAU};

use crate::numerics::instant::exact_sum;

/// Full turns [-], a whole number.
pub type Turns = f64;

/// The leading 31 bits of 2π: their product with up to four million turns is exact.
const TAU_HEAD: f64 = f64::from_bits(TAU.to_bits() & !0x3F_FFFF);
/// The rest of 2π, including the difference between 2π and its nearest double.
const TAU_TAIL: f64 = TAU - TAU_HEAD + 2.449_293_598_294_706_4e-16;

/// An angle [rad] as one within half a turn and full turns.
#[inline]
pub fn wrap(angle: f64) -> (f64, Turns) {
    unwind_sum(angle, 0.0)
}

/// The same for an angle and its rounding error, which the angle within half a turn can represent.
#[inline]
pub fn unwind_sum(angle: f64, rest: f64) -> (f64, Turns) {
    let ([angle, rest], turns) = parts(angle, rest);
    (angle + rest, turns)
}

/// The same with the rounding error of the angle within half a turn.
#[inline]
pub fn unwind_exactly(angle: f64, rest: f64) -> ([f64; 2], Turns) {
    let ([angle, rest], turns) = parts(angle, rest);
    (exact_sum(angle, rest).into(), turns)
}

/// An angle within half a turn as a sum of two numbers, and full turns.
#[inline]
fn parts(angle: f64, rest: f64) -> ([f64; 2], Turns) {
    if angle.abs() <= PI {
        return ([angle, rest], 0.0);
    }
    let turns = (angle / TAU).round();
    ([angle - turns * TAU_HEAD, -(turns * TAU_TAIL - rest)], turns)
}

/// The angle [rad] with its full turns.
#[inline]
pub fn with_turns(angle: f64, turns: Turns) -> f64 {
    turns * TAU_HEAD + (angle + turns * TAU_TAIL)
}
