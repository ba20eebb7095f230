//! Texels of the walls of a canonical cube, and the holes in them.

use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::Outline;

/// Index of the shape's texel at a point of a face; `None` if that face is missing.
pub fn texel_at(shape: &Shape, face: Face, point: DVec3, resolution: usize) -> Option<usize> {
    let offset = shape.wall_offset(face, resolution)?;
    Some(offset + face.texel_index(point, resolution))
}

/// Corners (0,0), (1,0), (1,1), (0,1) in (u, v) of the texel with the given centre.
pub fn texel_corners(face: Face, center: DVec3, resolution: usize) -> [DVec3; 4] {
    let half = 0.5 / resolution as f64;
    let along = |axis: usize| [center[axis] - half, center[axis] + half];
    face.rectangle(along(face.u_axis()), along(face.v_axis()))
}

/// The frame in which the vector irradiance of a face's texels is stored: along u, along v, along the inward normal.
pub fn texel_axes(face: Face) -> [DVec3; 3] {
    let axis = |k: usize| DVec3::AXES[k];
    [axis(face.u_axis()), axis(face.v_axis()), -face.outward()]
}

/// Corners of the part of a texel that is in the hole of its wall; `None` if there is no such part.
pub fn part_in_hole(
    shape: &Shape,
    face: Face,
    center: DVec3,
    resolution: usize,
) -> Option<[DVec3; 4]> {
    let Outline::Hole(hole) = shape.opening(face)?.outline else {
        return None;
    };
    let half = 0.5 / resolution as f64;
    let overlap = |axis: usize, [low, high]: [f64; 2]| {
        [low.max(center[axis] - half), high.min(center[axis] + half)]
    };
    let [u, v] = hole.rectangle();
    let (u, v) = (overlap(face.u_axis(), u), overlap(face.v_axis(), v));
    (u[0] < u[1] && v[0] < v[1]).then(|| face.rectangle(u, v))
}

/// Fraction of a texel, in [0, 1], that no hole takes away.
pub fn wall_fraction(shape: &Shape, face: Face, center: DVec3, resolution: usize) -> f64 {
    let Some([a, b, _, d]) = part_in_hole(shape, face, center, resolution) else {
        return 1.0;
    };
    let area = (b - a).length() * (d - a).length() * (resolution * resolution) as f64;
    (1.0 - area).max(0.0)
}
