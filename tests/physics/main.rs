//! Tests of the core physics: closed forms, identities, independent references.

mod chebyshev;
mod contact;
mod integrators;
mod mechanics;
mod oracles;
mod problems;
mod random_trees;
mod reference;
mod rodas6p;
mod scaling;
mod support;
mod tableaus;
