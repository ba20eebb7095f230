//! Where a point of the real mesh gets its indirect light from: one block, its walls, and the (u, v) on
//! them (Loos et al. 2011, sections 6.2 and 7.2).
//!
//! The paper gives each vertex the face through which a cube camera in the block's centre sees it, which
//! suits a scene in one block. Joined blocks take the wall that the surface is turned like instead: two
//! blocks side by side then choose the same wall, and light runs on across their common side.

mod cube_camera;
mod lookup;
mod trilinear;
pub mod unwrap;

use cube_camera::CubeCamera;
use glam::{DVec3, Vec3};
use lookup::Lookup;
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::tube::TubeForm;
use mrt_runtime::Level;
use mrt_runtime::blocks::Block;
use trilinear::Trilinear;

/// A point of a block's wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Index into [`Level::blocks`].
    pub block: usize,
    /// A wall of the block's canonical shape.
    pub face: Face,
    /// Along the face's u axis, in [0, 1].
    pub u: f64,
    /// Along the face's v axis, in [0, 1].
    pub v: f64,
}

/// Steps off the surface at which a block is looked for, in shares of the smallest block's diagonal:
/// a surface lies on the border of two blocks or a little behind its own block's wall.
const STEPS_OFF_SURFACE: [f64; 3] = [0.01, 0.06, 0.25];

/// Weight of nearness against likeness of direction when one wall is chosen.
const NEARNESS_WEIGHT: f64 = 0.35;

/// The cube camera decides for surfaces turned like the face that sees them, to this cosine; the sides
/// of furniture are seen through the floor but turned like walls.
const LEAST_FACING: f64 = 0.35;

/// Cosines are raised by this and cubed to weigh walls: 99 % falls to the wall that a surface is
/// parallel to, and where that is an opening, the walls around it share.
const BLEND_OFFSET: f64 = 0.15;

/// Blocks that are not joined but have nothing between them, such as storeys around an atrium, run into
/// one another over this distance, in block widths.
const BLEND_DISTANCE: f64 = 0.4;

/// Blocks below this, before it is squared to a weight, are not worth a ray.
const LEAST_BLEND: f64 = 0.1;

/// Blocks that one point takes light from, at most.
const MOST_BLENDED: usize = 4;

/// Distances over which light ends on surfaces that have their block behind them, in block widths.
const BEHIND_RANGE: [f64; 2] = [0.1, 0.3];

/// Distances over which light ends on surfaces away from any block, in block widths.
const FAR_RANGE: [f64; 2] = [0.6, 1.2];

/// Blocks by place.
#[derive(Clone, Debug)]
pub struct ReceiverMap {
    blocks: Vec<Placed>,
    camera: Option<CubeCamera>,
    lookup: Lookup,
    smallest_diagonal: f64,
    largest_diagonal: f64,
}

#[derive(Clone, Debug)]
struct Placed {
    /// From the canonical cube.
    map: Trilinear,
    orientation: CubeRotation,
    bounds: (DVec3, DVec3),
    /// Cube root of the volume, metres.
    width: f64,
    /// Of the canonical shape.
    is_wall: [bool; 6],
    /// Its form, if it is a tube.
    tube: Option<TubeForm>,
    /// Blocks that it is connected to.
    neighbours: Vec<usize>,
}

/// The block nearest to a place.
#[derive(Clone, Copy, Debug)]
struct Found {
    block: usize,
    /// In its unit cube.
    unit: DVec3,
    /// Where it was looked for.
    place: DVec3,
    /// Metres from the place to the block, 0 inside.
    distance: f64,
}

/// Receivers of one point, with weights.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    parts: [(Receiver, f64); 6 * MOST_BLENDED],
    count: usize,
}

impl ReceiverMap {
    /// Sorts the level's blocks by place.
    pub fn new(level: &Level) -> Self {
        let mut blocks: Vec<Placed> = level.blocks.iter().map(Placed::new).collect();
        for connection in &level.connections {
            let (a, b) = (connection.a.block, connection.b.block);
            blocks[a].neighbours.push(b);
            blocks[b].neighbours.push(a);
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

    /// As [`ReceiverMap::new`]; a level of one closed block looks at the mesh with a cube camera.
    pub fn with_mesh(level: &Level, bvh: &Bvh) -> Self {
        let mut map = Self::new(level);
        if let [block] = level.blocks.as_slice()
            && block.shape.openings.is_empty()
        {
            map.camera = Some(CubeCamera::new(&block.canonical_warp(), bvh));
        }
        map
    }

    /// The one receiver of a surface point with a unit normal out of the surface, `None` only without
    /// blocks.
    pub fn receiver(&self, point: Vec3, normal: Vec3) -> Option<Receiver> {
        let (point, normal) = (point.as_dvec3(), normal.as_dvec3());
        let Found { block, unit, .. } = self.block_in_front(point, normal)?;
        let placed = &self.blocks[block];
        if let Some(receiver) = placed.on_tube(block, unit) {
            return Some(receiver);
        }
        let facing = placed.facing(unit, normal);
        let face = self.face_seen(point, unit, &facing).or_else(|| {
            let score = |face: Face| facing[face.index()] - NEARNESS_WEIGHT * depth(face, unit);
            placed
                .walls()
                .max_by(|&a, &b| score(a).total_cmp(&score(b)))
        })?;
        Some(on_face(block, face, unit))
    }

    /// The receivers of a surface point and their weights, which change smoothly with place and normal;
    /// for pictures, where each pixel can read several places of a lightmap. `sees` tells whether
    /// nothing stands between the surface and a point.
    ///
    /// The weights sum to one, less where the nearest block lies behind the surface or far off: no
    /// light of the level gets there.
    pub fn blended(&self, point: Vec3, normal: Vec3, sees: impl Fn(Vec3) -> bool) -> Blend {
        let mut blend = Blend::default();
        let (point, normal) = (point.as_dvec3(), normal.as_dvec3());
        let Some(own) = self.block_in_front(point, normal) else {
            return blend;
        };
        let placed = &self.blocks[own.block];
        let share = placed.share_lit(point, normal, &own);
        if let Some(receiver) = placed.on_tube(own.block, own.unit) {
            blend.add(receiver, share);
            return blend;
        }
        if let Some(face) = self.face_seen(point, own.unit, &placed.facing(own.unit, normal)) {
            blend.add(on_face(own.block, face, own.unit), share);
            return blend;
        }
        let mut blocks = [(own.block, own.unit, 1.0); MOST_BLENDED];
        let mut count = 1;
        for &other in self.lookup.candidates(own.place) {
            let other = other as usize;
            // The walls of joined blocks run into one another anyway.
            let is_joined = self.blocks[own.block].neighbours.contains(&other);
            if count == MOST_BLENDED || other == own.block || is_joined {
                continue;
            }
            let placed = &self.blocks[other];
            let reach = own.distance + BLEND_DISTANCE * placed.width;
            if lookup::box_distance(own.place, placed.bounds) >= reach {
                continue;
            }
            let unit = placed.unit(own.place);
            let beyond = placed.map.point(unit).distance(own.place) - own.distance;
            let weight = (1.0 - beyond / (BLEND_DISTANCE * placed.width)).clamp(0.0, 1.0);
            // Into the other block, along the surface: beyond a slab between, but not behind the surface.
            let closest = placed.map.point(unit);
            let to_center = placed.map.point(DVec3::splat(0.5)) - closest;
            let inside = closest + 0.06 * to_center.reject_from_normalized(normal);
            if weight > LEAST_BLEND && sees(inside.as_vec3()) {
                blocks[count] = (other, placed.unit_from(unit, point), weight * weight);
                count += 1;
            }
        }
        let total: f64 = blocks[..count].iter().map(|(.., weight)| weight).sum();
        for &(block, unit, weight) in &blocks[..count] {
            self.blend_walls(block, unit, normal, share * weight / total, &mut blend);
        }
        blend
    }

    /// Shares a weight out over a block's walls.
    fn blend_walls(&self, block: usize, unit: DVec3, normal: DVec3, share: f64, blend: &mut Blend) {
        let placed = &self.blocks[block];
        let facing = placed.facing(unit, normal);
        let weight = |face: Face| (facing[face.index()] + BLEND_OFFSET).max(0.0).powi(3);
        let total: f64 = placed.walls().map(weight).sum();
        for face in placed.walls() {
            if weight(face) > 0.0 {
                blend.add(on_face(block, face, unit), share * weight(face) / total);
            }
        }
    }

    /// Where a point lies on a wall of a block, moved inside it.
    pub fn receiver_on(&self, point: Vec3, block: usize, face: Face) -> Receiver {
        on_face(block, face, self.blocks[block].unit(point.as_dvec3()))
    }

    /// The block that contains a point, or else the nearest, and the distance to it in metres.
    pub fn nearest_block(&self, point: Vec3) -> Option<(usize, f64)> {
        let found = self.nearest(point.as_dvec3())?;
        Some((found.block, found.distance))
    }

    /// A canonical face as the level names it.
    pub fn turned_face(&self, receiver: &Receiver) -> Face {
        self.blocks[receiver.block].orientation.face(receiver.face)
    }

    fn face_seen(&self, point: DVec3, unit: DVec3, facing: &[f64; 6]) -> Option<Face> {
        let camera = self.camera.as_ref()?;
        let face = camera.face_that_sees(point, unit)?;
        (facing[face.index()] > LEAST_FACING).then_some(face)
    }

    /// The block that the surface looks into.
    fn block_in_front(&self, point: DVec3, normal: DVec3) -> Option<Found> {
        let mut nearest: Option<Found> = None;
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

    fn nearest(&self, place: DVec3) -> Option<Found> {
        let mut best: Option<Found> = None;
        // Tolerance of the inverse map, in metres.
        let rounding = 2e-6 * self.largest_diagonal;
        for &block in self.lookup.candidates(place) {
            let placed = &self.blocks[block as usize];
            let least = best.map_or(f64::MAX, |best| best.distance);
            if lookup::box_distance(place, placed.bounds) >= least {
                continue;
            }
            let unit = placed.unit(place);
            let distance = placed.map.point(unit).distance(place);
            let distance = if distance < rounding { 0.0 } else { distance };
            if distance < least {
                best = Some(Found {
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

impl Blend {
    /// Receivers and their weights.
    pub fn parts(&self) -> &[(Receiver, f64)] {
        &self.parts[..self.count]
    }

    fn add(&mut self, receiver: Receiver, weight: f64) {
        if weight > 0.0
            && let Some(part) = self.parts.get_mut(self.count)
        {
            *part = (receiver, weight);
            self.count += 1;
        }
    }
}

impl Default for Blend {
    fn default() -> Self {
        let nowhere = Receiver {
            block: 0,
            face: Face::NegX,
            u: 0.0,
            v: 0.0,
        };
        Self {
            parts: [(nowhere, 0.0); 6 * MOST_BLENDED],
            count: 0,
        }
    }
}

impl Placed {
    fn new(block: &Block) -> Self {
        let warp = block.canonical_warp();
        Self {
            map: Trilinear::new(&warp),
            orientation: block.orientation,
            bounds: warp.bounds(),
            width: warp.jacobian(DVec3::splat(0.5)).determinant().abs().cbrt(),
            neighbours: Vec::new(),
            is_wall: Face::ALL.map(|face| !block.shape.is_open(face)),
            tube: block.shape.tube(),
        }
    }

    /// The nearest point of a tube's wall, which is smooth: no normal is needed to choose a chart.
    fn on_tube(&self, block: usize, unit: DVec3) -> Option<Receiver> {
        let (face, u, v) = self.tube?.chart_of(unit);
        Some(Receiver { block, face, u, v })
    }

    fn walls(&self) -> impl Iterator<Item = Face> + '_ {
        Face::ALL
            .into_iter()
            .filter(|face| self.is_wall[face.index()])
    }

    /// Cosines between a surface's normal and the inward normals of the faces around a point.
    fn facing(&self, unit: DVec3, normal: DVec3) -> [f64; 6] {
        let gradients = self.map.gradients(unit).unwrap_or([DVec3::ZERO; 3]);
        let along = gradients.map(|gradient| gradient.normalize_or_zero().dot(normal));
        Face::ALL.map(|face| {
            let cosine = along[face.axis()];
            if face.is_positive() { -cosine } else { cosine }
        })
    }

    /// 1 for surfaces in the block or in niches before it, 0 for those that turn their back on it or are
    /// far off.
    fn share_lit(&self, point: DVec3, normal: DVec3, found: &Found) -> f64 {
        let offset = point - self.map.point(found.unit);
        let fade = |distance: f64, range: [f64; 2]| {
            let [start, end] = range.map(|share| share * self.width);
            (1.0 - (distance - start) / (end - start)).clamp(0.0, 1.0)
        };
        fade(offset.dot(normal), BEHIND_RANGE) * fade(offset.length(), FAR_RANGE)
    }

    /// The point's place in the unit cube, moved inside it.
    fn unit(&self, point: DVec3) -> DVec3 {
        // The inverse of a warp is unsure far outside; there the nearest point of the bounds will do.
        self.unit_from(DVec3::splat(0.5), point)
    }

    /// As [`Placed::unit`], faster from a good guess.
    fn unit_from(&self, guess: DVec3, point: DVec3) -> DVec3 {
        let inside = point.clamp(self.bounds.0, self.bounds.1);
        let unit = self.map.inverse(guess, inside).unwrap_or(guess);
        unit.clamp(DVec3::ZERO, DVec3::ONE)
    }
}

fn on_face(block: usize, face: Face, unit: DVec3) -> Receiver {
    Receiver {
        block,
        face,
        u: unit[face.u_axis()],
        v: unit[face.v_axis()],
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
            assert_eq!(receiver.block, point.x as usize);
            assert_eq!(map.turned_face(&receiver), Face::NegY);
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
        let block = |normal| map.receiver(point, normal).expect("blocks").block;
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
            let parts = blend.parts();
            let total: f64 = parts.iter().map(|(_, weight)| weight).sum();
            assert!((total - 1.0).abs() < 1e-12);
            for receiver in parts.iter().map(|(part, _)| part).chain([&one]) {
                assert!(!level.blocks[receiver.block].shape.is_open(receiver.face));
            }
        }
    }

    #[test]
    fn light_does_not_reach_the_backs_of_walls() {
        let map = ReceiverMap::new(&corridor());
        let weight = |normal| {
            let blend = map.blended(Vec3::new(0.5, -0.35, 0.5), normal, |_| true);
            blend.parts().iter().map(|(_, weight)| weight).sum::<f64>()
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
            let of_upper = blend.parts().iter().filter(|(r, _)| r.block == 4);
            of_upper.map(|(_, weight)| weight).sum::<f64>()
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
        assert_eq!(block, 0);
        assert!((distance - 7.0).abs() < 1e-6);
        assert_eq!(map.nearest_block(Vec3::new(2.5, 0.5, 1.5)), Some((3, 0.0)));
    }
}
