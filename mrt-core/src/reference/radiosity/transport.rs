//! The one-bounce operator of a level: irradiance at every texel centre from the radiosity of every
//! texel, in closed form.
//!
//! From each receiving point a cone is carried from block to block. In a block it cuts the wall
//! texels; through each opening it goes on, narrowed to the part of the opening that it reaches. In
//! a level of convex blocks every ray crosses one sequence of blocks, so the parts neither overlap
//! nor leave anything out: in a closed level each row adds up to 1.

use crate::geometry::form_factor::{HalfSpace, clip_polygon, cone_through, point_to_polygon};
use glam::DVec3;
use rayon::prelude::*;

use super::{ExactError, ExactScene, Side, Wall, check_length, winding};

/// Metres by which a corner may miss a cone and still count as inside.
const INSIDE_TOLERANCE: f64 = 1e-12;
/// Fraction of the hemisphere below which an opening is not looked through.
const SMALLEST_OPENING: f64 = 1e-12;
/// Corners of a clipped opening that are closer than this, metres, are taken as one; the plane
/// through the eye and both would have a direction made of rounding.
const CORNER_MERGE: f64 = 1e-10;
/// Distance, in texels, below which a sender counts by its quarters. With whole texels only, lights
/// near a wall err by 0.7 % at 16², most of it next to the spot below the light; from 6 texels on
/// the reference cube errs by 0.19 %, from 9 by 0.16 %, from 14 by 0.14 %, at growing memory.
const NEAR: f64 = 8.0;
/// Half-spaces of a cone that fit the outside-bits of a corner; an opening seen through any number
/// of quadrilateral openings has far fewer edges.
const MAX_PLANES: usize = 32;

/// A row-compressed matrix of form factors, receiving texels x sending texels.
///
/// Factors are stored as `f32`: their rounding, 6e-8 of each, is far below what a level's
/// discretisation costs, and the largest test level takes 0.3 GB instead of 0.6.
#[derive(Clone, Debug)]
pub struct Transport {
    rows: Vec<Row>,
}

/// Runs of consecutive senders, at most one for each wall, and what near senders add.
#[derive(Clone, Debug, Default)]
struct Row {
    /// First sender of each run and its length.
    runs: Vec<(u32, u32)>,
    values: Vec<f32>,
    /// Form factors to the quarters of near senders.
    near: Vec<(u32, [f32; 4])>,
}

impl Transport {
    /// Computes all form factors, in parallel; each depends on its receiver alone, so the result
    /// does not depend on the number of threads.
    ///
    /// Cost: about 40 ns for each pair of texels that see each other.
    pub fn build(scene: &ExactScene) -> Self {
        let corners: Vec<Vec<DVec3>> = scene.walls.iter().map(|w| grid(scene, w)).collect();
        let texels_per_wall = scene.resolution * scene.resolution;
        let rows = (0..scene.texel_count())
            .into_par_iter()
            .map_init(
                || Gather::new(scene, &corners),
                |gather, texel| gather.row(texel, texel / texels_per_wall),
            )
            .collect();
        Self { rows }
    }

    /// Number of rows and of columns: the level's texels.
    pub fn texel_count(&self) -> usize {
        self.rows.len()
    }

    /// Bytes of the stored factors.
    pub fn bytes(&self) -> usize {
        let bytes = |row: &Row| {
            size_of_val(row.values.as_slice())
                + size_of_val(row.runs.as_slice())
                + size_of_val(row.near.as_slice())
        };
        self.rows.iter().map(bytes).sum()
    }

    /// Form factor from a receiving texel centre to a sending texel, in [0, 1].
    ///
    /// # Panics
    /// If a texel does not exist.
    pub fn factor(&self, receiver: usize, sender: usize) -> f64 {
        let row = &self.rows[receiver];
        let mut from = 0;
        for &(start, length) in &row.runs {
            let (start, length) = (start as usize, length as usize);
            if (start..start + length).contains(&sender) {
                return f64::from(row.values[from + sender - start]);
            }
            from += length;
        }
        assert!(sender < self.rows.len(), "sender {sender} does not exist");
        0.0
    }

    /// Irradiance at texel centres, W/m², from the radiosity of every texel's [`Quarters`]. Sums are
    /// `f64`, in the order of the senders.
    ///
    /// # Errors
    /// [`ExactError::Length`].
    pub fn irradiance(&self, radiosity: &[Quarters]) -> Result<Vec<f64>, ExactError> {
        check_length("radiosity", self.rows.len(), radiosity.len())?;
        let means: Vec<f64> = radiosity.iter().map(mean_of_quarters).collect();
        let rows = self.rows.par_iter();
        Ok(rows.map(|row| row.gather(&means, radiosity)).collect())
    }
}

impl Row {
    /// Irradiance from the radiosity of every texel's quarters and their means.
    fn gather(&self, means: &[f64], radiosity: &[Quarters]) -> f64 {
        let mut sum = 0.0;
        let mut values = self.values.as_slice();
        for &(start, length) in &self.runs {
            let (run, rest) = values.split_at(length as usize);
            values = rest;
            sum += run_product(run, &means[start as usize..(start + length) as usize]);
        }
        for (sender, factors) in &self.near {
            let sender = *sender as usize;
            for (&factor, quarter) in factors.iter().zip(radiosity[sender]) {
                sum += f64::from(factor) * (quarter - means[sender]);
            }
        }
        sum
    }
}

/// Irradiance at the centres of some texels only, from several radiosities, without storing the transport: one vector
/// a receiver, with one value a radiosity.
///
/// # Errors
/// [`ExactError::Length`].
///
/// # Panics
/// If the scene has no such receiver.
pub fn irradiance_at(
    scene: &ExactScene,
    receivers: &[usize],
    radiosities: &[Vec<Quarters>],
) -> Result<Vec<Vec<f64>>, ExactError> {
    for radiosity in radiosities {
        check_length("radiosity", scene.texel_count(), radiosity.len())?;
    }
    let corners: Vec<Vec<DVec3>> = scene.walls.iter().map(|w| grid(scene, w)).collect();
    let texels_per_wall = scene.resolution * scene.resolution;
    let means: Vec<Vec<f64>> = radiosities
        .iter()
        .map(|radiosity| radiosity.iter().map(mean_of_quarters).collect())
        .collect();
    Ok(receivers
        .par_iter()
        .map_init(
            || Gather::new(scene, &corners),
            |gather, &texel| {
                let row = gather.row(texel, texel / texels_per_wall);
                let pairs = means.iter().zip(radiosities);
                pairs.map(|(means, r)| row.gather(means, r)).collect()
            },
        )
        .collect())
}

/// Values of the four quarters of a texel, at (u, v) = (low, low), (high, low), (low, high),
/// (high, high).
pub type Quarters = [f64; 4];

/// A texel's mean.
pub fn mean_of_quarters(quarters: &Quarters) -> f64 {
    quarters.iter().sum::<f64>() * 0.25
}

/// Sum of products in four interleaved partial sums, which hide the latency of the additions.
fn run_product(factors: &[f32], means: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (factors, means) in factors.chunks(4).zip(means.chunks(4)) {
        for ((sum, &factor), mean) in sums.iter_mut().zip(factors).zip(means) {
            *sum += f64::from(factor) * mean;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Texel corners of a wall, (resolution + 1)², row v, column u.
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

/// One thread's state while it computes rows.
struct Gather<'a> {
    scene: &'a ExactScene,
    corners: &'a [Vec<DVec3>],
    /// Walls of each block.
    walls_of: Vec<Vec<usize>>,
    /// The row, dense; only walls in `touched` hold anything but zeros.
    factors: Vec<f64>,
    touched: Vec<bool>,
    /// Blocks that the current cone has passed.
    path: Vec<usize>,
    outside: Vec<u32>,
    edges_u: Vec<f64>,
    edges_v: Vec<f64>,
    near: Vec<(u32, [f32; 4])>,
    polygon: Vec<DVec3>,
    scratch: Vec<DVec3>,
}

/// The receiver of a row.
#[derive(Clone, Copy)]
struct Eye {
    point: DVec3,
    normal: DVec3,
    /// Its own wall if planar, which it cannot see.
    hidden_wall: Option<usize>,
    /// Its own texel.
    texel: usize,
}

impl<'a> Gather<'a> {
    fn new(scene: &'a ExactScene, corners: &'a [Vec<DVec3>]) -> Self {
        let resolution = scene.resolution;
        let mut walls_of = vec![Vec::new(); scene.blocks.len()];
        for (index, wall) in scene.walls.iter().enumerate() {
            walls_of[wall.block].push(index);
        }
        Self {
            scene,
            corners,
            walls_of,
            factors: vec![0.0; scene.texel_count()],
            touched: vec![false; scene.walls.len()],
            path: Vec::new(),
            outside: vec![0; (resolution + 1) * (resolution + 1)],
            edges_u: vec![0.0; resolution * (resolution + 1)],
            edges_v: vec![0.0; resolution * (resolution + 1)],
            near: Vec::new(),
            polygon: Vec::new(),
            scratch: Vec::new(),
        }
    }

    fn row(&mut self, texel: usize, wall_index: usize) -> Row {
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
        self.compress()
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

    fn add_wall(&mut self, wall_index: usize, eye: Eye, cone: &[HalfSpace]) {
        let resolution = self.scene.resolution;
        let stride = resolution + 1;
        let wall = self.scene.walls[wall_index];
        let corners = &self.corners[wall_index];
        let outline = [0, resolution, stride * stride - 1, stride * resolution];
        let is_outside = |corner: DVec3, half: &HalfSpace| half.side(corner) < -INSIDE_TOLERANCE;
        let mut cuts = false;
        for half in cone {
            let count = outline
                .iter()
                .filter(|&&corner| is_outside(corners[corner], half))
                .count();
            if count == 4 {
                return;
            }
            cuts |= count > 0;
        }
        self.touched[wall_index] = true;
        self.outside.fill(0);
        if cuts {
            for (outside, &corner) in self.outside.iter_mut().zip(corners) {
                for (bit, half) in cone.iter().enumerate() {
                    *outside |= u32::from(is_outside(corner, half)) << bit;
                }
            }
        }
        // Edges are shared by two texels, so each is integrated once; NaN marks those to do.
        self.edges_u.fill(f64::NAN);
        self.edges_v.fill(f64::NAN);
        let sign = winding(wall.face);
        for j in 0..resolution {
            for i in 0..resolution {
                let texel = wall.first_texel + j * resolution + i;
                let loop_of = [0, 1, stride + 1, stride].map(|offset| j * stride + i + offset);
                let bits = loop_of.map(|corner| self.outside[corner]);
                if bits[0] & bits[1] & bits[2] & bits[3] != 0 || texel == eye.texel {
                    continue;
                }
                let is_near = self.is_near(eye, texel);
                if is_near {
                    let cone = if bits == [0; 4] { &[] } else { cone };
                    let quarters = loop_of.map(|corner| corners[corner]);
                    self.add_near(texel, eye, quarters, cone);
                }
                self.factors[texel] += if bits == [0; 4] {
                    let edge = |at: usize, from: usize, to: usize, store: &mut Vec<f64>| {
                        if store[at].is_nan() {
                            store[at] = edge_integral(eye, corners[from], corners[to]);
                        }
                        store[at]
                    };
                    let [a, b, c, d] = loop_of;
                    let below = edge(j * resolution + i, a, b, &mut self.edges_u);
                    let above = edge((j + 1) * resolution + i, d, c, &mut self.edges_u);
                    let left = edge(j * stride + i, a, d, &mut self.edges_v);
                    let right = edge(j * stride + i + 1, b, c, &mut self.edges_v);
                    // Loops wind about the normal towards the eye, against the direction of sight.
                    (sign * (above + left - below - right)).max(0.0)
                } else {
                    self.clipped_factor(eye, loop_of.map(|corner| corners[corner]), cone)
                };
            }
        }
    }

    fn is_near(&self, eye: Eye, texel: usize) -> bool {
        let distance_squared = self.scene.centers[texel].distance_squared(eye.point);
        distance_squared < NEAR * NEAR * self.scene.areas[texel]
    }

    /// Notes the factors to the quarters of a texel with the given corners. A texel seen through
    /// several openings is noted once for each; the parts add up.
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
        self.near.push((texel as u32, factors));
    }

    fn clipped_factor(&mut self, eye: Eye, corners: [DVec3; 4], cone: &[HalfSpace]) -> f64 {
        self.polygon.clear();
        self.polygon.extend(corners);
        for half in cone {
            clip_polygon(&mut self.polygon, half, &mut self.scratch);
        }
        point_to_polygon(eye.point, eye.normal, &self.polygon)
    }

    /// Takes the row out of `factors` and leaves zeros.
    fn compress(&mut self) -> Row {
        let texels = self.scene.resolution * self.scene.resolution;
        let mut row = Row {
            near: self.near.to_vec(),
            ..Row::default()
        };
        self.near.clear();
        for (index, touched) in self.touched.iter_mut().enumerate() {
            if !std::mem::take(touched) {
                continue;
            }
            let start = self.scene.walls[index].first_texel;
            let values = &mut self.factors[start..start + texels];
            let first = values.iter().position(|&x| x > 0.0);
            let last = values.iter().rposition(|&x| x > 0.0);
            if let (Some(first), Some(last)) = (first, last) {
                row.runs
                    .push(((start + first) as u32, (last - first + 1) as u32));
                row.values
                    .extend(values[first..=last].iter().map(|&x| x as f32));
            }
            values.fill(0.0);
        }
        row.values.shrink_to_fit();
        row
    }
}

/// One edge of Lambert's formula: the angle it subtends times the component of its plane's unit
/// normal along the surface normal, over 2 pi.
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

fn merge_corners(polygon: &mut Vec<DVec3>) {
    polygon.dedup_by(|a, b| a.distance(*b) < CORNER_MERGE);
    while polygon.len() > 1 && polygon[0].distance(polygon[polygon.len() - 1]) < CORNER_MERGE {
        polygon.pop();
    }
}
