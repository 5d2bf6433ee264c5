//! Geometry and force of a revolute joint with clearance, section 2 of `[Xiang2020]`.
//!
//! The journal (radius R_J) turns inside the bearing (radius R_B = R_J + c). The eccentricity
//! **e** points from the bearing's center to the journal's, Eq. (1); the normal **n** = **e**/|**e**|
//! and the tangent **t** (n turned by +90°) are Eq. (4).

use crate::contact::friction::FrictionLaw;
use crate::contact::normal::{Latch, NormalLaw};
use crate::numerics::dual::{Dual, Scalar};

/// Square of the eccentricity [m²] below which the joint is concentric. Every rounding error is far above 1e-70 m, and
/// the square of its inverse is a number.
const CONCENTRIC: f64 = 1e-140;

/// Convention of the sliding velocity of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlidingVelocity {
    /// The two material surfaces: v_T = ė·t + ω_J R_J - ω_B R_B.
    Surface,
    /// The geometric contact points, as printed in Eq. (5) and (6): v_T = ė·t (1 - c/|e|).
    ///
    /// It omits the rotation of the bodies and contains the factor δ/|e|, so that friction nearly
    /// vanishes. It exists to reproduce published results.
    ContactPoint,
}

/// Dimensions and laws of one clearance joint: the force depends on these and the relative motion alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearanceLaw {
    /// Radial clearance c [m].
    pub clearance: f64,
    /// Journal radius R_J [m].
    pub journal_radius: f64,
    /// Bearing radius R_B [m].
    pub bearing_radius: f64,
    /// Normal force.
    pub normal: NormalLaw,
    /// Friction, if the joint has any.
    pub friction: Option<FrictionLaw>,
    /// Convention of the sliding velocity.
    pub sliding: SlidingVelocity,
}

/// Whether the journal touches the bearing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// No contact: the force is zero, whatever the penetration.
    Free,
    /// In contact.
    Contact {
        /// Constants of the damping that were fixed at the onset.
        latch: Latch,
        /// Whether the force is clipped to zero: the damping would make it tensile, which a dry joint cannot
        /// transmit.
        clipped: bool,
    },
}

/// Relative motion of journal and bearing on which the contact force depends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeMotion<S> {
    /// Eccentricity vector e [m].
    pub eccentricity: [S; 2],
    /// Its rate ė [m/s].
    pub rate: [S; 2],
    /// Rolling velocity of the surfaces ω_J R_J - ω_B R_B [m/s].
    pub spin: S,
}

/// Penetration, velocities and forces of a contact, for the journal relative to the bearing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState<S> {
    /// Penetration δ = |e| - c [m], Eq. (2); negative in free flight.
    pub penetration: S,
    /// Penetration rate δ̇ = ė·n [m/s].
    pub penetration_rate: S,
    /// Sliding velocity v_T [m/s].
    pub sliding_velocity: S,
    /// Normal force F_N [N], positive in compression.
    pub normal_force: S,
    /// Component of the force on the journal along t [N].
    pub friction_force: S,
    /// Force on the journal in the world frame [N].
    pub force: [S; 2],
}

/// Position and velocity of the surfaces relative to each other, with the directions of the forces.
struct Geometry<S> {
    /// 1/|e|.
    inverse: S,
    normal: [S; 2],
    penetration: S,
    penetration_rate: S,
    /// ė·t.
    tangential_velocity: S,
}

impl ClearanceLaw {
    /// The geometry of the joint; `None` where the normal is undefined, as in a concentric start.
    #[inline(always)]
    fn geometry<S: Scalar>(&self, motion: &RelativeMotion<S>) -> Option<Geometry<S>> {
        let [ex, ey] = motion.eccentricity;
        let [vx, vy] = motion.rate;
        let square = ex * ex + ey * ey;
        if square.value() < CONCENTRIC {
            return None;
        }
        let eccentricity = square.sqrt();
        // Root and quotient do not wait for each other.
        let inverse = eccentricity * (S::constant(1.0) / square);
        let (nx, ny) = (ex * inverse, ey * inverse);
        Some(Geometry {
            inverse,
            normal: [nx, ny],
            penetration: eccentricity - self.clearance,
            penetration_rate: vx * nx + vy * ny,
            tangential_velocity: vy * nx - vx * ny,
        })
    }

    /// Sliding velocity of the two material surfaces [m/s], whichever convention the friction law uses.
    pub fn surface_velocity(&self, motion: &RelativeMotion<f64>) -> f64 {
        self.geometry(motion).map_or(0.0, |geometry| geometry.tangential_velocity + motion.spin)
    }

    /// Penetration, velocities and forces of the joint.
    ///
    /// Where the normal is undefined, forces and rates are zero.
    #[inline(always)]
    pub fn evaluate<S: Scalar>(&self, motion: &RelativeMotion<S>, phase: Phase) -> ContactState<S> {
        let zero = S::constant(0.0);
        let Some(geometry) = self.geometry(motion) else {
            return ContactState {
                penetration: S::constant(-self.clearance),
                penetration_rate: zero,
                sliding_velocity: zero,
                normal_force: zero,
                friction_force: zero,
                force: [zero, zero],
            };
        };
        let Geometry { inverse, normal: [nx, ny], penetration, penetration_rate, tangential_velocity } =
            geometry;
        let sliding_velocity = match self.sliding {
            SlidingVelocity::Surface => tangential_velocity + motion.spin,
            SlidingVelocity::ContactPoint => tangential_velocity * penetration * inverse,
        };
        let normal_force = match phase {
            Phase::Contact { latch, clipped: false } => {
                self.normal.normal_force(penetration, penetration_rate, latch)
            }
            _ => zero,
        };
        let friction_force = match self.friction {
            Some(law) => -(law.signed_coefficient(sliding_velocity) * normal_force),
            None => zero,
        };
        // On the journal: the normal force pushes it back inside, friction acts along t = (-ny, nx).
        let force = [-(normal_force * nx) - friction_force * ny, friction_force * nx - normal_force * ny];
        ContactState { penetration, penetration_rate, sliding_velocity, normal_force, friction_force, force }
    }

    /// Penetration and velocities alone: the state of the joint without its forces.
    #[inline]
    pub fn without_forces(&self, motion: &RelativeMotion<f64>) -> ContactState<f64> {
        ClearanceLaw { friction: None, ..*self }.evaluate(motion, Phase::Free)
    }

    /// Force on the journal and friction, with their derivatives with respect to
    /// (e_x, e_y, ė_x, ė_y, spin): `[force_x, force_y, friction_force]`.
    pub fn force_gradient(&self, motion: &RelativeMotion<f64>, phase: Phase) -> [Dual<5>; 3] {
        let dual = RelativeMotion {
            eccentricity: [Dual::input(motion.eccentricity[0], 0), Dual::input(motion.eccentricity[1], 1)],
            rate: [Dual::input(motion.rate[0], 2), Dual::input(motion.rate[1], 3)],
            spin: Dual::input(motion.spin, 4),
        };
        let state = self.evaluate(&dual, phase);
        [state.force[0], state.force[1], state.friction_force]
    }

    /// The state without friction, and the rate of the normal force [N/s] for a relative acceleration [m/s²].
    #[inline(always)]
    pub fn state_with_rate(
        &self,
        motion: &RelativeMotion<f64>,
        acceleration: [f64; 2],
        phase: Phase,
    ) -> (ContactState<f64>, f64) {
        let along =
            |value: [f64; 2], rate: [f64; 2]| [0, 1].map(|k| Dual { value: value[k], gradient: [rate[k]] });
        let dual = RelativeMotion {
            eccentricity: along(motion.eccentricity, motion.rate),
            rate: along(motion.rate, acceleration),
            spin: Dual::constant(motion.spin),
        };
        let state = ClearanceLaw { friction: None, ..*self }.evaluate::<Dual<1>>(&dual, phase);
        let values = ContactState {
            penetration: state.penetration.value,
            penetration_rate: state.penetration_rate.value,
            sliding_velocity: state.sliding_velocity.value,
            normal_force: state.normal_force.value,
            friction_force: 0.0,
            force: state.force.map(|force| force.value),
        };
        (values, state.normal_force.gradient[0])
    }

    /// Sliding speed [m/s] below which the friction force changes steeply with the relative velocity, `None`
    /// if it does nowhere.
    ///
    /// The printed sliding velocity is smaller than the relative velocity by the factor δ/|e|, about 0.01, so
    /// that friction is flatter by this factor.
    pub fn stick_velocity(&self) -> Option<f64> {
        match self.sliding {
            SlidingVelocity::Surface => self.friction.map(|law| law.stick_velocity()),
            SlidingVelocity::ContactPoint => None,
        }
    }

    /// Ratio of the relative tangential velocity to the sliding velocity in the friction law [-]; infinite
    /// without penetration.
    pub fn sliding_ratio(&self, state: &ContactState<f64>) -> f64 {
        match self.sliding {
            SlidingVelocity::Surface => 1.0,
            SlidingVelocity::ContactPoint => {
                (state.penetration + self.clearance) / state.penetration.max(0.0)
            }
        }
    }
}
