//! The `mrt` program as a user meets it: exit codes, messages, and files that are whole or not there.

mod accuracy;
mod adapt;
mod bake;
mod cases_colour;
mod cases_gltf;
mod cases_obj;
mod common;
mod demo;
mod info;
mod light;
mod map;
mod outputs;
mod pack;
mod usage;
