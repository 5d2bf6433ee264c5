//! Normal-force laws of dry contact: penetration and penetration rate in, force out.
//!
//! All laws offered have the form of Hunt and Crossley, Eq. (7) and (10) of `[Xiang2020]`:
//!
//! ```text
//! F_N = K δⁿ (1 + χ δ̇)      for δ > 0,     F_N = 0 otherwise
//! ```
//!
//! and differ in the hysteresis factor χ, which is fixed at the onset of a contact.

use crate::numerics::dual::Scalar;

/// Where the hysteresis factor χ [s/m] of a contact comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    /// χ = 0: the elastic contact of Hertz.
    Elastic,
    /// χ = 3 (1 - c²) / (4 v₀) with the restitution c and the impact velocity v₀,
    /// `[LankaraniNikravesh1990]`, Eq. (10) of `[Xiang2020]`.
    ///
    /// `restitution` is nominal: the rebound ratio r this law really gives solves
    /// `χv₀ - ln(1 + χv₀) = -χv₁ - ln(1 - χv₁)`, v₁ = r v₀. It is 0.913 for 0.9, 0.725 for
    /// 0.5 and never falls below about 0.66.
    LankaraniNikravesh {
        /// Nominal coefficient of restitution c [-], in (0, 1].
        restitution: f64,
    },
    /// χ = 8 (1 - c) / (5 c v₀), `[Flores2011]`: made for the whole range of c. Its rebound ratio
    /// solves the same equation; it is 0.894 for 0.9, 0.470 for 0.5 and 0.069 for 0.1.
    Flores {
        /// Coefficient of restitution c [-], in (0, 1].
        restitution: f64,
    },
    /// A fixed χ, `[HuntCrossley1975]`: the rebound ratio falls with the impact velocity.
    HuntCrossley {
        /// Hysteresis factor χ [s/m].
        hysteresis_factor: f64,
    },
}

/// A normal-force law with its constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalLaw {
    /// Contact stiffness K [N/m^exponent].
    pub stiffness: f64,
    /// Exponent n of the penetration [-]; 1.5 for Hertzian contact.
    pub exponent: f64,
    /// The hysteresis damping.
    pub damping: Damping,
}

impl NormalLaw {
    /// Hysteresis factor χ [s/m] of a contact that began with `impact_velocity` [m/s] > 0.
    pub fn hysteresis_factor(&self, impact_velocity: f64) -> f64 {
        match self.damping {
            Damping::Elastic => 0.0,
            Damping::LankaraniNikravesh { restitution } => {
                0.75 * (1.0 - restitution * restitution) / impact_velocity
            }
            Damping::Flores { restitution } => 1.6 * (1.0 - restitution) / (restitution * impact_velocity),
            Damping::HuntCrossley { hysteresis_factor } => hysteresis_factor,
        }
    }

    /// Whether the hysteresis factor is latched from the impact velocity, and needs a floor of it.
    pub fn is_latched(&self) -> bool {
        match self.damping {
            Damping::Elastic | Damping::HuntCrossley { .. } => false,
            Damping::LankaraniNikravesh { .. } | Damping::Flores { .. } => true,
        }
    }

    /// Penetration [m] at which the elastic force alone carries a load [N]: (F/K)^(1/n).
    pub fn resting_penetration(&self, load: f64) -> f64 {
        coarse((load / self.stiffness).powf(1.0 / self.exponent))
    }

    /// Angular frequency [rad/s] of small oscillations of a mass [kg] about that penetration.
    pub fn contact_frequency(&self, load: f64, mass: f64) -> f64 {
        let slope = self.exponent * self.stiffness * self.resting_penetration(load).powf(self.exponent - 1.0);
        coarse((slope / mass).sqrt())
    }

    /// Impact velocity [m/s] at which the latched law is critically damped for a load [N]
    /// on an effective mass [kg]: it damps a contact that a run starts at rest in.
    ///
    /// ```text
    /// damping ratio  ζ = χ F / (2 m ω_c),   ω_c² = n K δ_eq^(n-1) / m,   δ_eq = (F/K)^(1/n)
    /// ```
    ///
    /// Below it a contact creeps to where it carries its load. For the paper's joint at 307 N it is
    /// 2.65 mm/s, of the order of the velocity at which friction starts to slide.
    /// Zero for a law that latches nothing.
    pub fn resting_velocity(&self, load: f64, mass: f64) -> f64 {
        if !self.is_latched() {
            return 0.0;
        }
        let frequency = self.contact_frequency(load, mass);
        // χ = hysteresis_factor(1) / v for every law whose damping is latched; ζ = 1 solved for v.
        coarse(self.hysteresis_factor(1.0) * load / (2.0 * mass * frequency))
    }

    /// Time scale [s] of an impact of a mass [kg] at a velocity [m/s]: (m / (K v^(n-1)))^(1/(n+1)).
    pub fn impact_time(&self, mass: f64, impact_velocity: f64) -> f64 {
        let power = self.stiffness * impact_velocity.powf(self.exponent - 1.0);
        coarse((mass / power).powf(1.0 / (self.exponent + 1.0)))
    }

    /// Normal force [N] at a penetration δ [m] and penetration rate δ̇ [m/s], both of a contact
    /// with the hysteresis factor χ [s/m].
    ///
    /// Not clipped where the damping pulls (δ̇ < -1/χ): the clip is an event of the
    /// integrator, which wants the smooth continuation up to the instant it locates.
    #[inline]
    pub fn normal_force<S: Scalar>(&self, penetration: S, penetration_rate: S, hysteresis_factor: f64) -> S {
        if penetration.value() <= 0.0 {
            return S::constant(0.0);
        }
        // The exponent of Hertz is the common one, and a square root costs a tenth of a power.
        let power = if self.exponent == 1.5 {
            penetration * penetration.sqrt()
        } else {
            penetration.powf(self.exponent)
        };
        power * self.stiffness * (penetration_rate * hysteresis_factor + 1.0)
    }
}

/// `value` rounded to 32 bits. A power with a fractional exponent is not the same to the last bits in
/// units that are a power of two apart; rounded, it is, and so are the results.
fn coarse(value: f64) -> f64 {
    f64::from_bits(value.to_bits().wrapping_add(1 << 19) & !0xF_FFFF)
}
