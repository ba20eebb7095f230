//! What a block sends out through an opening, and how lightfields pass through blocks from opening to opening.

pub mod cube;
pub mod tube;
