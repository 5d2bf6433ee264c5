//! Threads for the work of a study.

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
