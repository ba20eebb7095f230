//! Modular transport part by part: paths, holes, vertical openings, tubes, warps, probes, and frames.

mod frame;
mod great_hall;
mod holes;
mod paths;
mod probes;
mod tunnel;
mod vector_irradiance;
mod vertical;
mod warped;
