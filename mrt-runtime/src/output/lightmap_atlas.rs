//! The padded lightmap atlas (Loos et al. 2011, section 6.2): one tile a wall, with a border of one texel
//! that copies what a bilinear filter must see there.
//!
//! Across an opening the border shows the neighbouring block's wall, so joined blocks have no seam; at
//! creases inside a block it repeats the wall's own edge. The charts of a tube meet without a crease, and show
//! one another.

use crate::executor::{Executor, run_parts, task_count};
use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedBlock, PlacedLevel};
use crate::level::shape::Shape;
use crate::output::texel_layout::{BlockRank, Planes, TexelLayout};
use glam::{DVec3, Vec2};
use mrt_core::geometry::cube::Face;

/// Where each texel of a scene goes in the lightmap.
#[derive(Clone, Debug)]
pub struct LightmapAtlas {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// First pixel of each (block, wall) tile's border, by block and [`Face::index`].
    tiles: Vec<[Option<[usize; 2]>; 6]>,
    /// By tile, one a pixel, row by row: the slot that it shows, `u32::MAX` for none.
    slots: Vec<u32>,
    /// By place of a block: the tiles that show it are `shown[shown_by[k]..shown_by[k + 1]]`.
    shown: Vec<u32>,
    shown_by: Vec<u32>,
    resolution: usize,
}

impl LightmapAtlas {
    /// Lays out the walls of all blocks in a nearly square image.
    pub(crate) fn new(level: &PlacedLevel, layout: &TexelLayout) -> Self {
        let blocks = &level.blocks[..];
        let resolution = level.resolution;
        let wall_count: usize = blocks.iter().map(|block| block.shape.walls().count()).sum();
        let tile = resolution + 2;
        let columns = (1..)
            .find(|c| c * c >= wall_count)
            .unwrap_or(wall_count)
            .max(1);
        let rows = wall_count.div_ceil(columns);
        let mut atlas = Self {
            width: columns * tile,
            height: rows * tile,
            tiles: vec![[None; 6]; blocks.len()],
            slots: Vec::with_capacity(wall_count * tile * tile),
            shown: Vec::new(),
            shown_by: Vec::new(),
            resolution,
        };
        let mut next = 0;
        // (rank of a block, tile that shows it)
        let mut shows: Vec<(BlockRank, u32)> = Vec::new();
        for (index, block) in blocks.iter().enumerate() {
            for face in block.shape.walls() {
                let origin = [next % columns * tile, next / columns * tile];
                atlas.tiles[index][face.index()] = Some(origin);
                let first = shows.len();
                for row in 0..tile {
                    for column in 0..tile {
                        let place = [column as isize - 1, row as isize - 1];
                        let seen = texel_seen(blocks, index, face, place, resolution);
                        let slot = seen.and_then(|(block, texel)| {
                            let rank = layout.rank[block];
                            if !shows[first..].contains(&(rank, next as u32)) {
                                shows.push((rank, next as u32));
                            }
                            layout.slot(BlockIndex::new(block), texel)
                        });
                        atlas.slots.push(slot.map_or(u32::MAX, |slot| slot as u32));
                    }
                }
                next += 1;
            }
        }
        shows.sort_unstable();
        let mut at = 0;
        for rank in layout.ranks() {
            atlas.shown_by.push(at as u32);
            while at < shows.len() && shows[at].0 == rank {
                atlas.shown.push(shows[at].1);
                at += 1;
            }
        }
        atlas.shown_by.push(at as u32);
        atlas
    }

    /// Pixel coordinates (x to the right, y down the rows, pixel centres at halves) at which a bilinear
    /// filter reads the light at (u, v) in [0, 1]² of a block's canonical wall; `None` for openings.
    pub fn pixel(&self, block: BlockIndex, face: Face, u: f32, v: f32) -> Option<Vec2> {
        let [x, y] = self.tiles.get(block.get())?[face.index()]?;
        let scale = self.resolution as f32;
        let inside = Vec2::new(u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)) * scale;
        Some(Vec2::new(x as f32 + 1.0, y as f32 + 1.0) + inside)
    }

    /// [`LightmapAtlas::pixel`] over the image's size: texture coordinates in [0, 1]².
    pub fn texture_coordinate(
        &self,
        block: BlockIndex,
        face: Face,
        u: f32,
        v: f32,
    ) -> Option<Vec2> {
        let size = Vec2::new(self.width as f32, self.height as f32);
        Some(self.pixel(block, face, u, v)? / size)
    }

    /// Bilinear lookup in an image of this layout at pixel coordinates from [`LightmapAtlas::pixel`]; zero in an image of
    /// another size.
    pub fn sample(&self, image: &[[f32; 3]], pixel: Vec2) -> [f32; 3] {
        // A level of open blocks alone has no walls.
        if self.width == 0 || self.height == 0 || image.len() != self.width * self.height {
            return [0.0; 3];
        }
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

    /// Number of tiles: one a wall.
    pub fn tile_count(&self) -> usize {
        let tile = self.resolution + 2;
        self.slots.len() / (tile * tile)
    }

    /// Where a tile stands in the image; `None` if there is no such tile.
    pub fn tile(&self, index: usize) -> Option<Tile> {
        let size = self.resolution + 2;
        let columns = self.width / size;
        (index < self.tile_count()).then(|| Tile {
            x: index % columns * size,
            y: index / columns * size,
            size,
        })
    }

    /// Tiles a row.
    pub(crate) fn columns(&self) -> usize {
        self.width / self.tile_size()
    }

    /// Pixels along an edge of a tile.
    pub(crate) fn tile_size(&self) -> usize {
        self.resolution + 2
    }

    /// Length that a list of tiles may have in [`LightmapAtlas::fill`].
    pub(crate) fn tile_list_size(&self) -> usize {
        self.shown.len()
    }

    /// Copies texels to the tiles that show the changed blocks; `tiles` is room for their list.
    pub(crate) fn fill(
        &self,
        changed: &[BlockRank],
        tiles: &mut Vec<u32>,
        texels: &Planes,
        image: &mut [[f32; 3]],
        executor: &dyn Executor,
    ) {
        tiles.clear();
        for &place in changed {
            let place = place.get();
            let (start, end) = (self.shown_by[place], self.shown_by[place + 1]);
            tiles.extend_from_slice(&self.shown[start as usize..end as usize]);
        }
        tiles.sort_unstable();
        tiles.dedup();
        let (Some(&first), Some(&last)) = (tiles.first(), tiles.last()) else {
            return;
        };
        let tile = self.resolution + 2;
        let columns = (self.width / tile) as u32;
        let rows = (first / columns) as usize..(last / columns) as usize + 1;
        let tasks = task_count(executor, rows.len());
        let channels = texels.channels();
        let mut image = &mut image[rows.start * tile * self.width..];
        let mut tiles = &tiles[..];
        let parts = (0..tasks).map(|k| {
            let (from, to) = (k * rows.len() / tasks, (k + 1) * rows.len() / tasks);
            let taken = std::mem::take(&mut image);
            let (part, rest) = taken.split_at_mut((to - from) * tile * self.width);
            image = rest;
            let end = (rows.start + to) as u32 * columns;
            let (list, rest) = tiles.split_at(tiles.partition_point(|&t| t < end));
            tiles = rest;
            (list, rows.start + from, part)
        });
        run_parts(executor, parts, |(list, first_row, image)| {
            for &index in list {
                let (row, column) = (index / columns, index % columns);
                let slots = &self.slots[index as usize * tile * tile..][..tile * tile];
                let first = (row as usize - first_row) * tile * self.width;
                let first = first + column as usize * tile;
                for (k, slots) in slots.chunks_exact(tile).enumerate() {
                    let pixels = &mut image[first + k * self.width..][..tile];
                    copy_row(slots, channels, pixels);
                }
            }
        });
    }
}

fn copy_row(slots: &[u32], [red, green, blue]: [&[f32]; 3], pixels: &mut [[f32; 3]]) {
    for (pixel, &slot) in pixels.iter_mut().zip(slots) {
        let slot = slot as usize;
        // Pixels that show nothing stay as they are.
        if let (Some(&r), Some(&g), Some(&b)) = (red.get(slot), green.get(slot), blue.get(slot)) {
            *pixel = [r, g, b];
        }
    }
}

/// A square of the lightmap: one wall, with a border of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Tile {
    /// First pixel from the left.
    pub x: usize,
    /// First row from the top.
    pub y: usize,
    /// Pixels along an edge.
    pub size: usize,
}

/// A point in the plane of a block's wall, inside it or up to a texel beside it.
#[derive(Clone, Copy)]
struct Place {
    block: usize,
    wall: Face,
    /// In the block's canonical cube.
    point: DVec3,
}

/// How far beyond an opening, in u, a tube's border looks for the neighbour's first texel.
const PAST: f64 = 1e-6;

/// The texel, as (block, index in it), that column and row of a wall show, both in -1..=resolution: one
/// step outside is the neighbour's wall across an opening, or the nearest texel inside at a crease.
///
/// Up to four blocks meet where two openings of a block do, and all of their tiles must give the same
/// mean there. With four, each tile shows all four. Around a pillar there are three, and each tile shows
/// the middle one twice: the middle one's at its corner, the others' beside it, at their crease with the
/// pillar.
fn texel_seen(
    blocks: &[PlacedBlock],
    block: usize,
    face: Face,
    [column, row]: [isize; 2],
    resolution: usize,
) -> Option<(usize, usize)> {
    let center = |k: isize| (k as f64 + 0.5) / resolution as f64;
    if let Some(form) = blocks[block].shape.tube() {
        // Just past an opening, not half a texel: the neighbour's texels may be far shorter.
        let (u, v) = (center(column).clamp(-PAST, 1.0 + PAST), center(row));
        return texel_seen_in_tube(blocks, block, form.surface(face, u, v).position, resolution);
    }
    let here = Place {
        block,
        wall: face,
        point: face.point(center(column), center(row)),
    };
    let last = resolution as isize - 1;
    let (u, v) = (face.u_axis(), face.v_axis());
    let outside = |axis, k| (k < 0 || k > last).then(|| Face::from_axis(axis, k > 0));
    let seen = match (outside(u, column), outside(v, row)) {
        (None, None) => here,
        (Some(u), Some(v)) => {
            let ways = [walk(blocks, here, [u, v]), walk(blocks, here, [v, u])];
            match ways {
                [(2, place), _] | [_, (2, place)] | [(1, place), (0, _)] | [(0, _), (1, place)] => {
                    place
                }
                _ => here,
            }
        }
        (Some(side), None) => beside(blocks, here, side, corner(v, row, last)),
        (None, Some(side)) => beside(blocks, here, side, corner(u, column, last)),
    };
    let shape = blocks[seen.block].shape;
    let offset = shape.wall_offset(seen.wall, resolution)?;
    let texel = texel_of_wall(shape, seen.wall, seen.point, resolution);
    Some((seen.block, offset + texel))
}

/// The texel of a tube's wall at a point, or that of the tube beyond an opening that the point is past.
///
/// Charts are quarters of the section in every tube, and joined openings are the same disc: rows of texels go on
/// from tube to tube and around each.
fn texel_seen_in_tube(
    blocks: &[PlacedBlock],
    block: usize,
    point: DVec3,
    resolution: usize,
) -> Option<(usize, usize)> {
    let placed = &blocks[block];
    let (mut block, mut point) = (block, point);
    for opening in placed.shape.openings {
        let side = opening.face;
        let past = (point - side.point(0.5, 0.5)).dot(side.outward());
        if let (
            true,
            Beyond::Block {
                block: there,
                here_from_there,
                ..
            },
        ) = (past > 0.0, placed.beyond[side.index()])
        {
            point = here_from_there.inverse().point(point - side.outward());
            block = there.get();
            break;
        }
    }
    let shape = blocks[block].shape;
    let (chart, u, v) = shape.tube()?.chart_of(point);
    let texel = Shape::texel_of_uv(resolution, u, v);
    Some((block, shape.wall_offset(chart, resolution)? + texel))
}

/// The texel at a point, or the nearest that is wall where there is a hole.
fn texel_of_wall(shape: &Shape, wall: Face, point: DVec3, resolution: usize) -> usize {
    let texel = wall.texel_index(point, resolution);
    let center = |k: usize| wall.texel_center(resolution, k / resolution, k % resolution);
    if !shape.is_in_hole(wall, center(texel)) {
        return texel;
    }
    (0..resolution * resolution)
        .filter(|&k| !shape.is_in_hole(wall, center(k)))
        .min_by(|&a, &b| {
            let distance = |k: usize| center(k).distance(center(texel));
            distance(a).total_cmp(&distance(b))
        })
        .unwrap_or(texel)
}

/// The side that an outermost texel touches.
fn corner(axis: usize, k: isize, last: isize) -> Option<Face> {
    (k == 0 || k == last).then(|| Face::from_axis(axis, k > 0))
}

/// What a pixel beyond `side` shows; `corner` is the side that it is nearest to, if it is at the end.
fn beside(blocks: &[PlacedBlock], here: Place, side: Face, corner: Option<Face>) -> Place {
    if let (1, place) = walk(blocks, here, [side]) {
        return place;
    }
    let Some(corner) = corner else { return here };
    match walk(blocks, here, [corner, side, corner.opposite()]) {
        // The block beyond a door that is closed.
        (3, place) => place,
        (2, _) => walk(blocks, here, [corner]).1,
        _ => here,
    }
}

/// Follows a wall over `sides`, as `from` names them, up to the first that does not lead on; returns how many
/// were crossed, and the same point as the last block sees it.
fn walk<const N: usize>(
    blocks: &[PlacedBlock],
    from: Place,
    mut sides: [Face; N],
) -> (usize, Place) {
    let mut here = from;
    for k in 0..N {
        let side = sides[k];
        let Beyond::Block {
            block,
            here_from_there,
            ..
        } = blocks[here.block].beyond[side.index()]
        else {
            return (k, here);
        };
        let block = block.get();
        // Around a hole there is a wall between the blocks.
        if !blocks[here.block].shape.is_open(side) {
            return (k, here);
        }
        let there_from_here = here_from_there.inverse();
        let wall = there_from_here.face(here.wall);
        if blocks[block].shape.is_open(wall) {
            return (k, here);
        }
        here = Place {
            block,
            wall,
            // The neighbour's cube stands one width further on.
            point: there_from_here.point(here.point - side.outward()),
        };
        sides = sides.map(|side| there_from_here.face(side));
    }
    (N, here)
}
