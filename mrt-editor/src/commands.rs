//! One module a command: its flags and what it does.

pub mod accuracy;
pub mod adapt;
pub mod bake;
pub mod bench;
pub mod demo;
pub mod figures;
pub mod info;
pub mod light;
pub mod map;
pub mod pack;
