//! A force at a point or a torque on a frame, whose components are loads.

use super::{Exerted, Law, Motion, Work};
use crate::numerics::dual::Scalar;

/// An applied force or torque; the reaction acts on the first end, for a force on ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied {
    /// Cosine and sine of the angle between the axes of the components and those of the second frame, if the force rotates
    /// with that.
    pub body_axes: Option<[f64; 2]>,
}

/// A vector turned by the angle with the given cosine and sine.
#[inline]
fn turned<S: Scalar>([x, y]: [S; 2], [cosine, sine]: [S; 2]) -> [S; 2] {
    [cosine * x - sine * y, sine * x + cosine * y]
}

impl Law for Applied {
    #[inline]
    fn exerted<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Exerted<S> {
        let zero = S::constant(0.0);
        let components = loads.map(|load| load.unwrap_or(zero));
        let force = match self.body_axes {
            Some(axes) => turned(turned(components, axes.map(S::constant)), motion.axes),
            None => components,
        };
        Exerted { force, moments: [zero; 2] }
    }

    fn work<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Work<S> {
        let zero = S::constant(0.0);
        Work { stored: zero, lost: zero, input: self.exerted(motion, loads).power(motion) }
    }

    fn damps(&self) -> bool {
        false
    }
}
