//! Tests of the core physics: closed forms, identities, independent references.

mod assembly;
mod chebyshev;
mod constrained;
mod contact;
mod contact_events;
mod events;
mod gates;
mod integrators;
mod loops;
mod mechanics;
mod oracles;
mod problems;
mod random_trees;
mod rattle;
mod reference;
mod rodas6p;
mod scaling;
mod scenes;
mod step_control;
mod stiffness;
mod support;
mod tableaus;
