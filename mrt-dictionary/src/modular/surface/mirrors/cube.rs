//! The mirrors that leave a canonical shape as it is, acting on its texels and on the samples of its probes.

use crate::modular::surface::probes::{DIRECTIONS, probe_points, probe_sample, probe_sample_count};
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::parity::ParityClasses;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::mirrors::{mirrors, texel_permutation};

/// Parity classes of the shape's texels: eight for the closed cube, straight and cross, four for most other shapes.
pub fn texel_parity_classes(shape: &Shape, resolution: usize) -> ParityClasses {
    output_parity_classes(shape, resolution, 0)
}

/// Parity classes of the shape's texels followed by the samples of its `probes`³ probes, in the order of
/// [`probe_sample`].
pub fn output_parity_classes(shape: &Shape, resolution: usize, probes: usize) -> ParityClasses {
    let permutations: Vec<Vec<u32>> = mirrors(shape)
        .into_iter()
        .map(|map| output_permutation(shape, resolution, probes, map))
        .collect();
    let count = shape.texel_count(resolution) + probe_sample_count(probes);
    ParityClasses::new(count, &permutations)
}

/// Where a symmetry of the shape takes its texels and the samples of its probes.
///
/// # Panics
/// If the symmetry does not keep the shape.
pub fn output_permutation(
    shape: &Shape,
    resolution: usize,
    probes: usize,
    map: CubeSymmetry,
) -> Vec<u32> {
    let texels = texel_permutation(shape, resolution, map);
    let first_sample = texels.len();
    let samples = probe_points(probes).flat_map(|point| {
        DIRECTIONS.iter().map(move |direction| {
            let direction = map.direction(direction.as_dvec3()).as_ivec3();
            (first_sample + probe_sample(map.point(point), direction, probes)) as u32
        })
    });
    texels.iter().copied().chain(samples).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_runtime::low_level::level::shape::cubes;

    #[test]
    fn each_shape_has_the_classes_of_its_symmetry() {
        let factors: Vec<(&str, usize)> = cubes()
            .filter(|shape| shape.wall_count() > 0)
            .map(|shape| (shape.name, texel_parity_classes(shape, 4).class_count()))
            .collect();
        let expected = [
            ("closed", 8),
            ("dead_end", 4),
            ("straight", 8),
            ("corner", 4),
            ("tee", 4),
            ("cross", 8),
            ("corner_up", 2),
            ("tee_up", 4),
            ("floor", 4),
            ("door", 2),
            ("window", 2),
            ("doorway", 2),
            ("window_end", 2),
        ];
        assert_eq!(factors, expected);
    }

    #[test]
    fn probes_follow_the_mirrors() {
        for shape in cubes() {
            let texels = shape.texel_count(4);
            let classes = output_parity_classes(shape, 4, 2);
            assert_eq!(classes.point_count(), texels + 8 * DIRECTIONS.len());
        }
    }
}
