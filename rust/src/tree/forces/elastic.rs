//! A spring and a damper in all directions: between points that may coincide a bushing, between frames a torsion spring.

use super::{Exerted, Law, Motion, Work};
use crate::numerics::dual::Scalar;

/// A spring and a damper in all directions; loads are a stiffness and a damping in the place of both numbers, which are zero
/// then.
///
/// The forces of a bushing act on both bodies at the second point, and its damper sees the velocity of that point against
/// the first body: it makes no moment of its own, and turns with the bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Stiffness [N/m or N m/rad].
    pub stiffness: f64,
    /// Damping [N s/m or N m s/rad].
    pub damping: f64,
}

/// Velocity of the second end against the first body.
#[inline]
fn against<S: Scalar>(Motion { apart: e, rate, turning, .. }: &Motion<S>) -> [S; 2] {
    [rate[0] + turning[0] * e[1], rate[1] - turning[0] * e[0]]
}

impl Law for Elastic {
    #[inline]
    fn exerted<S: Scalar>(&self, motion: &Motion<S>, [stiffness, damping]: [Option<S>; 2]) -> Exerted<S> {
        let (e, against) = (motion.apart, against(motion));
        let stiffness = stiffness.unwrap_or(S::constant(self.stiffness));
        let damping = damping.unwrap_or(S::constant(self.damping));
        let force = [0, 1].map(|k| -(e[k] * stiffness + against[k] * damping));
        Exerted { force, moments: [e[0] * force[1] - e[1] * force[0], S::constant(0.0)] }
    }

    /// A stiffness by a formula stores nothing: what it does is input.
    fn work<S: Scalar>(&self, motion: &Motion<S>, [stiffness, damping]: [Option<S>; 2]) -> Work<S> {
        let (e, rate, against) = (motion.apart, motion.rate, against(motion));
        let damping = damping.unwrap_or(S::constant(self.damping));
        Work {
            stored: (e[0] * e[0] + e[1] * e[1]) * (0.5 * self.stiffness),
            lost: (against[0] * against[0] + against[1] * against[1]) * damping,
            input: stiffness.map_or(S::constant(0.0), |by| -(by * (e[0] * rate[0] + e[1] * rate[1]))),
        }
    }

    fn damps(&self) -> bool {
        self.damping != 0.0
    }

    fn outputs(&self) -> &'static [&'static str] {
        &["deflection", "force_x", "force_y"]
    }

    fn output(&self, motion: &Motion<f64>, loads: [Option<f64>; 2], place: usize) -> f64 {
        let [x, y] = self.exerted(motion, loads).force;
        [motion.distance(), x, y][place]
    }
}
