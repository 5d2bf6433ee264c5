//! The end of a run as the start of another.

use serde_json::{Value, json};

use crate::contact::normal::Latch;
use crate::contact::pair::Phase;
use crate::contact::sticking::Traction;
use crate::dynamics::ContactLoss;
use crate::error::Notice;
use crate::error::{InputError, Problem, Subject};
use crate::numerics::turns::Turns;
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Contact, OpenContact};
use crate::run::motion::Motion;
use crate::run::work::Work;
use crate::scene::json::{Fields, Node, parse, read_object};

/// State of a run besides positions and velocities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// Contact phase of every clearance joint.
    pub phases: Vec<Phase>,
    /// Whether every ideal joint with friction sticks or slides, and its spring.
    pub tractions: Vec<Traction>,
    /// Open contacts, at most one for every clearance joint.
    pub contacts: Vec<Option<OpenContact>>,
    /// Full turns that were subtracted from the coordinate of every column.
    pub turns: Vec<Turns>,
    /// Work and losses so far, if the run integrated them.
    pub work: Option<Work>,
}

impl Memory {
    /// The memory of a run.
    pub(crate) fn of(motion: &Motion, log: &ContactLog) -> Self {
        let Motion { dynamics, work, counts_work, .. } = motion;
        Self {
            phases: dynamics.phases.clone(),
            tractions: dynamics.tractions().to_vec(),
            contacts: log.open.clone(),
            turns: dynamics.turns.clone(),
            work: (*counts_work && !work.input.is_nan())
                .then(|| Work { sectors: Vec::new(), ..work.clone() }),
        }
    }

    /// Gives it to the run that continues. Work and losses count from the start of the first run: they are NaN if one of
    /// the runs before did not integrate them, of which the notice tells.
    pub(crate) fn recall(&self, motion: &mut Motion, log: &mut ContactLog) -> Option<Notice> {
        motion.dynamics.phases.clone_from(&self.phases);
        motion.dynamics.set_tractions(&self.tractions);
        motion.dynamics.turns.clone_from(&self.turns);
        motion.inside.turns.clone_from(&self.turns);
        log.open.clone_from(&self.contacts);
        let is_unknown = motion.counts_work && self.work.is_none();
        let unknown = is_unknown.then(|| Work::unknown(self.contacts.len(), self.tractions.len()));
        if let Some(work) = self.work.clone().or(unknown) {
            motion.work = Work { sectors: std::mem::take(&mut motion.work.sectors), ..work };
        }
        is_unknown.then(|| Notice {
            code: "work_unknown",
            about: Vec::new(),
            numbers: Vec::new(),
            text: "work and losses count from the first start on, and the run that ended at the given start did \
                   not count them: they are NaN; name one of them in the outputs of that run too"
                .to_owned(),
        })
    }
}

/// The end of a run, from which another run can continue.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restart {
    /// Time [s].
    pub time: f64,
    /// Names of the coordinates and clearance joints of the mechanism, by which another mechanism is
    /// recognized.
    pub parts: Vec<String>,
    /// Position.
    pub q: Vec<f64>,
    /// Velocity.
    pub v: Vec<f64>,
    /// Contacts, turns and work.
    pub memory: Memory,
}

/// Numbers that are not finite become text, since JSON has none.
fn number(value: f64) -> Value {
    if value.is_finite() {
        json!(value)
    } else if value.is_nan() {
        json!("NaN")
    } else {
        json!(if value > 0.0 { "Infinity" } else { "-Infinity" })
    }
}

fn numbers<'a>(values: impl IntoIterator<Item = &'a f64>) -> Value {
    values.into_iter().map(|&value| number(value)).collect()
}

impl Restart {
    /// As JSON.
    pub fn to_json(&self) -> String {
        let mut text = write_memory(&self.memory);
        text["time"] = json!(self.time);
        text["parts"] = json!(self.parts);
        text["q"] = numbers(&self.q);
        text["v"] = numbers(&self.v);
        text.to_string()
    }

    /// What [`Restart::to_json`] wrote.
    ///
    /// # Errors
    /// Every missing or wrong field, with paths below `start`.
    pub fn from_json(text: &str) -> Result<Restart, InputError> {
        let (restart, problems) = read_object(&parse(Subject::Start, "start", text)?, "start", None, read);
        let restart = Subject::Start.judge(restart, problems)?;
        restart.check()?;
        Ok(restart)
    }

    /// Numbers that no run can have ended with.
    ///
    /// # Errors
    /// Each of them, with its path below `start`.
    pub fn check(&self) -> Result<(), InputError> {
        let mut problems = Vec::new();
        let mut expect = |good: bool, path: &str, what: &str, value: f64| {
            if !good {
                problems.push(Problem::new(format!("start.{path}"), format!("must be {what}, got {value}")));
            }
        };
        for (name, numbers) in [("q", &self.q), ("v", &self.v)] {
            for (index, &number) in numbers.iter().enumerate() {
                expect(number.is_finite(), &format!("{name}[{index}]"), "a finite number", number);
            }
        }
        let Memory { phases, tractions, turns, work, .. } = &self.memory;
        for (index, &number) in turns.iter().enumerate() {
            let is_whole = number.is_finite() && number.fract() == 0.0;
            expect(is_whole, &format!("turns[{index}]"), "a whole number of full turns", number);
        }
        for (index, phase) in phases.iter().enumerate() {
            let Phase::Contact { latch, traction, .. } = phase else { continue };
            for (name, number) in Latch::NAMES.into_iter().zip(latch.numbers()) {
                let is_damping = number.is_finite() && number >= 0.0;
                expect(is_damping, &format!("phases[{index}].{name}"), "a finite number >= 0", number);
            }
            let numbers =
                traction.iter().flat_map(|traction| Traction::NAMES.into_iter().zip(traction.numbers()));
            for (name, number) in numbers {
                let (good, what) = match name {
                    "tangential_stiffness" | "load" => (number > 0.0, "a finite number > 0"),
                    "tangential_damping" => (number >= 0.0, "a finite number >= 0"),
                    "sliding_direction" => ([-1.0, 0.0, 1.0].contains(&number), "-1, 0 or 1"),
                    _ => (true, "a finite number"),
                };
                expect(good && number.is_finite(), &format!("phases[{index}].{name}"), what, number);
            }
        }
        for (index, traction) in tractions.iter().enumerate() {
            for (name, number) in Traction::NAMES.into_iter().zip(traction.numbers()) {
                expect(number.is_finite(), &format!("tractions[{index}].{name}"), "a finite number", number);
            }
        }
        if let Some(work) = work {
            // Work that is not known is NaN.
            expect(work.damping >= 0.0 || work.damping.is_nan(), "work.damping", ">= 0 [J]", work.damping);
            for (index, loss) in work.contacts.iter().enumerate() {
                expect(
                    loss.wear >= 0.0 || loss.wear.is_nan(),
                    &format!("work.contacts[{index}][2]"),
                    ">= 0 [N m]",
                    loss.wear,
                );
            }
        }
        Subject::Start.judge((), problems)
    }
}

/// The phase of a corner that is not over its face.
const BEYOND: &str = "beyond";

fn write_memory(memory: &Memory) -> Value {
    let Memory { phases, tractions, contacts, turns, work } = memory;
    let phase = |phase: &Phase| match *phase {
        Phase::Free => Value::Null,
        Phase::Beyond => json!(BEYOND),
        Phase::Contact { latch, clipped, traction } => {
            let mut text = json!({ "clipped": f64::from(clipped) });
            let latched = Latch::NAMES.into_iter().zip(latch.numbers());
            let of_spring = traction.map(|traction| Traction::NAMES.into_iter().zip(traction.numbers()));
            for (name, value) in latched.chain(of_spring.into_iter().flatten()) {
                text[name] = json!(value);
            }
            text
        }
    };
    let contact = |open: &Option<OpenContact>| match open {
        None => Value::Null,
        Some(OpenContact { contact, .. }) => json!({
            "onset": number(contact.onset),
            "impact_velocity": number(contact.impact_velocity),
            "peak_force": number(contact.peak_force),
            "peak_time": number(contact.peak_time),
        }),
    };
    let loss = |loss: &ContactLoss| numbers(&[loss.impact, loss.friction, loss.wear]);
    let work = work.as_ref().map(|work| {
        json!({
            "start_energy": number(work.start_energy),
            "input": number(work.input),
            "damping": number(work.damping),
            "contacts": work.contacts.iter().map(loss).collect::<Vec<_>>(),
            "dry_joints": numbers(&work.dry_joints),
        })
    });
    json!({
        "phases": phases.iter().map(phase).collect::<Vec<_>>(),
        "tractions": tractions.iter().map(|one| numbers(&one.numbers())).collect::<Vec<_>>(),
        "contacts": contacts.iter().map(contact).collect::<Vec<_>>(),
        "turns": numbers(turns),
        "work": work,
    })
}

fn read(fields: &mut Fields) -> Restart {
    let time = fields.number("time");
    if !(time >= 0.0 && time.is_finite()) {
        fields.problem("time", format!("must be >= 0 [s], got {time}"));
    }
    let parts = fields.required("parts").map_or_else(Vec::new, |node| node.texts());
    Restart { time, parts, q: fields.numbers("q"), v: fields.numbers("v"), memory: read_memory(fields) }
}

fn read_memory(fields: &mut Fields) -> Memory {
    let contacts = fields.list("contacts", |node| (!node.value.is_null()).then(|| node.read(read_contact)));
    // The index in the list is that of the joint.
    let contacts = contacts.into_iter().enumerate().map(|(joint, contact)| {
        contact.map(|contact| OpenContact { contact: Contact { joint, ..contact }, last: None })
    });
    Memory {
        phases: fields.list("phases", read_phase),
        tractions: fields.list("tractions", |node| {
            let numbers = node.numbers();
            Traction::from_numbers(std::array::from_fn(|k| numbers.get(k).copied().unwrap_or(f64::NAN)))
        }),
        contacts: contacts.collect(),
        turns: fields.numbers("turns"),
        work: fields.optional("work").map(|node| node.read(read_work)),
    }
}

fn read_phase(node: Node) -> Phase {
    if node.value.is_null() {
        return Phase::Free;
    }
    if node.value == BEYOND {
        return Phase::Beyond;
    }
    node.read(|fields| {
        let [damping, impact_velocity] = Latch::NAMES;
        let latch = Latch::from_numbers([fields.number(damping), fields.number_or(impact_velocity, 0.0)]);
        let clipped = fields.number("clipped");
        if clipped != 0.0 && clipped != 1.0 {
            fields.problem("clipped", format!("must be 0 or 1, got {clipped}"));
        }
        let numbers = Traction::NAMES.map(|name| fields.optional_number(name));
        let traction = numbers.iter().any(Option::is_some).then(|| {
            // What is missing is no number, which the checks refuse.
            Traction::from_numbers(numbers.map(|number| number.unwrap_or(f64::NAN)))
        });
        Phase::Contact { latch, clipped: clipped != 0.0, traction }
    })
}

fn read_contact(fields: &mut Fields) -> Contact {
    Contact {
        joint: 0,
        onset: fields.number("onset"),
        separation: f64::NAN,
        impact_velocity: fields.number("impact_velocity"),
        peak_force: fields.number("peak_force"),
        peak_time: fields.number("peak_time"),
    }
}

fn read_work(fields: &mut Fields) -> Work {
    Work {
        start_energy: fields.number("start_energy"),
        input: fields.number("input"),
        damping: fields.number("damping"),
        contacts: fields.list("contacts", |node| match node.numbers()[..] {
            [impact, friction, wear] => ContactLoss { impact, friction, wear },
            _ => {
                node.problem("must be three numbers");
                ContactLoss::default()
            }
        }),
        sectors: Vec::new(),
        dry_joints: fields.optional("dry_joints").map_or_else(Vec::new, |node| node.numbers()),
    }
}
