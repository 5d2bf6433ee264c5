//! Numerical tools without mechanics: dual numbers, ranges, small dense linear algebra, instants and angles that keep
//! their digits in long runs, sines and cosines of angles that change little, splines, logarithms to a few
//! digits. In:
//! numbers; out: numbers. Uses no other room.

pub mod accuracy;
pub mod dual;
pub mod extremum;
pub mod instant;
pub mod interval;
pub mod jet;
pub mod linear;
pub mod logarithm;
pub mod memory;
pub mod rotation;
pub(crate) mod spline;
pub mod turns;
