//! The user's description: bodies, joints, forces, drives, functions of time. In: JSON; out: a checked
//! [`parts::Scene`] or every problem at once, with its path. Uses `numerics` and the laws of `contact`.

mod check;
pub(crate) mod json;
pub mod parts;
mod plausibility;
pub mod reader;
pub mod time_function;
