//! Tests of the core physics: closed forms, identities, independent references.

mod reference;
mod support;
