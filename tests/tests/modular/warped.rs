//! Warped blocks: their transport, levels of them, and what is neglected in bent ones.

mod bent;
mod levels;
mod transport;
