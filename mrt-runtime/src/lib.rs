//! Modular Radiance Transfer at run time (Loos et al., "Modular Radiance Transfer", SIGGRAPH Asia
//! 2011), in the order in which data flows.
//!
//! A [`shape`] is a cube with faces missing, and a [`dictionary`] holds the baked operators of shapes. A
//! [`level`] places warped shapes and joins their openings; [`assemble`] turns both into a [`scene`],
//! which a game keeps. Every frame takes [`light`]s through [`direct`] light and the reduced operators
//! to indirect irradiance ([`frame`]) and copies it to a lightmap [`atlas`].

pub mod shape;
pub mod level;
pub mod level_text;
mod overlap;
pub mod dictionary;
pub mod scene;
pub mod assemble;
mod propagate;
pub mod light;
pub mod visibility;
pub mod direct;
pub mod frame;
pub mod atlas;
