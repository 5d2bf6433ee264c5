//! The loop over the steps: step-size control, projection, acceptance.

use crate::integrators::events::{EventFinder, Guard};
use crate::integrators::{
    HybridSystem, Limits, NextLimits, Outcome, Projection, StateAt, Stats, Status, Stepper,
};
use crate::numerics::accuracy::{HALF_DIGITS, ROUNDING_OF_CHAIN};
use crate::numerics::logarithm::power;

/// Parts of a step at which its polynomial is judged: at one of them the error of a method may vanish (in the middle that
/// of `rodas4` does for a damper: forces were off by 70 %; at a quarter that of `rodas5p` for a film: by 4 %).
const INSIDE: [f64; 2] = [0.25, 0.5];
/// Chebyshev's points of a step, with the weights of the difference between a value in its middle and the cubic through the
/// other four. They have no common measure: a load of any period is not the same at all of them.
const POINTS: [(f64, f64); 5] = [
    (0.0, 0.5),
    (0.5 - 0.25 * std::f64::consts::SQRT_2, -1.0),
    (0.5, 1.0),
    (0.5 + 0.25 * std::f64::consts::SQRT_2, -1.0),
    (1.0, 0.5),
];
/// Step-size factor of an attempt that failed (a number that is not finite, a singular W).
/// Half, twice: work +1, 0 % (42 of 44 runs).
const FAILURE_FACTOR: f64 = 0.1;
/// Safety factor of the step-size controller, as in Hairer's RODAS. A step shrinks at most to a sixth and
/// grows at most fivefold; in RODAS it shrinks to a fifth and grows sixfold.
/// 0.8 and 0.95: work +4, -1 %, errors times 0.75, 1.2 (355 of 364 runs).
const SAFETY: f64 = 0.9;
const SMALLEST_FACTOR: f64 = 1.0 / 6.0;
/// Half, twice: work +4, -3 % (100 of 109 runs).
const LARGEST_FACTOR: f64 = 5.0;
/// Least growth of the steps of a multistep method. 1.0 to 1.5 need the same evaluations; 1.2 rejects fewer
/// steps than 1.0. 1 and 1.4: work -3, +2 %, same errors (377 of 393 runs).
const LEAST_GROWTH: f64 = 1.2;
/// Accepted steps after a restart whose successors are chosen from the present error alone: the predictive
/// controller would compare with a step of the previous phase. Half, twice: work -1, 0 % (22 of 81 runs).
const UNPREDICTED_STEPS: usize = 2;
/// Error relative to the tolerance below which a step gives no prediction for the next one, except that it may be longer.
/// Half, twice: work 0, +1 % (11 of 118 runs).
const LEAST_ERROR: f64 = 1e-8;
/// Largest [`DenseStep::damping`] of a step across a kink of the accelerations. With more damping, both the
/// step and its error estimate follow the Jacobian from before the kink, and neither notices that the
/// acceleration has changed. Tuned on contacts that change from sticking to sliding, the slider-cranks of
/// `benchmarks/stiffness.rs`: 10 saves up to a quarter of the work of a Rosenbrock method for errors of 1e-2
/// and 1e-3, 100 saves nothing, 3 and 1 cost up to 9 and 17 %. Half, twice: the same work (10 of 78 runs).
const LARGEST_DAMPING: f64 = 10.0;

/// The integration in progress.
pub(super) struct Run<'a> {
    pub(super) system: &'a mut dyn HybridSystem,
    pub(super) method: &'a mut dyn Stepper,
    pub(super) finder: EventFinder,
    pub(super) limits: Limits,
    pub(super) stats: Stats,
    pub(super) t: f64,
    /// End of the run, and the instant that the present step must not pass: the end or a break before it [s].
    end: f64,
    stop: f64,
    /// Length of the step that ends there.
    longest: f64,
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    position_tolerance: Vec<f64>,
    velocity_tolerance: Vec<f64>,
    pub(super) start_guards: Vec<Guard>,
    pub(super) end_guards: Vec<Guard>,
    /// Error and length of the last accepted step, used by the predictive controller.
    last_error: f64,
    last_step: f64,
    steps_since_restart: usize,
    /// The present step was not accepted at the first attempt.
    was_rejected: bool,
    /// Events in a row that did not advance the time.
    pub(super) standing_events: usize,
    /// The dense output of the present step is complete.
    pub(super) dense: bool,
    /// Errors of the present step, once found.
    pub(super) errors: Option<[f64; 2]>,
    /// The present step ends beyond a kink.
    pub(super) beyond_kink: bool,
    /// [`HybridSystem::velocity_refinement`] at the start of the step, and its maximum over the step.
    pub(super) start_refinement: f64,
    pub(super) velocity_refinement: f64,
    /// [`HybridSystem::caution`] in the present step.
    caution: f64,
    /// Why the last attempt was rejected: the status of the run if no shorter step is accepted.
    refusal: Status,
    /// End of the present step after its projection, its instant, and the result of the projection.
    next_q: Vec<f64>,
    next_v: Vec<f64>,
    next_t: f64,
    projection: Projection,
    /// State and guards inside a step.
    pub(super) inner_q: Vec<f64>,
    pub(super) inner_v: Vec<f64>,
    /// Memory of [`Run::error_at`]: the error of the accelerations, and those of the polynomial.
    inner_a: [Vec<f64>; 2],
    pub(super) inner_guards: Vec<Guard>,
}

/// Integrates with a method from `t` to `end`; `q` and `v` are the start and become the end.
pub fn integrate(
    system: &mut dyn HybridSystem,
    method: &mut dyn Stepper,
    limits: Limits,
    t: f64,
    end: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> Outcome {
    let d = system.dimension();
    let guards = system.guard_count();
    let mut run = Run {
        system,
        method,
        finder: EventFinder::new(guards, d),
        limits,
        stats: Stats::default(),
        t,
        end,
        stop: end,
        longest: 0.0,
        q: q.to_vec(),
        v: v.to_vec(),
        position_tolerance: vec![0.0; d],
        velocity_tolerance: vec![0.0; d],
        start_guards: vec![Guard::INACTIVE; guards],
        end_guards: vec![Guard::INACTIVE; guards],
        last_error: 1.0,
        last_step: 0.0,
        steps_since_restart: 0,
        was_rejected: false,
        standing_events: 0,
        dense: false,
        errors: None,
        beyond_kink: false,
        start_refinement: 1.0,
        velocity_refinement: 1.0,
        caution: 1.0,
        refusal: Status::StepUnderflow,
        next_q: vec![0.0; d],
        next_v: vec![0.0; d],
        next_t: t,
        projection: Projection::Unneeded,
        inner_q: vec![0.0; d],
        inner_v: vec![0.0; d],
        inner_a: [vec![0.0; d], vec![0.0; d]],
        inner_guards: vec![Guard::INACTIVE; guards],
    };
    let (status, guard) = match run.advance() {
        Ok(()) => (Status::Done, None),
        Err(failure) => failure,
    };
    q.copy_from_slice(&run.q);
    v.copy_from_slice(&run.v);
    Outcome { status, time: run.t, guard, stats: run.stats }
}

/// Why an integration cannot go on, and at which guard.
pub(super) type Failure = (Status, Option<usize>);

impl Run<'_> {
    fn advance(&mut self) -> Result<(), Failure> {
        // By default a thousandth of the run; if that is too long, a few rejections shorten it.
        let mut h = self.limits.first_step.unwrap_or(1e-3 * (self.end - self.t)).max(self.shortest());
        self.restart();
        while self.t < self.end {
            if !self.method.begin(self.system, StateAt { t: self.t, q: &self.q, v: &self.v }, &mut self.stats)
            {
                let finite = self.q.iter().chain(&self.v).all(|y| y.is_finite());
                return Err((if finite { Status::SingularMechanism } else { Status::NonFinite }, None));
            }
            self.start_refinement = self.system.velocity_refinement();
            self.caution = self.system.caution();
            h = h.min(self.system.step_bound()).min(self.limits.max_step);
            self.stop = self.end.min(self.system.next_break());
            self.longest = self.rounded(self.stop - self.t);
            let (taken, error, event) = self.attempt_to_event(h)?;
            let stopped = self.next_t >= self.stop;
            self.accept(event.is_some() || stopped)?;
            // A break tells nothing of the steps beyond it, however short the one that ends there.
            let least = match (stopped, self.was_rejected) {
                (true, false) => h,
                (true, true) => self.shortest(),
                (false, _) => 0.0,
            };
            match event {
                Some(index) => {
                    let bound = self.change_phase(index)?;
                    // Repeated changes of phase at one instant: the step is too long in either phase.
                    let repeated = self.standing_events > self.start_guards.len();
                    let first = if repeated {
                        FAILURE_FACTOR * taken
                    } else {
                        self.system.first_step(taken.max(least))
                    };
                    h = bound.min(first);
                }
                None => {
                    let at = StateAt { t: self.t, q: &self.q, v: &self.v };
                    let limits = self.method.next_limits(self.system, at, &mut self.stats);
                    h = self.next_step(taken, error, &limits).max(least);
                    if let Some(other) = self.method.hand_over(h) {
                        h = self.switch(other);
                    }
                }
            }
        }
        Ok(())
    }

    /// Reads tolerances and guards after a change of phase.
    pub(super) fn restart(&mut self) {
        self.system.tolerances(&mut self.position_tolerance, &mut self.velocity_tolerance);
        self.method.restart(&self.position_tolerance, &self.velocity_tolerance);
        self.system.guards(self.t.into(), &self.q, &self.v, &mut self.start_guards);
        self.steps_since_restart = 0;
    }

    /// Shortest step that still advances the time. It depends on the present time: a contact at the
    /// start of a run of hours may need steps shorter than the rounding of its final time.
    fn shortest(&self) -> f64 {
        let time = self.t.abs().max(HALF_DIGITS * (self.end - self.t).abs());
        (ROUNDING_OF_CHAIN * time).max(f64::MIN_POSITIVE)
    }

    /// Shortest part of a step of length `h` that advances the time.
    pub(super) fn resolution(&mut self, h: f64) -> f64 {
        ROUNDING_OF_CHAIN * (self.t.abs() + h)
    }

    pub(super) fn take(&mut self, h: f64) -> bool {
        self.dense = false;
        self.errors = None;
        let h = self.rounded(h);
        let finite = self.method.attempt(self.system, h, &mut self.stats);
        let step = self.method.step();
        step.is_corrected = self.system.corrects(step);
        finite
    }

    /// The length of a step rounded so that t + h is exact and the next step starts exactly where this one ends.
    /// While steps are longer than t, the difference is rounded as well and may miss that by one unit in the last
    /// place.
    fn rounded(&self, h: f64) -> f64 {
        (self.t + h) - self.t
    }

    /// Local error relative to the tolerances: the largest over all coordinates.
    fn error_norm(&mut self) -> f64 {
        let [a, b] = match self.errors {
            Some(errors) => errors,
            None => self.find_errors(),
        };
        let b = self.velocity_refinement * b;
        self.caution * if a > b || a.is_nan() { a } else { b }
    }

    /// Largest local errors of positions and velocities relative to their tolerances without refinement and caution.
    fn find_errors(&mut self) -> [f64; 2] {
        // Loops of known length are the faster ones.
        let errors = match self.q.len() {
            1 => self.errors_of(1),
            2 => self.errors_of(2),
            d => self.errors_of(d),
        };
        let is_corrected = self.method.step().is_corrected;
        let errors = if is_corrected { [errors[0].max(self.error_inside()), errors[1]] } else { errors };
        let errors =
            if self.system.holds() { [errors[0], errors[1].max(self.error_of_held())] } else { errors };
        self.errors = Some(errors);
        errors
    }

    /// Largest error of the accelerations of the polynomial of a step, by which states inside are corrected.
    // Not inlined: few steps are corrected.
    #[inline(never)]
    fn error_inside(&mut self) -> f64 {
        if self.finish_dense().is_err() {
            return f64::INFINITY;
        }
        INSIDE.iter().map(|&part| self.error_at(part)).fold(0.0, f64::max)
    }

    /// Error of the velocities that the accelerations which are held back would cause over the step, were they not.
    // Not inlined: few steps hold.
    #[inline(never)]
    fn error_of_held(&mut self) -> f64 {
        // What is held back follows drives and loads, which may turn back within a step that is short for what moves.
        self.method.step().is_short = false;
        let [mut error, mut held] = std::mem::take(&mut self.inner_a);
        error.fill(0.0);
        for (part, weight) in POINTS {
            let (q, v) = (&mut self.inner_q, &mut self.inner_v);
            if part == 0.0 {
                q.copy_from_slice(&self.q);
                v.copy_from_slice(&self.v);
            } else if part == 1.0 {
                let (end_q, end_v) = self.method.step().end.split_at(q.len());
                q.copy_from_slice(end_q);
                v.copy_from_slice(end_v);
            } else {
                self.method.estimate_inside(part, q, v);
            }
            self.stats.evaluations += 1;
            let t = self.method.step().instant(part);
            self.system.held_accelerations(t, &self.inner_q, &self.inner_v, &mut held);
            error.iter_mut().zip(&held).for_each(|(sum, held)| *sum += weight * held);
        }
        let h = self.method.step().h;
        let scaled =
            error.iter().zip(&self.velocity_tolerance).map(|(error, tolerance)| h * error.abs() / tolerance);
        let largest = scaled.fold(0.0, f64::max);
        self.inner_a = [error, held];
        largest
    }

    /// The same at a part of the step.
    fn error_at(&mut self, part: f64) -> f64 {
        let step = self.method.step();
        step.at(part, &mut self.inner_q, &mut self.inner_v);
        let [error, of_polynomial] = &mut self.inner_a;
        step.rates(part, of_polynomial);
        let t = step.instant(part);
        self.stats.evaluations += 1;
        if !self.system.acceleration(t, &self.inner_q, &self.inner_v, error) {
            return f64::INFINITY;
        }
        // The accelerations differ by what stiff forces make of the error of the velocity: that error over hγ is the
        // error of its slope.
        let step = self.method.step();
        error.iter_mut().zip(&*of_polynomial).for_each(|(a, expected)| *a -= expected);
        step.solve(error);
        error.iter_mut().for_each(|change| *change /= step.diagonal());
        self.system.inner_error(error, of_polynomial, step.damping / step.h)
    }

    /// The same for a number of degrees of freedom that the compiler may know.
    #[inline(always)]
    fn errors_of(&mut self, d: usize) -> [f64; 2] {
        let (position, velocity) = self.method.step().error[..2 * d].split_at(d);
        let scaled = |error: &[f64], tolerance: &[f64]| {
            error.iter().zip(&tolerance[..d]).map(|(e, tol)| e.abs() / tol).fold(0.0, |largest: f64, e| {
                // max would drop a NaN, and a NaN must reject the step.
                if e > largest || e.is_nan() { e } else { largest }
            })
        };
        [scaled(position, &self.position_tolerance), scaled(velocity, &self.velocity_tolerance)]
    }

    /// Factor for the length of the next step from the error of this one.
    fn factor(&mut self, error: f64) -> f64 {
        let exponent = 1.0 / (self.method.step().embedded_order as f64 + 1.0);
        (SAFETY * power(error, -exponent)).clamp(SMALLEST_FACTOR, LARGEST_FACTOR)
    }

    /// Counts that another method makes the next attempt, of a `proposed` length; returns the length that it begins with. It
    /// advances the time: no step of this method has been refused yet.
    fn switch(&mut self, proposed: f64) -> f64 {
        self.stats.switches += 1;
        // The error of another method gives no prediction.
        self.steps_since_restart = 0;
        proposed.max(self.shortest())
    }

    /// Counts an attempt that is not accepted, and keeps why; returns the length of the next one, `next` unless another
    /// method makes it, and whether the same one does.
    fn reject(&mut self, why: Status, next: f64) -> (f64, bool) {
        self.stats.rejected += 1;
        self.refusal = why;
        match self.method.reject(next, &self.stats) {
            Some(other) => {
                (self.switch(other).min(self.system.step_bound()).min(self.limits.max_step), false)
            }
            None => (next, true),
        }
    }

    /// Takes a step of at most `h` whose error is within the tolerance; returns its length and error.
    fn attempt(&mut self, mut h: f64) -> Result<(f64, f64), Failure> {
        self.was_rejected = false;
        loop {
            if self.stats.steps + self.stats.rejected >= self.limits.max_steps {
                return Err((Status::MaxSteps, None));
            }
            let remaining = self.stop - self.t;
            // Two steps of equal length rather than a tiny last one.
            let length = if h >= remaining {
                remaining
            } else if 2.0 * h > remaining {
                0.5 * remaining
            } else {
                h
            };
            if h < self.shortest() && length < remaining {
                return Err((self.refusal, None));
            }
            let finite = self.take(length);
            self.velocity_refinement = self.start_refinement;
            let error = self.error_norm();
            if finite && error <= 1.0 {
                return Ok((length, error));
            }
            let failed = !finite || !error.is_finite();
            let (why, factor) = if failed {
                (Status::NonFinite, FAILURE_FACTOR)
            } else {
                (Status::StepUnderflow, self.factor(error).min(SAFETY))
            };
            (h, self.was_rejected) = self.reject(why, factor * length);
        }
    }

    /// Takes a step of at most `h` within the tolerance, shortened to end on its first event; returns its
    /// length, its error and the guard. The shortened step must pass the error test too: where the motion
    /// grows at a rate r, the error of a linearly implicit step grows as its length approaches 1/(γr), even
    /// if the step becomes shorter. A step is also rejected if it crosses a kink with too much damping or if
    /// its projection is too large.
    fn attempt_to_event(&mut self, mut h: f64) -> Result<(f64, f64, Option<usize>), Failure> {
        let mut was_refused = false;
        self.refusal = Status::StepUnderflow;
        loop {
            let (taken, error) = self.attempt(h)?;
            let event = self.end_on_event();
            // W may be singular at the length that ends on the event, and regular at longer and shorter ones.
            let failed = matches!(event, Err((Status::NonFinite, _)));
            let (event, part_error) =
                if failed { (None, f64::INFINITY) } else { (event?, self.error_norm()) };
            let overdamped = self.beyond_kink && self.method.step().damping > LARGEST_DAMPING;
            let (why, factor) = if !part_error.is_finite() {
                (Status::NonFinite, FAILURE_FACTOR)
            } else if overdamped {
                (Status::StepUnderflow, SMALLEST_FACTOR)
            } else if part_error > 1.0 {
                (Status::StepUnderflow, self.factor(part_error).min(SAFETY))
            } else {
                match self.project() {
                    Projection::Unneeded | Projection::Done => {
                        if let Some(part) = self.unseen_change() {
                            let next = part * self.method.step().h;
                            (h, was_refused) = self.reject(Status::StepUnderflow, next);
                            continue;
                        }
                        self.was_rejected |= was_refused;
                        // Without an event, the second value includes what the guards found at the end of the
                        // step.
                        let error = if event.is_none() { part_error } else { error };
                        return Ok((taken, error, event));
                    }
                    Projection::TooLarge(excess) => (Status::Projection, self.factor(excess).min(SAFETY)),
                    Projection::Singular => (Status::SingularMechanism, FAILURE_FACTOR),
                }
            };
            let next = factor * self.method.step().h;
            (h, was_refused) = self.reject(why, next);
        }
    }

    /// [`HybridSystem::unseen_change`] in the present step.
    fn unseen_change(&mut self) -> Option<f64> {
        let Self { system, method, t, .. } = self;
        let (h, nodes) = (method.step().h, method.nodes());
        system.unseen_change(*t, h, nodes, &mut |theta, q, v| method.estimate_inside(theta, q, v))
    }

    fn project(&mut self) -> Projection {
        let step = self.method.step();
        // The longest step ends at its stop, whatever the rounding of its length; every other one ends where it says,
        // which is not behind it.
        step.stop = (step.h >= self.longest).then_some(self.stop);
        self.next_t = step.end_time();
        let (q, v) = step.end.split_at(self.q.len());
        self.next_q.copy_from_slice(q);
        self.next_v.copy_from_slice(v);
        self.projection = self.system.project(self.next_t, &mut self.next_q, &mut self.next_v);
        self.projection
    }

    fn accept(&mut self, cut: bool) -> Result<(), Failure> {
        let step = self.method.step();
        let (h, wants_dense) = (step.h, self.system.wants_dense(step));
        self.stats.steps += 1;
        self.stats.explicit_steps += usize::from(step.is_explicit);
        self.steps_since_restart += 1;
        if h > 0.0 {
            self.standing_events = 0;
        }
        if !cut && h < self.stats.smallest_step {
            self.stats.smallest_step = h;
            self.stats.smallest_step_time = self.t;
        }
        if wants_dense {
            self.finish_dense()?;
        }
        let go_on = self.system.accepted(self.method.step());
        self.t = self.next_t;
        std::mem::swap(&mut self.q, &mut self.next_q);
        std::mem::swap(&mut self.v, &mut self.next_v);
        self.system.wrap_angles(&mut self.q);
        std::mem::swap(&mut self.start_guards, &mut self.end_guards);
        if self.projection != Projection::Unneeded {
            self.system.guards(self.t.into(), &self.q, &self.v, &mut self.start_guards);
        }
        go_on.map_err(|status| (status, None))
    }

    /// Length of the next step, after an accepted one of length `h` with `error`.
    fn next_step(&mut self, h: f64, error: f64, limits: &NextLimits) -> f64 {
        let error = error.max(LEAST_ERROR);
        // At least 1: only the error estimate shortens a step.
        let largest_growth = limits.largest_growth.max(1.0);
        let factor = match limits.possible_growth {
            Some(growth) => {
                // Twice: its error depends on the lengths of several steps.
                let factor = (SAFETY * SAFETY * self.refined(growth, error)).min(largest_growth);
                // A multistep method keeps the length of its steps unless they may grow clearly: differences at
                // equal distances tell the error best.
                if factor > 1.0 && factor < LEAST_GROWTH { 1.0 } else { factor.max(SMALLEST_FACTOR) }
            }
            None => self.predicted_factor(h, error).min(largest_growth),
        };
        (self.last_step, self.last_error) = (h, error);
        h * if self.was_rejected { factor.min(1.0) } else { factor }
    }

    /// Growth of a step within its tolerance, from that without the refinement and caution in the `error` of the last
    /// one.
    fn refined(&mut self, growth: f64, error: f64) -> f64 {
        // The common case.
        if self.velocity_refinement == 1.0 && self.caution == 1.0 {
            return growth;
        }
        let [position, velocity] = self.errors.unwrap_or([error; 2]);
        let refinement = error / position.max(velocity).max(LEAST_ERROR);
        growth * power(refinement, -1.0 / (self.method.step().embedded_order as f64 + 1.0))
    }

    /// Factor for the length of the next step of a one-step method, from the errors of the last two.
    fn predicted_factor(&mut self, h: f64, error: f64) -> f64 {
        let factor = self.factor(error);
        if self.steps_since_restart <= UNPREDICTED_STEPS || self.last_step <= 0.0 || error <= LEAST_ERROR {
            return factor;
        }
        // Gustafsson: the error is taken to change as it did over the last step.
        let exponent = 1.0 / (self.method.step().embedded_order as f64 + 1.0);
        let trend = h / self.last_step * power(self.last_error / error, exponent);
        factor.min((factor * trend).max(SMALLEST_FACTOR))
    }
}
