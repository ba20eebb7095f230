//! A plain diffuse path tracer: the reference for meshes that are not levels of convex blocks.
//!
//! Paths start at the receivers, leave every surface with a cosine density, and gather direct light at
//! each hit through a shadow ray. There is no Russian roulette and no other importance sampling, so
//! little can go wrong.

use crate::geometry::bvh::Bvh;
use crate::geometry::mesh::{self, MeshError, TriangleMesh};
use crate::lighting::sampling::{
    cosine_hemisphere_from_square, hash, sobol_point, square_from_unit,
};
use crate::lighting::sphere_light::sphere_light_irradiance;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Rays start this fraction of the scene's diagonal off a surface: a hundred roundings of `f32`.
const SURFACE_OFFSET: f64 = 1e-5;

/// An isotropic diffuse sphere, or a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// World position of the centre.
    pub position: DVec3,
    /// Radiant intensity of each channel, W/sr.
    pub intensity: DVec3,
    /// Metres; 0 for a point. Irradiance grows no further within this distance.
    pub radius: f64,
}

/// A mesh with its lights, ready to be traced. Surfaces reflect and emit on both sides.
pub struct PathScene {
    bvh: Bvh,
    /// Unit normal of each triangle.
    normals: Vec<DVec3>,
    /// Albedo of each triangle.
    albedo: Vec<DVec3>,
    /// Emitted radiosity of each triangle; empty if nothing emits.
    emission: Vec<DVec3>,
    lights: Vec<SphereLight>,
    /// How far off a surface rays start, metres.
    offset: f64,
}

/// How many paths are traced, and how far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Number of paths from each receiver; a power of two is best.
    pub paths: u32,
    /// Largest number of reflections on a path.
    pub bounces: u32,
    /// Different seeds give independent estimates.
    pub seed: u32,
}

/// Irradiance of a receiver, W/m² for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathIrradiance {
    /// Light straight from lights and emitting surfaces.
    pub direct: DVec3,
    /// Light that was reflected at least once.
    pub indirect: DVec3,
}

/// Why a scene cannot be traced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// The mesh is not valid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// There is not one emission for each material.
    #[error("there are {found} emissions; expected none, or {expected}, one for each material")]
    EmissionCount {
        /// Number of materials.
        expected: usize,
        /// Number of emissions.
        found: usize,
    },
}

impl PathScene {
    /// Prepares a mesh. `emission` holds the radiosity that each material emits, W/m², or is empty.
    ///
    /// # Errors
    /// [`PathError`] if the mesh is not valid, or there is not one emission for each material.
    pub fn new(
        mesh: &TriangleMesh,
        lights: Vec<SphereLight>,
        emission: &[DVec3],
    ) -> Result<Self, PathError> {
        mesh::check(mesh)?;
        if !emission.is_empty() && emission.len() != mesh.materials.len() {
            return Err(PathError::EmissionCount {
                expected: mesh.materials.len(),
                found: emission.len(),
            });
        }
        let normal = |triangle| {
            let [a, b, c] = mesh.corners(triangle).map(Vec3::as_dvec3);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let material_of = |triangle: &u32| *triangle as usize;
        let materials = || mesh.triangle_materials.iter().map(material_of);
        let diagonal = mesh::bounds(mesh).map_or(0.0, |[low, high]| low.distance(high));
        Ok(Self {
            bvh: Bvh::build(mesh),
            normals: (0..mesh.triangles.len()).map(normal).collect(),
            albedo: materials()
                .map(|m| mesh.materials[m].albedo.as_dvec3())
                .collect(),
            emission: if emission.is_empty() {
                Vec::new()
            } else {
                materials().map(|m| emission[m]).collect()
            },
            lights,
            offset: SURFACE_OFFSET * f64::from(diagonal),
        })
    }
}

/// Irradiance at receivers, each a point and a unit normal.
///
/// The result of a receiver depends on the settings and on its index, not on the number of threads.
pub fn irradiance(
    scene: &PathScene,
    receivers: &[(DVec3, DVec3)],
    settings: &PathSettings,
) -> Vec<PathIrradiance> {
    let gather = |(index, &(point, normal)): (usize, &(DVec3, DVec3))| {
        let seed = hash(settings.seed, index as u32);
        let mut sum = PathIrradiance::default();
        for path in 0..settings.paths {
            let path = Path {
                seed,
                index: path,
                bounces: settings.bounces,
            };
            path.trace(scene, (point, normal), &mut sum);
        }
        let scale = 1.0 / f64::from(settings.paths.max(1));
        PathIrradiance {
            direct: sum.direct * scale + direct_light(scene, point, normal),
            indirect: sum.indirect * scale,
        }
    };
    receivers.par_iter().enumerate().map(gather).collect()
}

/// One of the paths from a receiver.
struct Path {
    seed: u32,
    index: u32,
    /// Largest number of reflections.
    bounces: u32,
}

impl Path {
    /// Adds the light that the path brings to its receiver.
    fn trace(
        &self,
        scene: &PathScene,
        (mut point, mut normal): (DVec3, DVec3),
        sum: &mut PathIrradiance,
    ) {
        let mut throughput = DVec3::ONE;
        // Emitted light is reflected as often as light from lights, and needs one more ray for it.
        let rays = self.bounces + u32::from(!scene.emission.is_empty());
        for depth in 0..rays {
            let square = square_from_unit(sobol_point(self.index, hash(self.seed, depth)));
            let local = cosine_hemisphere_from_square(square);
            let (tangent, bitangent) = normal.any_orthonormal_pair();
            let direction = tangent * local.x + bitangent * local.y + normal * local.z;
            let origin = point + normal * scene.offset;
            let found = scene
                .bvh
                .closest_hit(origin.as_vec3(), direction.as_vec3(), f32::INFINITY);
            let Some(hit) = found else {
                return;
            };
            let triangle = hit.triangle as usize;
            point = origin + direction * f64::from(hit.t);
            normal = scene.normals[triangle];
            if normal.dot(direction) > 0.0 {
                normal = -normal;
            }
            if let Some(&emitted) = scene.emission.get(triangle) {
                let arriving = throughput * emitted;
                if depth == 0 {
                    sum.direct += arriving;
                } else {
                    sum.indirect += arriving;
                }
            }
            throughput *= scene.albedo[triangle];
            if depth == self.bounces || throughput == DVec3::ZERO {
                return;
            }
            sum.indirect += throughput * direct_light(scene, point, normal);
        }
    }
}

/// Irradiance straight from the lights, shadows included.
fn direct_light(scene: &PathScene, point: DVec3, normal: DVec3) -> DVec3 {
    let origin = point + normal * scene.offset;
    let mut sum = DVec3::ZERO;
    for light in &scene.lights {
        let unshadowed = sphere_light_irradiance(light.position - point, normal, light.radius);
        if unshadowed == 0.0 {
            continue;
        }
        let ray = (light.position - origin).as_vec3();
        if !scene.bvh.is_occluded(origin.as_vec3(), ray, 1.0) {
            sum += light.intensity * unshadowed;
        }
    }
    sum
}
