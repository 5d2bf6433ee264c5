//! The motion of a run: the present state, at the end of a step or inside it, and the work done up to there.
//! Observers of the steps get it and nothing else.

use std::f64::consts::PI;

use crate::dynamics::Dynamics;
use crate::integrators::Status;
use crate::integrators::dense::DenseStep;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::NEWTON_STEPS;
use crate::numerics::turns::{with_turns, wrap};
use crate::run::outputs::Needs;
use crate::run::work::Work;
use crate::run::work::pace::{piece_of_work, uniform_piece};
use crate::tree::kinematics::FrameKind;

/// Error of corrected accelerations inside a step, relative to them: far below that of the polynomial. Half and twice change
/// nothing; 1e-8 takes 1.7 times the time where samples are close and a film changes much in a step, for the same forces.
const CORRECTED: f64 = 1e-6;

/// A mechanism in a state.
pub(crate) struct Motion<'a> {
    pub(crate) mechanism: &'a Mechanism,
    pub(crate) dynamics: Box<Dynamics<'a>>,
    /// The frames in states inside a step, so that those of `dynamics` stay at its end, where the next begins. The
    /// two are boxed because they are exchanged.
    pub(crate) inside: Box<Dynamics<'a>>,
    /// Position, velocity and acceleration.
    pub(crate) q: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) a: Vec<f64>,
    /// Memory of [`Motion::correct`].
    scratch: [Vec<f64>; 3],
    /// Work and losses up to the state.
    pub(crate) work: Work,
    /// Whether outputs or features need the work: it is then integrated over all steps, with the reactions.
    pub(crate) counts_work: bool,
    /// Whether the run goes on, asked with the time [s].
    pub(crate) monitor: &'a dyn Fn(f64) -> bool,
    /// How many pieces of steps may still be visited, besides one for each step.
    pieces_left: usize,
    /// Length of the pieces over which work is integrated [s], if all drives have constant speed.
    uniform_piece: Option<f64>,
}

impl<'a> Motion<'a> {
    /// The motion of a mechanism, which has no state yet.
    pub(crate) fn new(
        mechanism: &'a Mechanism,
        counts_work: bool,
        monitor: &'a dyn Fn(f64) -> bool,
        most_pieces: usize,
    ) -> Self {
        let d = mechanism.degrees_of_freedom();
        let dynamics = Box::new(Dynamics::new(mechanism));
        Self {
            mechanism,
            inside: dynamics.clone(),
            dynamics,
            q: vec![0.0; d],
            v: vec![0.0; d],
            a: vec![0.0; d],
            scratch: std::array::from_fn(|_| vec![0.0; d]),
            work: Work::new(mechanism.slots.len(), mechanism.dry_joints.len()),
            counts_work,
            monitor,
            pieces_left: most_pieces,
            uniform_piece: uniform_piece(mechanism),
        }
    }

    /// Asks whether the run goes on at an instant [s].
    ///
    /// # Errors
    /// Why it must end.
    pub(crate) fn goes_on(&self, t: f64) -> Result<(), Status> {
        if !(self.monitor)(t) {
            return Err(Status::Cancelled);
        }
        if self.pieces_left > 0 { Ok(()) } else { Err(Status::MaxSteps) }
    }

    /// The same before a further piece of a step, which is counted.
    pub(crate) fn visits_further_piece(&mut self, t: f64) -> bool {
        self.pieces_left = self.pieces_left.saturating_sub(1);
        self.goes_on(t).is_ok()
    }

    /// Sets the states of expressions and tables to those of a state of the mechanism.
    pub(crate) fn settle(&mut self, t: f64, q: &[f64], v: &[f64]) {
        if !self.mechanism.motion_loads.is_empty() {
            self.dynamics.move_to(t, q, v);
            self.dynamics.settle_switches();
        }
    }

    /// Adds the full turns to angles.
    pub(crate) fn with_turns(&self, q: &mut [f64]) {
        for (q, &column) in q.iter_mut().zip(&self.mechanism.free) {
            *q = with_turns(*q, self.dynamics.turns[column]);
        }
    }

    /// Subtracts full turns from angles to within half a turn, so that their rounding errors do not grow with
    /// the turns.
    pub(crate) fn wrap(&mut self, q: &mut [f64]) {
        let mechanism = self.mechanism;
        for (q, &column) in q.iter_mut().zip(&mechanism.free) {
            // The common case, prismatic joints included.
            if q.abs() <= PI {
                continue;
            }
            if let FrameKind::Revolute = mechanism.frames[column + 1].kind {
                let (angle, turns) = wrap(*q);
                *q = angle;
                self.dynamics.turns[column] += turns;
                // Expressions are evaluated inside the next step too.
                self.inside.turns[column] = self.dynamics.turns[column];
            }
        }
    }

    /// Sets the state to that at an instant of a step, projected onto the closures, which the dense output
    /// does not satisfy exactly.
    pub(crate) fn move_inside(&mut self, step: &DenseStep, t: f64) {
        let (mut q, mut v) = (std::mem::take(&mut self.q), std::mem::take(&mut self.v));
        self.state_inside(step, t, &mut q, &mut v);
        (self.q, self.v) = (q, v);
    }

    /// The state at an instant of a step, projected onto the closures.
    pub(crate) fn state_inside(&mut self, step: &DenseStep, t: f64, q: &mut [f64], v: &mut [f64]) {
        let theta = step.part_until(t);
        step.at(theta, q, v);
        self.correct(step, theta, q, v);
        if self.mechanism.has_loops() && self.dynamics.project(t, q, v, &self.mechanism.scales).is_none() {
            step.at(theta, q, v);
        }
    }

    /// Corrects the state of the polynomial of a step, if its states are corrected. The change x of the velocities solves
    ///
    /// ```text
    /// x = hγ (a(q + hγ x, v + x) - a of the polynomial)
    /// ```
    ///
    /// as a stage of the step would, by Newton's method with its matrix. Where forces follow the state steeply, the
    /// accelerations become those of the polynomial; elsewhere the change is as small as the error of the polynomial.
    pub(crate) fn correct(&mut self, step: &DenseStep, theta: f64, q: &mut [f64], v: &mut [f64]) {
        // At its ends a step has states of its own.
        if !step.is_corrected || theta <= 0.0 || theta >= 1.0 {
            return;
        }
        let mut a = std::mem::take(&mut self.a);
        let [mut expected, mut change, mut sum] = std::mem::take(&mut self.scratch);
        step.rates(theta, &mut expected);
        change.fill(0.0);
        sum.fill(0.0);
        let scales = &self.mechanism.scales;
        let diagonal = step.diagonal();
        let mut least = f64::INFINITY;
        for _ in 0..NEWTON_STEPS {
            let exists = self.dynamics.acceleration(step.instant(theta), q, v, &mut a);
            for k in 0..a.len() {
                a[k] -= expected[k] + sum[k] / diagonal;
            }
            let error = if exists { scales.relative_to_accelerations(&a, &expected) } else { f64::INFINITY };
            let is_better = error < least;
            if is_better {
                change.copy_from_slice(&a);
                step.solve(&mut change);
            } else {
                // What did not help is taken back.
                change.iter_mut().for_each(|change| *change = -*change);
            }
            for (k, change) in change.iter().enumerate() {
                q[k] += diagonal * change;
                v[k] += change;
                sum[k] += change;
            }
            if !is_better || error <= CORRECTED {
                break;
            }
            least = error;
        }
        self.a = a;
        self.scratch = [expected, change, sum];
    }

    /// Computes all that `needs` names for the state in `self.q`, `self.v`.
    pub(crate) fn place(&mut self, t: f64, needs: Needs) {
        if needs.acceleration {
            self.accelerate_at(t);
        } else {
            self.dynamics.move_to(t, &self.q, &self.v);
            if needs.contacts {
                self.dynamics.find_contacts();
            }
        }
        if needs.reactions {
            if self.dynamics.is_near_change_point() {
                self.dynamics.forget_closure_forces();
            }
            self.dynamics.find_reactions();
        }
    }

    /// Computes motion, accelerations and contacts in the state in `self.q`, `self.v`; NaN where there are none,
    /// or none that are known.
    pub(crate) fn accelerate_at(&mut self, t: f64) {
        let defined = self.dynamics.acceleration_and_contacts(t, &self.q, &self.v, &mut self.a);
        if !defined || self.dynamics.is_near_change_point() {
            self.a.fill(f64::NAN);
        }
        self.dynamics.accelerate(&self.a);
    }

    /// Length [s] of the piece of a step from `t` on, which has `most` [s] left, over which Gauss's quadrature integrates the powers of the
    /// drives to rounding.
    pub(crate) fn piece_of_work(&self, t: f64, most: f64) -> f64 {
        piece_of_work(self.mechanism, self.uniform_piece, t, most)
    }

    /// Adds the powers of a state over a time `dt` [s] to the work.
    pub(crate) fn add_work(&mut self, t: f64, q: &[f64], v: &[f64], dt: f64) {
        if !self.dynamics.acceleration_and_contacts(t, q, v, &mut self.a) {
            self.a.fill(f64::NAN);
        }
        self.dynamics.accelerate(&self.a);
        let input = if self.counts_work {
            self.dynamics.find_reactions();
            self.dynamics.input_power()
        } else {
            self.dynamics.balanced_power()
        };
        self.work.add(&self.dynamics, input, dt);
    }

    /// Adds the work from the start of a step to the instant `to` in it, in pieces that resolve the drives, by the given
    /// nodes and weights in each: the step resolves the free motion only, and a crank may turn many times in it.
    pub(crate) fn add_work_of(&mut self, nodes: &[(f64, f64)], step: &DenseStep, to: f64) {
        let (mut q, mut v) = (std::mem::take(&mut self.q), std::mem::take(&mut self.v));
        let mut from = step.t;
        while from < to {
            let next = (from + self.piece_of_work(from, to - from)).min(to);
            for &(place, weight) in nodes {
                let t = from + place * (next - from);
                let theta = step.part_until(t);
                step.at(theta, &mut q, &mut v);
                self.correct(step, theta, &mut q, &mut v);
                self.add_work(t, &q, &v, weight * (next - from));
            }
            from = next;
            if from < to && !self.visits_further_piece(step.t) {
                // This step is the last one.
                break;
            }
        }
        (self.q, self.v) = (q, v);
    }

    /// Moves to the end of a step, where the guards may have moved the frames already.
    pub(crate) fn move_to_end(&mut self, step: &DenseStep) {
        let (q, v) = step.end.split_at(step.end.len() / 2);
        if !self.dynamics.is_at(step.end_time().into(), q, v) {
            self.dynamics.move_to(step.end_time(), q, v);
        }
    }

    /// The frames of a state inside a step or at its end, with the phases of the contacts, whose laws may switch inside.
    pub(crate) fn guarded(&mut self, is_inside: bool) -> &mut Dynamics<'a> {
        if !is_inside {
            return &mut self.dynamics;
        }
        if !self.mechanism.motion_loads.is_empty() {
            self.inside.phases.copy_from_slice(&self.dynamics.phases);
        }
        &mut self.inside
    }

    /// Visits states inside the last step: the frames of its end stay where they are meanwhile, since the next step needs
    /// them.
    pub(crate) fn visit_inside(&mut self, visit: impl FnOnce(&mut Self)) {
        std::mem::swap(&mut self.dynamics, &mut self.inside);
        self.dynamics.copy_phases(&self.inside);
        // Those of the driven coordinates follow from the instant.
        for &column in &self.mechanism.free {
            self.dynamics.turns[column] = self.inside.turns[column];
        }
        visit(self);
        std::mem::swap(&mut self.dynamics, &mut self.inside);
    }
}
