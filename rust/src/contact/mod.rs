//! Contact of journal and bearing: geometry, normal-force laws, friction laws, with exact
//! derivatives. In: relative motion of the two surfaces; out: forces. Uses `numerics`.

pub mod friction;
pub mod normal;
pub mod pair;
pub mod sticking;
