//! Kinematic runs: in a mechanism without degrees of freedom the drives prescribe the motion; nothing is
//! integrated.

use crate::integrators::{Outcome, Stats, Status};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::{HALVINGS, INTEGRAL_ERROR, ROUNDING_OF_CHAIN};
use crate::run::contacts::phases::Phases;
use crate::run::motion::Motion;
use crate::run::path::{Halt, Path};
use crate::run::system::System;
use crate::run::work::GAUSS;
use crate::run::work::pace::continued;

/// Largest rotation of a drive [rad] in one step of the path: the pieces over which features are integrated. Half and twice
/// change samples by rounding (142 of 150 scenes).
const LARGEST_ROTATION: f64 = 0.05;

/// The motion of a mechanism that its drives prescribe completely, from an instant [s] to `end`;
/// nothing is integrated.
///
/// The steps of the path depend on the mechanism and its drives alone. Samples and features are found inside them, so that
/// the choice of the samples changes neither the motion nor where it ends.
pub(crate) fn follow_drives(
    system: &mut System,
    from: f64,
    end: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> Outcome {
    let mut outcome = Outcome { status: Status::Done, time: from, guard: None, stats: Stats::default() };
    let Err(halt) = follow_path(system, &mut outcome, end, q, v) else { return outcome };
    outcome.status = match halt {
        Halt::Singular | Halt::Load => Status::SingularMechanism,
        Halt::Limit => Status::MaxSteps,
        Halt::Cancelled => Status::Cancelled,
    };
    if halt == Halt::Load {
        let dynamics = &system.motion.dynamics;
        let table = dynamics.uncovered_table().map(|(load, ..)| (Status::OutsideTable, load));
        let of_domain = || Some((Status::OutsideDomain, dynamics.load_without_value()?));
        if let Some((status, load)) = table.or_else(of_domain) {
            outcome.status = status;
            outcome.guard = Some(Phases::guard_of_switch(&system.motion, load.first_switch));
        }
    }
    // The last sample may lie between two steps of the path.
    outcome.time = outcome.time.max(system.samples.last_taken());
    outcome
}

/// Follows the path to the end; an error where it stops before.
fn follow_path(
    system: &mut System,
    outcome: &mut Outcome,
    end: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> Result<(), Halt> {
    let limits = system.limits();
    let mut path = Path::new(&mut system.motion, outcome.time, q, v).ok_or(Halt::Singular)?;
    let (mut last, mut bound, mut longest) = (f64::NAN, limits.max_step, 0.0_f64);
    let mut pieces = 0;
    while outcome.time < end {
        let t = outcome.time;
        let used = outcome.stats.steps + outcome.stats.rejected + pieces;
        let left = limits.max_steps.checked_sub(used + 1).ok_or(Halt::Limit)?;
        let step = continued(system.motion.mechanism, t, last, LARGEST_ROTATION).min(bound);
        let next = (t + step).min(system.motion.mechanism.next_break(t)).min(end);
        longest = longest.max(next - t);
        let growth = match path.step_to(&mut system.motion, next) {
            Ok(growth) => growth,
            Err(halt) => {
                outcome.stats.rejected += 1;
                bound = 0.5 * (next - t);
                if bound <= ROUNDING_OF_CHAIN * longest.max(t.abs()) {
                    return Err(halt);
                }
                continue;
            }
        };
        let mut work = WorkOf { path: &path, left };
        sample_until(system, &mut work, next)?;
        track_until(system, &mut work, next)?;
        work.add(&mut system.motion, t, next)?;
        pieces += left - work.left;
        let (end_q, end_v) = path.end();
        q.copy_from_slice(end_q);
        v.copy_from_slice(end_v);
        (outcome.time, last, bound) = (next, step, limits.max_step.min(growth * (next - t)));
        outcome.stats.steps += 1;
        system.motion.goes_on(next).map_err(Halt::of)?;
        if next < end {
            path.go_on(|q| system.motion.wrap(q));
        }
    }
    Ok(())
}

/// Takes the samples that are due in a step up to an instant.
fn sample_until(system: &mut System, work: &mut WorkOf, until: f64) -> Result<(), Halt> {
    let System { motion, samples, .. } = system;
    let (mut q, mut v) = (vec![0.0; motion.q.len()], vec![0.0; motion.q.len()]);
    while let Some(due) = samples.due.filter(|&due| due <= until) {
        let before = motion.work.clone();
        work.add(motion, work.path.from(), due)?;
        work.path.state_at(motion, due, &mut q, &mut v)?;
        if motion.dynamics.is_at_change_point() {
            // The drives do not prescribe velocities there.
            v.fill(f64::NAN);
        }
        samples.take_state(motion, due, &q, &v);
        motion.work = before;
        motion.goes_on(due).map_err(Halt::of)?;
    }
    Ok(())
}

/// Tracks the quantities of features through a step up to an instant.
fn track_until(system: &mut System, work: &mut WorkOf, until: f64) -> Result<(), Halt> {
    let mut halt = None;
    let is_tracked = system.tracking.track_to(until, &mut system.motion, &mut |motion, t, q, v| {
        let from = work.path.from();
        let there = work.add(motion, from, t).and_then(|()| work.path.state_at(motion, t, q, v));
        halt = there.err().or(halt);
        there.is_ok()
    });
    if is_tracked { Ok(()) } else { Err(halt.unwrap_or(Halt::Singular)) }
}

/// The work inside a step of the path.
struct WorkOf<'p> {
    path: &'p Path,
    /// Pieces that its integration may still take beside the first.
    left: usize,
}

impl WorkOf<'_> {
    /// Adds the work from an instant to another, if an output needs it.
    fn add(&mut self, motion: &mut Motion, mut t: f64, to: f64) -> Result<(), Halt> {
        if !motion.counts_work {
            return Ok(());
        }
        // Forces jump where they switch, and the powers between two switches are smooth.
        while let Some(instant) = first_switch(motion, self.path, t, to)? {
            self.add_smooth(motion, [t, instant], HALVINGS)?;
            self.count(motion, t)?;
            t = instant;
        }
        self.add_smooth(motion, [t, to], HALVINGS)
    }

    /// Counts a piece that begins at an instant.
    fn count(&mut self, motion: &Motion, t: f64) -> Result<(), Halt> {
        self.left = self.left.checked_sub(1).ok_or(Halt::Limit)?;
        motion.goes_on(t).map_err(Halt::of)
    }

    /// Adds the work from an instant to another between which no force switches, in pieces over which it equals the change of
    /// the energy.
    fn add_smooth(&mut self, motion: &mut Motion, [t, to]: [f64; 2], halvings: u32) -> Result<(), Halt> {
        let path = self.path;
        let (mut q, mut v) = (vec![0.0; motion.q.len()], vec![0.0; motion.q.len()]);
        let before = motion.work.clone();
        let mut energies_at = |motion: &mut Motion, t: f64| {
            path.state_at(motion, t, &mut q, &mut v)?;
            motion.dynamics.move_to(t, &q, &v);
            Ok([motion.dynamics.kinetic_energy(), motion.dynamics.potential_energy()])
        };
        let start = energies_at(motion, t)?;
        let end = energies_at(motion, to)?;
        let mut turnover = 0.0;
        for (place, weight) in GAUSS {
            let node = t + place * (to - t);
            path.state_at(motion, node, &mut q, &mut v)?;
            motion.add_work(node, &q, &v, weight * (to - t));
            let drives = 0..motion.mechanism.driven.len();
            let powers: f64 = drives.map(|drive| motion.dynamics.drive_power(drive).abs()).sum();
            turnover += weight * (to - t) * powers;
        }
        let work = motion.work.input - before.input - (motion.work.losses() - before.losses());
        let error = (end[0] + end[1] - start[0] - start[1] - work).abs();
        let size = start
            .iter()
            .chain(&end)
            .fold(turnover.max(motion.mechanism.energy_scale()), |size, energy| size.max(energy.abs()));
        // Not where the work is unknown.
        if halvings > 0 && error > INTEGRAL_ERROR * size {
            let middle = 0.5 * (t + to);
            motion.work = before;
            self.count(motion, t)?;
            self.add_smooth(motion, [t, middle], halvings - 1)?;
            return self.add_smooth(motion, [middle, to], halvings - 1);
        }
        Ok(())
    }
}

/// The first instant after `t` at which a force switches or friction turns, if it does up to `to`.
fn first_switch(motion: &mut Motion, path: &Path, t: f64, to: f64) -> Result<Option<f64>, Halt> {
    let Mechanism { tree, .. } = motion.mechanism;
    if tree.motion_loads.is_empty() && tree.dry_joints.is_empty() {
        return Ok(None);
    }
    let (mut q, mut v) = (vec![0.0; motion.q.len()], vec![0.0; motion.q.len()]);
    path.state_at(motion, t, &mut q, &mut v)?;
    let (switches, phases) = (motion.dynamics.switches.clone(), motion.dynamics.joint_phases().to_vec());
    let mut switches_until = |instant: f64| {
        path.state_at(motion, instant, &mut q, &mut v)?;
        Ok(motion.dynamics.switches != switches || motion.dynamics.joint_phases() != phases)
    };
    let (mut low, mut high) = (t, to);
    if !switches_until(to)? {
        return Ok(None);
    }
    while high - low > ROUNDING_OF_CHAIN * to.abs() {
        let middle = 0.5 * (low + high);
        if switches_until(middle)? { high = middle } else { low = middle }
    }
    Ok((high < to).then_some(high))
}
