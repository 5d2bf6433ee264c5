//! Expressions and tables of the motion: text and points into straight lists of operations. In: text, constants,
//! points; out: tapes that are evaluated on numbers, on dual numbers and on ranges, with the instants at which they switch.
//! Uses `numerics` and `error`.

mod compiler;
pub mod curve;
pub mod dimension;
mod domain;
pub mod enclosure;
mod functions;
pub mod grammar;
pub mod tape;
