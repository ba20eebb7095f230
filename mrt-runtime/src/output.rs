//! The outputs of a frame: the padded lightmap and light at probes, and the layout of texels in memory.

pub mod texel_layout;
pub mod lightmap_atlas;
pub mod lightmap;
pub mod probe_order;
pub mod probes;
pub mod receiver;
mod pixel_formats;
