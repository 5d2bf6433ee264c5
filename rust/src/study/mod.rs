//! Many runs: sweeps over parameters (the only threads), Chebyshev polynomials and their bounds. In: mechanisms, or
//! samples of runs; out: trajectories, coefficients, bounds. Uses `run` and `numerics`.

pub mod bounds;
pub mod chebyshev;
pub mod sweep;
