//! Light as a function of direction, light from spheres, and points to sample light with.

pub mod sh;
pub mod hemisphere_sh;
pub mod sphere_light;
pub mod sampling;
