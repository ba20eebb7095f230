//! The one-bounce operator F between the walls of one warped block, in closed form (Loos et al. 2011,
//! equation 1, on the warped shapes of section 6.2 and figure 12).
//!
//! A receiver is the image of a texel centre, a source the loop through the images of a texel's four
//! corners. Lambert's formula needs nothing but that loop, planar or not: grid lines of a trilinear face
//! are straight, so neighbouring loops share their edges and leave no gap. Loops that turn their back on
//! the receiver count as nothing.
//!
//! That is exact for affine warps, whose images are convex. Bent faces may hide parts of the block from
//! each other, which is neglected: behind every hidden wall stands the wall that hides it, so such a
//! receiver finds more than a whole hemisphere of walls. By that excess the row is scaled down, which keeps
//! a closed block from gaining energy and makes the error three times smaller. What is left
//! (`tests/tests/warped_bent.rs`): 0.3 % of the first bounce where corners move by 0.3, and 0.6 and 1.9 % for
//! towers twisted by 45 and 70 degrees.

use crate::modular::surface::warped_mirrors::warped_parity_classes;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon};
use mrt_core::geometry::hexahedron::Hexahedron;
use mrt_core::linalg::matrix::Matrix;
use rayon::prelude::*;

/// Fraction of a block's diagonal by which a face may miss its plane and still be called planar.
const PLANAR_TOLERANCE: f64 = 1e-9;

/// Wall faces of a cube with the images of their texels under a warp. Texels are numbered as those of a
/// shape: wall by wall, row by row, column by column.
#[derive(Clone, Debug)]
pub struct WarpedWalls {
    /// Where points of the unit cube go; passes [`Hexahedron::check`].
    pub warp: Hexahedron,
    /// The faces that are there, in the order of [`Face::ALL`].
    pub faces: Vec<Face>,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Images of the texel centres.
    pub centers: Vec<DVec3>,
    /// Unit normals into the block, there.
    pub normals: Vec<DVec3>,
    /// Texel areas: length of the vector area of the loop of their corners.
    pub areas: Vec<f64>,
}

impl WarpedWalls {
    /// Places `resolution`² texels on each face.
    pub fn new(faces: &[Face], resolution: usize, warp: &Hexahedron) -> Self {
        let step = 1.0 / resolution as f64;
        let mut walls = Self {
            warp: *warp,
            faces: faces.to_vec(),
            resolution,
            centers: Vec::new(),
            normals: Vec::new(),
            areas: Vec::new(),
        };
        for &face in faces {
            for k in 0..resolution * resolution {
                let (i, j) = ((k % resolution) as f64, (k / resolution) as f64);
                let (u, v) = ((i + 0.5) * step, (j + 0.5) * step);
                walls.centers.push(warp.point(face.point(u, v)));
                walls.normals.push(warp.face_normal(face, u, v));
                let along = |k: f64| [k * step, (k + 1.0) * step];
                let [a, b, c, d] = face
                    .rectangle(along(i), along(j))
                    .map(|unit| warp.point(unit));
                walls.areas.push((c - a).cross(d - b).length() * 0.5);
            }
        }
        walls
    }

    /// Number of texels.
    pub fn texel_count(&self) -> usize {
        self.centers.len()
    }

    /// Centre of every texel in the unit cube, with its face.
    pub fn unit_texels(&self) -> impl Iterator<Item = (Face, DVec3)> + '_ {
        let resolution = self.resolution;
        self.faces.iter().flat_map(move |&face| {
            (0..resolution * resolution).map(move |k| {
                (
                    face,
                    face.texel_center(resolution, k / resolution, k % resolution),
                )
            })
        })
    }
}

/// F of warped walls, texels x texels.
///
/// Cost: one polygon evaluation for each pair of texels, spread over the threads and divided by the number
/// of the block's own symmetries that are used; 0.25 s for a closed block without any at 16² on two cores.
pub fn warped_bounce(walls: &WarpedWalls) -> Matrix<f64> {
    let classes = warped_parity_classes(walls);
    let orbits: Vec<&[(u32, u32)]> = classes.orbits().collect();
    let receivers: Vec<usize> = orbits.iter().map(|orbit| orbit[0].0 as usize).collect();
    let rows = warped_bounce_rows(walls, &receivers);
    let count = walls.texel_count();
    let mut bounce = Matrix::zeros(count, count);
    for (orbit, row) in orbits.iter().zip(&rows) {
        for &(receiver, element) in *orbit {
            for (source, &factor) in row.iter().enumerate() {
                let image = classes.image(element, source as u32);
                bounce[(receiver as usize, image as usize)] = factor;
            }
        }
    }
    bounce
}

/// Rows of F, one for each of the given receiving texels: factors from all texels to it.
pub fn warped_bounce_rows(walls: &WarpedWalls, receivers: &[usize]) -> Vec<Vec<f64>> {
    let grids: Vec<FaceGrid> = Face::ALL
        .into_iter()
        .map(|face| FaceGrid::new(face, walls))
        .collect();
    receivers
        .par_iter()
        .map_init(Gather::default, |gather, &texel| {
            receiver_row(walls, &grids, texel, gather)
        })
        .collect()
}

/// Images of the corners of all texels of a face.
struct FaceGrid {
    face: Face,
    is_planar: bool,
    /// Sign of Lambert's sum over a loop that faces the receiver.
    facing: f64,
    /// (resolution + 1)² corners, row by row.
    corners: Vec<DVec3>,
}

impl FaceGrid {
    fn new(face: Face, walls: &WarpedWalls) -> Self {
        let lines = walls.resolution + 1;
        let along = |k: usize| k as f64 / walls.resolution as f64;
        let corners = (0..lines * lines)
            .map(|k| {
                walls
                    .warp
                    .point(face.point(along(k % lines), along(k / lines)))
            })
            .collect();
        let [a, b, c, d] = walls.warp.face_corners(face);
        let normal = (c - a).cross(d - b).normalize();
        let mut u = DVec3::ZERO;
        let mut v = DVec3::ZERO;
        u[face.u_axis()] = 1.0;
        v[face.v_axis()] = 1.0;
        Self {
            face,
            is_planar: (b - a).dot(normal).abs() <= PLANAR_TOLERANCE * walls.warp.diagonal(),
            // Seen from inside, a loop that runs around the outward direction runs clockwise.
            facing: u.cross(v).dot(face.outward()),
            corners,
        }
    }
}

/// Scratch of one receiver after another.
#[derive(Default)]
struct Gather {
    /// Corners of one face, from the receiver.
    seen: Vec<DVec3>,
    /// Lambert's terms of the edges along u, and along v.
    along_u: Vec<f64>,
    along_v: Vec<f64>,
    polygon: Vec<DVec3>,
    clipped: Vec<DVec3>,
}

fn receiver_row(
    walls: &WarpedWalls,
    grids: &[FaceGrid],
    texel: usize,
    gather: &mut Gather,
) -> Vec<f64> {
    let per_face = walls.resolution * walls.resolution;
    let own_face = walls.faces[texel / per_face];
    let (point, normal) = (walls.centers[texel], walls.normals[texel]);
    let mut row = vec![0.0; walls.texel_count()];
    let mut behind_openings = vec![0.0; per_face];
    let mut total = 0.0;
    for grid in grids {
        let wall = walls.faces.iter().position(|&face| face == grid.face);
        let out = match wall {
            Some(wall) => &mut row[wall * per_face..][..per_face],
            None => behind_openings.as_mut_slice(),
        };
        if grid.face != own_face {
            gather.face(grid, point, normal, walls.resolution, out);
        } else if !grid.is_planar {
            gather.face(grid, point, normal, walls.resolution, out);
            // Its own loop runs around the point, where Lambert's formula has no meaning.
            out[texel % per_face] = 0.0;
        }
        total += out.iter().sum::<f64>();
    }
    if total > 1.0 && grids.iter().any(|grid| !grid.is_planar) {
        row.iter_mut().for_each(|factor| *factor /= total);
    }
    row
}

impl Gather {
    /// Factors from each texel of a face to a point.
    fn face(
        &mut self,
        grid: &FaceGrid,
        point: DVec3,
        normal: DVec3,
        resolution: usize,
        out: &mut [f64],
    ) {
        let lines = resolution + 1;
        self.seen.clear();
        self.seen.extend(grid.corners.iter().map(|&c| c - point));
        let scale = grid.facing * (0.5 / std::f64::consts::PI);
        if self.seen.iter().any(|to| to.dot(normal) < 0.0) {
            let horizon = HalfSpace {
                normal,
                offset: 0.0,
            };
            for (k, factor) in out.iter_mut().enumerate() {
                let low = k / resolution * lines + k % resolution;
                self.polygon.clear();
                let corners = [low, low + 1, low + lines + 1, low + lines];
                self.polygon.extend(corners.map(|k| self.seen[k]));
                clip_polygon(&mut self.polygon, &horizon, &mut self.clipped);
                *factor = (loop_sum(&self.polygon, normal) * scale).max(0.0);
            }
            return;
        }
        // Each inner edge belongs to two texels.
        self.along_u.clear();
        self.along_v.clear();
        for j in 0..lines {
            for i in 0..resolution {
                let from = j * lines + i;
                let term = edge_term(self.seen[from], self.seen[from + 1], normal);
                self.along_u.push(term);
            }
        }
        for from in 0..resolution * lines {
            let term = edge_term(self.seen[from], self.seen[from + lines], normal);
            self.along_v.push(term);
        }
        for (k, factor) in out.iter_mut().enumerate() {
            let (j, i) = (k / resolution, k % resolution);
            let sum = self.along_u[k] + self.along_v[j * lines + i + 1]
                - self.along_u[k + resolution]
                - self.along_v[j * lines + i];
            *factor = (sum * scale).max(0.0);
        }
    }
}

/// Lambert's sum over a loop, with its sign; corners are relative to the receiver.
fn loop_sum(polygon: &[DVec3], normal: DVec3) -> f64 {
    let ends = polygon.iter().skip(1).chain(polygon.first());
    polygon
        .iter()
        .zip(ends)
        .map(|(&from, &to)| edge_term(from, to, normal))
        .sum()
}

/// The angle that an edge subtends times the part along `normal` of the unit normal of the plane through
/// it and the receiver.
fn edge_term(from: DVec3, to: DVec3, normal: DVec3) -> f64 {
    let across = from.cross(to);
    let sine = across.length();
    // An edge that the receiver lies in line with subtends no area.
    if sine > 0.0 {
        libm::atan2(sine, from.dot(to)) * across.dot(normal) / sine
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
    use crate::progress::Progress;
    use glam::DMat3;

    fn sheared() -> Hexahedron {
        let shear = DMat3::from_cols(
            DVec3::new(1.0, 0.0, 0.0),
            DVec3::new(0.5, 1.2, 0.1),
            DVec3::new(-0.2, 0.3, 3.0),
        );
        Hexahedron {
            corners: std::array::from_fn(|k| shear * Hexahedron::unit_corner(k)),
        }
    }

    /// Corners moved by at most 0.2 along each axis.
    fn bent() -> Hexahedron {
        Hexahedron {
            corners: std::array::from_fn(|k| {
                let moved = |axis: usize| ((7 * k + 3 * axis + k * axis) % 5) as f64 * 0.1 - 0.2;
                Hexahedron::unit_corner(k) + DVec3::new(moved(0), moved(1), moved(2))
            }),
        }
    }

    fn row_sum(bounce: &Matrix<f64>, i: usize) -> f64 {
        (0..bounce.columns()).map(|j| bounce[(i, j)]).sum()
    }

    #[test]
    fn the_identity_gives_the_canonical_operator() {
        let cube = closed_cube_bounce(5, Reconstruction::Constant, &Progress::silent())
            .expect("nobody cancels");
        let walls = WarpedWalls::new(&Face::ALL, 5, &Hexahedron::cell(DVec3::ZERO));
        for (a, b) in warped_bounce(&walls).data().iter().zip(cube.data()) {
            // Shared edges cancel in another order: roundings of angles of order one.
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
    }

    #[test]
    fn affine_images_gather_all_light_and_respect_reciprocity() {
        let walls = WarpedWalls::new(&Face::ALL, 12, &sheared());
        let bounce = warped_bounce(&walls);
        let mut exchanged = [[0.0; 6]; 6];
        for i in 0..bounce.rows() {
            // Sums of 5 * 144 factors.
            assert!((row_sum(&bounce, i) - 1.0).abs() < 1e-12);
            for j in 0..bounce.columns() {
                exchanged[i / 144][j / 144] += walls.areas[i] * bounce[(i, j)];
            }
        }
        for (a, b) in (0..6).flat_map(|a| (0..a).map(move |b| (a, b))) {
            let [there, back] = [exchanged[a][b], exchanged[b][a]];
            // Exact between areas; a receiver is a point here, which neighbours across an edge notice.
            assert!((there / back - 1.0).abs() < 0.02, "{there} {back}");
        }
    }

    #[test]
    fn openings_take_what_the_walls_do_not_send() {
        let all = WarpedWalls::new(&Face::ALL, 6, &sheared());
        let closed = warped_bounce(&all);
        let faces = [Face::NegX, Face::NegY, Face::PosY, Face::PosZ];
        let open = WarpedWalls::new(&faces, 6, &sheared());
        let kept: Vec<usize> = faces
            .iter()
            .flat_map(|face| face.index() * 36..(face.index() + 1) * 36)
            .collect();
        let bounce = warped_bounce(&open);
        for (i, &row) in kept.iter().enumerate() {
            let to_openings: f64 = (0..216)
                .filter(|column| !kept.contains(column))
                .map(|column| closed[(row, column)])
                .sum();
            assert!((row_sum(&bounce, i) + to_openings - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn bent_blocks_gain_no_energy_and_lose_little() {
        let walls = WarpedWalls::new(&Face::ALL, 8, &bent());
        assert_eq!(walls.warp.check(), Ok(()));
        let bounce = warped_bounce(&walls);
        for i in 0..bounce.rows() {
            let sum = row_sum(&bounce, i);
            // What is missing is the receiver's own texel and what it cuts of its neighbours.
            assert!(sum < 1.0 + 1e-12 && sum > 0.97, "row {i}: {sum}");
        }
    }
}
