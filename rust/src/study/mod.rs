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

/// Columns, points or instants that are worked on together, so that their rows stay in the first-level cache and a task of a
/// thread takes some tenths of a millisecond. Answers do not depend on it; 64 to 512 take the same time.
const BLOCK: usize = 64;
