//! The damping of a contact, fixed at its onset or at the start of a run that begins in contact.

use crate::contact::pair::{Phase, Surfaces};
use crate::dynamics::relative_motion;
use crate::error::Notice;
use crate::integrators::StateAt;
use crate::run::contacts::OpenContact;
use crate::run::contacts::guards::gap_resolution;
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::sticking::{begin_friction, new_traction};
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;

/// The onset of a contact.
pub(crate) struct Onset {
    /// The phase that begins.
    pub(crate) phase: Phase,
    /// Penetration rate at zero penetration [m/s].
    pub(crate) impact_velocity: f64,
    /// Bound of the next step [s].
    pub(crate) first_step: f64,
    /// Whether it is slower than the floor of the impact velocity, and damped as if at it.
    pub(crate) is_at_floor: bool,
}

/// The onset of a contact in a state with zero or slightly positive penetration.
pub(crate) fn onset(
    motion: &mut Motion,
    tolerances: &Tolerances,
    rtol: f64,
    StateAt { t, q, v }: StateAt,
    index: usize,
) -> Onset {
    let mechanism = motion.mechanism;
    let law = &mechanism.slots[index].law.normal;
    let mass = contact_mass(motion, t, q, v, index);
    let impact_velocity = surface_velocity(motion, index);
    let floor = tolerances.impact_velocity_floor(mechanism, index);
    let latch = law.latch(impact_velocity.max(floor));
    let scales = &mechanism.scales.contacts[index];
    let deepest = law.impact_penetration(scales.mass, impact_velocity).max(scales.resting_penetration);
    let traction = new_traction(motion, index, deepest);
    // In slower impacts the load determines the time scale.
    let slowest = mechanism.scales.contacts[index].resting_velocity;
    let impact_time = law.impact_time(mass, impact_velocity.max(slowest));
    Onset {
        phase: Phase::Contact { latch, clipped: false, traction },
        impact_velocity,
        is_at_floor: law.is_latched() && impact_velocity < floor,
        // The force grows as δ^n, which limits the order to n + 1 in the steps next to the onset. A factor of two changes
        // the work by 0.5 %, and errors by less than they scatter.
        first_step: rtol.powf(1.0 / (law.exponent + 1.0)) * impact_time,
    }
}

/// Penetration rate [m/s] at zero penetration, extrapolated with the present acceleration; called after
/// [`contact_mass`]. A located onset has a penetration of up to a part of the position
/// tolerance. Over this distance a load can make a slow approach several times faster.
fn surface_velocity(motion: &mut Motion, index: usize) -> f64 {
    motion.dynamics.accelerate(&motion.a);
    let state = motion.dynamics.contact_state(index);
    let slot = &motion.mechanism.slots[index];
    let relative = motion.dynamics.slot_motion(slot);
    let acceleration =
        slot.law.penetration_acceleration(&relative_motion(&relative), relative.acceleration.into());
    let square = state.penetration_rate.powi(2) - 2.0 * acceleration * state.penetration;
    if square.is_nan() { state.penetration_rate } else { square.max(0.0).sqrt() }
}

/// Sets the phases of the contacts in which the run starts; returns warnings.
pub(crate) fn begin_contacts(
    motion: &mut Motion,
    tolerances: &Tolerances,
    log: &mut ContactLog,
    q: &[f64],
    v: &[f64],
) -> Vec<Notice> {
    let mut warnings = Vec::new();
    motion.dynamics.move_to(0.0, q, v);
    for index in 0..motion.dynamics.phases.len() {
        begin_at_ends(motion, index);
        if motion.dynamics.phases[index] == Phase::Beyond {
            continue;
        }
        let state = motion.dynamics.contact_state(index);
        let mechanism = motion.mechanism;
        let joint = &mechanism.slots[index];
        let law = &joint.law.normal;
        let slowest =
            joint.impact_velocity_floor.unwrap_or(mechanism.scales.contacts[index].resting_velocity);
        // A journal that the scene places on the surface may lie on either side by a rounding error.
        let touches =
            state.penetration > -gap_resolution(mechanism, index, &motion.dynamics.slot_ends(joint));
        let rests = touches && state.penetration_rate.abs() < slowest;
        if !(state.penetration > 0.0 || rests) {
            continue;
        }
        // Velocity of the impact that would have reached this state without loss.
        let elastic = law.elastic_energy(state.penetration);
        let mass = contact_mass(motion, 0.0, q, v, index);
        let arrival = (state.penetration_rate.powi(2) + 2.0 * elastic / mass).sqrt().max(slowest);
        if law.is_latched() {
            let what = format!(
                "starts in contact: it has no impact velocity and is damped as after an impact at {arrival:.3e} m/s. \
                 This is the velocity that leads to its start without loss or, if larger, the one for which it is \
                 critically damped under the load of the start"
            );
            let numbers = vec![("velocity", arrival)];
            warnings.push(Notice::of_joint("starts_in_contact", &joint.name, numbers, what));
        }
        let scales = &mechanism.scales.contacts[index];
        let traction = new_traction(motion, index, state.penetration.max(scales.resting_penetration));
        motion.dynamics.phases[index] =
            Phase::Contact { latch: law.latch(arrival), clipped: false, traction };
        motion.dynamics.settle_contact(index);
        if traction.is_some() {
            motion.dynamics.accelerate(&motion.a);
            begin_friction(motion, tolerances, index);
        }
        log.open[index] = Some(OpenContact::begin(index, 0.0, f64::NAN));
    }
    warnings
}

/// Decides which of two corners at an end of a guide is over the face of the other; the first of them decides.
fn begin_at_ends(motion: &mut Motion, index: usize) {
    let slot = &motion.mechanism.slots[index];
    if let (Surfaces::Face(face), Some(neighbor)) = (&slot.law.surfaces, &slot.neighbor)
        && index < neighbor.slot
    {
        let [[ahead, _], _] = motion.dynamics.ends_ahead(slot, face, neighbor);
        let beyond = if ahead < 0.0 { index } else { neighbor.slot };
        motion.dynamics.phases[beyond] = Phase::Beyond;
    }
}

/// Effective mass [kg] for the normal force of a contact in a state.
fn contact_mass(motion: &mut Motion, t: f64, q: &[f64], v: &[f64], index: usize) -> f64 {
    if !motion.dynamics.acceleration(t, q, v, &mut motion.a) {
        return f64::INFINITY;
    }
    let slot = &motion.mechanism.slots[index];
    let normal = motion.dynamics.slot_normal(slot);
    motion.dynamics.accelerance(motion.dynamics.touching_points(slot)).mass_along(normal)
}
