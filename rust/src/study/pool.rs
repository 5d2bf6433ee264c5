//! Threads for the work of a study.

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Number of threads for some tasks: as many as requested (default: one for every processor), but no more
/// than tasks.
pub fn thread_count(threads: Option<usize>, tasks: usize) -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    threads.unwrap_or(processors).clamp(1, tasks.max(1))
}

/// A private pool: the global one does not survive a fork of the process, and its size may be set by others.
///
/// # Errors
///
/// If the threads cannot be started.
pub fn private_pool(count: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new().num_threads(count).build()
}

/// `work` for every task, in order, on threads of a private pool; `None` if one of them gives none.
///
/// # Errors
///
/// If the threads cannot be started.
pub fn in_parallel<T: Send>(
    tasks: usize,
    threads: Option<usize>,
    work: impl Fn(usize) -> Option<T> + Send + Sync,
) -> Result<Option<Vec<T>>, ThreadPoolBuildError> {
    let count = thread_count(threads, tasks);
    if count == 1 {
        return Ok((0..tasks).map(work).collect());
    }
    let pool = private_pool(count)?;
    Ok(pool.install(|| (0..tasks).into_par_iter().with_max_len(1).map(work).collect()))
}
