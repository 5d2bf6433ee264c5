//! The compiled mechanism: flat, constant, holding only what the scene uses. In: a scene; out: frames, spanning
//! tree, cut joints, assembled start, scales. Uses `scene`, `contact`, `numerics`.

pub mod assembly;
mod balance;
pub mod compiled;
pub mod constraints;
mod immovable;
pub mod kinematics;
mod scales;
mod tree;
