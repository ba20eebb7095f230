//! One closed room: its reduced transport, its exact solution, and a picture of its inside.

use super::error::FigureError;
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::reference::bounces::ReferenceBounces;
use mrt_core::reference::radiosity::direct::{PointLight, direct_quarters};
use mrt_core::reference::radiosity::solve::solve_rgb;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_core::reference::radiosity::{ExactScene, Side};
use mrt_dictionary::config::{Enrichment, PriorConfig};
use mrt_dictionary::modular::light_prior::basis::light_prior;
use mrt_dictionary::modular::light_prior::cube::{direct_samples, enriched_prior};
use mrt_dictionary::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
use mrt_dictionary::modular::surface::mirrors::cube::texel_parity_classes;
use mrt_dictionary::modular::transport::modes::{BlockTransport, block_transport, fold_bounce};
use mrt_dictionary::progress::Progress;
use mrt_editor::render::camera::Camera;
use mrt_editor::render::picture::Picture;
use mrt_editor::render::render;
use mrt_runtime::blocks::SHAPES;
use std::f32::consts::PI;

/// Modes of the reduced transport: those of the standard preset.
pub const MODES: usize = 32;

/// Points of direct light along each axis of a quarter of a texel.
const DIRECT_SAMPLES: usize = 4;

/// Canonical transport of the closed cube, with and without enrichment.
pub struct ClosedCube {
    /// With enrichment, as every preset bakes it.
    pub enriched: BlockTransport,
    /// From the light prior alone.
    pub plain: BlockTransport,
}

impl ClosedCube {
    /// The standard preset's transport at any resolution.
    pub fn new(resolution: usize) -> Result<Self, FigureError> {
        let shape = &SHAPES[0];
        let classes = texel_parity_classes(shape, resolution);
        let bounce = closed_cube_bounce(resolution, Reconstruction::Constant, &Progress::silent())?;
        let folded = fold_bounce(&bounce, &classes);
        let samples = direct_samples(shape, resolution, &PriorConfig::default());
        let prior = light_prior(&samples, &classes, usize::MAX);
        let transport = |prior| block_transport(&folded, &folded, prior, &classes, MODES);
        let plain = transport(&prior.basis);
        let weights = Enrichment::default();
        let joined = enriched_prior(&prior, &plain.indirect_basis, shape, &classes, &weights);
        Ok(Self {
            enriched: transport(&joined.basis),
            plain,
        })
    }
}

/// A box from the origin to `size`.
pub fn box_of(size: DVec3) -> Hexahedron {
    Hexahedron {
        corners: std::array::from_fn(|k| Hexahedron::unit_corner(k) * size),
    }
}

/// Indirect irradiance (texels x 3) after a number of bounces of direct light through reduced operators T and U.
pub fn reduced(
    [coefficients, basis]: [&Matrix<f64>; 2],
    direct: &[f64],
    albedo: &[[f64; 3]],
    bounces: usize,
) -> Vec<[f64; 3]> {
    let mut indirect = vec![[0.0; 3]; direct.len()];
    for _ in 0..bounces {
        let sent = Matrix::from_fn(direct.len(), 3, |i, c| {
            albedo[i][c] * (direct[i] + indirect[i][c])
        });
        let arriving = multiply(
            basis.view(),
            multiply(coefficients.view(), sent.view()).view(),
        );
        // A frame clamps the irradiance of each pass in the same way.
        indirect = (0..direct.len())
            .map(|i| [0, 1, 2].map(|c| arriving[(i, c)].max(0.0)))
            .collect();
    }
    indirect
}

/// Indirect irradiance (texels x 3) after a number of bounces by the exact solver, for a room of any form.
pub fn exact(
    warp: Hexahedron,
    resolution: usize,
    light: &PointLight,
    albedo: &[[f64; 3]],
    bounces: usize,
) -> Result<Vec<[f64; 3]>, FigureError> {
    let scene = ExactScene::new(vec![warp], vec![[Side::Wall; 6]], resolution)?;
    let direct = direct_quarters(&scene, light, DIRECT_SAMPLES);
    let transport = Transport::build(&scene);
    Ok(solve_rgb(
        &scene,
        &transport,
        &direct,
        ReferenceBounces::Count(bounces),
        albedo,
    )?)
}

/// One colour for each wall, spread over its texels.
pub fn spread(walls: [[f64; 3]; 6], resolution: usize) -> Vec<[f64; 3]> {
    walls
        .iter()
        .flat_map(|&colour| std::iter::repeat_n(colour, resolution * resolution))
        .collect()
}

/// Radiance, linear RGB, of diffuse texels under light.
pub fn radiance(albedo: &[[f64; 3]], irradiance: &[[f64; 3]]) -> Vec<Vec3> {
    albedo
        .iter()
        .zip(irradiance)
        .map(|(a, e)| Vec3::from_array([0, 1, 2].map(|c| (a[c] * e[c]) as f32)) / PI)
        .collect()
}

/// The inside of a box from the origin to `size`, seen through one face that is left out.
pub struct OpenBox<'a> {
    /// Metres.
    pub size: DVec3,
    /// The face left out.
    pub open: Face,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Of the texels of all six walls.
    pub radiance: &'a [Vec3],
}

impl OpenBox<'_> {
    /// A picture, and another that is white where the first shows the room and black where it shows nothing.
    pub fn picture(&self, camera: &Camera, size: [usize; 2]) -> [Picture; 2] {
        render(camera, size, 3, |origin, direction| {
            match self.seen(origin.as_dvec3(), direction.as_dvec3()) {
                Some(colour) => [colour, Vec3::ONE],
                None => [Vec3::ZERO; 2],
            }
        })
    }

    /// Radiance of the wall that a ray from outside meets; `None` unless it enters by the open face.
    fn seen(&self, origin: DVec3, direction: DVec3) -> Option<Vec3> {
        let (mut near, mut far) = ((f64::MIN, None), (f64::MAX, None));
        for axis in (0..3).filter(|&axis| direction[axis] != 0.0) {
            let to = |plane: f64| (plane - origin[axis]) / direction[axis];
            let forward = direction[axis] > 0.0;
            let (low, high) = (to(0.0), to(self.size[axis]));
            let (enter, leave) = if forward { (low, high) } else { (high, low) };
            if enter > near.0 {
                near = (enter, Some(Face::from_axis(axis, !forward)));
            }
            if leave < far.0 {
                far = (leave, Some(Face::from_axis(axis, forward)));
            }
        }
        let is_through = near.0 < far.0 && near.0 > 0.0 && near.1 == Some(self.open);
        let face = far.1.filter(|_| is_through)?;
        Some(self.on_wall(face, (origin + far.0 * direction) / self.size))
    }

    /// Radiance at a point of a wall, bilinear between texel centres.
    fn on_wall(&self, face: Face, unit: DVec3) -> Vec3 {
        let n = self.resolution;
        let place = |x: f64| {
            let x = (x * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
            let low = (x.floor() as usize).min(n - 2);
            (low, (x - low as f64) as f32)
        };
        let ((i, s), (j, t)) = (place(unit[face.u_axis()]), place(unit[face.v_axis()]));
        let texel = |i: usize, j: usize| self.radiance[(face.index() * n + j) * n + i];
        let row = |j: usize| texel(i, j).lerp(texel(i + 1, j), s);
        row(j).lerp(row(j + 1), t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_seen_only_through_the_open_face() {
        let mut radiance = vec![Vec3::ZERO; 6 * 4];
        radiance[4 * Face::NegZ.index()..][..4].fill(Vec3::ONE);
        let room = OpenBox {
            size: DVec3::new(1.0, 1.0, 2.0),
            open: Face::PosZ,
            resolution: 2,
            radiance: &radiance,
        };
        let middle = DVec3::new(0.5, 0.5, 5.0);
        assert_eq!(room.seen(middle, DVec3::NEG_Z), Some(Vec3::ONE));
        assert_eq!(room.seen(middle, DVec3::Z), None);
        assert_eq!(room.seen(DVec3::new(0.5, 5.0, 0.5), DVec3::NEG_Y), None);
    }
}
