//! The oil film between a journal and its bearing: the short bearing of Ocvirk with a half film, section 2 of `[DuBois1953]`,
//! for any motion of both.
//!
//! With the journal's eccentricity **e** (from the bearing's center to the journal's), the mean angular velocity
//! Ω = (ω_J + ω_B)/2 and the velocity seen in axes that turn with it, **V** = ė - Ω z × **e**, Reynolds' equation of a bearing
//! that is short along its axis gives the pressure in closed form: it is positive where **V**·**n** > 0. Its resultant on the
//! journal is
//!
//! ```text
//! F = -C I(e, V) V,   C = η R L³ / c³,   I = ∫ n nᵀ / (1 - e·n/c)³ dα   over V·n > 0
//! ```
//!
//! `I` is symmetric and positive, so that the film never makes energy. Sommerfeld's substitution gives the integrals.

use std::f64::consts::{PI, TAU};

use crate::numerics::dual::Scalar;

/// Eccentricity ratio below which the integrals are replaced by their first two terms in it; the next are its square.
/// Half, twice: the same work (20 of 84 runs).
const NEARLY_CONCENTRIC: f64 = 1e-5;

/// Ratios of length to diameter for which the factor of a finite width was fitted, `[Butenschoen1976]`.
pub const FINITE_WIDTHS: [f64; 2] = [0.25, 1.0];

/// A lubricant and the width of the bearing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lubricant {
    /// Dynamic viscosity η [Pa s].
    pub viscosity: f64,
    /// Length of the bearing along its axis L [m].
    pub length: f64,
    /// Height of the roughness of both surfaces together [m]: where they touch, so much of the film remains.
    pub roughness: f64,
    /// Whether the pressure is that of a bearing of finite width instead of a short one.
    pub has_finite_width: bool,
}

/// The film of one bearing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmLaw {
    /// Radial clearance of the surfaces [m].
    pub clearance: f64,
    /// The same with the roughness [m].
    thickness: f64,
    /// C [N s/m].
    resistance: f64,
    /// Friction torque of a concentric journal over the difference of the angular velocities [N m s].
    drag: f64,
    /// Coefficients a1 and a2 of the factor of the finite width, if it has one.
    width: Option<[f64; 2]>,
}

/// Force and torques of a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmForce<S> {
    /// Force on the journal [N]; the opposite one acts on the bearing.
    pub force: [S; 2],
    /// Torque on the journal and on the bearing, each about its center [N m].
    pub torques: [S; 2],
}

impl FilmLaw {
    /// The film of a lubricant in a bearing.
    pub fn new(lubricant: &Lubricant, journal_radius: f64, clearance: f64) -> Self {
        let Lubricant { viscosity, length, roughness, has_finite_width } = *lubricant;
        let thickness = clearance + roughness;
        Self {
            clearance,
            thickness,
            resistance: viscosity * journal_radius * (length / thickness).powi(3),
            drag: TAU * viscosity * journal_radius.powi(3) * length / thickness,
            width: has_finite_width.then(|| width_coefficients(length / (2.0 * journal_radius))),
        }
    }

    /// Force and torques at an eccentricity [m], its rate [m/s] and the angular velocities of journal and bearing [rad/s].
    pub fn evaluate<S: Scalar>(&self, e: [S; 2], rate: [S; 2], [journal, bearing]: [S; 2]) -> FilmForce<S> {
        let turning = (journal + bearing) * 0.5;
        let velocity = [rate[0] + turning * e[1], rate[1] - turning * e[0]];
        let (force, root) = self.pressure_force(e, velocity);
        let shear = (journal - bearing) * self.drag / root;
        // The pressure acts on both surfaces, whose centers are apart: each takes half of the moment.
        let half = (e[0] * force[1] - e[1] * force[0]) * 0.5;
        FilmForce { force, torques: [-shear - half, shear - half] }
    }

    /// Resultant of the pressure on the journal, and √(1 - ε²).
    fn pressure_force<S: Scalar>(&self, e: [S; 2], velocity: [S; 2]) -> ([S; 2], S) {
        let square = e[0] * e[0] + e[1] * e[1];
        let speed_square = velocity[0] * velocity[0] + velocity[1] * velocity[1];
        let stands = speed_square.value() == 0.0;
        if square.value() < (NEARLY_CONCENTRIC * self.thickness).powi(2) {
            // The integrals to first order in e, in the axes of V.
            let factor = self.resistance * self.factor_at(square.value().sqrt() / self.thickness);
            let mean = velocity.map(|component| component * (0.5 * PI));
            if stands {
                return (mean.map(|component| -(component * factor)), S::constant(1.0));
            }
            let speed = speed_square.sqrt();
            let along = (e[0] * velocity[0] + e[1] * velocity[1]) / speed;
            let slope = 2.0 / self.thickness;
            let force = [0, 1].map(|k| mean[k] + (along * velocity[k] + speed * e[k]) * slope);
            return (force.map(|component| -(component * factor)), S::constant(1.0));
        }
        let distance = square.sqrt();
        let [nx, ny] = e.map(|component| component / distance);
        // Where the surfaces touch, the roughness keeps the film that is left.
        let ratio = if distance.value() < self.clearance {
            distance * (1.0 / self.thickness)
        } else {
            S::constant(self.clearance / self.thickness)
        };
        let radial = velocity[0] * nx + velocity[1] * ny;
        let tangential = velocity[1] * nx - velocity[0] * ny;
        let root = (S::constant(1.0) - ratio * ratio).sqrt();
        let direction = (!stands).then(|| {
            let speed = speed_square.sqrt();
            [radial / speed, tangential / speed]
        });
        let [along, mixed, across] = integrals(ratio, root, direction);
        let factor = self.factor_at(ratio) * -self.resistance;
        let on_radius = factor * (along * radial + mixed * tangential);
        let on_tangent = factor * (mixed * radial + across * tangential);
        ([on_radius * nx - on_tangent * ny, on_radius * ny + on_tangent * nx], root)
    }

    /// Factor of the finite width at an eccentricity ratio; 1 in a short bearing.
    fn factor_at<S: Scalar>(&self, ratio: S) -> S {
        match self.width {
            Some([a1, a2]) => (S::constant(1.0) - ratio) * a1 / (S::constant(-a2) - ratio),
            None => S::constant(1.0),
        }
    }
}

/// The components of I along the eccentricity, mixed, and across it, at an eccentricity ratio with its √(1 - ε²); for a
/// direction of **V** by its cosine and sine, or the mean of **V** and -**V** where it stands still.
fn integrals<S: Scalar>(ratio: S, root: S, direction: Option<[S; 2]>) -> [S; 3] {
    let square = ratio * ratio;
    let cube = root * root * root;
    let [of_angle, of_product, of_sine, of_square, of_cosine] = match direction {
        None => [S::constant(PI), S::constant(0.0), S::constant(0.0), S::constant(0.0), S::constant(0.0)],
        Some([cosine, sine]) => {
            // Ends of the film, a quarter turn before and behind V, as angles of Sommerfeld's substitution.
            let end = |cosine: S, sine: S| {
                let inverse = S::constant(1.0) / (S::constant(1.0) - ratio * cosine);
                [(cosine - ratio) * inverse, root * sine * inverse]
            };
            let ([c1, s1], [c2, s2]) = (end(sine, -cosine), end(-sine, cosine));
            let angle = s2.atan2(c2) - s1.atan2(c1);
            let turn = if angle.value() < 0.0 { TAU } else { 0.0 };
            [angle + turn, (s2 * c2 - s1 * c1) * 0.5, s2 - s1, (s2 * s2 - s1 * s1) * 0.5, c2 - c1]
        }
    };
    [
        ((square + 0.5) * of_angle + of_product + ratio * of_sine * 2.0) / (cube * root * root),
        (of_square - ratio * of_cosine) / (cube * root),
        (of_angle * 0.5 - of_product) / cube,
    ]
}

/// The coefficients of the factor a1 (1 - ε) / (-a2 - ε) by which the pressure of a bearing of finite width differs from that
/// of a short one, at a ratio of length to diameter; `[Butenschoen1976]`.
fn width_coefficients(ratio: f64) -> [f64; 2] {
    let polynomial = |coefficients: [f64; 5]| coefficients.iter().rev().fold(0.0, |sum, a| sum * ratio + a);
    [
        polynomial([1.1642, -1.9456, 7.1161, -10.1073, 5.0141]),
        polynomial([-1.000026, -0.023634, -0.4215, -0.038817, -0.090551]),
    ]
}
