//! The log of events and contacts that a run keeps, cut where the sampled time begins.

use crate::dynamics::relative_motion;
use crate::run::contacts::{Contact, Event, ForceSample};
use crate::run::recorder::Recorder;

impl Recorder<'_> {
    /// Records the force of an open contact, after [`Dynamics::accelerate`].
    pub(crate) fn watch_contact(&mut self, t: f64, index: usize) {
        let joint = &self.mechanism.clearance_joints[index];
        let (phase, Some(open)) = (self.dynamics.phases[index], &mut self.open_contacts[index]) else {
            return;
        };
        let motion = self.dynamics.joint_motion(joint);
        let relative = relative_motion(&motion);
        let acceleration = motion.acceleration.into();
        let [force, rate] = joint.law.normal_force_with_rate(&relative, acceleration, phase);
        let sample = ForceSample { time: t, motion: relative, acceleration, force, rate };
        open.watch(sample, |motion| joint.law.evaluate(motion, phase).normal_force);
    }

    /// Records the forces of all open contacts in the state in `self.q`, `self.v`, from which no step starts.
    fn watch_open_contacts(&mut self, t: f64) {
        if self.open_contacts.iter().all(Option::is_none) {
            return;
        }
        self.accelerate_at(t);
        for index in 0..self.open_contacts.len() {
            self.watch_contact(t, index);
        }
    }

    /// Records the last forces of the contacts that are open at the end of the run.
    pub(crate) fn end_contacts(&mut self, t: f64, q: &[f64], v: &[f64]) {
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.watch_open_contacts(t);
    }

    /// The contacts of the skipped and of the sampled time in the order of their onsets, including open ones.
    pub(crate) fn finished_contacts(&mut self) -> [Vec<Contact>; 2] {
        let mut contacts = std::mem::take(&mut self.contacts);
        contacts.extend(self.open_contacts.iter().flatten().map(|open| open.contact));
        // A run may fail before its sampled time begins.
        let begun = self.next_sample > 0;
        let before =
            |contact: &Contact| self.settings.skip > 0.0 && (contact.separation <= self.from || !begun);
        let (mut skipped, mut sampled): (Vec<Contact>, Vec<Contact>) = contacts.into_iter().partition(before);
        skipped.append(&mut self.cut_contacts);
        for contacts in [&mut skipped, &mut sampled] {
            contacts.sort_by(|a, b| a.onset.total_cmp(&b.onset));
        }
        [skipped, sampled]
    }

    /// The events of the skipped and of the sampled time.
    pub(crate) fn finished_events(&mut self) -> [Vec<Event>; 2] {
        let before = |event: &Event| self.settings.skip > 0.0 && event.time <= self.from;
        let (skipped, sampled) = std::mem::take(&mut self.events).into_iter().partition(before);
        [skipped, sampled]
    }

    /// Begins the sampled time after a skipped one: the peaks of open contacts are counted anew.
    pub(crate) fn cut_contacts(&mut self, t: f64) {
        self.watch_open_contacts(t);
        for open in self.open_contacts.iter_mut().flatten() {
            self.cut_contacts.push(open.contact);
            open.forget_peak();
        }
    }

    /// Moves to the end of a phase of a joint and records the last force of its contact.
    pub(crate) fn end_phase(&mut self, t: f64, index: usize, q: &[f64], v: &[f64]) {
        self.tracking.interrupt();
        if self.open_contacts[index].is_none() {
            self.dynamics.move_to(t, q, v);
            return;
        }
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.accelerate_at(t);
        self.watch_contact(t, index);
    }
}
