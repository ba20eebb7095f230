//! The padded lightmap atlas (Loos et al. 2011, section 6.2): one tile for each wall, with a border of one pixel for
//! bilinear filters.
//!
//! Across an opening, the border shows the wall of the neighbouring block, so joined blocks have no seam. At a crease
//! inside a block, it repeats the wall's own edge. The charts of a tube meet without a crease, so their borders show
//! each other.

use crate::executor::{Executor, run_parts, task_count};
use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedBlock, PlacedLevel};
use crate::level::shape::Shape;
use crate::output::texel_layout::{BlockRank, Planes, TexelLayout};
use glam::{DVec3, Vec2};
use mrt_core::geometry::cube::Face;

/// The position of each texel of a scene in the lightmap.
#[derive(Clone, Debug)]
pub struct LightmapAtlas {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// By block and [`Face::index`]: the first pixel of the tile's border; `None` without a wall.
    tiles: Vec<[Option<[usize; 2]>; 6]>,
    /// Tile by tile, pixel by pixel: the slot that the pixel shows; `u32::MAX` if it shows none.
    slots: Vec<u32>,
    /// The block of rank k is shown by the tiles `shown[shown_by[k]..shown_by[k + 1]]`.
    shown: Vec<u32>,
    shown_by: Vec<u32>,
    resolution: usize,
}

/// A block, and a tile that shows some of its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Shows {
    block: BlockRank,
    tile: u32,
}

impl LightmapAtlas {
    /// Lays out the walls of all blocks in a nearly square image.
    pub(crate) fn new(level: &PlacedLevel, layout: &TexelLayout) -> Self {
        let blocks = &level.blocks[..];
        let wall_count: usize = blocks.iter().map(|block| block.shape.walls().count()).sum();
        let tile = level.resolution + 2;
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
            resolution: level.resolution,
        };
        let mut shows = Vec::new();
        let mut next = 0;
        for (index, block) in blocks.iter().enumerate() {
            for face in block.shape.walls() {
                let origin = [next % columns * tile, next / columns * tile];
                atlas.tiles[index][face.index()] = Some(origin);
                atlas.push_tile(blocks, layout, (index, face), &mut shows);
                next += 1;
            }
        }
        atlas.index_shown(layout, shows);
        atlas
    }

    /// Appends the slots that the tile of a block's wall shows, and to `shows` the blocks that it shows.
    fn push_tile(
        &mut self,
        blocks: &[PlacedBlock],
        layout: &TexelLayout,
        (block, wall): (usize, Face),
        shows: &mut Vec<Shows>,
    ) {
        let tile = self.tile_count() as u32;
        let size = self.tile_size();
        let first = shows.len();
        for row in 0..size {
            for column in 0..size {
                let place = [column as isize - 1, row as isize - 1];
                let seen = texel_seen(blocks, block, wall, place, self.resolution);
                let slot = seen.and_then(|(block, texel)| {
                    let rank = layout.rank[block];
                    if !shows[first..].iter().any(|shows| shows.block == rank) {
                        shows.push(Shows { block: rank, tile });
                    }
                    layout.slot(BlockIndex::new(block), texel)
                });
                self.slots.push(slot.map_or(u32::MAX, |slot| slot as u32));
            }
        }
    }

    /// Lists, by block, the tiles that show it.
    fn index_shown(&mut self, layout: &TexelLayout, mut shows: Vec<Shows>) {
        shows.sort_unstable();
        for rank in layout.ranks() {
            let start = shows.partition_point(|shows| shows.block < rank);
            self.shown_by.push(start as u32);
        }
        self.shown_by.push(shows.len() as u32);
        self.shown.extend(shows.iter().map(|shows| shows.tile));
    }

    /// Pixel coordinates (x to the right, y downwards, pixel centres at halves) at which a bilinear filter reads the
    /// light at (u, v) in [0, 1]² of a block's canonical wall; `None` for openings and blocks that do not exist.
    pub fn pixel(&self, block: BlockIndex, face: Face, u: f32, v: f32) -> Option<Vec2> {
        let [x, y] = self.tiles.get(block.get())?[face.index()]?;
        let scale = self.resolution as f32;
        let inside = Vec2::new(u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)) * scale;
        Some(Vec2::new(x as f32 + 1.0, y as f32 + 1.0) + inside)
    }

    /// [`LightmapAtlas::pixel`] divided by the size of the image: texture coordinates in [0, 1]².
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

    /// Bilinear lookup, at pixel coordinates from [`LightmapAtlas::pixel`], in an image of this layout; 0 if the image
    /// has another size.
    pub fn sample(&self, image: &[[f32; 3]], pixel: Vec2) -> [f32; 3] {
        // A level of open blocks only has no walls.
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

    /// Number of tiles: one for each wall.
    pub fn tile_count(&self) -> usize {
        self.slots.len() / (self.tile_size() * self.tile_size())
    }

    /// Position of a tile in the image; `None` if there is no such tile.
    pub fn tile(&self, index: usize) -> Option<Tile> {
        (index < self.tile_count()).then(|| Tile::of_grid(index, self.columns(), self.tile_size()))
    }

    /// Tiles in a row.
    pub(crate) fn columns(&self) -> usize {
        self.width / self.tile_size()
    }

    /// Pixels along an edge of a tile.
    pub(crate) fn tile_size(&self) -> usize {
        self.resolution + 2
    }

    /// Longest list of tiles, duplicates included, that [`LightmapAtlas::fill`] makes.
    pub(crate) fn tile_list_size(&self) -> usize {
        self.shown.len()
    }

    /// Copies texels to the tiles that show the changed blocks, and writes the list of those tiles, ascending, to
    /// `tiles`.
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
        let tile = self.tile_size();
        let columns = self.columns() as u32;
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
        // Pixels that show no slot stay as they are.
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

impl Tile {
    /// Number `index` in a grid of tiles, row by row.
    pub(crate) fn of_grid(index: usize, columns: usize, size: usize) -> Self {
        Self {
            x: index % columns * size,
            y: index / columns * size,
            size,
        }
    }
}

/// A point in the plane of a block's wall, inside the wall or up to a texel beside it.
#[derive(Clone, Copy)]
struct Place {
    block: usize,
    wall: Face,
    /// The point in the block's canonical cube.
    point: DVec3,
}

/// Distance, in u, beyond an opening at which the border of a tube's tile looks for the neighbour's first texel.
const PAST: f64 = 1e-6;

/// The texel, as (block, index in the block), that a tile shows at (column, row), both in -1..=resolution. One step
/// outside the wall, it is in the neighbour's wall across an opening, or the nearest texel of the wall itself at a
/// crease.
///
/// Up to four blocks meet at the corner between two openings of a block, and a filter must read the same mean there
/// from all of their tiles. With four blocks, each tile shows all four. Around a pillar there are three, and each tile
/// shows the middle block twice: the middle block's own tile in its corner pixel, the other two tiles in the pixel
/// beside it, at their crease with the pillar.
fn texel_seen(
    blocks: &[PlacedBlock],
    block: usize,
    face: Face,
    [column, row]: [isize; 2],
    resolution: usize,
) -> Option<(usize, usize)> {
    let center = |k: isize| (k as f64 + 0.5) / resolution as f64;
    if let Some(form) = blocks[block].shape.tube() {
        // Just past the opening, not half a texel: the neighbour's texels may be far shorter.
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

/// The texel of a tube's wall at a point. If the point is past an opening, it is a texel of the tube beyond.
///
/// The charts of every tube are quarters of its section, and joined openings are the same disc, so rows of texels
/// continue from tube to tube and around each tube.
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

/// The texel of a wall at a point; if it is in a hole, the nearest texel that is not.
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

/// The side, along `axis`, that the texel in row or column `k` touches; `None` for inner texels.
fn corner(axis: usize, k: isize, last: isize) -> Option<Face> {
    (k == 0 || k == last).then(|| Face::from_axis(axis, k > 0))
}

/// The point that a pixel beyond `side` shows. `corner` is the other side that the pixel is next to, if it is at an
/// end.
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

/// Follows a wall into the next block across each of `sides`, named as in the block of `from`, up to the first side
/// that does not lead on. Returns how many sides were crossed, and the point in the last block.
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
        // A side with a hole has a wall around it.
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
            // The neighbour's cube is one width further on.
            point: there_from_here.point(here.point - side.outward()),
        };
        sides = sides.map(|side| there_from_here.face(side));
    }
    (N, here)
}
