//! Changes of contact, and the contacts of a run from onset to separation with the peak of the
//! normal force.

/// What happened at an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Journal and bearing touch.
    Onset,
    /// They part.
    Separation,
    /// The damping would pull from here on: the force is zero.
    Clip,
    /// The damping no longer pulls.
    Unclip,
}

impl EventKind {
    /// The word by which results name the event.
    pub fn word(self) -> &'static str {
        match self {
            EventKind::Onset => "onset",
            EventKind::Separation => "separation",
            EventKind::Clip => "clip",
            EventKind::Unclip => "unclip",
        }
    }
}

/// A change of phase of a clearance joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When [s].
    pub time: f64,
    /// Index of the clearance joint.
    pub joint: usize,
    /// What.
    pub kind: EventKind,
    /// Penetration rate [m/s]: the approach velocity at an onset.
    pub normal_velocity: f64,
}

/// One contact of a clearance joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Index of the clearance joint.
    pub joint: usize,
    /// Onset [s].
    pub onset: f64,
    /// Separation [s]; NaN while it lasts.
    pub separation: f64,
    /// Approach velocity at the onset [m/s]; NaN if the run began in contact.
    pub impact_velocity: f64,
    /// Largest normal force so far [N].
    pub peak_force: f64,
    /// When it acted [s].
    pub peak_time: f64,
}

/// Normal force and its rate at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// Instant [s].
    pub time: f64,
    /// Normal force [N].
    pub force: f64,
    /// Its rate [N/s].
    pub rate: f64,
}

/// The contact of one joint as it goes on, with the force at the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenContact {
    /// The contact so far.
    pub contact: Contact,
    /// The force at the start of the last step, unless the phase has changed since.
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

    /// Takes the force at the start of a step. Between two of them it is the cubic through the forces
    /// and their rates, so the peak has an error of fourth order in the step.
    pub fn watch(&mut self, sample: ForceSample) {
        let (time, force) = match self.last {
            Some(last) => cubic_peak(&last, &sample),
            None => (sample.time, sample.force),
        };
        if force > self.contact.peak_force {
            (self.contact.peak_force, self.contact.peak_time) = (force, time);
        }
        self.last = Some(sample);
    }
}

/// Instant and value of the largest force between two samples.
fn cubic_peak(a: &ForceSample, b: &ForceSample) -> (f64, f64) {
    let mut peak = if a.force > b.force { (a.time, a.force) } else { (b.time, b.force) };
    let h = b.time - a.time;
    let (rise, fall) = (h * a.rate, h * b.rate);
    if rise > 0.0 && fall < 0.0 {
        // f(θ) = a + rise θ + c2 θ² + c3 θ³; its derivative has one root where it falls.
        let step = b.force - a.force;
        let (c2, c3) = (3.0 * step - 2.0 * rise - fall, rise + fall - 2.0 * step);
        let root = (c2 * c2 - 3.0 * c3 * rise).sqrt();
        let theta = rise / (root - c2);
        if theta > 0.0 && theta < 1.0 {
            let force = a.force + theta * (rise + theta * (c2 + theta * c3));
            if force > peak.1 {
                peak = (a.time + theta * h, force);
            }
        }
    }
    peak
}

/// How long a contact with friction presses, and slides slower than its law is steep meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stick {
    /// Start of the step [s].
    pub time: f64,
    /// Whether the contact presses there.
    pub presses: bool,
    /// Whether it presses and is slow there.
    pub slow: bool,
    /// Time that it pressed [s].
    pub pressed: f64,
    /// Time that it was slow [s].
    pub crept: f64,
}

impl Stick {
    /// Counts the step that ends at `t` [s] and notes the state in which the next one starts.
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
