//! Oil films in clearance joints: generalized forces, their exact derivatives, and their loss.

use super::Dynamics;
use super::forces::inputs;
use crate::contact::film::FilmForce;
use crate::numerics::dual::Dual;
use crate::tree::forces::Film;
use crate::tree::kinematics::Vec2;

impl Dynamics<'_> {
    /// Angular velocities of journal and bearing [rad/s].
    fn film_spins(&self, film: &Film) -> [f64; 2] {
        let [bearing, journal] = film.points.map(|point| self.states[point.frame].angular_velocity);
        [journal, bearing]
    }

    /// Force on the journal [N] with the torques on journal and bearing [N m].
    pub fn film_force(&self, film: &Film) -> FilmForce<f64> {
        let [e, rate] = self.between(film.points);
        film.law.evaluate(e.into(), rate.into(), self.film_spins(film))
    }

    /// Distance of the centers [m].
    pub fn film_eccentricity(&self, film: &Film) -> f64 {
        self.between(film.points)[0].norm()
    }

    /// Power that the film dissipates [W].
    pub fn film_loss(&self, film: &Film) -> f64 {
        let ([_, rate], [journal, bearing]) = (self.between(film.points), self.film_spins(film));
        let FilmForce { force, torques } = self.film_force(film);
        -Vec2::from(force).dot(&rate) - torques[0] * journal - torques[1] * bearing
    }

    /// Adds the generalized forces of the films.
    #[inline]
    pub(super) fn add_films(&self, forces: &mut [f64]) {
        for film in &self.tree.films {
            let positions = film.points.map(|point| self.point(point).position);
            let FilmForce { force, torques: [on_journal, on_bearing] } = self.film_force(film);
            self.add_pair(film.points, positions, force.into(), [-on_bearing, on_journal], forces);
        }
    }

    /// Adds the derivatives of the same to those of the force residual.
    pub(super) fn add_film_derivatives(&mut self) {
        let tree = self.tree;
        for film in &tree.films {
            let ([e, rate], [journal, bearing]) = (inputs(self.between(film.points)), self.film_spins(film));
            // A pair has the angular velocity of its first body with a minus.
            let spins = [Dual::<7>::input(journal, 4), -Dual::input(-bearing, 5)];
            let FilmForce { force, torques: [on_journal, on_bearing] } = film.law.evaluate(e, rate, spins);
            self.add_pair_derivatives(
                film.points,
                [[0.0, 1.0], [1.0, 0.0]],
                force,
                [on_journal, -on_bearing],
            );
        }
    }
}
