//! Many runs: points of the box of parameters, sweeps over them, polynomials and their bounds, bands. The
//! only room that computes in parallel. In: mechanisms, or samples of runs; out: trajectories, coefficients,
//! bounds. Uses `run` and `numerics`.

pub mod band;
mod bernstein;
pub mod bounds;
mod branch_and_bound;
pub mod chebyshev;
pub mod points;
mod pool;
pub mod range;
pub mod sweep;
