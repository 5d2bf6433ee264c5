//! The compiled mechanism, complete when it exists. In: a scene; out: its tree, an assembled start, scales
//! for error control, warnings. Uses `dynamics`, `tree`, `scene`, `numerics`.

mod assembly;
mod balance;
pub mod branch;
mod closing;
pub mod compiled;
mod conditions;
mod couplings;
mod immovable;
mod nearest;
mod scales;
pub mod small_motions;
mod springs;
mod vector_loops;
