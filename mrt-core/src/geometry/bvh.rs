//! Ray casting against triangle meshes, through obvhs.
//!
//! The answers depend neither on the machine nor on the shape of the tree. Triangles are intersected in
//! `f64` by exactly rounded operations. Boxes are padded by more than the rounding of their tests. Of hits
//! at equal distance, the triangle with the smallest index wins. Rays through an edge or a vertex that
//! triangles share always hit one of them (S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle
//! Intersection", Journal of Computer Graphics Techniques 2(1), 2013).

use crate::geometry::mesh::TriangleMesh;
use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2, node::Bvh2Node};
use obvhs::fast_stack;
use obvhs::ray::{Ray, RayHit};

/// Triangles with a coordinate beyond this are left out, because areas of boxes would overflow.
pub const MAX_COORDINATE: f32 = 1e15;

/// The triangles of a mesh in a tree of boxes.
pub struct Bvh {
    tree: Bvh2,
    /// Corners of the triangles, in the order of the tree's leaves.
    corners: Vec<[Vec3; 3]>,
    /// Indices of these triangles in the mesh.
    mesh_triangles: Vec<u32>,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle in the mesh.
    pub triangle: u32,
    /// Distance from the origin, in lengths of the direction.
    pub t: f32,
    /// Weight of the triangle's second corner, in [0, 1].
    pub u: f32,
    /// Weight of the third corner, in [0, 1]. The first corner has 1 - u - v.
    pub v: f32,
}

impl Bvh {
    /// Builds the tree, on the calling thread.
    ///
    /// Triangles that no ray can hit are left out: those without area, with a vertex that does not exist,
    /// or with a coordinate that is NaN or beyond [`MAX_COORDINATE`]. Without triangles every ray misses.
    ///
    /// Cost: about a second for a million triangles.
    pub fn build(mesh: &TriangleMesh) -> Self {
        let (mut corners, mut mesh_triangles) = (Vec::new(), Vec::new());
        for (index, vertices) in mesh.triangles.iter().enumerate() {
            let found = vertices.map(|vertex| mesh.positions.get(vertex as usize).copied());
            if let [Some(a), Some(b), Some(c)] = found
                && can_be_hit([a, b, c])
            {
                corners.push([a, b, c]);
                mesh_triangles.push(index as u32);
            }
        }
        let padding = box_padding(&corners);
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|&[a, b, c]| Aabb {
                min: (a.min(b).min(c) - padding).into(),
                max: (a.max(b).max(c) + padding).into(),
            })
            .collect();
        let parameters = BvhBuildParams::medium_build();
        let mut tree = build_bvh2(&boxes, parameters, &mut std::time::Duration::default());
        if !tree.nodes.is_empty() {
            // obvhs sizes its traversal stack by the depth, which the build does not update.
            tree.max_depth = tree.max_depth.max(tree.depth(0) + 1);
        }
        let order = std::mem::take(&mut tree.primitive_indices);
        Self {
            tree,
            corners: order.iter().map(|&k| corners[k as usize]).collect(),
            mesh_triangles: order.iter().map(|&k| mesh_triangles[k as usize]).collect(),
        }
    }

    /// Number of triangles that can be hit.
    pub fn triangle_count(&self) -> usize {
        self.corners.len()
    }

    /// The nearest hit with 0 < t < `t_max`, from either side.
    ///
    /// `direction` need not have unit length. A ray that starts on a triangle may hit it again at a tiny t,
    /// so start a little off the surface. Rays should start within about ten sizes of the mesh; from
    /// farther away they may slip past the edge of a box. A ray that is not finite or has no direction
    /// hits nothing.
    pub fn closest_hit(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Hit> {
        let sheared = ShearedRay::new(origin, direction)?;
        let mut closest: Option<Hit> = None;
        // In the closest hit of obvhs the order of the tree chooses between equal distances.
        let visit_leaf = |leaf: &Bvh2Node, ray: &mut Ray, _: &mut RayHit| {
            let first = leaf.first_index as usize;
            for k in first..first + leaf.prim_count as usize {
                let Some((t, u, v)) = sheared.intersect(&self.corners[k]) else {
                    continue;
                };
                let triangle = self.mesh_triangles[k];
                let nearer = match closest {
                    None => t < t_max,
                    Some(hit) => (t, triangle) < (hit.t, hit.triangle),
                };
                if nearer {
                    closest = Some(Hit { triangle, t, u, v });
                    // The next larger number, so that a box at the same distance is still opened.
                    ray.tmax = t.next_up();
                }
            }
            true
        };
        let (ray, mut ignored) = (box_ray(origin, direction, t_max), RayHit::none());
        fast_stack!(u32, (96, 192), self.tree.max_depth, stack, {
            self.tree
                .ray_traverse_dynamic(&mut stack, ray, &mut ignored, visit_leaf);
        });
        closest
    }

    /// True if any triangle is hit with 0 < t < `t_max`, which is if [`Bvh::closest_hit`] finds a hit. Stops
    /// at the first hit.
    pub fn is_occluded(&self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        let Some(sheared) = ShearedRay::new(origin, direction) else {
            return false;
        };
        let missed = |_: &Ray, k: usize| {
            sheared
                .intersect(&self.corners[k])
                .map_or(f32::INFINITY, |(t, ..)| t)
        };
        let ray = box_ray(origin, direction, t_max);
        !self.tree.ray_traverse_miss(ray, missed)
    }
}

/// A ray, and the shear that makes it start at zero and run along z (Woop et al., section 3).
struct ShearedRay {
    origin: DVec3,
    /// The axis of the direction's largest component, which becomes z, then the two others.
    axes: [usize; 3],
    /// The slopes of x and y along z, and the inverse of the largest component.
    shear: DVec3,
}

impl ShearedRay {
    fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        if !(origin.is_finite() && direction.is_finite()) || direction == Vec3::ZERO {
            return None;
        }
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let d = direction.as_dvec3();
        Some(Self {
            origin: origin.as_dvec3(),
            axes: [z, x, y],
            shear: DVec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        })
    }

    /// t > 0 and the weights of the second and third corner, if the triangle is hit.
    ///
    /// The sign of an edge function is that of a difference of two rounded products. Their factors belong to
    /// one corner each, so neighbours agree on the sign. It is right or zero, and zero counts as inside.
    fn intersect(&self, corners: &[Vec3; 3]) -> Option<(f32, f32, f32)> {
        let [z, x, y] = self.axes;
        let [a, b, c] = corners.map(|corner| {
            let p = corner.as_dvec3() - self.origin;
            let along = p[z];
            DVec3::new(
                p[x] - self.shear.x * along,
                p[y] - self.shear.y * along,
                along,
            )
        });
        let opposite_a = c.x * b.y - c.y * b.x;
        let opposite_b = a.x * c.y - a.y * c.x;
        let opposite_c = b.x * a.y - b.y * a.x;
        let least = opposite_a.min(opposite_b).min(opposite_c);
        let most = opposite_a.max(opposite_b).max(opposite_c);
        if least < 0.0 && most > 0.0 {
            return None;
        }
        let sum = opposite_a + opposite_b + opposite_c;
        // The sum is zero if the ray runs in the triangle's plane.
        if sum == 0.0 {
            return None;
        }
        let along = opposite_a * a.z + opposite_b * b.z + opposite_c * c.z;
        let t = (along / sum * self.shear.z) as f32;
        (t > 0.0).then(|| (t, (opposite_b / sum) as f32, (opposite_c / sum) as f32))
    }
}

/// The ray for box tests.
///
/// `Ray::new` would replace every component below 1e-7 by 1e-7, and a short direction would miss its
/// boxes. The bound here keeps 0 times the inverse from becoming NaN.
fn box_ray(origin: Vec3, direction: Vec3, t_max: f32) -> Ray {
    let inverse = |x: f32| (1.0 / x).clamp(-1e37, 1e37);
    Ray {
        origin: origin.into(),
        direction: direction.into(),
        inv_direction: Vec3::from_array(direction.to_array().map(inverse)).into(),
        tmin: 0.0,
        tmax: t_max,
    }
}

/// How far boxes reach beyond their triangles.
///
/// A box test rounds three times, so it errs by 3 * 2^-24 of the distance. 4e-6 of the size of the mesh
/// covers rays as long as about ten sizes, with an error at both ends. Far from zero, the padding must also
/// be large enough to change a coordinate that it is added to. Padding makes flat boxes solid too, so a
/// ray within the face of a box is inside it.
fn box_padding(corners: &[[Vec3; 3]]) -> f32 {
    let Some(&[first, ..]) = corners.first() else {
        return 0.0;
    };
    let (mut low, mut high) = (first, first);
    for &corner in corners.iter().flatten() {
        (low, high) = (low.min(corner), high.max(corner));
    }
    let size = (high - low).max_element();
    let farthest = low.abs().max(high.abs()).max_element();
    (4e-6 * size + 2.0 * f32::EPSILON * farthest).max(1e-30)
}

/// True for triangles that have an area and no coordinate beyond [`MAX_COORDINATE`].
fn can_be_hit(corners: [Vec3; 3]) -> bool {
    // Written so that NaN fails.
    let in_range = |p: Vec3| p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all();
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    corners.into_iter().all(in_range) && (b - a).cross(c - a) != DVec3::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lighting::sampling::{hash, sobol_point, sphere_from_square, square_from_unit};

    /// Fixed pseudo-random numbers in [-1, 1].
    fn noise(k: u32, seed: u32) -> f32 {
        (f64::from(hash(k, seed)) / f64::from(u32::MAX) * 2.0 - 1.0) as f32
    }

    fn noise_point(k: u32, seed: u32) -> Vec3 {
        Vec3::new(
            noise(3 * k, seed),
            noise(3 * k + 1, seed),
            noise(3 * k + 2, seed),
        )
    }

    fn direction(k: u32, seed: u32) -> Vec3 {
        sphere_from_square(square_from_unit(sobol_point(k, seed))).as_vec3()
    }

    /// `count` random triangles of about the given size, spread over [-1, 1]³.
    fn soup(count: u32, size: f32, seed: u32) -> TriangleMesh {
        let corner = |k: u32| noise_point(k / 3, seed) + size * noise_point(k, seed + 1);
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        TriangleMesh::from_triangles((0..3 * count).map(corner).collect(), triangles)
    }

    /// The closest hit from all triangles in turn.
    fn brute_force(mesh: &TriangleMesh, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Hit> {
        let sheared = ShearedRay::new(origin, direction)?;
        let mut closest: Option<Hit> = None;
        for triangle in 0..mesh.triangles.len() {
            if let Some((t, u, v)) = sheared.intersect(&mesh.corners(triangle))
                && t < closest.map_or(t_max, |hit| hit.t)
            {
                let triangle = triangle as u32;
                closest = Some(Hit { triangle, t, u, v });
            }
        }
        closest
    }

    fn assert_like_brute_force(mesh: &TriangleMesh, bvh: &Bvh, origin: Vec3, d: Vec3, t_max: f32) {
        let expected = brute_force(mesh, origin, d, t_max);
        assert_eq!(
            bvh.closest_hit(origin, d, t_max),
            expected,
            "{origin} {d} {t_max}"
        );
        assert_eq!(bvh.is_occluded(origin, d, t_max), expected.is_some());
    }

    /// A flat n x n grid of squares in y = 0, two triangles each.
    fn floor(n: u32) -> TriangleMesh {
        let vertex = |i: u32, j: u32| j * (n + 1) + i;
        let cells = (0..n * n).map(|k| (k % n, k / n));
        let triangles = cells
            .flat_map(|(i, j)| {
                let quad = [
                    vertex(i, j),
                    vertex(i, j + 1),
                    vertex(i + 1, j + 1),
                    vertex(i + 1, j),
                ];
                [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
            })
            .collect();
        let place = |k: u32| Vec3::new((k % (n + 1)) as f32, 0.0, (k / (n + 1)) as f32) / n as f32;
        TriangleMesh::from_triangles((0..(n + 1) * (n + 1)).map(place).collect(), triangles)
    }

    #[test]
    fn random_rays_agree_with_brute_force() {
        for (count, size) in [(1, 0.5), (2, 0.5), (13, 0.3), (700, 0.1), (700, 1e-3)] {
            let mesh = soup(count, size, 100 + count);
            let bvh = Bvh::build(&mesh);
            assert_eq!(bvh.triangle_count(), count as usize);
            for k in 0..1000 {
                let origin = 2.0 * noise_point(k, 5);
                let t_max = [f32::INFINITY, 0.7][k as usize % 2];
                assert_like_brute_force(&mesh, &bvh, origin, direction(k, 1), t_max);
            }
        }
    }

    #[test]
    fn rays_at_vertices_edges_and_along_axes_agree_with_brute_force() {
        let mesh = floor(7);
        let bvh = Bvh::build(&mesh);
        let mut targets = mesh.positions.clone();
        targets.extend(mesh.triangles.iter().flat_map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            [a.lerp(b, 0.5), b.lerp(c, 0.25), c.lerp(a, 1.0 / 3.0)]
        }));
        for (k, target) in targets.into_iter().enumerate() {
            let above = target + Vec3::Y;
            assert_like_brute_force(&mesh, &bvh, above, Vec3::NEG_Y, f32::INFINITY);
            // Straight down on the sheet, rim and corners included, no ray passes between triangles.
            let hit = bvh.closest_hit(above, Vec3::NEG_Y, 2.0).unwrap();
            assert_eq!(hit.t, 1.0);
            let origin = noise_point(k as u32, 3) + 2.0 * Vec3::Y;
            assert_like_brute_force(&mesh, &bvh, origin, target - origin, 10.0);
            // A ray within the plane of the sheet sees no area.
            assert_eq!(bvh.closest_hit(target - Vec3::X, Vec3::X, 9.0), None);
        }
    }

    #[test]
    fn no_ray_passes_between_triangles() {
        let mesh = floor(9);
        let bvh = Bvh::build(&mesh);
        for k in 0..4000 {
            // Rays aim at shared edges from skew origins, so that no coordinate is exact.
            let triangle = hash(k, 1) as usize % mesh.triangles.len();
            let [a, b, _] = mesh.corners(triangle);
            let target = a.lerp(b, 0.5 + 0.5 * noise(k, 2));
            let rim = [target.x, target.z].map(|x| !(1e-3..=0.999).contains(&x));
            if rim.contains(&true) {
                continue;
            }
            let origin = noise_point(k, 7) + 1.5 * Vec3::Y;
            assert!(
                bvh.is_occluded(origin, target - origin, 1.1),
                "towards {target}"
            );
        }
    }

    #[test]
    fn a_hit_lies_where_its_weights_say() {
        let mesh = soup(300, 0.4, 9);
        let bvh = Bvh::build(&mesh);
        let mut hits = 0;
        for k in 0..500 {
            let (origin, d) = (noise_point(k, 8), direction(k, 2));
            if let Some(hit) = bvh.closest_hit(origin, d, f32::INFINITY) {
                let [a, b, c] = mesh.corners(hit.triangle as usize);
                let on_triangle = (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c;
                // A few roundings of `f32` in numbers up to 3.
                assert!((origin + hit.t * d - on_triangle).length() < 2e-6);
                hits += 1;
            }
        }
        assert!(hits > 250, "{hits}");
    }

    #[test]
    fn the_length_of_the_direction_only_scales_t() {
        let mesh = soup(200, 0.3, 4);
        let bvh = Bvh::build(&mesh);
        for k in 0..300 {
            let (origin, d) = (noise_point(k, 6), direction(k, 3));
            let unit = bvh.closest_hit(origin, d, f32::INFINITY);
            for power in [-40, -20, 20] {
                let scale = 2f32.powi(power);
                let scaled = bvh.closest_hit(origin, scale * d, f32::INFINITY);
                let expected = unit.map(|hit| Hit {
                    t: hit.t / scale,
                    ..hit
                });
                assert_eq!(scaled, expected);
            }
        }
    }

    #[test]
    fn the_interval_is_open_at_both_ends() {
        let mesh = floor(1);
        let bvh = Bvh::build(&mesh);
        let above = Vec3::new(0.3, 1.0, 0.4);
        assert!(!bvh.is_occluded(above, Vec3::NEG_Y, 1.0));
        assert_eq!(bvh.closest_hit(above, Vec3::NEG_Y, 1.0), None);
        assert!(bvh.is_occluded(above, Vec3::NEG_Y, 1.0f32.next_up()));
        let on_it = Vec3::new(0.3, 0.0, 0.4);
        assert!(!bvh.is_occluded(on_it, Vec3::Y, 9.0));
        assert!(!bvh.is_occluded(above, Vec3::NEG_Y, 0.0));
    }

    #[test]
    fn of_equal_hits_the_smallest_index_wins() {
        let one = soup(40, 0.8, 21);
        let mut twice = one.clone();
        twice.triangles.extend(one.triangles.iter().copied());
        let bvh = Bvh::build(&twice);
        for k in 0..500 {
            let (origin, d) = (noise_point(k, 12), direction(k, 4));
            let expected = brute_force(&one, origin, d, f32::INFINITY);
            assert_eq!(bvh.closest_hit(origin, d, f32::INFINITY), expected);
        }
    }

    #[test]
    fn a_mesh_far_from_zero_is_still_hit() {
        let mut mesh = floor(4);
        for position in &mut mesh.positions {
            *position += Vec3::new(5000.0, 0.0, -3000.0);
        }
        let bvh = Bvh::build(&mesh);
        for k in 0..200 {
            let target = mesh.positions[k % mesh.positions.len()];
            let origin = target + noise_point(k as u32, 2) + 1.5 * Vec3::Y;
            assert_like_brute_force(&mesh, &bvh, origin, target - origin, 2.0);
        }
    }

    #[test]
    fn empty_and_broken_meshes_are_missed() {
        let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let broken = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| {
            let bvh = Bvh::build(&TriangleMesh::from_triangles(positions, triangles));
            assert_eq!(bvh.triangle_count(), 0);
            assert_eq!(bvh.closest_hit(Vec3::Z, Vec3::NEG_Z, f32::INFINITY), None);
            assert!(!bvh.is_occluded(Vec3::Z, Vec3::NEG_Z, f32::INFINITY));
        };
        broken(vec![], vec![]);
        broken(good.to_vec(), vec![]);
        broken(good.to_vec(), vec![[0, 1, 3], [0, 1, 1]]);
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            broken(vec![Vec3::ZERO, Vec3::splat(bad), Vec3::Y], vec![[0, 1, 2]]);
        }
        let bvh = Bvh::build(&TriangleMesh::from_triangles(
            good.to_vec(),
            vec![[0, 1, 2]],
        ));
        for bad in [
            Vec3::ZERO,
            Vec3::splat(f32::NAN),
            Vec3::splat(f32::INFINITY),
        ] {
            assert_eq!(bvh.closest_hit(Vec3::Z, bad, f32::INFINITY), None);
            assert!(!bvh.is_occluded(Vec3::splat(f32::NAN), bad, f32::INFINITY));
        }
        assert!(!bvh.is_occluded(Vec3::Z, Vec3::NEG_Z, f32::NAN));
    }

    #[test]
    fn meshes_of_extreme_size_and_with_many_copies_are_hit() {
        for scale in [1e-36, 1e-20, 1e14] {
            let mut mesh = soup(200, 0.5, 31);
            for position in &mut mesh.positions {
                *position *= scale;
            }
            let bvh = Bvh::build(&mesh);
            let target = mesh.corners(0).iter().sum::<Vec3>() / 3.0;
            let origin = target + scale * Vec3::new(0.1, 3.0, 0.2);
            assert!(
                bvh.is_occluded(origin, target - origin, 1.5),
                "scale {scale}"
            );
        }
        let copies =
            TriangleMesh::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]; 5000]);
        let hit = Bvh::build(&copies).closest_hit(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, 2.0);
        assert_eq!(hit.map(|hit| hit.triangle), Some(0));
    }
}
