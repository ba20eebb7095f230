//! The padded lightmap atlas (Loos et al. 2011, section 6.2): one tile a wall, with a border of one texel
//! that copies what a bilinear filter must see there.
//!
//! Across an opening the border shows the neighbouring block's wall, so joined blocks have no seam; at
//! creases inside a block it repeats the wall's own edge.

use crate::scene::{Beyond, SceneBlock};
use glam::{DVec3, Vec2};
use mrt_core::cube::Face;

/// Where each texel of a scene goes in the lightmap.
#[derive(Clone, Debug)]
pub struct AtlasLayout {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// First pixel of each (block, wall) tile's border, by block and [`Face::index`].
    tiles: Vec<[Option<[usize; 2]>; 6]>,
    records: Vec<CopyRecord>,
    resolution: usize,
}

/// A texel that is copied to a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CopyRecord {
    pixel: u32,
    block: u32,
    /// Within the block.
    texel: u32,
}

impl AtlasLayout {
    /// Lays out the walls of all blocks in a nearly square image.
    pub(crate) fn new(blocks: &[SceneBlock], resolution: usize) -> Self {
        let wall_count: usize = blocks.iter().map(|block| block.shape.walls().count()).sum();
        let tile = resolution + 2;
        let columns = (1..)
            .find(|c| c * c >= wall_count)
            .unwrap_or(wall_count)
            .max(1);
        let rows = wall_count.div_ceil(columns);
        let mut layout = Self {
            width: columns * tile,
            height: rows * tile,
            tiles: vec![[None; 6]; blocks.len()],
            records: Vec::with_capacity(wall_count * tile * tile),
            resolution,
        };
        let mut next = 0;
        for (index, block) in blocks.iter().enumerate() {
            for face in block.shape.walls() {
                let origin = [next % columns * tile, next / columns * tile];
                layout.tiles[index][face.index()] = Some(origin);
                layout.record_tile(blocks, index, face, origin);
                next += 1;
            }
        }
        layout
    }

    fn record_tile(&mut self, blocks: &[SceneBlock], block: usize, face: Face, origin: [usize; 2]) {
        let tile = self.resolution + 2;
        for row in 0..tile {
            for column in 0..tile {
                let texel = texel_seen(
                    blocks,
                    block,
                    face,
                    [column as isize - 1, row as isize - 1],
                    self.resolution,
                );
                if let Some((block, texel)) = texel {
                    let pixel = (origin[1] + row) * self.width + origin[0] + column;
                    self.records.push(CopyRecord {
                        pixel: pixel as u32,
                        block: block as u32,
                        texel: texel as u32,
                    });
                }
            }
        }
    }

    /// Pixel coordinates (x to the right, y down the rows, pixel centres at halves) at which a bilinear
    /// filter reads the light at (u, v) in [0, 1]² of a block's canonical wall; `None` for openings.
    pub fn pixel(&self, block: usize, face: Face, u: f32, v: f32) -> Option<Vec2> {
        let [x, y] = self.tiles.get(block)?[face.index()]?;
        let scale = self.resolution as f32;
        let inside = Vec2::new(u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)) * scale;
        Some(Vec2::new(x as f32 + 1.0, y as f32 + 1.0) + inside)
    }

    /// [`AtlasLayout::pixel`] over the image's size: texture coordinates in [0, 1]².
    pub fn texture_coordinate(&self, block: usize, face: Face, u: f32, v: f32) -> Option<Vec2> {
        let size = Vec2::new(self.width as f32, self.height as f32);
        Some(self.pixel(block, face, u, v)? / size)
    }

    /// Bilinear lookup in an image of this layout at pixel coordinates from [`AtlasLayout::pixel`].
    pub fn sample(&self, image: &[[f32; 3]], pixel: Vec2) -> [f32; 3] {
        let at = (pixel - 0.5).clamp(
            Vec2::ZERO,
            Vec2::new(self.width as f32 - 1.0, self.height as f32 - 1.0),
        );
        let (low, weight) = (at.floor(), at - at.floor());
        let (x, y) = (low.x as usize, low.y as usize);
        let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
        std::array::from_fn(|channel| {
            let value = |x: usize, y: usize| image[y * self.width + x][channel];
            let top = value(x, y) + (value(right, y) - value(x, y)) * weight.x;
            let bottom = value(x, below) + (value(right, below) - value(x, below)) * weight.x;
            top + (bottom - top) * weight.y
        })
    }

    /// Copies texels (in the frame's order) to the image.
    pub(crate) fn fill(&self, blocks: &[SceneBlock], texels: &[f32], image: &mut [[f32; 3]]) {
        for record in &self.records {
            let range = &blocks[record.block as usize].texels;
            let start = 3 * range.start + record.texel as usize;
            let count = range.len();
            image[record.pixel as usize] = [
                texels[start],
                texels[start + count],
                texels[start + 2 * count],
            ];
        }
    }
}

/// The texel, as (block, index in it), that column and row of a wall show, both in -1..=resolution: one
/// step outside is the neighbour's wall across an opening, or the nearest texel inside at a crease.
///
/// A corner is two steps away. Where only one of the two ways round it is open, that one counts, so that
/// all blocks of a room agree on the corner that they share.
fn texel_seen(
    blocks: &[SceneBlock],
    block: usize,
    face: Face,
    [column, row]: [isize; 2],
    resolution: usize,
) -> Option<(usize, usize)> {
    let center = |k: isize| (k as f64 + 0.5) / resolution as f64;
    let pixel = face.point(center(column), center(row));
    let side = |axis: usize, k: isize| {
        let inside = (0..resolution as isize).contains(&k);
        (!inside).then(|| Face::from_axis(axis, k > 0))
    };
    let [u, v] = [side(face.u_axis(), column), side(face.v_axis(), row)];
    let (crossed, seen) = walk(blocks, block, face, pixel, [u, v], resolution)?;
    let (crossed_v_first, seen_v_first) = walk(blocks, block, face, pixel, [v, u], resolution)?;
    Some(if crossed_v_first > crossed {
        seen_v_first
    } else {
        seen
    })
}

/// Follows a wall from block to block over `sides`, those that are open, and returns how many were and the
/// texel nearest to `pixel`, a point in the plane of the first block's wall.
fn walk(
    blocks: &[SceneBlock],
    mut block: usize,
    mut wall: Face,
    mut pixel: DVec3,
    mut sides: [Option<Face>; 2],
    resolution: usize,
) -> Option<(usize, (usize, usize))> {
    let mut crossed = 0;
    for k in 0..sides.len() {
        let Some(side) = sides[k] else { continue };
        let Beyond::Block {
            block: there,
            here_from_there,
            ..
        } = blocks[block].beyond[side.index()]
        else {
            continue;
        };
        let there_from_here = here_from_there.inverse();
        if blocks[there].shape.is_open(there_from_here.face(wall)) {
            continue;
        }
        block = there;
        wall = there_from_here.face(wall);
        // The neighbour's cube stands one width further on.
        pixel = there_from_here.point(pixel - side.outward());
        sides = sides.map(|side| side.map(|side| there_from_here.face(side)));
        crossed += 1;
    }
    let offset = blocks[block].shape.wall_offset(wall, resolution)?;
    Some((crossed, (block, offset + wall.texel_index(pixel, resolution))))
}
