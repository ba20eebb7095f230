//! What `mrt light` tells the user and goes on.

use crate::cli::output::warn;
use mrt_dictionary::modular::variants::warp_error::guessed_error;
use mrt_runtime::Level;
use mrt_runtime::blocks::WarpTransport;

/// Expected error of a canonical block above which the user is told.
const WARP_WARNING: f64 = 0.1;

/// Names the blocks that are warped too far for the operators that they use.
pub(super) fn warn_of_warps(level: &Level) {
    let guesses = level
        .blocks
        .iter()
        .enumerate()
        .filter(|(_, block)| block.transport == WarpTransport::Canonical)
        .map(|(index, block)| (index, guessed_error(&block.warp)))
        .filter(|&(_, error)| error > WARP_WARNING);
    let count = guesses.clone().count();
    if let Some((worst, error)) = guesses.max_by(|a, b| a.1.total_cmp(&b.1)) {
        warn(format_args!(
            "warning: {count} of {} blocks are warped so far that their light errs by over {:.0} %, \
             block {worst} by about {:.0} %; `mrt adapt` gives them operators of their own",
            level.blocks.len(),
            100.0 * WARP_WARNING,
            100.0 * error
        ));
    }
}
