//! Tests of the core physics: closed forms, identities, independent references.

mod integrators;
mod mechanics;
mod problems;
mod random_trees;
mod reference;
mod rodas6p;
mod support;
mod tableaus;
