//! chebclear: dynamics of planar mechanisms with joint clearance and interval parameters.
//!
//! Data flow in one direction:
//!
//! ```text
//! scene -> mechanism -> trajectory -> sweep -> surrogate -> bounds, sensitivities
//! ```
//!
//! SI units and radians everywhere. Notation in the kernels: q, v, a generalised position,
//! velocity, acceleration; e eccentricity, δ penetration, n normal, t tangent, χ hysteresis
//! factor, φ constraint, γ its acceleration right-hand side; keys in brackets such as
//! `[Xiang2020]` are resolved in REFERENCES.md.

pub mod assembly;
pub mod bounds;
pub mod chebyshev;
pub mod clearance;
pub mod constraints;
pub mod contact;
pub mod contacts;
pub mod dual;
pub mod dynamics;
pub mod error;
pub mod friction;
pub mod instant;
pub mod integrators;
mod json;
mod kinematic_run;
pub mod kinematics;
pub mod linear;
pub mod mechanism;
pub mod outputs;
mod recorder;
pub mod restart;
mod run_warnings;
mod scales;
pub mod scene;
mod scene_check;
pub mod scene_reader;
pub mod settings;
pub mod sweep;
pub mod time_function;
mod tolerances;
pub mod trajectory;
mod tree;
pub mod turns;
pub mod work;

#[cfg(feature = "python")]
mod python;
