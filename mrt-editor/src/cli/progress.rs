//! Progress of long work on standard error, and the interrupt that stops it.

use mrt_dictionary::progress::Progress;
use std::io::{IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs long work with progress on standard error; an interrupt (Ctrl-C) asks it to stop.
pub fn with_progress<T>(name: &str, work: impl FnOnce(&Progress) -> T) -> T {
    let terminal = std::io::stderr().is_terminal();
    let report = |what: &str, step: usize, steps: usize| {
        let line = format!("{name}: step {step} of {steps}, {what}");
        // On a terminal one line is rewritten; in a log every step keeps its own.
        if terminal {
            eprint!("\r\x1b[K{line}");
            // Progress that cannot be shown is no reason to stop.
            let _ = std::io::stderr().flush();
        } else {
            eprintln!("{line}");
        }
    };
    let result = work(&Progress::new(&report, interrupted()));
    if terminal {
        eprintln!();
    }
    result
}

/// A flag that is set when the user interrupts the program.
fn interrupted() -> &'static AtomicBool {
    static FLAG: AtomicBool = AtomicBool::new(false);
    static HANDLER: OnceLock<bool> = OnceLock::new();
    // Without a handler an interrupt ends the program at once, which leaves no file either.
    HANDLER.get_or_init(|| ctrlc::set_handler(|| FLAG.store(true, Ordering::Relaxed)).is_ok());
    &FLAG
}
