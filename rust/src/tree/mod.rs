//! The bodies of a scene on a spanning tree of frames. In: a scene; out: frames, cut joints, inertias,
//! forces, all flat and constant, and how frames move. Uses `scene`, `contact`, `expression`,
//! `numerics`.

mod couplings;
pub mod elements;
pub mod forces;
pub mod friction;
pub mod kinematics;
mod lists;
pub mod loads;
mod meshes;
pub mod motions;
mod slots;
mod span;
