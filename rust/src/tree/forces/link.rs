//! A spring and a damper between two points, along the line through them.

use super::{Exerted, Law, Motion, Work};
use crate::numerics::dual::Scalar;

/// A spring and a damper between two points; a load is a further tension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Unloaded length [m].
    pub length: f64,
    /// Damping [N s/m].
    pub damping: f64,
    /// Distance of its ends up to which rounding errors of their positions decide its direction [m]; zero if
    /// its force needs no direction.
    pub indistinct: f64,
}

impl Link {
    /// Length [m] and its rate [m/s], zero where the direction is lost.
    #[inline]
    fn stretch<S: Scalar>(&self, Motion { apart: e, rate, .. }: &Motion<S>) -> [S; 2] {
        let length = (e[0] * e[0] + e[1] * e[1]).sqrt();
        let is_lost = length.value() <= self.indistinct;
        let rate = if is_lost { S::constant(0.0) } else { (rate[0] * e[0] + rate[1] * e[1]) / length };
        [length, rate]
    }

    /// Tension [N] at a length [m] that grows at a rate [m/s].
    #[inline]
    fn tension<S: Scalar>(&self, length: S, rate: S, further: Option<S>) -> S {
        let own = (length - self.length) * self.stiffness + rate * self.damping;
        further.map_or(own, |further| own + further)
    }
}

impl Law for Link {
    /// Where only rounding errors keep the points apart, a spring with a natural length or a further tension has no
    /// direction: it is NaN. A damper has none there either, and does not act.
    #[inline]
    fn exerted<S: Scalar>(&self, motion: &Motion<S>, [further, _]: [Option<S>; 2]) -> Exerted<S> {
        let Motion { apart: e, rate, .. } = *motion;
        let needs_direction = self.length != 0.0 || further.is_some();
        let along = |force| Exerted { force, moments: [S::constant(0.0); 2] };
        let isotropic = || along(e.map(|component| component * -self.stiffness));
        if !needs_direction && self.damping == 0.0 {
            return isotropic();
        }
        let length = (e[0] * e[0] + e[1] * e[1]).sqrt();
        if length.value() <= self.indistinct {
            return if needs_direction { along([S::constant(f64::NAN); 2]) } else { isotropic() };
        }
        let inverse = S::constant(1.0) / length;
        let normal = e.map(|component| component * inverse);
        let lengthening = rate[0] * normal[0] + rate[1] * normal[1];
        let tension = self.tension(length, lengthening, further);
        along(normal.map(|component| -(component * tension)))
    }

    fn work<S: Scalar>(&self, motion: &Motion<S>, [further, _]: [Option<S>; 2]) -> Work<S> {
        let [length, rate] = self.stretch(motion);
        let longer = length - self.length;
        Work {
            stored: longer * longer * (0.5 * self.stiffness),
            lost: rate * rate * self.damping,
            input: further.map_or(S::constant(0.0), |further| -(further * rate)),
        }
    }

    fn damps(&self) -> bool {
        self.damping != 0.0
    }

    fn outputs(&self) -> &'static [&'static str] {
        &["length", "lengthening", "force"]
    }

    fn output(&self, motion: &Motion<f64>, [further, _]: [Option<f64>; 2], place: usize) -> f64 {
        let [length, rate] = self.stretch(motion);
        [length, rate, self.tension(length, rate, further)][place]
    }
}
