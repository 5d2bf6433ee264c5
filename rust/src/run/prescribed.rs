//! Kinematic runs: in a mechanism without degrees of freedom the drives prescribe the motion; nothing is
//! integrated.

use crate::integrators::{Outcome, Stats, Status};
use crate::run::recorder::Recorder;
use crate::run::work::GAUSS;
use crate::run::work::pace::continued;

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
            let step = continued(self.motion.mechanism, t, last, LARGEST_ROTATION);
            let next = (t + step).min(self.motion.mechanism.next_break(t));
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
            self.motion.unwind(q);
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
            if self.motion.dynamics.is_at_change_point() {
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

    /// Moves a state that closes the loops at `from` to one that closes them at `t`.
    fn follow(&mut self, from: f64, t: f64, q: &mut [f64], v: &mut [f64]) -> bool {
        for (q, v) in q.iter_mut().zip(&*v) {
            *q += v * (t - from);
        }
        self.motion.dynamics.project(t, q, v, &self.motion.mechanism.scales).is_some()
    }
}
