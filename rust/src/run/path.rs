//! The path of a mechanism that its drives prescribe: a continuation from state to state, none of which can lie on another
//! way to close the loops.

use crate::dynamics::FirstOrder;
use crate::integrators::Status;
use crate::run::contacts::dry_joints::settle_directions;
use crate::run::motion::Motion;

/// Largest part of the closures that may change in a step: by Kantorovich's theorem Newton's method then finds the end of
/// the path that begins in a state, and no other.
pub(crate) const LARGEST_CHANGE: f64 = 0.5;

/// Why a state is not reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Halt {
    /// The loops cannot be closed, their closures change too much on the way, or friction has two solutions or none.
    Singular,
    /// A table ends before it, or a function in a formula has no value.
    Load,
    /// The allowed steps and pieces are used up.
    Limit,
    /// The run was cancelled.
    Cancelled,
}

impl Halt {
    /// The same as the end of a run that [`Motion::goes_on`] gives.
    pub(crate) fn of(status: Status) -> Self {
        if status == Status::MaxSteps { Halt::Limit } else { Halt::Cancelled }
    }
}

/// A state of the path.
#[derive(Clone, Debug)]
struct Station {
    t: f64,
    q: Vec<f64>,
    v: Vec<f64>,
    closures: FirstOrder,
    /// Whether it is within the reach of a change point over which the motion passes: the closures do not act there.
    passes: bool,
}

/// A step of the path.
pub(crate) struct Path {
    start: Station,
    end: Station,
    /// A state between them, and the rows of its closures.
    middle: (Vec<f64>, Vec<f64>),
}

impl Path {
    /// A path that begins in a state; none where there are no accelerations.
    pub(crate) fn new(motion: &mut Motion, t: f64, q: &[f64], v: &[f64]) -> Option<Self> {
        let station =
            Station { t, q: q.to_vec(), v: v.to_vec(), closures: FirstOrder::default(), passes: false };
        let mut path = Self { start: station.clone(), end: station, middle: (q.to_vec(), Vec::new()) };
        if motion.mechanism.has_loops() {
            if !motion.dynamics.acceleration(t, q, v, &mut motion.a) {
                return None;
            }
            path.keep_end(motion);
            path.start.clone_from(&path.end);
        }
        Some(path)
    }

    /// The instant at which the step begins [s].
    pub(crate) fn from(&self) -> f64 {
        self.start.t
    }

    /// The state in which the step ends.
    pub(crate) fn end(&self) -> (&[f64], &[f64]) {
        (&self.end.q, &self.end.v)
    }

    /// Begins the next step where the last one ended, in a state whose angles may have fewer turns.
    pub(crate) fn go_on(&mut self, wrap: impl FnOnce(&mut [f64])) {
        std::mem::swap(&mut self.start, &mut self.end);
        wrap(&mut self.start.q);
    }

    /// Finds the state at the end `to` of a step. How long the next one may be, relative to this one.
    pub(crate) fn step_to(&mut self, motion: &mut Motion, to: f64) -> Result<f64, Halt> {
        let Self { start, end, .. } = self;
        end.t = to;
        end.v.copy_from_slice(&start.v);
        for ((q, from), v) in end.q.iter_mut().zip(&start.q).zip(&start.v) {
            *q = from + v * (to - start.t);
        }
        let scales = &motion.mechanism.scales;
        if motion.dynamics.project(to, &mut end.q, &mut end.v, scales).is_none() {
            return settled(motion, to, &end.q, &end.v).and(Err(Halt::Singular));
        }
        let mut growth = f64::INFINITY;
        if motion.mechanism.has_loops() {
            self.keep_end(motion);
            if !self.start.passes {
                let [from_start, from_end] = self.change(motion);
                let change = from_start.min(from_end);
                if change > LARGEST_CHANGE {
                    return Err(Halt::Singular);
                }
                // The closures come nearer to a dead center in proportion to the time.
                let left = if from_start < from_end { 1.0 - from_start } else { 1.0 };
                growth = left * LARGEST_CHANGE / change;
            }
        }
        settled(motion, to, &self.end.q, &self.end.v).map(|()| growth)
    }

    fn keep_end(&mut self, motion: &mut Motion) {
        let Self { end, .. } = self;
        let scales = &motion.mechanism.scales;
        motion.dynamics.keep_closures(&scales.levers, &mut end.closures);
        end.passes = motion.dynamics.passes_change_point(&end.v, scales);
    }

    /// Part of the closures that changes in the step, as seen from its start and from its end.
    fn change(&mut self, motion: &mut Motion) -> [f64; 2] {
        let Self { start, end, middle: (q, rows) } = self;
        for ((q, from), to) in q.iter_mut().zip(&start.q).zip(&end.q) {
            *q = 0.5 * (from + to);
        }
        motion.dynamics.write_closures(0.5 * (start.t + end.t), q, &end.v, rows);
        start.closures.change(rows, &end.closures, end.q.len())
    }

    /// Finds the state at an instant in the step, by Newton's method from the cubic through its ends.
    pub(crate) fn state_at(
        &self,
        motion: &mut Motion,
        t: f64,
        q: &mut [f64],
        v: &mut [f64],
    ) -> Result<(), Halt> {
        let Self { start, end, .. } = self;
        let h = end.t - start.t;
        let s = if h > 0.0 { (t - start.t) / h } else { 1.0 };
        for k in 0..q.len() {
            let (rise, from, to) = (end.q[k] - start.q[k], h * start.v[k], h * end.v[k]);
            let (bend, twist) = (3.0 * rise - 2.0 * from - to, from + to - 2.0 * rise);
            q[k] = start.q[k] + s * (from + s * (bend + s * twist));
            v[k] = start.v[k] + s * (end.v[k] - start.v[k]);
        }
        if motion.dynamics.project(t, q, v, &motion.mechanism.scales).is_none() {
            return settled(motion, t, q, v).and(Err(Halt::Singular));
        }
        settled(motion, t, q, v)
    }
}

/// Sets the states of functions and the directions of friction to those of a state, which may not exist.
fn settled(motion: &mut Motion, t: f64, q: &[f64], v: &[f64]) -> Result<(), Halt> {
    motion.settle(t, q, v);
    if motion.dynamics.uncovered_table().is_some() || motion.dynamics.load_without_value().is_some() {
        return Err(Halt::Load);
    }
    if settle_directions(motion, t, q, v) { Ok(()) } else { Err(Halt::Singular) }
}
