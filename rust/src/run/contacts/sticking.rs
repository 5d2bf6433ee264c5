//! Sticking and sliding as phases of a contact whose friction law sticks: guards, changes, the traction of an onset.

use crate::contact::pair::Phase;
use crate::contact::sticking::Traction;
use crate::dynamics::SlotContact;
use crate::integrators::events::Guard;
use crate::numerics::accuracy::{ROUNDING, ROUNDING_OF_CHAIN};
use crate::numerics::instant::Instant;
use crate::run::contacts::EventKind;
use crate::run::contacts::guards::{OVERSHOOT, RATIO_PART, gap_resolution};
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;
use crate::tree::kinematics::perp;

/// The traction of a contact that is not clipped.
fn loaded(phase: Phase) -> Option<Traction> {
    match phase {
        Phase::Contact { clipped: false, traction, .. } => traction,
        _ => None,
    }
}

/// Computes the accelerations where one of the slots slides: the velocity of its slider depends on the rate of its normal
/// force. False where they do not exist.
fn accelerate_sliding(
    motion: &mut Motion,
    slots: &[usize],
    is_inside: bool,
    (t, q, v): (Instant, &[f64], &[f64]),
) -> bool {
    let phases = &motion.dynamics.phases;
    if !slots.iter().any(|&slot| loaded(phases[slot]).is_some_and(|traction| !traction.sticks())) {
        return true;
    }
    if is_inside {
        motion.inside.copy_phases(&motion.dynamics);
    }
    let dynamics = if is_inside { &mut motion.inside } else { &mut motion.dynamics };
    // Not the function of the steps, which is inlined there.
    let exists = dynamics.acceleration_and_contacts(t, q, v, &mut motion.a);
    dynamics.accelerate(&motion.a);
    exists
}

/// The guards of the slots that can stick, the last ones of all guards; the frames have been moved to the state.
#[inline(never)]
pub(crate) fn sticking_guards(
    motion: &mut Motion,
    slots: &[usize],
    limits: (&Tolerances, f64),
    (t, q, v): (Instant, &[f64], &[f64]),
    guards: &mut [Guard],
) {
    let is_inside = motion.dynamics.instant() != t;
    let exists = accelerate_sliding(motion, slots, is_inside, (t, q, v));
    let first = guards.len() - slots.len();
    for (of_slot, &slot) in guards[first..].iter_mut().zip(slots) {
        *of_slot = stick_guard(motion, limits, is_inside, slot);
        if !exists {
            of_slot.value = f64::NAN;
        }
    }
}

/// The guard of a slot in the state of the frames inside the step or at its end, after [`accelerate_sliding`]: what is left
/// to Coulomb's limit [N] where it sticks, the velocity of the slider in its direction [m/s] where it slides.
fn stick_guard(
    motion: &Motion,
    (tolerances, rtol): (&Tolerances, f64),
    is_inside: bool,
    index: usize,
) -> Guard {
    let dynamics = if is_inside { &motion.inside } else { &motion.dynamics };
    let slot = &motion.mechanism.slots[index];
    let phase = motion.dynamics.phases[index];
    let (Some(traction), Some(law)) = (loaded(phase), slot.law.stick_slip()) else { return Guard::INACTIVE };
    let ends = dynamics.slot_ends(slot);
    let (value, resolution, overshoot) = if traction.sticks() {
        let SlotContact { motion: relative, state } = dynamics.contact_of(slot, phase);
        let spring = slot.law.spring_force(&traction, &relative, state.friction_force);
        let limit = law.static_coefficient * state.normal_force;
        let slope = law.static_coefficient * slot.law.normal.stiffness_at(state.penetration.max(0.0));
        let rounding = (traction.stiffness + slope) * gap_resolution(motion.mechanism, index, &ends);
        (limit - spring.abs(), rounding + ROUNDING_OF_CHAIN * limit.abs(), rtol * limit)
    } else {
        let rounding = ROUNDING * ends.iter().map(|end| end.velocity.abs().sum()).sum::<f64>();
        let slider = traction.direction * dynamics.slider_velocity(slot, phase, &traction);
        let tolerance = tolerances.of_joint(motion.mechanism, index).velocity;
        (slider, rounding + RATIO_PART * tolerance, OVERSHOOT * tolerance)
    };
    Guard { value, rate: f64::NAN, margin: 0.0, resolution, overshoot: overshoot.max(8.0 * resolution) }
}

fn set_traction(motion: &mut Motion, index: usize, new: Traction) {
    if let Phase::Contact { traction, .. } = &mut motion.dynamics.phases[index] {
        *traction = Some(new);
    }
}

/// Changes from sticking to sliding or back where the guard of a slot is zero; `None` if it does neither any more.
pub(crate) fn cross_stick(motion: &mut Motion, index: usize) -> Option<EventKind> {
    let slot = &motion.mechanism.slots[index];
    let phase = motion.dynamics.phases[index];
    let traction = loaded(phase)?;
    let SlotContact { motion: relative, state } = motion.dynamics.contact_of(slot, phase);
    let (kind, traction) = if traction.sticks() {
        // The spring pulls the second body back.
        let direction = -slot.law.spring_force(&traction, &relative, state.friction_force).signum();
        (EventKind::Slip, Traction { direction, ..traction })
    } else {
        (EventKind::Stick, motion.dynamics.anchored(slot, state.friction_force, traction))
    };
    set_traction(motion, index, traction);
    Some(kind)
}

/// The tangential spring of a contact that begins, whose normal force acts up to a penetration [m]; after
/// [`crate::dynamics::Dynamics::acceleration`].
pub(crate) fn new_traction(motion: &mut Motion, index: usize, penetration: f64) -> Option<Traction> {
    let slot = &motion.mechanism.slots[index];
    let law = slot.law.stick_slip()?;
    let stiffness = law.stiffness(slot.law.normal.stiffness_at(penetration));
    let tangent = perp(motion.dynamics.slot_normal(slot));
    let points = motion.dynamics.surface_points(slot);
    let mass = motion.dynamics.accelerance(points).mass_along(tangent);
    // Twice that of the ratio, of which half acts at the load. Where drives prescribe the sliding, nothing oscillates.
    let damping = if mass.is_finite() { 4.0 * law.damping_ratio * (stiffness * mass).sqrt() } else { 0.0 };
    let load = slot.law.normal.elastic_force(penetration);
    Some(Traction { stiffness, damping, load, direction: 0.0, anchor: 0.0, arm: 0.0, turns: [0.0; 2] })
}

/// Decides whether a contact that begins in the state of the dynamics sticks or slides, after
/// [`crate::dynamics::Dynamics::accelerate`]. It sticks with an unloaded spring.
pub(crate) fn begin_friction(motion: &mut Motion, tolerances: &Tolerances, index: usize) {
    let slot = &motion.mechanism.slots[index];
    let Some(traction) = loaded(motion.dynamics.phases[index]) else { return };
    set_traction(motion, index, Traction { direction: 1.0, ..traction });
    let sliding = motion.dynamics.contact_of(slot, motion.dynamics.phases[index]).state.sliding_velocity;
    let direction = sliding.signum();
    set_traction(motion, index, Traction { direction, ..traction });
    let slider = motion.dynamics.slider_velocity(slot, motion.dynamics.phases[index], &traction);
    let tolerance = tolerances.of_joint(motion.mechanism, index).velocity;
    if sliding.abs().min(direction * slider) <= RATIO_PART * tolerance {
        let sticks = motion.dynamics.anchored(slot, 0.0, traction);
        set_traction(motion, index, sticks);
    }
}
