//! The lightmap of a frame, and its pixels in the formats of textures.

use crate::level::block_index::BlockIndex;
use crate::output::lightmap_atlas::{LightmapAtlas, Tile};
use crate::output::pixel_formats::{f16_bits, rgb9e5};
use glam::Vec2;
use mrt_core::geometry::cube::Face;

/// Indirect irradiance, W/m², linear RGB, in the pixels of a padded atlas.
#[derive(Clone, Copy, Debug)]
pub struct Lightmap<'a> {
    atlas: &'a LightmapAtlas,
    pixels: &'a [[f32; 3]],
}

impl<'a> Lightmap<'a> {
    /// `pixels` is an image of the atlas, or empty.
    pub(crate) fn new(atlas: &'a LightmapAtlas, pixels: &'a [[f32; 3]]) -> Self {
        Self { atlas, pixels }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.atlas.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.atlas.height
    }

    /// All pixels, row by row from the top; empty if the frame computes no lightmap.
    pub fn pixels(&self) -> &'a [[f32; 3]] {
        self.pixels
    }

    /// Texture coordinates in [0, 1]² at which a bilinear filter reads the light at (u, v) in [0, 1]² of a block's
    /// canonical wall; `None` for openings and blocks that do not exist.
    pub fn texture_coordinate(
        &self,
        block: BlockIndex,
        wall: Face,
        u: f32,
        v: f32,
    ) -> Option<Vec2> {
        self.atlas.texture_coordinate(block, wall, u, v)
    }

    /// Irradiance, W/m², that a bilinear filter reads at texture coordinates in [0, 1]²; 0 without a lightmap.
    pub fn sample(&self, coordinate: Vec2) -> [f32; 3] {
        let size = Vec2::new(self.width() as f32, self.height() as f32);
        self.atlas.sample(self.pixels, coordinate * size)
    }

    /// Writes a tile as half-precision numbers with an alpha of 1, row by row: `size`² pixels of `RGBA16F`. Values
    /// above 65,504 become 65,504. The content of `out` is replaced; a tile that is not in the image leaves `out`
    /// empty.
    pub fn write_rgba16f(&self, tile: Tile, out: &mut Vec<[u16; 4]>) {
        const ONE: u16 = 0x3c00;
        out.clear();
        let pixels = self.pixels_of(tile).map(|rgb| {
            let [r, g, b] = rgb.map(f16_bits);
            [r, g, b, ONE]
        });
        out.extend(pixels);
    }

    /// Writes a tile with a shared exponent, row by row: `size`² pixels of `RGB9E5`. Values above 65,408 become 65,408.
    /// The error is at most 1/511 of a pixel's largest channel, and 2^-25 where that is less. The content of `out` is
    /// replaced; a tile that is not in the image leaves `out` empty.
    pub fn write_rgb9e5(&self, tile: Tile, out: &mut Vec<u32>) {
        out.clear();
        out.extend(self.pixels_of(tile).map(rgb9e5));
    }

    fn pixels_of(&self, tile: Tile) -> impl Iterator<Item = [f32; 3]> + 'a {
        let (width, pixels) = (self.width(), self.pixels);
        let is_inside = tile.x.saturating_add(tile.size) <= width
            && tile.y.saturating_add(tile.size) <= self.height();
        let rows = if is_inside { tile.size } else { 0 };
        (0..rows)
            .flat_map(move |row| {
                let start = (tile.y + row) * width + tile.x;
                pixels.get(start..start + tile.size).unwrap_or(&[])
            })
            .copied()
    }
}
