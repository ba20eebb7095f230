//! What a lightfield that enters through an opening does to the block behind.

pub mod cube;
pub mod tube;
