//! How large the local errors of a run may be: what `rtol` means for a mechanism with clearance.

use crate::contact::clearance::{ContactState, Phase};
use crate::contact::normal::NormalLaw;
use crate::error::{InputError, Problem, Subject};
use crate::mechanism::compiled::Mechanism;
use crate::run::settings::{DEFAULT_RTOL, Settings};
use crate::tree::elements::{ContactScales, State};

/// Position tolerance of a scene with clearance: `rtol` times this part of the smallest
/// clearance. 0.5 is the scale on which the methods were compared (1e-5 m at 0.02 mm).
const CLEARANCE_PART: f64 = 0.5;
/// Largest tolerances as a part of the oscillation about a contact that rests under the load of the start: this over
/// the radians that it oscillates while the mechanism crosses its own size, within the bounds below. Wider, a resting
/// contact cannot be told from free flight: it chatters, and the more often the longer it rests. Tuned on the paper's
/// mechanism at 0.1 to 300 r/min, rtol 1e-2 and 1e-4, in both conventions with Rodas4, Rodas5P and auto: 60 makes as many
/// contact changes as the least part (97 instead of 93 at worst, but for the scatter of a single scene), 120 up to 8 %,
/// 360 up to 60 % more.
const RESTING_RADIANS: f64 = 60.0;
/// Bounds of that part. At 0.1 r/min 0.1 leaves 4807 contact changes in a revolution of the paper's mechanism, 0.01 407, 0.003 189, tight
/// tolerances 161; at 1000 to 3000 r/min 0.1 none too many, 0.3 up to twice as many. Where the lower bound held in all
/// mechanisms a run at 2000 r/min and rtol 1e-2 took twice the steps.
const RESTING_PARTS: [f64; 2] = [0.003, 0.1];
/// Velocity tolerance: `rtol` times this part of the speed of the mechanism. For the paper's
/// crank (10.5 m/s) it is the 1 m/s on which the methods were compared.
const SPEED_PART: f64 = 0.1;
/// Velocity tolerance in a contact with friction, as a part of its sliding velocity or, if that is more, of the velocity
/// at which the friction law is steep. Wider, a linearly implicit step hops across the kink: 15 times more steps at
/// rtol 1e-4 than at 1e-5 in a sticking contact. Over the ensembles of `benchmarks/stiffness.rs` 0.3 is as
/// good, and with 1 a loose tolerance costs more than a tight one.
const STICK_PART: f64 = 0.1;
/// Smallest velocity tolerance: what a contact that rests under the load of the start makes of this part of
/// the size of the mechanism, a rounding of its positions, in a step of its oscillation. Tighter, the error
/// estimate is rounding. Tuned on the paper's mechanism at 100 and 2000 r/min: up to 1.2 roundings two methods
/// differ as much as without a floor (3e-9 m/s), beyond by more; without it DOP853 took eight times the steps
/// at `rtol` 1e-13 and 100 r/min.
const FINEST_PART: f64 = f64::EPSILON;

/// Floor of the impact velocity of every clearance joint [m/s] in a run with the default settings.
pub fn default_impact_velocity_floors(mechanism: &Mechanism) -> Vec<f64> {
    // The duration counts only where nothing moves.
    let tolerances = Tolerances::new(mechanism, &mechanism.start, &Settings::new(1.0, 2));
    (0..mechanism.clearance_joints.len())
        .map(|joint| tolerances.impact_velocity_floor(mechanism, joint))
        .collect()
}

/// Absolute tolerances of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerances {
    /// Of the positions of points [m].
    pub(crate) position: f64,
    /// Of their velocities [m/s], but where contacts are damped or friction is steep.
    pub(crate) velocity: f64,
    /// Part of its sliding velocity, or of the stick velocity of its friction law, that a contact is resolved to.
    stick_part: f64,
    /// Smallest velocity tolerance [m/s].
    finest_velocity: f64,
}

/// Distance by which positions are told apart [m].
fn position_scale(mechanism: &Mechanism) -> f64 {
    let smallest = mechanism.clearance_joints.iter().map(|joint| joint.law.clearance).reduce(f64::min);
    smallest.map_or(mechanism.scales.length, |clearance| CLEARANCE_PART * clearance)
}

/// Speed of the mechanism from `start` [m/s].
fn speed(mechanism: &Mechanism, start: &State) -> f64 {
    let scales = &mechanism.scales;
    let start_speed = start.v.iter().zip(&scales.levers).map(|(v, lever)| (v * lever).abs());
    start_speed.fold(scales.speed, f64::max)
}

/// Absolute tolerances that a run may have: with larger ones it would mean nothing.
pub(crate) fn check_tolerances(
    mechanism: &Mechanism,
    start: &State,
    settings: &Settings,
) -> Result<(), InputError> {
    let (length, speed) = (position_scale(mechanism), speed(mechanism, start));
    let of_what = if mechanism.clearance_joints.is_empty() {
        "the size of the mechanism"
    } else {
        "half the smallest clearance"
    };
    let limits = [
        ("position_tolerance", settings.position_tolerance, "m", length, of_what),
        // Where nothing sets a speed, nothing limits its tolerance.
        ("velocity_tolerance", settings.velocity_tolerance, "m/s", speed, "the speed of the mechanism"),
    ];
    let problems: Vec<Problem> = limits
        .into_iter()
        .filter(|(_, given, _, limit, _)| *limit > 0.0 && given.is_some_and(|given| given > *limit))
        .map(|(field, given, unit, limit, of_what)| {
            let message =
                format!("must be <= {limit:.3e} [{unit}], {of_what}, got {:e}", given.unwrap_or(f64::NAN));
            Problem::new(format!("settings.{field}"), message)
        })
        .collect();
    Subject::Settings.judge((), problems)
}

impl Tolerances {
    /// The tolerances of a run from `start`.
    pub(crate) fn new(mechanism: &Mechanism, start: &State, settings: &Settings) -> Self {
        let scales = &mechanism.scales;
        let position_scale = position_scale(mechanism);
        // Where contacts and friction bind the tolerances, a tighter `rtol` must still tell something new.
        let of_run = settings.companion_of.unwrap_or(settings.rtol);
        let tighter = (of_run / DEFAULT_RTOL).min(1.0) * (settings.rtol / of_run);
        let speed = speed(mechanism, start);
        // The oscillation about a resting contact must be resolved, however slow the mechanism.
        let resting = |of: fn(&ContactScales) -> f64| {
            let largest = |contact: &ContactScales| {
                let radians = scales.length / speed * contact.resting_speed / contact.resting_penetration;
                let [least, most] = RESTING_PARTS;
                (RESTING_RADIANS / radians).clamp(least, most) * of(contact)
            };
            tighter * scales.contacts.iter().map(largest).fold(f64::INFINITY, f64::min)
        };
        let finest = 4.0 * f64::EPSILON * scales.length;
        let position =
            (settings.rtol * position_scale).min(resting(|contact| contact.resting_penetration)).max(finest);
        // Where nothing moves, falls or is driven: the speed that crosses the position scale in the
        // whole run. Elsewhere the duration must not change the steps: a run may be continued.
        let speed_scale = if speed > 0.0 { SPEED_PART * speed } else { position_scale / settings.duration };
        let frequencies =
            scales.contacts.iter().map(|contact| contact.resting_speed / contact.resting_penetration);
        let finest_velocity = FINEST_PART * scales.length * frequencies.fold(0.0, f64::max);
        let velocity =
            (settings.rtol * speed_scale).min(resting(|contact| contact.resting_speed)).max(finest_velocity);
        Self {
            position: settings.position_tolerance.unwrap_or(position),
            velocity: settings.velocity_tolerance.unwrap_or(velocity),
            stick_part: STICK_PART * tighter,
            finest_velocity,
        }
    }

    /// Floor of the impact velocity that a joint latches [m/s]: what the scene gives, or the velocity
    /// tolerance, or the part χ v₀ of that where it is below 1. An onset is known no better, so a slower one
    /// may as well have been one at the floor: raising it moves the run no more than its tolerance does. Nor
    /// is the floor above the velocity at which the contact is critically damped.
    pub(crate) fn impact_velocity_floor(&self, mechanism: &Mechanism, joint: usize) -> f64 {
        let default = || {
            let law = mechanism.clearance_joints[joint].law.normal;
            let resolved = law.onset_damping().min(1.0) * self.velocity.max(self.finest_velocity);
            resolved.min(mechanism.scales.contacts[joint].resting_velocity)
        };
        mechanism.clearance_joints[joint].impact_velocity_floor.unwrap_or_else(default)
    }

    /// Velocity tolerance that the damping of a contact leaves [m/s]: its force is known to the elastic share
    /// only where the penetration rate is known to [`NormalLaw::damping_rate`]. Less than the tolerance of flight after a slow impact
    /// with a small restitution only.
    pub(crate) fn damped(&self, law: &NormalLaw, phase: Phase) -> f64 {
        match phase {
            Phase::Contact { latch, .. } => {
                self.velocity.min(law.damping_rate(latch).max(self.finest_velocity))
            }
            Phase::Free => self.velocity,
        }
    }

    /// How many times finer than in the phases of the contacts the velocity must be known for the friction of a
    /// `joint` that presses, slides at `start` [m/s] where a step begins and is in `state` later; at least 1.
    pub(crate) fn velocity_refinement(
        &self,
        mechanism: &Mechanism,
        phases: &[Phase],
        joint: usize,
        start: f64,
        state: &ContactState<f64>,
    ) -> f64 {
        let law = &mechanism.clearance_joints[joint].law;
        let Some(friction) = law.friction else { return 1.0 };
        let here = state.sliding_velocity;
        // What slides the other way has passed zero.
        let slowest = if start * here > 0.0 { start.abs().min(here.abs()) } else { 0.0 };
        let sliding = self.stick_part * friction.stick_velocity().max(slowest);
        let tolerance = (sliding * law.sliding_ratio(state)).max(self.finest_velocity);
        if tolerance < self.velocity {
            (self.velocity_in(mechanism, phases) / tolerance).max(1.0)
        } else {
            1.0
        }
    }

    /// Velocity tolerance in the phases of the contacts [m/s].
    fn velocity_in(&self, mechanism: &Mechanism, phases: &[Phase]) -> f64 {
        let joints = mechanism.clearance_joints.iter().zip(phases);
        joints.map(|(joint, phase)| self.damped(&joint.law.normal, *phase)).fold(self.velocity, f64::min)
    }

    /// The tolerances of all coordinates and their velocities in the phases of the contacts.
    pub(crate) fn in_phases(
        &self,
        mechanism: &Mechanism,
        phases: &[Phase],
        position: &mut [f64],
        velocity: &mut [f64],
    ) {
        let of_velocities = self.velocity_in(mechanism, phases);
        for (k, lever) in mechanism.scales.levers.iter().enumerate() {
            position[k] = self.position / lever;
            velocity[k] = of_velocities / lever;
        }
    }
}
