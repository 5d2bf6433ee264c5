//! The user's description: bodies, joints, forces, drives, functions of time and of the motion. In: JSON; out: a checked
//! [`parts::Scene`] or every problem at once, with its path. Uses `numerics`, `expression` and the laws of `contact`.

mod check;
mod check_laws;
pub mod components;
pub mod couplings;
mod functions;
pub(crate) mod json;
pub mod loads;
pub mod parts;
pub(crate) mod plausibility;
pub mod quantities;
pub mod reader;
pub mod time_function;
