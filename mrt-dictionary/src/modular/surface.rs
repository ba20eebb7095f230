//! Where the light of a block is known: at the texels of its walls and at the probes of its volume, and which
//! symmetries both have.

pub mod output_grid;
pub mod probes;
pub mod walls;
pub mod mirrors;
pub mod area_weights;
