//! Where a point of the real mesh gets its indirect light from: one block, one of its walls, and the
//! (u, v) on it (Loos et al. 2011, sections 6.2 and 7.2).
//!
//! The paper assigns vertices to faces by a cube camera in the block's centre, which suits a scene in
//! one block. Joined blocks take the wall that the surface is turned like instead: two blocks side
//! by side then choose the same wall, and light runs on across their common side.

mod cube_camera;
pub mod unwrap;

use cube_camera::CubeCamera;
use glam::{DVec3, Vec3};
use mrt_core::bvh::Bvh;
use mrt_core::cube::{CubeRotation, Face};
use mrt_core::hexahedron::Hexahedron;
use mrt_runtime::level::{Block, Level};

/// A point of a block's wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Index into [`Level::blocks`].
    pub block: usize,
    /// A wall of the block's turned cube.
    pub face: Face,
    /// Along the face's u axis, in [0, 1].
    pub u: f64,
    /// Along the face's v axis, in [0, 1].
    pub v: f64,
}

/// Steps off the surface at which a block is looked for, in shares of the smallest block's diagonal:
/// a surface lies on the border of two blocks or a little behind its own block's wall.
const STEPS_OFF_SURFACE: [f64; 3] = [0.01, 0.06, 0.25];

/// Weight of nearness against likeness of direction when a wall is chosen.
const NEARNESS_WEIGHT: f64 = 0.35;

/// The cube camera decides for surfaces turned like the face that sees them, to this cosine; the sides
/// of furniture are seen through the floor but turned like walls.
const LEAST_FACING: f64 = 0.35;

/// Blocks by place.
#[derive(Clone, Debug)]
pub struct ReceiverMap {
    blocks: Vec<Placed>,
    camera: Option<CubeCamera>,
    lookup: Lookup,
    smallest_diagonal: f64,
}

#[derive(Clone, Debug)]
struct Placed {
    warp: Hexahedron,
    orientation: CubeRotation,
    bounds: (DVec3, DVec3),
    walls: Vec<Face>,
}

impl ReceiverMap {
    /// Sorts the level's blocks by place.
    pub fn new(level: &Level) -> Self {
        let blocks: Vec<Placed> = level
            .blocks
            .iter()
            .map(|block| Placed {
                warp: block.warp,
                orientation: block.orientation,
                bounds: block.warp.bounds(),
                walls: walls(block),
            })
            .collect();
        let smallest_diagonal = blocks
            .iter()
            .map(|block| block.warp.diagonal())
            .fold(f64::MAX, f64::min);
        Self {
            lookup: Lookup::new(&blocks),
            blocks,
            camera: None,
            smallest_diagonal,
        }
    }

    /// As [`ReceiverMap::new`]; a level of one closed block looks at the mesh with a cube camera.
    pub fn with_mesh(level: &Level, bvh: &Bvh) -> Self {
        let mut map = Self::new(level);
        if let [block] = level.blocks.as_slice()
            && block.shape.openings.is_empty()
        {
            map.camera = Some(CubeCamera::new(&block.warp, bvh));
        }
        map
    }

    /// The receiver of a surface point with a unit normal out of the surface, `None` only without
    /// blocks.
    pub fn receiver(&self, point: Vec3, normal: Vec3) -> Option<Receiver> {
        let (point, normal) = (point.as_dvec3(), normal.as_dvec3());
        let (block, unit) = self.block_in_front(point, normal)?;
        let placed = &self.blocks[block];
        let seen = self
            .camera
            .as_ref()
            .and_then(|camera| camera.face_that_sees(&placed.warp, point, unit))
            .filter(|&face| placed.facing(face, unit, normal) > LEAST_FACING);
        let face = seen.or_else(|| placed.wall_towards(unit, normal))?;
        Some(Receiver {
            block,
            face,
            u: unit[face.u_axis()],
            v: unit[face.v_axis()],
        })
    }

    /// Where a point lies on a given wall of a given block, moved inside it.
    pub fn receiver_on(&self, point: Vec3, block: usize, face: Face) -> Receiver {
        let unit = self.blocks[block].unit(point.as_dvec3());
        Receiver {
            block,
            face,
            u: unit[face.u_axis()],
            v: unit[face.v_axis()],
        }
    }

    /// The receiver in the block's canonical shape: face, u, v.
    pub fn canonical(&self, receiver: &Receiver) -> (Face, f64, f64) {
        let canonical = self.blocks[receiver.block].orientation.inverse();
        let face = canonical.face(receiver.face);
        let point = canonical.point(receiver.face.point(receiver.u, receiver.v));
        (face, point[face.u_axis()], point[face.v_axis()])
    }

    /// The block that contains a point, or else the nearest, and the distance to it in metres.
    pub fn nearest_block(&self, point: Vec3) -> Option<(usize, f64)> {
        let (block, _, distance) = self.nearest(point.as_dvec3())?;
        Some((block, distance))
    }

    /// The block that the surface looks into, with the point's place in its unit cube.
    fn block_in_front(&self, point: DVec3, normal: DVec3) -> Option<(usize, DVec3)> {
        let mut nearest: Option<(usize, f64)> = None;
        for step in STEPS_OFF_SURFACE {
            let (block, _, distance) =
                self.nearest(point + normal * step * self.smallest_diagonal)?;
            if nearest.is_none_or(|(_, least)| distance < least) {
                nearest = Some((block, distance));
            }
            if distance == 0.0 {
                break;
            }
        }
        let (block, _) = nearest?;
        Some((block, self.blocks[block].unit(point)))
    }

    fn nearest(&self, point: DVec3) -> Option<(usize, DVec3, f64)> {
        let mut best: Option<(usize, DVec3, f64)> = None;
        for &block in self.lookup.candidates(point) {
            let placed = &self.blocks[block as usize];
            let least = best.map_or(f64::MAX, |(_, _, least)| least);
            if box_distance(point, placed.bounds) >= least {
                continue;
            }
            let unit = placed.unit(point);
            // Rounding of the inverse map, in metres.
            let rounding = 1e-9 * self.smallest_diagonal;
            let distance = placed.warp.point(unit).distance(point);
            let distance = if distance < rounding { 0.0 } else { distance };
            if distance < least {
                best = Some((block as usize, unit, distance));
            }
            if distance == 0.0 {
                break;
            }
        }
        best
    }
}

impl Placed {
    /// The wall that a surface is turned like; of several the nearest.
    fn wall_towards(&self, unit: DVec3, normal: DVec3) -> Option<Face> {
        let score = |face: Face| {
            let axis = face.axis();
            let depth = if face.is_positive() {
                1.0 - unit[axis]
            } else {
                unit[axis]
            };
            self.facing(face, unit, normal) - NEARNESS_WEIGHT * depth
        };
        self.walls
            .iter()
            .copied()
            .max_by(|&a, &b| score(a).total_cmp(&score(b)))
    }

    /// Cosine between a surface's normal and a wall's.
    fn facing(&self, face: Face, unit: DVec3, normal: DVec3) -> f64 {
        let (u, v) = (unit[face.u_axis()], unit[face.v_axis()]);
        normal.dot(self.warp.face_normal(face, u, v))
    }

    /// The point's place in the unit cube, moved inside it.
    fn unit(&self, point: DVec3) -> DVec3 {
        // The inverse of a warp is unsure far outside; there the nearest point of the bounds will do.
        let inside = point.clamp(self.bounds.0, self.bounds.1);
        let unit = self.warp.inverse(inside).unwrap_or(DVec3::splat(0.5));
        unit.clamp(DVec3::ZERO, DVec3::ONE)
    }
}

/// Faces of the turned cube that are not openings.
fn walls(block: &Block) -> Vec<Face> {
    Face::ALL
        .into_iter()
        .filter(|&face| !block.is_open(face))
        .collect()
}

/// Distance from a point to a box, zero inside.
fn box_distance(point: DVec3, (min, max): (DVec3, DVec3)) -> f64 {
    point.distance(point.clamp(min, max))
}

/// A coarse grid over the level; each cell lists every block that can be nearest to a point in it.
#[derive(Clone, Debug)]
struct Lookup {
    min: DVec3,
    edge: DVec3,
    candidates: Vec<Vec<u32>>,
}

/// Cells along each axis of the lookup.
const LOOKUP_CELLS: usize = 24;

impl Lookup {
    fn new(blocks: &[Placed]) -> Self {
        let min = blocks
            .iter()
            .map(|b| b.bounds.0)
            .fold(DVec3::MAX, DVec3::min);
        let max = blocks
            .iter()
            .map(|b| b.bounds.1)
            .fold(DVec3::MIN, DVec3::max);
        // Meshes reach beyond the blocks; further out, the outermost cells serve.
        let margin = (max - min) * 0.1;
        let (min, max) = (min - margin, max + margin);
        let edge = (max - min) / LOOKUP_CELLS as f64;
        let half = edge / 2.0;
        let mut candidates = Vec::with_capacity(LOOKUP_CELLS.pow(3));
        for z in 0..LOOKUP_CELLS {
            for y in 0..LOOKUP_CELLS {
                for x in 0..LOOKUP_CELLS {
                    let center = min + (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * edge;
                    let nearest = blocks
                        .iter()
                        .map(|block| box_distance(center, block.bounds))
                        .fold(f64::MAX, f64::min);
                    // The nearest box may hold a slanted block whose wall is further away.
                    let reach = nearest + 2.0 * half.length();
                    let near = |block: &Placed| {
                        let grown = (block.bounds.0 - half, block.bounds.1 + half);
                        box_distance(center, grown) <= reach
                    };
                    let list = (0..blocks.len())
                        .filter(|&block| near(&blocks[block]))
                        .map(|block| block as u32)
                        .collect();
                    candidates.push(list);
                }
            }
        }
        Self {
            min,
            edge,
            candidates,
        }
    }

    fn candidates(&self, point: DVec3) -> &[u32] {
        let cell = ((point - self.min) / self.edge)
            .clamp(DVec3::ZERO, DVec3::splat(LOOKUP_CELLS as f64 - 1.0))
            .as_usizevec3();
        self.candidates
            .get((cell.z * LOOKUP_CELLS + cell.y) * LOOKUP_CELLS + cell.x)
            .map_or(&[], Vec::as_slice)
    }
}
