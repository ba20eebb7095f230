//! The walls of a shape: flat faces of the cube, or the charts of a round tube (Loos et al. 2011, section 6.1).

use crate::level::shape::Shape;
use crate::level::wall_point::WallPoint;
use glam::DVec3;
use mrt_core::geometry::cube::Face;

impl Shape {
    /// The point at (u, v) in [0, 1]² of a wall. For a tube, v may be outside [0, 1]: the chart continues around the
    /// tube.
    pub fn wall_point(&self, wall: Face, u: f64, v: f64) -> WallPoint {
        match self.tube() {
            None => WallPoint {
                position: wall.point(u, v),
                normal: -wall.outward(),
            },
            Some(form) => {
                let point = form.surface(wall, u, v);
                WallPoint {
                    position: point.position,
                    normal: point.normal,
                }
            }
        }
    }

    /// Index, within a wall, of the texel at (u, v) in [0, 1]²; other values count as the nearest edge.
    pub fn texel_of_uv(resolution: usize, u: f64, v: f64) -> usize {
        let index = |x: f64| ((x * resolution as f64) as usize).min(resolution - 1);
        index(v) * resolution + index(u)
    }

    /// Area of each texel divided by the area of a cube's texel; empty for cubes, where all are 1.
    pub fn relative_texel_areas(&self, resolution: usize) -> Vec<f32> {
        let Some(form) = self.tube() else {
            return Vec::new();
        };
        let of_cube = 1.0 / (resolution * resolution) as f64;
        self.walls()
            .flat_map(|face| (0..resolution).map(move |j| form.texel_area(face, resolution, j)))
            .flat_map(|area| std::iter::repeat_n((area / of_cube) as f32, resolution))
            .collect()
    }

    /// True when a point of the unit cube is inside the walls; points outside a round wall by at most `tolerance` block
    /// widths count as inside.
    pub fn is_inside_walls(&self, unit: DVec3, tolerance: f64) -> bool {
        self.tube()
            .is_none_or(|form| form.wall_distance(unit) >= -tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::shape::SHAPES;
    use mrt_core::geometry::hexahedron::Hexahedron;

    #[test]
    fn texels_are_where_their_uv_is() {
        for shape in &SHAPES {
            for (k, (face, center)) in shape.texels(3).enumerate() {
                let (row, column) = (k % 9 / 3, k % 3);
                let (u, v) = ((column as f64 + 0.5) / 3.0, (row as f64 + 0.5) / 3.0);
                // Roundings of u and v.
                assert!(shape.wall_point(face, u, v).position.distance(center) < 1e-14);
                assert_eq!(Shape::texel_of_uv(3, u, v), k % 9);
                assert!(shape.is_inside_walls(center, 1e-12));
            }
        }
    }

    #[test]
    fn normals_of_warped_walls_are_perpendicular_to_them() {
        let mut warp = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(2.0, 1.0, 0.5));
        warp.corners[3] += DVec3::new(0.1, 0.2, 0.05);
        for shape in SHAPES.iter().filter(|shape| shape.wall_count() > 0) {
            for face in shape.walls() {
                let (step, at) = (1e-6, |u, v| {
                    warp.point(shape.wall_point(face, u, v).position)
                });
                let normal = shape.wall_point(face, 0.3, 0.6).warped_normal(&warp);
                for tangent in [at(0.3 + step, 0.6), at(0.3, 0.6 + step)] {
                    let tangent = (tangent - at(0.3, 0.6)) / step;
                    // A finite difference over curvatures of up to 4.
                    assert!(normal.dot(tangent).abs() < 1e-5, "{} {face}", shape.name);
                }
                assert!(
                    normal.dot(warp.point(DVec3::splat(0.5)) - at(0.3, 0.6)) > 0.0
                        || shape.name == "bend"
                );
            }
        }
    }

    #[test]
    fn areas_add_up_to_the_walls() {
        for shape in &SHAPES {
            let Some(form) = shape.tube() else { continue };
            let areas = shape.relative_texel_areas(8);
            assert_eq!(areas.len(), shape.texel_count(8));
            let sum = f64::from(areas.iter().sum::<f32>()) / 64.0;
            // 256 roundings of f32.
            assert!((sum / form.wall_area() - 1.0).abs() < 1e-5, "{sum}");
        }
    }
}
