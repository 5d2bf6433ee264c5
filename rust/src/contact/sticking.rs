//! Friction that sticks: a tangential spring that holds up to Coulomb's limit, and slides beyond it.
//!
//! Spring and slider act in series, as in the element of Jenkins. Between two surfaces in the plane the slip distance u is
//! a function of their position, so that the place u₀ of the slider is all that a contact must remember:
//!
//! ```text
//! stick:  F_t = -k (u - u₀) - d u̇      while k |u - u₀| < μ_s F_N
//! slip:   F_t = -s μ(|u̇|) F_N          while the slider, at u₀ = u + F_t / k, moves along s
//! ```
//!
//! At Coulomb's limit the damping vanishes: the force is the same in both phases, what ends one of them lets the other go
//! on, and a load that grows slowly is held exactly up to the limit. In slip the slider loses -F_t u̇₀, which is positive,
//! and the spring stores the rest of the power of friction.

use serde::{Deserialize, Serialize};

use crate::numerics::dual::Scalar;

/// Ratio of the tangential to the normal stiffness of a contact, 2 (1 - ν) / (2 - ν) of `[Mindlin1949]`, for Poisson's
/// ratio ν = 0.3.
const MINDLIN: f64 = 2.0 * (1.0 - 0.3) / (2.0 - 0.3);

/// A friction law with sticking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StickSlip {
    /// Static friction coefficient μ_s [-].
    pub static_coefficient: f64,
    /// Sliding friction coefficient μ_d [-], at most the static one.
    pub sliding_coefficient: f64,
    /// Stribeck velocity V [m/s] of the fall between them, μ = μ_d + (μ_s - μ_d) exp(-(v/V)²); zero for a jump.
    pub stribeck_velocity: f64,
    /// Tangential stiffness k [N/m]; `None` for that of Mindlin.
    pub tangential_stiffness: Option<f64>,
    /// Damping ratio of the oscillation of a contact that sticks at its reference load [-].
    pub damping_ratio: f64,
}

impl StickSlip {
    /// Friction coefficient [-] at a sliding velocity [m/s].
    pub fn coefficient<S: Scalar>(&self, sliding_velocity: S) -> S {
        if self.stribeck_velocity == 0.0 {
            return S::constant(self.sliding_coefficient);
        }
        let part = sliding_velocity * (1.0 / self.stribeck_velocity);
        let exponent = -(part * part);
        let fall = exponent.compose([exponent.value().exp(); 4]);
        fall * (self.static_coefficient - self.sliding_coefficient) + self.sliding_coefficient
    }

    /// Damping [N s/m] of a contact that sticks, under a normal force and with a force of its spring [N].
    pub fn damping<S: Scalar>(&self, traction: &Traction, normal_force: S, spring_force: S) -> S {
        let limit = normal_force * self.static_coefficient;
        if limit.value() <= spring_force.value().abs() {
            return S::constant(0.0);
        }
        let part = spring_force / limit;
        normal_force / (normal_force + traction.load) * (-(part * part) + 1.0) * traction.damping
    }

    /// Tangential stiffness [N/m] of a contact with a normal stiffness dF_N/dδ [N/m].
    pub fn stiffness(&self, normal_stiffness: f64) -> f64 {
        self.tangential_stiffness.unwrap_or(MINDLIN * normal_stiffness)
    }
}

/// The tangential spring of a contact.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// Stiffness k [N/m], fixed at the onset of the contact.
    pub stiffness: f64,
    /// Largest damping while the contact sticks [N s/m], likewise.
    pub damping: f64,
    /// Normal force at which half of it acts [N], likewise: without a normal force nothing is transmitted.
    pub load: f64,
    /// Direction s in which the surfaces slide, ±1; 0 while they stick.
    pub direction: f64,
    /// Slip distance u₀ at which the spring is unloaded [m], while they stick.
    pub anchor: f64,
    /// Distance of the centers in a bearing where the contact began to stick [m]; zero at a face.
    pub arm: f64,
    /// Full turns of the frames of the two bodies from which the slip distance counts.
    pub turns: [f64; 2],
}

impl Traction {
    /// Whether the contact sticks.
    pub fn sticks(&self) -> bool {
        self.direction == 0.0
    }
}
