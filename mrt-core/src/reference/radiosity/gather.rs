//! Computes a row of the transport: a cone from the receiver through the openings of a level.

use super::row::{NearSender, Row};
use super::scene::{ExactScene, Side, Wall, winding};
use crate::geometry::form_factor::{HalfSpace, clip_polygon, cone_through, point_to_polygon};
use glam::DVec3;

/// How far outside a cone a corner may lie, in metres, and still count as inside.
const INSIDE_TOLERANCE: f64 = 1e-12;
/// Fraction of the hemisphere below which an opening is not looked through.
const SMALLEST_OPENING: f64 = 1e-12;
/// Corners of a clipped opening that are closer than this, in metres, count as one. The direction of
/// the plane through the eye and both of them would be made of rounding.
const CORNER_MERGE: f64 = 1e-10;
/// Distance, in texels, below which the quarters of a sender count one by one.
///
/// With whole texels only, lights near a wall err by 0.7 % at 16², most of it next to the spot below
/// the light. With quarters up to 6 texels away the reference cube errs by 0.19 %, up to 9 by 0.16 %, up
/// to 14 by 0.14 %, and memory grows.
const NEAR: f64 = 8.0;
/// Most half-spaces of a cone: each has a bit in a corner's `outside`. An opening that is seen through
/// any number of quadrilateral openings has far fewer edges.
const MAX_PLANES: usize = 32;

/// Texel corners of every wall of a level.
pub(super) fn wall_grids(scene: &ExactScene) -> Vec<Vec<DVec3>> {
    scene.walls.iter().map(|wall| grid(scene, wall)).collect()
}

/// The (resolution + 1)² texel corners of a wall, row v, column u.
fn grid(scene: &ExactScene, wall: &Wall) -> Vec<DVec3> {
    let resolution = scene.resolution;
    let step = 1.0 / resolution as f64;
    let corner = |k: usize| {
        let (j, i) = (k / (resolution + 1), k % (resolution + 1));
        scene.blocks[wall.block].point(wall.face.point(i as f64 * step, j as f64 * step))
    };
    (0..(resolution + 1) * (resolution + 1))
        .map(corner)
        .collect()
}

/// The state of one thread while it computes rows.
pub(super) struct Gather<'a> {
    scene: &'a ExactScene,
    /// From [`wall_grids`].
    grids: &'a [Vec<DVec3>],
    /// Walls of each block.
    walls_of: Vec<Vec<usize>>,
    /// The row, dense. Only walls in `touched` hold anything but zeros.
    factors: Vec<f64>,
    touched: Vec<bool>,
    near: Vec<NearSender>,
    /// Blocks that the current cone has passed.
    path: Vec<usize>,
    /// For each texel corner of a wall: bit k is set outside half-space k of the cone.
    outside: Vec<u32>,
    /// [`edge_integral`] of the texel edges along u and along v; NaN where it is not yet computed.
    edges_u: Vec<f64>,
    edges_v: Vec<f64>,
    polygon: Vec<DVec3>,
    scratch: Vec<DVec3>,
}

/// The receiver of a row.
#[derive(Clone, Copy)]
struct Eye {
    point: DVec3,
    normal: DVec3,
    /// The receiver's wall if it is planar: it cannot see itself.
    hidden_wall: Option<usize>,
    /// The receiver's texel.
    texel: usize,
}

impl<'a> Gather<'a> {
    pub(super) fn new(scene: &'a ExactScene, grids: &'a [Vec<DVec3>]) -> Self {
        let resolution = scene.resolution;
        let mut walls_of = vec![Vec::new(); scene.blocks.len()];
        for (index, wall) in scene.walls.iter().enumerate() {
            walls_of[wall.block].push(index);
        }
        Self {
            scene,
            grids,
            walls_of,
            factors: vec![0.0; scene.texel_count()],
            touched: vec![false; scene.walls.len()],
            near: Vec::new(),
            path: Vec::new(),
            outside: vec![0; (resolution + 1) * (resolution + 1)],
            edges_u: vec![0.0; resolution * (resolution + 1)],
            edges_v: vec![0.0; resolution * (resolution + 1)],
            polygon: Vec::new(),
            scratch: Vec::new(),
        }
    }

    /// The form factors from the centre of a texel.
    pub(super) fn row(&mut self, texel: usize) -> Row {
        let wall_index = texel / (self.scene.resolution * self.scene.resolution);
        let wall = self.scene.walls[wall_index];
        let is_planar = self.scene.facets[wall.block][wall.face.index()].len() == 1;
        let eye = Eye {
            point: self.scene.centers[texel],
            normal: self.scene.normals[texel],
            hidden_wall: is_planar.then_some(wall_index),
            texel,
        };
        let horizon = HalfSpace::through(eye.point, eye.normal);
        self.visit(wall.block, eye, &[horizon]);
        self.take_row()
    }

    /// Adds what is seen inside `cone` of a block and of the blocks behind it.
    fn visit(&mut self, block: usize, eye: Eye, cone: &[HalfSpace]) {
        for k in 0..self.walls_of[block].len() {
            let wall = self.walls_of[block][k];
            if eye.hidden_wall != Some(wall) {
                self.add_wall(wall, eye, cone);
            }
        }
        self.path.push(block);
        let scene = self.scene;
        for (side, facets) in scene.sides[block].iter().zip(&scene.facets[block]) {
            let Side::Opening(next, _) = *side else {
                continue;
            };
            // A straight ray meets a convex block once.
            if self.path.contains(&next) {
                continue;
            }
            for facet in facets {
                let mut portal = facet.polygon.clone();
                for half_space in cone {
                    clip_polygon(&mut portal, half_space, &mut self.scratch);
                }
                merge_corners(&mut portal);
                let fraction = point_to_polygon(eye.point, eye.normal, &portal);
                if portal.len() < 3 || fraction < SMALLEST_OPENING {
                    continue;
                }
                let mut narrowed = Vec::with_capacity(portal.len());
                cone_through(eye.point, &portal, &mut narrowed);
                narrowed.truncate(MAX_PLANES);
                self.visit(next, eye, &narrowed);
            }
        }
        self.path.pop();
    }

    /// Adds the part of a wall that is inside `cone`.
    fn add_wall(&mut self, wall_index: usize, eye: Eye, cone: &[HalfSpace]) {
        if !self.mark_outside(wall_index, cone) {
            return;
        }
        self.touched[wall_index] = true;
        self.edges_u.fill(f64::NAN);
        self.edges_v.fill(f64::NAN);
        let resolution = self.scene.resolution;
        let stride = resolution + 1;
        let first_texel = self.scene.walls[wall_index].first_texel;
        let grid = &self.grids[wall_index];
        for j in 0..resolution {
            for i in 0..resolution {
                let texel = first_texel + j * resolution + i;
                let loop_of = [0, 1, stride + 1, stride].map(|offset| j * stride + i + offset);
                let bits = loop_of.map(|corner| self.outside[corner]);
                let is_outside = bits[0] & bits[1] & bits[2] & bits[3] != 0;
                if is_outside || texel == eye.texel {
                    continue;
                }
                let is_whole = bits == [0; 4];
                let cone = if is_whole { &[] } else { cone };
                let corners = loop_of.map(|corner| grid[corner]);
                if self.is_near(eye, texel) {
                    self.add_near(texel, eye, corners, cone);
                }
                self.factors[texel] += if is_whole {
                    self.whole_factor(wall_index, [j, i], eye)
                } else {
                    self.clipped_factor(eye, corners, cone)
                };
            }
        }
    }

    /// Fills `outside` for a wall. False, without filling it, if the whole wall is outside a half-space
    /// of the cone.
    fn mark_outside(&mut self, wall_index: usize, cone: &[HalfSpace]) -> bool {
        let resolution = self.scene.resolution;
        let stride = resolution + 1;
        let grid = &self.grids[wall_index];
        let outline = [0, resolution, stride * stride - 1, stride * resolution];
        let is_outside = |corner: DVec3, half: &HalfSpace| half.side(corner) < -INSIDE_TOLERANCE;
        let mut cuts = false;
        for half in cone {
            let count = outline
                .iter()
                .filter(|&&corner| is_outside(grid[corner], half))
                .count();
            if count == 4 {
                return false;
            }
            cuts |= count > 0;
        }
        self.outside.fill(0);
        if cuts {
            for (outside, &corner) in self.outside.iter_mut().zip(grid) {
                for (bit, half) in cone.iter().enumerate() {
                    *outside |= u32::from(is_outside(corner, half)) << bit;
                }
            }
        }
        true
    }

    fn is_near(&self, eye: Eye, texel: usize) -> bool {
        let distance_squared = self.scene.centers[texel].distance_squared(eye.point);
        distance_squared < NEAR * NEAR * self.scene.areas[texel]
    }

    /// Notes the factors to the quarters of a texel with the given corners. A texel that is seen through
    /// several openings is noted once for each, and the parts add up.
    fn add_near(&mut self, texel: usize, eye: Eye, corners: [DVec3; 4], cone: &[HalfSpace]) {
        let [a, b, c, d] = corners;
        let (below, right, above, left) =
            (a.midpoint(b), b.midpoint(c), c.midpoint(d), d.midpoint(a));
        let middle = left.midpoint(right);
        let quarters = [
            [a, below, middle, left],
            [below, b, right, middle],
            [left, middle, above, d],
            [middle, right, c, above],
        ];
        let factors = quarters.map(|quarter| self.clipped_factor(eye, quarter, cone) as f32);
        self.near.push(NearSender {
            sender: texel as u32,
            factors,
        });
    }

    /// The form factor to a texel (row j, column i) that is wholly inside the cone. Two texels share an
    /// edge, so each edge is integrated once.
    fn whole_factor(&mut self, wall_index: usize, [j, i]: [usize; 2], eye: Eye) -> f64 {
        let resolution = self.scene.resolution;
        let stride = resolution + 1;
        let grid = &self.grids[wall_index];
        let edge = |store: &mut f64, from: usize, to: usize| {
            if store.is_nan() {
                *store = edge_integral(eye, grid[from], grid[to]);
            }
            *store
        };
        let [a, b, c, d] = [0, 1, stride + 1, stride].map(|offset| j * stride + i + offset);
        let below = edge(&mut self.edges_u[j * resolution + i], a, b);
        let above = edge(&mut self.edges_u[(j + 1) * resolution + i], d, c);
        let left = edge(&mut self.edges_v[j * stride + i], a, d);
        let right = edge(&mut self.edges_v[j * stride + i + 1], b, c);
        // Loops wind about the normal towards the eye, against the direction of sight.
        let sign = winding(self.scene.walls[wall_index].face);
        (sign * (above + left - below - right)).max(0.0)
    }

    /// The form factor to the part of a quadrilateral that is inside `cone`.
    fn clipped_factor(&mut self, eye: Eye, corners: [DVec3; 4], cone: &[HalfSpace]) -> f64 {
        self.polygon.clear();
        self.polygon.extend(corners);
        for half in cone {
            clip_polygon(&mut self.polygon, half, &mut self.scratch);
        }
        point_to_polygon(eye.point, eye.normal, &self.polygon)
    }

    /// Takes the row out of `factors`, which is all zeros afterwards.
    fn take_row(&mut self) -> Row {
        let texels = self.scene.resolution * self.scene.resolution;
        let mut row = Row::new(self.near.to_vec());
        self.near.clear();
        for (wall, touched) in self.scene.walls.iter().zip(&mut self.touched) {
            if std::mem::take(touched) {
                let factors = &mut self.factors[wall.first_texel..][..texels];
                row.push_wall(wall.first_texel, factors);
                factors.fill(0.0);
            }
        }
        row.shrink_to_fit();
        row
    }
}

/// One edge of Lambert's formula: the angle it subtends times the component of its plane's unit normal
/// along the surface normal, over 2π.
fn edge_integral(eye: Eye, from: DVec3, to: DVec3) -> f64 {
    let (from, to) = (from - eye.point, to - eye.point);
    let across = from.cross(to);
    let sine = across.length();
    if sine == 0.0 {
        return 0.0;
    }
    let angle = sine.atan2(from.dot(to));
    angle * across.dot(eye.normal) / (sine * std::f64::consts::TAU)
}

/// Leaves one of any run of corners that nearly coincide.
fn merge_corners(polygon: &mut Vec<DVec3>) {
    polygon.dedup_by(|a, b| a.distance(*b) < CORNER_MERGE);
    while polygon.len() > 1 && polygon[0].distance(polygon[polygon.len() - 1]) < CORNER_MERGE {
        polygon.pop();
    }
}
