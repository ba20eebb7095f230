//! Blocks by place, and the receivers of points of a mesh.

use crate::level::block::Level;
use crate::level::block_index::BlockIndex;
use crate::output::receiver::blend::{Blend, MAX_BLOCKS_BLENDED};
use crate::output::receiver::block_in_place::BlockInPlace;
use crate::output::receiver::cube_camera::CubeCamera;
use crate::output::receiver::lookup::{Lookup, box_distance};
use crate::output::receiver::wall_receiver::WallReceiver;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;

/// Steps off the surface at which a block is looked for, in diagonals of the smallest block: a surface lies on the border
/// of two blocks or a little behind its own block's wall.
const STEPS_OFF_SURFACE: [f64; 3] = [0.01, 0.06, 0.25];

/// Weight of nearness against likeness of direction when one wall is chosen.
const NEARNESS_WEIGHT: f64 = 0.35;

/// The cube camera decides for surfaces turned like the face that sees them, down to this cosine; the sides of furniture
/// are seen through the floor but turned like walls.
const LEAST_FACING: f64 = 0.35;

/// Added to cosines before they are cubed to weigh walls: 99 % falls to the wall that a surface is parallel to, and where
/// that is an opening, the walls around it share.
const BLEND_OFFSET: f64 = 0.15;

/// Blocks that are not joined but have nothing between them, such as storeys around an atrium, run into one another over
/// this distance, in block widths.
const BLEND_DISTANCE: f64 = 0.4;

/// Blocks whose nearness is below this are left out before `sees` is asked; their weight would be its square.
const LEAST_NEARNESS: f64 = 0.1;

/// How far into another block `sees` is asked about, in distances from its surface to its centre.
const SIGHT_DEPTH: f64 = 0.06;

/// A level's blocks by place, to find the receivers of points of a mesh.
#[derive(Clone, Debug)]
pub struct ReceiverMap {
    blocks: Vec<BlockInPlace>,
    camera: Option<CubeCamera>,
    lookup: Lookup,
    smallest_diagonal: f64,
    largest_diagonal: f64,
}

/// A point of a surface, with its unit normal.
#[derive(Clone, Copy, Debug)]
struct Surface {
    point: DVec3,
    normal: DVec3,
}

/// The block nearest to a place.
#[derive(Clone, Copy, Debug)]
struct NearestBlock {
    block: usize,
    /// The nearest point of the block, in its unit cube.
    unit: DVec3,
    /// Where it was looked for.
    place: DVec3,
    /// Metres from the place to the block, 0 inside.
    distance: f64,
}

/// A block that a point takes light from.
#[derive(Clone, Copy, Debug)]
struct BlockShare {
    block: usize,
    /// The point in its unit cube.
    unit: DVec3,
    weight: f64,
}

impl Surface {
    fn new(point: Vec3, normal: Vec3) -> Self {
        Self {
            point: point.as_dvec3(),
            normal: normal.as_dvec3(),
        }
    }
}

impl ReceiverMap {
    /// Sorts the level's blocks by place.
    ///
    /// Cost: a grid of 24³ cells, each of which asks all blocks for their distance.
    pub fn new(level: &Level) -> Self {
        let mut blocks: Vec<BlockInPlace> = level.blocks.iter().map(BlockInPlace::new).collect();
        for connection in &level.connections {
            let (a, b) = (connection.a.block, connection.b.block);
            for (from, to) in [(a, b), (b, a)] {
                if let Some(block) = blocks.get_mut(from) {
                    block.neighbours.push(to);
                }
            }
        }
        let widest = blocks.iter().map(|block| block.width).fold(0.0, f64::max);
        let bounds: Vec<_> = blocks.iter().map(|block| block.bounds).collect();
        let diagonals = || level.blocks.iter().map(|block| block.warp.diagonal());
        Self {
            lookup: Lookup::new(&bounds, BLEND_DISTANCE * widest),
            blocks,
            camera: None,
            smallest_diagonal: diagonals().fold(f64::MAX, f64::min),
            largest_diagonal: diagonals().fold(0.0, f64::max),
        }
    }

    /// As [`ReceiverMap::new`]; if the level is one closed block, a cube camera in its centre looks at the mesh and chooses
    /// the walls, as in the paper.
    ///
    /// `first_hit` casts a ray: it gives the distance from an origin along a direction to the mesh, in lengths of the
    /// direction, and infinity where the ray meets nothing. It is called up to 24,576 times.
    pub fn with_cube_camera(level: &Level, first_hit: impl Fn(Vec3, Vec3) -> f32) -> Self {
        let mut map = Self::new(level);
        if let [block] = level.blocks.as_slice()
            && block.shape.openings.is_empty()
        {
            map.camera = Some(CubeCamera::new(&block.canonical_warp(), first_hit));
        }
        map
    }

    /// The one receiver of a surface point with a unit normal out of the surface; `None` only in a level without blocks
    /// or walls.
    pub fn receiver(&self, point: Vec3, normal: Vec3) -> Option<WallReceiver> {
        let surface = Surface::new(point, normal);
        let own = self.block_in_front(&surface)?;
        self.certain_receiver(&surface, &own).or_else(|| {
            let placed = &self.blocks[own.block];
            let facing = placed.facing(own.unit, surface.normal);
            let score = |face: Face| facing[face.index()] - NEARNESS_WEIGHT * depth(face, own.unit);
            let best = placed
                .walls()
                .max_by(|&a, &b| score(a).total_cmp(&score(b)))?;
            Some(WallReceiver::on_face(own.block, best, own.unit))
        })
    }

    /// The receivers of a surface point and their weights, which change smoothly with place and normal; for pictures,
    /// where each pixel can read several places of a lightmap. `sees` tells whether nothing stands between the surface
    /// and a point.
    ///
    /// The weights sum to one, or to less where the nearest block lies behind the surface or far off, since no light of
    /// the level gets there.
    pub fn blended(&self, point: Vec3, normal: Vec3, sees: impl Fn(Vec3) -> bool) -> Blend {
        let mut blend = Blend::EMPTY;
        let surface = Surface::new(point, normal);
        let Some(own) = self.block_in_front(&surface) else {
            return blend;
        };
        let lit = self.blocks[own.block].share_lit(surface.point, surface.normal, own.unit);
        if let Some(receiver) = self.certain_receiver(&surface, &own) {
            blend.add(receiver, lit);
            return blend;
        }
        let mut shares = [BlockShare {
            block: own.block,
            unit: own.unit,
            weight: 1.0,
        }; MAX_BLOCKS_BLENDED];
        let mut count = 1;
        for &other in self.lookup.candidates(own.place) {
            if count == MAX_BLOCKS_BLENDED {
                break;
            }
            if let Some(share) = self.share_of(other as usize, &own, &surface, &sees) {
                shares[count] = share;
                count += 1;
            }
        }
        let total: f64 = shares[..count].iter().map(|share| share.weight).sum();
        for share in &shares[..count] {
            let weight = lit * share.weight / total;
            self.blend_walls(&BlockShare { weight, ..*share }, surface.normal, &mut blend);
        }
        blend
    }

    /// Where a point lies on a face of a block, moved inside it; `None` if there is no such block.
    pub fn receiver_on(&self, point: Vec3, block: BlockIndex, face: Face) -> Option<WallReceiver> {
        let placed = self.blocks.get(block.get())?;
        let unit = placed.unit(point.as_dvec3());
        Some(WallReceiver::on_face(block.get(), face, unit))
    }

    /// The block that contains a point, or else the nearest, and the distance to it in metres; `None` in a level without
    /// blocks.
    pub fn nearest_block(&self, point: Vec3) -> Option<(BlockIndex, f64)> {
        let found = self.nearest(point.as_dvec3())?;
        Some((BlockIndex::new(found.block), found.distance))
    }

    /// The receiver's wall as the level names it; `None` if there is no such block.
    pub fn turned_face(&self, receiver: &WallReceiver) -> Option<Face> {
        let placed = self.blocks.get(receiver.block.get())?;
        Some(placed.orientation.face(receiver.face))
    }

    /// Edge or diagonal below which a piece of a mesh is small against every block: the smallest block's diagonal, metres.
    pub(super) fn smallest_diagonal(&self) -> f64 {
        self.smallest_diagonal
    }

    /// The receiver where there is no choice: on a tube's smooth wall, or on the wall that the cube camera says.
    fn certain_receiver(&self, surface: &Surface, own: &NearestBlock) -> Option<WallReceiver> {
        let placed = &self.blocks[own.block];
        placed.on_tube(own.block, own.unit).or_else(|| {
            let face = self
                .camera
                .as_ref()?
                .face_that_sees(surface.point, own.unit)?;
            let facing = placed.facing(own.unit, surface.normal)[face.index()];
            let is_alike = facing > LEAST_FACING;
            is_alike.then(|| WallReceiver::on_face(own.block, face, own.unit))
        })
    }

    /// The share of a block that is not joined to the point's own but as near; `None` if it has none.
    fn share_of(
        &self,
        other: usize,
        own: &NearestBlock,
        surface: &Surface,
        sees: impl Fn(Vec3) -> bool,
    ) -> Option<BlockShare> {
        // The walls of joined blocks run into one another anyway.
        if other == own.block || self.blocks[own.block].neighbours.contains(&other) {
            return None;
        }
        let placed = &self.blocks[other];
        let range = BLEND_DISTANCE * placed.width;
        if box_distance(own.place, placed.bounds) >= own.distance + range {
            return None;
        }
        let unit = placed.unit(own.place);
        let closest = placed.map.point(unit);
        let beyond = closest.distance(own.place) - own.distance;
        let nearness = (1.0 - beyond / range).clamp(0.0, 1.0);
        // Into the other block, along the surface: beyond a slab between, but not behind the surface.
        let to_center = placed.map.point(DVec3::splat(0.5)) - closest;
        let inside = closest + SIGHT_DEPTH * to_center.reject_from_normalized(surface.normal);
        let is_seen = nearness > LEAST_NEARNESS && sees(inside.as_vec3());
        is_seen.then(|| BlockShare {
            block: other,
            unit: placed.unit_from(unit, surface.point),
            weight: nearness * nearness,
        })
    }

    /// Shares a block's weight out over its walls.
    fn blend_walls(&self, share: &BlockShare, normal: DVec3, blend: &mut Blend) {
        let placed = &self.blocks[share.block];
        let facing = placed.facing(share.unit, normal);
        let weight = |face: Face| (facing[face.index()] + BLEND_OFFSET).max(0.0).powi(3);
        let total: f64 = placed.walls().map(weight).sum();
        for face in placed.walls() {
            if weight(face) > 0.0 {
                let receiver = WallReceiver::on_face(share.block, face, share.unit);
                blend.add(receiver, share.weight * weight(face) / total);
            }
        }
    }

    /// The block that the surface looks into, with the surface point in its unit cube.
    fn block_in_front(&self, surface: &Surface) -> Option<NearestBlock> {
        let Surface { point, normal } = *surface;
        let mut nearest: Option<NearestBlock> = None;
        for step in STEPS_OFF_SURFACE {
            let found = self.nearest(point + normal * step * self.smallest_diagonal)?;
            let is_inside = found.distance == 0.0;
            if nearest.is_none_or(|nearest| found.distance < nearest.distance) {
                nearest = Some(found);
            }
            if is_inside {
                break;
            }
        }
        let mut found = nearest?;
        found.unit = self.blocks[found.block].unit_from(found.unit, point);
        Some(found)
    }

    fn nearest(&self, place: DVec3) -> Option<NearestBlock> {
        let mut best: Option<NearestBlock> = None;
        // Tolerance of the inverse map, in metres.
        let rounding = 2e-6 * self.largest_diagonal;
        for &block in self.lookup.candidates(place) {
            let placed = &self.blocks[block as usize];
            let least = best.map_or(f64::MAX, |best| best.distance);
            if box_distance(place, placed.bounds) >= least {
                continue;
            }
            let unit = placed.unit(place);
            let distance = placed.map.point(unit).distance(place);
            let distance = if distance < rounding { 0.0 } else { distance };
            if distance < least {
                best = Some(NearestBlock {
                    block: block as usize,
                    unit,
                    place,
                    distance,
                });
            }
            if distance == 0.0 {
                break;
            }
        }
        best
    }
}

/// Distance from a face, in block widths.
fn depth(face: Face, unit: DVec3) -> f64 {
    let along = unit[face.axis()];
    if face.is_positive() {
        1.0 - along
    } else {
        along
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corridor() -> Level {
        let cells = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1]];
        Level::from_cells(&cells, Vec3::splat(0.5)).expect("flat cells")
    }

    #[test]
    fn a_floor_runs_on_across_blocks() {
        let map = ReceiverMap::new(&corridor());
        for k in 0..29 {
            let point = Vec3::new(0.05 + 0.1 * k as f32, -0.03, 0.4);
            let receiver = map.receiver(point, Vec3::Y).expect("blocks");
            assert_eq!(receiver.block.get(), point.x as usize);
            assert_eq!(map.turned_face(&receiver), Some(Face::NegY));
        }
    }

    #[test]
    fn a_wall_between_rooms_belongs_to_the_room_that_it_faces() {
        // Blocks 1 and 3 do not touch; between 0 and the free place beside it stands a wall at z = 1.
        let mut level = corridor();
        level.blocks.extend(
            Level::from_cells(&[[0, 0, 1]], Vec3::ONE)
                .expect("a cell")
                .blocks,
        );
        let map = ReceiverMap::new(&level);
        let point = Vec3::new(0.5, 0.5, 1.0);
        let block = |normal| map.receiver(point, normal).expect("blocks").block.get();
        assert_eq!(block(Vec3::NEG_Z), 0);
        assert_eq!(block(Vec3::Z), 4);
    }

    #[test]
    fn openings_receive_nothing_and_weights_sum_to_one() {
        let level = corridor();
        let map = ReceiverMap::new(&level);
        for k in 0..64 {
            let angle = 0.1 * k as f32;
            let normal = Vec3::new(angle.cos(), 0.3 * (3.0 * angle).sin(), angle.sin()).normalize();
            let point = Vec3::new(1.5, 0.4, 0.5);
            let one = map.receiver(point, normal).expect("blocks");
            let blend = map.blended(point, normal, |_| true);
            assert!((blend.total_weight() - 1.0).abs() < 1e-12);
            let parts = blend.parts().iter().map(|part| &part.receiver);
            for receiver in parts.chain([&one]) {
                let shape = level.blocks[receiver.block.get()].shape;
                assert!(!shape.is_open(receiver.face));
            }
        }
    }

    #[test]
    fn light_does_not_reach_the_backs_of_walls() {
        let map = ReceiverMap::new(&corridor());
        let weight = |normal| {
            let point = Vec3::new(0.5, -0.35, 0.5);
            map.blended(point, normal, |_| true).total_weight()
        };
        assert_eq!(weight(Vec3::NEG_Y), 0.0);
        assert!((weight(Vec3::Y) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn unjoined_blocks_run_into_one_another_unless_something_is_between() {
        let mut level = corridor();
        let upper = Level::from_cells(&[[0, 1, 0]], Vec3::ONE).expect("a cell");
        level.blocks.extend(upper.blocks);
        let map = ReceiverMap::new(&level);
        let share_of_upper = |height: f32, sees: bool| {
            let blend = map.blended(Vec3::new(0.0, height, 0.5), Vec3::X, |_| sees);
            let parts = blend.parts().iter();
            let of_upper = parts.filter(|part| part.receiver.block.get() == 4);
            of_upper.map(|part| part.weight).sum::<f64>()
        };
        assert_eq!(share_of_upper(0.5, true), 0.0);
        assert!((share_of_upper(0.999, true) - 0.5).abs() < 0.01);
        assert!((share_of_upper(1.001, true) - 0.5).abs() < 0.01);
        assert_eq!(share_of_upper(0.999, false), 0.0);
        assert_eq!(share_of_upper(1.001, false), 1.0);
    }

    #[test]
    fn points_far_outside_find_the_nearest_block() {
        let map = ReceiverMap::new(&corridor());
        let (block, distance) = map
            .nearest_block(Vec3::new(-7.0, 0.5, 0.5))
            .expect("blocks");
        assert_eq!(block.get(), 0);
        assert!((distance - 7.0).abs() < 1e-6);
        let inside = map.nearest_block(Vec3::new(2.5, 0.5, 1.5));
        assert_eq!(inside, Some((BlockIndex::new(3), 0.0)));
    }

    #[test]
    fn without_blocks_nothing_is_received() {
        let map = ReceiverMap::new(&Level::default());
        assert_eq!(map.receiver(Vec3::ONE, Vec3::Y), None);
        assert_eq!(map.nearest_block(Vec3::ONE), None);
        assert!(map.blended(Vec3::ONE, Vec3::Y, |_| true).parts().is_empty());
        let nowhere = BlockIndex::new(0);
        assert_eq!(map.receiver_on(Vec3::ONE, nowhere, Face::PosX), None);
    }

    #[test]
    fn the_cube_camera_decides_in_one_closed_block() {
        let level = Level::from_cells(&[[0, 0, 0]], Vec3::ONE).expect("a cell");
        // Only the floor is there.
        let floor = |origin: Vec3, direction: Vec3| match -origin.y / direction.y {
            t if t > 0.0 => t,
            _ => f32::INFINITY,
        };
        let map = ReceiverMap::with_cube_camera(&level, floor);
        // A slope low on the wall: without the camera, nearness would choose the wall.
        let (point, normal) = (
            Vec3::new(0.1, 0.02, 0.5),
            Vec3::new(0.9, 0.4, 0.0).normalize(),
        );
        let face = |map: &ReceiverMap| map.receiver(point, normal).expect("a block").face;
        assert_eq!(face(&map), Face::NegY);
        assert_eq!(face(&ReceiverMap::new(&level)), Face::NegX);
    }
}
