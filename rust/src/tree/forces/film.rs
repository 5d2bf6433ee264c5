//! The oil film of a clearance joint, whose journal is the second end.

use super::{Exerted, Law, Motion, Work};
use crate::contact::film::{FilmForce, FilmLaw};
use crate::numerics::dual::Scalar;

impl Law for FilmLaw {
    #[inline]
    fn exerted<S: Scalar>(&self, motion: &Motion<S>, _: [Option<S>; 2]) -> Exerted<S> {
        let [bearing, journal] = motion.turning;
        let FilmForce { force, torques: [on_journal, on_bearing] } =
            self.evaluate(motion.apart, motion.rate, [journal, bearing]);
        Exerted { force, moments: [-on_bearing, on_journal] }
    }

    fn work<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Work<S> {
        let zero = S::constant(0.0);
        Work { stored: zero, lost: -self.exerted(motion, loads).power(motion), input: zero }
    }

    fn damps(&self) -> bool {
        true
    }

    fn outputs(&self) -> &'static [&'static str] {
        &["eccentricity_ratio", "film_force_x", "film_force_y", "film_torque", "film_thickness", "film_loss"]
    }

    fn output(&self, motion: &Motion<f64>, loads: [Option<f64>; 2], place: usize) -> f64 {
        let Exerted { force: [x, y], moments: [_, on_journal] } = self.exerted(motion, loads);
        let eccentricity = motion.distance();
        match place {
            0 => eccentricity / self.clearance,
            4 => self.clearance - eccentricity,
            5 => self.work(motion, loads).lost,
            _ => [x, y, on_journal][place - 1],
        }
    }
}
