//! Finds places for lights and cameras in a mesh by casting rays.

use super::camera::Camera;
use glam::{DVec3, Vec3};
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::geometry::mesh::{TriangleMesh, bounds};
use mrt_core::lighting::sampling::{hammersley_point, sphere_from_square, square_from_unit};
use mrt_runtime::Level;
use mrt_runtime::blocks::Block;
use std::f32::consts::TAU;

/// Vertical angle of view, radians.
pub const VIEW_ANGLE_RAD: f32 = 1.05;

/// Rays across and down a trial picture.
const TRIAL_COLUMNS: usize = 24;
const TRIAL_ROWS: usize = 14;

/// Rays that look around from a point.
const LOOKS: u32 = 64;

/// A mesh and which side of its faces is inside.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// The mesh.
    pub mesh: &'a TriangleMesh,
    /// Its tree.
    pub bvh: &'a Bvh,
    /// True if rooms see the backs of the faces.
    pub is_reversed: bool,
}

/// What rays in all directions from a point meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outlook {
    /// Share of the directions that meet a face turned to the point.
    pub fronts: f32,
    /// Share of the directions that meet a face turned away.
    pub backs: f32,
    /// Distance to the nearest face met, metres; infinite if there is none.
    pub clearance: f32,
}

impl<'a> Surroundings<'a> {
    /// Finds out which side of the faces is inside, from what the blocks' centres see.
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
    pub fn look_around(&self, point: Vec3) -> Outlook {
        let mut outlook = Outlook {
            clearance: f32::INFINITY,
            ..Outlook::default()
        };
        for k in 0..LOOKS {
            let square = square_from_unit(hammersley_point(k, LOOKS));
            let direction = sphere_from_square(square).as_vec3();
            let Some(hit) = self.bvh.closest_hit(point, direction, f32::INFINITY) else {
                continue;
            };
            outlook.clearance = outlook.clearance.min(hit.t);
            let [a, b, c] = self.mesh.corners(hit.triangle as usize);
            let is_front = (b - a).cross(c - a).dot(direction) < 0.0;
            let share = 1.0 / LOOKS as f32;
            if is_front != self.is_reversed {
                outlook.fronts += share;
            } else {
                outlook.backs += share;
            }
        }
        outlook
    }

    /// Distance beyond which there are no surfaces, metres.
    pub fn reach(&self) -> f32 {
        size(self.mesh)
    }

    /// Distance from surfaces at which to start rays, metres: 1e-5 of the mesh's size.
    pub fn restart(&self) -> f32 {
        1e-5 * size(self.mesh)
    }

    /// True behind the faces: in a wall or in the rock.
    pub fn is_in_wall(&self, point: Vec3) -> bool {
        let view = self.look_around(point);
        view.backs > view.fronts
    }

    /// The free distance from a point along a direction, at most `limit`.
    fn distance(&self, point: Vec3, direction: Vec3, limit: f32) -> f32 {
        self.bvh
            .closest_hit(point, direction, limit)
            .map_or(limit, |hit| hit.t)
    }
}

/// A place for a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPlace {
    /// Which block it is in.
    pub block: usize,
    /// Metres.
    pub position: Vec3,
}

/// Places for up to `count` lights: high up in the largest blocks, apart from one another.
pub fn light_places(around: &Surroundings<'_>, level: &Level, count: usize) -> Vec<LightPlace> {
    let mut order: Vec<usize> = (0..level.blocks.len()).collect();
    let volume = |block: usize| volume(&level.blocks[block]);
    order.sort_by(|&a, &b| volume(b).total_cmp(&volume(a)));
    let mut places: Vec<LightPlace> = Vec::new();
    for block in order {
        let Some(position) = place_in_block(around, &level.blocks[block]) else {
            continue;
        };
        let apart = 2.5 * level.blocks[block].warp.diagonal() as f32;
        if places
            .iter()
            .all(|other| other.position.distance(position) > apart)
        {
            places.push(LightPlace { block, position });
        }
        if places.len() == count {
            break;
        }
    }
    places
}

/// Edge of the cube with nearly the block's volume, metres: that of the map's derivative in the middle.
pub fn block_width(warp: &Hexahedron) -> f64 {
    warp.jacobian(DVec3::splat(0.5)).determinant().abs().cbrt()
}

/// Nearly the block's volume, m³; negative if the block is mirrored.
fn volume(block: &Block) -> f64 {
    block.warp.jacobian(DVec3::splat(0.5)).determinant()
}

/// Of a few places in the block the one that is furthest from every surface; `None` if all are in walls.
fn place_in_block(around: &Surroundings<'_>, block: &Block) -> Option<Vec3> {
    let mut best: Option<(f32, Vec3)> = None;
    for y in [0.72, 0.5, 0.3] {
        for x in [0.5, 0.35, 0.65] {
            for z in [0.5, 0.35, 0.65] {
                let place = block.warp.point(DVec3::new(x, y, z)).as_vec3();
                let view = around.look_around(place);
                // A room may have open sides, but shows hardly any backs.
                let is_inside = view.fronts > 4.0 * view.backs && view.clearance.is_finite();
                if is_inside && best.is_none_or(|(clearance, _)| view.clearance > 1.3 * clearance) {
                    best = Some((view.clearance, place));
                }
            }
        }
    }
    best.map(|(_, place)| place)
}

/// A camera that shows what a light lights: of many places around the light the one whose picture has most lit surfaces
/// and edges. `None` if the light lights nothing.
pub fn camera_at_light(around: &Surroundings<'_>, light: Vec3, aspect: f32) -> Option<Camera> {
    let limit = size(around.mesh);
    let below = around.distance(light, Vec3::NEG_Y, limit);
    let above = around.distance(light, Vec3::Y, limit);
    let mut best: Option<(f32, Camera)> = None;
    // Heights of eyes in rooms of usual proportions, and higher where the light hangs over a pit.
    for height in [0.35, 0.6] {
        let eye = light - Vec3::Y * (below - height * (below + above).min(1.4 * below)).max(0.0);
        for k in 0..24 {
            let angle = k as f32 / 24.0 * TAU;
            let ahead = Vec3::new(angle.cos(), 0.0, angle.sin());
            let back = around.distance(eye, -ahead, limit);
            let forward = around.distance(eye, ahead, limit);
            for share in [0.4, 0.85] {
                // The camera may stand outside and look in, but not from afar.
                let from = eye - ahead * (share * back).min(1.5 * forward);
                let to = eye + ahead * forward - Vec3::Y * 0.15 * (forward + back).min(below);
                let Some(camera) = Camera::look_at(from, to, VIEW_ANGLE_RAD, aspect) else {
                    continue;
                };
                let score = interest(around, &camera, light);
                if score > 0.0 && best.is_none_or(|(most, _)| score > most) {
                    best = Some((score, camera));
                }
            }
        }
    }
    best.map(|(_, camera)| camera)
}

/// What one ray of a trial picture meets.
#[derive(Clone, Copy)]
struct Glimpse {
    distance: f32,
    normal: Vec3,
}

/// How much a picture shows: lit surfaces and edges between surfaces count; the outside, and things right before the
/// camera, count little. Zero inside a wall.
fn interest(around: &Surroundings<'_>, camera: &Camera, light: Vec3) -> f32 {
    let near = 0.4 * camera.position.distance(light);
    let (mut lit, mut far) = (0.0, 0.0);
    let mut glimpses = [None; TRIAL_COLUMNS * TRIAL_ROWS];
    for (k, glimpse) in glimpses.iter_mut().enumerate() {
        let x = ((k % TRIAL_COLUMNS) as f32 + 0.5) / TRIAL_COLUMNS as f32;
        let y = ((k / TRIAL_COLUMNS) as f32 + 0.5) / TRIAL_ROWS as f32;
        let direction = camera.direction(x, y);
        let Some(hit) = around
            .bvh
            .closest_hit(camera.position, direction, f32::INFINITY)
        else {
            continue;
        };
        let [a, b, c] = around.mesh.corners(hit.triangle as usize);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if (normal.dot(direction) < 0.0) == around.is_reversed {
            return 0.0;
        }
        let start = (camera.position + direction * hit.t).lerp(light, 1e-3);
        lit += f32::from(!around.bvh.is_occluded(start, light - start, 1.0));
        far += f32::from(hit.t > near);
        *glimpse = Some(Glimpse {
            distance: hit.t,
            normal,
        });
    }
    let is_edge = |k: usize, other: usize| match (glimpses[k], glimpses[other]) {
        (Some(p), Some(q)) => {
            let ratio = p.distance / q.distance;
            p.normal.dot(q.normal) < 0.8 || !(0.75..1.33).contains(&ratio)
        }
        _ => false,
    };
    let edges = (0..glimpses.len() - TRIAL_COLUMNS)
        .filter(|&k| (k + 1) % TRIAL_COLUMNS != 0)
        .map(|k| f32::from(is_edge(k, k + 1)) + f32::from(is_edge(k, k + TRIAL_COLUMNS)))
        .sum::<f32>();
    let count = glimpses.len() as f32;
    // More lit surfaces than half of the picture, or more edges than half of the rays, make it no better.
    (lit / count).min(0.5) * (edges / count).min(0.5) * (far / count).powi(3)
}

/// A camera high outside, to look into the rooms through the backs of ceilings.
pub fn overview(level: &Level, aspect: f32) -> Option<Camera> {
    let corners = || level.blocks.iter().flat_map(|block| block.warp.corners);
    let low = corners().fold(DVec3::MAX, DVec3::min).as_vec3();
    let high = corners().fold(DVec3::MIN, DVec3::max).as_vec3();
    let center = (low + high) / 2.0;
    let angle = 40f32.to_radians();
    // Levels are flat: to show the whole bounding sphere would leave much of the picture empty.
    let reach = ((high - low).length() / 2.0) / (angle / 2.0).tan() * 0.75;
    // Most levels are longer along one axis; the camera looks across that.
    let size = high - low;
    let side = if size.x >= size.z { Vec3::Z } else { Vec3::X };
    let direction = (side + Vec3::Y * 1.4).normalize();
    Camera::look_at(center + direction * reach, center, angle, aspect)
}

fn size(mesh: &TriangleMesh) -> f32 {
    bounds(mesh).map_or(1.0, |[low, high]| (high - low).length())
}
