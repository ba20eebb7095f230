//! Frames: instruction sets, parts, skipping, long runs.

mod levels;
mod parts;
mod skipping;
mod stress;
