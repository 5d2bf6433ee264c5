//! Tests of the core physics by room: closed forms, identities, independent references.

mod numerics {
    mod extremum;
    mod logarithm;
    mod rotation;
}

mod expression {
    mod language;
    mod tables;
}

mod contact {
    mod film;
    mod forces;
}

mod scene {
    pub(crate) mod bad_elements;
    pub(crate) mod properties;
    pub(crate) mod scenes;
    mod time_functions;
}

mod dynamics {
    pub(crate) mod cartesian;
    pub(crate) mod constraints;
    mod couplings;
    mod elements;
    mod expressions;
    mod films;
    pub(crate) mod guides;
    pub(crate) mod joint_friction;
    pub(crate) mod loops;
    mod massless;
    mod mechanics;
    pub(crate) mod random_trees;
    mod sticking;
}

mod mechanism {
    mod assembly;
    mod effective_mass;
    mod nearest;
}

mod integrators {
    mod events;
    mod full_system;
    mod multistep;
    mod orders;
    pub(crate) mod problems;
    pub(crate) mod rattle;
    pub(crate) mod rodas6p;
    mod stages;
    mod step_control;
    mod stiffness;
    mod tableaus;
}

mod run {
    mod allocations;
    mod contact_events;
    mod energy;
    mod impact_floor;
    mod oracles;
    mod restart;
    pub(crate) mod scaling;
    mod tables;
}

mod study {
    mod bands;
    mod bands_by_angle;
    mod chebyshev;
    pub(crate) mod polynomials;
    mod ranges;
    mod sparse_ranges;
    mod tables;
}

mod gates;
mod support;
