//! Two surfaces that may touch, a journal in a bearing or a corner at a face: geometry, normal-force laws, friction laws,
//! oil films, worn bearings, with exact derivatives. In: relative motion of the two surfaces; out: forces. Uses `numerics`
//! and `expression`.

pub mod face;
pub mod film;
pub mod formula;
pub mod friction;
pub mod normal;
pub mod pair;
pub mod sticking;
pub mod worn;
