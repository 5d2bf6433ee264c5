//! Normal-force laws of dry contact: penetration and penetration rate in, force out.
//!
//! All laws offered but those with a damper beside the spring have the form of Hunt and Crossley, Eq. (7) and (10) of
//! `[Xiang2020]`:
//!
//! ```text
//! F_N = K δⁿ (1 + χ δ̇)      for δ > 0,     F_N = 0 otherwise
//! ```
//!
//! and differ in the hysteresis factor χ. It is latched, that is computed at the onset of a contact and kept
//! until the separation. Only this file uses that form: others store a [`Latch`] and ask for forces, elastic
//! forces and the penetration rate that the damping requires to be resolved.

use crate::numerics::accuracy::SEARCH_STEPS;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::formula::Formula;
use crate::numerics::dual::Scalar;

/// Nominal restitution below which the rebound of the Lankarani-Nikravesh law exceeds it by more than 3 %:
/// 0.878 instead of 0.85, 0.725 instead of 0.5 (closed form in [`Damping::LankaraniNikravesh`]).
/// Only notices depend on it.
const ACCURATE_RESTITUTION: f64 = 0.85;

/// Restitution below which the damping of a law that keeps to it begins at more than twenty times the elastic force.
/// Half, twice: one notice less, 6 more in 88 runs.
const SOFT_RESTITUTION: f64 = 0.05;

/// Where the hysteresis factor χ [s/m] of a contact comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Damping {
    /// χ = 0: the elastic contact of Hertz.
    Elastic,
    /// χ = 3 (1 - c²) / (4 v₀) with the restitution c and the impact velocity v₀,
    /// `[LankaraniNikravesh1990]`, Eq. (10) of `[Xiang2020]`.
    ///
    /// `restitution` is nominal: the rebound velocity v₁ = r v₀ of this law follows from
    /// `χv₀ - ln(1 + χv₀) = -χv₁ - ln(1 - χv₁)`. The ratio r is 0.913 for 0.9, 0.725 for
    /// 0.5 and never below 0.66.
    LankaraniNikravesh {
        /// Nominal coefficient of restitution c [-], in (0, 1].
        restitution: f64,
    },
    /// χ = 8 (1 - c) / (5 c v₀), `[Flores2011]`, intended for the whole range of c. Its rebound ratio
    /// follows from the same equation; it is 0.894 for 0.9, 0.470 for 0.5 and 0.069 for 0.1.
    Flores {
        /// Coefficient of restitution c [-], in (0, 1].
        restitution: f64,
    },
    /// χ = d / v₀ where the rebound ratio that follows from the same equation is the restitution: d solves
    /// `(1 + d) / (1 - c d) = exp(d (1 + c))`. It holds for any exponent n, since the penetrations of compression
    /// and restitution are the same.
    ExactRestitution {
        /// Coefficient of restitution c [-], in (0, 1].
        restitution: f64,
        /// d [-], see [`Damping::exact_restitution`].
        onset_damping: f64,
    },
    /// A fixed χ, `[HuntCrossley1975]`: the rebound ratio falls with the impact velocity.
    HuntCrossley {
        /// Hysteresis factor χ [s/m].
        hysteresis_factor: f64,
    },
    /// A viscous damper beside the spring, F_N = K δⁿ + D δ̇: the force jumps where the contact begins.
    KelvinVoigt {
        /// Damping D [N s/m].
        damping: f64,
    },
    /// The contact function of commercial programs: a damper that grows to D over a depth d,
    /// F_N = K δⁿ + D s(δ/d) δ̇ with s(x) = x² (3 - 2x) up to x = 1.
    Impact {
        /// Damping D at full depth [N s/m].
        damping: f64,
        /// Penetration at which it is reached [m].
        depth: f64,
    },
    /// The whole force is a formula of penetration, penetration rate and impact velocity.
    Formula {
        /// The formula.
        formula: Arc<Formula>,
        /// Penetration at which it is compared with a power law [m], see [`NormalLaw::fit`].
        reference: f64,
    },
}

impl Damping {
    /// The damping whose rebound ratio is the restitution; for a restitution outside (0, 1], which checks refuse, it
    /// is NaN.
    pub fn exact_restitution(restitution: f64) -> Damping {
        Damping::ExactRestitution { restitution, onset_damping: exact_onset_damping(restitution) }
    }
}

/// The root d > 0 of `ln(1 + d) - ln(1 - c d) = d (1 + c)`; zero for c = 1.
fn exact_onset_damping(restitution: f64) -> f64 {
    let c = restitution;
    if !(c > 0.0 && c < 1.0) {
        return if c == 1.0 { 0.0 } else { f64::NAN };
    }
    // The equation over -d²: Σ (-1)^k (1 - (-c)^k) d^(k-2) / k from k = 2 on. Near c = 1, where d is small, the
    // logarithms cancel and few terms suffice.
    let first = 1.5 * (1.0 - c * c) / (1.0 + c * c * c);
    let balance = |d: f64| {
        if first < SMALL_DAMPING {
            let term = |k: i32| (1.0 - (-c).powi(k)) * (-d).powi(k - 2) / f64::from(k);
            (2..TERMS).map(term).sum()
        } else {
            d * (1.0 + c) - d.ln_1p() + (-c * d).ln_1p()
        }
    };
    // Positive below the root. Beyond 1/c there is no number.
    let (mut low, mut high) = (0.5 * first, 1.0 / c);
    for _ in 0..SEARCH_STEPS {
        let middle = 0.5 * (low + high);
        if balance(middle) > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Damping at an onset below which a series stands for the logarithms, and terms of it that reach rounding.
/// Half changes nothing, twice 6 of 150 runs.
const SMALL_DAMPING: f64 = 0.05;
/// Half and twice change nothing.
const TERMS: i32 = 16;
/// Constants of the damping of one contact, fixed at its onset.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Latch {
    /// Hysteresis factor χ [s/m].
    pub hysteresis_factor: f64,
    /// Impact velocity [m/s] of a formula; zero for other laws.
    pub impact_velocity: f64,
    /// Which form a formula of the normal force and one of friction have: it changes at their switches.
    pub forms: [u16; 2],
}

/// A normal-force law with its constants.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalLaw {
    /// Contact stiffness K [N/m^exponent]; that and the exponent of a formula are those of a power law, see
    /// [`NormalLaw::fit`].
    pub stiffness: f64,
    /// Exponent n of the penetration [-]; 1.5 for Hertzian contact.
    pub exponent: f64,
    /// The hysteresis damping.
    pub damping: Damping,
}

impl NormalLaw {
    /// The law of a formula.
    pub fn of(formula: Formula) -> Self {
        let damping = Damping::Formula { formula: Arc::new(formula), reference: f64::NAN };
        Self { stiffness: f64::NAN, exponent: f64::NAN, damping }
    }

    /// Gives a formula stiffness and exponent of the power law that has its force and slope at a penetration [m], without
    /// damping: scales and tolerances rest on these. Other laws stay as they are.
    pub fn fit(&mut self, penetration: f64) {
        let Damping::Formula { formula, reference } = &mut self.damping else { return };
        let [force, slope] = formula.elastic(penetration);
        let exponent = penetration * slope / force;
        *reference = penetration;
        self.exponent = if exponent > 0.0 && exponent.is_finite() { exponent } else { 1.0 };
        self.stiffness = force / penetration.powf(self.exponent);
    }

    /// The same at the penetration, up to a largest one [m], at which it carries a load [N].
    pub fn fit_to_load(&mut self, load: f64, largest: f64) {
        if let Damping::Formula { formula, .. } = &self.damping {
            let penetration = formula.penetration_under(load, largest);
            self.fit(penetration);
        }
    }

    /// The formula, if it is one.
    pub fn formula(&self) -> Option<&Formula> {
        match &self.damping {
            Damping::Formula { formula, .. } => Some(formula),
            _ => None,
        }
    }

    /// Constants of the damping of a contact that began with `impact_velocity` [m/s] > 0.
    pub fn latch(&self, impact_velocity: f64) -> Latch {
        let hysteresis_factor = match self.damping {
            Damping::Elastic => 0.0,
            Damping::LankaraniNikravesh { restitution } => {
                0.75 * (1.0 - restitution * restitution) / impact_velocity
            }
            Damping::Flores { restitution } => 1.6 * (1.0 - restitution) / (restitution * impact_velocity),
            Damping::ExactRestitution { onset_damping, .. } => onset_damping / impact_velocity,
            Damping::HuntCrossley { hysteresis_factor } => hysteresis_factor,
            Damping::KelvinVoigt { .. } | Damping::Impact { .. } => 0.0,
            Damping::Formula { ref formula, reference } => {
                let variables = [reference, 0.0, impact_velocity];
                let [force, slope] = formula.with_damping(variables, formula.forms(&variables));
                let hysteresis_factor = (slope / force).max(0.0);
                return Latch { hysteresis_factor, impact_velocity, ..Latch::default() };
            }
        };
        Latch { hysteresis_factor, ..Latch::default() }
    }

    /// Whether the damping depends on the impact velocity, for which a lower bound (floor) is then needed.
    pub fn is_latched(&self) -> bool {
        match self.damping {
            Damping::Elastic
            | Damping::HuntCrossley { .. }
            | Damping::KelvinVoigt { .. }
            | Damping::Impact { .. } => false,
            Damping::LankaraniNikravesh { .. }
            | Damping::Flores { .. }
            | Damping::ExactRestitution { .. } => true,
            Damping::Formula { ref formula, .. } => formula.depends[2],
        }
    }

    /// Ratio χ v₀ of damping to elastic force at the onset of a contact [-], the same for every impact
    /// velocity; zero for laws whose damping does not depend on it.
    pub fn onset_damping(&self) -> f64 {
        // χ is inversely proportional to the impact velocity.
        if self.is_latched() { self.latch(1.0).hysteresis_factor } else { 0.0 }
    }

    /// A warning about the constants, if there is one.
    pub fn out_of_range(&self) -> Option<String> {
        match self.damping {
            Damping::LankaraniNikravesh { restitution } if restitution < ACCURATE_RESTITUTION => {
                Some(format!(
                    "the Lankarani-Nikravesh law rebounds more than its restitution {restitution} says (below \
                 {ACCURATE_RESTITUTION} by more than 3 %): take the law \
                 ExactRestitution, whose rebound is what it says"
                ))
            }
            Damping::ExactRestitution { restitution, onset_damping } if restitution < SOFT_RESTITUTION => {
                Some(format!(
                    "a restitution of {restitution} takes a damping that begins at {onset_damping:.0} times the \
                     elastic force at any depth: the force of an impact is that of the damping, not of the stiffness"
                ))
            }
            _ => None,
        }
    }

    /// Penetration [m] at which the elastic force alone carries a load [N]: (F/K)^(1/n).
    pub fn resting_penetration(&self, load: f64) -> f64 {
        round_to_32_bits((load / self.stiffness).powf(1.0 / self.exponent))
    }

    /// Angular frequency [rad/s] of small oscillations of a mass [kg] about that penetration.
    pub fn contact_frequency(&self, load: f64, mass: f64) -> f64 {
        let slope = self.exponent * self.stiffness * self.resting_penetration(load).powf(self.exponent - 1.0);
        round_to_32_bits((slope / mass).sqrt())
    }

    /// Stiffness dF_N/dδ of the elastic force at a penetration [N/m].
    pub fn stiffness_at(&self, penetration: f64) -> f64 {
        if let Some(formula) = self.formula() {
            return round_to_32_bits(formula.elastic(penetration)[1]);
        }
        round_to_32_bits(self.exponent * self.stiffness * penetration.powf(self.exponent - 1.0))
    }

    /// Largest penetration [m] of an elastic impact of a mass [kg] at a velocity [m/s].
    pub fn impact_penetration(&self, mass: f64, impact_velocity: f64) -> f64 {
        let energy = 0.5 * mass * impact_velocity * impact_velocity;
        let order = self.exponent + 1.0;
        round_to_32_bits((order * energy / self.stiffness).powf(1.0 / order))
    }

    /// Impact velocity [m/s] for which the contact is critically damped under a load [N] on an effective mass
    /// [kg]. It sets the damping of a contact that is at rest at the start of a run.
    ///
    /// ```text
    /// damping ratio  ζ = χ F / (2 m ω_c),   ω_c² = n K δ_eq^(n-1) / m,   δ_eq = (F/K)^(1/n)
    /// ```
    ///
    /// With a lower impact velocity the contact approaches its equilibrium without oscillation. For the
    /// paper's joint at 307 N it is 2.65 mm/s, of the order of the stick-slip velocity. Zero for a law whose
    /// damping does not depend on the impact velocity.
    pub fn resting_velocity(&self, load: f64, mass: f64) -> f64 {
        if !self.is_latched() {
            return 0.0;
        }
        // ζ = 1 solved for v₀, with the product χ v₀ of the law.
        round_to_32_bits(self.onset_damping() * load / (2.0 * mass * self.contact_frequency(load, mass)))
    }

    /// Time scale [s] of an impact of a mass [kg] at a velocity [m/s]: (m / (K v^(n-1)))^(1/(n+1)).
    pub fn impact_time(&self, mass: f64, impact_velocity: f64) -> f64 {
        let power = self.stiffness * impact_velocity.powf(self.exponent - 1.0);
        round_to_32_bits((mass / power).powf(1.0 / (self.exponent + 1.0)))
    }

    /// Normal force [N] at a penetration δ [m] and penetration rate δ̇ [m/s].
    ///
    /// It is not clipped where it is tensile ([`NormalLaw::force_ratio`] < 0): the clipping is an event of
    /// the integrator, which needs the smooth continuation until it has located the event.
    #[inline(always)]
    pub fn normal_force<S: Scalar>(&self, penetration: S, penetration_rate: S, latch: Latch) -> S {
        match &self.damping {
            Damping::Formula { formula, .. } if penetration.value() > 0.0 => {
                let variables = [penetration, penetration_rate, S::constant(latch.impact_velocity)];
                formula.value(&variables, latch.forms[0])
            }
            Damping::Formula { .. } => S::constant(0.0),
            _ => self.built_in_force(penetration, penetration_rate, latch),
        }
    }

    /// The same of a law that is no formula.
    #[inline]
    pub(super) fn built_in_force<S: Scalar>(&self, penetration: S, penetration_rate: S, latch: Latch) -> S {
        if penetration.value() <= 0.0 {
            return S::constant(0.0);
        }
        let elastic = self.elastic(penetration);
        match self.viscosity(penetration) {
            Some(viscosity) => elastic + viscosity * penetration_rate,
            None => elastic * Self::ratio(penetration_rate, latch),
        }
    }

    /// Force per penetration rate [N s/m] of a damper beside the spring; `None` for hysteresis damping.
    #[inline]
    fn viscosity<S: Scalar>(&self, penetration: S) -> Option<S> {
        match self.damping {
            Damping::KelvinVoigt { damping } => Some(S::constant(damping)),
            Damping::Impact { damping, depth } => {
                let part = penetration * (1.0 / depth);
                let full = part.value() >= 1.0;
                Some(if full { S::constant(damping) } else { part * part * (part * -2.0 + 3.0) * damping })
            }
            _ => None,
        }
    }

    /// Ratio of normal to elastic force [-]; the force is tensile where it is negative. Exactly 1 without
    /// damping. With a damper beside the spring, which acts at zero penetration too, it is the ratio to the sum of
    /// both forces.
    pub fn force_ratio(&self, penetration: f64, penetration_rate: f64, latch: Latch) -> f64 {
        match self.viscosity(penetration) {
            Some(viscosity) => {
                let (elastic, viscous) = (self.elastic_force(penetration), viscosity * penetration_rate);
                (elastic + viscous) / (elastic + viscous.abs()).max(f64::MIN_POSITIVE)
            }
            None => Self::ratio(penetration_rate, latch),
        }
    }

    /// Derivative of that ratio with respect to the penetration rate [s/m], or its size.
    pub fn force_ratio_slope(&self, penetration: f64, penetration_rate: f64, latch: Latch) -> f64 {
        match self.viscosity(penetration) {
            Some(viscosity) => {
                let both = self.elastic_force(penetration) + (viscosity * penetration_rate).abs();
                viscosity / both.max(f64::MIN_POSITIVE)
            }
            None => latch.hysteresis_factor,
        }
    }

    /// The ratio and its slope of a formula, as of a damper beside the spring with the slope that it has here; `None` for
    /// other laws.
    #[inline]
    pub fn ratio_of_formula(&self, [penetration, rate]: [f64; 2], latch: Latch) -> Option<[f64; 2]> {
        let Damping::Formula { formula, reference } = &self.damping else { return None };
        if !formula.depends[1] {
            return Some([1.0, 0.0]);
        }
        // Where both forces vanish the ratio is that beside it.
        let penetration = penetration.max(f64::EPSILON * reference);
        let [force, slope] = formula.with_damping([penetration, rate, latch.impact_velocity], latch.forms[0]);
        let viscous = slope * rate;
        let both = ((force - viscous).abs() + viscous.abs()).max(f64::MIN_POSITIVE);
        Some([force / both, slope.abs() / both])
    }

    /// Derivative of the normal force by the penetration rate [N s/m] at a penetration [m] and force [N], about that of hysteresis damping where the rate is
    /// high; infinite for a formula that depends on the rate.
    #[inline]
    pub fn damping_in(&self, [penetration, normal_force]: [f64; 2], latch: Latch) -> f64 {
        match &self.damping {
            Damping::Formula { formula, .. } if formula.depends[1] => f64::INFINITY,
            _ => self.viscosity(penetration).unwrap_or(latch.hysteresis_factor * normal_force),
        }
    }

    /// Penetration rate [m/s] at which damping and elastic force are equal; infinite without damping.
    pub fn damping_rate(&self, latch: Latch) -> f64 {
        1.0 / latch.hysteresis_factor
    }

    /// 1 + χ δ̇.
    #[inline]
    pub(super) fn ratio<S: Scalar>(penetration_rate: S, latch: Latch) -> S {
        penetration_rate * latch.hysteresis_factor + 1.0
    }

    /// Normal force [N] without damping.
    pub fn elastic_force(&self, penetration: f64) -> f64 {
        if penetration <= 0.0 {
            return 0.0;
        }
        self.formula().map_or_else(|| self.elastic(penetration), |formula| formula.elastic_force(penetration))
    }

    /// Elastic energy K δ^(n+1) / (n+1) at a penetration [J], or the integral of the elastic part of a formula.
    pub fn elastic_energy(&self, penetration: f64) -> f64 {
        if let Some(formula) = self.formula() {
            return formula.elastic_energy(penetration);
        }
        self.elastic_force(penetration) * penetration / (self.exponent + 1.0)
    }

    /// K δⁿ for δ > 0.
    #[inline]
    fn elastic<S: Scalar>(&self, penetration: S) -> S {
        // Hertzian contact is the common case, and a square root costs a tenth of a general power.
        let power = if self.exponent == 1.5 {
            penetration * penetration.sqrt()
        } else {
            penetration.powf(self.exponent)
        };
        power * self.stiffness
    }
}

/// `value` rounded to 32 bits after the leading one. In units that differ by powers of two, a power with a
/// fractional exponent differs in its last bits; rounded it does not, so that results are the same in both
/// units to the last bit.
fn round_to_32_bits(value: f64) -> f64 {
    f64::from_bits(value.to_bits().wrapping_add(1 << 19) & !0xF_FFFF)
}
