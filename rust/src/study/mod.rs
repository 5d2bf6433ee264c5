//! Many runs: points of the box, sweeps over parameters (with `band` and `range` the only threads), polynomials and
//! their bounds, bands. In: mechanisms, or samples of runs; out: trajectories, coefficients, bounds. Uses `run` and `numerics`.

pub mod band;
mod bernstein;
pub mod bounds;
mod branch_and_bound;
pub mod chebyshev;
pub mod points;
mod pool;
pub mod range;
pub mod sweep;
