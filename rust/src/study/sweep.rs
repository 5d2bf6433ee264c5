//! Many runs in parallel: the only user of threads.
//!
//! Runs are independent and collected in the order of the scenes; nothing is summed across
//! them. The results are the same bits for any number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::error::{Problem, SceneError};
use crate::integrators::Status;
use crate::mechanism::compiled::Mechanism;
use crate::run::trajectory::{Settings, Trajectory, simulate};
use crate::scene::reader::read_scene;

/// Simulates every scene, given as JSON text, on `threads` threads of a private pool (default:
/// one for every processor).
///
/// `finished` counts the runs as they end. `monitor` is asked after every accepted step of any run; false
/// cancels all of them. It is asked by all threads at once and must not write what they share: a counter
/// kept there cost two threads 5 % of their time.
///
/// # Errors
/// The problems of all scenes together, with paths below `scenes[i]`; nothing is simulated then.
pub fn sweep(
    scenes: &[String],
    settings: &Settings,
    threads: Option<usize>,
    finished: &AtomicUsize,
    monitor: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Trajectory>, SceneError> {
    settings.check()?;
    // More threads than runs would only wait.
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let count = threads.unwrap_or(processors).clamp(1, scenes.len().max(1));
    // A pool of its own: the global one would not survive a fork, and its size is the user's.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .map_err(|error| SceneError::single("threads", format!("cannot be started: {error}")))?;
    pool.install(|| {
        let mechanisms = gather(
            scenes.par_iter().map(|text| read_scene(text).and_then(|scene| Mechanism::compile(&scene))),
        )?;
        gather(mechanisms.par_iter().with_max_len(1).map(|mechanism| {
            let run = simulate(mechanism, settings, &|_| monitor())?;
            if run.status != Status::Cancelled {
                finished.fetch_add(1, Ordering::Relaxed);
            }
            Ok(run)
        }))
    })
}

/// All results in order, or the problems of all failures with the path of their scene.
fn gather<T: Send>(
    results: impl IndexedParallelIterator<Item = Result<T, SceneError>>,
) -> Result<Vec<T>, SceneError> {
    let results: Vec<Result<T, SceneError>> = results.collect();
    let mut good = Vec::with_capacity(results.len());
    let mut problems = Vec::new();
    for (index, result) in results.into_iter().enumerate() {
        match result {
            Ok(value) => good.push(value),
            Err(error) => {
                problems.extend(error.problems.into_iter().map(|problem| {
                    Problem::new(format!("scenes[{index}].{}", problem.path), problem.message)
                }))
            }
        }
    }
    if problems.is_empty() { Ok(good) } else { Err(SceneError { problems }) }
}
