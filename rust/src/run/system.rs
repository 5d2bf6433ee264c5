//! The system that the integrator integrates: a motion with its tolerances, guards and phases, and the observers of its
//! accepted steps.

use crate::contact::pair::{Phase, Surfaces};
use crate::dynamics::{Linearization, SlotContact, relative_motion};
use crate::integrators::dense::DenseStep;
use crate::integrators::events::Guard;
use crate::integrators::{HybridSystem, Limits, Projection, Status};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::instant::Instant;
use crate::run::contacts::dry_joints::{begin_dry_joints, cross_dry_joint, dry_guards};
use crate::run::contacts::guards::{GUARDS, StepDemands};
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::onset::{begin_contacts, onset};
use crate::run::contacts::sticking::{begin_friction, cross_stick, sticking_guards};
use crate::run::contacts::switches::{cross_switch, switch_guard};
use crate::run::contacts::{Event, EventKind, OpenContact, Place};
use crate::run::features::Plan;
use crate::run::motion::Motion;
use crate::run::outputs::{Column, Needs, asked_sectors};
use crate::run::restart::Memory;
use crate::run::samples::Samples;
use crate::run::settings::Settings;
use crate::run::tolerances::Tolerances;
use crate::run::tracking::Tracking;
use crate::run::warnings::{Notice, of_scene};
use crate::run::work::{Work, balance::Balance};
use crate::tree::elements::State;
use crate::tree::kinematics::Vec2;

/// First step of a run relative to the time in which the mechanism moves by its own size. Rejections shorten
/// a step that is too long; one that is too short grows fivefold per step.
const FIRST_STEP: f64 = 1e-3;

/// What a guard watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Watched {
    /// The gap of a slot, or the sign of its normal force.
    Contact { slot: usize, of_gap: bool },
    /// A switch of an expression or table.
    Switch(usize),
    /// Whether a slot sticks.
    Sticking(usize),
    /// Whether an ideal joint with friction sticks.
    DryJoint(usize),
}

/// A motion as a system for the integrator, with the observers of its steps.
pub(crate) struct System<'a> {
    pub(crate) motion: Motion<'a>,
    settings: &'a Settings,
    pub(crate) tolerances: Tolerances,
    /// What the contacts ask of the present step.
    demands: StepDemands,
    pub(crate) log: ContactLog,
    pub(crate) samples: Samples<'a>,
    pub(crate) tracking: Tracking,
    pub(crate) balance: Balance,
    /// Largest correction that closed the loops after a step [m].
    pub(crate) largest_projection: f64,
    /// Warnings that are known before the first step.
    pub(crate) warnings: Vec<Notice>,
    /// The slots whose friction can stick.
    sticking: Vec<usize>,
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
        let joints = mechanism.slots.len();
        let counts_work = Needs::of(&table.0).work || plan.needs.work;
        let mut motion = Motion::new(mechanism, counts_work, monitor);
        motion.work.sectors = asked_sectors(mechanism, table.0.iter().copied().chain(plan.columns()));
        let samples = Samples::new(settings, table, from);
        Self {
            motion,
            settings,
            tolerances: Tolerances::new(mechanism, start, settings),
            demands: StepDemands::new(joints),
            log: ContactLog::new(joints, (settings.skip > 0.0).then_some(samples.from)),
            tracking: Tracking::new(plan, settings, samples.from, mechanism.degrees_of_freedom()),
            balance: Balance::new(mechanism, settings, from),
            samples,
            largest_projection: 0.0,
            warnings: of_scene(mechanism),
            sticking: (0..joints).filter(|&slot| mechanism.slots[slot].law.stick_slip().is_some()).collect(),
        }
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

    /// Number of guards of the clearance joints; those of the switches follow, then those of
    /// slots that can stick and of ideal joints with friction.
    pub(crate) fn contact_guards(&self) -> usize {
        GUARDS * self.motion.dynamics.phases.len()
    }

    /// What a guard watches.
    pub(crate) fn watched(&self, guard: usize) -> Watched {
        let (contacts, switches) = (self.contact_guards(), self.motion.dynamics.switches.len());
        if guard < contacts {
            Watched::Contact { slot: guard / GUARDS, of_gap: guard.is_multiple_of(GUARDS) }
        } else if guard < contacts + switches {
            Watched::Switch(guard - contacts)
        } else {
            let place = guard - contacts - switches;
            let slot = self.sticking.get(place).map(|&slot| Watched::Sticking(slot));
            slot.unwrap_or_else(|| Watched::DryJoint(place - self.sticking.len()))
        }
    }

    /// Takes over the memory of the run that this one continues.
    pub(crate) fn recall(&mut self, memory: &Memory) {
        self.motion.dynamics.phases.clone_from(&memory.phases);
        self.motion.dynamics.set_tractions(&memory.tractions);
        self.motion.dynamics.turns.clone_from(&memory.turns);
        self.motion.inside.turns.clone_from(&memory.turns);
        self.log.open.clone_from(&memory.contacts);
        match &memory.work {
            Some(work) => {
                let sectors = std::mem::take(&mut self.motion.work.sectors);
                self.motion.work = Work { sectors, ..work.clone() };
            }
            None if self.motion.counts_work => self.forget_work(),
            None => {}
        }
    }

    /// Work and losses count from the start of the first run: they are NaN if one of the runs before did not
    /// integrate them.
    fn forget_work(&mut self) {
        let sectors = std::mem::take(&mut self.motion.work.sectors);
        self.motion.work =
            Work { sectors, ..Work::unknown(self.log.open.len(), self.motion.mechanism.dry_joints.len()) };
        self.warnings.push(Notice {
            code: "work_unknown",
            about: None,
            numbers: Vec::new(),
            text: "work and losses count from the first start on, and the run that ended at the given start did \
                   not count them: they are NaN; name one of them in the outputs of that run too"
                .to_owned(),
        });
    }

    /// The memory with which another run continues.
    pub(crate) fn memory(&self) -> Memory {
        let Motion { dynamics, work, counts_work, .. } = &self.motion;
        Memory {
            phases: dynamics.phases.clone(),
            tractions: dynamics.tractions().to_vec(),
            contacts: self.log.open.clone(),
            turns: dynamics.turns.clone(),
            work: (*counts_work && !work.input.is_nan())
                .then(|| Work { sectors: Vec::new(), ..work.clone() }),
        }
    }

    /// Sets the phases of the start and takes the first sample, if it is due.
    pub(crate) fn begin(&mut self, q: &mut [f64], v: &[f64]) {
        self.motion.settle(0.0, q, v);
        self.warnings.extend(begin_contacts(&mut self.motion, &self.tolerances, &mut self.log, q, v));
        begin_dry_joints(&mut self.motion, &self.tolerances, self.settings.rtol, (q, v));
        self.motion.work.begin(&mut self.motion.dynamics);
        self.motion.wrap(q);
        if self.samples.wants(0.0) {
            self.samples.take_state(&mut self.motion, 0.0, q, v);
        }
    }

    /// Bounds the next step and records penetrations and forces, after [`Dynamics::accelerate`].
    fn watch(&mut self, t: f64) {
        let mechanism = self.motion.mechanism;
        if t >= self.demands.next_break {
            self.demands.next_break = mechanism.next_break(t);
        }
        self.demands.bound = f64::INFINITY;
        (self.demands.velocity_refinement, self.demands.caution) = (1.0, 1.0);
        for index in 0..mechanism.slots.len() {
            self.watch_joint(t, index);
        }
    }

    /// The same for one clearance joint.
    // Not inlined: what the loop does not change would be loaded ahead of it and kept on the stack.
    #[inline(never)]
    fn watch_joint(&mut self, t: f64, index: usize) {
        let Self { motion, tolerances, demands, log, .. } = self;
        let joint = &motion.mechanism.slots[index];
        let relative = motion.dynamics.slot_motion(joint);
        let phase = motion.dynamics.phases[index];
        let presses = matches!(phase, Phase::Contact { clipped: false, .. });
        let acceleration = relative.acceleration.into();
        let (state, rate) = joint.law.state_with_rate(&relative_motion(&relative), acceleration, phase);
        log.deepest[index] = log.deepest[index].max(state.penetration);
        self.balance.watch_slide(motion, index, &state);
        demands.slides[index] = None;
        if presses && joint.law.is_steep(phase) {
            demands.slides[index] = Some(state.sliding_velocity);
            demands.refine_velocity(motion, tolerances, index, &state);
        }
        if joint.law.stick_velocity().is_some() {
            let sticks = demands.sticks_at_start(motion, index);
            log.sticks[index].advance(t, presses, sticks);
        }
        match phase {
            Phase::Beyond => {}
            Phase::Free => {
                // Half a clearance per step: the journal cannot cross the bearing without an event. Along a face the
                // bodies may slide as far as they like.
                let clearance = joint.law.clearance;
                let (rate, acceleration, clearance) = match joint.law.surfaces {
                    Surfaces::Bearing { .. } | Surfaces::Worn(_) => {
                        (relative.rate.norm(), relative.acceleration.norm(), clearance)
                    }
                    // Beyond the end of a face there is as much room as there is distance.
                    Surfaces::Face(face) if face.is_past_end(relative.eccentricity.into()) => {
                        let room = clearance.max(-state.penetration);
                        (relative.rate.norm(), relative.acceleration.norm(), room)
                    }
                    Surfaces::Face(face) => {
                        let along = relative.acceleration.dot(&Vec2::from(face.normal));
                        (state.penetration_rate.abs(), along.abs(), clearance)
                    }
                };
                // |ė| h + |ë| h²/2 = c/2
                let bound = clearance / (rate + (rate * rate + acceleration * clearance).sqrt());
                demands.bound = demands.bound.min(self.settings.refinement() * bound);
            }
            Phase::Contact { .. } => {
                log.watch_force(motion, t, index, &relative, [state.normal_force, rate]);
                demands.begin_with_caution(motion, log, tolerances, t, index);
            }
        }
    }

    /// Changes the phase of a slot where its gap or the sign of its normal force changes; returns a bound of the next step.
    fn cross_contact(
        &mut self,
        index: usize,
        of_gap: bool,
        (t, q, v): (f64, &[f64], &[f64]),
    ) -> Result<f64, Status> {
        self.log.end_phase(&mut self.motion, t, index, q, v);
        if of_gap && self.cross_end(index, t)? {
            return Ok(f64::INFINITY);
        }
        let mut normal_velocity = self.motion.dynamics.contact_state(index).penetration_rate;
        let mut bound = f64::INFINITY;
        let stored = self.spring_energy(index);
        let (kind, phase) = match (of_gap, self.motion.dynamics.phases[index]) {
            (true, Phase::Free) => {
                let onset = onset(&mut self.motion, &self.tolerances, self.settings.rtol, (t, q, v), index);
                self.log.impacts_at_floor[index] += usize::from(onset.is_at_floor);
                (bound, normal_velocity) = (onset.first_step, onset.impact_velocity);
                (EventKind::Onset, onset.phase)
            }
            (true, Phase::Contact { .. }) => (EventKind::Separation, Phase::Free),
            (false, Phase::Contact { latch, clipped, traction }) => {
                let kind = if clipped { EventKind::Unclip } else { EventKind::Clip };
                (kind, Phase::Contact { latch, clipped: !clipped, traction })
            }
            // The contact ended or passed to a neighbor at the same instant.
            (false, Phase::Free) | (_, Phase::Beyond) => return Ok(bound),
        };
        self.motion.dynamics.phases[index] = phase;
        if let EventKind::Onset | EventKind::Unclip = kind {
            self.motion.dynamics.settle_contact(index);
            begin_friction(&mut self.motion, &self.tolerances, index);
        }
        self.account_spring(index, stored);
        self.log.record(Event { time: t, place: Place::Joint(index), kind, normal_velocity });
        Ok(bound)
    }

    /// Passes a corner that reaches an end of its face on to its neighbor, with the contact if it has one; false if it is
    /// over its face. What leaves a guide altogether ends the run.
    fn cross_end(&mut self, index: usize, t: f64) -> Result<bool, Status> {
        let Motion { dynamics, mechanism, work, .. } = &mut self.motion;
        let slot = &mechanism.slots[index];
        let (Surfaces::Face(face), Some(neighbor)) = (&slot.law.surfaces, &slot.neighbor) else {
            return Ok(false);
        };
        let [[own, _], [far, _]] = dynamics.ends_ahead(slot, face, neighbor);
        let SlotContact { motion, state } = dynamics.contact_of(slot, dynamics.phases[index]);
        if state.penetration.abs() < own.min(far) {
            return Ok(false);
        }
        if far < own {
            return Err(Status::LeftGuide);
        }
        let carried = dynamics.carried_energy(index);
        let mut phase = dynamics.phases[index];
        if let Phase::Contact { traction: Some(traction), .. } = &mut phase
            && traction.sticks()
        {
            let force = slot.law.spring_force(traction, &motion, state.friction_force);
            *traction = dynamics.anchored(&mechanism.slots[neighbor.slot], force, *traction);
        }
        dynamics.phases[index] = Phase::Beyond;
        dynamics.phases[neighbor.slot] = phase;
        dynamics.settle_contact(neighbor.slot);
        work.contacts[index].friction -= carried;
        work.contacts[neighbor.slot].friction += carried;
        if phase.touches() {
            let (place, normal_velocity) = (Place::Joint(index), state.penetration_rate);
            self.log.record(Event { time: t, place, kind: EventKind::Transfer, normal_velocity });
            self.log.open[neighbor.slot] = Some(OpenContact::begin(neighbor.slot, t, f64::NAN));
        }
        Ok(true)
    }

    /// Lets a slot slide that stuck, or stick that slid.
    fn cross_stick(&mut self, index: usize, (t, q, v): (f64, &[f64], &[f64])) {
        self.log.end_phase(&mut self.motion, t, index, q, v);
        let normal_velocity = self.motion.dynamics.contact_state(index).penetration_rate;
        let stored = self.spring_energy(index);
        // The contact may have ended at the same instant.
        if let Some(kind) = cross_stick(&mut self.motion, index) {
            self.account_spring(index, stored);
            self.log.record(Event { time: t, place: Place::Joint(index), kind, normal_velocity });
        }
    }

    /// Energy of the tangential spring of a slot that sticks in the present state [J].
    fn spring_energy(&self, index: usize) -> f64 {
        let dynamics = &self.motion.dynamics;
        let energy = dynamics.spring_energy(&self.motion.mechanism.slots[index], dynamics.phases[index]);
        energy - dynamics.carried_energy(index)
    }

    /// Counts as friction what the tangential spring of a slot lost in a change of phase, with the energy that it `stored`
    /// before [J].
    fn account_spring(&mut self, index: usize, stored: f64) {
        let lost = stored - self.spring_energy(index);
        if lost != 0.0 {
            self.motion.work.contacts[index].friction += lost;
            self.balance.forget_state();
        }
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
        self.motion.dynamics.accelerate(a);
        self.watch(t);
        self.balance.begin(t);
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        self.tolerances.in_phases(self.motion.mechanism, &self.motion.dynamics.phases, position, velocity);
    }

    fn next_break(&self) -> f64 {
        self.demands.next_break
    }

    fn step_bound(&self) -> f64 {
        self.demands.bound
    }

    fn guard_count(&self) -> usize {
        self.contact_guards()
            + self.motion.dynamics.switches.len()
            + self.sticking.len()
            + self.motion.mechanism.dry_joints.len()
    }

    fn guards(&mut self, t: Instant, q: &[f64], v: &[f64], guards: &mut [Guard]) {
        let is_inside = self.motion.dynamics.instant() != t;
        let moved = self.motion.guarded(is_inside);
        // The last stage of a method may have been evaluated in this state.
        if !moved.is_at(t, q, v) {
            moved.move_to(t, q, v);
        }
        self.demands.breaks_away = false;
        self.demands.velocity_refinement = 1.0;
        let (of_contacts, others) = guards.split_at_mut(self.contact_guards());
        let (of_joints, _) = of_contacts.as_chunks_mut();
        for (index, of_joint) in of_joints.iter_mut().enumerate() {
            *of_joint = self.demands.joint_guards(&self.motion, &self.tolerances, is_inside, index);
        }
        for (index, of_switch) in (0..self.motion.dynamics.switches.len()).zip(others) {
            *of_switch = switch_guard(&self.motion, &self.tolerances, is_inside, index);
        }
        let dry_joints = self.motion.mechanism.dry_joints.len();
        let (others, of_dry_joints) = guards.split_at_mut(guards.len() - dry_joints);
        let limits = (&self.tolerances, self.settings.rtol);
        if !self.sticking.is_empty() {
            sticking_guards(&mut self.motion, &self.sticking, limits, (t, q, v), others);
        }
        if dry_joints > 0 {
            dry_guards(&mut self.motion, limits, is_inside, (t, q, v), of_dry_joints);
        }
    }

    fn is_beyond_kink(&self) -> bool {
        self.demands.breaks_away
    }

    fn velocity_refinement(&self) -> f64 {
        self.demands.velocity_refinement
    }

    fn caution(&self) -> f64 {
        self.demands.caution
    }

    fn cross(&mut self, guard: usize, t: f64, q: &[f64], v: &[f64]) -> Result<f64, Status> {
        self.tracking.interrupt();
        match self.watched(guard) {
            Watched::Contact { slot, of_gap } => self.cross_contact(slot, of_gap, (t, q, v)),
            Watched::Switch(switch) => cross_switch(&mut self.motion, &mut self.log, switch, (t, q, v)),
            Watched::Sticking(slot) => {
                self.cross_stick(slot, (t, q, v));
                Ok(f64::INFINITY)
            }
            Watched::DryJoint(joint) => {
                cross_dry_joint(&mut self.motion, &mut self.log, &self.tolerances, joint, (t, q, v));
                self.balance.forget_state();
                Ok(f64::INFINITY)
            }
        }
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
        self.motion.wrap(q);
    }

    fn wants_dense(&mut self, step: &DenseStep) -> bool {
        let end = step.end_time();
        self.balance.may_check(step, &self.motion) || self.tracking.wants(end) || self.samples.wants(end)
    }

    fn accepted(&mut self, step: &DenseStep) -> bool {
        let motion = &mut self.motion;
        if step.h > 0.0 {
            self.log.accepted(step, motion);
            self.samples.accepted(step, motion);
            self.tracking.accepted(step, motion);
        }
        self.balance.accepted(step, motion);
        (motion.monitor)(step.end_time())
    }
}
