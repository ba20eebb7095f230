//! Operators as frames read them, in the order in which kernels use their numbers.
//!
//! The texels of a block are stored in **slots** ([`Folding`]), such that mirrored texels are at equal distances, and
//! even and odd parts are sums and differences of whole vectors. Blocks of one shape follow each other, so that the
//! operators of the shape stay in the cache from block to block.

pub mod numbers;
pub mod folding;
pub mod shape;
pub mod transport;

pub use folding::Folding;
pub use numbers::PackedNumbers;
pub use shape::{Group, Operators, PackedShape, RowTile, Tiled};
pub use transport::{PackedTransport, TransportEntry, TransportPacker, TransportTile};
