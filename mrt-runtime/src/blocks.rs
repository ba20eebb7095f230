//! The parts of a level: blocks of canonical shapes, the openings that join them, and doors.
//!
//! Most levels are read from text ([`Level::from_text`](crate::Level::from_text)). A program that builds a level fills
//! the lists of a [`Level`](crate::Level) with these parts.

pub use crate::level::block::{Block, Connection, Door, Opening};
pub use crate::level::cells::CellsError;
#[cfg(feature = "generator")]
pub use crate::level::generator::maze;
pub use crate::level::mesh_reading::{MeshReading, UpAxis};
pub use crate::level::shape::{SHAPES, Shape};
pub use crate::level::warp_transport::WarpTransport;
pub use mrt_core::geometry::cube::{CubeRotation, Face};
pub use mrt_core::geometry::hexahedron::Hexahedron;
