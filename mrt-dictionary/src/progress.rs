//! Progress of a bake, and the caller's way to stop it.

use std::sync::atomic::{AtomicBool, Ordering};

/// The caller asked a bake to stop, and nothing was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Reports the steps of a bake to the caller, and tells the bake when the caller wants it to stop.
pub struct Progress<'a> {
    report: &'a (dyn Fn(&str, usize, usize) + Sync),
    cancel: &'a AtomicBool,
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Progress<'a> {
    /// `report(what, step, steps)` is called as each step starts, with `step` from 0 to `steps - 1`. Set `cancel` at any
    /// time to stop.
    pub fn new(report: &'a (dyn Fn(&str, usize, usize) + Sync), cancel: &'a AtomicBool) -> Self {
        Self { report, cancel }
    }

    /// Reports nothing and is never cancelled.
    pub fn silent() -> Progress<'static> {
        Progress {
            report: &|_, _, _| {},
            cancel: &NEVER,
        }
    }

    /// Announces step `step` of `steps`.
    ///
    /// # Errors
    /// [`Cancelled`], if the caller has asked to stop.
    pub fn step(&self, what: &str, step: usize, steps: usize) -> Result<(), Cancelled> {
        self.check()?;
        (self.report)(what, step, steps);
        Ok(())
    }

    /// Cheap enough to be called often inside long work.
    ///
    /// # Errors
    /// [`Cancelled`], if the caller has asked to stop.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(Cancelled);
        }
        Ok(())
    }
}

/// Counts the steps of a bake as they start.
pub(crate) struct Steps<'a> {
    progress: &'a Progress<'a>,
    started: usize,
    count: usize,
}

impl<'a> Steps<'a> {
    /// For a bake of `count` steps.
    pub fn new(progress: &'a Progress<'a>, count: usize) -> Self {
        Self {
            progress,
            started: 0,
            count,
        }
    }

    /// Announces the next step.
    ///
    /// # Errors
    /// [`Cancelled`], if the caller has asked to stop.
    pub fn start(&mut self, what: &str) -> Result<(), Cancelled> {
        self.progress.step(what, self.started, self.count)?;
        self.started += 1;
        Ok(())
    }
}
