//! Friction laws: sliding velocity in, friction coefficient out; for an ideal joint its reaction in, friction out.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::formula::{Formula, steepness};
use crate::contact::sticking::StickSlip;
use crate::numerics::dual::Scalar;
use crate::numerics::turns::Turns;

/// A law for the friction coefficient.
#[derive(Clone, Debug, PartialEq)]
pub enum FrictionLaw {
    /// Modified Coulomb friction, Eq. (11) of `[Xiang2020]`:
    ///
    /// ```text
    /// μ = μ_s sin(π |v| / (2 V_s))                                      |v| < V_s
    /// μ = (μ_s+μ_d)/2 + (μ_s-μ_d)/2 cos(π (|v| - V_s) / (V_d - V_s))    V_s ≤ |v| ≤ V_d
    /// μ = μ_d                                                           |v| > V_d
    /// ```
    ///
    /// The force is zero at zero velocity and grows with it: under a tangential load a contact
    /// creeps instead of sticking.
    ModifiedCoulomb {
        /// Static friction coefficient μ_s [-].
        static_coefficient: f64,
        /// Sliding friction coefficient μ_d [-].
        sliding_coefficient: f64,
        /// Stick-slip switch velocity V_s [m/s].
        stick_slip_velocity: f64,
        /// Static-sliding friction switch velocity V_d [m/s], above V_s.
        static_sliding_velocity: f64,
    },
    /// Smoothed Coulomb friction, μ tanh(v / V): smooth everywhere; a contact creeps as well.
    SmoothedCoulomb {
        /// Friction coefficient μ [-].
        coefficient: f64,
        /// Velocity V of the smoothing [m/s]: at 3 V the force is 99.5 % of Coulomb's.
        velocity: f64,
    },
    /// Coulomb friction with sticking: what a contact transmits depends on its traction, here are its coefficients.
    StickSlip(StickSlip),
    /// A formula of sliding velocity and normal force, which has the sign of the sliding velocity.
    Formula(Arc<FrictionFormula>),
}

/// A formula of friction, with the numbers that tolerances ask for.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionFormula {
    /// The formula.
    pub formula: Formula,
    /// Sliding speed below which it is steep [m/s]; zero if it is steep nowhere or jumps.
    pub velocity: f64,
    /// Its slope there [s/m].
    pub slope: f64,
}

impl FrictionLaw {
    /// The law of a formula.
    pub fn of(formula: Formula) -> Self {
        let [velocity, slope] = steepness(&formula);
        FrictionLaw::Formula(Arc::new(FrictionFormula { formula, velocity, slope }))
    }

    /// The formula, if it is one.
    pub fn formula(&self) -> Option<&Formula> {
        match self {
            FrictionLaw::Formula(law) => Some(&law.formula),
            _ => None,
        }
    }

    /// Friction coefficient with the sign of the sliding velocity [m/s]: μ(|v|) sign(v) [-], under a normal force [N].
    pub fn under<S: Scalar>(&self, sliding_velocity: S, normal_force: S, forms: u16) -> S {
        match self {
            FrictionLaw::Formula(law) if normal_force.value() != 0.0 => {
                // A force that would pull, before the place where it is clipped is located, goes on smoothly.
                let pressing = normal_force * normal_force.value().signum();
                law.formula.value(&[sliding_velocity, pressing], forms)
            }
            _ => self.signed_coefficient(sliding_velocity),
        }
    }

    /// The same of a law that does not depend on the normal force; zero for a formula.
    #[inline(always)]
    pub fn signed_coefficient<S: Scalar>(&self, sliding_velocity: S) -> S {
        let FrictionLaw::ModifiedCoulomb {
            static_coefficient,
            sliding_coefficient,
            stick_slip_velocity,
            static_sliding_velocity,
        } = *self
        else {
            return self.uncommon_coefficient(sliding_velocity);
        };
        let half_pi = std::f64::consts::FRAC_PI_2;
        let speed = sliding_velocity.value().abs();
        if speed < stick_slip_velocity {
            // Odd in v: no sign to restore, and no special case at v = 0.
            return (sliding_velocity * (half_pi / stick_slip_velocity)).sin() * static_coefficient;
        }
        if speed > static_sliding_velocity {
            return S::constant(sliding_coefficient.copysign(sliding_velocity.value()));
        }
        let sign = sliding_velocity.value().signum();
        let mean = 0.5 * (static_coefficient + sliding_coefficient);
        let amplitude = 0.5 * (static_coefficient - sliding_coefficient);
        let width = static_sliding_velocity - stick_slip_velocity;
        let phase = (sliding_velocity * sign - stick_slip_velocity) * (2.0 * half_pi / width);
        (phase.cos() * amplitude + mean) * sign
    }

    /// That of the other laws.
    // Not inlined, so that the evaluation of a contact stays small.
    #[inline(never)]
    fn uncommon_coefficient<S: Scalar>(&self, sliding_velocity: S) -> S {
        match *self {
            FrictionLaw::SmoothedCoulomb { coefficient, velocity } => {
                (sliding_velocity * (1.0 / velocity)).tanh() * coefficient
            }
            FrictionLaw::StickSlip(law) => {
                law.coefficient(sliding_velocity) * sliding_velocity.value().signum()
            }
            FrictionLaw::ModifiedCoulomb { .. } | FrictionLaw::Formula(_) => S::constant(0.0),
        }
    }

    /// Sliding speed [m/s] below which the law is steep, which an integrator must resolve; zero without one.
    pub fn stick_velocity(&self) -> f64 {
        match *self {
            FrictionLaw::ModifiedCoulomb { stick_slip_velocity, .. } => stick_slip_velocity,
            FrictionLaw::SmoothedCoulomb { velocity, .. } => velocity,
            FrictionLaw::StickSlip(law) => law.stribeck_velocity,
            FrictionLaw::Formula(ref law) => law.velocity,
        }
    }

    /// Largest rate [s/m] at which the coefficient rises with the sliding velocity, which is that at zero velocity.
    pub fn steepness(&self) -> f64 {
        match *self {
            FrictionLaw::ModifiedCoulomb { static_coefficient, stick_slip_velocity, .. } => {
                std::f64::consts::FRAC_PI_2 * static_coefficient / stick_slip_velocity
            }
            FrictionLaw::SmoothedCoulomb { coefficient, velocity } => coefficient / velocity,
            FrictionLaw::StickSlip(_) => 0.0,
            FrictionLaw::Formula(ref law) => law.slope,
        }
    }

    /// Sliding speed [m/s] from which on the coefficient is constant, or nearly so.
    pub fn steep_until(&self) -> f64 {
        match *self {
            FrictionLaw::ModifiedCoulomb { static_sliding_velocity, .. } => static_sliding_velocity,
            FrictionLaw::SmoothedCoulomb { velocity, .. } => 3.0 * velocity,
            FrictionLaw::Formula(ref law) => 3.0 * law.velocity,
            // exp(-3) is 5 %.
            FrictionLaw::StickSlip(law) => 3.0_f64.sqrt() * law.stribeck_velocity,
        }
    }
}

/// Whether an ideal joint with friction sticks or slides.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
pub enum JointPhase {
    /// It slides in a direction, ±1; 0 where drives prescribe its motion and stand still.
    Slides(f64),
    /// It sticks.
    Sticks {
        /// Where, [rad] or [m].
        position: f64,
        /// Full turns that were subtracted from the angle.
        turns: Turns,
    },
}

impl Default for JointPhase {
    fn default() -> Self {
        JointPhase::Slides(0.0)
    }
}

impl JointPhase {
    /// Whether the joint sticks.
    pub fn sticks(&self) -> bool {
        matches!(self, JointPhase::Sticks { .. })
    }

    /// The direction in which it slides; 0 where it sticks.
    pub fn direction(&self) -> f64 {
        match *self {
            JointPhase::Slides(direction) => direction,
            JointPhase::Sticks { .. } => 0.0,
        }
    }
}

/// Dry friction in an ideal joint, in proportion to its reaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointFriction {
    /// A torque μ' r |R| in a revolute joint. In a bearing of vanishing clearance |R| is the resultant of normal force and
    /// friction, so that μ' = μ / √(1 + μ²).
    Journal {
        /// Friction coefficient μ [-].
        coefficient: f64,
        /// Journal radius r [m].
        journal_radius: f64,
    },
    /// A force μ max(|N|, |P| / a) in a prismatic joint, with the force N across the guide and the moment P about the middle
    /// of the block: the sum of what its ends carry, N/2 ± P/(2a).
    Guide {
        /// Friction coefficient μ [-].
        coefficient: f64,
        /// Half the length a of the block [m].
        half_length: f64,
    },
}

impl JointFriction {
    /// Names of outputs: friction on the second body, power dissipated, whether the joint sticks, energy dissipated.
    pub fn outputs(&self) -> [&'static str; 4] {
        let friction = match self {
            JointFriction::Journal { .. } => "friction_torque",
            JointFriction::Guide { .. } => "friction_force",
        };
        [friction, "friction_power", "sticking", "friction_loss"]
    }

    /// The largest friction under a reaction [N m or N] and its derivatives. The reaction is a force in two components [N],
    /// or the force across a guide [N] and its moment [N m].
    ///
    /// It is a norm of the reaction: that of a change bounds the change of friction.
    pub fn limit(&self, [first, second]: [f64; 2]) -> (f64, [f64; 2]) {
        match *self {
            JointFriction::Journal { coefficient, journal_radius } => {
                let factor = coefficient / coefficient.hypot(1.0) * journal_radius;
                let size = first.hypot(second);
                // At the tip of the cone any slope up to the factor would do.
                let slope = if size > 0.0 { factor / size } else { 0.0 };
                (factor * size, [slope * first, slope * second])
            }
            JointFriction::Guide { coefficient, half_length } => {
                let (force, tilt) = (coefficient * first, coefficient / half_length * second);
                if force.abs() >= tilt.abs() {
                    (force.abs(), [coefficient * first.signum(), 0.0])
                } else {
                    (tilt.abs(), [0.0, coefficient / half_length * second.signum()])
                }
            }
        }
    }
}
