//! The end of a run as the start of another.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::contact::friction::JointPhase;
use crate::contact::pair::Phase;
use crate::contact::sticking::Traction;
use crate::error::{InputError, Notice, Problem, Subject};
use crate::numerics::turns::Turns;
use crate::run::contacts::OpenContact;
use crate::run::contacts::log::ContactLog;
use crate::run::motion::Motion;
use crate::run::work::Work;
use crate::scene::json::parse;

/// State of a run besides positions and velocities.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Contact phase of every clearance joint.
    pub phases: Vec<Phase>,
    /// Whether every ideal joint with friction sticks or slides.
    pub joint_phases: Vec<JointPhase>,
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
            joint_phases: dynamics.joint_phases().to_vec(),
            contacts: log.open.clone(),
            turns: dynamics.turns.clone(),
            work: (*counts_work && (work.input + work.losses()).is_finite())
                .then(|| Work { sectors: Vec::new(), ..work.clone() }),
        }
    }

    /// Gives it to the run that continues. Work and losses count from the start of the first run: they are NaN if one of
    /// the runs before did not integrate them, of which the notice tells.
    pub(crate) fn recall(&self, motion: &mut Motion, log: &mut ContactLog) -> Option<Notice> {
        motion.dynamics.phases.clone_from(&self.phases);
        motion.dynamics.set_joint_phases(&self.joint_phases);
        motion.dynamics.turns.clone_from(&self.turns);
        motion.inside.turns.clone_from(&self.turns);
        log.open.clone_from(&self.contacts);
        let is_unknown = motion.counts_work && self.work.is_none();
        let unknown = is_unknown.then(|| Work::unknown(self.contacts.len(), self.joint_phases.len()));
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
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
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

impl Restart {
    /// As JSON.
    pub fn to_json(&self) -> String {
        json!(self).to_string()
    }

    /// What [`Restart::to_json`] wrote.
    ///
    /// # Errors
    /// The first missing or wrong field, with its path below `start`; or all numbers that no run can have ended with.
    pub fn from_json(text: &str) -> Result<Restart, InputError> {
        let text = parse(Subject::Start, "start", text)?;
        let restart: Restart = serde_path_to_error::deserialize(text).map_err(|error| {
            let path = format!("start.{}", error.path());
            Subject::Start.error(path.trim_end_matches('.'), error.inner().to_string())
        })?;
        restart.check()?;
        Ok(restart)
    }

    /// Numbers that no run can have ended with.
    ///
    /// # Errors
    /// Each of them, with its path below `start`.
    pub fn check(&self) -> Result<(), InputError> {
        let mut problems = Vec::new();
        let mut expect = |good: bool, path: String, what: &str, value: f64| {
            if !good {
                problems.push(Problem::new(format!("start.{path}"), format!("must be {what}, got {value}")));
            }
        };
        let Memory { phases, turns, work, .. } = &self.memory;
        expect(self.time >= 0.0, "time".to_owned(), ">= 0 [s]", self.time);
        for (index, &number) in turns.iter().enumerate() {
            let path = format!("memory.turns[{index}]");
            expect(number.fract() == 0.0, path, "a whole number of full turns", number);
        }
        for (index, phase) in phases.iter().enumerate() {
            let Phase::Contact { latch, traction, .. } = phase else { continue };
            let path = |name: &str| format!("memory.phases[{index}].Contact.{name}");
            let damping = latch.hysteresis_factor;
            expect(damping >= 0.0, path("latch.hysteresis_factor"), ">= 0 [s/m]", damping);
            let Some(Traction { stiffness, damping, load, direction, .. }) = *traction else { continue };
            expect(stiffness > 0.0, path("traction.stiffness"), "> 0 [N/m]", stiffness);
            expect(damping >= 0.0, path("traction.damping"), ">= 0 [N s/m]", damping);
            expect(load > 0.0, path("traction.load"), "> 0 [N]", load);
            expect(
                [-1.0, 0.0, 1.0].contains(&direction),
                path("traction.direction"),
                "-1, 0 or 1",
                direction,
            );
        }
        if let Some(work) = work {
            expect(work.damping >= 0.0, "memory.work.damping".to_owned(), ">= 0 [J]", work.damping);
            for (index, loss) in work.contacts.iter().enumerate() {
                expect(
                    loss.wear >= 0.0,
                    format!("memory.work.contacts[{index}].wear"),
                    ">= 0 [N m]",
                    loss.wear,
                );
            }
        }
        Subject::Start.judge((), problems)
    }
}
