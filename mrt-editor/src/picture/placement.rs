//! Finds places for lights and cameras in a mesh by casting rays.

use super::camera::Camera;
use glam::{DVec3, Vec3};
use mrt_core::bvh::Bvh;
use mrt_core::mesh::{TriangleMesh, bounds};
use mrt_core::sampling::{hammersley_point, sphere_from_square, square_from_unit};
use mrt_runtime::level::{Block, Level};

/// Rays that look around from a point.
const LOOKS: u32 = 64;

/// A mesh and which side of its faces is inside.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// The mesh.
    pub mesh: &'a TriangleMesh,
    /// Its tree.
    pub bvh: &'a Bvh,
    /// Rooms see the backs of the faces.
    pub is_reversed: bool,
}

/// What a look around from a point meets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct View {
    /// Share of the directions that meet a face turned to the point.
    pub fronts: f32,
    /// Share that meets a face turned away.
    pub backs: f32,
    /// Smallest distance met, metres.
    pub clearance: f32,
}

impl<'a> Surroundings<'a> {
    /// Asks the blocks' centres which side of the faces is inside.
    pub fn new(mesh: &'a TriangleMesh, bvh: &'a Bvh, level: &Level) -> Self {
        let mut surroundings = Self {
            mesh,
            bvh,
            is_reversed: false,
        };
        let (mut fronts, mut backs) = (0.0, 0.0);
        for block in &level.blocks {
            let view = surroundings.look_around(block.warp.center().as_vec3());
            fronts += view.fronts;
            backs += view.backs;
        }
        surroundings.is_reversed = backs > 2.0 * fronts;
        surroundings
    }

    /// Looks in all directions.
    pub fn look_around(&self, point: Vec3) -> View {
        let mut view = View {
            clearance: f32::INFINITY,
            ..View::default()
        };
        for k in 0..LOOKS {
            let square = square_from_unit(hammersley_point(k, LOOKS));
            let direction = sphere_from_square(square).as_vec3();
            let Some(hit) = self.bvh.closest_hit(point, direction, f32::INFINITY) else {
                continue;
            };
            view.clearance = view.clearance.min(hit.t);
            let [a, b, c] = self.mesh.corners(hit.triangle as usize);
            let is_front = (b - a).cross(c - a).dot(direction) < 0.0;
            let share = 1.0 / LOOKS as f32;
            if is_front != self.is_reversed {
                view.fronts += share;
            } else {
                view.backs += share;
            }
        }
        view
    }

    /// True behind the faces: in a wall or in the rock.
    pub fn is_in_wall(&self, point: Vec3) -> bool {
        let view = self.look_around(point);
        view.backs > view.fronts
    }

    /// The free distance from a point, at most `limit`.
    fn distance(&self, point: Vec3, direction: Vec3, limit: f32) -> f32 {
        self.bvh
            .closest_hit(point, direction, limit)
            .map_or(limit, |hit| hit.t)
    }
}

/// Places for up to `count` lights: high up in the largest blocks, apart from one another.
pub fn light_places(around: &Surroundings<'_>, level: &Level, count: usize) -> Vec<(usize, Vec3)> {
    let mut order: Vec<usize> = (0..level.blocks.len()).collect();
    let volume = |block: usize| volume(&level.blocks[block]);
    order.sort_by(|&a, &b| volume(b).total_cmp(&volume(a)));
    let mut places: Vec<(usize, Vec3)> = Vec::new();
    for block in order {
        let Some(place) = place_in_block(around, &level.blocks[block]) else {
            continue;
        };
        let apart = 2.5 * level.blocks[block].warp.diagonal() as f32;
        if places
            .iter()
            .all(|(_, other)| other.distance(place) > apart)
        {
            places.push((block, place));
        }
        if places.len() == count {
            break;
        }
    }
    places
}

fn volume(block: &Block) -> f64 {
    block.warp.jacobian(DVec3::splat(0.5)).determinant()
}

/// The place in the block that is furthest from every surface, out of a few; `None` when all are in
/// walls.
fn place_in_block(around: &Surroundings<'_>, block: &Block) -> Option<Vec3> {
    let mut best: Option<(f32, Vec3)> = None;
    for y in [0.72, 0.5, 0.3] {
        for x in [0.5, 0.35, 0.65] {
            for z in [0.5, 0.35, 0.65] {
                let place = block.warp.point(DVec3::new(x, y, z)).as_vec3();
                let view = around.look_around(place);
                // Open sides are fine, a view of backs is not.
                let is_inside = view.fronts > 4.0 * view.backs && view.clearance.is_finite();
                if is_inside && best.is_none_or(|(clearance, _)| view.clearance > 1.3 * clearance) {
                    best = Some((view.clearance, place));
                }
            }
        }
    }
    best.map(|(_, place)| place)
}

/// A camera that sees what a light lights: along the longest level line through the light's place, from
/// one end towards the other.
pub fn camera_at_light(around: &Surroundings<'_>, light: Vec3, aspect: f32) -> Option<Camera> {
    let limit = size(around.mesh);
    let below = around.distance(light, Vec3::NEG_Y, limit);
    let above = around.distance(light, Vec3::Y, limit);
    // The height of eyes in a room of usual proportions.
    let eye = light - Vec3::Y * (below - 0.45 * (below + above).min(2.0 * below)).max(0.0);
    let mut best: Option<(f32, Vec3, f32, f32)> = None;
    for k in 0..48 {
        let angle = k as f32 / 48.0 * std::f32::consts::TAU;
        let ahead = Vec3::new(angle.cos(), 0.0, angle.sin());
        // A view out of the level shows nothing; standing outside and looking in is fine.
        let Some(hit) = around.bvh.closest_hit(eye, ahead, limit) else {
            continue;
        };
        let forward = hit.t;
        let back = around.distance(eye, -ahead, limit);
        // A place to stand in counts as much as a far view, but no more than fits into the picture.
        let score = forward + 1.5 * back.min(forward);
        if best.is_none_or(|(most, ..)| score > most) {
            best = Some((score, ahead, forward, back));
        }
    }
    let (_, ahead, forward, back) = best?;
    let from = eye - ahead * (0.85 * back).min(1.5 * forward);
    // Slightly downwards: floors show light better than far ends.
    let to = eye + ahead * forward - Vec3::Y * 0.1 * forward.min(0.9 * below);
    Camera::look_at(from, to, 60f32.to_radians(), aspect)
}

/// A camera high outside, to look into the rooms through the backs of ceilings.
pub fn overview(level: &Level, aspect: f32) -> Option<Camera> {
    let corners = || level.blocks.iter().flat_map(|block| block.warp.corners);
    let low = corners().fold(DVec3::MAX, DVec3::min).as_vec3();
    let high = corners().fold(DVec3::MIN, DVec3::max).as_vec3();
    let center = (low + high) / 2.0;
    let angle = 40f32.to_radians();
    // The whole bounding sphere would leave much empty; levels are flat.
    let reach = ((high - low).length() / 2.0) / (angle / 2.0).tan() * 0.75;
    // Levels are longer one way; look across the longer.
    let size = high - low;
    let side = if size.x >= size.z { Vec3::Z } else { Vec3::X };
    let direction = (side + Vec3::Y * 1.4).normalize();
    Camera::look_at(center + direction * reach, center, angle, aspect)
}

fn size(mesh: &TriangleMesh) -> f32 {
    bounds(mesh).map_or(1.0, |[low, high]| (high - low).length())
}
