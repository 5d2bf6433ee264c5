//! Oil films in clearance joints: generalized forces, their exact derivatives, and their loss.

use super::Dynamics;
use crate::contact::film::FilmForce;
use crate::numerics::dual::Dual;
use crate::tree::forces::Film;
use crate::tree::kinematics::{PointState, Vec2};

impl Dynamics<'_> {
    /// Centers of bearing and journal, and the angular velocities of journal and bearing [rad/s].
    fn film_motion(&self, film: &Film) -> ([PointState; 2], [f64; 2]) {
        let ends = film.points.map(|point| self.point(point));
        let [bearing, journal] = film.points.map(|point| self.states[point.frame].angular_velocity);
        (ends, [journal, bearing])
    }

    /// Force on the journal [N] with the torques on journal and bearing [N m].
    pub fn film_force(&self, film: &Film) -> FilmForce<f64> {
        let ([a, b], spins) = self.film_motion(film);
        film.law.evaluate((b.position - a.position).into(), (b.velocity - a.velocity).into(), spins)
    }

    /// Distance of the centers [m].
    pub fn film_eccentricity(&self, film: &Film) -> f64 {
        let [a, b] = film.points.map(|point| self.point(point).position);
        (b - a).norm()
    }

    /// Power that the film dissipates [W].
    pub fn film_loss(&self, film: &Film) -> f64 {
        let ([a, b], [journal, bearing]) = self.film_motion(film);
        let FilmForce { force, torques } = self.film_force(film);
        -Vec2::from(force).dot(&(b.velocity - a.velocity)) - torques[0] * journal - torques[1] * bearing
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
            let ([a, b], [journal, bearing]) = self.film_motion(film);
            let (e, rate) = (b.position - a.position, b.velocity - a.velocity);
            let FilmForce { force, torques: [on_journal, on_bearing] } = film.law.evaluate::<Dual<7>>(
                [Dual::input(e.x, 0), Dual::input(e.y, 1)],
                [Dual::input(rate.x, 2), Dual::input(rate.y, 3)],
                // A pair has the angular velocity of its first body with a minus.
                [Dual::input(journal, 4), -Dual::input(-bearing, 5)],
            );
            self.add_pair_derivatives(
                film.points,
                [[0.0, 1.0], [1.0, 0.0]],
                force,
                [on_journal, -on_bearing],
            );
        }
    }
}
