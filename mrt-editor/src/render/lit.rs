//! Colours of a mesh under lamps, with indirect light from a lightmap.

use super::lamp::{position, unshadowed, way_to};
use crate::import::surface_colours::{SurfaceColours, SurfacePoint};
use glam::{Vec2, Vec3};
use mrt_core::geometry::bvh::Bvh;
use mrt_core::geometry::mesh::TriangleMesh;
use mrt_core::lighting::sampling::{hash, sobol_point};
use mrt_runtime::Light;
use mrt_runtime::low_level::output::lightmap_atlas::LightmapAtlas;
use mrt_runtime::low_level::output::receiver::{Blend, ReceiverMap};
use std::f32::consts::PI;

/// Shadow rays that are always cast to a lamp.
const FIRST_SHADOW_RAYS: u32 = 2;

/// Shadow rays to a lamp where the first disagree.
const SHADOW_RAYS: u32 = 16;

/// Lamps below this share of all light that a point would get without shadows are left out.
const NEGLIGIBLE_SHARE: f32 = 2e-3;

/// Images seen at a flatter angle than this are averaged as at this cosine.
const LEAST_COSINE: f32 = 0.1;

/// Everything that a ray needs to find its colour.
#[derive(Clone, Copy)]
pub struct LitScene<'a> {
    /// The mesh.
    pub mesh: &'a TriangleMesh,
    /// The colours of its points.
    pub colours: &'a SurfaceColours,
    /// Unit normals of the triangles' corners, for shading.
    pub corner_normals: &'a [[Vec3; 3]],
    /// The mesh's tree.
    pub bvh: &'a Bvh,
    /// From points of the mesh to walls of blocks.
    pub receivers: &'a ReceiverMap,
    /// From walls of blocks to the lightmap.
    pub atlas: &'a LightmapAtlas,
    /// Indirect irradiance, W/m².
    pub lightmap: &'a [[f32; 3]],
    /// What direct light comes from.
    pub lamps: &'a [Light],
    /// Distance from surfaces at which rays start, metres.
    pub restart: f32,
    /// Distance beyond which the mesh has no surfaces, metres.
    pub reach: f32,
    /// Angle between neighbouring pixels, radians: images on surfaces are averaged over a pixel.
    pub pixel_angle: f32,
    /// True if rooms see the backs of the faces.
    pub is_reversed: bool,
    /// For views from outside: surfaces are invisible from behind, and where no light of the level gets to, such as roofs,
    /// so that one looks into the rooms.
    pub hides_outside: bool,
}

/// What a ray sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Colours {
    /// Radiance by light straight from lamps, and that of surfaces which shine.
    pub direct: Vec3,
    /// Radiance by indirect light.
    pub indirect: Vec3,
}

struct Surface {
    position: Vec3,
    /// Of the triangle, towards the viewer.
    flat_normal: Vec3,
    /// Smoothed, towards the viewer.
    normal: Vec3,
    albedo: Vec3,
    /// Radiance that it sends out by itself.
    emission: Vec3,
}

impl LitScene<'_> {
    /// The radiance that comes back along a ray with a unit direction; black where the ray hits nothing.
    pub fn colours(&self, origin: Vec3, direction: Vec3) -> Colours {
        let Some(surface) = self.surface(origin, direction) else {
            return Colours::default();
        };
        let reflectance = surface.albedo / PI;
        Colours {
            direct: surface.emission + reflectance * self.direct(&surface),
            indirect: reflectance * self.indirect(&surface),
        }
    }

    fn surface(&self, mut origin: Vec3, direction: Vec3) -> Option<Surface> {
        // Few surfaces lie behind one another; the bound stops rays along a stack of them.
        for _ in 0..64 {
            let hit = self.bvh.closest_hit(origin, direction, f32::INFINITY)?;
            let triangle = hit.triangle as usize;
            let [a, b, c] = self.mesh.corners(triangle);
            let flat = (b - a).cross(c - a).normalize_or_zero();
            let position = origin + direction * hit.t;
            let is_back = flat.dot(direction) > 0.0;
            if self.hides_outside && (is_back || self.is_outside(position, flat)) {
                origin = position + direction * self.restart;
                continue;
            }
            let towards_viewer = if is_back { -1.0 } else { 1.0 };
            let [na, nb, nc] = self.corner_normals[triangle];
            let smooth = na * (1.0 - hit.u - hit.v) + nb * hit.u + nc * hit.v;
            let across = hit.t * self.pixel_angle;
            let at = SurfacePoint {
                triangle,
                barycentric: Vec2::new(hit.u, hit.v),
                area: across * across / flat.dot(direction).abs().max(LEAST_COSINE),
            };
            let most = self.colours.albedo_range()[1];
            let emission = self.colours.emission(self.mesh, triangle);
            return Some(Surface {
                position,
                flat_normal: flat * towards_viewer,
                normal: smooth.try_normalize().unwrap_or(flat) * towards_viewer,
                // Walls of the level are no brighter than this, so that light dies out between them.
                albedo: self.colours.albedo(self.mesh, &at).min(Vec3::splat(most)),
                emission: if is_back == self.is_reversed {
                    emission
                } else {
                    Vec3::ZERO
                },
            });
        }
        None
    }

    fn is_outside(&self, position: Vec3, normal: Vec3) -> bool {
        let blend = self.receivers.blended(position, normal, |_| false);
        blend.total_weight() < 0.5
    }

    /// Irradiance straight from the lamps, with soft shadows.
    fn direct(&self, surface: &Surface) -> Vec3 {
        let seed = hash(surface.position.x.to_bits(), surface.position.z.to_bits());
        let unshadowed = |lamp: &Light| {
            let flat = unshadowed(lamp, surface.position, surface.flat_normal);
            if flat == Vec3::ZERO {
                return Vec3::ZERO;
            }
            unshadowed(lamp, surface.position, surface.normal)
        };
        let most: Vec3 = self.lamps.iter().map(unshadowed).sum();
        let mut sum = Vec3::ZERO;
        for lamp in self.lamps {
            let irradiance = unshadowed(lamp);
            if irradiance.cmple(most * NEGLIGIBLE_SHARE).all() {
                continue;
            }
            sum += irradiance * self.visible_share(surface, lamp, seed);
        }
        sum
    }

    /// The share of a lamp that is seen: by a few rays where they agree, by more in penumbras.
    fn visible_share(&self, surface: &Surface, lamp: &Light, seed: u32) -> f32 {
        let distance = position(lamp).map_or(self.reach, |lamp| lamp.distance(surface.position));
        let start = surface.position + surface.flat_normal * self.restart.min(1e-2 * distance);
        let is_visible = |k: u32| {
            let towards = way_to(lamp, start, sobol_point(k, seed), self.reach);
            u32::from(!self.bvh.is_occluded(start, towards, 1.0))
        };
        let first: u32 = (0..FIRST_SHADOW_RAYS).map(is_visible).sum();
        if first == 0 || first == FIRST_SHADOW_RAYS {
            return (first / FIRST_SHADOW_RAYS) as f32;
        }
        let rest: u32 = (FIRST_SHADOW_RAYS..SHADOW_RAYS).map(is_visible).sum();
        (first + rest) as f32 / SHADOW_RAYS as f32
    }

    fn blend(&self, surface: &Surface) -> Blend {
        let start = surface.position + surface.flat_normal * self.restart;
        self.receivers
            .blended(surface.position, surface.normal, |place| {
                !self.bvh.is_occluded(start, place - start, 1.0)
            })
    }

    /// Irradiance from the lightmap, of several walls: with one, curved surfaces would show where it changes.
    fn indirect(&self, surface: &Surface) -> Vec3 {
        self.blend(surface)
            .parts()
            .iter()
            .filter_map(|part| {
                let at = part.receiver;
                let pixel = self
                    .atlas
                    .pixel(at.block, at.face, at.u as f32, at.v as f32)?;
                let irradiance = self.atlas.sample(self.lightmap, pixel);
                Some(Vec3::from_array(irradiance) * part.weight as f32)
            })
            .sum()
    }
}
