//! The loop over the steps: step control, projections, what an accepted step changes.

use crate::integrators::dense::DenseStep;
use crate::integrators::events::{EventFinder, Guard};
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, Limits, Outcome, Projection, Settled, Stats, Status, Stepper};

/// Step-size factor of an attempt that failed (a number that is not finite, a singular W).
const FAILURE_FACTOR: f64 = 0.1;
/// Safety factor of the step-size controller, that of Hairer's RODAS, and its limits, a sixth and five (in RODAS a fifth
/// and six).
const SAFETY: f64 = 0.9;
const SMALLEST_FACTOR: f64 = 1.0 / 6.0;
const LARGEST_FACTOR: f64 = 5.0;
/// Accepted steps after a restart that are controlled by the present error alone: the predictive
/// controller would compare with a step of the phase before.
const UNPREDICTED_STEPS: usize = 2;
/// Error [tolerances] below which a step says nothing of the next one but that it may be longer.
const LEAST_ERROR: f64 = 1e-8;
/// Part of what remains of a run that counts as time already passed where the shortest step is asked
/// for: at time zero there is no rounding of the time to measure it by.
const EARLIEST: f64 = 1e-8;

/// Largest [`DenseStep::damping`] of a step beyond a kink. Beyond it the step follows the slope before the kink, the
/// error estimate is damped by the same slope, and it may swing past the kink without seeing that the acceleration
/// changed. Tuned on contacts that break away from sticking, the slider-cranks of
/// `benchmarks/stiffness.rs`: 10 takes up to a quarter off the work of a Rosenbrock method for errors of
/// 1e-2 and 1e-3, 100 nothing, 3 and 1 cost up to 9 and 17 %.
const LARGEST_DAMPING: f64 = 10.0;

/// The integration in progress.
pub(super) struct Run<'a> {
    pub(super) system: &'a mut dyn HybridSystem,
    pub(super) method: &'a mut dyn Stepper,
    pub(super) finder: EventFinder,
    pub(super) limits: Limits,
    pub(super) stats: Stats,
    pub(super) t: f64,
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    position_tolerance: Vec<f64>,
    velocity_tolerance: Vec<f64>,
    pub(super) start_guards: Vec<Guard>,
    pub(super) end_guards: Vec<Guard>,
    /// Error and length of the last accepted step, for the predictive controller.
    last_error: f64,
    last_step: f64,
    steps_since_restart: usize,
    /// The present step was not accepted at the first attempt.
    was_rejected: bool,
    /// Events in a row that did not advance the time.
    pub(super) standing_events: usize,
    /// The dense output of the present step is complete.
    pub(super) dense: bool,
    /// The present step ends beyond a kink.
    pub(super) beyond_kink: bool,
    /// How many times finer than its tolerance the velocity must be known: where the step starts, and in all of it.
    pub(super) start_sharpness: f64,
    pub(super) sharpness: f64,
    /// Why the last attempt was refused, as the run ends if no shorter step helps.
    refusal: Status,
    /// End of the present step on the constraints, and how it came there.
    next_q: Vec<f64>,
    next_v: Vec<f64>,
    projection: Projection,
    /// State and guards inside a step.
    pub(super) inner_q: Vec<f64>,
    pub(super) inner_v: Vec<f64>,
    pub(super) inner_guards: Vec<Guard>,
}

/// Integrates with a Rosenbrock method from `t` to `end`; `q` and `v` are the start and become
/// the end.
pub fn integrate(
    system: &mut dyn HybridSystem,
    tableau: Tableau,
    limits: Limits,
    t: f64,
    end: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> Outcome {
    let mut method = Rosenbrock::new(tableau, system.dimension());
    integrate_with(system, &mut method, limits, t, end, q, v)
}

/// Integrates with any method from `t` to `end`; `q` and `v` are the start and become the end.
pub fn integrate_with(
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
        beyond_kink: false,
        start_sharpness: 1.0,
        sharpness: 1.0,
        refusal: Status::StepUnderflow,
        next_q: vec![0.0; d],
        next_v: vec![0.0; d],
        projection: Projection::Unneeded,
        inner_q: vec![0.0; d],
        inner_v: vec![0.0; d],
        inner_guards: vec![Guard::INACTIVE; guards],
    };
    let (status, guard) = match run.advance(end) {
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
    fn advance(&mut self, end: f64) -> Result<(), Failure> {
        // A thousandth of the run: too long is cut by rejections within a few attempts.
        let mut h = self.limits.first_step.unwrap_or(1e-3 * (end - self.t)).max(self.shortest(end));
        self.restart();
        while self.t < end {
            if !self.method.begin(self.system, self.t, &self.q, &self.v, &mut self.stats) {
                let finite = self.q.iter().chain(&self.v).all(|y| y.is_finite());
                return Err((if finite { Status::SingularMechanism } else { Status::NonFinite }, None));
            }
            self.start_sharpness = self.system.sharpness();
            h = h.min(self.system.step_bound()).min(self.limits.max_step);
            let (taken, error, event) = self.attempt_to_event(h, end)?;
            let cut = event.is_some() || self.t + self.method.step().h >= end;
            self.accept(end, cut)?;
            match event {
                Some(index) => {
                    let bound = self.change_phase(index)?;
                    // Changes to and fro on the spot: the error of a step too long for either phase.
                    let repeated = self.standing_events > self.start_guards.len();
                    h = bound.min(taken * if repeated { FAILURE_FACTOR } else { 1.0 });
                }
                None => {
                    let Settled { largest_growth, switched } =
                        self.method.settle(self.system, self.t, &self.q, &self.v, &mut self.stats);
                    h = self.next_step(taken, error, largest_growth);
                    if switched {
                        self.stats.switches += 1;
                        // The errors of two methods have no trend.
                        self.steps_since_restart = 0;
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

    /// Shortest step that still advances the time. It belongs to the present time: a contact at the
    /// start of a run of hours may need steps that the end of the run could not resolve.
    fn shortest(&self, end: f64) -> f64 {
        let time = self.t.abs().max(EARLIEST * (end - self.t).abs());
        (16.0 * f64::EPSILON * time).max(f64::MIN_POSITIVE)
    }

    /// Shortest part of a step of length `h` that advances the time.
    pub(super) fn resolution(&mut self, h: f64) -> f64 {
        16.0 * f64::EPSILON * (self.t.abs() + h)
    }

    pub(super) fn take(&mut self, h: f64) -> bool {
        self.dense = false;
        // To the next number: the step after this one begins where this one ended, to the last bit. The first
        // few may miss it, which multiply the time: then their difference is rounded as well.
        let h = (self.t + h) - self.t;
        self.method.attempt(self.system, h, &mut self.stats)
    }

    /// Local error relative to the tolerances: the largest over all coordinates.
    fn error_norm(&mut self) -> f64 {
        let d = self.q.len();
        let (position, velocity) = self.method.step().error.split_at(d);
        let scaled = |error: &[f64], tolerance: &[f64]| {
            error.iter().zip(tolerance).map(|(e, tol)| e.abs() / tol).fold(0.0, |largest: f64, e| {
                // max would drop a NaN, and a NaN must reject the step.
                if e > largest || e.is_nan() { e } else { largest }
            })
        };
        let (a, b) = (scaled(position, &self.position_tolerance), scaled(velocity, &self.velocity_tolerance));
        let b = self.sharpness * b;
        if a > b || a.is_nan() { a } else { b }
    }

    /// Factor by which the error estimate lets the step grow.
    fn factor(&mut self, error: f64) -> f64 {
        let exponent = 1.0 / (self.method.step().embedded_order as f64 + 1.0);
        (SAFETY * error.powf(-exponent)).clamp(SMALLEST_FACTOR, LARGEST_FACTOR)
    }

    /// Takes a step of at most `h` with an acceptable error; its length and error.
    fn attempt(&mut self, mut h: f64, end: f64) -> Result<(f64, f64), Failure> {
        self.was_rejected = false;
        loop {
            if self.stats.steps + self.stats.rejected >= self.limits.max_steps {
                return Err((Status::MaxSteps, None));
            }
            let remaining = end - self.t;
            // Half of what remains rather than a tiny last step; the end is met exactly.
            let length = if h >= remaining {
                remaining
            } else if 2.0 * h > remaining {
                0.5 * remaining
            } else {
                h
            };
            if h < self.shortest(end) && length < remaining {
                return Err((self.refusal, None));
            }
            let finite = self.take(length);
            self.sharpness = self.start_sharpness;
            let error = self.error_norm();
            if finite && error <= 1.0 {
                return Ok((length, error));
            }
            self.stats.rejected += 1;
            let broken = !finite || !error.is_finite();
            self.refusal = if broken { Status::NonFinite } else { Status::StepUnderflow };
            self.was_rejected = true;
            h = length * if broken { FAILURE_FACTOR } else { self.factor(error).min(SAFETY) };
        }
    }

    /// Takes a step of at most `h` with an acceptable error, or the part of it up to its first event: its
    /// length, its error and the guard. The part has an error of its own: where the motion grows at a rate r,
    /// a linearly implicit step is the worse the closer its length is to 1/(γr), be it a shorter one. Neither
    /// may pass a kink blindly, or end further from the constraints than its error says.
    fn attempt_to_event(&mut self, mut h: f64, end: f64) -> Result<(f64, f64, Option<usize>), Failure> {
        let mut was_refused = false;
        self.refusal = Status::StepUnderflow;
        loop {
            let (taken, error) = self.attempt(h, end)?;
            let event = self.end_on_event();
            // A singular W may lie between a step that was possible and shorter ones that are.
            let failed = matches!(event, Err((Status::NonFinite, _)));
            let (event, part_error) =
                if failed { (None, f64::INFINITY) } else { (event?, self.error_norm()) };
            let blind = self.beyond_kink && self.method.step().damping > LARGEST_DAMPING;
            let (why, factor) = if !part_error.is_finite() {
                (Status::NonFinite, FAILURE_FACTOR)
            } else if blind {
                (Status::StepUnderflow, SMALLEST_FACTOR)
            } else if part_error > 1.0 {
                (Status::StepUnderflow, self.factor(part_error).min(SAFETY))
            } else {
                match self.project(end) {
                    Projection::Unneeded | Projection::Done => {
                        self.was_rejected |= was_refused;
                        // Known better where the end has been looked at.
                        let error = if event.is_none() { part_error } else { error };
                        return Ok((taken, error, event));
                    }
                    Projection::TooLarge(excess) => (Status::Projection, self.factor(excess).min(SAFETY)),
                    Projection::Singular => (Status::SingularMechanism, FAILURE_FACTOR),
                }
            };
            // The step cannot stay.
            self.stats.rejected += 1;
            self.refusal = why;
            was_refused = true;
            h = factor * self.method.step().h;
        }
    }

    /// Moves the end of the step onto the constraints.
    fn project(&mut self, end: f64) -> Projection {
        let next = self.end_of_step(end);
        let step = self.method.step();
        let (q, v) = step.end.split_at(self.q.len());
        self.next_q.copy_from_slice(q);
        self.next_v.copy_from_slice(v);
        self.projection = self.system.project(next, &mut self.next_q, &mut self.next_v);
        self.projection
    }

    /// Instant at which the step ends. The last one has the length that remains: rounding must not leave a
    /// sliver.
    fn end_of_step(&mut self, end: f64) -> f64 {
        let next = self.t + self.method.step().h;
        let rounding = 16.0 * f64::EPSILON * next.abs().max(end.abs());
        if (end - next).abs() <= rounding { end } else { next }
    }

    /// Moves to the end of the step.
    fn accept(&mut self, end: f64, cut: bool) -> Result<(), Failure> {
        let &mut DenseStep { h, is_explicit, .. } = self.method.step();
        self.stats.steps += 1;
        self.stats.explicit_steps += usize::from(is_explicit);
        self.steps_since_restart += 1;
        if h > 0.0 {
            self.standing_events = 0;
        }
        if !cut && h < self.stats.smallest_step {
            self.stats.smallest_step = h;
            self.stats.smallest_step_time = self.t;
        }
        if self.system.wants_dense(self.t + h) {
            self.finish_dense()?;
        }
        let go_on = self.system.accepted(self.method.step());
        self.t = self.end_of_step(end);
        self.q.copy_from_slice(&self.next_q);
        self.v.copy_from_slice(&self.next_v);
        self.system.fold(&mut self.q);
        std::mem::swap(&mut self.start_guards, &mut self.end_guards);
        if self.projection != Projection::Unneeded {
            self.system.guards(self.t.into(), &self.q, &self.v, &mut self.start_guards);
        }
        if go_on { Ok(()) } else { Err((Status::Cancelled, None)) }
    }

    /// Length of the next step, after an accepted one of length `h` with `error`.
    fn next_step(&mut self, h: f64, error: f64, largest_growth: f64) -> f64 {
        let exponent = 1.0 / (self.method.step().embedded_order as f64 + 1.0);
        let error = error.max(LEAST_ERROR);
        let mut factor = self.factor(error);
        if self.steps_since_restart > UNPREDICTED_STEPS && self.last_step > 0.0 && error > LEAST_ERROR {
            // Gustafsson: the error is taken to change as it did over the last step.
            let trend = h / self.last_step * (self.last_error / error).powf(exponent);
            factor = factor.min((factor * trend).max(SMALLEST_FACTOR));
        }
        if self.was_rejected {
            factor = factor.min(1.0);
        }
        // Not below 1: that is for the error to say.
        factor = factor.min(largest_growth.max(1.0));
        self.last_step = h;
        self.last_error = error;
        h * factor
    }
}
