//! The end of a run as the start of another.

use serde_json::{Value, json};

use crate::contact::normal::Latch;
use crate::contact::pair::Phase;
use crate::contact::sticking::Traction;
use crate::dynamics::ContactLoss;
use crate::error::{InputError, Problem, Subject};
use crate::numerics::turns::Turns;
use crate::run::contacts::{Contact, OpenContact};
use crate::run::work::Work;
use crate::scene::json::{Fields, Node, Problems};

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
        let value: Value = serde_json::from_str(text)
            .map_err(|error| Subject::Start.error("start", format!("is not valid JSON: {error}")))?;
        let mut problems = Vec::new();
        let restart = read(Node::root(&value, "start"), &mut problems);
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

fn read(node: Node, problems: &mut Problems) -> Restart {
    let mut fields = node.fields(problems);
    let time = fields.number("time", problems);
    if !(time >= 0.0 && time.is_finite()) {
        problems.push(Problem::new(fields.path_of("time"), format!("must be >= 0 [s], got {time}")));
    }
    let restart = Restart {
        time,
        parts: fields.required("parts", problems).map_or_else(Vec::new, |node| node.texts(problems)),
        q: fields.numbers("q", problems),
        v: fields.numbers("v", problems),
        memory: read_memory(&mut fields, problems),
    };
    fields.finish(problems);
    restart
}

fn read_memory(fields: &mut Fields, problems: &mut Problems) -> Memory {
    let contacts = fields.list("contacts", problems, |node, problems| {
        let open = !node.value.is_null();
        open.then(|| read_contact(node, problems))
    });
    // The index in the list is that of the joint.
    let contacts = contacts.into_iter().enumerate().map(|(joint, open)| {
        open.map(|open| OpenContact { contact: Contact { joint, ..open.contact }, ..open })
    });
    Memory {
        phases: fields.list("phases", problems, read_phase),
        tractions: fields.list("tractions", problems, |node, problems| {
            let numbers = node.numbers(problems);
            Traction::from_numbers(std::array::from_fn(|k| numbers.get(k).copied().unwrap_or(f64::NAN)))
        }),
        contacts: contacts.collect(),
        turns: fields.numbers("turns", problems),
        work: fields.optional("work").map(|node| read_work(node, problems)),
    }
}

fn read_phase(node: Node, problems: &mut Problems) -> Phase {
    if node.value.is_null() {
        return Phase::Free;
    }
    if node.value == BEYOND {
        return Phase::Beyond;
    }
    let mut fields = node.fields(problems);
    let [damping, impact_velocity] = Latch::NAMES;
    let latch = Latch::from_numbers([
        fields.number(damping, problems),
        fields.number_or(impact_velocity, 0.0, problems),
    ]);
    let clipped = fields.number("clipped", problems);
    if clipped != 0.0 && clipped != 1.0 {
        problems.push(Problem::new(fields.path_of("clipped"), format!("must be 0 or 1, got {clipped}")));
    }
    let numbers = Traction::NAMES.map(|name| fields.optional_number(name, problems));
    let traction = numbers.iter().any(Option::is_some).then(|| {
        // What is missing is no number, which the checks refuse.
        Traction::from_numbers(numbers.map(|number| number.unwrap_or(f64::NAN)))
    });
    let phase = Phase::Contact { latch, clipped: clipped != 0.0, traction };
    fields.finish(problems);
    phase
}

fn read_contact(node: Node, problems: &mut Problems) -> OpenContact {
    let mut fields = node.fields(problems);
    let contact = Contact {
        joint: 0,
        onset: fields.number("onset", problems),
        separation: f64::NAN,
        impact_velocity: fields.number("impact_velocity", problems),
        peak_force: fields.number("peak_force", problems),
        peak_time: fields.number("peak_time", problems),
    };
    fields.finish(problems);
    OpenContact { contact, last: None }
}

fn read_work(node: Node, problems: &mut Problems) -> Work {
    let mut fields = node.fields(problems);
    let work = Work {
        start_energy: fields.number("start_energy", problems),
        input: fields.number("input", problems),
        damping: fields.number("damping", problems),
        contacts: fields.list("contacts", problems, |node, problems| match node.numbers(problems)[..] {
            [impact, friction, wear] => ContactLoss { impact, friction, wear },
            _ => {
                problems.push(Problem::new(&node.path, "must be three numbers"));
                ContactLoss::default()
            }
        }),
        sectors: Vec::new(),
        dry_joints: fields.optional("dry_joints").map_or_else(Vec::new, |node| node.numbers(problems)),
    };
    fields.finish(problems);
    work
}
