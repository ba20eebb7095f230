//! The `mrt` tool's parts, in the order in which data flows: a mesh is read, a level is laid around it, kept as a
//! document, lit and looked at, and compared with references; the command line calls them all.

pub mod import;
pub mod fit_level;
pub mod document;
pub mod render;
pub mod accuracy;
pub mod cli;
