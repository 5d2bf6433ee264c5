//! Integration of `q̈ = a(q, q̇, t)` with events. In: a system, a method, a start; out: a state at the end
//! and the work done. Uses `numerics` and the form of a linearization from `dynamics`.
//!
//! The integrator knows no mechanism and no contact. A [`HybridSystem`] gives accelerations, their exact
//! derivatives, guard functions whose zeros end the present phase, and the change of phase.

pub mod adams;
pub mod auto;
mod control;
pub mod dense;
pub mod dop853;
mod dop853_coefficients;
pub mod events;
mod rates;
mod relocation;
pub mod rosenbrock;
mod stages;
pub mod tableaus;

use crate::dynamics::Linearization;
use crate::numerics::instant::Instant;
use dense::DenseStep;
use events::Guard;

pub use control::integrate;

/// What the integrator needs to know of a system.
pub trait HybridSystem {
    /// Number of degrees of freedom d.
    fn dimension(&self) -> usize;

    /// Accelerations; false where they do not exist.
    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool;

    /// Accelerations and their derivatives; false where they do not exist.
    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool;

    /// Receives the state, with its accelerations, from which the next attempts start.
    fn begin(&mut self, _t: f64, _q: &[f64], _v: &[f64], _a: &[f64]) {}

    /// Absolute tolerances of the local error of each coordinate and velocity in the present phase.
    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]);

    /// Longest step from the state of the last [`HybridSystem::begin`] that cannot step over an event.
    fn step_bound(&self) -> f64 {
        f64::INFINITY
    }

    /// The first instant [s] after the last [`HybridSystem::begin`] at which the accelerations or their derivatives
    /// jump. A step ends there, at exactly this number, or before it.
    fn next_break(&self) -> f64 {
        f64::INFINITY
    }

    /// Number of guards.
    fn guard_count(&self) -> usize {
        0
    }

    /// Guards of the present phase.
    fn guards(&mut self, _t: Instant, _q: &[f64], _v: &[f64], _guards: &mut [Guard]) {}

    /// Whether a kink of the accelerations (a jump of their derivatives) lies between the start of the step
    /// and the state at which the guards were last evaluated. The Jacobian at the start of the step does not
    /// hold beyond it.
    fn is_beyond_kink(&self) -> bool {
        false
    }

    /// Factor, at least 1, by which all tolerances of [`HybridSystem::tolerances`] must be divided in the step that
    /// begins in the state of the last [`HybridSystem::begin`].
    fn caution(&self) -> f64 {
        1.0
    }

    /// Factor, at least 1, by which the velocity tolerances of [`HybridSystem::tolerances`] must be divided:
    /// at the state of the last [`HybridSystem::begin`], and between it and the state at which the guards
    /// were last evaluated.
    fn velocity_refinement(&self) -> f64 {
        1.0
    }

    /// Whether states inside the step just attempted are corrected; asked before its guards. Inside implicit steps that do
    /// not resolve how fast forces other than friction brake, the states of the polynomial have errors that are harmless
    /// to the motion, but not to these forces.
    fn corrects(&mut self, _step: &DenseStep) -> bool {
        false
    }

    /// Corrects the state of the polynomial of a step at `t + theta h` so that its accelerations are those of the
    /// polynomial.
    fn correct(&mut self, _step: &DenseStep, _theta: f64, _q: &mut [f64], _v: &mut [f64]) {}

    /// An error of the accelerations of a polynomial, relative to what is allowed in a step that damps velocities at a
    /// rate [1/s].
    fn inner_error(&self, _error: &[f64], _of_polynomial: &[f64], _rate: f64) -> f64 {
        0.0
    }

    /// Whether the present phase holds accelerations back, which a step must resolve as those that move: the change of the
    /// phase depends on them.
    fn holds(&self) -> bool {
        false
    }

    /// The accelerations of all coordinates that the present phase holds back.
    fn held_accelerations(&mut self, _t: Instant, _q: &[f64], _v: &[f64], _held: &mut [f64]) {}

    /// Changes the phase after the zero of a guard, with what the location of the zero leaves of velocities that vanish
    /// there; returns a bound for the next step, or infinity.
    ///
    /// # Errors
    /// Why the motion cannot go on beyond it.
    fn cross(&mut self, _index: usize, _t: f64, _q: &[f64], _v: &mut [f64]) -> Result<f64, Status> {
        Ok(f64::INFINITY)
    }

    /// Length of the first step of a phase, before [`HybridSystem::step_bound`], where the `last` step before the
    /// event was of that length.
    fn first_step(&self, last: f64) -> f64 {
        last
    }

    /// Whether states inside an accepted step are needed, and with them its dense output.
    fn wants_dense(&mut self, _step: &DenseStep) -> bool {
        true
    }

    /// Projects the state at the end of a step onto the constraints, if there are any. The step may still be
    /// rejected afterwards.
    fn project(&mut self, _t: f64, _q: &mut [f64], _v: &mut [f64]) -> Projection {
        Projection::Unneeded
    }

    /// Whether what acts changes in a step of length `h` [s] from `t` [s] by more than the method sees, which asks for the
    /// accelerations at parts of the step, the `nodes`; a multistep method at the ends of its steps. `state` writes the
    /// approximate state at a part of the step. Returns the part that a shorter step may take.
    fn unseen_change(&mut self, _t: f64, _h: f64, _nodes: &[f64], _state: &mut StateInside) -> Option<f64> {
        None
    }

    /// Rewrites the positions of an accepted step as an equivalent state with smaller rounding errors, from
    /// which the next step starts: angles without their full turns.
    fn wrap_angles(&mut self, _q: &mut [f64]) {}

    /// Receives every accepted step, before any change of phase at its end.
    ///
    /// # Errors
    /// Why the integration must end there.
    fn accepted(&mut self, _step: &DenseStep) -> Result<(), Status> {
        Ok(())
    }
}

/// Writes the approximate state at a part of a step.
pub type StateInside<'s> = dyn FnMut(f64, &mut [f64], &mut [f64]) + 's;

/// A state at an instant.
#[derive(Clone, Copy, Debug)]
pub struct StateAt<'a> {
    /// Instant [s].
    pub t: f64,
    /// Positions.
    pub q: &'a [f64],
    /// Velocities.
    pub v: &'a [f64],
}

/// A one-step method.
///
/// The loop over the steps calls [`Stepper::restart`] at the start of a phase, [`Stepper::begin`] once for
/// every state, [`Stepper::attempt`] until a step is accepted, and then [`Stepper::next_limits`] unless the step
/// ended a phase. All but `begin` and `restart` refer to the last step.
pub trait Stepper {
    /// Receives the tolerances of a new phase, by which positions and velocities are weighted.
    fn restart(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]);

    /// Computes what all attempts from a state need; false where the accelerations do not exist.
    fn begin(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool;

    /// Takes a step of length `h` from the state of the last [`Stepper::begin`]; false where
    /// something is not finite.
    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool;

    /// Learns that the last attempt is not accepted: its error is above the tolerances, with what a system asks beyond
    /// those of [`Stepper::restart`], or not finite. The next attempt is of length `next` [s]; returns another one if
    /// another method makes it.
    fn reject(&mut self, _next: f64, _stats: &Stats) -> Option<f64> {
        None
    }

    /// The step with its error estimate.
    fn step(&mut self) -> &mut DenseStep;

    /// Approximate state at the fraction `theta` of the step, without further evaluations. It decides whether
    /// guards must be evaluated on the dense output.
    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]);

    /// Parts of a step at which it asks for accelerations; none of a multistep method, which knows those of the steps
    /// before.
    fn nodes(&self) -> &'static [f64];

    /// Completes the dense output of the step; false where something is not finite.
    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool;

    /// Called when the step was accepted and led to a state in the same phase. Returns the factor by which the next
    /// step may be longer within the region of absolute stability.
    fn next_limits(
        &mut self,
        _system: &mut dyn HybridSystem,
        _at: StateAt,
        _stats: &mut Stats,
    ) -> NextLimits {
        NextLimits::UNLIMITED
    }

    /// Called after [`Stepper::next_limits`] with the length of the next step [s]; returns another one if another method
    /// takes it.
    fn hand_over(&mut self, _next: f64) -> Option<f64> {
        None
    }
}

/// What a method allows for the step after an accepted one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextLimits {
    /// Largest ratio of its length to that of the accepted step.
    pub largest_growth: f64,
    /// Of a multistep method: ratio of the lengths that the error of the next step alone would allow, at the order
    /// that the method has chosen for it and without [`HybridSystem::velocity_refinement`].
    pub possible_growth: Option<f64>,
}

impl NextLimits {
    /// Only its error limits the next step.
    pub const UNLIMITED: Self = Self { largest_growth: f64::INFINITY, possible_growth: None };
}

/// How a projection onto the constraints went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// There are no constraints.
    Unneeded,
    /// The correction is within its limit.
    Done,
    /// The correction exceeds its limit by this factor: the error of the step is larger than its estimate.
    TooLarge(f64),
    /// The constraints are dependent here, or Newton's method did not converge.
    Singular,
}

/// Why an integration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The end was reached.
    Done,
    /// The allowed number of steps was used up.
    MaxSteps,
    /// The step became too short to advance the time.
    StepUnderflow,
    /// Something is not a finite number.
    NonFinite,
    /// The mass matrix is singular, or the loop closures are dependent: dead center, change point.
    SingularMechanism,
    /// An event could not be located.
    EventLocation,
    /// The allowed number of events was used up.
    MaxEvents,
    /// A projection onto the loop closures exceeded the tolerance, however short the step.
    Projection,
    /// A force that changes where a quantity passes a limit pushes it back from both sides, as dry friction does at
    /// rest.
    Held,
    /// A table ends, beyond which it is not extrapolated.
    OutsideTable,
    /// A function in a formula is asked for outside its domain, as the root of a negative number.
    OutsideDomain,
    /// What slides in a guide with ends has left it.
    LeftGuide,
    /// Friction in an ideal joint and the reaction that it changes have two solutions or none.
    FrictionIndeterminate,
    /// The caller cancelled.
    Cancelled,
}

impl Status {
    /// The word by which results name the status.
    pub fn word(self) -> &'static str {
        match self {
            Status::Done => "done",
            Status::MaxSteps => "max_steps",
            Status::StepUnderflow => "step_underflow",
            Status::NonFinite => "non_finite",
            Status::SingularMechanism => "singular_mechanism",
            Status::EventLocation => "event_location",
            Status::MaxEvents => "max_events",
            Status::Projection => "projection",
            Status::Held => "held",
            Status::OutsideTable => "outside_table",
            Status::OutsideDomain => "outside_domain",
            Status::LeftGuide => "left_guide",
            Status::FrictionIndeterminate => "friction_indeterminate",
            Status::Cancelled => "cancelled",
        }
    }
}

/// Work done: counts that do not depend on the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stats {
    /// Accepted steps, those that end on events included.
    pub steps: usize,
    /// Accepted steps of an explicit method.
    pub explicit_steps: usize,
    /// Changes between an explicit and an implicit method.
    pub switches: usize,
    /// Rejected attempts.
    pub rejected: usize,
    /// Stages of all attempts.
    pub stages: usize,
    /// Evaluations of the accelerations, those of the Jacobians included.
    pub evaluations: usize,
    /// Jacobians.
    pub jacobians: usize,
    /// Factorizations of W.
    pub factorizations: usize,
    /// Events.
    pub events: usize,
    /// Steps taken again so that they end on an event.
    pub relocations: usize,
    /// Accepted steps of an Adams method after which stability did not let the next one grow, though its error would have
    /// let it pay for a Rosenbrock step.
    pub limited: usize,
    /// Steps of a Rosenbrock method of the same error, in Adams steps of equal work, as far as the errors of the limited
    /// ones tell.
    pub enough: f64,
    /// Shortest accepted step that was not cut by an event or the end [s].
    pub smallest_step: f64,
    /// Time at which that step started [s].
    pub smallest_step_time: f64,
}

impl Default for Stats {
    fn default() -> Self {
        Self {
            steps: 0,
            explicit_steps: 0,
            switches: 0,
            rejected: 0,
            stages: 0,
            evaluations: 0,
            jacobians: 0,
            factorizations: 0,
            events: 0,
            relocations: 0,
            limited: 0,
            enough: 0.0,
            smallest_step: f64::INFINITY,
            smallest_step_time: 0.0,
        }
    }
}

impl Stats {
    /// The counts with their names in results.
    pub fn counts(&self) -> [(&'static str, usize); 10] {
        [
            ("steps", self.steps),
            ("explicit_steps", self.explicit_steps),
            ("switches", self.switches),
            ("rejected", self.rejected),
            ("stages", self.stages),
            ("evaluations", self.evaluations),
            ("jacobians", self.jacobians),
            ("factorizations", self.factorizations),
            ("events", self.events),
            ("relocations", self.relocations),
        ]
    }

    /// The other numbers with their names in results.
    pub fn sizes(&self) -> [(&'static str, f64); 2] {
        [("smallest_step", self.smallest_step), ("smallest_step_time", self.smallest_step_time)]
    }
}

/// Limits of an integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most attempts of a step, accepted or not; relocations do not count. As many pieces of steps may be integrated or
    /// searched by observers, besides one for each step.
    pub max_steps: usize,
    /// Most events.
    pub max_events: usize,
    /// Length of the first step [s], if not found automatically.
    pub first_step: Option<f64>,
    /// Longest step [s].
    pub max_step: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { max_steps: 10_000_000, max_events: 1_000_000, first_step: None, max_step: f64::INFINITY }
    }
}

/// How an integration ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Why.
    pub status: Status,
    /// When [s].
    pub time: f64,
    /// The guard involved, if one is.
    pub guard: Option<usize>,
    /// Work done.
    pub stats: Stats,
}
