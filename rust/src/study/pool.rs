//! Threads for the work of a study.

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// How many threads some tasks are worth: as many as asked for (default: one for every processor), but more than
/// tasks would only wait.
pub fn thread_count(threads: Option<usize>, tasks: usize) -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    threads.unwrap_or(processors).clamp(1, tasks.max(1))
}

/// A pool of its own: the global one would not survive a fork, and its size is the user's.
///
/// # Errors
///
/// Threads that cannot be started.
pub fn private_pool(count: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new().num_threads(count).build()
}
