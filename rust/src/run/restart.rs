//! The end of a run as the start of another: what must be known to go on bit for bit.

use serde_json::{Value, json};

use crate::contact::clearance::Phase;
use crate::contact::normal::Latch;
use crate::dynamics::ContactLoss;
use crate::error::{InputError, Problem, Subject};
use crate::integrators::{Checkpoint, MethodMemory};
use crate::numerics::turns::Turns;
use crate::run::contacts::{Contact, OpenContact};
use crate::run::work::Work;
use crate::scene::json::{Fields, Node, Problems};

/// What a run remembers at an instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// Contact phase of every clearance joint.
    pub phases: Vec<Phase>,
    /// Contacts that go on, one or none for every clearance joint.
    pub contacts: Vec<Option<OpenContact>>,
    /// Full turns of every column that the coordinates leave out.
    pub turns: Vec<Turns>,
    /// Work and losses so far, if the run counted them.
    pub work: Option<Work>,
}

/// Where a run can be continued.
#[derive(Clone, Debug, PartialEq)]
pub struct Restart {
    /// End of the run [s]: where the samples of the next one start.
    pub time: f64,
    /// Names of the coordinates and clearance joints of the mechanism, by which another one is told.
    pub parts: Vec<String>,
    /// The last state that the end did not influence.
    pub checkpoint: Checkpoint,
    /// What the run remembered there.
    pub memory: Memory,
    /// The end itself. The checkpoint lies before it, and what follows it depends on the mechanism: another
    /// one must go on from here.
    pub end: Option<End>,
}

/// State and memory of a run at its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct End {
    /// Position.
    pub q: Vec<f64>,
    /// Velocity.
    pub v: Vec<f64>,
    /// What the run remembered.
    pub memory: Memory,
}

/// JSON has no numbers that are not finite.
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
        let Checkpoint { time, q, v, step, last, steps_since_restart, memory } = &self.checkpoint;
        let method = memory.map(|MethodMemory { implicit, steps, contradictions, pause, next_pause }| {
            [u32::from(implicit), steps, contradictions, pause, next_pause]
        });
        let mut text = write_memory(&self.memory);
        text["time"] = json!(self.time);
        text["parts"] = json!(self.parts);
        text["checkpoint"] = json!({
            "time": time,
            "q": numbers(q),
            "v": numbers(v),
            "step": number(*step),
            "last": numbers(last),
            "steps_since_restart": steps_since_restart,
            "method": method,
        });
        if let Some(end) = &self.end {
            text["end"] = write_memory(&end.memory);
            text["end"]["q"] = numbers(&end.q);
            text["end"]["v"] = numbers(&end.v);
        }
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
        let restart = read(Node { value: &value, path: "start".to_owned() }, &mut problems);
        Subject::Start.judge(restart, problems)
    }

    /// For another mechanism, which must not act before the end: a start from the end itself, with a first
    /// step found anew.
    ///
    /// # Errors
    /// If the end was not noted.
    pub fn at_end(self) -> Result<Restart, InputError> {
        let Restart { time, parts, end, .. } = self;
        let Some(End { q, v, memory }) = end else {
            return Err(Subject::Start
                .error("start", "is too old to tell its very end: only its own scene can go on".to_owned()));
        };
        let checkpoint = Checkpoint::at(time, &q, &v);
        Ok(Restart { time, parts, checkpoint, memory, end: None })
    }
}

fn write_memory(memory: &Memory) -> Value {
    let Memory { phases, contacts, turns, work } = memory;
    let phase = |phase: &Phase| match *phase {
        Phase::Free => Value::Null,
        Phase::Contact { latch, clipped } => {
            let mut text = json!({ "clipped": f64::from(clipped) });
            for (name, value) in Latch::NAMES.into_iter().zip(latch.numbers()) {
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
        })
    });
    json!({
        "phases": phases.iter().map(phase).collect::<Vec<_>>(),
        "contacts": contacts.iter().map(contact).collect::<Vec<_>>(),
        "turns": numbers(turns),
        "work": work,
    })
}

fn read(node: Node, problems: &mut Problems) -> Restart {
    let mut fields = node.fields(problems);
    let time = instant(&mut fields, problems);
    let parts = fields.required("parts", problems).map_or_else(Vec::new, |node| node.texts(problems));
    let checkpoint = match fields.required("checkpoint", problems) {
        Some(node) => read_checkpoint(node, problems),
        None => Checkpoint::at(f64::NAN, &[], &[]),
    };
    let memory = read_memory(&mut fields, problems);
    let end = fields.optional("end").map(|node| {
        let mut fields = node.fields(problems);
        let end = End {
            q: fields.numbers("q", problems),
            v: fields.numbers("v", problems),
            memory: read_memory(&mut fields, problems),
        };
        fields.finish(problems);
        end
    });
    fields.finish(problems);
    Restart { time, parts, checkpoint, memory, end }
}

fn read_memory(fields: &mut Fields, problems: &mut Problems) -> Memory {
    let contacts = fields.list("contacts", problems, |node, problems| {
        let open = !node.value.is_null();
        open.then(|| read_contact(node, problems))
    });
    // The place in the list is the joint.
    let contacts = contacts.into_iter().enumerate().map(|(joint, open)| {
        open.map(|open| OpenContact { contact: Contact { joint, ..open.contact }, ..open })
    });
    Memory {
        phases: fields.list("phases", problems, read_phase),
        contacts: contacts.collect(),
        turns: fields.numbers("turns", problems),
        work: fields.optional("work").map(|node| read_work(node, problems)),
    }
}

fn read_checkpoint(node: Node, problems: &mut Problems) -> Checkpoint {
    let mut fields = node.fields(problems);
    let checkpoint = Checkpoint {
        time: instant(&mut fields, problems),
        q: fields.numbers("q", problems),
        v: fields.numbers("v", problems),
        // NaN where the next run finds its first step itself.
        step: match fields.number("step", problems) {
            step if step <= 0.0 || step == f64::INFINITY => {
                problems.push(Problem::new(fields.path_of("step"), format!("must be > 0 [s], got {step}")));
                f64::NAN
            }
            step => step,
        },
        last: fields.pair("last", problems),
        steps_since_restart: fields.count_or("steps_since_restart", 0, problems),
        memory: fields.optional("method").map(|node| read_method(node, problems)),
    };
    fields.finish(problems);
    checkpoint
}

fn instant(fields: &mut Fields, problems: &mut Problems) -> f64 {
    let time = fields.number("time", problems);
    if !(time >= 0.0 && time.is_finite()) {
        problems.push(Problem::new(fields.path_of("time"), format!("must be >= 0 [s], got {time}")));
    }
    time
}

fn read_method(node: Node, problems: &mut Problems) -> MethodMemory {
    let whole = |number: f64| (number >= 0.0 && number <= f64::from(u32::MAX)).then_some(number as u32);
    let numbers: Vec<u32> = node.numbers(problems).into_iter().filter_map(whole).collect();
    match numbers[..] {
        [implicit, steps, contradictions, pause, next_pause] => {
            MethodMemory { implicit: implicit != 0, steps, contradictions, pause, next_pause }
        }
        _ => {
            problems.push(Problem::new(&node.path, "must be five whole numbers"));
            MethodMemory::default()
        }
    }
}

fn read_phase(node: Node, problems: &mut Problems) -> Phase {
    if node.value.is_null() {
        return Phase::Free;
    }
    let mut fields = node.fields(problems);
    let phase = Phase::Contact {
        latch: Latch::from_numbers(Latch::NAMES.map(|name| fields.number(name, problems))),
        clipped: fields.number("clipped", problems) != 0.0,
    };
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
    };
    fields.finish(problems);
    work
}
