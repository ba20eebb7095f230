//! Physics that holds whatever the level: closed forms, energy, reciprocity, full rank equals dense.

mod convergence;
mod emission;
mod invariances;
mod path_tracing;
mod radiosity;
mod random_levels;
mod reduced_transport;
