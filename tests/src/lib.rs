//! The independent references that the other crates are measured against, built on `mrt-core` alone:
//! none of the method's own code (dictionaries, lightfields, reduced bases) takes part.
//!
//! 1. [`oracle_file`] reads reference files that another renderer computed.
//! 2. [`error_measure`] states how far an answer is from a reference, whole and by distance.
//! 3. [`exact`] solves levels of convex blocks with closed-form form factors and exact visibility.
//! 4. [`path_tracer`] solves any triangle mesh by sampling.

pub mod error_measure;
pub mod exact;
pub mod oracle_file;
pub mod path_tracer;

/// How many diffuse reflections an indirect irradiance contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounces {
    /// Light that was reflected once.
    First,
    /// Light that was reflected at least once and at most this often.
    Count(usize),
    /// Light that was reflected at least once.
    All,
}
