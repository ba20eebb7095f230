//! One basis per shape for the light of its own walls and that of other blocks.
//!
//! The paper expands light from other blocks in a basis of its own for each opening, which is the largest
//! stage of a frame in a large level. Both kinds of light are smooth on the same walls, so a basis for the first
//! needs few columns more to hold the second too. Its first columns are `U_b` itself, so that a block's own
//! coefficients need no projection; the others are the singular vectors of what `U_b` leaves of the responses.

use crate::modular::outputs::cube::{
    DIRECTIONS, PROBE_WEIGHT, ProbeSamples, probe_points, probe_sample, texel_axes,
};
use crate::modular::paths::response::{ResponseBasis, rows, stack};
use crate::modular::paths::transport::{RECEIVER, texel_at};
use crate::modular::surface::mirrors::output_parity_classes;
use glam::{DVec3, IVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::least_squares::pseudo_inverse;
use mrt_core::linalg::matrix::{Matrix, multiply, transpose_multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{
    GramModes, ModeChoice, ParityMode, combined_columns, gram_of_columns,
};
use mrt_core::linalg::svd::largest_entry_sign;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::modular::path::frame_of_heading;

/// Light of a shape's own modes.
#[derive(Clone, Debug)]
pub struct OwnLight {
    /// `U_b`: texels x modes.
    pub irradiance: Matrix<f64>,
    /// 9 probes³ x modes.
    pub probes: Matrix<f64>,
    /// 4 texels x modes, or no rows.
    pub vector: Matrix<f64>,
}

/// The joint basis of one shape.
#[derive(Clone, Debug)]
pub struct JointBasis {
    /// Texels x joint modes.
    pub irradiance: Matrix<f64>,
    /// 9 probes³ x joint modes.
    pub probes: Matrix<f64>,
    /// 4 texels x joint modes, or no rows.
    pub vector: Matrix<f64>,
    /// For each opening, joint modes x response modes: in the frame of the opening, and if asked for in that with
    /// x and y exchanged.
    pub joint_from_response: Vec<Vec<Matrix<f64>>>,
    /// Fraction of the energy of light from other blocks that the basis does not hold.
    pub dropped_energy: f64,
}

/// Light that enters through one opening of a shape, in one of its frames.
#[derive(Clone, Debug)]
pub struct ForeignLight {
    /// Outputs of the shape (texels, then weighted samples of probes) x response modes.
    pub field: Matrix<f64>,
    /// 4 texels x response modes, or no rows.
    pub vector: Matrix<f64>,
}

/// Adds up to `extra` modes to a shape's own for the responses that enter through its openings.
pub fn joint_basis(
    shape: &Shape,
    own: &OwnLight,
    response: &ResponseBasis,
    resolution: usize,
    probes: usize,
    extra: usize,
    has_exchanges: bool,
) -> JointBasis {
    let exchanges: &[bool] = if has_exchanges {
        &[false, true]
    } else {
        &[false]
    };
    let mut foreign = Vec::new();
    for opening in shape.openings {
        for &is_exchanged in exchanges {
            let (field, vector) = response_at(
                shape,
                opening.face,
                is_exchanged,
                response,
                resolution,
                probes,
            );
            foreign.push(ForeignLight { field, vector });
        }
    }
    let classes = output_parity_classes(shape, resolution, probes);
    joint_basis_of(
        own,
        foreign,
        &response.scales,
        &classes,
        extra,
        exchanges.len(),
    )
}

/// As [`joint_basis`], for any light: `foreign` lists `frames` for each opening, `scales` say how much each response
/// mode counts, and `classes` are symmetries of the outputs.
pub fn joint_basis_of(
    own: &OwnLight,
    foreign: Vec<ForeignLight>,
    scales: &[f64],
    classes: &ParityClasses,
    extra: usize,
    frames: usize,
) -> JointBasis {
    let samples = ProbeSamples::default();
    let texels = own.irradiance.rows();
    let base = stack(&own.irradiance, &samples.from_sh(&own.probes, PROBE_WEIGHT));
    // The coefficients of U_b's columns whose sum is nearest to a signal.
    let base_gram = transpose_multiply(base.view(), base.view());
    let nearest = multiply(pseudo_inverse(&base_gram).view(), base.transposed().view());
    let responses: Vec<Response> = foreign
        .into_iter()
        .map(|ForeignLight { field, vector }| {
            let of_base = multiply(nearest.view(), field.view());
            let rest = difference(&field, &multiply(base.view(), of_base.view()));
            Response {
                field,
                vector,
                of_base,
                rest,
            }
        })
        .collect();
    let found = extra_modes(classes, &responses, scales, extra);
    let (mut irradiance, mut vector) = (own.irradiance.clone(), own.vector.clone());
    let mut probe_samples = rows(&base, texels..base.rows());
    for weights in &found.weights {
        let mode = combine(responses.iter().map(|r| &r.rest), weights);
        let of_base = combine(responses.iter().map(|r| &r.of_base), weights);
        let mut mode_vector = combine(responses.iter().map(|r| &r.vector), weights);
        let own_part = multiply(own.vector.view(), of_base.view());
        mode_vector = difference(&mode_vector, &own_part);
        irradiance = beside(&irradiance, &rows(&mode, 0..texels));
        probe_samples = beside(&probe_samples, &rows(&mode, texels..mode.rows()));
        vector = beside(&vector, &mode_vector);
    }
    let all = stack(&irradiance, &probe_samples);
    let added = Matrix::from_columns(
        all.rows(),
        &(base.columns()..all.columns())
            .map(|j| all.column(j))
            .collect::<Vec<_>>(),
    );
    let operators: Vec<Matrix<f64>> = responses
        .iter()
        .map(|r| {
            let of_added = transpose_multiply(added.view(), r.rest.view());
            stack(&r.of_base, &of_added)
        })
        .collect();
    JointBasis {
        irradiance,
        probes: samples.to_sh(&probe_samples, PROBE_WEIGHT),
        vector,
        joint_from_response: operators
            .chunks(frames)
            .map(<[Matrix<f64>]>::to_vec)
            .collect(),
        dropped_energy: found.dropped_energy(&responses, scales),
    }
}

/// The response modes as they enter through one opening of a shape.
struct Response {
    /// Outputs of the shape x response modes.
    field: Matrix<f64>,
    /// 4 texels x response modes, or no rows.
    vector: Matrix<f64>,
    /// Coefficients of the own modes nearest to them.
    of_base: Matrix<f64>,
    /// What those leave.
    rest: Matrix<f64>,
}

/// Response modes brought to the walls, probes and vector irradiance of a shape behind one of its openings.
pub fn response_at(
    shape: &Shape,
    opening: Face,
    is_exchanged: bool,
    response: &ResponseBasis,
    resolution: usize,
    probes: usize,
) -> (Matrix<f64>, Matrix<f64>) {
    let mut frame = frame_of_heading(opening.opposite());
    if is_exchanged {
        frame = frame.after(CubeSymmetry::exchange(0, 1));
    }
    let back = frame.inverse();
    let texels: Vec<Option<usize>> = shape
        .texels(resolution)
        .map(|(face, center)| {
            if shape.is_in_hole(face, center) {
                return None;
            }
            texel_at(&RECEIVER, back.face(face), back.point(center), resolution)
        })
        .collect();
    let walls = RECEIVER.texel_count(resolution);
    let samples = probe_points(probes).flat_map(|point| {
        DIRECTIONS.iter().map(move |direction| {
            let direction: IVec3 = back.direction(direction.as_dvec3()).as_ivec3();
            walls + probe_sample(back.point(point), direction, probes)
        })
    });
    let sources: Vec<Option<usize>> = texels.iter().copied().chain(samples.map(Some)).collect();
    let field = Matrix::from_fn(sources.len(), response.basis.columns(), |i, j| {
        sources[i].map_or(0.0, |row| response.basis[(row, j)])
    });
    if response.vector.rows() == 0 {
        return (field, Matrix::zeros(0, response.basis.columns()));
    }
    // Tangents turn with the frame.
    let turns: Vec<[[f64; 2]; 2]> = shape
        .texels(resolution)
        .map(|(face, _)| {
            let [u, v, _] = texel_axes(face);
            let [from_u, from_v, _] = texel_axes(back.face(face));
            let image = |d: DVec3| [frame.direction(d).dot(u), frame.direction(d).dot(v)];
            [image(from_u), image(from_v)]
        })
        .collect();
    let vector = Matrix::from_fn(4 * texels.len(), response.vector.columns(), |i, j| {
        let Some(row) = texels[i / 4] else { return 0.0 };
        let at = |k: usize| response.vector[(4 * row + k, j)];
        let [from_u, from_v] = turns[i / 4];
        // Order 1, v, normal, u.
        match i % 4 {
            1 => at(3) * from_u[1] + at(1) * from_v[1],
            3 => at(3) * from_u[0] + at(1) * from_v[0],
            k => at(k),
        }
    });
    (field, vector)
}

/// Modes as weights of the responses' columns.
struct Extra {
    weights: Vec<Vec<f64>>,
    kept_energy: f64,
}

impl Extra {
    fn dropped_energy(&self, responses: &[Response], scales: &[f64]) -> f64 {
        let energy = |m: &Matrix<f64>| {
            let norm = m.scaled_columns(scales).frobenius_norm();
            norm * norm
        };
        let all: f64 = responses.iter().map(|r| energy(&r.field)).sum();
        let rest: f64 = responses.iter().map(|r| energy(&r.rest)).sum();
        if all > 0.0 {
            (rest - self.kept_energy).max(0.0) / all
        } else {
            0.0
        }
    }
}

/// The largest singular vectors of what is left of all responses, class by class (method of snapshots).
fn extra_modes(
    classes: &ParityClasses,
    responses: &[Response],
    scales: &[f64],
    extra: usize,
) -> Extra {
    if responses.is_empty() || extra == 0 {
        return Extra {
            weights: Vec::new(),
            kept_energy: 0.0,
        };
    }
    let columns: Vec<(usize, usize)> = (0..responses.len())
        .flat_map(|r| (0..scales.len()).map(move |k| (r, k)))
        .collect();
    let parts: Vec<(Matrix<f64>, GramModes)> = (0..classes.class_count())
        .map(|class| {
            let folded: Vec<Vec<f64>> = columns
                .iter()
                .map(|&(r, k)| {
                    let mut signal = classes.fold(class, responses[r].rest.column(k));
                    signal.iter_mut().for_each(|x| *x *= scales[k]);
                    signal
                })
                .collect();
            let folded = Matrix::from_columns(classes.dimension(class), &folded);
            let modes = GramModes::of(&gram_of_columns(&folded));
            (folded, modes)
        })
        .collect();
    let values = parts.iter().map(|(_, part)| &part.singular_values[..]);
    let mut choice = ModeChoice::largest(values, extra);
    // A frame pays for every mode, so not even the first multiplet may exceed what is asked for.
    choice.truncate(extra);
    let weights = choice.kept.iter().map(|&ParityMode { class, position }| {
        let (folded, part) = &parts[class];
        let vector = part.vectors.column(position);
        // Mirrors exchange openings and modes, so the weights of a class's part of the columns are those of the
        // columns themselves.
        let sign = largest_entry_sign(&combined_columns(folded, vector));
        let scale = sign / part.singular_values[position];
        let weights = vector.iter().zip(&columns);
        weights
            .map(|(w, &(_, mode))| w * scale * scales[mode])
            .collect()
    });
    Extra {
        weights: weights.collect(),
        kept_energy: choice.scales().iter().map(|s| s * s).sum(),
    }
}

/// Sum of all columns of several matrices with weights.
fn combine<'a>(parts: impl Iterator<Item = &'a Matrix<f64>>, weights: &[f64]) -> Matrix<f64> {
    let mut sum: Option<Matrix<f64>> = None;
    let mut next = 0;
    for part in parts {
        let own = Matrix::from_column_major(
            part.columns(),
            1,
            weights[next..next + part.columns()].to_vec(),
        );
        next += part.columns();
        let term = multiply(part.view(), own.view());
        sum = Some(match sum {
            None => term,
            Some(mut sum) => {
                for (s, &x) in sum.data_mut().iter_mut().zip(term.data()) {
                    *s += x;
                }
                sum
            }
        });
    }
    sum.unwrap_or_else(|| Matrix::zeros(0, 1))
}

fn difference(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)] - b[(i, j)])
}

/// One matrix to the right of another.
fn beside(left: &Matrix<f64>, right: &Matrix<f64>) -> Matrix<f64> {
    let data = [left.data(), right.data()].concat();
    Matrix::from_column_major(left.rows(), left.columns() + right.columns(), data)
}
