//! Changes of contact, and the contacts of a run from onset to separation with the peak of the normal force.
//! In: steps and the motion; out: guards for the integrator, phases, a log of events and
//! contacts; likewise the switches of expressions and the friction of ideal joints. Uses `dynamics`, `contact`, `integrators`, `numerics`.

pub(crate) mod dry_joints;
pub(crate) mod guards;
pub(crate) mod log;
pub(crate) mod onset;
pub(crate) mod phases;
pub(crate) mod sticking;
pub(crate) mod switches;

use serde::{Deserialize, Deserializer, Serialize};

use crate::contact::pair::RelativeMotion;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::extremum::highest_within;

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Journal and bearing touch.
    Onset,
    /// They separate.
    Separation,
    /// The damping would make the normal force tensile from here on: it is clipped to zero.
    Clip,
    /// The damping no longer makes it tensile.
    Unclip,
    /// The surfaces stick from here on.
    Stick,
    /// They slide from here on: the spring of the contact reaches Coulomb's limit.
    Slip,
    /// The contact passes to the neighbor of its slot, at an end of a face.
    Transfer,
    /// A formula changes its form.
    Switch,
}

impl EventKind {
    /// The word by which results name the event.
    pub fn word(self) -> &'static str {
        match self {
            EventKind::Onset => "onset",
            EventKind::Separation => "separation",
            EventKind::Clip => "clip",
            EventKind::Unclip => "unclip",
            EventKind::Stick => "stick",
            EventKind::Slip => "slip",
            EventKind::Transfer => "transfer",
            EventKind::Switch => "switch",
        }
    }
}

/// Where an event happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The clearance joint with this index.
    Joint(usize),
    /// The ideal joint with friction with this index.
    DryJoint(usize),
    /// The function of the motion with this index.
    Load(usize),
}

/// A change of phase of a clearance joint, or of the form of a formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Time [s].
    pub time: f64,
    /// Where it happens.
    pub place: Place,
    /// Kind.
    pub kind: EventKind,
    /// Penetration rate [m/s]: the approach velocity at an onset; NaN where no surfaces touch.
    pub normal_velocity: f64,
}

/// Name of what an event belongs to.
pub fn event_joint(mechanism: &Mechanism, place: Place) -> &str {
    match place {
        Place::Joint(slot) => &mechanism.slots[slot].name,
        Place::DryJoint(joint) => mechanism.dry_joint_name(joint),
        Place::Load(load) => &mechanism.motion_loads[load].name,
    }
}

/// One contact of a clearance joint.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Index of the clearance joint.
    pub joint: usize,
    /// Onset [s].
    pub onset: f64,
    /// Separation [s]; NaN while it lasts.
    #[serde(deserialize_with = "or_unknown")]
    pub separation: f64,
    /// Approach velocity at the onset [m/s]; NaN if the run began in contact or a neighbor did.
    #[serde(deserialize_with = "or_unknown")]
    pub impact_velocity: f64,
    /// Largest normal force so far [N].
    pub peak_force: f64,
    /// Time of that force [s].
    pub peak_time: f64,
}

/// Reads a number that may be NaN, which JSON has as `null`.
fn or_unknown<'de, D: Deserializer<'de>>(text: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(text)?.unwrap_or(f64::NAN))
}

/// Relative motion of journal and bearing with its normal force at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// Instant [s].
    pub time: f64,
    /// Eccentricity [m] and its rate [m/s].
    pub motion: RelativeMotion<f64>,
    /// Acceleration of the eccentricity [m/s²].
    pub acceleration: [f64; 2],
    /// Normal force [N].
    pub force: f64,
    /// Its rate [N/s].
    pub rate: f64,
}

/// An open contact of one joint, with the force at the last step.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OpenContact {
    /// The contact so far.
    pub contact: Contact,
    /// The force at the start of the last step, unless the phase has changed since.
    #[serde(skip)]
    pub last: Option<ForceSample>,
}

impl OpenContact {
    /// A contact that begins.
    pub fn begin(joint: usize, time: f64, impact_velocity: f64) -> Self {
        let contact = Contact {
            joint,
            onset: time,
            separation: f64::NAN,
            impact_velocity,
            peak_force: 0.0,
            peak_time: time,
        };
        Self { contact, last: None }
    }

    /// Counts the peak anew, from the last recorded force.
    pub fn forget_peak(&mut self) {
        (self.contact.peak_time, self.contact.peak_force) =
            self.last.map_or((self.contact.onset, 0.0), |last| (last.time, last.force.max(0.0)));
    }

    /// Records the force at the start of a step or at the end of the last one. If the force rose at the
    /// record before and falls now, its peak is searched on the quintic through both relative motions,
    /// without dense output; `force` gives the normal force of a relative motion.
    pub fn watch(&mut self, sample: ForceSample, force: impl Fn(&RelativeMotion<f64>) -> f64) {
        let mut peak = (sample.time, sample.force);
        let known = self.contact.peak_force;
        let has_peak = |last: &ForceSample| last.rate > 0.0 && sample.rate < 0.0;
        if let Some(last) = self.last.filter(|last| has_peak(last) && may_exceed(known, last, &sample)) {
            let between = highest_between(&last, &sample, force);
            if between.1 > peak.1 {
                peak = between;
            }
        }
        if peak.1 > self.contact.peak_force {
            (self.contact.peak_time, self.contact.peak_force) = peak;
        }
        self.last = Some(sample);
    }
}

/// Whether the force may exceed a known one [N] between a sample at which it rises and one at which it falls: by
/// the higher of the two tangents, each followed through the whole time. The top of an arch lies below the lower
/// one.
fn may_exceed(known: f64, a: &ForceSample, b: &ForceSample) -> bool {
    let h = b.time - a.time;
    (a.force + a.rate * h).max(b.force - b.rate * h) > known
}

/// Instant and value of the largest force between two samples.
fn highest_between(
    a: &ForceSample,
    b: &ForceSample,
    force: impl Fn(&RelativeMotion<f64>) -> f64,
) -> (f64, f64) {
    let at = |theta: f64| force(&between(a, b, theta));
    let (theta, force) = highest_within([0.0, 1.0], (0.5, at(0.5)), at);
    (a.time + theta * (b.time - a.time), force)
}

/// The motion at a fraction of the time from one sample to the next, on the quintic Hermite interpolant of
/// their eccentricities, rates and accelerations.
fn between(a: &ForceSample, b: &ForceSample, theta: f64) -> RelativeMotion<f64> {
    let h = b.time - a.time;
    let (t, t2) = (theta, theta * theta);
    let (t3, t4, t5) = (t2 * t, t2 * t2, t2 * t2 * t);
    let place = |k: usize| {
        let step = b.motion.eccentricity[k] - a.motion.eccentricity[k];
        a.motion.eccentricity[k]
            + step * (10.0 * t3 - 15.0 * t4 + 6.0 * t5)
            + h * a.motion.rate[k] * (t - 6.0 * t3 + 8.0 * t4 - 3.0 * t5)
            + h * b.motion.rate[k] * (-4.0 * t3 + 7.0 * t4 - 3.0 * t5)
            + 0.5 * h * h * a.acceleration[k] * (t2 - 3.0 * t3 + 3.0 * t4 - t5)
            + 0.5 * h * h * b.acceleration[k] * (t3 - 2.0 * t4 + t5)
    };
    let rate = |k: usize| {
        let step = b.motion.eccentricity[k] - a.motion.eccentricity[k];
        step / h * (30.0 * t2 - 60.0 * t3 + 30.0 * t4)
            + a.motion.rate[k] * (1.0 - 18.0 * t2 + 32.0 * t3 - 15.0 * t4)
            + b.motion.rate[k] * (-12.0 * t2 + 28.0 * t3 - 15.0 * t4)
            + 0.5 * h * a.acceleration[k] * (2.0 * t - 9.0 * t2 + 12.0 * t3 - 5.0 * t4)
            + 0.5 * h * b.acceleration[k] * (3.0 * t2 - 8.0 * t3 + 5.0 * t4)
    };
    RelativeMotion { eccentricity: [0, 1].map(place), rate: [0, 1].map(rate), spin: 0.0, roll: 0.0 }
}

/// Time that a contact with friction is loaded, and time that it slides below its stick velocity meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stick {
    /// Start of the step [s].
    pub time: f64,
    /// Whether the contact is loaded there.
    pub presses: bool,
    /// Whether it is loaded and slides below the stick velocity there.
    pub slow: bool,
    /// Time that it was loaded [s].
    pub pressed: f64,
    /// Time that it was loaded and slid below the stick velocity [s].
    pub crept: f64,
}

impl Stick {
    /// Adds the step that ends at `t` [s] and records the state in which the next one starts.
    pub fn advance(&mut self, t: f64, presses: bool, slow: bool) {
        let elapsed = t - self.time;
        if self.presses {
            self.pressed += elapsed;
        }
        if self.slow {
            self.crept += elapsed;
        }
        (self.time, self.presses, self.slow) = (t, presses, slow);
    }
}
