//! What frames read: operators in the order in which kernels take them.
//!
//! Texels of a block are kept in **slots** ([`Folding`]), so that mirrored texels stand at equal distances and even and
//! odd parts are sums and differences of whole vectors. Blocks of one shape stand one after another, and its operators
//! stay in the cache from block to block.

pub mod numbers;
pub mod folding;
pub mod shape;
pub mod transport;

pub use folding::Folding;
pub use numbers::PackedNumbers;
pub use shape::{Group, Operators, PackedShape, RowTile, Tiled};
pub use transport::{PackedTransport, TransportEntry, TransportPacker, TransportTile};
