//! What callers may rely on: the facade, outputs, doors, files, documents, and bits that never change.

mod bake_reproducible;
mod direct_light;
mod documents;
mod doors;
mod facade;
mod frame;
mod licences;
mod lightmap;
mod old_versions;
mod opening_responses;
mod seams;
mod storage;
