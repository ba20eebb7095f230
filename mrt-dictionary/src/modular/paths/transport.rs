//! Transport along a path of openings, in closed form: from the walls of the canonical emitter to those and the
//! probes of the canonical receiver (the paper's section 5.1 passes sampled lightfields on instead).
//!
//! From a receiving point the openings of the path are one convex window. Every texel of the emitter is cut to
//! what the window shows, and counts with the exact moments of that polygon, so nothing is sampled and paths
//! share no light. A receiver in the plane of an opening sees nothing through it.

use crate::modular::outputs::cube::{
    SH9, probe_points, sh_of_unit_radiosity, texel_axes, vector_of_unit_radiosity,
};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::form_factor::{HalfSpace, clip_polygon, cone_through, point_to_polygon};
use mrt_core::geometry::polygon_moments::polygon_moments;
use mrt_core::linalg::matrix::Matrix;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::{Aperture, Hole, Outline, WallForm};
use mrt_runtime::low_level::modular::path::{Word, response_frame};
use rayon::prelude::*;

/// The cube that light leaves through z = 1.
pub static EMITTER: Shape = Shape {
    name: "emitter",
    form: WallForm::Cube,
    openings: &[Aperture {
        face: Face::PosZ,
        outline: Outline::Whole,
    }],
};

/// The cube that light enters through z = 0.
pub static RECEIVER: Shape = Shape {
    name: "receiver",
    form: WallForm::Cube,
    openings: &[Aperture {
        face: Face::NegZ,
        outline: Outline::Whole,
    }],
};

/// What receivers gather.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gather {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Probes along an edge of the receiver.
    pub probes: usize,
    /// True if vector irradiance is gathered too.
    pub vector: bool,
}

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

/// Radiosities of the emitter whose light is gathered.
#[derive(Clone, Copy, Debug)]
pub enum Signals<'a> {
    /// One a texel, which emits alone.
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
/// Cost: about 0.2 µs for each texel in each receiver's window, and as many multiply-adds as there are signals.
pub fn gather(word: &Word, radiosity: Signals, gather: &Gather) -> Gathered {
    let windows = windows(word);
    let frame = response_frame(word);
    let cell = word
        .cells()
        .last()
        .map_or(DVec3::ZERO, |c| DVec3::from_array(c.map(f64::from)));
    let signals = radiosity.count(gather.resolution);
    let texels: Vec<(Face, DVec3)> = RECEIVER.texels(gather.resolution).collect();
    let irradiance: Vec<(Vec<f64>, Vec<f64>)> = texels
        .par_iter()
        .map(|&(face, point)| {
            let point = cell + frame.point(point);
            let normal = frame.direction(-face.outward());
            let mut row = vec![0.0; signals];
            let mut vector = vec![0.0; if gather.vector { 4 * signals } else { 0 }];
            let axes = texel_axes(face).map(|axis| frame.direction(axis));
            for_each_visible(&windows, point, gather.resolution, |texel, polygon| {
                if gather.vector {
                    let moments = polygon_moments(point, polygon);
                    radiosity.add(&mut row, texel, moments.irradiance_factor(normal));
                    let ohlsh = vector_of_unit_radiosity(&moments, &axes);
                    for (part, weight) in vector.chunks_exact_mut(signals).zip(ohlsh) {
                        radiosity.add(part, texel, weight);
                    }
                } else {
                    let factor = point_to_polygon(point, normal, polygon);
                    radiosity.add(&mut row, texel, factor);
                }
            });
            (row, vector)
        })
        .collect();
    let points: Vec<DVec3> = probe_points(gather.probes).collect();
    let probes: Vec<Vec<f64>> = points
        .par_iter()
        .map(|&point| {
            let point = cell + frame.point(point);
            let mut rows = vec![0.0; SH9 * signals];
            for_each_visible(&windows, point, gather.resolution, |texel, polygon| {
                // The receiver's axes in the path's are an exchange, which is its own inverse.
                let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| frame.direction(axis));
                let moments = polygon_moments(point, polygon).in_frame(&axes);
                let sh = sh_of_unit_radiosity(&moments);
                for (part, weight) in rows.chunks_exact_mut(signals).zip(sh) {
                    radiosity.add(part, texel, weight);
                }
            });
            rows
        })
        .collect();
    Gathered {
        irradiance: Matrix::from_fn(texels.len(), signals, |i, j| irradiance[i].0[j]),
        probes: Matrix::from_fn(SH9 * points.len(), signals, |i, j| {
            probes[i / SH9][i % SH9 * signals + j]
        }),
        vector: Matrix::from_fn(
            if gather.vector { 4 * texels.len() } else { 0 },
            signals,
            |i, j| irradiance[i / 4].1[i % 4 * signals + j],
        ),
    }
}

/// The outlines of a path's openings in the emitter's coordinates, and the axis along which each is crossed.
fn windows(word: &Word) -> Vec<(usize, Vec<DVec3>)> {
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
            (crossing.heading.axis(), corners)
        })
        .collect()
}

/// Calls `visit` with every texel of the emitter that a point sees through the windows, and what it sees of it.
fn for_each_visible(
    windows: &[(usize, Vec<DVec3>)],
    point: DVec3,
    resolution: usize,
    mut visit: impl FnMut(usize, &[DVec3]),
) {
    let mut scratch = Vec::with_capacity(16);
    let mut cone: Vec<HalfSpace> = Vec::with_capacity(16);
    let Some(((_, first), others)) = windows.split_first() else {
        return;
    };
    let in_front = |axis: usize, corners: &[DVec3]| point[axis] > corners[0][axis] + 1e-9;
    if windows
        .iter()
        .any(|(axis, corners)| !in_front(*axis, corners))
    {
        return;
    }
    let mut window = first.to_vec();
    for (_, corners) in others {
        cone_through(point, corners, &mut cone);
        for half_space in &cone {
            clip_polygon(&mut window, half_space, &mut scratch);
        }
    }
    if area(&window) < SLIVER {
        return;
    }
    cone_through(point, &window, &mut cone);
    let mut polygon = Vec::with_capacity(16);
    let per_face = resolution * resolution;
    for (wall, face) in EMITTER.walls().enumerate() {
        polygon.clear();
        polygon.extend(face.rectangle([0.0, 1.0], [0.0, 1.0]));
        for half_space in &cone {
            clip_polygon(&mut polygon, half_space, &mut scratch);
        }
        if polygon.len() < 3 {
            continue;
        }
        let range = |axis: usize| {
            let (low, high) = polygon.iter().fold((1.0f64, 0.0f64), |(low, high), p| {
                (low.min(p[axis]), high.max(p[axis]))
            });
            let first = (low * resolution as f64).floor().max(0.0) as usize;
            let last = (high * resolution as f64).ceil().min(resolution as f64) as usize;
            first..last
        };
        let (columns, rows) = (range(face.u_axis()), range(face.v_axis()));
        let line = |k: usize| k as f64 / resolution as f64;
        for j in rows {
            for i in columns.clone() {
                polygon.clear();
                let texel = face.rectangle([line(i), line(i + 1)], [line(j), line(j + 1)]);
                polygon.extend(texel);
                for half_space in &cone {
                    if texel.iter().any(|&corner| half_space.side(corner) < 0.0) {
                        clip_polygon(&mut polygon, half_space, &mut scratch);
                    }
                }
                if polygon.len() >= 3 {
                    visit(wall * per_face + j * resolution + i, &polygon);
                }
            }
        }
    }
}

/// Windows of less than this share of a face pass nothing: where the path's openings leave a line, rounding makes
/// a sliver of it whose edges point anywhere.
const SLIVER: f64 = 1e-10;

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

/// Index of a texel of [`EMITTER`] or [`RECEIVER`] at a point of a wall.
pub fn texel_at(shape: &Shape, face: Face, center: DVec3, resolution: usize) -> Option<usize> {
    let offset = shape.wall_offset(face, resolution)?;
    Some(offset + face.texel_index(center, resolution))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_core::geometry::form_factor::point_to_polygon;

    fn unit_radiosity(resolution: usize) -> Matrix<f64> {
        Matrix::from_fn(1, EMITTER.texel_count(resolution), |_, _| 1.0)
    }

    #[test]
    fn an_evenly_lit_emitter_fills_the_opening() {
        let setup = Gather {
            resolution: 4,
            probes: 2,
            vector: true,
        };
        let word = Word::from_name("z").expect("a word");
        let light = gather(&word, Signals::Given(&unit_radiosity(4)), &setup);
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
    fn a_turn_shows_the_emitter_through_both_openings() {
        // From the far wall behind a turn the visible part of the first opening is what the second one leaves.
        let setup = Gather {
            resolution: 4,
            probes: 1,
            vector: false,
        };
        let turned = gather(
            &Word::from_name("zx").expect("word"),
            Signals::Given(&unit_radiosity(4)),
            &setup,
        );
        let total = |m: &Matrix<f64>| m.data().iter().sum::<f64>();
        assert!(total(&turned.irradiance) > 0.0);
        // Two openings that share an edge show a line of the first from points in line with it, and no more.
        let around = gather(
            &Word::from_name("zzx").expect("word"),
            Signals::Given(&unit_radiosity(4)),
            &setup,
        );
        let floor = RECEIVER.wall_offset(Face::NegY, 4).expect("a wall");
        let diagonal = RECEIVER
            .texels(4)
            .position(|(face, p)| face == Face::NegY && p.x == 0.125 && p.z == 0.125);
        assert_eq!(diagonal, Some(floor));
        assert_eq!(around.irradiance[(floor, 0)], 0.0);
        // The wall opposite the side opening that looks back the way the light came sees nothing of it but
        // grazing; the one it meets head on sees most.
        let door = gather(
            &Word::from_name("zd").expect("word"),
            Signals::Given(&unit_radiosity(4)),
            &setup,
        );
        let whole = gather(
            &Word::from_name("z").expect("word"),
            Signals::Given(&unit_radiosity(4)),
            &setup,
        );
        assert!(total(&door.irradiance) < 0.5 * total(&whole.irradiance));
        assert!(total(&turned.irradiance) < 0.5 * total(&whole.irradiance));
    }
}
