//! Tests of the core physics: closed forms, identities, independent references.

mod assembly;
mod bad_elements;
mod chebyshev;
mod constrained;
mod contact;
mod contact_events;
mod elements;
mod energy;
mod events;
mod integrators;
mod loops;
mod mechanics;
mod oracles;
mod problems;
mod random_trees;
mod reference;
mod restart;
mod rodas6p;
mod scaling;
mod scenes;
mod step_control;
mod support;
mod tableaus;
mod time_functions;
