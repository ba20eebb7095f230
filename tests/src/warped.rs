//! For tests of warped blocks: warps, canonical operators, lights and errors.

use glam::{DMat3, DQuat, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::lighting::sampling::hash;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_dictionary::config::{Enrichment, PriorConfig};
use mrt_dictionary::modular::light_prior::basis::light_prior;
use mrt_dictionary::modular::light_prior::cube::{direct_samples, enriched_prior};
use mrt_dictionary::modular::light_prior::warped::{
    warped_direct_samples, warped_light_radius, warped_prior_lights,
};
use mrt_dictionary::modular::one_bounce::cube::{
    Reconstruction, closed_cube_bounce, restrict_to_shape,
};
use mrt_dictionary::modular::one_bounce::warped::warped_bounce;
use mrt_dictionary::modular::surface::mirrors::cube::texel_parity_classes;
use mrt_dictionary::modular::surface::walls::warped::WarpedWalls;
use mrt_dictionary::modular::transport::modes::{BlockTransport, block_transport, fold_bounce};
use mrt_dictionary::modular::transport::warped::{RebuildConfig, rebuilt, regathered};
use mrt_dictionary::progress::Progress;
use mrt_runtime::blocks::Shape;

/// Texels along an edge of a wall in the standard preset.
pub const RESOLUTION: usize = 16;
/// Modes of the standard preset.
pub const MODES: usize = 32;

/// The canonical operators of a shape, as the standard preset bakes them.
pub fn canonical(shape: &Shape) -> BlockTransport {
    let classes = texel_parity_classes(shape, RESOLUTION);
    let closed = closed_cube_bounce(RESOLUTION, Reconstruction::Constant, &Progress::silent())
        .expect("nobody cancels");
    let folded = fold_bounce(&restrict_to_shape(&closed, shape, RESOLUTION), &classes);
    let samples = direct_samples(shape, RESOLUTION, &PriorConfig::default());
    let prior = light_prior(&samples, &classes, usize::MAX);
    let plain = block_transport(&folded, &folded, &prior.basis, &classes, MODES);
    let weights = Enrichment::default();
    let enriched = enriched_prior(&prior, &plain.indirect_basis, shape, &classes, &weights);
    block_transport(&folded, &folded, &enriched.basis, &classes, MODES)
}

/// A warped block with the transport that each way of adapting it gives.
pub struct Warped {
    /// Its walls, texel by texel.
    pub walls: WarpedWalls,
    /// F of the warped walls: the exact first bounce, texels x texels.
    pub bounce: Matrix<f64>,
    /// (T, U) of canonical, re-gathered and rebuilt transport.
    pub transports: [(Matrix<f64>, Matrix<f64>); 3],
    /// Radius of lights, world units.
    pub light_radius: f64,
}

/// A shape under a warp, with all its transports.
pub fn warped(shape: &Shape, canonical: &BlockTransport, warp: &Hexahedron) -> Warped {
    assert_eq!(warp.check(), Ok(()));
    let faces: Vec<Face> = shape.walls().collect();
    let openings: Vec<Face> = Face::ALL
        .into_iter()
        .filter(|f| !faces.contains(f))
        .collect();
    let walls = WarpedWalls::new(&faces, RESOLUTION, warp);
    let bounce = warped_bounce(&walls);
    let prior = PriorConfig::default();
    let light_radius = warped_light_radius(&walls, prior.light_radius);
    let lights = warped_prior_lights(&walls, &openings, prior.lights_per_axis);
    let samples = warped_direct_samples(&walls, &lights, light_radius);
    let config = RebuildConfig {
        modes: MODES,
        enrichment: Some(Enrichment::default()),
    };
    let own = rebuilt(&walls, &bounce, &samples, &config);
    let gathered = regathered(&bounce, &canonical.implicit_lighting);
    let coefficients = &canonical.coefficients_from_direct;
    Warped {
        transports: [
            (coefficients.clone(), canonical.indirect_basis.clone()),
            (coefficients.clone(), gathered),
            (own.coefficients_from_direct, own.indirect_basis),
        ],
        walls,
        bounce,
        light_radius,
    }
}

impl Warped {
    /// First bounce that each transport gives from direct light (texels x lights) between white walls.
    pub fn first_bounce(&self, direct: &Matrix<f64>) -> [Matrix<f64>; 3] {
        self.transports
            .each_ref()
            .map(|(t, u)| multiply(u.view(), multiply(t.view(), direct.view()).view()))
    }
}

/// A number in [0, 1), from a seed and an index.
pub fn random(seed: u32, index: u32) -> f64 {
    f64::from(hash(seed, index)) / 4_294_967_296.0
}

/// A random point of the unit cube.
pub fn random_point(seed: u32, index: u32) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| random(seed, 3 * index + axis)))
}

/// Random lights in the unit cube, at least 0.1 from every wall.
pub fn mid_lights(count: u32) -> Vec<DVec3> {
    (0..count).map(|k| random_point(1, k) * 0.8 + 0.1).collect()
}

/// The hexahedron whose corners are the images of the unit cube's.
pub fn image(map: impl Fn(DVec3) -> DVec3) -> Hexahedron {
    Hexahedron {
        corners: std::array::from_fn(|k| map(Hexahedron::unit_corner(k))),
    }
}

/// A box of this size.
pub fn stretched(size: [f64; 3]) -> Hexahedron {
    image(|p| p * DVec3::from_array(size))
}

/// A cube whose points move by `shear` times y along x.
pub fn sheared(shear: f64) -> Hexahedron {
    let map = DMat3::from_cols(DVec3::X, DVec3::new(shear, 1.0, 0.0), DVec3::Z);
    image(|p| map * p)
}

/// A cube each of whose corners is moved at random, by up to `size` along each axis.
pub fn jittered(size: f64, seed: u32) -> Hexahedron {
    Hexahedron {
        corners: std::array::from_fn(|k| {
            let offset = random_point(seed, k as u32) * 2.0 - 1.0;
            Hexahedron::unit_corner(k) + offset * size
        }),
    }
}

/// A tower whose top is `width` times as wide as its foot. Its faces are planar, and yet it is no affine image of the cube.
pub fn frustum(width: f64) -> Hexahedron {
    image(|p| {
        let scale = 1.0 + (width - 1.0) * p.y;
        (p - DVec3::new(0.5, 0.0, 0.5)) * DVec3::new(scale, 1.0, scale)
    })
}

/// A tower whose top is turned by `angle`, in degrees.
pub fn twisted(angle: f64) -> Hexahedron {
    image(|p| {
        let turn = DQuat::from_rotation_y(p.y * angle.to_radians());
        turn * (p - DVec3::new(0.5, 0.0, 0.5))
    })
}

/// Relative L2 error, with squares weighted by `areas`.
pub fn rel_l2_by(areas: &[f64], found: &[f64], truth: &[f64]) -> f64 {
    let (mut miss, mut size) = (0.0, 0.0);
    for ((f, t), area) in found.iter().zip(truth).zip(areas) {
        miss += (f - t) * (f - t) * area;
        size += t * t * area;
    }
    (miss / size).sqrt()
}

/// Sum weighted by `areas`.
pub fn total(areas: &[f64], values: &[f64]) -> f64 {
    areas.iter().zip(values).map(|(a, v)| a * v).sum()
}

/// The middle value of a list that is not empty.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The mean of a list that is not empty.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
