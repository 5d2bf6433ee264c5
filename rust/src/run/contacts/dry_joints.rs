//! Ideal joints with friction: their spring, and sticking and sliding as phases with located guards.

use crate::contact::sticking::Traction;
use crate::integrators::events::Guard;
use crate::integrators::{StateAt, Status};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::{HALF_DIGITS, NEWTON_STEPS, ROUNDING, ROUNDING_OF_CHAIN};
use crate::run::contacts::guards::{OVERSHOOT, RATIO_PART};
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Event, EventKind, Place};
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;
use crate::tree::elements::{ComponentScales, IdealKind};

/// The component of a joint.
fn component(mechanism: &Mechanism, index: usize) -> usize {
    let joint = &mechanism.ideal_joints[mechanism.dry_joints[index].joint];
    mechanism.components.of(joint.bodies).unwrap_or_default()
}

/// Unit of the coordinate of a joint at the size of its component: 1 [rad], or that size [m].
fn reach(mechanism: &Mechanism, index: usize) -> f64 {
    match mechanism.ideal_joints[mechanism.dry_joints[index].joint].kind {
        IdealKind::Prismatic => mechanism.scales.components[component(mechanism, index)].length,
        IdealKind::Revolute | IdealKind::Fixed => 1.0,
    }
}

/// Velocity tolerance of the coordinate of a joint [rad/s or m/s].
fn velocity_tolerance(motion: &Motion, tolerances: &Tolerances, index: usize) -> f64 {
    let mechanism = motion.mechanism;
    let component = component(mechanism, index);
    let length = mechanism.scales.components[component].length;
    tolerances.of(component).velocity * reach(mechanism, index) / length
}

/// Decides which joints stick and which slide at the start.
pub(crate) fn begin_dry_joints(
    motion: &mut Motion,
    tolerances: &Tolerances,
    rtol: f64,
    (q, v): (&[f64], &[f64]),
) {
    let count = motion.mechanism.dry_joints.len();
    if count == 0 || !motion.dynamics.acceleration(0.0, q, v, &mut motion.a) {
        return;
    }
    motion.dynamics.accelerate(&motion.a);
    let moves = |index: &usize| motion.dynamics.dry_inertia(*index).is_finite();
    let movable: Vec<usize> = (0..count).filter(moves).collect();
    let mut at_rest = Vec::new();
    anchor(motion, rtol, &movable);
    for index in 0..count {
        let velocity = motion.dynamics.dry_velocity(index);
        let direction = if !movable.contains(&index) {
            // A drive that starts from rest moves in either direction.
            let first = [velocity, motion.dynamics.dry_acceleration(index)];
            first.into_iter().find(|rate| *rate != 0.0).unwrap_or(1.0).signum()
        } else if velocity.abs() > RATIO_PART * velocity_tolerance(motion, tolerances, index) {
            velocity.signum()
        } else {
            at_rest.push(index);
            0.0
        };
        motion.dynamics.direct_joint(index, direction);
    }
    // Where no choice is right, the first step ends the run.
    hold(motion, rtol, &at_rest);
}

/// Gives joints that stick their springs, in the state and with the fractions in which friction was last found.
///
/// A joint without clearance has no stiffness of its own. Its spring stretches by at most `rtol` times the size of the
/// mechanism (or by `rtol` radians) under its largest friction: what sticks moves by less than the tolerance. Friction at
/// its limit takes the same energy ½ I u² from the mass I that it moves in all joints, so that those which only move together
/// stretch to equal fractions. The damping is critical, but no slower than the mechanism.
fn anchor(motion: &mut Motion, rtol: f64, joints: &[usize]) {
    let mechanism = motion.mechanism;
    let roots: Vec<f64> = joints.iter().map(|&index| motion.dynamics.dry_inertia(index).sqrt()).collect();
    for (&index, root) in joints.iter().zip(&roots) {
        let own = component(mechanism, index);
        let others = joints.iter().zip(&roots).filter(|(other, _)| component(mechanism, **other) == own);
        let stretches = others.map(|(&other, root)| rtol.max(HALF_DIGITS) * reach(mechanism, other) * root);
        let stretch = stretches.fold(f64::INFINITY, f64::min);
        let ComponentScales { length, speed } = mechanism.scales.components[own];
        let rate = 2.0 * speed / length;
        let dynamics = &mut motion.dynamics;
        let grips = joints.iter().zip(&roots).map(|(&other, root)| {
            dynamics.dry_correlation(index, other).powi(2) * dynamics.dry_limit(other) / root
        });
        let grip = grips.sum::<f64>().max(rate * rate * stretch);
        let damping = if grip > 0.0 { 2.0 * root / (stretch * grip).sqrt() } else { 0.0 };
        let traction = dynamics.tractions()[index];
        let fraction = dynamics.held_fraction(index);
        let traction = Traction { stiffness: root / stretch, damping, ..traction };
        let traction = dynamics.anchored_joint(index, fraction, traction);
        dynamics.set_traction(index, traction);
    }
}

/// Lets a joint slide in a direction, and those of the `joints` with it that only move together with it.
fn direct(motion: &mut Motion, joints: &[usize], index: usize, direction: f64) {
    for &other in joints {
        let correlation = if other == index { 1.0 } else { motion.dynamics.dry_correlation(index, other) };
        if correlation.abs() == 1.0 {
            motion.dynamics.direct_joint(other, correlation * direction);
        }
    }
}

/// Finds which of some joints at rest stick and which slide in the state last moved to, from what they do now: all go where
/// their friction lets them until none has to. False where there is no choice that is right for all, or none was found.
fn hold(motion: &mut Motion, rtol: f64, joints: &[usize]) -> bool {
    for _ in 0..NEWTON_STEPS {
        let sticks = |index: &usize| motion.dynamics.tractions()[*index].sticks();
        let held: Vec<usize> = joints.iter().copied().filter(sticks).collect();
        if !motion.dynamics.hold_joints(&held) {
            return false;
        }
        let departure = |&index: &usize| Some((index, motion.dynamics.dry_departure(index)?));
        let departures: Vec<(usize, f64)> = joints.iter().filter_map(departure).collect();
        if departures.is_empty() {
            // What its largest friction just holds sticks too.
            let rests = |index: &usize| !motion.dynamics.dry_accelerates(*index);
            let at_rest: Vec<usize> = joints.iter().copied().filter(rests).collect();
            anchor(motion, rtol, &at_rest);
            return true;
        }
        for (index, direction) in departures {
            motion.dynamics.direct_joint(index, direction);
        }
    }
    false
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
        let direction = if velocity == 0.0 { 0.0 } else { velocity.signum() };
        motion.dynamics.direct_joint(index, direction);
    }
    motion.dynamics.find_friction()
}

/// The guard of a joint with friction in the state of the frames inside the step or at its end: what is left to the largest
/// friction where it sticks, as a part of it, its velocity in its direction [rad/s or m/s] where it slides.
pub(crate) fn dry_guard(
    motion: &Motion,
    (tolerances, rtol): (&Tolerances, f64),
    is_inside: bool,
    index: usize,
) -> Guard {
    let dynamics = if is_inside { &motion.inside } else { &motion.dynamics };
    let traction = &motion.dynamics.tractions()[index];
    let velocity = dynamics.dry_velocity(index);
    let (value, resolution, overshoot) = if traction.sticks() {
        let rounding = ROUNDING * traction.stiffness * reach(motion.mechanism, index);
        (1.0 - dynamics.dry_fraction(index, traction).abs(), rounding + ROUNDING_OF_CHAIN, rtol)
    } else {
        let tolerance = velocity_tolerance(motion, tolerances, index);
        let rounding = ROUNDING * velocity.abs();
        (traction.direction * velocity, rounding + RATIO_PART * tolerance, OVERSHOOT * tolerance)
    };
    Guard { value, rate: f64::NAN, margin: 0.0, resolution, overshoot: overshoot.max(8.0 * resolution) }
}

/// Changes from sticking to sliding or back where the guard of a joint is zero. What is at rest sticks anew beside a joint
/// that comes to rest or turns back, since its load jumps. An error where friction has two solutions or none.
pub(crate) fn cross_dry_joint(
    motion: &mut Motion,
    log: &mut ContactLog,
    (tolerances, rtol): (&Tolerances, f64),
    index: usize,
    StateAt { t: time, q, v }: StateAt,
) -> Result<(), Status> {
    // The joint may have changed with another at the same instant.
    let guard = dry_guard(motion, (tolerances, rtol), false, index);
    if guard.value > guard.resolution || !motion.dynamics.acceleration(time, q, v, &mut motion.a) {
        return Ok(());
    }
    let before = motion.dynamics.tractions().to_vec();
    let moves = |other: &usize| motion.dynamics.dry_inertia(*other).is_finite();
    // Joints that only move together pass zero at the same instant.
    let rests = |&other: &usize| {
        let ahead = before[other].direction * motion.dynamics.dry_velocity(other);
        ahead <= velocity_tolerance(motion, tolerances, other)
    };
    if before[index].sticks() {
        let stuck: Vec<usize> = (0..before.len()).filter(|&other| before[other].sticks()).collect();
        let direction = motion.dynamics.held_fraction(index).signum();
        direct(motion, &stuck, index, direction);
    } else if moves(&index) {
        let at_rest: Vec<usize> = (0..before.len()).filter(moves).filter(rests).collect();
        // What turns back needs no holding.
        for &other in &at_rest {
            motion.dynamics.direct_joint(other, -before[other].direction);
        }
        if !hold(motion, rtol, &at_rest) {
            return Err(Status::FrictionIndeterminate);
        }
    } else {
        // Nothing holds it: a drive, or the mechanism at a dead center of the joint, turns its motion back.
        motion.dynamics.direct_joint(index, -before[index].direction);
    }
    for (other, before) in before.iter().enumerate() {
        let after = motion.dynamics.tractions()[other];
        // Drives turn a motion back without sticking.
        if after.direction != before.direction && after.stiffness > 0.0 {
            let kind = if after.sticks() { EventKind::Stick } else { EventKind::Slip };
            log.events.push(Event { time, place: Place::DryJoint(other), kind, normal_velocity: 0.0 });
        }
    }
    Ok(())
}
