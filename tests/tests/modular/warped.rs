//! Warped blocks.

mod bent;
mod levels;
mod transport;
