//! Physics that holds in every level: closed forms, energy, reciprocity, and full rank equals the dense operator.

mod convergence;
mod emission;
mod invariances;
mod path_tracing;
mod radiosity;
mod random_levels;
mod reduced_transport;
