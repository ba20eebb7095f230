//! The `mrt` tool's parts, in the order in which data flows: a dictionary is found or baked, a mesh is
//! read, mapped to blocks, lit through them, looked at and compared with references.

pub mod import;
pub mod fit_level;
pub mod document;
pub mod render;
pub mod cli;
