//! What a ray sees of a level's own walls.

use glam::{DVec3, Vec3};
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::placed::{PlacedBlock, PlacedLevel};
use mrt_runtime::low_level::light::direct_light::{Shadows, irradiance};
use mrt_runtime::low_level::light::placed::{PlacedLight, place};
use mrt_runtime::shadows::{Openings, Receiver};
use mrt_runtime::{BlockIndex, Frame, Light, LightError};
use std::f32::consts::PI;

/// Parts along each axis into which a wall is cut, since warped walls are bent.
const WALL_PARTS: usize = 4;

/// Parts along each axis into which a chart of a tube, a quarter of the way around, is cut: chords are 2e-4 block widths
/// off their arcs.
const CHART_PARTS: usize = 24;

/// Distance, in lengths of the ray's direction, by which a ray restarts behind a wall seen from outside.
const RESTART: f32 = 1e-4;

/// The level's walls as a mesh that is visible from inside the blocks alone, so that one looks into them from outside.
pub struct LevelView<'a> {
    frame: &'a Frame,
    lights: Vec<PlacedLight>,
    bvh: Bvh,
    /// By triangle of the mesh.
    patches: Vec<Patch>,
}

/// Why there is no view.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// A light is refused.
    #[error(transparent)]
    Light(#[from] LightError),
}

/// A triangle on a wall.
#[derive(Clone, Copy, Debug)]
struct Patch {
    block: BlockIndex,
    /// Of the canonical shape.
    face: Face,
    /// (u, v) of the triangle's corners on the face.
    corners: [[f32; 2]; 3],
}

/// A point of a wall that a ray meets from inside.
#[derive(Clone, Copy, Debug)]
struct Seen {
    patch: Patch,
    u: f32,
    v: f32,
    normal: DVec3,
    /// In lengths of the ray's direction.
    distance: f32,
}

impl<'a> LevelView<'a> {
    /// A view of a solved frame. Without ceilings (+y walls as the level names them) it can be seen from above.
    ///
    /// # Errors
    /// [`ViewError::Light`].
    pub fn new(frame: &'a Frame, lights: &[Light], with_ceilings: bool) -> Result<Self, ViewError> {
        let level = &frame.scene().level;
        let lights = lights
            .iter()
            .map(|&light| place(level, light))
            .collect::<Result<_, _>>()?;
        let mut patches = Vec::new();
        for (index, block) in level.blocks.iter().enumerate() {
            for face in block.shape.walls() {
                if with_ceilings || block.orientation.face(face) != Face::PosY {
                    patches.extend(patches_of_wall(block, BlockIndex::new(index), face));
                }
            }
        }
        Ok(Self {
            frame,
            lights,
            bvh: Bvh::build(&mesh_of(level, &patches)),
            patches,
        })
    }

    fn level(&self) -> &'a PlacedLevel {
        &self.frame.scene().level
    }

    /// Radiance towards the ray's origin, W/(m² sr) per channel, from direct and from indirect light; `None` where the ray
    /// meets no wall from inside.
    pub fn radiance(&self, origin: Vec3, direction: Vec3) -> Option<(Vec3, Vec3)> {
        let seen = self.seen(origin, direction)?;
        Some(self.leaving(&seen))
    }

    /// How far the ray goes until it meets a wall from inside, in lengths of its direction.
    pub fn distance(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        self.seen(origin, direction).map(|seen| seen.distance)
    }

    fn seen(&self, mut origin: Vec3, direction: Vec3) -> Option<Seen> {
        let mut start = 0.0;
        // A ray crosses each block at most twice.
        for _ in 0..2 * self.level().blocks.len() + 2 {
            let hit = self.bvh.closest_hit(origin, direction, f32::MAX)?;
            let patch = self.patches[hit.triangle as usize];
            let [a, b, c] = patch.corners;
            let mix = |k: usize| a[k] + hit.u * (b[k] - a[k]) + hit.v * (c[k] - a[k]);
            let (u, v) = (mix(0), mix(1));
            let block = &self.level().blocks[patch.block.get()];
            let wall = block
                .shape
                .wall_point(patch.face, f64::from(u), f64::from(v));
            let normal = wall.warped_normal(&block.warp);
            if normal.dot(direction.as_dvec3()) < 0.0 {
                return Some(Seen {
                    patch,
                    u,
                    v,
                    normal,
                    distance: start + hit.t,
                });
            }
            origin += direction * (hit.t + RESTART);
            start += hit.t + RESTART;
        }
        None
    }

    fn leaving(&self, seen: &Seen) -> (Vec3, Vec3) {
        let Seen {
            patch,
            u,
            v,
            normal,
            ..
        } = *seen;
        let block = &self.level().blocks[patch.block.get()];
        let (across, up) = (f64::from(u), f64::from(v));
        let wall = block.shape.wall_point(patch.face, across, up);
        let receiver = Receiver {
            block: patch.block,
            position: block.warp.point(wall.position),
        };
        let shadows = Shadows {
            level: self.level(),
            doors: &self.level().doors,
            visibility: &Openings,
        };
        let lights = self.lights.iter();
        let direct: Vec3 = lights
            .map(|light| irradiance(shadows, light, receiver, normal))
            .sum();
        let atlas = &self.frame.scene().atlas;
        let indirect = atlas
            .pixel(patch.block, patch.face, u, v)
            .map_or(Vec3::ZERO, |pixel| {
                Vec3::from_array(atlas.sample(self.frame.lightmap().pixels(), pixel))
            });
        let texel = Shape::texel_of_uv(self.level().resolution, across, up);
        let albedo = block
            .shape
            .wall_offset(patch.face, self.level().resolution)
            .map_or(Vec3::ZERO, |offset| {
                let albedo = self.frame.texel_albedo(patch.block, offset + texel);
                albedo.unwrap_or(Vec3::ZERO)
            });
        (direct * albedo / PI, indirect * albedo / PI)
    }
}

/// Two triangles for each part of a wall.
fn patches_of_wall(block: &PlacedBlock, index: BlockIndex, face: Face) -> Vec<Patch> {
    let parts = match block.shape.tube() {
        None => WALL_PARTS,
        Some(_) => CHART_PARTS,
    };
    let mut patches = Vec::with_capacity(2 * parts * parts);
    for cell in 0..parts * parts {
        let at = |k: usize| k as f32 / parts as f32;
        let (i, j) = (cell % parts, cell / parts);
        let [a, b] = [[at(i), at(j)], [at(i + 1), at(j)]];
        let [c, d] = [[at(i + 1), at(j + 1)], [at(i), at(j + 1)]];
        patches.extend([[a, b, c], [a, c, d]].map(|corners| Patch {
            block: index,
            face,
            corners,
        }));
    }
    patches
}

/// The patches in the world, one triangle each.
fn mesh_of(level: &PlacedLevel, patches: &[Patch]) -> TriangleMesh {
    let mut positions = Vec::with_capacity(3 * patches.len());
    for patch in patches {
        let block = &level.blocks[patch.block.get()];
        positions.extend(patch.corners.map(|[u, v]| {
            let wall = block
                .shape
                .wall_point(patch.face, f64::from(u), f64::from(v));
            block.warp.point(wall.position).as_vec3()
        }));
    }
    let indices = (0..patches.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    TriangleMesh::from_triangles(positions, indices.collect())
}
