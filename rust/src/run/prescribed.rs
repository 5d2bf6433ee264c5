//! Kinematic runs: in a mechanism without degrees of freedom the drives prescribe the motion; nothing is
//! integrated.

use crate::integrators::{Outcome, Stats, Status};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::{HALVINGS, INTEGRAL_ERROR, ROUNDING_OF_CHAIN};
use crate::run::contacts::dry_joints::settle_directions;
use crate::run::contacts::phases::Phases;
use crate::run::motion::Motion;
use crate::run::system::System;
use crate::run::work::GAUSS;
use crate::run::work::pace::continued;

/// Largest rotation of a drive [rad] in one step of the continuation of the kinematic solution. The error of
/// the initial guess is then a few thousandths of the size of the mechanism, far from any other branch.
/// Half and twice change samples by rounding (142 of 150 scenes).
const LARGEST_ROTATION: f64 = 0.05;
/// The motion of a mechanism that its drives prescribe completely, from an instant [s] to `end`;
/// nothing is integrated.
///
/// The steps of the continuation depend on the drives alone. Samples and the end are solved for from the
/// configuration before them, so that the choice of the samples does not change the motion.
pub(crate) fn follow_drives(
    system: &mut System,
    from: f64,
    end: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> Outcome {
    let mut outcome = Outcome { status: Status::Done, time: from, guard: None, stats: Stats::default() };
    let mut last = f64::NAN;
    let followed = loop {
        let t = outcome.time;
        if outcome.stats.steps >= system.limits().max_steps {
            outcome.status = Status::MaxSteps;
            break true;
        }
        let step = continued(system.motion.mechanism, t, last, LARGEST_ROTATION);
        let next = (t + step).min(system.motion.mechanism.next_break(t));
        let next = next.min(end);
        if !sample_until(system, t, next, q, v)
            || !track_from(system, t, next, q, v)
            || !go_on(&mut system.motion, t, next, q, v)
        {
            break false;
        }
        (outcome.time, last) = (next, step);
        outcome.stats.steps += 1;
        if !(system.motion.monitor)(next) {
            outcome.status = Status::Cancelled;
            break true;
        }
        if next >= end {
            break true;
        }
        system.motion.wrap(q);
    };
    if !followed {
        outcome.status = Status::SingularMechanism;
        if let Some((load, ..)) = system.motion.dynamics.uncovered_table() {
            outcome.status = Status::OutsideTable;
            outcome.guard = Some(Phases::guard_of_switch(&system.motion, load.first_switch));
        } else if let Some(load) = system.motion.dynamics.load_without_value() {
            outcome.status = Status::OutsideDomain;
            outcome.guard = Some(Phases::guard_of_switch(&system.motion, load.first_switch));
        }
        // The last sample may lie between two steps of the continuation.
        outcome.time = outcome.time.max(system.samples.last_taken());
    }
    outcome
}

/// Takes the samples after `t` up to `next`; false in a singular configuration.
fn sample_until(system: &mut System, t: f64, next: f64, q: &[f64], v: &[f64]) -> bool {
    let System { motion, samples, .. } = system;
    let (mut inner_q, mut inner_v) = (q.to_vec(), v.to_vec());
    while let Some(due) = samples.due.filter(|&due| due <= next) {
        let work = motion.work.clone();
        inner_q.copy_from_slice(q);
        inner_v.copy_from_slice(v);
        if !go_on(motion, t, due, &mut inner_q, &mut inner_v) {
            return false;
        }
        if motion.dynamics.is_at_change_point() {
            // The drives do not prescribe velocities there.
            inner_v.fill(f64::NAN);
        }
        samples.take_state(motion, due, &inner_q, &inner_v);
        motion.work = work;
    }
    true
}

/// Tracks the quantities of features from `t` to `to`; false in a singular configuration.
fn track_from(system: &mut System, t: f64, to: f64, q: &[f64], v: &[f64]) -> bool {
    system.tracking.track_to(to, &mut system.motion, &mut |motion, inner, inner_q, inner_v| {
        inner_q.copy_from_slice(q);
        inner_v.copy_from_slice(v);
        go_on(motion, t, inner, inner_q, inner_v)
    })
}

/// Moves a state from `t` to `to` and adds the work in between, if an output needs it; false in a
/// singular configuration, where a table ends, or where friction has two solutions or none.
fn go_on(motion: &mut Motion, mut t: f64, to: f64, q: &mut [f64], v: &mut [f64]) -> bool {
    // Forces jump where they switch, and the powers between two switches are smooth.
    while let Some(instant) = first_switch(motion, t, to, q, v) {
        if !go_on_smoothly(motion, t, instant, q, v) {
            return false;
        }
        t = instant;
    }
    go_on_smoothly(motion, t, to, q, v)
}

/// The first instant after `t` at which a force switches or friction turns, if it does up to `to` and the work is counted.
fn first_switch(motion: &mut Motion, t: f64, to: f64, q: &[f64], v: &[f64]) -> Option<f64> {
    let Mechanism { tree, .. } = motion.mechanism;
    if !motion.counts_work || tree.motion_loads.is_empty() && tree.dry_joints.is_empty() {
        return None;
    }
    let mut switches_until = |instant: f64| {
        let (mut q, mut v) = (q.to_vec(), v.to_vec());
        let (switches, tractions) = (motion.dynamics.switches.clone(), motion.dynamics.tractions().to_vec());
        follow(motion, t, instant, &mut q, &mut v);
        let switched = motion.dynamics.switches != switches || motion.dynamics.tractions() != tractions;
        motion.dynamics.switches = switches;
        motion.dynamics.set_tractions(&tractions);
        switched
    };
    let (mut low, mut high) = (t, to);
    if !switches_until(to) {
        return None;
    }
    while high - low > ROUNDING_OF_CHAIN * to.abs() {
        let middle = 0.5 * (low + high);
        if switches_until(middle) { high = middle } else { low = middle }
    }
    (high < to).then_some(high)
}

/// The same as [`go_on`] where no force switches.
fn go_on_smoothly(motion: &mut Motion, t: f64, to: f64, q: &mut [f64], v: &mut [f64]) -> bool {
    if motion.counts_work { work_on(motion, t, to, q, v, HALVINGS) } else { follow(motion, t, to, q, v) }
}

/// The same with the work, in pieces over which it equals the change of the energy.
fn work_on(motion: &mut Motion, t: f64, to: f64, q: &mut [f64], v: &mut [f64], halvings: u32) -> bool {
    let (start_q, start_v, before) = (q.to_vec(), v.to_vec(), motion.work.clone());
    motion.dynamics.move_to(t, q, v);
    let start = [motion.dynamics.kinetic_energy(), motion.dynamics.potential_energy()];
    let (mut reached, mut turnover) = (t, 0.0);
    for (place, weight) in GAUSS {
        let node = t + place * (to - t);
        if !follow(motion, reached, node, q, v) {
            return false;
        }
        reached = node;
        motion.add_work(node, q, v, weight * (to - t));
        let drives = 0..motion.mechanism.driven.len();
        let powers: f64 = drives.map(|drive| motion.dynamics.drive_power(drive).abs()).sum();
        turnover += weight * (to - t) * powers;
    }
    if !follow(motion, reached, to, q, v) {
        return false;
    }
    motion.dynamics.move_to(to, q, v);
    let end = [motion.dynamics.kinetic_energy(), motion.dynamics.potential_energy()];
    let work = motion.work.input - before.input - (motion.work.losses() - before.losses());
    let error = (end[0] + end[1] - start[0] - start[1] - work).abs();
    let size = start
        .iter()
        .chain(&end)
        .fold(turnover.max(motion.mechanism.energy_scale()), |size, energy| size.max(energy.abs()));
    // Not where the work is unknown.
    if halvings > 0 && error > INTEGRAL_ERROR * size {
        let middle = 0.5 * (t + to);
        q.copy_from_slice(&start_q);
        v.copy_from_slice(&start_v);
        motion.work = before;
        return work_on(motion, t, middle, q, v, halvings - 1)
            && work_on(motion, middle, to, q, v, halvings - 1);
    }
    true
}

/// Moves a state that closes the loops at `from` to one that closes them at `t`.
fn follow(motion: &mut Motion, from: f64, t: f64, q: &mut [f64], v: &mut [f64]) -> bool {
    for (q, v) in q.iter_mut().zip(&*v) {
        *q += v * (t - from);
    }
    let closed = motion.dynamics.project(t, q, v, &motion.mechanism.scales).is_some();
    motion.settle(t, q, v);
    let dynamics = &motion.dynamics;
    let has_loads = dynamics.uncovered_table().is_none() && dynamics.load_without_value().is_none();
    closed && has_loads && settle_directions(motion, t, q, v)
}
