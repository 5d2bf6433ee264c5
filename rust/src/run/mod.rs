//! One run: a mechanism through time. In: a mechanism and settings; out: a [`trajectory::Trajectory`] of
//! samples, events and contacts. Uses `integrators`, `dynamics`, `mechanism` and the rooms below them.

mod branch;
pub mod contacts;
pub mod features;
mod motion;
pub mod outputs;
mod path;
mod prescribed;
pub mod restart;
mod samples;
pub mod settings;
mod system;
pub mod tolerances;
mod tracking;
pub mod trajectory;
mod warnings;
pub mod work;
