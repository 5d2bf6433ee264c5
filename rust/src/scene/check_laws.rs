//! Checks of loads and functions of time, of the laws of contact and friction, of guides with play, slots with pins and
//! stops, and of how these start.

use crate::contact::film::{FINITE_WIDTHS, Lubricant};
use crate::contact::formula::{FORCES, Formula, SPEEDS};
use crate::contact::friction::FrictionLaw;
use crate::contact::normal::{Damping, NormalLaw};
use crate::contact::pair::SlidingVelocity;
use crate::contact::sticking::StickSlip;
use crate::error::refused;
use crate::expression::dimension::Dimension;
use crate::numerics::accuracy::EQUAL;
use crate::scene::check::Checker;
use crate::scene::components::Components;
use crate::scene::functions::BUSHING;
use crate::scene::loads::{Expression, Load};
use crate::scene::parts::{GuideShape, Joint, Scene};

/// Penetrations at which a formula is looked at, as parts of the size of the mechanism.
/// Half and twice change two of 58 messages.
const DEPTHS: [f64; 4] = [1e-9, 1e-7, 1e-5, 1e-3];
/// What is wrong with a normal force in a mechanism of a size [m]: it is looked at for four penetrations, as far as it has
/// numbers there, and two impact velocities, in compression and in restitution.
fn fault_of_force(formula: &Formula, size: f64) -> Option<String> {
    let depths = DEPTHS.map(|depth| depth * size);
    let first = formula.at(&[0.0, 0.0, 1.0]);
    // What is no number is no measure.
    let largest = depths.map(|depth| formula.at(&[depth, 0.0, 1.0]).abs()).into_iter().fold(0.0, f64::max);
    if !(first == 0.0 || first.abs() <= EQUAL * largest && largest.is_finite()) {
        return Some(format!("must be 0 without penetration and penetration_rate, is {first:e} N"));
    }
    for (index, penetration) in depths.into_iter().enumerate() {
        for impact_velocity in [1e-2, 1.0] {
            let elastic = formula.at(&[penetration, 0.0, impact_velocity]);
            let place = format!("at penetration = {penetration:.3e}, impact_velocity = {impact_velocity}");
            if !(elastic > 0.0 && elastic.is_finite()) {
                // A law may end somewhere, but not where every contact begins.
                let message =
                    format!("must be > 0 N and finite without penetration_rate, is {elastic:e} N {place}");
                return (index == 0).then_some(message);
            }
            for rate in [1.0, 0.1, -0.1, -1.0].map(|part| part * impact_velocity) {
                let damping = formula.at(&[penetration, rate, impact_velocity]) - elastic;
                if !(damping * rate >= -EQUAL * elastic * rate.abs() && damping.is_finite()) {
                    return Some(format!(
                        "must not grow where the surfaces separate, nor fall where they approach, since a contact makes no \
                         energy: penetration_rate = {rate} changes it by {damping:.3e} N {place}"
                    ));
                }
            }
        }
    }
    None
}

/// What is wrong with a friction coefficient.
fn fault_of_friction(formula: &Formula) -> Option<String> {
    for normal_force in FORCES {
        for sliding_velocity in SPEEDS.into_iter().flat_map(|speed| [speed, -speed]) {
            let coefficient = formula.at(&[sliding_velocity, normal_force]);
            if !(coefficient * sliding_velocity >= 0.0 && coefficient.is_finite()) {
                return Some(format!(
                    "must be finite and have the sign of sliding_velocity, as \"0.1*tanh(sliding_velocity/0.01)\" has: is \
                     {coefficient} at sliding_velocity = {sliding_velocity}, normal_force = {normal_force}"
                ));
            }
        }
    }
    None
}

/// Fewest sectors of a worn bearing: each spans an eighth of a turn at most.
const LEAST_SECTORS: usize = 8;

impl Checker<'_> {
    /// Checks a law of a contact of two bodies.
    pub(super) fn normal_law(&mut self, law: &NormalLaw, scene: &Scene, bodies: [Option<usize>; 2]) {
        let size = || {
            let components = Components::of_scene(scene);
            let length = components.of(bodies).map_or(0.0, |component| components.lengths[component]);
            // Only messages depend on it.
            if length > 0.0 { length } else { 1.0 }
        };
        if let Some(message) = law.formula().and_then(|formula| fault_of_force(formula, size())) {
            self.add("force", message);
        }
    }

    /// Checks the worn profile of a bearing, and that its laws are those of its pressures.
    pub(super) fn profile(&mut self, joint: &Joint) {
        let Joint::Clearance { profile, contact, friction, sliding, film, .. } = joint else { return };
        if profile.is_empty() {
            return;
        }
        if profile.len() < LEAST_SECTORS {
            let got = profile.len();
            self.add("profile", format!("must have at least {LEAST_SECTORS} sectors, got {got}"));
        }
        let exponent = contact.exponent == 1.5;
        let damped = matches!(
            contact.damping,
            Damping::KelvinVoigt { .. } | Damping::Impact { .. } | Damping::Formula { .. }
        );
        let sticks = matches!(friction, Some(FrictionLaw::StickSlip(_)));
        let formula = matches!(friction, Some(FrictionLaw::Formula(_)));
        let problems = [
            (!exponent, "contact.exponent", "must be 1.5: the pressures begin as this law does"),
            (damped, "contact", "must be a law whose damping is in proportion to the elastic force"),
            (sticks, "friction", "must not be stick_slip: no contact with a profile sticks"),
            (formula, "friction", "must have constant coefficients"),
            (*sliding != SlidingVelocity::Surface, "sliding", "must be \"surface\""),
            (film.is_some(), "film", "must not be given: oil films are those of round bearings"),
        ];
        for (is_wrong, field, problem) in problems {
            if is_wrong {
                self.add(field, format!("{problem}, in a bearing with a profile"));
            }
        }
    }

    /// Checks a force or torque of the given dimension.
    pub(super) fn load(&mut self, scene: &Scene, field: &str, dimension: Dimension, load: &Load) {
        if let Load::Motion(expression) = load {
            self.expression(scene, field, dimension, expression);
        }
    }

    /// Checks the formulas in the place of the numbers of a bushing.
    pub(super) fn formulas(&mut self, scene: &Scene, formulas: &[Option<Box<Expression>>; 4]) {
        for ((field, dimension), formula) in BUSHING.into_iter().zip(formulas) {
            if let Some(formula) = formula {
                self.expression(scene, field, dimension, formula);
            }
        }
    }

    pub(super) fn lubricant(&mut self, lubricant: &Lubricant, journal_radius: f64) {
        let Lubricant { length, has_finite_width, .. } = *lubricant;
        let [narrow, wide] = FINITE_WIDTHS;
        let diameter = 2.0 * journal_radius;
        let ratio = length / diameter;
        if ratio > wide {
            let message = format!(
                "must be at most the diameter, {diameter} [m]: the film is that of a short bearing, got {length}"
            );
            self.add("length", message);
        } else if has_finite_width && ratio > 0.0 && ratio < narrow {
            let message = format!(
                "must be at least {narrow} of the diameter, {} [m], for a finite bearing, got {length}: a short bearing \
                 holds below",
                2.0 * narrow * journal_radius
            );
            self.add("length", message);
        }
    }

    pub(super) fn friction(&mut self, law: &FrictionLaw) {
        match *law {
            FrictionLaw::StickSlip(StickSlip { static_coefficient, sliding_coefficient, .. })
                if sliding_coefficient > static_coefficient =>
            {
                let message = format!(
                    "must be <= static_coefficient = {} [-], got {}: friction that grows with the sliding velocity does \
                     not stick",
                    refused(static_coefficient, sliding_coefficient),
                    refused(sliding_coefficient, static_coefficient)
                );
                self.add("sliding_coefficient", message);
            }
            FrictionLaw::ModifiedCoulomb { stick_slip_velocity, static_sliding_velocity, .. }
                if static_sliding_velocity <= stick_slip_velocity =>
            {
                let message = format!(
                    "must be > stick_slip_velocity = {} [m/s], got {}",
                    refused(stick_slip_velocity, static_sliding_velocity),
                    refused(static_sliding_velocity, stick_slip_velocity)
                );
                self.add("static_sliding_velocity", message);
            }
            FrictionLaw::Formula(ref law) => {
                if let Some(message) = fault_of_friction(&law.formula) {
                    self.add("coefficient", message);
                }
            }
            _ => {}
        }
    }

    pub(super) fn guide(&mut self, joint: &Joint, scene: &Scene, bodies: [Option<usize>; 2]) {
        let Joint::Guide { shape, face_length, contact, friction, .. } = joint else { return };
        if let GuideShape::Block { length, height, clearance, is_sleeve: false, .. } = *shape {
            // Half the diagonal fits between the faces then.
            let most = 0.5 * (length.hypot(height) - height);
            if clearance >= most {
                let message = format!(
                    "must be < {most:e} [m]: with more, a block of this length and height can turn over between the \
                     faces; got {clearance:e}"
                );
                self.add("clearance", message);
            }
        }
        if face_length.is_some() {
            self.round_edge(shape, friction.as_ref());
        }
        self.inside("contact").normal_law(contact, scene, bodies);
        if let Some(law) = friction {
            self.inside("friction").friction(law);
        }
    }

    /// Checks what passes the ends of faces as a round edge.
    fn round_edge(&mut self, shape: &GuideShape, friction: Option<&FrictionLaw>) {
        if let GuideShape::Block { .. } = shape {
            return;
        }
        if let GuideShape::Stop { radius: 0.0 } = shape {
            self.add(
                "radius",
                "must be > 0 [m] at a face with ends: a sharp corner has no direction of contact there",
            );
        }
        if let Some(FrictionLaw::StickSlip(_)) = friction {
            self.add(
                "friction",
                "must not stick at a face with ends: what sticks does not roll around them; smoothed_coulomb and \
                 modified_coulomb may",
            );
        }
    }
}

/// Whether a joint is a guide that can start so.
pub(super) fn start_of_guide(joint: &Joint, tilt: &[f64; 2]) -> Result<(), String> {
    match joint {
        Joint::Guide { shape: GuideShape::Pin { .. }, .. } if *tilt != [0.0, 0.0] => {
            Err(format!("the pin of {:?} has no tilt: it may turn", joint.name()))
        }
        Joint::Guide { shape: GuideShape::Block { .. } | GuideShape::Pin { .. }, .. } => Ok(()),
        _ => Err(format!("joint {:?} must be a guide with play or a pin in a slot", joint.name())),
    }
}
