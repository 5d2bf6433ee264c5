//! A mechanism without a degree of freedom: its drives prescribe the motion, nothing is integrated.

use crate::integrators::{Checkpoint, HybridSystem, Outcome, Stats, Status};
use crate::recorder::Recorder;
use crate::work::GAUSS;

/// Turn of a drive [rad] over which the kinematic solution is continued at once: the guess is
/// then off by a few thousandths, far from any other branch.
const LARGEST_TURN: f64 = 0.05;
impl Recorder<'_> {
    /// The motion of a mechanism that its drives prescribe completely, from `t` to `end`: every sample
    /// is solved for by itself, by continuation from the one before; nothing is integrated.
    pub(crate) fn follow_drives(&mut self, t: f64, end: f64, q: &mut [f64], v: &mut [f64]) -> Outcome {
        let mut outcome =
            Outcome { status: Status::Done, time: t, guard: None, stats: Stats::default(), checkpoint: None };
        while outcome.time < end {
            let due = self.next_due().unwrap_or(end);
            let next = self.continued(outcome.time, due);
            let start = outcome.time;
            let nodes = if self.needs.work { &GAUSS[..] } else { &[] };
            for &(place, weight) in nodes {
                let node = start + place * (next - start);
                if !self.follow(outcome.time, node, q, v) {
                    outcome.status = Status::SingularMechanism;
                    return outcome;
                }
                outcome.time = node;
                self.add_work(node, q, v, weight * (next - start));
            }
            if !self.follow(outcome.time, next, q, v) {
                outcome.status = Status::SingularMechanism;
                return outcome;
            }
            outcome.time = next;
            outcome.stats.steps += 1;
            self.unwind(q);
            if !(self.monitor)(next) {
                outcome.status = Status::Cancelled;
                return outcome;
            }
            if self.next_due() == Some(next) {
                self.sample_state(next, q, v);
            }
        }
        self.keep();
        outcome.checkpoint = Some(Checkpoint {
            time: outcome.time,
            q: q.to_vec(),
            v: v.to_vec(),
            step: f64::NAN,
            last: [1.0, 0.0],
            steps_since_restart: 0,
            memory: None,
        });
        outcome
    }

    /// How far from `t` towards `end` the drives may go at once: until one has turned by
    /// [`LARGEST_TURN`], or slid by as much of the size of the mechanism.
    fn continued(&self, t: f64, end: f64) -> f64 {
        let mechanism = self.dynamics.mechanism;
        let mut next = end;
        for driven in &mechanism.driven {
            let largest = LARGEST_TURN * if driven.turns { 1.0 } else { mechanism.scales.length };
            while next > t {
                let pieces = [0.25, 0.5, 0.75, 1.0].map(|part| driven.motion.at(t + part * (next - t))[0]);
                let start = driven.motion.at(t)[0];
                let moved = pieces.iter().map(|position| (position - start).abs()).fold(0.0, f64::max);
                if moved <= largest {
                    break;
                }
                let shorter = t + (next - t) * (0.9 * largest / moved).max(0.1);
                if shorter >= next {
                    break;
                }
                next = shorter;
            }
        }
        if next > t { next } else { end }
    }

    /// Moves a state that closes the loops at `from` to one that closes them at `t`.
    fn follow(&mut self, from: f64, t: f64, q: &mut [f64], v: &mut [f64]) -> bool {
        for (q, v) in q.iter_mut().zip(&*v) {
            *q += v * (t - from);
        }
        self.dynamics.project(t, q, v, &self.dynamics.mechanism.scales.levers).is_some()
    }
}
