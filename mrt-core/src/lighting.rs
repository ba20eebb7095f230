//! Light as functions of direction, and from sphere lights; points to sample it with.

pub mod sh;
pub mod hemisphere_sh;
pub mod sphere_light;
pub mod sampling;
