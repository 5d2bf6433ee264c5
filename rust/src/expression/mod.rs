//! Expressions and tables of the motion: text and points into straight lists of operations. In: text, constants,
//! points; out: tapes that are evaluated on numbers and on dual numbers, with the instants at which they switch. Uses
//! `numerics` and `error`.

mod compiler;
pub mod curve;
pub mod dimension;
mod domain;
mod functions;
pub mod grammar;
pub mod tape;
