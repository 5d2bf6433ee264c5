//! Ideal joints with friction: their spring, and sticking and sliding as phases with located guards.

use crate::contact::sticking::Traction;
use crate::integrators::events::Guard;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::instant::Instant;
use crate::run::contacts::guards::{ONSET_PART, RATIO_PART};
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Event, EventKind, Place};
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;
use crate::tree::elements::IdealKind;

/// Smallest stretch of the spring of a joint under its largest friction, relative to the size of the mechanism: at the
/// square root of a rounding error its force still has half of its digits.
const LEAST_STRETCH: f64 = 1.490_116_119_384_765_6e-8;

/// Most passes over joints at rest, and part of the largest friction by which their loads may still change in the last one.
const PASSES: usize = 50;
/// See there.
const SETTLED: f64 = 1e-9;

/// Unit of the coordinate of a joint at the size of the mechanism: 1 [rad], or that size [m].
fn reach(mechanism: &Mechanism, index: usize) -> f64 {
    match mechanism.ideal_joints[mechanism.dry_joints[index].joint].kind {
        IdealKind::Prismatic => mechanism.scales.length,
        IdealKind::Revolute | IdealKind::Fixed => 1.0,
    }
}

/// Velocity tolerance of the coordinate of a joint [rad/s or m/s].
fn velocity_tolerance(motion: &Motion, tolerances: &Tolerances, index: usize) -> f64 {
    let mechanism = motion.mechanism;
    tolerances.velocity * reach(mechanism, index) / mechanism.scales.length
}

/// Decides which joints stick and which slide at the start, and fixes their springs.
///
/// A joint without clearance has no stiffness of its own. Its spring stretches by `rtol` times the size of the mechanism (or
/// by `rtol` radians) under the largest friction of the start, or under one that gives the mechanism its speed within its
/// size if that is larger, and is critically damped. What sticks therefore moves by less than the tolerance.
pub(crate) fn begin_dry_joints(
    motion: &mut Motion,
    tolerances: &Tolerances,
    rtol: f64,
    (q, v): (&[f64], &[f64]),
) {
    let mechanism = motion.mechanism;
    if mechanism.dry_joints.is_empty() || !motion.dynamics.acceleration(0.0, q, v, &mut motion.a) {
        return;
    }
    motion.dynamics.accelerate(&motion.a);
    motion.dynamics.find_friction(true);
    let rate = mechanism.scales.speed / mechanism.scales.length;
    let mut at_rest = Vec::new();
    for index in 0..mechanism.dry_joints.len() {
        let (inertia, reach) = (motion.dynamics.dry_inertia(index), reach(mechanism, index));
        let (velocity, acceleration) =
            (motion.dynamics.dry_velocity(index), motion.dynamics.dry_acceleration(index));
        let mut traction = motion.dynamics.tractions()[index];
        if inertia.is_finite() {
            let load = motion.dynamics.dry_limit(index).max(inertia * rate * rate * reach);
            // Without any load, speed and acceleration nothing is transmitted.
            traction.stiffness = load.max(f64::MIN_POSITIVE) / (rtol.max(LEAST_STRETCH) * reach);
            traction.damping = 2.0 * (traction.stiffness * inertia).sqrt();
            traction.direction = velocity.signum();
            if velocity.abs() <= RATIO_PART * velocity_tolerance(motion, tolerances, index) {
                at_rest.push(index);
            }
        } else {
            // A drive that starts from rest moves in either direction.
            let first = [velocity, acceleration].into_iter().find(|rate| *rate != 0.0);
            traction.direction = first.unwrap_or(1.0).signum();
        }
        motion.dynamics.set_traction(index, traction);
    }
    hold(motion, &at_rest);
}

/// Lets joints at rest stick where their friction holds them, with their springs stretched as far as that takes, and slide
/// where it does not, in the state last moved to. Their loads depend on each other.
fn hold(motion: &mut Motion, joints: &[usize]) {
    let mut efforts = vec![0.0; joints.len()];
    // A joint that moved turns as it accelerates: friction of others may decide what would hold it.
    let turned = joints.iter().map(|&index| {
        let moved = !motion.dynamics.tractions()[index].sticks();
        moved.then(|| motion.dynamics.dry_acceleration(index).signum())
    });
    let turned: Vec<Option<f64>> = turned.collect();
    // What one of several joints can hold alone, the others need not.
    for &index in joints {
        let unloaded = motion.dynamics.anchored_joint(index, 0.0, motion.dynamics.tractions()[index]);
        motion.dynamics.set_traction(index, unloaded);
    }
    for _ in 0..PASSES {
        let mut settled = true;
        for ((&index, last), turned) in joints.iter().zip(&mut efforts).zip(&turned) {
            let traction = motion.dynamics.tractions()[index];
            // Where its friction moves nothing, it turns as the others let it.
            let unheld = (-motion.dynamics.dry_acceleration(index) * f64::INFINITY, 0.0);
            let (effort, limit) = motion.dynamics.holding_effort(index).unwrap_or(unheld);
            let traction = if effort.abs() <= limit {
                motion.dynamics.anchored_joint(index, effort, traction)
            } else {
                Traction { direction: turned.unwrap_or(-effort.signum()), ..traction }
            };
            motion.dynamics.set_traction(index, traction);
            settled &= effort == *last || (effort - *last).abs() <= SETTLED * limit;
            *last = effort;
        }
        if settled {
            break;
        }
    }
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
        let traction = motion.dynamics.tractions()[index];
        motion.dynamics.set_traction(index, Traction { direction, ..traction });
    }
    motion.dynamics.find_friction(true)
}

/// The guards of all joints with friction in the state of the frames inside the step or at its end: what is left to the
/// largest friction [N m or N] where a joint sticks, the velocity of the slider in its direction [rad/s or m/s] where it
/// slides, its own where drives prescribe it.
pub(crate) fn dry_guards(
    motion: &mut Motion,
    (tolerances, rtol): (&Tolerances, f64),
    is_inside: bool,
    (t, q, v): (Instant, &[f64], &[f64]),
    guards: &mut [Guard],
) {
    if is_inside {
        motion.inside.copy_phases(&motion.dynamics);
    }
    let slides = motion.dynamics.tractions().iter().any(|one| !one.sticks() && one.stiffness > 0.0);
    let dynamics = if is_inside { &mut motion.inside } else { &mut motion.dynamics };
    let exists = if slides {
        // Not the function of the steps, which is inlined there.
        let exists = dynamics.acceleration_and_contacts(t, q, v, &mut motion.a);
        dynamics.accelerate(&motion.a);
        if exists {
            dynamics.differentiate_friction();
        }
        exists
    } else {
        dynamics.find_friction(true)
    };
    if !exists {
        return guards.fill(Guard { value: f64::NAN, ..Guard::INACTIVE });
    }
    let dynamics = if is_inside { &motion.inside } else { &motion.dynamics };
    for (index, guard) in guards.iter_mut().enumerate() {
        let traction = dynamics.tractions()[index];
        let (value, resolution, overshoot) = if traction.sticks() {
            let limit = dynamics.dry_limit(index);
            let rounding = 64.0 * f64::EPSILON * limit
                + 4.0 * f64::EPSILON * traction.stiffness * reach(motion.mechanism, index);
            (limit - dynamics.dry_effort(index).abs(), rounding, rtol * limit)
        } else {
            let velocity = if traction.stiffness > 0.0 {
                dynamics.dry_slider(index)
            } else {
                dynamics.dry_velocity(index)
            };
            let tolerance = velocity_tolerance(motion, tolerances, index);
            let rounding = 4.0 * f64::EPSILON * dynamics.dry_velocity(index).abs();
            (traction.direction * velocity, rounding + RATIO_PART * tolerance, ONSET_PART * tolerance)
        };
        *guard = Guard {
            value,
            rate: f64::NAN,
            margin: 0.0,
            resolution,
            overshoot: overshoot.max(8.0 * resolution),
        };
    }
}

/// Changes from sticking to sliding or back where the guard of a joint is zero. What is at rest sticks anew beside a joint
/// that comes to rest, since its load jumps. What a spring stores is no loss, and is lost when it lets go.
pub(crate) fn cross_dry_joint(
    motion: &mut Motion,
    log: &mut ContactLog,
    tolerances: &Tolerances,
    index: usize,
    (time, q, v): (f64, &[f64], &[f64]),
) {
    if !motion.dynamics.acceleration(time, q, v, &mut motion.a) {
        return;
    }
    motion.dynamics.accelerate(&motion.a);
    let before = motion.dynamics.tractions().to_vec();
    let stored: Vec<f64> = (0..before.len()).map(|other| motion.dynamics.dry_energy(other)).collect();
    let traction = before[index];
    if traction.sticks() {
        let direction = -motion.dynamics.dry_effort(index).signum();
        motion.dynamics.set_traction(index, Traction { direction, ..traction });
    } else if traction.stiffness > 0.0 {
        let rests = |&other: &usize| {
            let slow =
                motion.dynamics.dry_velocity(other).abs() <= velocity_tolerance(motion, tolerances, other);
            before[other].stiffness > 0.0 && (other == index || before[other].sticks() || slow)
        };
        let at_rest: Vec<usize> = (0..before.len()).filter(rests).collect();
        hold(motion, &at_rest);
    } else {
        motion.dynamics.set_traction(index, Traction { direction: -traction.direction, ..traction });
    }
    for (other, (before, stored)) in before.iter().zip(stored).enumerate() {
        motion.work.dry_joints[other] += stored - motion.dynamics.dry_energy(other);
        let after = motion.dynamics.tractions()[other];
        // Drives turn a motion back without sticking.
        if after.direction != before.direction && after.stiffness > 0.0 {
            let kind = if after.sticks() { EventKind::Stick } else { EventKind::Slip };
            log.events.push(Event { time, place: Place::DryJoint(other), kind, normal_velocity: 0.0 });
        }
    }
}
