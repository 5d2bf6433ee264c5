//! The log of events and contacts that a run keeps, an observer of its steps; it is cut where the sampled time begins.

use crate::dynamics::{SlotMotion, relative_motion};
use crate::integrators::StateAt;
use crate::integrators::dense::DenseStep;
use crate::run::contacts::{Contact, Event, EventKind, ForceSample, OpenContact, Place, Stick};
use crate::run::motion::Motion;
use crate::run::samples::Samples;

/// Events and contacts of a run so far, and what its warnings tell of every clearance joint.
pub(crate) struct ContactLog {
    pub(crate) events: Vec<Event>,
    /// The contact of every clearance joint, while it lasts.
    pub(crate) open: Vec<Option<OpenContact>>,
    closed: Vec<Contact>,
    /// Instant at which the sampled time begins after a skipped one [s], until then.
    cut_at: Option<f64>,
    /// State of the contacts that last from the skipped into the sampled time, when the latter began.
    cut: Vec<Contact>,
    /// Impacts that were slower than the floor of the impact velocity and damped as if at it.
    pub(crate) impacts_at_floor: Vec<usize>,
    /// Largest penetration at the start of a step [m].
    pub(crate) deepest: Vec<f64>,
    /// Time that the joint slides slower than the stick velocity of its friction law.
    pub(crate) sticks: Vec<Stick>,
}

impl ContactLog {
    /// An empty log of this many clearance joints, with the instant at which the sampled time begins after a skipped
    /// one [s].
    pub(crate) fn new(joints: usize, cut_at: Option<f64>) -> Self {
        Self {
            events: Vec::new(),
            open: vec![None; joints],
            closed: Vec::new(),
            cut_at,
            cut: Vec::new(),
            impacts_at_floor: vec![0; joints],
            deepest: vec![0.0; joints],
            sticks: vec![Stick::default(); joints],
        }
    }

    /// Records an event, and begins or ends the contact of its joint.
    pub(crate) fn record(&mut self, event: Event) {
        let Event { time, place, kind, normal_velocity } = event;
        self.events.push(event);
        let Place::Joint(joint) = place else { return };
        match kind {
            EventKind::Onset => self.open[joint] = Some(OpenContact::begin(joint, time, normal_velocity)),
            EventKind::Separation | EventKind::Transfer => {
                if let Some(OpenContact { contact, .. }) = self.open[joint].take() {
                    self.closed.push(Contact { separation: time, ..contact });
                }
            }
            // The rate of the force may jump, so the peak is not interpolated across this instant.
            EventKind::Clip | EventKind::Unclip | EventKind::Stick | EventKind::Slip | EventKind::Switch => {
                if let Some(open) = &mut self.open[joint] {
                    open.last = None;
                }
            }
        }
    }

    /// The contacts of the skipped and of the sampled time in the order of their onsets, including open ones.
    pub(crate) fn finished_contacts(&mut self, samples: &Samples) -> [Vec<Contact>; 2] {
        let mut contacts = std::mem::take(&mut self.closed);
        contacts.extend(self.open.iter().flatten().map(|open| open.contact));
        // A run may fail before its sampled time begins: all of its time is skipped then.
        let all = samples.skips(f64::NEG_INFINITY) && samples.taken == 0;
        let before = |contact: &Contact| all || samples.skips(contact.separation);
        let (mut skipped, mut sampled): (Vec<Contact>, Vec<Contact>) = contacts.into_iter().partition(before);
        skipped.append(&mut self.cut);
        for contacts in [&mut skipped, &mut sampled] {
            contacts.sort_by(|a, b| a.onset.total_cmp(&b.onset));
        }
        [skipped, sampled]
    }

    /// The events of the skipped and of the sampled time.
    pub(crate) fn finished_events(&mut self, samples: &Samples) -> [Vec<Event>; 2] {
        let before = |event: &Event| samples.skips(event.time);
        let (skipped, sampled) = std::mem::take(&mut self.events).into_iter().partition(before);
        [skipped, sampled]
    }

    /// Begins the sampled time in an accepted step that reaches it: the peaks of open contacts are counted anew.
    pub(crate) fn accepted(&mut self, step: &DenseStep, motion: &mut Motion) {
        let Some(t) = self.cut_at.take_if(|cut_at| *cut_at <= step.end_time()) else { return };
        motion.visit_inside(|motion| {
            motion.move_inside(step, t);
            self.watch_open_contacts(motion, t);
        });
        for open in self.open.iter_mut().flatten() {
            self.cut.push(open.contact);
            open.forget_peak();
        }
    }

    /// Records the force of an open contact, after [`Dynamics::accelerate`].
    pub(crate) fn watch_contact(&mut self, motion: &Motion, t: f64, index: usize) {
        let joint = &motion.mechanism.slots[index];
        let relative = motion.dynamics.slot_motion(joint);
        let acceleration = relative.acceleration.into();
        let phase = motion.dynamics.phases[index];
        let (state, rate) = joint.law.state_with_rate(&relative_motion(&relative), acceleration, phase);
        self.watch_force(motion, t, index, &relative, [state.normal_force, rate]);
    }

    /// Records a force [N] of an open contact and its rate [N/s].
    pub(crate) fn watch_force(
        &mut self,
        motion: &Motion,
        t: f64,
        index: usize,
        relative: &SlotMotion,
        [force, rate]: [f64; 2],
    ) {
        let law = &motion.mechanism.slots[index].law;
        let phase = motion.dynamics.phases[index];
        if let Some(open) = &mut self.open[index] {
            let acceleration = relative.acceleration.into();
            let sample =
                ForceSample { time: t, motion: relative_motion(relative), acceleration, force, rate };
            open.watch(sample, |motion| law.evaluate(motion, phase).normal_force);
        }
    }

    /// Records the forces of all open contacts in the state of the motion, from which no step starts.
    fn watch_open_contacts(&mut self, motion: &mut Motion, t: f64) {
        if self.open.iter().all(Option::is_none) {
            return;
        }
        motion.accelerate_at(t);
        for index in 0..self.open.len() {
            self.watch_contact(motion, t, index);
        }
    }

    /// Records the last forces of the contacts that are open at the end of the run.
    pub(crate) fn end(&mut self, motion: &mut Motion, t: f64, q: &[f64], v: &[f64]) {
        motion.q.copy_from_slice(q);
        motion.v.copy_from_slice(v);
        self.watch_open_contacts(motion, t);
    }

    /// Moves to the end of a phase of a joint and records the last force of its contact.
    pub(crate) fn end_phase(&mut self, motion: &mut Motion, index: usize, StateAt { t, q, v }: StateAt) {
        if self.open[index].is_none() {
            motion.dynamics.move_to(t, q, v);
            return;
        }
        motion.q.copy_from_slice(q);
        motion.v.copy_from_slice(v);
        motion.accelerate_at(t);
        self.watch_contact(motion, t, index);
    }
}
