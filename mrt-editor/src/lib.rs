//! The `mrt` tool's parts, in the order in which data flows: a dictionary is found or baked, a mesh is
//! read, mapped to blocks, lit through them, looked at and compared with references.

pub mod commands;
pub mod dictionary_source;
pub mod import;
pub mod level_file;
pub mod level_view;
pub mod map;
pub mod output;
pub mod picture;
pub mod receiver;
pub mod reference_level;
pub mod table;
