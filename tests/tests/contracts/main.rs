//! What callers may rely on: outputs, doors, files, bits.

mod bake_reproducible;
mod direct_light;
mod documents;
mod doors;
mod facade;
mod frame;
mod lightmap;
mod old_versions;
mod opening_responses;
mod seams;
mod storage;
