//! What a frame gives: the padded lightmap and light at probes, and where their texels are kept.

pub mod texel_layout;
pub mod lightmap_atlas;
pub mod lightmap;
pub mod probe_order;
pub mod probes;
pub mod receiver;
mod pixel_formats;
