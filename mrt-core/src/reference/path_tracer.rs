//! A plain diffuse path tracer: the reference for meshes that are no levels of convex blocks.
//!
//! Paths start at the points that are asked about, leave every surface with a cosine density, and
//! gather direct light at each hit through a shadow ray. There is no roulette and no importance
//! sampling of lights beyond that, so there is little that could be wrong.

use crate::geometry::bvh::Bvh;
use crate::geometry::mesh::{self, MeshError, TriangleMesh};
use crate::lighting::sampling::{
    cosine_hemisphere_from_square, hash, sobol_point, square_from_unit,
};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Rays start this fraction of the scene's diagonal off a surface: a hundred roundings of `f32`.
const SURFACE_OFFSET: f64 = 1e-5;

/// An isotropic diffuse sphere, or a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// World position of the centre.
    pub position: DVec3,
    /// W/sr for each channel.
    pub intensity: DVec3,
    /// Metres; 0 for a point. Nearer than this, irradiance grows no further.
    pub radius: f64,
}

/// A mesh with its lights, ready to be traced. Surfaces reflect and emit on both sides.
pub struct PathScene {
    bvh: Bvh,
    normals: Vec<DVec3>,
    /// Albedo of each triangle.
    albedo: Vec<DVec3>,
    /// Emitted radiosity of each triangle; empty if nothing emits.
    emission: Vec<DVec3>,
    lights: Vec<SphereLight>,
    offset: f64,
}

/// How much work to spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Paths from each point; best a power of two.
    pub paths: u32,
    /// Most reflections on a path.
    pub bounces: u32,
    /// Seeds give independent estimates.
    pub seed: u32,
}

/// What arrives at a point, W/m² for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathIrradiance {
    /// Straight from lights and emitting surfaces.
    pub direct: DVec3,
    /// After at least one reflection.
    pub indirect: DVec3,
}

/// Why a scene cannot be traced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// The mesh makes no sense.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Not one emission for each material.
    #[error("there are {found} emissions; expected none, or {expected}, one for each material")]
    EmissionCount {
        /// Number of materials.
        expected: usize,
        /// Number of emissions.
        found: usize,
    },
}

impl PathScene {
    /// Prepares a mesh; `emission` holds the radiosity that each material emits, W/m², or nothing.
    ///
    /// # Errors
    /// [`PathError`].
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

/// Irradiance at (point, unit normal) pairs.
///
/// The result depends on the settings and the index of the point, not on the number of threads.
pub fn irradiance(
    scene: &PathScene,
    receivers: &[(DVec3, DVec3)],
    settings: &PathSettings,
) -> Vec<PathIrradiance> {
    let gather = |(index, &(point, normal)): (usize, &(DVec3, DVec3))| {
        let seed = hash(settings.seed, index as u32);
        let mut sum = PathIrradiance::default();
        for path in 0..settings.paths {
            add_path(
                scene,
                point,
                normal,
                (seed, path, settings.bounces),
                &mut sum,
            );
        }
        let scale = 1.0 / f64::from(settings.paths.max(1));
        PathIrradiance {
            direct: sum.direct * scale + direct_light(scene, point, normal),
            indirect: sum.indirect * scale,
        }
    };
    receivers.par_iter().enumerate().map(gather).collect()
}

/// Adds what one path brings, `(seed, path, bounces)` naming it.
fn add_path(
    scene: &PathScene,
    mut point: DVec3,
    mut normal: DVec3,
    (seed, path, bounces): (u32, u32, u32),
    sum: &mut PathIrradiance,
) {
    let mut throughput = DVec3::ONE;
    // What surfaces emit is reflected as often as lights' light is, and then takes one ray more.
    let rays = bounces + u32::from(!scene.emission.is_empty());
    for depth in 0..rays {
        let square = square_from_unit(sobol_point(path, hash(seed, depth)));
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
        if depth == bounces || throughput == DVec3::ZERO {
            return;
        }
        sum.indirect += throughput * direct_light(scene, point, normal);
    }
}

/// Irradiance straight from the lights.
fn direct_light(scene: &PathScene, point: DVec3, normal: DVec3) -> DVec3 {
    let origin = point + normal * scene.offset;
    let mut sum = DVec3::ZERO;
    for light in &scene.lights {
        let to_light = light.position - point;
        let squared = to_light.length_squared();
        let cosine = normal.dot(to_light) / squared.sqrt();
        if cosine.is_nan() || cosine <= 0.0 {
            continue;
        }
        let ray = (light.position - origin).as_vec3();
        if !scene.bvh.is_occluded(origin.as_vec3(), ray, 1.0) {
            sum += light.intensity * (cosine / squared.max(light.radius * light.radius));
        }
    }
    sum
}
