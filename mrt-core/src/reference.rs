//! Independent references that the method is measured against. None of the method's own code
//! (dictionaries, lightfields, reduced bases) takes part.
//!
//! 1. [`oracle_file`] reads reference files that another renderer computed.
//! 2. [`error_measure`] states how far an answer is from a reference, as a whole and by distance.
//! 3. [`radiosity`] solves levels of convex blocks with closed-form form factors and exact visibility.
//! 4. [`path_tracer`] solves any triangle mesh by sampling.

pub mod bounces;
pub mod cells;
pub mod error_measure;
pub mod radiosity;
pub mod oracle_file;
pub mod path_tracer;
