//! Geometry and force of a pair of surfaces that may touch: a journal in its bearing, section 2 of `[Xiang2020]`, or a
//! corner or pin against a straight face.
//!
//! The journal (radius R_J) turns inside the bearing (radius R_B = R_J + c). The eccentricity
//! **e** points from the bearing's center to the journal's, Eq. (1); the normal **n** = **e**/|**e**|
//! and the tangent **t** (n turned by +90°) are Eq. (4).

use std::f64::consts::TAU;

use crate::contact::face::Face;
use crate::contact::friction::FrictionLaw;
use crate::contact::normal::{Latch, NormalLaw};
use crate::contact::sticking::{StickSlip, Traction};
use crate::contact::worn::WornBearing;
use crate::numerics::dual::{Dual, Scalar};

/// Square of the eccentricity [m²] below which the joint is concentric. Every rounding error is far above 1e-70 m, and
/// the square of its inverse is a number. Half and twice change nothing.
pub(super) const CONCENTRIC: f64 = 1e-140;

/// Sectors of a bearing without a worn profile: one for every five degrees; half and twice are other outputs.
const SECTORS: usize = 72;

/// Convention of the sliding velocity of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlidingVelocity {
    /// The two material surfaces: v_T = ė·t + ω_J R_J - ω_B R_B.
    Surface,
    /// The geometric contact points, as printed in Eq. (5) and (6): v_T = ė·t (1 - c/|e|).
    ///
    /// It omits the rotation of the bodies and contains the factor δ/|e|, so that friction nearly
    /// vanishes. It exists to reproduce published results. Faces have none of it.
    ContactPoint,
}

/// The two surfaces of a contact.
#[derive(Clone, Debug, PartialEq)]
pub enum Surfaces {
    /// A journal inside a bearing.
    Bearing {
        /// Journal radius R_J [m].
        journal_radius: f64,
        /// Bearing radius R_B [m].
        bearing_radius: f64,
    },
    /// The same with a worn surface of the bearing.
    Worn(Box<WornBearing>),
    /// A round edge of the second body, or a corner of radius zero, against a straight face of the first.
    Face(Face),
}

/// Dimensions and laws of one contact: the force depends on these and the relative motion alone.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactLaw {
    /// The surfaces.
    pub surfaces: Surfaces,
    /// Clearance [m]: how far the second point can move from the middle of its play until the surfaces touch.
    pub clearance: f64,
    /// Normal force.
    pub normal: NormalLaw,
    /// Friction, if there is any.
    pub friction: Option<FrictionLaw>,
    /// Convention of the sliding velocity.
    pub sliding: SlidingVelocity,
}

/// Whether the surfaces touch.
#[derive(Clone, Copy, Debug, serde::Deserialize, PartialEq, serde::Serialize)]
pub enum Phase {
    /// No contact: the force is zero, whatever the penetration.
    Free,
    /// The same of a corner that is not over its face: the neighbor of its slot may touch instead.
    Beyond,
    /// In contact.
    Contact {
        /// Constants of the damping that were fixed at the onset.
        latch: Latch,
        /// Whether the force is clipped to zero: the damping would make it tensile, which a dry joint cannot
        /// transmit.
        clipped: bool,
        /// The tangential spring, where friction can stick.
        traction: Option<Traction>,
    },
}

impl Phase {
    /// Whether the surfaces are in contact.
    pub fn touches(&self) -> bool {
        matches!(self, Phase::Contact { .. })
    }
}

/// Relative motion on which the contact force depends: in a bearing in the axes of the world, at a face and in a worn
/// bearing that of the second point seen from the first body, in its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeMotion<S> {
    /// Vector e from the first point to the second [m].
    pub eccentricity: [S; 2],
    /// Its rate ė [m/s].
    pub rate: [S; 2],
    /// Rolling velocity of the surfaces [m/s]: ω_J R_J - ω_B R_B in a bearing, the radius of what touches times ω_b - ω_a
    /// where the motion is seen from the first body.
    pub spin: S,
    /// Its integral since a contact began to stick [m], for one that sticks; see [`ContactLaw::rolling`].
    pub roll: S,
}

/// Penetration, velocities and forces of a contact, for the second body relative to the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState<S> {
    /// Penetration [m], δ = |e| - c in a bearing, Eq. (2); negative in free flight.
    pub penetration: S,
    /// Penetration rate δ̇ = ė·n [m/s].
    pub penetration_rate: S,
    /// Sliding velocity v_T [m/s].
    pub sliding_velocity: S,
    /// Normal force F_N [N], positive in compression.
    pub normal_force: S,
    /// Component of the force on the second body along t [N].
    pub friction_force: S,
    /// Force on the second body in the axes of the relative motion [N].
    pub force: [S; 2],
}

/// Position and velocity of the surfaces relative to each other, with the directions of the forces.
pub(super) struct Geometry<S> {
    /// 1/|e|.
    pub(super) inverse: S,
    pub(super) normal: [S; 2],
    pub(super) penetration: S,
    pub(super) penetration_rate: S,
    /// ė·t.
    pub(super) tangential_velocity: S,
}

impl ContactLaw {
    /// The geometry in a bearing; `None` where the normal is undefined, as in a concentric start.
    #[inline(always)]
    pub(super) fn geometry<S: Scalar>(&self, motion: &RelativeMotion<S>) -> Option<Geometry<S>> {
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

    /// Acceleration of the penetration [m/s²] for a relative acceleration [m/s²]; called away from a concentric joint.
    pub fn penetration_acceleration(&self, motion: &RelativeMotion<f64>, [ax, ay]: [f64; 2]) -> f64 {
        let [ex, ey] = motion.eccentricity;
        let [vx, vy] = motion.rate;
        match &self.surfaces {
            Surfaces::Worn(worn) => {
                let [nx, ny] = worn.normal(motion.eccentricity);
                ax * nx + ay * ny
            }
            Surfaces::Face(face) => {
                let geometry = face.geometry(motion, Phase::Free);
                let [nx, ny] = geometry.normal;
                let along = ax * nx + ay * ny;
                if face.is_past_end(motion.eccentricity) {
                    along - geometry.tangential_velocity.powi(2) / (face.radius - geometry.penetration)
                } else {
                    along
                }
            }
            Surfaces::Bearing { .. } => {
                let distance = (ex * ex + ey * ey).sqrt();
                let tangential = (ex * vy - ey * vx) / distance;
                (ex * ax + ey * ay) / distance + tangential * tangential / distance
            }
        }
    }

    /// Radii of the surfaces [m]: of the first, then of the second.
    pub fn radii(&self) -> [f64; 2] {
        match &self.surfaces {
            Surfaces::Bearing { bearing_radius, journal_radius } => [*bearing_radius, *journal_radius],
            Surfaces::Worn(worn) => [worn.journal_radius; 2],
            Surfaces::Face(face) => [face.radius; 2],
        }
    }

    /// Sectors of a bearing into which its wear is divided; none at a face.
    pub fn sectors(&self) -> usize {
        match self.surfaces {
            Surfaces::Bearing { .. } => SECTORS,
            Surfaces::Worn(ref worn) => worn.sectors(),
            Surfaces::Face(_) => 0,
        }
    }

    /// Size of the surfaces [m], against which penetrations are small: the radius of the journal.
    pub fn size(&self) -> f64 {
        match self.surfaces {
            Surfaces::Bearing { journal_radius, .. } => journal_radius,
            Surfaces::Worn(ref worn) => worn.journal_radius,
            Surfaces::Face(face) => face.size,
        }
    }

    /// Sliding velocity of the two material surfaces [m/s], whichever convention the friction law uses.
    pub fn surface_velocity(&self, motion: &RelativeMotion<f64>) -> f64 {
        let geometry = match &self.surfaces {
            Surfaces::Bearing { .. } => self.geometry(motion),
            Surfaces::Worn(worn) => return self.in_worn_bearing(worn, motion, Phase::Free).sliding_velocity,
            Surfaces::Face(face) => Some(face.geometry(motion, Phase::Free)),
        };
        geometry.map_or(0.0, |geometry| geometry.tangential_velocity + motion.spin)
    }

    /// The friction law, if it can stick.
    #[inline(always)]
    pub fn stick_slip(&self) -> Option<&StickSlip> {
        match &self.friction {
            Some(FrictionLaw::StickSlip(law)) => Some(law),
            _ => None,
        }
    }

    /// Rolling velocity of a law that can stick, from the angular velocities of the two bodies, or the roll from their
    /// angles. Both forces act where the surface of the journal is, at a distance `arm` beyond its radius from the center
    /// of the bearing: they make no moment of their own.
    pub fn rolling<S: Scalar>(&self, arm: S, [first, second]: [S; 2]) -> S {
        match self.surfaces {
            Surfaces::Bearing { journal_radius, .. } => {
                second * journal_radius - first * (arm + journal_radius)
            }
            Surfaces::Worn(ref worn) => (second - first) * worn.journal_radius,
            Surfaces::Face(face) => (second - first) * face.radius,
        }
    }

    /// Slip distance u [m] of a contact that sticks, whose rate is the sliding velocity: in a bearing that of a given arm,
    /// turned by the angle of the eccentricity, and of the roll.
    pub fn slip_distance<S: Scalar>(&self, motion: &RelativeMotion<S>, arm: f64) -> S {
        let [ex, ey] = motion.eccentricity;
        match self.surfaces {
            Surfaces::Face(Face { normal: [nx, ny], .. }) => ey * nx - ex * ny + motion.roll,
            // No law that sticks has a worn bearing.
            Surfaces::Bearing { .. } | Surfaces::Worn(_) => {
                let (x, y) = (ex.value(), ey.value());
                let square = x * x + y * y;
                // The angle at the value, with the derivatives that it has there.
                let turned = ((ey - y) * x - (ex - x) * y) * (1.0 / square);
                (turned + y.atan2(x)) * arm + motion.roll
            }
        }
    }

    /// Penetration, velocities and forces of the contact.
    ///
    /// Where the normal is undefined, forces and rates are zero.
    #[inline(always)]
    pub fn evaluate<S: Scalar>(&self, motion: &RelativeMotion<S>, phase: Phase) -> ContactState<S> {
        match self.stick_slip() {
            Some(law) => self.with_stick_slip(law, motion, phase),
            None => self.without_sticking(motion, phase),
        }
    }

    /// The same for a law that does not stick.
    #[inline(always)]
    pub(crate) fn without_sticking<S: Scalar>(
        &self,
        motion: &RelativeMotion<S>,
        phase: Phase,
    ) -> ContactState<S> {
        match &self.surfaces {
            Surfaces::Bearing { .. } if self.has_formula() => self.in_bearing::<S, true, true>(motion, phase),
            Surfaces::Bearing { .. } => self.in_bearing::<S, true, false>(motion, phase),
            Surfaces::Worn(worn) => self.in_worn_bearing(worn, motion, phase),
            Surfaces::Face(face) => self.at_face(face, motion, phase),
        }
    }

    /// The same in a bearing, with or without friction that does not stick, and laws that are formulas.
    #[inline(always)]
    pub(crate) fn in_bearing<S: Scalar, const FRICTION: bool, const FORMULA: bool>(
        &self,
        motion: &RelativeMotion<S>,
        phase: Phase,
    ) -> ContactState<S> {
        let zero = S::constant(0.0);
        match self.geometry(motion) {
            Some(geometry) => self.forces::<S, FRICTION, FORMULA>(geometry, motion.spin, phase),
            None => ContactState {
                penetration: S::constant(-self.clearance),
                penetration_rate: zero,
                sliding_velocity: zero,
                normal_force: zero,
                friction_force: zero,
                force: [zero, zero],
            },
        }
    }

    /// The same at a face, with friction that does not stick.
    // Not inlined, so that what it needs is not kept ready where all contacts are bearings.
    #[inline(never)]
    pub(crate) fn at_face<S: Scalar>(
        &self,
        face: &Face,
        motion: &RelativeMotion<S>,
        phase: Phase,
    ) -> ContactState<S> {
        if self.has_formula() {
            return self.forces::<S, true, true>(face.geometry(motion, phase), motion.spin, phase);
        }
        self.forces::<S, true, false>(face.geometry(motion, phase), motion.spin, phase)
    }

    /// The same with friction that can stick. While it does, force and moments are those that do the work of the slip
    /// distance, so that what the spring stores comes back.
    #[inline(never)]
    fn with_stick_slip<S: Scalar>(
        &self,
        law: &StickSlip,
        motion: &RelativeMotion<S>,
        phase: Phase,
    ) -> ContactState<S> {
        let zero = S::constant(0.0);
        let geometry = match self.surfaces {
            Surfaces::Bearing { .. } | Surfaces::Worn(_) => self.geometry(motion),
            Surfaces::Face(face) => Some(face.geometry(motion, phase)),
        };
        let Some(geometry) = geometry else { return self.in_bearing::<S, false, false>(motion, phase) };
        let Geometry { inverse, normal: [nx, ny], penetration, penetration_rate, tangential_velocity } =
            geometry;
        let lever = match (&self.surfaces, phase) {
            (Surfaces::Bearing { .. }, Phase::Contact { traction: Some(traction), .. })
                if traction.sticks() =>
            {
                inverse * traction.arm
            }
            _ => S::constant(1.0),
        };
        let sliding_velocity = tangential_velocity * lever + motion.spin;
        let (mut normal_force, mut friction_force) = (zero, zero);
        if let Phase::Contact { latch, clipped: false, traction: Some(traction) } = phase {
            normal_force = self.normal.normal_force(penetration, penetration_rate, latch);
            friction_force = if traction.sticks() {
                let spring = self.spring_force(&traction, motion, zero);
                spring - law.damping(&traction, normal_force, spring) * sliding_velocity
            } else {
                -(law.coefficient(sliding_velocity) * normal_force * traction.direction)
            };
        }
        let along = friction_force * lever;
        let force = [-(normal_force * nx) - along * ny, along * nx - normal_force * ny];
        ContactState { penetration, penetration_rate, sliding_velocity, normal_force, friction_force, force }
    }

    /// Force of the tangential spring on the second body [N]; while the contact slides it is that of friction.
    pub fn spring_force<S: Scalar>(
        &self,
        traction: &Traction,
        motion: &RelativeMotion<S>,
        friction_force: S,
    ) -> S {
        if !traction.sticks() {
            return friction_force;
        }
        let elongation = self.slip_distance(motion, traction.arm) - traction.anchor;
        // A full turn of the eccentricity does not count: springs are stretched by far less than its way.
        let way = TAU * traction.arm;
        let turns = if way > 0.0 { (elongation.value() / way).round() } else { 0.0 };
        -((elongation - turns * way) * traction.stiffness)
    }

    #[inline(always)]
    pub(super) fn forces<S: Scalar, const FRICTION: bool, const FORMULA: bool>(
        &self,
        geometry: Geometry<S>,
        spin: S,
        phase: Phase,
    ) -> ContactState<S> {
        let zero = S::constant(0.0);
        let Geometry { inverse, normal: [nx, ny], penetration, penetration_rate, tangential_velocity } =
            geometry;
        let sliding_velocity = match self.sliding {
            SlidingVelocity::Surface => tangential_velocity + spin,
            SlidingVelocity::ContactPoint => tangential_velocity * penetration * inverse,
        };
        let (normal_force, forms) = match phase {
            Phase::Contact { latch, clipped: false, .. } if FORMULA => {
                (self.normal.normal_force(penetration, penetration_rate, latch), latch.forms[1])
            }
            Phase::Contact { latch, clipped: false, .. } => {
                (self.normal.built_in_force(penetration, penetration_rate, latch), 0)
            }
            _ => (zero, 0),
        };
        let friction_force = match &self.friction {
            Some(law) if FORMULA => -(law.under(sliding_velocity, normal_force, forms) * normal_force),
            Some(law) if FRICTION => -(law.signed_coefficient(sliding_velocity) * normal_force),
            _ => zero,
        };
        // On the second body: the normal force pushes it back, friction acts along t = (-ny, nx).
        let force = [-(normal_force * nx) - friction_force * ny, friction_force * nx - normal_force * ny];
        ContactState { penetration, penetration_rate, sliding_velocity, normal_force, friction_force, force }
    }

    /// Penetration and velocities in a bearing alone: the state of the contact without its forces.
    #[inline(always)]
    pub(crate) fn in_bearing_without_forces(&self, motion: &RelativeMotion<f64>) -> ContactState<f64> {
        self.in_bearing::<f64, false, false>(motion, Phase::Free)
    }

    /// Force on the second body and friction, by a law that does not stick, with their derivatives with respect to
    /// (e_x, e_y, ė_x, ė_y, spin): `[force_x, force_y, friction_force]`.
    pub fn force_gradient(&self, motion: &RelativeMotion<f64>, phase: Phase) -> [Dual<5>; 3] {
        let dual = RelativeMotion {
            eccentricity: [Dual::input(motion.eccentricity[0], 0), Dual::input(motion.eccentricity[1], 1)],
            rate: [Dual::input(motion.rate[0], 2), Dual::input(motion.rate[1], 3)],
            spin: Dual::input(motion.spin, 4),
            roll: Dual::constant(motion.roll),
        };
        let state = self.without_sticking(&dual, phase);
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
            roll: Dual::constant(motion.roll),
        };
        let state = match &self.surfaces {
            Surfaces::Bearing { .. } if self.has_formula() => self.in_bearing::<_, true, true>(&dual, phase),
            Surfaces::Bearing { .. } => self.in_bearing::<_, false, false>(&dual, phase),
            Surfaces::Worn(worn) => self.in_worn_bearing(worn, &dual, phase),
            Surfaces::Face(face) => self.at_face(face, &dual, phase),
        };
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
    /// if it does nowhere, as a law that can stick.
    ///
    /// The printed sliding velocity is smaller than the relative velocity by the factor δ/|e|, about 0.01, so
    /// that friction is flatter by this factor.
    pub fn stick_velocity(&self) -> Option<f64> {
        match (self.sliding, &self.friction) {
            (SlidingVelocity::ContactPoint, _) | (_, Some(FrictionLaw::StickSlip(_))) => None,
            (SlidingVelocity::Surface, law) => law.as_ref().map(|law| law.stick_velocity()),
        }
    }

    /// Whether the friction of a contact in its phase changes with the sliding velocity.
    pub fn is_steep(&self, phase: Phase) -> bool {
        match (&self.friction, phase) {
            (Some(FrictionLaw::StickSlip(law)), Phase::Contact { traction: Some(traction), .. }) => {
                !traction.sticks() && law.stribeck_velocity > 0.0
            }
            (Some(FrictionLaw::Formula(law)), _) => law.velocity > 0.0,
            (friction, _) => friction.is_some(),
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
