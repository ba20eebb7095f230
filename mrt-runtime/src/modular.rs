//! Modular Radiance Transfer: a dictionary of shapes, a scene assembled from a level, and frames.

pub mod path;
pub mod dictionary;
pub mod dictionary_file;
pub mod packed;
pub mod scene;
pub mod assemble;
pub mod pack;
pub mod opening_responses;
pub mod frame;
mod propagate;
mod kernels;
