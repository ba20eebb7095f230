//! Frames: kernels, parts, skipped work, large levels and long runs.

mod kernels;
mod parts;
mod skipping;
mod stress;
