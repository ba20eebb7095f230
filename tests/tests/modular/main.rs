//! Modular transport part by part: paths, holes, storeys, tubes, warps, probes, and frames that skip work.

mod frame;
mod great_hall;
mod holes;
mod paths;
mod probes;
mod tunnel;
mod vector_irradiance;
mod vertical;
mod warped;
