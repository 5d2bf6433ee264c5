//! The system that the integrator integrates: tolerances, guards and phases of a mechanism, and the samples
//! of a run.

use crate::contact::clearance::Phase;
use crate::dynamics::{Linearization, relative_motion};
use crate::integrators::dense::DenseStep;
use crate::integrators::events::Guard;
use crate::integrators::{HybridSystem, Limits, Projection};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::instant::Instant;
use crate::run::contacts::guards::StepDemands;
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Event, EventKind};
use crate::run::features::Plan;
use crate::run::motion::Motion;
use crate::run::outputs::{Column, Needs};
use crate::run::restart::Memory;
use crate::run::samples::Samples;
use crate::run::settings::Settings;
use crate::run::tolerances::Tolerances;
use crate::run::tracking::Tracking;
use crate::run::work::Work;
use crate::run::work::balance::Balance;
use crate::tree::elements::State;

/// First step of a run relative to the time in which the mechanism moves by its own size. Rejections shorten
/// a step that is too long; one that is too short grows fivefold per step.
const FIRST_STEP: f64 = 1e-3;

/// Guards of a clearance joint: the gap, and the sign of the normal force.
pub(crate) const GUARDS: usize = 2;

/// The mechanism as a system for the integrator, which takes the samples of a run.
pub(crate) struct Recorder<'a> {
    pub(crate) motion: Motion<'a>,
    pub(crate) settings: &'a Settings,
    pub(crate) monitor: &'a dyn Fn(f64) -> bool,
    pub(crate) tolerances: Tolerances,
    pub(crate) samples: Samples<'a>,
    /// What must be computed for samples, and the work if a feature needs it.
    pub(crate) needs: Needs,
    pub(crate) log: ContactLog,
    /// What the contacts ask of the present step.
    pub(crate) step: StepDemands,
    pub(crate) work: Work,
    /// The work up to the present step, while `work` holds that up to a sample inside it.
    work_of_steps: Work,
    /// Error of the energy balance over the steps.
    pub(crate) balance: Balance,
    /// Quantities that are tracked for features.
    pub(crate) tracking: Tracking,
    /// Largest correction that closed the loops after a step [m].
    pub(crate) largest_projection: f64,
    /// Samples near a change point, where forces in the loops are not known.
    pub(crate) unknown_samples: usize,
    pub(crate) warnings: Vec<String>,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(
        mechanism: &'a Mechanism,
        start: &State,
        settings: &'a Settings,
        table: (Vec<Column>, &'a mut [f64]),
        plan: Plan,
        monitor: &'a dyn Fn(f64) -> bool,
        from: f64,
    ) -> Self {
        let d = mechanism.degrees_of_freedom();
        let joints = mechanism.clearance_joints.len();
        let needs = Needs::of(&table.0);
        // Energies are differences of terms of this size, whatever of it is exchanged.
        let mass: f64 = mechanism.bodies.iter().map(|body| body.mass).sum();
        let energy = 0.5 * mass * mechanism.scales.speed * mechanism.scales.speed;
        let samples = Samples::new(settings, table, from);
        let tracking = Tracking::new(plan, settings, samples.from, d);
        Self {
            motion: Motion::new(mechanism),
            settings,
            monitor,
            tolerances: Tolerances::new(mechanism, start, settings),
            samples,
            needs: Needs { work: needs.work || tracking.needs_work(), ..needs },
            log: ContactLog::new(joints),
            step: StepDemands::new(joints),
            work: Work::new(joints),
            work_of_steps: Work::default(),
            balance: Balance::new(joints, settings.rtol, energy),
            tracking,
            largest_projection: 0.0,
            unknown_samples: 0,
            warnings: Vec::new(),
        }
    }

    /// Takes the next sample in a given state.
    pub(crate) fn sample_state(&mut self, t: f64, q: &[f64], v: &[f64]) {
        self.motion.q.copy_from_slice(q);
        self.motion.v.copy_from_slice(v);
        self.sample(t);
    }

    /// Limits of the integration.
    pub(crate) fn limits(&self) -> Limits {
        let scales = &self.motion.mechanism.scales;
        let crossing = FIRST_STEP * scales.length / scales.speed;
        // If nothing moves, relative to the duration of the run.
        let whole = FIRST_STEP * (self.settings.skip + self.settings.duration);
        let first_step = self.settings.refinement() * if crossing.is_finite() { crossing } else { whole };
        let first_step = self.settings.limits.first_step.or(Some(first_step));
        Limits { first_step, ..self.settings.limits }
    }

    /// Takes over the memory of the run that this one continues.
    pub(crate) fn recall(&mut self, memory: &Memory) {
        self.warn_of_scene();
        self.motion.dynamics.phases.clone_from(&memory.phases);
        self.motion.dynamics.turns.clone_from(&memory.turns);
        self.log.open.clone_from(&memory.contacts);
        match &memory.work {
            Some(work) => self.work.clone_from(work),
            None if self.needs.work => self.forget_work(),
            None => {}
        }
    }

    /// Work and losses count from the start of the first run: they are NaN if one of the runs before did not
    /// integrate them.
    fn forget_work(&mut self) {
        self.work = Work::unknown(self.log.open.len());
        self.warnings.push(
            "work and losses count from the first start on, and the run that ended at the given start did not \
             count them: they are NaN; name one of them in the outputs of that run too"
                .to_owned(),
        );
    }

    /// The memory with which another run continues.
    pub(crate) fn memory(&self) -> Memory {
        Memory {
            phases: self.motion.dynamics.phases.clone(),
            contacts: self.log.open.clone(),
            turns: self.motion.dynamics.turns.clone(),
            work: (self.needs.work && !self.work.input.is_nan()).then(|| self.work.clone()),
        }
    }

    /// Sets the phases of the start and takes the first sample, if it is due.
    pub(crate) fn begin(&mut self, q: &mut [f64], v: &[f64]) {
        self.warn_of_scene();
        self.begin_contacts(q, v);
        self.work.begin(&mut self.motion.dynamics);
        self.motion.unwind(q);
        if self.samples.next_due().is_some_and(|due| due <= 0.0) {
            self.sample_state(0.0, q, v);
        }
    }

    /// Writes the next row of samples from the state in `self.motion.q`, `self.motion.v`.
    fn sample(&mut self, t: f64) {
        self.motion.place(t, self.needs);
        let asked = self.needs.reactions || self.needs.acceleration;
        self.unknown_samples += usize::from(asked && self.motion.dynamics.is_near_change_point());
        self.samples.take(&self.motion.dynamics, &self.work);
    }

    /// Bounds the next step and records penetrations and forces, after [`Dynamics::accelerate`].
    fn watch(&mut self, t: f64) {
        let mechanism = self.motion.mechanism;
        if t >= self.step.next_break {
            self.step.next_break = mechanism.next_break(t);
        }
        self.step.bound = f64::INFINITY;
        (self.step.velocity_refinement, self.step.caution) = (1.0, 1.0);
        for index in 0..mechanism.clearance_joints.len() {
            self.watch_joint(t, index);
        }
    }

    /// The same for one clearance joint.
    // Not inlined: what the loop does not change would be loaded ahead of it and kept on the stack.
    #[inline(never)]
    fn watch_joint(&mut self, t: f64, index: usize) {
        let joint = &self.motion.mechanism.clearance_joints[index];
        let motion = self.motion.dynamics.joint_motion(joint);
        let phase = self.motion.dynamics.phases[index];
        let presses = matches!(phase, Phase::Contact { clipped: false, .. });
        let acceleration = motion.acceleration.into();
        let (state, rate) = joint.law.state_with_rate(&relative_motion(&motion), acceleration, phase);
        self.log.deepest[index] = self.log.deepest[index].max(state.penetration);
        self.watch_slide(index, &state);
        self.step.slides[index] = None;
        if presses && joint.law.friction.is_some() {
            self.step.slides[index] = Some(state.sliding_velocity);
            self.refine_velocity(index, &state);
        }
        if joint.law.stick_velocity().is_some() {
            let sticks = self.sticks_at_start(index);
            self.log.sticks[index].advance(t, presses, sticks);
        }
        match phase {
            Phase::Free => {
                // Half a clearance per step: the journal cannot cross the bearing without an event.
                let (rate, acceleration) = (motion.rate.norm(), motion.acceleration.norm());
                let clearance = joint.law.clearance;
                // |ė| h + |ë| h²/2 = c/2
                let bound = clearance / (rate + (rate * rate + acceleration * clearance).sqrt());
                self.step.bound = self.step.bound.min(self.settings.refinement() * bound);
            }
            Phase::Contact { .. } => {
                self.watch_force(t, index, &motion, [state.normal_force, rate]);
                self.begin_with_caution(t, index);
            }
        }
    }
}

impl Recorder<'_> {
    /// Visits states inside the last step.
    pub(crate) fn visit_inside(&mut self, visit: impl FnOnce(&mut Self)) {
        self.motion.enter_step();
        visit(self);
        self.motion.leave_step();
    }

    /// Takes the samples that are due in a step.
    fn take_samples(&mut self, step: &DenseStep) {
        let end = step.end_time();
        while let Some(t) = self.samples.next_due().filter(|&due| due <= end) {
            if self.needs.work {
                // Saved, so that the sum over the steps does not depend on the samples.
                self.work_of_steps.clone_from(&self.work);
                self.add_work_of(step, t);
            }
            self.motion.move_inside(step, t);
            if !self.samples.have_begun() && self.settings.skip > 0.0 {
                self.cut_contacts(t);
            }
            self.sample(t);
            if self.needs.work {
                std::mem::swap(&mut self.work, &mut self.work_of_steps);
            }
        }
    }

    /// Tracks the quantities of features through a step.
    fn track(&mut self, step: &DenseStep) {
        self.track_to(step.end_time(), &mut |recorder, t, q, v| {
            if recorder.tracking.needs_work() {
                recorder.add_work_of(step, t);
            }
            recorder.motion.state_inside(step, t, q, v);
            true
        });
    }
}

impl HybridSystem for Recorder<'_> {
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
        self.motion.dynamics.accelerate(a);
        self.watch(t);
        self.begin_energy_check(t);
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        self.tolerances.in_phases(self.motion.mechanism, &self.motion.dynamics.phases, position, velocity);
    }

    fn next_break(&self) -> f64 {
        self.step.next_break
    }

    fn step_bound(&self) -> f64 {
        self.step.bound
    }

    fn guard_count(&self) -> usize {
        GUARDS * self.motion.dynamics.phases.len()
    }

    fn guards(&mut self, t: Instant, q: &[f64], v: &[f64], guards: &mut [Guard]) {
        let is_inside = self.motion.dynamics.instant() != t;
        let moved = if is_inside { &mut self.motion.inside } else { &mut self.motion.dynamics };
        // The last stage of a method may have been evaluated in this state.
        if !moved.is_at(t, q, v) {
            moved.move_to(t, q, v);
        }
        self.step.breaks_away = false;
        self.step.velocity_refinement = 1.0;
        let (of_joints, _) = guards.as_chunks_mut();
        for (index, of_joint) in of_joints.iter_mut().enumerate() {
            *of_joint = self.joint_guards(is_inside, index);
        }
    }

    fn is_beyond_kink(&self) -> bool {
        self.step.breaks_away
    }

    fn velocity_refinement(&self) -> f64 {
        self.step.velocity_refinement
    }

    fn caution(&self) -> f64 {
        self.step.caution
    }

    fn cross(&mut self, guard: usize, t: f64, q: &[f64], v: &[f64]) -> f64 {
        let index = guard / GUARDS;
        self.end_phase(t, index, q, v);
        let mut normal_velocity = self.motion.dynamics.contact_state(index).penetration_rate;
        let mut bound = f64::INFINITY;
        let (kind, phase) = match (guard % GUARDS, self.motion.dynamics.phases[index]) {
            (0, Phase::Free) => {
                let onset = self.onset(t, q, v, index);
                (bound, normal_velocity) = (onset.first_step, onset.impact_velocity);
                (EventKind::Onset, onset.phase)
            }
            (0, Phase::Contact { .. }) => (EventKind::Separation, Phase::Free),
            (_, Phase::Contact { latch, clipped }) => {
                let kind = if clipped { EventKind::Unclip } else { EventKind::Clip };
                (kind, Phase::Contact { latch, clipped: !clipped })
            }
            // The contact ended at the same instant.
            (_, Phase::Free) => return bound,
        };
        self.motion.dynamics.phases[index] = phase;
        self.log.record(Event { time: t, joint: index, kind, normal_velocity });
        bound
    }

    fn first_step(&self, last: f64) -> f64 {
        // The steps of a contact are far too short for a flight, of which half a clearance bounds the steps.
        let flies = self.motion.dynamics.phases.iter().all(|phase| matches!(phase, Phase::Free));
        if flies { f64::INFINITY } else { last }
    }

    fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64]) -> Projection {
        let mechanism = self.motion.mechanism;
        if mechanism.closures.is_empty() {
            return Projection::Unneeded;
        }
        let Some(correction) = self.motion.dynamics.project(t, q, v, &mechanism.scales) else {
            return Projection::Singular;
        };
        let excess = self.tolerances.excess(&correction, mechanism.scales.speed);
        if excess <= 1.0 {
            self.largest_projection = self.largest_projection.max(correction.position);
            Projection::Done
        } else {
            Projection::TooLarge(excess)
        }
    }

    fn wrap_angles(&mut self, q: &mut [f64]) {
        self.motion.unwind(q);
    }

    fn wants_dense(&mut self, step: &DenseStep) -> bool {
        let end = step.end_time();
        self.may_check_energy(step)
            || self.tracking.wants(end)
            || self.samples.next_due().is_some_and(|due| due <= end)
    }

    fn accepted(&mut self, step: &DenseStep) -> bool {
        let end = step.end_time();
        if step.h > 0.0 {
            if self.samples.next_due().is_some_and(|due| due <= end) {
                self.visit_inside(|recorder| recorder.take_samples(step));
            }
            if self.tracking.wants(end) {
                self.visit_inside(|recorder| recorder.track(step));
            }
        }
        self.check_energy(step);
        (self.monitor)(end)
    }
}
