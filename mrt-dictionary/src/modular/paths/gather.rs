//! Transport along a path of openings, in closed form: from the walls of the canonical emitter to those and the
//! probes of the canonical receiver (the paper's section 5.1 passes sampled lightfields on instead).
//!
//! From a receiving point the openings of the path are one convex window. Every texel of the emitter is cut to
//! what the window shows, and counts with the exact moments of that polygon. So nothing is sampled, and paths
//! share no light. A receiver in the plane of an opening sees nothing through it.

use crate::matrix_parts::{from_row_groups, stack};
use crate::modular::outputs::polygon_light::{SH9, sh_of_unit_radiosity, vector_of_unit_radiosity};
use crate::modular::outputs::probe_samples::{PROBE_WEIGHT, ProbeSamples};
use crate::modular::paths::ends::{EMITTER, RECEIVER};
use crate::modular::surface::output_grid::OutputGrid;
use crate::modular::surface::probes::probe_points;
use crate::modular::surface::walls::cube::texel_axes;
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, cone_through, point_to_polygon};
use mrt_core::geometry::polygon_moments::polygon_moments;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::low_level::level::shape::{Aperture, Hole, Outline};
use mrt_runtime::low_level::modular::path::{Word, response_frame};
use rayon::prelude::*;
use std::ops::Range;

/// Light at the receiver for each signal on the emitter.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// Texels x signals.
    pub irradiance: Matrix<f64>,
    /// 9 probes³ x signals.
    pub probes: Matrix<f64>,
    /// 4 texels x signals, or no rows.
    pub vector: Matrix<f64>,
}

impl Gathered {
    /// Irradiance of the texels, then the samples of the probes times [`PROBE_WEIGHT`].
    pub fn texels_and_samples(&self, samples: &ProbeSamples) -> Matrix<f64> {
        let samples = samples.from_sh(&self.probes, PROBE_WEIGHT);
        stack(&[&self.irradiance, &samples])
    }
}

/// Radiosities of the emitter whose light is gathered.
#[derive(Clone, Copy, Debug)]
pub enum Signals<'a> {
    /// One signal a texel: that texel alone emits 1.
    EachTexel,
    /// Signals x texels of [`EMITTER`].
    Given(&'a Matrix<f64>),
}

impl Signals<'_> {
    fn count(&self, resolution: usize) -> usize {
        match self {
            Signals::EachTexel => EMITTER.texel_count(resolution),
            Signals::Given(by_texel) => by_texel.rows(),
        }
    }

    /// Adds what a texel contributes to each signal.
    fn add(&self, sums: &mut [f64], texel: usize, weight: f64) {
        match self {
            Signals::EachTexel => sums[texel] += weight,
            Signals::Given(by_texel) => {
                for (sum, &x) in sums.iter_mut().zip(by_texel.column(texel)) {
                    *sum += weight * x;
                }
            }
        }
    }
}

/// Gathers signals at the end of a path.
///
/// Cost: about 0.2 µs for each texel in each receiver's window, and one multiply-add for each signal there.
pub fn gather(word: &Word, radiosity: Signals, grid: &OutputGrid) -> Gathered {
    let path = PathView::new(word, radiosity, grid);
    let signals = path.signals;
    let texels: Vec<(Face, DVec3)> = RECEIVER.texels(grid.resolution).collect();
    let (irradiance, vector): (Vec<Vec<f64>>, Vec<Vec<f64>>) = texels
        .par_iter()
        .map(|&(face, point)| {
            if grid.vector {
                path.irradiance_and_vector(face, point)
            } else {
                (path.irradiance(face, point), Vec::new())
            }
        })
        .unzip();
    let points: Vec<DVec3> = probe_points(grid.probes).collect();
    let probes: Vec<Vec<f64>> = points.par_iter().map(|&p| path.probe(p)).collect();
    Gathered {
        irradiance: from_row_groups(&irradiance, 1, signals),
        probes: from_row_groups(&probes, SH9, signals),
        vector: if grid.vector {
            from_row_groups(&vector, 4, signals)
        } else {
            Matrix::zeros(0, signals)
        },
    }
}

/// A path as its receiver sees it. Positions and directions are the emitter's.
struct PathView<'a> {
    windows: Vec<Window>,
    /// Corner of the receiver's cell with the smallest coordinates.
    cell: DVec3,
    /// From the receiver's frame to the emitter's.
    frame: CubeSymmetry,
    radiosity: Signals<'a>,
    /// Number of signals.
    signals: usize,
    resolution: usize,
}

/// One opening of a path.
struct Window {
    /// The axis along which light crosses it.
    axis: usize,
    corners: Vec<DVec3>,
}

/// Windows of less than this share of a face pass nothing. Where the path's openings leave only a line, rounding makes
/// a sliver of it, whose edges point anywhere.
const SLIVER: f64 = 1e-10;

/// A receiver must be further beyond the plane of each opening than this, in block widths, to see through it.
const BEYOND_PLANE: f64 = 1e-9;

impl<'a> PathView<'a> {
    fn new(word: &Word, radiosity: Signals<'a>, grid: &OutputGrid) -> Self {
        Self {
            windows: windows(word),
            cell: word
                .cells()
                .last()
                .map_or(DVec3::ZERO, |cell| DVec3::from_array(cell.map(f64::from))),
            frame: response_frame(word),
            radiosity,
            signals: radiosity.count(grid.resolution),
            resolution: grid.resolution,
        }
    }

    /// Irradiance at a point of the receiver's wall, from each signal.
    fn irradiance(&self, face: Face, point: DVec3) -> Vec<f64> {
        let point = self.cell + self.frame.point(point);
        let normal = self.frame.direction(-face.outward());
        let mut row = vec![0.0; self.signals];
        self.for_each_visible(point, |texel, polygon| {
            let factor = point_to_polygon(point, normal, polygon);
            self.radiosity.add(&mut row, texel, factor);
        });
        row
    }

    /// Irradiance and the four rows of vector irradiance at a point of the receiver's wall, from each signal.
    fn irradiance_and_vector(&self, face: Face, point: DVec3) -> (Vec<f64>, Vec<f64>) {
        let point = self.cell + self.frame.point(point);
        let normal = self.frame.direction(-face.outward());
        let axes = texel_axes(face).map(|axis| self.frame.direction(axis));
        let mut row = vec![0.0; self.signals];
        let mut vector = vec![0.0; 4 * self.signals];
        self.for_each_visible(point, |texel, polygon| {
            let moments = polygon_moments(point, polygon);
            let factor = moments.irradiance_factor(normal);
            self.radiosity.add(&mut row, texel, factor);
            let ohlsh = vector_of_unit_radiosity(&moments, &axes);
            for (part, weight) in vector.chunks_exact_mut(self.signals).zip(ohlsh) {
                self.radiosity.add(part, texel, weight);
            }
        });
        (row, vector)
    }

    /// The nine rows of SH coefficients at a probe of the receiver, from each signal.
    fn probe(&self, point: DVec3) -> Vec<f64> {
        let point = self.cell + self.frame.point(point);
        // The receiver's axes in the path's frame are an exchange, which is its own inverse.
        let axes = DVec3::AXES.map(|axis| self.frame.direction(axis));
        let mut rows = vec![0.0; SH9 * self.signals];
        self.for_each_visible(point, |texel, polygon| {
            let sh = sh_of_unit_radiosity(&polygon_moments(point, polygon).in_frame(&axes));
            for (part, weight) in rows.chunks_exact_mut(self.signals).zip(sh) {
                self.radiosity.add(part, texel, weight);
            }
        });
        rows
    }

    /// Calls `visit` with every texel of the emitter that a point sees through the windows, and the part that it sees.
    fn for_each_visible(&self, point: DVec3, mut visit: impl FnMut(usize, &[DVec3])) {
        let Some(cone) = self.cone_through_windows(point) else {
            return;
        };
        let (mut polygon, mut scratch) = (Vec::with_capacity(16), Vec::with_capacity(16));
        let resolution = self.resolution;
        for (wall, face) in EMITTER.walls().enumerate() {
            polygon.clear();
            polygon.extend(face.rectangle([0.0, 1.0], [0.0, 1.0]));
            for half_space in &cone {
                clip_polygon(&mut polygon, half_space, &mut scratch);
            }
            if polygon.len() < 3 {
                continue;
            }
            let columns = texel_range(&polygon, face.u_axis(), resolution);
            let rows = texel_range(&polygon, face.v_axis(), resolution);
            let along = |k: usize| [k, k + 1].map(|line| line as f64 / resolution as f64);
            for j in rows {
                for i in columns.clone() {
                    let texel = face.rectangle(along(i), along(j));
                    polygon.clear();
                    polygon.extend(texel);
                    for half_space in &cone {
                        if texel.iter().any(|&corner| half_space.side(corner) < 0.0) {
                            clip_polygon(&mut polygon, half_space, &mut scratch);
                        }
                    }
                    if polygon.len() >= 3 {
                        visit((wall * resolution + j) * resolution + i, &polygon);
                    }
                }
            }
        }
    }

    /// The cone from a point through all windows; `None` if it is empty.
    fn cone_through_windows(&self, point: DVec3) -> Option<Vec<HalfSpace>> {
        let (first, others) = self.windows.split_first()?;
        let is_beyond =
            |window: &Window| point[window.axis] > window.corners[0][window.axis] + BEYOND_PLANE;
        if !self.windows.iter().all(is_beyond) {
            return None;
        }
        let mut cone: Vec<HalfSpace> = Vec::with_capacity(16);
        let mut scratch = Vec::with_capacity(16);
        let mut visible = first.corners.clone();
        for window in others {
            cone_through(point, &window.corners, &mut cone);
            for half_space in &cone {
                clip_polygon(&mut visible, half_space, &mut scratch);
            }
        }
        if area(&visible) < SLIVER {
            return None;
        }
        cone_through(point, &visible, &mut cone);
        Some(cone)
    }
}

/// The openings of a path, in the emitter's coordinates.
fn windows(word: &Word) -> Vec<Window> {
    let mut cell = DVec3::ZERO;
    word.crossings()
        .iter()
        .map(|crossing| {
            let outline = crossing
                .hole
                .and_then(|hole| Hole::ALL.get(usize::from(hole)))
                .map_or(Outline::Whole, |&hole| Outline::Hole(hole));
            let aperture = Aperture {
                face: crossing.heading,
                outline,
            };
            let corners = aperture.corners().into_iter();
            let corners = corners.map(|corner| corner + cell).collect();
            cell += crossing.heading.outward();
            Window {
                axis: crossing.heading.axis(),
                corners,
            }
        })
        .collect()
}

/// The texels, along one axis of a wall, that a polygon on it may touch.
fn texel_range(polygon: &[DVec3], axis: usize, resolution: usize) -> Range<usize> {
    let (low, high) = polygon.iter().fold((1.0f64, 0.0f64), |(low, high), p| {
        (low.min(p[axis]), high.max(p[axis]))
    });
    let first = (low * resolution as f64).floor().max(0.0) as usize;
    let end = (high * resolution as f64).ceil().min(resolution as f64) as usize;
    first..end
}

/// Area of a planar polygon.
fn area(polygon: &[DVec3]) -> f64 {
    let Some((&first, rest)) = polygon.split_first() else {
        return 0.0;
    };
    let doubled: DVec3 = rest
        .windows(2)
        .map(|edge| (edge[0] - first).cross(edge[1] - first))
        .sum();
    0.5 * doubled.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_radiosity(resolution: usize) -> Matrix<f64> {
        Matrix::from_fn(1, EMITTER.texel_count(resolution), |_, _| 1.0)
    }

    #[test]
    fn an_evenly_lit_emitter_lights_as_its_opening_would() {
        let grid = OutputGrid {
            resolution: 4,
            probes: 2,
            vector: true,
        };
        let word = Word::from_name("z").expect("a word");
        let light = gather(&word, Signals::Given(&unit_radiosity(4)), &grid);
        let entrance = Face::NegZ.rectangle([0.0, 1.0], [0.0, 1.0]);
        for (k, (face, point)) in RECEIVER.texels(4).enumerate() {
            let exact = point_to_polygon(point, -face.outward(), &entrance);
            // Sums of 80 texels' moments.
            assert!((light.irradiance[(k, 0)] - exact).abs() < 1e-12);
            let moments = polygon_moments(point, &entrance);
            let exact = vector_of_unit_radiosity(&moments, &texel_axes(face));
            for (i, exact) in exact.into_iter().enumerate() {
                assert!((light.vector[(4 * k + i, 0)] - exact).abs() < 1e-11);
            }
        }
        for (k, point) in probe_points(2).enumerate() {
            let exact = sh_of_unit_radiosity(&polygon_moments(point, &entrance));
            for (i, exact) in exact.into_iter().enumerate() {
                assert!((light.probes[(SH9 * k + i, 0)] - exact).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn turns_and_doors_show_part_of_the_emitter() {
        let grid = OutputGrid {
            resolution: 4,
            probes: 1,
            vector: false,
        };
        let radiosity = unit_radiosity(4);
        let irradiance = |name: &str| {
            let word = Word::from_name(name).expect("a word");
            gather(&word, Signals::Given(&radiosity), &grid).irradiance
        };
        let total = |m: &Matrix<f64>| m.data().iter().sum::<f64>();
        let whole = total(&irradiance("z"));
        let turned = total(&irradiance("zx"));
        assert!(turned > 0.0 && turned < 0.5 * whole);
        assert!(total(&irradiance("zd")) < 0.5 * whole);
        // From points in line with the edge that two openings share, the second one shows no more than a line of the
        // first.
        let around = irradiance("zzx");
        let floor = RECEIVER.wall_offset(Face::NegY, 4).expect("a wall");
        let diagonal = RECEIVER
            .texels(4)
            .position(|(face, p)| face == Face::NegY && p.x == 0.125 && p.z == 0.125);
        assert_eq!(diagonal, Some(floor));
        assert_eq!(around[(floor, 0)], 0.0);
    }
}
