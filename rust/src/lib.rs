//! chebclear: dynamics of planar mechanisms with joint clearance and interval parameters.
//!
//! Data flow in one direction:
//!
//! ```text
//! scene -> tree -> dynamics -> mechanism -> integrators -> run -> study
//! ```
//!
//! SI units and radians everywhere. Notation in the kernels: z joint coordinates; q, v, a positions,
//! velocities and accelerations of the free ones; e eccentricity, δ penetration, n normal, t tangent, χ
//! hysteresis factor, λ Lagrange multipliers. A column is one joint coordinate, counted in the order of the
//! frames of the tree. Keys in brackets such as `[Xiang2020]` are resolved in REFERENCES.md.

pub mod contact;
pub mod dynamics;
pub mod error;
pub mod expression;
pub mod integrators;
pub mod mechanism;
pub mod numerics;
pub mod run;
pub mod scene;
pub mod study;
pub mod tree;

#[cfg(feature = "python")]
mod python;
