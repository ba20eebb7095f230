//! One closed block around the whole scene, as the paper maps the Great Hall (section 7.2).

use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::CubeRotation;
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_runtime::Level;
use mrt_runtime::blocks::{Block, Shape};

/// Share of the area that may lie outside on each side of each axis.
const OUTLIER_SHARE: f64 = 0.005;

/// If the whole mesh is at most this many times as long as the box without outliers, the box holds all of it.
const WHOLE_STRETCH: f64 = 1.1;

/// One block of a shape around points that are spread evenly over the mesh's area.
pub fn fit_box(shape: &'static Shape, points: &[Vec3]) -> Level {
    let mut min = DVec3::ZERO;
    let mut max = DVec3::ZERO;
    for axis in 0..3 {
        let mut values: Vec<f32> = points.iter().map(|point| point[axis]).collect();
        values.sort_by(f32::total_cmp);
        let at = |index: usize| values.get(index).map_or(0.0, |&value| f64::from(value));
        let last = values.len().saturating_sub(1);
        let outliers = (OUTLIER_SHARE * last as f64) as usize;
        let (low, high) = (at(outliers), at(last - outliers));
        let is_whole = at(last) - at(0) <= WHOLE_STRETCH * (high - low);
        (min[axis], max[axis]) = if is_whole {
            (at(0), at(last))
        } else {
            (low, high)
        };
    }
    // A flat scene still needs a block with a volume.
    let least = 1e-2 * (max - min).max_element().max(1e-3);
    let center = (min + max) / 2.0;
    let half = ((max - min) / 2.0).max(DVec3::splat(least));
    let warp = Hexahedron::cuboid(center - half, center + half);
    Level {
        blocks: vec![Block::new(
            shape,
            CubeRotation::IDENTITY,
            warp,
            Vec3::splat(0.5),
        )],
        connections: Vec::new(),
        doors: Vec::new(),
        mesh: None,
    }
}
