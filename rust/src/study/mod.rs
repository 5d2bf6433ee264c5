//! Many runs: sweeps over parameters (the only threads), Chebyshev polynomials and their bounds. In: mechanisms, or
//! samples of runs; out: trajectories, coefficients, bounds. Uses `run` and `numerics`.

mod bernstein;
pub mod bounds;
mod branch_and_bound;
pub mod chebyshev;
pub mod range;
pub mod sweep;
