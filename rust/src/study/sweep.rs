//! Many runs in parallel.
//!
//! Runs are independent and collected in the order of the scenes; nothing is summed across
//! them. The results do not depend on the number of threads, to the last bit.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::error::{InputError, Problem, Subject};
use crate::integrators::Status;
use crate::mechanism::branch::differs;
use crate::mechanism::compiled::Mechanism;
use crate::run::trajectory::{Settings, Trajectory, check, columns, record};
use crate::scene::reader::Structure;
use crate::study::pool::{private_pool, thread_count};

/// A scene as its structure, which many share, and its numbers.
#[derive(Clone, Debug)]
pub struct FlatScene {
    /// Everything that is no number.
    pub structure: Arc<Structure>,
    /// The numbers, in the order of the structure.
    pub numbers: Vec<f64>,
    /// Signs of the branch on which it must be assembled; none if any will do.
    pub branch: Vec<i8>,
}

/// Mechanisms that are simulated with the same settings.
pub struct Sweep<'s> {
    settings: &'s Settings,
    /// None for the calling thread alone.
    pool: Option<rayon::ThreadPool>,
    mechanisms: Vec<Mechanism>,
    /// Names of the columns, the same for all.
    pub columns: Vec<String>,
}

/// Whether to continue; false cancels. All threads call it at once, so it should not write to shared memory:
/// a counter there cost two threads 5 % of their time.
pub type Monitor<'a> = &'a (dyn Fn() -> bool + Sync);

impl<'s> Sweep<'s> {
    /// Compiles every scene on `threads` threads of a private pool (default: one for every processor), on which they
    /// will also be simulated; on the calling thread if it is one. `None` if the monitor cancels.
    ///
    /// # Errors
    /// The problems of all scenes together, with paths below `scenes[i]`, including those of the settings,
    /// such as an unknown output, and columns that differ from those of the first scene.
    pub fn prepare(
        scenes: &[FlatScene],
        settings: &'s Settings,
        threads: Option<usize>,
        monitor: Monitor,
    ) -> Result<Option<Sweep<'s>>, InputError> {
        let count = thread_count(threads, scenes.len());
        let pool = (count > 1)
            .then(|| private_pool(count))
            .transpose()
            .map_err(|error| Subject::Settings.error("threads", format!("cannot be started: {error}")))?;
        let checked = |scene: &FlatScene| {
            let mechanism = Mechanism::compile_on(&scene.structure.scene(&scene.numbers)?, &scene.branch)?;
            if differs(&scene.branch, &mechanism.branch) {
                let message = "closes its loops on another side than the scene at the midpoint: values on two branches are \
                               those of two mechanisms; set the angles of the bodies for all scenes to one side, give a \
                               start, or take smaller intervals";
                return Err(Subject::Scene.error("branch", message));
            }
            check(&mechanism, settings)?;
            Ok(mechanism)
        };
        let compile = |scene| monitor().then(|| checked(scene));
        let compiled: Option<Vec<_>> = match &pool {
            Some(pool) => pool.install(|| scenes.par_iter().map(compile).collect()),
            None => scenes.iter().map(compile).collect(),
        };
        let Some(compiled) = compiled else { return Ok(None) };
        let mechanisms = gather(compiled)?;
        let names = mechanisms.first().map_or_else(Vec::new, |first| columns(first, settings));
        let others = mechanisms.iter().map(|mechanism| same_columns(&names, &columns(mechanism, settings)));
        gather(others.collect())?;
        Ok(Some(Sweep { settings, pool, mechanisms, columns: names }))
    }

    /// Simulates all mechanisms. The samples are written to `values` (runs, samples, columns) instead of the
    /// trajectories. `None` if the monitor, which is called before every run and after every accepted step,
    /// cancels. `finished` counts the completed runs. A run that takes longer than `limit` ends with the
    /// status [`Status::Cancelled`].
    ///
    /// # Errors
    /// If `values` has another size.
    pub fn run(
        &self,
        values: &mut [f64],
        finished: &AtomicUsize,
        limit: Option<Duration>,
        monitor: Monitor,
    ) -> Result<Option<Vec<Trajectory>>, InputError> {
        let size = self.settings.samples * self.columns.len();
        if values.len() != self.mechanisms.len() * size {
            return Err(Subject::Settings.error("settings.samples", "do not fit the memory that is given"));
        }
        let simulate = |(mechanism, values): (&Mechanism, &mut [f64])| {
            let begin = Instant::now();
            let go_on = |_| monitor() && limit.is_none_or(|limit| begin.elapsed() < limit);
            if limit.is_some() {
                values.fill(f64::NAN);
            }
            let run =
                monitor().then(|| record(mechanism, &mechanism.start, self.settings, &go_on, values))?;
            // Cancelled by the monitor, not by the time limit.
            if run.as_ref().is_ok_and(|run| run.status == Status::Cancelled) && !monitor() {
                return None;
            }
            finished.fetch_add(1, Ordering::Relaxed);
            Some(run)
        };
        // Not in chunks: those of length zero, where only features are requested, are not allowed.
        let mut rest = values;
        let place = |_| rest.split_off_mut(..size).unwrap_or_default();
        let places: Vec<&mut [f64]> = self.mechanisms.iter().map(place).collect();
        let runs: Option<Vec<_>> = match &self.pool {
            Some(pool) => pool
                .install(|| self.mechanisms.par_iter().zip(places).with_max_len(1).map(simulate).collect()),
            None => self.mechanisms.iter().zip(places).map(simulate).collect(),
        };
        runs.map(gather).transpose()
    }
}

/// Whether a mechanism has the columns of the first one.
fn same_columns(first: &[String], other: &[String]) -> Result<(), InputError> {
    if first == other {
        return Ok(());
    }
    let lacking = |from: &[String], to: &[String]| {
        let names: Vec<&str> = from.iter().filter(|name| !to.contains(name)).map(String::as_str).collect();
        match names[..] {
            [] => "nothing".to_owned(),
            [first, ref more @ ..] if more.len() > 2 => format!("{first:?} and {} more", more.len()),
            _ => names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "),
        }
    };
    let message = format!(
        "differ from those of the first scene, which lacks {} and has {} besides: all scenes of a study need the \
         same parts, or outputs that they share",
        lacking(other, first),
        lacking(first, other)
    );
    Err(Subject::Scene.error("outputs", message))
}

/// All results in order, or the problems of all failures with the paths of their scenes. They are problems of
/// the scenes, unless all have another subject in common.
fn gather<T>(results: Vec<Result<T, InputError>>) -> Result<Vec<T>, InputError> {
    let mut good = Vec::with_capacity(results.len());
    let mut problems = Vec::new();
    let mut subjects = Vec::new();
    for (index, result) in results.into_iter().enumerate() {
        match result {
            Ok(value) => good.push(value),
            Err(error) => {
                subjects.push(error.subject);
                problems.extend(error.problems.into_iter().map(|problem| {
                    Problem::new(format!("scenes[{index}].{}", problem.path), problem.message)
                }))
            }
        }
    }
    subjects.dedup();
    let subject = if let [subject] = subjects[..] { subject } else { Subject::Scene };
    subject.judge(good, problems)
}
