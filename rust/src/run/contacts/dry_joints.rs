//! Ideal joints with friction: sticking and sliding as phases with located guards. What sticks has no acceleration: the static
//! balance of the state says how much friction that takes.

use crate::contact::friction::JointPhase;
use crate::integrators::Status;
use crate::integrators::events::Guard;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::{HALF_DIGITS, NEWTON_STEPS, ROUNDING, ROUNDING_OF_SOLUTION};
use crate::run::contacts::guards::{OVERSHOOT, RATIO_PART};
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Event, EventKind, Place};
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;
use crate::tree::elements::IdealKind;

/// The component of a joint.
fn component(mechanism: &Mechanism, index: usize) -> usize {
    let joint = &mechanism.ideal_joints[mechanism.dry_joints[index].joint];
    mechanism.components.of(joint.bodies).unwrap_or_default()
}

/// Unit of the coordinate of a joint relative to the size of its component [rad/m or 1].
fn reach(mechanism: &Mechanism, index: usize) -> f64 {
    match mechanism.ideal_joints[mechanism.dry_joints[index].joint].kind {
        IdealKind::Prismatic => 1.0,
        IdealKind::Revolute | IdealKind::Fixed => {
            1.0 / mechanism.scales.components[component(mechanism, index)].length
        }
    }
}

/// Velocity tolerance of the coordinate of a joint [rad/s or m/s].
fn velocity_tolerance(motion: &Motion, tolerances: &Tolerances, index: usize) -> f64 {
    let mechanism = motion.mechanism;
    tolerances.of(component(mechanism, index)).velocity * reach(mechanism, index)
}

fn slide(motion: &mut Motion, index: usize, direction: f64) {
    motion.dynamics.set_joint_phase(index, JointPhase::Slides(direction));
}

/// Decides which joints stick and which slide at the start.
pub(crate) fn begin_dry_joints(motion: &mut Motion, tolerances: &Tolerances, (q, v): (&[f64], &[f64])) {
    let count = motion.mechanism.dry_joints.len();
    if count == 0 || !motion.dynamics.acceleration(0.0, q, v, &mut motion.a) {
        return;
    }
    motion.dynamics.accelerate(&motion.a);
    let moves = |index: usize| motion.dynamics.dry_inertia(index).is_finite();
    let movable: Vec<bool> = (0..count).map(moves).collect();
    for (index, moves) in movable.into_iter().enumerate() {
        let velocity = motion.dynamics.dry_velocity(index);
        if !moves {
            // A drive that starts from rest moves in either direction.
            let first = [velocity, motion.dynamics.dry_acceleration(index)];
            let direction = first.into_iter().find(|rate| *rate != 0.0).unwrap_or(1.0).signum();
            slide(motion, index, direction);
        } else if velocity.abs() > RATIO_PART * velocity_tolerance(motion, tolerances, index) {
            slide(motion, index, velocity.signum());
        } else {
            motion.dynamics.stick_joint(index);
        }
    }
    let at_rest: Vec<usize> =
        (0..count).filter(|&index| motion.dynamics.joint_phases()[index].sticks()).collect();
    // Where no choice is right, the first step ends the run.
    hold(motion, &at_rest);
}

/// Lets a joint slide in a direction, and those of the `joints` with it that only move together with it.
fn direct(motion: &mut Motion, joints: &[usize], index: usize, direction: f64) {
    for &other in joints {
        let correlation = if other == index { 1.0 } else { motion.dynamics.dry_correlation(index, other) };
        if correlation.abs() == 1.0 {
            slide(motion, other, correlation * direction);
        }
    }
}

/// Finds which of some joints at rest stick and which slide in the state last moved to, from what they do now: all go where
/// their friction lets them until none has to. False where there is no choice that is right for all, or none was found.
fn hold(motion: &mut Motion, joints: &[usize]) -> bool {
    for _ in 0..NEWTON_STEPS {
        if !motion.dynamics.find_friction() {
            return false;
        }
        let departure = |&index: &usize| Some((index, motion.dynamics.dry_departure(index)?));
        let departures: Vec<(usize, f64)> = joints.iter().filter_map(departure).collect();
        if departures.is_empty() {
            return true;
        }
        for (index, direction) in departures {
            if direction == 0.0 {
                motion.dynamics.stick_joint(index);
            } else {
                slide(motion, index, direction);
            }
        }
    }
    false
}

/// Takes the errors of a step, which let joints that stick creep, back from its end, where they are not rounding errors;
/// returns whether it did.
pub(crate) fn hold_still(
    motion: &mut Motion,
    tolerances: &Tolerances,
    t: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> bool {
    let count = motion.mechanism.dry_joints.len();
    if !motion.dynamics.joint_phases().iter().any(JointPhase::sticks) {
        return false;
    }
    if !motion.dynamics.is_at(t.into(), q, v) {
        motion.dynamics.move_to(t, q, v);
    }
    let creeps = |index: usize| {
        let (dynamics, mechanism) = (&motion.dynamics, motion.mechanism);
        let allowed = HALF_DIGITS * reach(mechanism, index);
        let own = tolerances.of(component(mechanism, index));
        dynamics.joint_phases()[index].sticks()
            && (dynamics.dry_velocity(index).abs() > allowed * own.velocity
                || dynamics.dry_offset(index).abs() > allowed * own.position)
    };
    let corrects = (0..count).any(creeps) && motion.dynamics.find_friction();
    if corrects {
        motion.dynamics.hold_still(q, v);
    }
    corrects
}

/// Gives the joints of a mechanism that drives move the directions in which they move in a state; false where their friction
/// has two solutions or none.
pub(crate) fn settle_directions(motion: &mut Motion, t: f64, q: &[f64], v: &[f64]) -> bool {
    if motion.mechanism.dry_joints.is_empty() {
        return true;
    }
    motion.dynamics.move_to(t, q, v);
    for index in 0..motion.mechanism.dry_joints.len() {
        let velocity = motion.dynamics.dry_velocity(index);
        slide(motion, index, if velocity == 0.0 { 0.0 } else { velocity.signum() });
    }
    motion.dynamics.find_friction()
}

/// Finds the friction in the state of the frames inside the step or at its end, if a joint sticks: how much it takes to hold
/// it. False where there is none.
pub(crate) fn find_held(motion: &mut Motion, is_inside: bool) -> bool {
    if !motion.dynamics.joint_phases().iter().any(JointPhase::sticks) {
        return true;
    }
    if is_inside {
        motion.inside.copy_phases(&motion.dynamics);
    }
    let dynamics = if is_inside { &mut motion.inside } else { &mut motion.dynamics };
    dynamics.find_friction()
}

/// The guard of a joint with friction in the state of the frames inside the step or at its end, after [`find_held`]: what is
/// left to the largest friction where it sticks, as a part of it, its velocity in its direction [rad/s or m/s] where it
/// slides.
pub(crate) fn dry_guard(motion: &Motion, tolerances: &Tolerances, is_inside: bool, index: usize) -> Guard {
    let dynamics = if is_inside { &motion.inside } else { &motion.dynamics };
    let (value, resolution, overshoot) = match motion.dynamics.joint_phases()[index] {
        JointPhase::Sticks { .. } => (1.0 - dynamics.dry_fraction(index).abs(), ROUNDING_OF_SOLUTION, 0.0),
        JointPhase::Slides(direction) => {
            let velocity = dynamics.dry_velocity(index);
            let tolerance = velocity_tolerance(motion, tolerances, index);
            let rounding = ROUNDING * velocity.abs();
            (direction * velocity, rounding + RATIO_PART * tolerance, OVERSHOOT * tolerance)
        }
    };
    Guard { value, rate: f64::NAN, margin: 0.0, resolution, overshoot: overshoot.max(8.0 * resolution) }
}

/// Whether a joint whose velocity passes zero may come to rest there, after the accelerations of the state: what the location
/// of the event leaves of its motion stops the mechanism by no more than a tolerance. At a dead center, or where a drive turns
/// it back, the mechanism goes on.
fn may_rest(motion: &mut Motion, tolerances: &Tolerances, index: usize, v: &[f64]) -> bool {
    if !motion.dynamics.dry_inertia(index).is_finite() {
        return false;
    }
    let mut change = v.to_vec();
    motion.dynamics.stop_joints(&[index], &mut change);
    change.iter_mut().zip(v).for_each(|(stopped, v)| *stopped -= v);
    let scales = &motion.mechanism.scales;
    (0..scales.components.len()).all(|of| scales.largest(of, &change) <= tolerances.of(of).velocity)
}

/// Changes from sticking to sliding or back where the guard of a joint is zero. What is at rest is decided anew beside a joint
/// that comes to rest or turns back, since its load jumps; what sticks then, or goes on in its direction after it has passed zero,
/// loses the velocity that the location of the event leaves. An error where friction has two solutions or none.
pub(crate) fn cross_dry_joint(
    motion: &mut Motion,
    log: &mut ContactLog,
    tolerances: &Tolerances,
    index: usize,
    (time, q, v): (f64, &[f64], &mut [f64]),
) -> Result<(), Status> {
    // The frames may be those of another stage, and the joint may have changed with another at the same instant.
    if !motion.dynamics.acceleration(time, q, v, &mut motion.a) {
        return Ok(());
    }
    let guard = dry_guard(motion, tolerances, false, index);
    if guard.value > guard.resolution {
        return Ok(());
    }
    let before = motion.dynamics.joint_phases().to_vec();
    let moves = |other: usize| motion.dynamics.dry_inertia(other).is_finite();
    let moves: Vec<bool> = (0..before.len()).map(moves).collect();
    if before[index].sticks() {
        let stuck: Vec<usize> = (0..before.len()).filter(|&other| before[other].sticks()).collect();
        let direction = motion.dynamics.dry_fraction(index).signum();
        direct(motion, &stuck, index, direction);
    } else if may_rest(motion, tolerances, index, v) {
        // Joints that only move together pass zero at the same instant.
        let rests = |&other: &usize| {
            let ahead = before[other].direction() * motion.dynamics.dry_velocity(other);
            moves[other] && ahead <= velocity_tolerance(motion, tolerances, other)
        };
        let at_rest: Vec<usize> = (0..before.len()).filter(rests).collect();
        // What turns back needs no holding.
        for &other in at_rest.iter().filter(|&&other| !before[other].sticks()) {
            slide(motion, other, -before[other].direction());
        }
        if !hold(motion, &at_rest) {
            return Err(Status::FrictionIndeterminate);
        }
        let stands = |&other: &usize| match motion.dynamics.joint_phases()[other] {
            JointPhase::Sticks { .. } => true,
            JointPhase::Slides(direction) => direction * motion.dynamics.dry_velocity(other) < 0.0,
        };
        let standing: Vec<usize> = at_rest.into_iter().filter(stands).collect();
        motion.dynamics.stop_joints(&standing, v);
    } else {
        // Nothing holds it: a drive, or the mechanism at a dead center of the joint, turns its motion back.
        slide(motion, index, -before[index].direction());
        return Ok(());
    }
    for (other, (before, moves)) in before.iter().zip(moves).enumerate() {
        let after = motion.dynamics.joint_phases()[other];
        if after.direction() != before.direction() && moves {
            let kind = if after.sticks() { EventKind::Stick } else { EventKind::Slip };
            log.events.push(Event { time, place: Place::DryJoint(other), kind, normal_velocity: 0.0 });
        }
    }
    Ok(())
}
