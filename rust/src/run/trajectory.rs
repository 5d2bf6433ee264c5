//! One run: a mechanism through time, sampled on a uniform grid.

use crate::error::Notice;
use crate::error::{InputError, Problem, Subject};
use crate::integrators::{Outcome, Stats, Status, integrate};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::ROUNDING_OF_CHAIN;
use crate::numerics::memory::filled;
use crate::run::contacts::phases::Watched;
pub use crate::run::contacts::{Contact, Event, EventKind, Place, event_joint};
use crate::run::features::Plan;
use crate::run::motion::Motion;
use crate::run::outputs::{Column, column_names, parse_columns};
use crate::run::prescribed::follow_drives;
use crate::run::restart::{Memory, Restart};
pub use crate::run::settings::{Method, Settings};
use crate::run::system::System;
use crate::run::tolerances::check_tolerances;
use crate::run::warnings::{of_run, of_stability};
use crate::tree::elements::State;
use crate::tree::loads::MotionLoad;

/// The result of one run.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Instants of the samples [s]; empty if the samples were written to memory of the caller.
    pub t: Vec<f64>,
    /// Samples, row-major: one row for each instant, one column for each output; NaN after a failure. Empty
    /// likewise.
    pub values: Vec<f64>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Changes of phase in the sampled time, in their order.
    pub events: Vec<Event>,
    /// Changes of phase in the time skipped before.
    pub skipped_events: Vec<Event>,
    /// Why the run ended.
    pub status: Status,
    /// When it ended [s].
    pub time: f64,
    /// The joint whose change of contact or friction could not be located or exceeded the allowed number, or whose friction
    /// has two solutions or none.
    pub joint: Option<String>,
    /// The force or torque that the run cannot follow further: it holds what it depends on, its table ends, or where it
    /// changes its form could not be located.
    pub load: Option<String>,
    /// What is wrong with it, or with friction.
    load_message: String,
    /// The clearance joint that is in Painlevé's paradox where a run failed: its normal force, with the
    /// friction that it causes, accelerates the surfaces toward each other.
    pub paradox: Option<String>,
    /// Paths of the numbers of the scene that look wrong.
    pub suspect_paths: Vec<String>,
    /// Work done.
    pub stats: Stats,
    /// Impacts slower than the floor of the impact velocity, which were damped as if at it.
    pub impacts_at_floor: usize,
    /// Largest correction of a projection onto the loop closures [m]; zero without loops.
    pub largest_projection: f64,
    /// What should be checked.
    pub warnings: Vec<Notice>,
    /// Contacts of the sampled time in the order of their onsets, with their peaks in that time.
    pub contacts: Vec<Contact>,
    /// Contacts of the time skipped before; one that lasts into the sampled time has no separation.
    pub skipped_contacts: Vec<Contact>,
    /// Features, a row for each piece of the sampled time; NaN in a piece that the run did not finish.
    pub features: Vec<f64>,
    /// State at the end.
    pub end: State,
    /// Data from which the run can be continued; `None` if it failed.
    pub restart: Option<Restart>,
}

impl Trajectory {
    /// One sentence on how the run ended.
    pub fn message(&self) -> String {
        let place = match (&self.joint, &self.load) {
            (Some(joint), _) => format!(" at t = {:.9e} s, joint {joint:?}", self.time),
            (None, Some(load)) => format!(" at t = {:.9e} s, load {load:?}", self.time),
            (None, None) => format!(" at t = {:.9e} s", self.time),
        };
        let why = match self.status {
            Status::Done => return "the end was reached".to_owned(),
            Status::MaxSteps => "the allowed number of steps was used up",
            Status::StepUnderflow => "the step became too short to advance the time",
            Status::NonFinite => "the motion is no longer a finite number",
            Status::SingularMechanism => {
                "the mass matrix is singular, or a loop passes a dead center or change point"
            }
            Status::Projection => {
                "closing the loops takes a correction above the tolerance, however short the step"
            }
            Status::EventLocation if self.load.is_some() => "a change of a force could not be located",
            Status::EventLocation => "a change of contact or friction could not be located",
            Status::MaxEvents if self.load.is_some() => "the allowed number of changes of forces was used up",
            Status::MaxEvents => "the allowed number of changes of contact or friction was used up",
            Status::Held => {
                "a force holds what it depends on: it pushes it back from both sides of its switch"
            }
            Status::OutsideTable => "a table ends",
            Status::OutsideDomain => "a function in a formula has no value from here on",
            Status::LeftGuide => "what slides in a guide has left it at its end",
            Status::FrictionIndeterminate => "friction has two solutions or none",
            Status::Cancelled => "the run was cancelled",
        };
        let paradox = self.paradox.as_ref().map_or(String::new(), |joint| {
            format!(
                "; the friction of joint {joint:?} is so strong there that pressing harder accelerates the surfaces \
                 toward each other (Painlevé's paradox): no contact force brings them to rest; reduce the friction \
                 coefficient or make the masses less unequal"
            )
        });
        let suspects = if self.suspect_paths.is_empty() {
            String::new()
        } else {
            format!(
                "; first look at {}, of which a warning says that it looks wrong",
                self.suspect_paths.join(", ")
            )
        };
        format!("{why}{place}{}{suspects}{paradox}", self.load_message)
    }
}

/// Simulates a mechanism from its assembled start.
///
/// `monitor` is called after every accepted step with the time [s]; false cancels.
///
/// # Errors
/// What is wrong with the settings.
pub fn simulate(
    mechanism: &Mechanism,
    settings: &Settings,
    monitor: &dyn Fn(f64) -> bool,
) -> Result<Trajectory, InputError> {
    simulate_from(mechanism, &mechanism.start, settings, monitor)
}

/// Where a run begins: in a state at time zero, or where another one ended, from which on the samples are then taken.
#[derive(Clone, Copy, Debug)]
pub enum Begin<'a> {
    /// In a state.
    State(&'a State),
    /// Where another run ended.
    Restart(&'a Restart),
}

impl<'a> From<&'a State> for Begin<'a> {
    fn from(state: &'a State) -> Self {
        Begin::State(state)
    }
}

impl<'a> From<&'a Restart> for Begin<'a> {
    fn from(restart: &'a Restart) -> Self {
        Begin::Restart(restart)
    }
}

/// Simulates a mechanism from a given state or where another run ended.
///
/// # Errors
/// What is wrong with the settings, or a restart that belongs to another mechanism.
pub fn simulate_from<'a>(
    mechanism: &Mechanism,
    begin: impl Into<Begin<'a>>,
    settings: &Settings,
    monitor: &dyn Fn(f64) -> bool,
) -> Result<Trajectory, InputError> {
    let begin = begin.into();
    let count = settings.samples.saturating_mul(columns(mechanism, settings).len());
    let mut values = filled(count, f64::NAN).map_err(|_| {
        Subject::Settings.error("settings.samples", format!("{count} numbers do not fit into the memory"))
    })?;
    let run = record(mechanism, begin, settings, monitor, &mut values)?;
    let from = if let Begin::Restart(restart) = begin { restart.time } else { 0.0 };
    let t = settings.sample_times(from).collect();
    Ok(Trajectory { t, values, ..run })
}

/// Checks the settings of a run without simulating.
///
/// # Errors
/// What is wrong with the settings.
pub fn check(mechanism: &Mechanism, settings: &Settings) -> Result<(), InputError> {
    check_tolerances(mechanism, &mechanism.start, settings)?;
    parse_columns(mechanism, &columns(mechanism, settings))?;
    Plan::new(mechanism, &settings.features)?;
    check_functions(mechanism, 0.0, settings.skip + settings.duration)
}

/// Names of the columns that a run with these settings has.
pub fn columns(mechanism: &Mechanism, settings: &Settings) -> Vec<String> {
    settings.outputs.clone().unwrap_or_else(|| column_names(mechanism))
}

/// Whether a run may continue where another ended.
pub(crate) fn check_restart(mechanism: &Mechanism, restart: &Restart) -> Result<(), InputError> {
    let Memory { phases, joint_phases, contacts, turns, work } = &restart.memory;
    let d = mechanism.degrees_of_freedom();
    let joints = mechanism.slots.len();
    let fits = restart.q.len() == d
        && restart.v.len() == d
        && [phases.len(), contacts.len()] == [joints; 2]
        && joint_phases.len() == mechanism.dry_joints.len()
        && work
            .as_ref()
            .is_none_or(|work| work.contacts.len() == joints && work.dry_joints.len() == joint_phases.len())
        && contacts
            .iter()
            .enumerate()
            .all(|(joint, open)| open.is_none_or(|open| open.contact.joint == joint))
        && turns.len() == mechanism.frames.len() - 1;
    if !fits {
        let message = format!(
            "belongs to another mechanism: this one has {d} coordinates and {joints} joints with clearance, \
             got {} and {}",
            restart.q.len(),
            phases.len()
        );
        return Err(Subject::Start.error("start", message));
    }
    if restart.parts != parts(mechanism) {
        let message = format!(
            "belongs to another mechanism: this one has {}, got {}",
            parts(mechanism).join(", "),
            restart.parts.join(", ")
        );
        return Err(Subject::Start.error("start", message));
    }
    restart.check()
}

/// Names of the coordinates and clearance joints of a mechanism, by which a restart recognizes it.
fn parts(mechanism: &Mechanism) -> Vec<String> {
    let joints = mechanism.slots.iter().map(|joint| &joint.name);
    mechanism.coordinate_names.iter().chain(joints).cloned().collect()
}

/// What the settings ask of a run: its columns with their names, and its features.
struct Request {
    names: Vec<String>,
    columns: Vec<Column>,
    plan: Plan,
}

impl Request {
    /// Resolves the settings for a mechanism and a table of `values` numbers.
    fn of(mechanism: &Mechanism, settings: &Settings, values: usize) -> Result<Request, InputError> {
        let names = columns(mechanism, settings);
        let columns = parse_columns(mechanism, &names)?;
        let plan = Plan::new(mechanism, &settings.features)?;
        if Some(values) != settings.samples.checked_mul(columns.len()) {
            let message =
                format!("{} samples of {} columns are no {values} numbers", settings.samples, columns.len());
            return Err(Subject::Settings.error("settings.samples", message));
        }
        Ok(Request { names, columns, plan })
    }
}

/// The same into `values` of the caller: a row for every sample, a column for every output. Rows that the run does not
/// reach become NaN; where it is cancelled they are left as they are, since filling them takes time.
///
/// # Errors
/// As [`simulate_from`].
pub fn record<'a>(
    mechanism: &Mechanism,
    begin: impl Into<Begin<'a>>,
    settings: &Settings,
    monitor: &dyn Fn(f64) -> bool,
    values: &mut [f64],
) -> Result<Trajectory, InputError> {
    let begin = begin.into();
    let smoothed = mechanism.for_tolerance(settings.rtol);
    let mechanism = smoothed.as_ref().unwrap_or(mechanism);
    let (start, from) = match begin {
        Begin::State(start) => (start.clone(), 0.0),
        Begin::Restart(restart) => {
            check_restart(mechanism, restart)?;
            (State { q: restart.q.clone(), v: restart.v.clone() }, restart.time)
        }
    };
    let scaled_by = if let Begin::State(start) = begin { start } else { &mechanism.start };
    check_tolerances(mechanism, scaled_by, settings)?;
    let Request { names, columns, plan } = Request::of(mechanism, settings, values.len())?;
    let mut system = System::new(mechanism, scaled_by, settings, (columns, values), plan, monitor, from);
    let end = system.samples.end();
    check_functions(mechanism, from, end)?;
    let State { mut q, mut v } = start;
    match begin {
        Begin::Restart(restart) => {
            system.recall(&restart.memory);
            system.motion.settle(from, &q, &v);
            if let Some(fault) = system.motion.dynamics.fault_of_loads() {
                return Err(Subject::Start.error("start", fault));
            }
        }
        Begin::State(_) => system.begin(&mut q, &v),
    }
    let mut outcome = if mechanism.mobility() == 0 && mechanism.slots.is_empty() {
        follow_drives(&mut system, from, end, &mut q, &mut v)
    } else {
        let mut method = settings.method.stepper(mechanism.degrees_of_freedom(), settings.rtol);
        let limits = system.limits();
        integrate(&mut system, &mut *method, limits, from, end, &mut q, &mut v)
    };
    if system.samples.wants(outcome.time) {
        // The last step was not sampled to its end.
        outcome.time = system.samples.last_taken().max(from);
    }
    // The motion itself may go on where a force or an energy is beyond the largest number.
    if let Some(time) = system.samples.first_lost() {
        (outcome.status, outcome.time) = (Status::NonFinite, time);
    }
    if outcome.status != Status::Cancelled {
        system.samples.forget_the_rest();
    }
    if outcome.status == Status::Done {
        system.phases.log.end(&mut system.motion, outcome.time, &q, &v);
    }
    let notice = of_stability(settings.method, &outcome.stats);
    let mut run = finished(system, outcome, State { q, v });
    run.warnings.extend(notice);
    Ok(Trajectory { columns: names, ..run })
}

/// The result of a run without its samples and their names.
fn finished(mut system: System, mut outcome: Outcome, mut end: State) -> Trajectory {
    let mechanism = system.motion.mechanism;
    let name_of = |place: Place| event_joint(mechanism, place).to_owned();
    let massless = mass_message(&mut system, &mut outcome);
    let fault = friction_fault(&system, &mut outcome);
    let paradox = match outcome.status {
        Status::Done | Status::Cancelled | Status::Projection | Status::FrictionIndeterminate => None,
        _ => system.motion.dynamics.paradoxical_contact(outcome.time, &end.q, &end.v),
    };
    let unknown = system.samples.unknown;
    let mut warnings = std::mem::take(&mut system.warnings);
    warnings
        .extend(of_run(mechanism, &system.phases.tolerances, &system.phases.log, &system.balance, unknown));
    warnings.extend(system.inputs.notices());
    let restart = (outcome.status == Status::Done).then(|| Restart {
        time: outcome.time,
        parts: parts(mechanism),
        q: end.q.clone(),
        v: end.v.clone(),
        memory: Memory::of(&system.motion, &system.phases.log),
    });
    system.motion.with_turns(&mut end.q);
    let [skipped_events, events] = system.phases.log.finished_events(&system.samples);
    let [skipped_contacts, contacts] = system.phases.log.finished_contacts(&system.samples);
    let (slot, switch) = match outcome.guard.map(|guard| system.phases.watched(&system.motion, guard)) {
        Some(Watched::Contact { slot, .. } | Watched::Sticking(slot)) => (Some(Place::Joint(slot)), None),
        Some(Watched::Switch(switch)) => (None, Some(switch)),
        Some(Watched::DryJoint(index)) => (Some(Place::DryJoint(index)), None),
        None => (None, None),
    };
    let slot = fault.map(|(index, _)| Place::DryJoint(index)).or(slot);
    let load = switch.and_then(|switch| mechanism.load_of_switch(switch)).map(|(load, _)| load);
    let slot = slot.or_else(|| Some(Place::Joint(load?.law_of?.slot)));
    let load_message =
        fault.map_or_else(|| load_message(&mut system, &outcome, load, &end), friction_message);
    let features = system.tracking.values(outcome.time, &events, &contacts);
    Trajectory {
        t: Vec::new(),
        values: Vec::new(),
        columns: Vec::new(),
        events,
        skipped_events,
        status: outcome.status,
        time: outcome.time,
        joint: slot.map(name_of),
        load: load.filter(|load| load.law_of.is_none()).map(|load| load.name.clone()),
        load_message: massless + &load_message,
        paradox: paradox.map(|slot| name_of(Place::Joint(slot))),
        suspect_paths: mechanism.warnings.iter().flat_map(|warning| warning.about.clone()).collect(),
        stats: outcome.stats,
        impacts_at_floor: system.phases.log.impacts_at_floor.iter().sum(),
        largest_projection: system.largest_projection,
        warnings,
        contacts,
        skipped_contacts,
        features,
        end,
        restart,
    }
}

/// What a message should say of bodies without mass or moment of inertia that no mass moves with where a run failed, which
/// its status then says.
fn mass_message(system: &mut System, outcome: &mut Outcome) -> String {
    let Motion { dynamics, mechanism, .. } = &mut system.motion;
    let fails =
        matches!(outcome.status, Status::NonFinite | Status::StepUnderflow | Status::SingularMechanism);
    if !fails || !dynamics.lacks_inertia() {
        return String::new();
    }
    outcome.status = Status::SingularMechanism;
    let bodies = dynamics.bodies_without_inertia().into_iter();
    let names: Vec<String> = bodies.map(|body| format!("{:?}", mechanism.bodies[body].name)).collect();
    format!("; {} moves there where no mass moves with it", names.join(" or "))
}

/// The joint whose friction has two solutions or none where a run failed, which its status then says, with how much friction
/// changes itself.
fn friction_fault(system: &System, outcome: &mut Outcome) -> Option<(usize, f64)> {
    let Motion { dynamics, inside, .. } = &system.motion;
    let fault = match outcome.status {
        Status::NonFinite
        | Status::SingularMechanism
        | Status::StepUnderflow
        | Status::FrictionIndeterminate => dynamics.friction_fault(),
        Status::EventLocation => dynamics.friction_fault().or(inside.friction_fault()),
        _ => None,
    }?;
    outcome.status = Status::FrictionIndeterminate;
    Some(fault)
}

/// What a message should say of it.
fn friction_message((_, bound): (usize, f64)) -> String {
    format!(
        "; it changes the reaction that causes it by {bound:.6} of itself, and below 1 there is one solution: a block that \
         jams, or a journal larger than the arm of its load; reduce the coefficient or change the lengths"
    )
}

/// What a message should say of the forces and torques that depend on the motion, where a run failed.
fn load_message(system: &mut System, outcome: &Outcome, load: Option<&MotionLoad>, end: &State) -> String {
    let dynamics = &mut system.motion.dynamics;
    let loads = &system.motion.mechanism.motion_loads;
    let concerned: Vec<&MotionLoad> = match (outcome.status, load) {
        (Status::Done | Status::Cancelled, _) => return String::new(),
        (_, Some(load)) => vec![load],
        (Status::NonFinite | Status::SingularMechanism | Status::StepUnderflow, None) => {
            loads.iter().filter(|load| dynamics.acts(load)).collect()
        }
        _ => return String::new(),
    };
    if concerned.is_empty() {
        return String::new();
    }
    dynamics.move_to(outcome.time, &end.q, &end.v);
    let values = concerned.iter().map(|load| format!("; {:?} is {}", load.name, dynamics.described(load)));
    let advice = match outcome.status {
        Status::Held => "; dry friction written with sign(v) sticks here: write tanh(v / v0) with a small v0",
        Status::OutsideTable => "; beyond=\"hold\" keeps the value at its end",
        Status::OutsideDomain => {
            "; abs, max or min around what stands under a root or a power keeps it positive"
        }
        _ => "",
    };
    values.collect::<String>() + advice
}

/// Checks that tables cover the whole run, since they are not extrapolated.
fn check_functions(mechanism: &Mechanism, start: f64, end: f64) -> Result<(), InputError> {
    let problems: Vec<Problem> = mechanism
        .time_functions()
        .filter_map(|(name, function)| {
            let [first, last] = function.domain();
            let rounding = ROUNDING_OF_CHAIN * end.abs();
            (start < first - rounding || end > last + rounding).then(|| {
                Problem::new(
                    "settings.duration",
                    format!("the run from {start} to {end} [s] leaves the table of {name:?}, from {first} to {last} [s]"),
                )
            })
        })
        .collect();
    Subject::Settings.judge((), problems)
}
