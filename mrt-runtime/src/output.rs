//! What a frame gives: the padded lightmap and light at probes.

pub mod lightmap_atlas;
pub mod probes;
