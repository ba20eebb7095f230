//! Progress of a bake, and the caller's way to stop it.

use std::sync::atomic::{AtomicBool, Ordering};

/// The caller asked a bake to stop; nothing was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Reports steps to the caller and carries the wish to stop back.
pub struct Progress<'a> {
    report: &'a (dyn Fn(&str, usize, usize) + Sync),
    cancel: &'a AtomicBool,
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Progress<'a> {
    /// `report(what, step, steps)` is called as each step starts; set `cancel` at any time to stop.
    pub fn new(report: &'a (dyn Fn(&str, usize, usize) + Sync), cancel: &'a AtomicBool) -> Self {
        Self { report, cancel }
    }

    /// Says nothing and is never cancelled.
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

    /// Called often inside long work.
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
