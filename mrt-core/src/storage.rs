//! Matrices in fewer bytes: `f32`, `f16`, or `int8` with one scale per mode. They are owned, or used
//! where they lie in the bytes of a file.
//!
//! A **mode** is a column of a basis (texels x modes) or a row of an operator that gives coefficients
//! (modes x texels); [`ModeAxis`] says which. Element (row, column) stands for
//! `values[column * rows + row] * scales[mode]`, computed in `f32`; `f32` itself has no scales.
//! How scales are chosen is in `storage/encode.rs`, sections of a container in `storage/sections.rs`.
//!
//! The table gives the relative L2 error of a matrix that is encoded and decoded. Products with the
//! matrix err by as much, unless they cancel:
//!
//! | storage | bytes per element | error |
//! | --- | --- | --- |
//! | `f32` | 4 | 0 |
//! | `f16` | 2 | 0.02 %, whatever the magnitude; at most 2⁻¹¹ = 0.05 %, for a mode of equal numbers |
//! | `int8` | 1 | 0.23 % times the ratio of largest to root mean square, of typical modes |
//!
//! So `int8` suits modes without peaks. Measured on baked operators (16² texels, 32 modes, one scale
//! per mode):
//!
//! | operator | error of `int8` |
//! | --- | --- |
//! | bases of irradiance in a room | 0.04 to 0.37 % |
//! | operators that give the coefficients of those bases | 0.66 to 1.2 % |
//! | light that enters by an opening | 1.2 % |
//! | operators between openings | 0.4 to 1 % |
//!
//! The axis of the scales matters more than the error of the matrix tells. With one scale per texel, an
//! operator that gives coefficients is more exact (0.6 %), yet the light of those coefficients is off
//! by tens of percent, because weak modes then err by as much as strong ones.

mod matrix;
mod encode;
mod sections;

pub use half::f16;
pub use matrix::{ModeAxis, Storage, StoredMatrix, StoredValues};
pub use sections::{StoredSection, read_stored, write_stored};

#[cfg(test)]
mod tests;
