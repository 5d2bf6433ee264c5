//! What contacts, switches and dry friction ask of the integrator: what a step may do, their guards, and the changes of
//! phase at the zeros of these.

use crate::contact::pair::{Phase, Surfaces};
use crate::dynamics::{SlotContact, relative_motion};
use crate::error::Notice;
use crate::integrators::events::Guard;
use crate::integrators::{StateAt, Status};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::instant::Instant;
use crate::run::contacts::dry_joints::{begin_dry_joints, cross_dry_joint, dry_guard, find_held};
use crate::run::contacts::guards::{GUARDS, StepDemands};
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::onset::{begin_contacts, onset};
use crate::run::contacts::sticking::{begin_friction, cross_stick, sticking_guards};
use crate::run::contacts::switches::{cross_switch, switch_guard};
use crate::run::contacts::{Event, EventKind, OpenContact, Place};
use crate::run::motion::Motion;
use crate::run::settings::Settings;
use crate::run::tolerances::Tolerances;
use crate::run::work::balance::Balance;
use crate::tree::elements::State;
use crate::tree::kinematics::Vec2;

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

/// How the motion goes on after a change of phase.
pub(crate) struct Crossing {
    /// Bound of the next step [s].
    pub(crate) bound: f64,
    /// Whether energies jump.
    pub(crate) has_jump: bool,
}

/// The phases of a run, with the log of their changes.
pub(crate) struct Phases<'a> {
    settings: &'a Settings,
    pub(crate) tolerances: Tolerances,
    /// What the contacts ask of the present step.
    pub(crate) demands: StepDemands,
    pub(crate) log: ContactLog,
    /// The slots whose friction can stick.
    sticking: Vec<usize>,
}

impl<'a> Phases<'a> {
    /// The phases of a mechanism whose sampled time begins at an instant [s].
    pub(crate) fn new(mechanism: &Mechanism, start: &State, settings: &'a Settings, from: f64) -> Self {
        let joints = mechanism.slots.len();
        Self {
            settings,
            tolerances: Tolerances::new(mechanism, start, settings),
            demands: StepDemands::new(joints),
            log: ContactLog::new(joints, (settings.skip > 0.0).then_some(from)),
            sticking: (0..joints).filter(|&slot| mechanism.slots[slot].law.stick_slip().is_some()).collect(),
        }
    }

    /// Sets those of the start; returns what should be checked.
    pub(crate) fn begin(&mut self, motion: &mut Motion, q: &[f64], v: &[f64]) -> Vec<Notice> {
        let warnings = begin_contacts(motion, &self.tolerances, &mut self.log, q, v);
        begin_dry_joints(motion, &self.tolerances, (q, v));
        warnings
    }

    /// Number of guards: of the clearance joints, then of the switches, of slots that can stick, and of ideal joints with
    /// friction.
    pub(crate) fn guard_count(&self, motion: &Motion) -> usize {
        let dynamics = &motion.dynamics;
        GUARDS * dynamics.phases.len()
            + dynamics.switches.len()
            + self.sticking.len()
            + motion.mechanism.dry_joints.len()
    }

    /// The guard of a switch.
    pub(crate) fn guard_of_switch(motion: &Motion, switch: usize) -> usize {
        GUARDS * motion.dynamics.phases.len() + switch
    }

    /// What a guard watches.
    pub(crate) fn watched(&self, motion: &Motion, guard: usize) -> Watched {
        let [first, end] = [0, motion.dynamics.switches.len()].map(|of| Self::guard_of_switch(motion, of));
        if guard < first {
            Watched::Contact { slot: guard / GUARDS, of_gap: guard.is_multiple_of(GUARDS) }
        } else if guard < end {
            Watched::Switch(guard - first)
        } else {
            let slot = self.sticking.get(guard - end).map(|&slot| Watched::Sticking(slot));
            slot.unwrap_or_else(|| Watched::DryJoint(guard - end - self.sticking.len()))
        }
    }

    /// The guards in a state inside the step or at its end.
    pub(crate) fn guards(
        &mut self,
        motion: &mut Motion,
        t: Instant,
        (q, v): (&[f64], &[f64]),
        guards: &mut [Guard],
    ) {
        let is_inside = motion.dynamics.instant() != t;
        let moved = motion.guarded(is_inside);
        // The last stage of a method may have been evaluated in this state.
        if !moved.is_at(t, q, v) {
            moved.move_to(t, q, v);
        }
        self.demands.breaks_away = false;
        self.demands.velocity_refinement = 1.0;
        let (of_contacts, others) = guards.split_at_mut(Self::guard_of_switch(motion, 0));
        let (of_joints, _) = of_contacts.as_chunks_mut();
        for (index, of_joint) in of_joints.iter_mut().enumerate() {
            *of_joint = self.demands.joint_guards(motion, &self.tolerances, is_inside, index);
        }
        for (index, of_switch) in (0..motion.dynamics.switches.len()).zip(others) {
            *of_switch = switch_guard(motion, &self.tolerances, is_inside, index);
        }
        let dry_joints = motion.mechanism.dry_joints.len();
        let (others, of_dry_joints) = guards.split_at_mut(guards.len() - dry_joints);
        let limits = (&self.tolerances, self.settings.rtol);
        if !self.sticking.is_empty() {
            sticking_guards(motion, &self.sticking, limits, (t, q, v), others);
        }
        if !of_dry_joints.is_empty() {
            let found = find_held(motion, is_inside);
            for (index, of_joint) in of_dry_joints.iter_mut().enumerate() {
                *of_joint = dry_guard(motion, &self.tolerances, is_inside, index);
                if !found && motion.dynamics.joint_phases()[index].sticks() {
                    // What held it is lost.
                    of_joint.value = f64::NEG_INFINITY;
                }
            }
        }
    }

    /// Bounds the next step and records penetrations and forces, after [`Dynamics::accelerate`].
    pub(crate) fn watch(&mut self, motion: &mut Motion, balance: &mut Balance, t: f64) {
        if t >= self.demands.next_break {
            self.demands.next_break = motion.mechanism.next_break(t);
        }
        self.demands.bound = f64::INFINITY;
        (self.demands.velocity_refinement, self.demands.caution) = (1.0, 1.0);
        for index in 0..motion.mechanism.slots.len() {
            self.watch_joint(motion, balance, t, index);
        }
    }

    /// Largest rate at which the damping of a contact brakes at the start of the step [1/s].
    pub(crate) fn braking_rate(&self, motion: &Motion) -> f64 {
        let rate = |(index, phase): (usize, &Phase)| match *phase {
            Phase::Contact { latch, clipped: false, .. } => {
                let law = &motion.mechanism.slots[index].law.normal;
                law.damping_in(self.demands.pressed[index], latch)
                    / motion.mechanism.scales.contacts[index].mass
            }
            _ => 0.0,
        };
        motion.dynamics.phases.iter().enumerate().map(rate).fold(0.0, f64::max)
    }

    /// The same for one clearance joint.
    // Not inlined: what the loop does not change would be loaded ahead of it and kept on the stack.
    #[inline(never)]
    fn watch_joint(&mut self, motion: &mut Motion, balance: &mut Balance, t: f64, index: usize) {
        let Self { settings, tolerances, demands, log, .. } = self;
        let joint = &motion.mechanism.slots[index];
        let relative = motion.dynamics.slot_motion(joint);
        let phase = motion.dynamics.phases[index];
        let presses = matches!(phase, Phase::Contact { clipped: false, .. });
        let acceleration = relative.acceleration.into();
        let (state, rate) = joint.law.state_with_rate(&relative_motion(&relative), acceleration, phase);
        log.deepest[index] = log.deepest[index].max(state.penetration);
        balance.watch_slide(motion, index, &state);
        demands.slides[index] = None;
        demands.pressed[index] = [state.penetration, state.normal_force];
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
                // bodies may slide as far as they like, and before it there is as much room as there is distance.
                let clearance = joint.law.clearance;
                let room = clearance.max(-state.penetration);
                let (rate, acceleration, room) = match joint.law.surfaces {
                    Surfaces::Bearing { .. } | Surfaces::Worn(_) => {
                        (relative.rate.norm(), relative.acceleration.norm(), clearance)
                    }
                    Surfaces::Face(face) if face.is_past_end(relative.eccentricity.into()) => {
                        (relative.rate.norm(), relative.acceleration.norm(), room)
                    }
                    Surfaces::Face(face) => {
                        let along = relative.acceleration.dot(&Vec2::from(face.normal));
                        (state.penetration_rate.abs(), along.abs(), room)
                    }
                };
                // |ė| h + |ë| h²/2 = c/2
                let bound = room / (rate + (rate * rate + acceleration * room).sqrt());
                demands.bound = demands.bound.min(settings.refinement() * bound);
            }
            Phase::Contact { .. } => {
                log.watch_force(motion, t, index, &relative, [state.normal_force, rate]);
                demands.begin_with_caution(motion, log, tolerances, t, index);
            }
        }
    }

    /// Changes the phase where a guard is zero.
    ///
    /// # Errors
    /// Why the motion cannot go on beyond it.
    pub(crate) fn cross(
        &mut self,
        motion: &mut Motion,
        guard: usize,
        (t, q, v): (f64, &[f64], &mut [f64]),
    ) -> Result<Crossing, Status> {
        let at = StateAt { t, q, v: &*v };
        match self.watched(motion, guard) {
            Watched::Contact { slot, of_gap } => self.cross_contact(motion, slot, of_gap, at),
            Watched::Switch(switch) => {
                let bound = cross_switch(motion, &mut self.log, switch, at)?;
                Ok(Crossing { bound, has_jump: false })
            }
            Watched::Sticking(slot) => Ok(self.cross_stick(motion, slot, at)),
            Watched::DryJoint(joint) => {
                cross_dry_joint(motion, &mut self.log, &self.tolerances, joint, (t, q, v))?;
                Ok(Crossing { bound: f64::INFINITY, has_jump: true })
            }
        }
    }

    /// Changes the phase of a slot where its gap or the sign of its normal force changes.
    fn cross_contact(
        &mut self,
        motion: &mut Motion,
        index: usize,
        of_gap: bool,
        at: StateAt,
    ) -> Result<Crossing, Status> {
        let t = at.t;
        self.log.end_phase(motion, index, at);
        let mut crossing = Crossing { bound: f64::INFINITY, has_jump: false };
        if of_gap && self.cross_end(motion, index, t)? {
            return Ok(crossing);
        }
        let mut normal_velocity = motion.dynamics.contact_state(index).penetration_rate;
        let stored = spring_energy(motion, index);
        let (kind, phase) = match (of_gap, motion.dynamics.phases[index]) {
            (true, Phase::Free) => {
                let onset = onset(motion, &self.tolerances, self.settings.rtol, at, index);
                self.log.impacts_at_floor[index] += usize::from(onset.is_at_floor);
                (crossing.bound, normal_velocity) = (onset.first_step, onset.impact_velocity);
                (EventKind::Onset, onset.phase)
            }
            (true, Phase::Contact { .. }) => (EventKind::Separation, Phase::Free),
            (false, Phase::Contact { latch, clipped, traction }) => {
                let kind = if clipped { EventKind::Unclip } else { EventKind::Clip };
                (kind, Phase::Contact { latch, clipped: !clipped, traction })
            }
            // The contact ended or passed to a neighbor at the same instant.
            (false, Phase::Free) | (_, Phase::Beyond) => return Ok(crossing),
        };
        motion.dynamics.phases[index] = phase;
        if let EventKind::Onset | EventKind::Unclip = kind {
            motion.dynamics.settle_contact(index);
            begin_friction(motion, &self.tolerances, index);
        }
        crossing.has_jump = account_spring(motion, index, stored);
        self.log.record(Event { time: t, place: Place::Joint(index), kind, normal_velocity });
        Ok(crossing)
    }

    /// Passes a corner that reaches an end of its face on to its neighbor, with the contact if it has one; false if it is
    /// over its face. What leaves a guide altogether ends the run.
    fn cross_end(&mut self, motion: &mut Motion, index: usize, t: f64) -> Result<bool, Status> {
        let Motion { dynamics, mechanism, work, .. } = motion;
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
    fn cross_stick(&mut self, motion: &mut Motion, index: usize, at: StateAt) -> Crossing {
        self.log.end_phase(motion, index, at);
        let normal_velocity = motion.dynamics.contact_state(index).penetration_rate;
        let stored = spring_energy(motion, index);
        // The contact may have ended at the same instant.
        let has_jump = cross_stick(motion, index).is_some_and(|kind| {
            let has_jump = account_spring(motion, index, stored);
            self.log.record(Event { time: at.t, place: Place::Joint(index), kind, normal_velocity });
            has_jump
        });
        Crossing { bound: f64::INFINITY, has_jump }
    }
}

/// Energy of the tangential spring of a slot that sticks in the present state [J].
fn spring_energy(motion: &Motion, index: usize) -> f64 {
    let dynamics = &motion.dynamics;
    let energy = dynamics.spring_energy(&motion.mechanism.slots[index], dynamics.phases[index]);
    energy - dynamics.carried_energy(index)
}

/// Counts as friction what the tangential spring of a slot lost in a change of phase, with the energy that it `stored`
/// before [J]; returns whether it did.
fn account_spring(motion: &mut Motion, index: usize, stored: f64) -> bool {
    let lost = stored - spring_energy(motion, index);
    if lost != 0.0 {
        motion.work.contacts[index].friction += lost;
    }
    lost != 0.0
}
