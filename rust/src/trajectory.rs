//! One run: a mechanism through time, sampled on a uniform grid.

use crate::clearance::{ClearanceLaw, ContactState, Phase};
use crate::contact::Damping;
use crate::dynamics::{Dynamics, Linearisation};
use crate::error::SceneError;
use crate::integrators::dense::DenseStep;
use crate::integrators::events::Guard;
use crate::integrators::{HybridSystem, Outcome, Projection, Stats, Status, integrate_with};
use crate::mechanism::{ClearanceJoint, Mechanism, State};
use crate::outputs::{Column, column_names, needs_acceleration, parse_columns};
pub use crate::settings::{Method, Settings};

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

/// The result of one run.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Instants of the samples [s].
    pub t: Vec<f64>,
    /// Samples, row-major: one row an instant, one column an output; NaN after a failure.
    pub values: Vec<f64>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Changes of phase in order of time.
    pub events: Vec<Event>,
    /// Why the run ended.
    pub status: Status,
    /// When it ended [s].
    pub time: f64,
    /// The clearance joint involved in a failure.
    pub joint: Option<String>,
    /// Work done.
    pub stats: Stats,
    /// Onsets whose velocity was below the floor of the latched impact velocity.
    pub floored_latches: usize,
    /// Largest correction that closed the loops after a step [m]; zero in a tree.
    pub largest_projection: f64,
    /// The clearance joint in which, where a run failed, a normal force drew the surfaces together.
    pub paradox: Option<String>,
    /// What the user should know about the result.
    pub warnings: Vec<String>,
    /// State at the end.
    pub end: State,
}

impl Trajectory {
    /// One sentence on how the run ended.
    pub fn message(&self) -> String {
        let place = match &self.joint {
            Some(joint) => format!(" at t = {:.9e} s, joint {joint:?}", self.time),
            None => format!(" at t = {:.9e} s", self.time),
        };
        let why = match self.status {
            Status::Done => return "the end was reached".to_owned(),
            Status::MaxSteps => "the allowed number of steps was used up",
            Status::StepUnderflow => "the step became too short to advance the time",
            Status::NonFinite => "the motion is no longer a finite number",
            Status::SingularMechanism => {
                "the mass matrix is singular, or a loop passes a dead centre or change point"
            }
            Status::Projection => "closing the loops took a correction above the tolerance",
            Status::EventLocation => "a change of contact could not be located",
            Status::MaxEvents => "the allowed number of contact changes was used up",
            Status::Cancelled => "the run was cancelled",
        };
        let paradox = self.paradox.as_ref().map_or(String::new(), |joint| {
            format!(
                "; the friction of joint {joint:?} is so strong there that pressing harder accelerates the surfaces \
                 towards each other (Painlevé's paradox): no contact law is at rest in it; reduce the friction \
                 coefficient or make the masses less unequal"
            )
        });
        format!("{why}{place}{paradox}")
    }
}

/// Position tolerance of a scene with clearance: `rtol` times this part of the smallest
/// clearance. 0.5 is the scale on which the methods were compared (1e-5 m at 0.02 mm).
const CLEARANCE_PART: f64 = 0.5;
/// Largest tolerances as a part of the oscillation about a contact that rests under the load of
/// the start: wider, a slow mechanism's resting contact cannot be told from free flight, and it
/// chatters. Tuned on the paper's mechanism at 0.01 to 2000 r/min with Rodas5P: 0.1 leaves 4807
/// contact changes in a revolution at 0.1 r/min, 0.01 407, 0.003 189, tight tolerances 161; from
/// 100 r/min on it changes nothing.
const RESTING_PART: f64 = 0.003;
/// Velocity tolerance: `rtol` times this part of the speed of the mechanism. For the paper's
/// crank (10.5 m/s) it is the 1 m/s on which the methods were compared.
const SPEED_PART: f64 = 0.1;
/// Velocity tolerance in a contact with friction, as a part of the velocity at which the friction
/// law is steep. Wider, a linearly implicit step hops across the kink: 15 times more steps at
/// rtol 1e-4 than at 1e-5 in a sticking contact.
const STICK_PART: f64 = 0.1;
/// First step after an onset: this times `rtol`^0.4 times the time scale of the impact. The force
/// begins as δ^1.5, which caps the order at 2.5 until the step has grown away from the onset.
/// Measured on the paper's mechanism: flat between 0.3 and 3.
const ONSET_STEP: f64 = 1.0;

/// Simulates a mechanism from its assembled start.
///
/// `monitor` is called after every accepted step with the time [s]; false cancels.
pub fn simulate(
    mechanism: &Mechanism,
    settings: &Settings,
    monitor: &dyn Fn(f64) -> bool,
) -> Result<Trajectory, SceneError> {
    simulate_from(mechanism, &mechanism.start, settings, monitor)
}

/// Simulates a mechanism from a given state.
pub fn simulate_from(
    mechanism: &Mechanism,
    start: &State,
    settings: &Settings,
    monitor: &dyn Fn(f64) -> bool,
) -> Result<Trajectory, SceneError> {
    settings.check()?;
    let names = settings.outputs.clone().unwrap_or_else(|| column_names(mechanism));
    let columns = parse_columns(mechanism, &names)?;
    let mut values = Vec::new();
    let count = settings.samples.saturating_mul(columns.len());
    values.try_reserve_exact(count).map_err(|_| {
        SceneError::single("settings.samples", format!("{count} numbers do not fit into the memory"))
    })?;
    values.resize(count, f64::NAN);
    let mut recorder = Recorder::new(mechanism, start, settings, columns, values, monitor);
    let (mut q, mut v) = (start.q.clone(), start.v.clone());
    recorder.begin(&q, &v);
    let outcome = if mechanism.mobility() == 0 && mechanism.clearance_joints.is_empty() {
        recorder.follow_drives(&mut q, &mut v)
    } else {
        let mut method = settings.method.stepper(mechanism.degrees_of_freedom());
        integrate_with(&mut recorder, &mut *method, settings.limits, 0.0, settings.duration, &mut q, &mut v)
    };
    let mut warnings = recorder.warnings;
    if recorder.floored > 0 {
        warnings.push(format!(
            "{} of {} impacts began slower than the floor of the impact velocity and were damped as \
             impacts at the floor",
            recorder.floored,
            recorder.events.iter().filter(|event| event.kind == EventKind::Onset).count()
        ));
    }
    for (joint, deepest) in mechanism.clearance_joints.iter().zip(&recorder.deepest) {
        if *deepest > DEEP * joint.law.journal_radius {
            warnings.push(format!(
                "joint {:?}: the penetration reached {deepest:.2e} m, more than {DEEP} of the journal radius: \
                 contact laws do not hold there; the mechanism may be jammed or the stiffness too small",
                joint.name
            ));
        }
    }
    let failed = outcome.status != Status::Done && outcome.status != Status::Cancelled;
    let paradox = if failed && outcome.status != Status::Projection {
        recorder.dynamics.paradoxical_contact(outcome.time, &q, &v)
    } else {
        None
    };
    let paradox = paradox.map(|index| mechanism.clearance_joints[index].name.clone());
    let joint = outcome
        .guard
        .map(|guard| guard / GUARDS)
        .or_else(|| recorder.events.last().map(|event| event.joint).filter(|_| failed))
        .map(|index| mechanism.clearance_joints[index].name.clone());
    Ok(Trajectory {
        t: (0..settings.samples).map(|index| settings.sample_time(index)).collect(),
        values: recorder.values,
        columns: names,
        events: recorder.events,
        status: outcome.status,
        time: outcome.time,
        joint,
        stats: outcome.stats,
        floored_latches: recorder.floored,
        largest_projection: recorder.largest_projection,
        paradox,
        warnings,
        end: State { q, v },
    })
}

/// Penetration relative to the journal radius beyond which the laws of a small contact area no
/// longer hold. Impacts of the paper's mechanism reach 1e-3; a jammed mechanism passes 1.
const DEEP: f64 = 0.02;
/// Resting penetration relative to the size of the mechanism below which the rounding of
/// positions (1e-16) shows: the paper's mechanism reaches it at 0.02 r/min.
const FINE_PENETRATION: f64 = 2e-12;
/// Nominal restitution below which the Lankarani-Nikravesh law rebounds noticeably more: 0.878
/// instead of 0.85, 0.725 instead of 0.5 (closed form in [`Damping::LankaraniNikravesh`]).
const HONEST_RESTITUTION: f64 = 0.85;

/// Turn of a drive [rad] over which the kinematic solution is continued at once: the guess is
/// then off by a few thousandths, far from any other branch.
const LARGEST_TURN: f64 = 0.05;
/// Largest correction of a projection, in tolerances of a step.
const LARGEST_PROJECTION: f64 = 10.0;

/// Guards of a clearance joint: the gap, and the bracket of the damping.
const GUARDS: usize = 2;

/// The mechanism as the integrator sees it, taking samples as it goes.
struct Recorder<'a> {
    dynamics: Dynamics<'a>,
    settings: &'a Settings,
    columns: Vec<Column>,
    monitor: &'a dyn Fn(f64) -> bool,
    position_tolerance: f64,
    velocity_tolerance: f64,
    step_bound: f64,
    values: Vec<f64>,
    next_sample: usize,
    with_acceleration: bool,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    events: Vec<Event>,
    floored: usize,
    /// Largest correction that closed the loops after a step [m].
    largest_projection: f64,
    /// Largest penetration of every clearance joint at the start of a step [m].
    deepest: Vec<f64>,
    warnings: Vec<String>,
}

impl<'a> Recorder<'a> {
    fn new(
        mechanism: &'a Mechanism,
        start: &State,
        settings: &'a Settings,
        columns: Vec<Column>,
        values: Vec<f64>,
        monitor: &'a dyn Fn(f64) -> bool,
    ) -> Self {
        let d = mechanism.degrees_of_freedom();
        let scales = &mechanism.scales;
        let smallest = mechanism.clearance_joints.iter().map(|joint| joint.law.clearance).reduce(f64::min);
        let position_scale = smallest.map_or(scales.length, |clearance| CLEARANCE_PART * clearance);
        // The oscillation about a resting contact must be resolved, however slow the mechanism.
        let resting = |of: fn(&ClearanceJoint) -> f64| {
            RESTING_PART * mechanism.clearance_joints.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let resting_position = resting(|joint| joint.resting_penetration);
        let resting_velocity = resting(|joint| joint.resting_speed);
        let finest = 4.0 * f64::EPSILON * scales.length;
        let position_tolerance = (settings.rtol * position_scale).min(resting_position).max(finest);
        let start_speed = start.v.iter().zip(&scales.levers).map(|(v, lever)| (v * lever).abs());
        let speed = start_speed.fold(scales.speed, f64::max);
        // A scene that starts at rest and undriven: the speed that crosses the position scale in
        // the whole run.
        let speed_scale = (SPEED_PART * speed).max(position_scale / settings.duration);
        Self {
            dynamics: Dynamics::new(mechanism),
            settings,
            with_acceleration: needs_acceleration(&columns),
            values,
            columns,
            monitor,
            position_tolerance: settings.position_tolerance.unwrap_or(position_tolerance),
            velocity_tolerance: settings
                .velocity_tolerance
                .unwrap_or((settings.rtol * speed_scale).min(resting_velocity)),
            step_bound: f64::INFINITY,
            next_sample: 0,
            q: vec![0.0; d],
            v: vec![0.0; d],
            a: vec![0.0; d],
            events: Vec::new(),
            floored: 0,
            largest_projection: 0.0,
            deepest: vec![0.0; mechanism.clearance_joints.len()],
            warnings: Vec::new(),
        }
    }

    /// Sets the phases of the start and takes the first sample.
    fn begin(&mut self, q: &[f64], v: &[f64]) {
        for joint in &self.dynamics.mechanism.clearance_joints {
            if let Damping::LankaraniNikravesh { restitution } = joint.law.normal.damping
                && restitution < HONEST_RESTITUTION
            {
                self.warnings.push(format!(
                    "joint {:?}: the Lankarani-Nikravesh law rebounds more than its restitution {restitution} \
                     says (below {HONEST_RESTITUTION} by more than 3 %)",
                    joint.name
                ));
            }
            if joint.resting_penetration < FINE_PENETRATION * self.dynamics.mechanism.scales.length {
                self.warnings.push(format!(
                    "joint {:?}: under the load of the start the contact rests at a penetration of {:.1e} m, too \
                     close to the rounding of positions: its contact changes may be noise",
                    joint.name, joint.resting_penetration
                ));
            }
        }
        self.dynamics.move_to(0.0, q, v);
        for index in 0..self.dynamics.phases.len() {
            if self.dynamics.contact_state(index).penetration > 0.0 {
                let joint = &self.dynamics.mechanism.clearance_joints[index];
                let phase = Phase::Contact {
                    hysteresis_factor: joint.law.normal.hysteresis_factor(joint.impact_velocity_floor),
                    clipped: false,
                };
                let name = joint.name.clone();
                self.dynamics.phases[index] = phase;
                self.warnings.push(format!(
                    "joint {name:?} starts in contact: it has no impact velocity and is damped as an impact \
                     at the floor"
                ));
            }
        }
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.sample(0.0);
    }

    /// Writes the next row of samples from the state in `self.q`, `self.v`.
    fn sample(&mut self, t: f64) {
        if self.with_acceleration {
            if !self.dynamics.acceleration(t, &self.q, &self.v, &mut self.a) {
                self.a.fill(f64::NAN);
            }
            self.dynamics.accelerate(&self.a);
        } else {
            self.dynamics.move_to(t, &self.q, &self.v);
        }
        let width = self.columns.len();
        let row = &mut self.values[self.next_sample * width..(self.next_sample + 1) * width];
        for (value, column) in row.iter_mut().zip(&self.columns) {
            *value = column.value(&self.dynamics);
        }
        self.next_sample += 1;
    }

    /// Bounds the next step and notes the penetrations, in motion with its accelerations.
    fn watch_joints(&mut self) {
        // Half a clearance per step: no flight can cross the bearing unseen.
        self.step_bound = f64::INFINITY;
        let joints = self.dynamics.mechanism.clearance_joints.iter().zip(&self.dynamics.phases);
        for ((joint, phase), deepest) in joints.zip(&mut self.deepest) {
            let motion = self.dynamics.joint_motion(joint);
            *deepest = deepest.max(motion.eccentricity.norm() - joint.law.clearance);
            if *phase == Phase::Free {
                let (rate, acceleration) = (motion.rate.norm(), motion.acceleration.norm());
                let clearance = joint.law.clearance;
                // |ė| h + |ë| h²/2 = c/2
                let bound = clearance / (rate + (rate * rate + acceleration * clearance).sqrt());
                self.step_bound = self.step_bound.min(bound);
            }
        }
    }

    /// The motion of a mechanism that its drives prescribe completely: every sample is solved for
    /// by itself, by continuation from the one before; nothing is integrated.
    fn follow_drives(&mut self, q: &mut [f64], v: &mut [f64]) -> Outcome {
        let mechanism = self.dynamics.mechanism;
        let mut outcome = Outcome { status: Status::Done, time: 0.0, guard: None, stats: Stats::default() };
        let fastest = mechanism.driven.iter().map(|driven| driven.speed.abs()).fold(0.0, f64::max);
        while self.next_sample < self.settings.samples {
            let end = self.settings.sample_time(self.next_sample);
            let span = end - outcome.time;
            let pieces = (fastest * span / LARGEST_TURN).ceil().max(1.0);
            let start = outcome.time;
            for piece in 1..=pieces as usize {
                let t = if piece as f64 == pieces { end } else { start + span * piece as f64 / pieces };
                for (q, v) in q.iter_mut().zip(&*v) {
                    *q += v * (t - outcome.time);
                }
                if self.dynamics.project(t, q, v, &mechanism.scales.levers).is_none() {
                    outcome.status = Status::SingularMechanism;
                    return outcome;
                }
                outcome.stats.steps += 1;
                outcome.time = t;
                if !(self.monitor)(t) {
                    outcome.status = Status::Cancelled;
                    return outcome;
                }
            }
            self.q.copy_from_slice(q);
            self.v.copy_from_slice(v);
            self.sample(end);
        }
        outcome
    }

    fn gap_guard(&self, index: usize, state: &ContactState<f64>) -> Guard {
        let joint = &self.dynamics.mechanism.clearance_joints[index];
        let sign = match self.dynamics.phases[index] {
            Phase::Free => -1.0,
            Phase::Contact { .. } => 1.0,
        };
        // Rounding of the difference of two positions.
        let journal = self.dynamics.point(joint.journal).position;
        let bearing = self.dynamics.point(joint.bearing).position;
        let resolution = 4.0
            * f64::EPSILON
            * (journal.abs().sum() + bearing.abs().sum() + self.dynamics.mechanism.scales.length);
        Guard {
            value: sign * state.penetration,
            rate: sign * state.penetration_rate,
            resolution,
            overshoot: (8.0 * resolution).max(LANDING_PART * self.position_tolerance),
        }
    }

    fn bracket_guard(&self, index: usize, state: &ContactState<f64>) -> Guard {
        let Phase::Contact { hysteresis_factor, clipped } = self.dynamics.phases[index] else {
            return Guard::INACTIVE;
        };
        if hysteresis_factor == 0.0 {
            return Guard::INACTIVE;
        }
        let joint = &self.dynamics.mechanism.clearance_joints[index];
        let bracket = ClearanceLaw::damping_bracket(state.penetration_rate, hysteresis_factor);
        // Rounding of the difference of two velocities, and what the tolerance leaves open: where
        // the damping is strong the bracket stays near zero for long, and its noise is no event.
        let journal = self.dynamics.point(joint.journal).velocity;
        let bearing = self.dynamics.point(joint.bearing).velocity;
        let rounding = 4.0 * f64::EPSILON * (journal.abs().sum() + bearing.abs().sum());
        let resolution =
            64.0 * f64::EPSILON + hysteresis_factor * (rounding + BRACKET_PART * self.velocity_tolerance);
        Guard {
            value: if clipped { -bracket } else { bracket },
            rate: f64::NAN,
            resolution,
            // The force at the clip is off by this part of its elastic share at most.
            overshoot: (8.0 * resolution).max(1e-4),
        }
    }
}

/// Rate at which the bracket of the damping has no sign, as a part of the velocity tolerance. Tuned on
/// overdamped contacts under explicit steps, which clip and unclip by the error of the velocity: with
/// 1e-3 a scene got half as far in 300 000 steps as with 0.1; with 1 a shaken bearing at rtol 1e-3 lost
/// clips that tighter runs have.
const BRACKET_PART: f64 = 0.1;
/// Largest penetration of a landing, as a part of the position tolerance.
const LANDING_PART: f64 = 1e-2;

impl HybridSystem for Recorder<'_> {
    fn dimension(&self) -> usize {
        self.q.len()
    }

    fn acceleration(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.dynamics.acceleration(t, q, v, a)
    }

    fn begin(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        if !self.dynamics.acceleration(t, q, v, a) {
            return false;
        }
        self.dynamics.accelerate(a);
        self.watch_joints();
        true
    }

    fn linearise(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearisation) -> bool {
        if !self.dynamics.linearise(t, q, v, linear) {
            return false;
        }
        self.watch_joints();
        true
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        let mechanism = self.dynamics.mechanism;
        let stick = mechanism
            .clearance_joints
            .iter()
            .zip(&self.dynamics.phases)
            .filter(|(_, phase)| **phase != Phase::Free)
            .filter_map(|(joint, _)| joint.law.stick_velocity())
            .fold(f64::INFINITY, f64::min);
        let velocity_tolerance = self.velocity_tolerance.min(STICK_PART * stick);
        for (k, lever) in mechanism.scales.levers.iter().enumerate() {
            position[k] = self.position_tolerance / lever;
            velocity[k] = velocity_tolerance / lever;
        }
    }

    fn step_bound(&self) -> f64 {
        self.step_bound
    }

    fn guard_count(&self) -> usize {
        GUARDS * self.dynamics.phases.len()
    }

    fn guards(&mut self, t: f64, q: &[f64], v: &[f64], guards: &mut [Guard]) {
        self.dynamics.move_to(t, q, v);
        for index in 0..self.dynamics.phases.len() {
            let state = self.dynamics.contact_state(index);
            guards[GUARDS * index] = self.gap_guard(index, &state);
            guards[GUARDS * index + 1] = self.bracket_guard(index, &state);
        }
    }

    fn cross(&mut self, guard: usize, t: f64, q: &[f64], v: &[f64]) -> f64 {
        self.dynamics.move_to(t, q, v);
        let index = guard / GUARDS;
        let joint = &self.dynamics.mechanism.clearance_joints[index];
        let law = &joint.law.normal;
        let normal_velocity = self.dynamics.contact_state(index).penetration_rate;
        let mut bound = f64::INFINITY;
        let (kind, phase) = match (guard % GUARDS, self.dynamics.phases[index]) {
            (0, Phase::Free) => {
                let impact_velocity = normal_velocity.max(joint.impact_velocity_floor);
                let floored = law.is_latched() && normal_velocity < joint.impact_velocity_floor;
                self.floored += usize::from(floored);
                let impact_time = law.impact_time(joint.effective_mass, impact_velocity);
                bound = ONSET_STEP * self.settings.rtol.powf(0.4) * impact_time;
                let hysteresis_factor = law.hysteresis_factor(impact_velocity);
                (EventKind::Onset, Phase::Contact { hysteresis_factor, clipped: false })
            }
            (0, Phase::Contact { .. }) => (EventKind::Separation, Phase::Free),
            (_, Phase::Contact { hysteresis_factor, clipped }) => {
                let kind = if clipped { EventKind::Unclip } else { EventKind::Clip };
                (kind, Phase::Contact { hysteresis_factor, clipped: !clipped })
            }
            // The bracket ended in the same instant as the contact.
            (_, Phase::Free) => return bound,
        };
        self.dynamics.phases[index] = phase;
        self.events.push(Event { time: t, joint: index, kind, normal_velocity });
        bound
    }

    fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64]) -> Projection {
        let mechanism = self.dynamics.mechanism;
        if mechanism.closures.is_empty() {
            return Projection::Unneeded;
        }
        let Some((moved, turned)) = self.dynamics.project(t, q, v, &mechanism.scales.levers) else {
            return Projection::Singular;
        };
        self.largest_projection = self.largest_projection.max(moved);
        let fine = moved <= LARGEST_PROJECTION * self.position_tolerance
            && turned <= LARGEST_PROJECTION * self.velocity_tolerance;
        if fine { Projection::Done } else { Projection::TooLarge }
    }

    fn wants_dense(&self, end: f64) -> bool {
        self.next_sample < self.settings.samples
            && self.settings.sample_time(self.next_sample) <= end * (1.0 + 32.0 * f64::EPSILON)
    }

    fn accepted(&mut self, step: &DenseStep) -> bool {
        let end = step.end_time();
        while self.next_sample < self.settings.samples {
            let t = self.settings.sample_time(self.next_sample);
            // The last step ends at the duration to rounding.
            let last = self.next_sample + 1 == self.settings.samples;
            let slack = if last { 32.0 * f64::EPSILON * t } else { 0.0 };
            if t > end + slack || step.h == 0.0 {
                break;
            }
            let (mut q, mut v) = (std::mem::take(&mut self.q), std::mem::take(&mut self.v));
            step.at(((t - step.t) / step.h).min(1.0), &mut q, &mut v);
            (self.q, self.v) = (q, v);
            self.sample(t);
        }
        (self.monitor)(end)
    }
}
