//! Runs the parts of a frame: on the caller's thread, or on threads that the caller provides.

use std::fmt::Debug;
use std::sync::{Mutex, PoisonError};

/// Runs tasks, in parallel or one after another.
pub trait Executor: Debug + Send + Sync {
    /// About how many tasks run in parallel.
    fn workers(&self) -> usize;

    /// Calls `task` once with each number below `tasks`, on any threads in any order, and returns when all calls have
    /// returned.
    fn run(&self, tasks: usize, task: &(dyn Fn(usize) + Sync));
}

/// Runs all tasks on the caller's thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl Executor for Serial {
    fn workers(&self) -> usize {
        1
    }

    fn run(&self, tasks: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..tasks).for_each(task);
    }
}

/// Runs tasks on the threads of rayon's current pool.
#[cfg(feature = "rayon")]
#[derive(Clone, Copy, Debug, Default)]
pub struct Rayon;

#[cfg(feature = "rayon")]
impl Executor for Rayon {
    fn workers(&self) -> usize {
        rayon::current_num_threads()
    }

    fn run(&self, tasks: usize, task: &(dyn Fn(usize) + Sync)) {
        use rayon::prelude::*;
        (0..tasks).into_par_iter().with_max_len(1).for_each(task);
    }
}

/// Most parts of a stage of a frame.
pub(crate) const MAX_TASKS: usize = 64;

/// Parts for each worker: enough that other workers do not wait long for one slow part.
const TASKS_PER_WORKER: usize = 4;

/// Number of parts into which to divide the work on `blocks` blocks.
pub(crate) fn task_count(executor: &dyn Executor, blocks: usize) -> usize {
    match executor.workers() {
        0 | 1 => 1,
        workers => (workers * TASKS_PER_WORKER).min(MAX_TASKS),
    }
    .min(blocks)
    .max(1)
}

/// Calls `f` with each part, on the executor's threads; allocates nothing.
///
/// # Panics
/// If there are more than [`MAX_TASKS`] parts.
pub(crate) fn run_parts<T: Send>(
    executor: &dyn Executor,
    parts: impl IntoIterator<Item = T>,
    f: impl Fn(T) + Sync,
) {
    let mut parts = parts.into_iter();
    if executor.workers() <= 1 {
        parts.for_each(f);
        return;
    }
    let mut slots: [Mutex<Option<T>>; MAX_TASKS] = std::array::from_fn(|_| Mutex::new(None));
    let mut count = 0;
    for (slot, part) in slots.iter_mut().zip(&mut parts) {
        *slot = Mutex::new(Some(part));
        count += 1;
    }
    assert!(parts.next().is_none(), "more than {MAX_TASKS} parts");
    executor.run(count, &|k| {
        let part = slots[k]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(part) = part {
            f(part);
        }
    });
}
