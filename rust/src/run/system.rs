//! The system that the integrator integrates: a motion with its phases, and the observers of its accepted steps.

use crate::contact::friction::JointPhase;
use crate::contact::pair::Phase;
use crate::dynamics::Linearization;
use crate::error::Notice;
use crate::integrators::dense::DenseStep;
use crate::integrators::events::Guard;
use crate::integrators::{HybridSystem, Limits, Projection, StateInside, Status};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::instant::Instant;
use crate::run::branch::Branch;
use crate::run::contacts::dry_joints::{find_held, hold_still};
use crate::run::contacts::phases::Phases;
use crate::run::features::Plan;
use crate::run::motion::Motion;
use crate::run::outputs::{Column, Needs, asked_sectors};
use crate::run::restart::Memory;
use crate::run::samples::Samples;
use crate::run::settings::Settings;
use crate::run::tracking::Tracking;
use crate::run::warnings::of_scene;
use crate::run::work::balance::Balance;
use crate::run::work::inputs::{Inputs, Stretch};
use crate::tree::elements::State;

/// First step of a run relative to the time in which the mechanism moves by its own size. Rejections shorten
/// a step that is too long; one that is too short grows fivefold per step.
/// Half, twice: work +1, -1 % (101 of 113 runs).
const FIRST_STEP: f64 = 1e-3;

/// A motion as a system for the integrator, with the observers of its steps.
pub(crate) struct System<'a> {
    pub(crate) motion: Motion<'a>,
    settings: &'a Settings,
    pub(crate) phases: Phases<'a>,
    pub(crate) samples: Samples<'a>,
    pub(crate) tracking: Tracking,
    pub(crate) balance: Balance,
    /// [`Tree::has_dampers`](crate::tree::elements::Tree::has_dampers).
    has_dampers: bool,
    /// Loads and drives that no step may step over.
    pub(crate) inputs: Inputs<'a>,
    /// The branch of its loops.
    branch: Branch,
    /// Accelerations at the start of the step.
    start: Vec<f64>,
    /// Largest correction that closed the loops after a step [m].
    pub(crate) largest_projection: f64,
    /// Warnings that are known before the first step.
    pub(crate) warnings: Vec<Notice>,
}

impl<'a> System<'a> {
    /// A mechanism at an instant [s] from which it is integrated.
    pub(crate) fn new(
        mechanism: &'a Mechanism,
        start: &State,
        settings: &'a Settings,
        table: (Vec<Column>, &'a mut [f64]),
        plan: Plan,
        monitor: &'a dyn Fn(f64) -> bool,
        from: f64,
    ) -> Self {
        let counts_work = Needs::of(&table.0).work || plan.needs.work;
        let mut motion = Motion::new(mechanism, counts_work, monitor, settings.limits.max_steps);
        motion.work.sectors = asked_sectors(mechanism, table.0.iter().copied().chain(plan.columns()));
        let samples = Samples::new(settings, table, from);
        Self {
            motion,
            settings,
            phases: Phases::new(mechanism, start, settings, samples.from),
            tracking: Tracking::new(plan, settings, samples.from, mechanism.degrees_of_freedom()),
            balance: Balance::new(mechanism, settings, from),
            samples,
            has_dampers: mechanism.tree.has_dampers(),
            inputs: Inputs::of(mechanism),
            branch: Branch::of(mechanism),
            start: vec![0.0; mechanism.degrees_of_freedom()],
            largest_projection: 0.0,
            warnings: of_scene(mechanism),
        }
    }

    /// Limits of the integration.
    pub(crate) fn limits(&self) -> Limits {
        let crossing = FIRST_STEP * self.motion.mechanism.scales.shortest_crossing();
        // If nothing moves, relative to the duration of the run.
        let whole = FIRST_STEP * (self.settings.skip + self.settings.duration);
        let first_step = self.settings.refinement() * if crossing.is_finite() { crossing } else { whole };
        let first_step = self.settings.limits.first_step.or(Some(first_step));
        Limits { first_step, ..self.settings.limits }
    }

    /// Takes over the memory of the run that this one continues.
    pub(crate) fn recall(&mut self, memory: &Memory) {
        self.warnings.extend(memory.recall(&mut self.motion, &mut self.phases.log));
    }

    /// Sets the phases of the start and takes the first sample, if it is due.
    pub(crate) fn begin(&mut self, q: &mut [f64], v: &[f64]) {
        self.motion.settle(0.0, q, v);
        self.warnings.extend(self.phases.begin(&mut self.motion, q, v));
        self.motion.work.begin(&mut self.motion.dynamics);
        self.motion.wrap(q);
        if self.samples.wants(0.0) {
            self.samples.take_state(&mut self.motion, 0.0, q, v);
        }
    }
}

impl System<'_> {
    /// Takes back how far joints that stick have crept in a step; returns the projection of its end with that.
    fn hold_still(&mut self, t: f64, q: &mut [f64], v: &mut [f64], projection: Projection) -> Projection {
        let held = hold_still(&mut self.motion, &self.phases.tolerances, t, q, v);
        if held { Projection::Done } else { projection }
    }
}

impl HybridSystem for System<'_> {
    fn dimension(&self) -> usize {
        self.motion.q.len()
    }

    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.motion.dynamics.acceleration(t, q, v, a)
    }

    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        self.motion.dynamics.linearize(t, q, v, linear)
    }

    fn begin(&mut self, t: f64, q: &[f64], v: &[f64], a: &[f64]) {
        if !self.motion.dynamics.is_at(t.into(), q, v) {
            self.motion.dynamics.move_to(t, q, v);
        }
        self.branch.begin(&self.motion.dynamics, self.motion.mechanism, v);
        self.motion.dynamics.accelerate(a);
        self.phases.watch(&mut self.motion, &mut self.balance, t);
        self.start.copy_from_slice(a);
        self.balance.begin(t);
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        let Motion { mechanism, dynamics, .. } = &self.motion;
        self.phases.tolerances.in_phases(mechanism, &dynamics.phases, position, velocity);
    }

    fn next_break(&self) -> f64 {
        self.phases.demands.next_break
    }

    fn step_bound(&self) -> f64 {
        self.phases.demands.bound
    }

    fn guard_count(&self) -> usize {
        self.phases.guard_count(&self.motion)
    }

    fn guards(&mut self, t: Instant, q: &[f64], v: &[f64], guards: &mut [Guard]) {
        self.phases.guards(&mut self.motion, t, (q, v), guards);
    }

    fn is_beyond_kink(&self) -> bool {
        self.phases.demands.breaks_away
    }

    fn velocity_refinement(&self) -> f64 {
        self.phases.demands.velocity_refinement
    }

    fn caution(&self) -> f64 {
        self.phases.demands.caution
    }

    fn corrects(&mut self, step: &DenseStep) -> bool {
        // A step that is shorter than the time in which its stiffest force brakes resolves that force; of dampers, films
        // and formulas the Jacobian alone tells.
        let brakes = || self.has_dampers || step.h * self.phases.braking_rate(&self.motion) > 1.0;
        let is_corrected = step.damping > 1.0 && brakes();
        self.phases.demands.is_corrected = is_corrected;
        is_corrected
    }

    fn correct(&mut self, step: &DenseStep, theta: f64, q: &mut [f64], v: &mut [f64]) {
        self.motion.visit_inside(|motion| motion.correct(step, theta, q, v));
    }

    /// The power of a drive against a damper or a film is as wrong as its force, and with it the balance of energies.
    fn inner_error(&self, error: &[f64], of_polynomial: &[f64], rate: f64) -> f64 {
        let scales = &self.motion.mechanism.scales;
        let of = |component: usize| {
            // A start that is off its slow motion, but within the tolerance, need not be resolved.
            let start = scales.largest_acceleration(component, &self.start);
            let of_start = start.min(self.phases.tolerances.of(component).velocity * rate);
            let size = scales.largest_acceleration(component, of_polynomial).max(of_start);
            scales.largest(component, error) / (self.balance.limit * size)
        };
        (0..scales.components.len()).map(of).fold(0.0, f64::max)
    }

    fn holds(&self) -> bool {
        self.motion.dynamics.joint_phases().iter().any(JointPhase::sticks)
    }

    fn held_accelerations(&mut self, t: Instant, q: &[f64], v: &[f64], held: &mut [f64]) {
        let is_inside = self.motion.dynamics.instant() != t;
        let moved = self.motion.guarded(is_inside);
        if !moved.is_at(t, q, v) {
            moved.move_to(t, q, v);
        }
        find_held(&mut self.motion, is_inside);
        self.motion.guarded(is_inside).held_accelerations(held);
    }

    fn cross(&mut self, guard: usize, t: f64, q: &[f64], v: &mut [f64]) -> Result<f64, Status> {
        self.tracking.interrupt();
        self.inputs.forget();
        let crossing = self.phases.cross(&mut self.motion, guard, (t, q, v))?;
        if crossing.has_jump {
            self.balance.forget_state();
        }
        Ok(crossing.bound)
    }

    fn first_step(&self, last: f64) -> f64 {
        // The steps of a contact are far too short for a flight, of which half a clearance bounds the steps.
        let phases = &self.motion.dynamics.phases;
        let flies = !phases.is_empty() && !phases.iter().any(Phase::touches);
        if flies { f64::INFINITY } else { last }
    }

    fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64]) -> Projection {
        let mechanism = self.motion.mechanism;
        if !mechanism.has_loops() {
            return self.hold_still(t, q, v, Projection::Unneeded);
        }
        let Some(correction) = self.motion.dynamics.project(t, q, v, &mechanism.scales) else {
            return Projection::Singular;
        };
        let corrections = self.motion.dynamics.corrections();
        let excess = self.phases.tolerances.excess(&mechanism.scales, &correction, corrections);
        if excess > 1.0 {
            Projection::TooLarge(excess)
        } else if !self.branch.holds(&self.motion.dynamics, mechanism, v) {
            Projection::Singular
        } else {
            let [positions, _] = corrections;
            let largest = mechanism.scales.largest_of_all(positions);
            self.largest_projection = self.largest_projection.max(largest);
            self.hold_still(t, q, v, Projection::Done)
        }
    }

    fn unseen_change(&mut self, t: f64, h: f64, nodes: &[f64], state: &mut StateInside) -> Option<f64> {
        self.inputs.unseen(&mut self.motion, Stretch { t, h, nodes }, &self.phases.tolerances, state)
    }

    fn wrap_angles(&mut self, q: &mut [f64]) {
        self.motion.wrap(q);
    }

    fn wants_dense(&mut self, step: &DenseStep) -> bool {
        let end = step.end_time();
        self.balance.may_check(step, &self.motion) || self.tracking.wants(end) || self.samples.wants(end)
    }

    fn accepted(&mut self, step: &DenseStep) -> Result<(), Status> {
        self.branch.go_on();
        let motion = &mut self.motion;
        if step.h > 0.0 {
            self.phases.log.accepted(step, motion);
            self.samples.accepted(step, motion);
            self.tracking.accepted(step, motion);
        }
        self.balance.accepted(step, motion);
        motion.goes_on(step.end_time())
    }
}
