//! Modular Radiance Transfer at run time (Loos et al., "Modular Radiance Transfer", SIGGRAPH Asia
//! 2011), in the order in which data flows.
//!
//! A [`shape`] is a cube with faces missing, and a [`dictionary`] holds the baked operators of shapes. A
//! [`level`] places warped shapes and joins their openings; [`assemble`] turns both into a [`scene`],
//! which a game keeps. Every frame takes [`light`]s through [`direct`] light and the reduced operators
//! to indirect irradiance ([`frame`]) and copies it to a lightmap [`atlas`].

pub mod assemble;
pub mod atlas;
pub mod dictionary;
pub mod dictionary_file;
pub mod direct;
pub mod frame;
pub mod level;
pub mod level_text;
pub mod light;
mod overlap;
mod propagate;
pub mod scene;
pub mod shape;
pub mod visibility;
