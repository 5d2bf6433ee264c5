//! chebclear: dynamics of planar mechanisms with joint clearance and interval parameters.
//!
//! Data flow in one direction:
//!
//! ```text
//! scene -> tree -> dynamics -> mechanism -> integrators -> run -> study
//! ```
//!
//! SI units and radians everywhere. Notation in the kernels: q, v, a generalized position,
//! velocity, acceleration; e eccentricity, δ penetration, n normal, t tangent, χ hysteresis
//! factor, φ constraint, γ its acceleration right-hand side; keys in brackets such as
//! `[Xiang2020]` are resolved in REFERENCES.md.

pub mod contact;
pub mod dynamics;
pub mod error;
pub mod integrators;
pub mod mechanism;
pub mod numerics;
pub mod run;
pub mod scene;
pub mod study;
pub mod tree;

#[cfg(feature = "python")]
mod python;
