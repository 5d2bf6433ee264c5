//! Kinematic runs: in a mechanism without degrees of freedom the drives prescribe the motion; nothing is
//! integrated.

use crate::integrators::{Outcome, Stats, Status};
use crate::mechanism::compiled::Mechanism;
use crate::run::recorder::Recorder;
use crate::run::work::GAUSS;
use crate::run::work::balance::WORK_ROTATION;
use crate::tree::elements::DrivenCoordinate;

/// Largest rotation of a drive [rad] in one step of the continuation of the kinematic solution. The error of
/// the initial guess is then a few thousandths of the size of the mechanism, far from any other branch.
const LARGEST_ROTATION: f64 = 0.05;

impl Recorder<'_> {
    /// The motion of a mechanism that its drives prescribe completely, from an instant [s] to `end`;
    /// nothing is integrated.
    ///
    /// The steps of the continuation depend on the drives alone. Samples and the end are solved for from the
    /// configuration before them, so that the choice of the samples does not change the motion.
    pub(crate) fn follow_drives(&mut self, from: f64, end: f64, q: &mut [f64], v: &mut [f64]) -> Outcome {
        let mut outcome = Outcome { status: Status::Done, time: from, guard: None, stats: Stats::default() };
        let mut last = f64::NAN;
        let followed = loop {
            let t = outcome.time;
            if outcome.stats.steps >= self.limits().max_steps {
                outcome.status = Status::MaxSteps;
                break true;
            }
            let step = self.continued(t, last, LARGEST_ROTATION);
            let next = (t + step).min(self.mechanism.next_break(t));
            let next = next.min(end);
            if !self.sample_until(t, next, q, v)
                || !self.track_from(t, next, q, v)
                || !self.go_on(t, next, q, v)
            {
                break false;
            }
            (outcome.time, last) = (next, step);
            outcome.stats.steps += 1;
            if !(self.monitor)(next) {
                outcome.status = Status::Cancelled;
                break true;
            }
            if next >= end {
                break true;
            }
            self.unwind(q);
        };
        if !followed {
            outcome.status = Status::SingularMechanism;
            // The last sample may lie between two steps of the continuation.
            outcome.time = outcome.time.max(self.samples.last_taken());
        }
        outcome
    }

    /// Takes the samples after `t` up to `next`; false in a singular configuration.
    fn sample_until(&mut self, t: f64, next: f64, q: &[f64], v: &[f64]) -> bool {
        let (mut inner_q, mut inner_v) = (q.to_vec(), v.to_vec());
        while let Some(due) = self.samples.next_due().filter(|&due| due <= next) {
            let work = self.work.clone();
            inner_q.copy_from_slice(q);
            inner_v.copy_from_slice(v);
            if !self.go_on(t, due, &mut inner_q, &mut inner_v) {
                return false;
            }
            if self.dynamics.is_at_change_point() {
                // The drives do not prescribe velocities there.
                inner_v.fill(f64::NAN);
            }
            self.sample_state(due, &inner_q, &inner_v);
            self.work = work;
        }
        true
    }

    /// Tracks the quantities of features from `t` to `to`; false in a singular configuration.
    fn track_from(&mut self, t: f64, to: f64, q: &[f64], v: &[f64]) -> bool {
        self.track_to(to, &mut |recorder, inner, inner_q, inner_v| {
            inner_q.copy_from_slice(q);
            inner_v.copy_from_slice(v);
            recorder.go_on(t, inner, inner_q, inner_v)
        })
    }

    /// Moves a state from `t` to `to` and adds the work in between, if an output needs it; false in a
    /// singular configuration.
    fn go_on(&mut self, t: f64, to: f64, q: &mut [f64], v: &mut [f64]) -> bool {
        let nodes = if self.needs.work { &GAUSS[..] } else { &[] };
        let mut reached = t;
        for &(place, weight) in nodes {
            let node = t + place * (to - t);
            if !self.follow(reached, node, q, v) {
                return false;
            }
            reached = node;
            self.add_work(node, q, v, weight * (to - t));
        }
        self.follow(reached, to, q, v)
    }

    /// Length [s] of the next step after one of length `last` (NaN for none): until a drive
    /// has rotated by `largest_rotation` [rad], or slid by the same fraction of the size of the mechanism.
    fn continued(&self, t: f64, last: f64, largest_rotation: f64) -> f64 {
        let mechanism = self.mechanism;
        let mut step = if last.is_nan() {
            first_rotation(mechanism, largest_rotation)
        } else {
            // Limited growth: a step over a whole oscillation would show no displacement.
            slowest_pace(mechanism).min(2.0 * last)
        };
        for driven in &mechanism.driven {
            let largest = largest_motion(mechanism, driven, largest_rotation);
            let start = driven.motion.at(t)[0];
            while step.is_finite() && t + step > t {
                let ahead = [0.25, 0.5, 0.75, 1.0].map(|part| driven.motion.at(t + part * step)[0]);
                let moved = ahead.iter().map(|position| (position - start).abs()).fold(0.0, f64::max);
                if moved <= largest {
                    break;
                }
                step *= (0.9 * largest / moved).max(0.1);
            }
        }
        resolved(t, step)
    }

    /// Length [s] of the piece of a step from `t` on over which Gauss's quadrature integrates the powers of the
    /// drives to rounding.
    pub(crate) fn piece_of_work(&self, t: f64) -> f64 {
        match self.uniform_piece {
            Some(piece) => resolved(t, piece),
            None => self.continued(t, f64::NAN, WORK_ROTATION),
        }
    }

    /// Moves a state that closes the loops at `from` to one that closes them at `t`.
    fn follow(&mut self, from: f64, t: f64, q: &mut [f64], v: &mut [f64]) -> bool {
        for (q, v) in q.iter_mut().zip(&*v) {
            *q += v * (t - from);
        }
        self.dynamics.project(t, q, v, &self.mechanism.scales).is_some()
    }
}

/// Length [s] of the pieces in which drives at constant speed are resolved, the same at all times; `None` if a
/// drive changes its speed.
pub(crate) fn uniform_piece(mechanism: &Mechanism) -> Option<f64> {
    let is_uniform = mechanism.driven.iter().all(|driven| driven.motion.is_linear());
    is_uniform.then(|| first_rotation(mechanism, WORK_ROTATION))
}

/// Time [s] from zero until a drive has rotated by `largest_rotation` [rad], or slid likewise.
fn first_rotation(mechanism: &Mechanism, largest_rotation: f64) -> f64 {
    let time = |driven: &DrivenCoordinate| {
        driven.motion.time_to_move(largest_motion(mechanism, driven, largest_rotation))
    };
    mechanism.driven.iter().map(time).fold(slowest_pace(mechanism), f64::min)
}

/// Largest motion of a drive in one step: an angle [rad], or the same fraction of the size of the mechanism [m].
fn largest_motion(mechanism: &Mechanism, driven: &DrivenCoordinate, largest_rotation: f64) -> f64 {
    largest_rotation * if driven.is_angle { 1.0 } else { mechanism.scales.length }
}

/// Longest step [s] for which no function of time in the scene is too fast.
fn slowest_pace(mechanism: &Mechanism) -> f64 {
    mechanism.time_functions().map(|(_, function)| function.pace()).fold(f64::INFINITY, f64::min)
}

/// The step [s]; one unit in the last place of the time where the motion is too fast for its resolution.
fn resolved(t: f64, step: f64) -> f64 {
    if t + step > t { step } else { t.next_up() - t }
}
