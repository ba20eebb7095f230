//! One basis per shape, for the light of its own walls and for the light of other blocks.
//!
//! The paper expands light from other blocks in a basis of its own for each opening, which is the largest
//! stage of a frame in a large level. Both kinds of light are smooth on the same walls, so a basis for the first
//! needs few more columns to hold the second too. Its first columns are `U_b` itself, so that a block's own
//! coefficients need no projection. The others are the singular vectors of what `U_b` leaves of the responses.

use crate::matrix_parts::{add_to, difference, rows, side_by_side, stack};
use crate::modular::outputs::probe_samples::{PROBE_WEIGHT, ProbeSamples};
use crate::modular::paths::arrival::ArrivingLight;
use mrt_core::linalg::least_squares::pseudo_inverse;
use mrt_core::linalg::matrix::{Matrix, multiply, transpose_multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{
    GramModes, ModeChoice, ParityMode, combined_columns, gram_of_columns,
};
use mrt_core::linalg::svd::largest_entry_sign;

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

/// What a joint basis is made from.
pub struct JointInput<'a> {
    /// Light of the shape's own modes.
    pub own: &'a OwnLight,
    /// Light that enters: for each opening, in each of its frames.
    pub arriving: Vec<ArrivingLight>,
    /// Number of frames at each opening.
    pub frames: usize,
    /// How much each response mode counts: its singular value.
    pub scales: &'a [f64],
    /// Parity classes of the outputs: texels, then samples of probes.
    pub classes: &'a ParityClasses,
    /// Largest number of modes that light from other blocks adds.
    pub extra_modes: usize,
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
    /// For each opening, and in each of its frames, joint modes x response modes.
    pub joint_from_response: Vec<Vec<Matrix<f64>>>,
    /// Fraction of the energy of light from other blocks that the basis does not hold.
    pub dropped_energy: f64,
}

/// Adds modes to a shape's own for the light that enters through its openings.
pub fn joint_basis(input: JointInput) -> JointBasis {
    let JointInput {
        own,
        scales,
        classes,
        ..
    } = input;
    let samples = ProbeSamples::default();
    let texels = own.irradiance.rows();
    let base = stack(&[&own.irradiance, &samples.from_sh(&own.probes, PROBE_WEIGHT)]);
    let responses = split_responses(&base, input.arriving);
    let extra = extra_modes(classes, &responses, scales, input.extra_modes);
    let extra_outputs = extra.combined(&responses, base.rows(), |r| &r.rest);
    let arriving_vector = extra.combined(&responses, own.vector.rows(), |r| &r.vector);
    let of_base = extra.combined(&responses, base.columns(), |r| &r.of_base);
    let own_vector = multiply(own.vector.view(), of_base.view());
    let extra_vector = difference(&arriving_vector, &own_vector);
    let all = side_by_side(&[&base, &extra_outputs]);
    let operators: Vec<Matrix<f64>> = responses
        .iter()
        .map(|r| {
            let of_extra = transpose_multiply(extra_outputs.view(), r.rest.view());
            stack(&[&r.of_base, &of_extra])
        })
        .collect();
    JointBasis {
        irradiance: rows(&all, 0..texels),
        probes: samples.to_sh(&rows(&all, texels..all.rows()), PROBE_WEIGHT),
        vector: side_by_side(&[&own.vector, &extra_vector]),
        joint_from_response: operators
            .chunks(input.frames)
            .map(<[Matrix<f64>]>::to_vec)
            .collect(),
        dropped_energy: extra.dropped_energy(&responses, scales),
    }
}

/// The response modes as they enter through one opening of a shape.
struct Response {
    /// Outputs of the shape x response modes.
    outputs: Matrix<f64>,
    /// 4 texels x response modes, or no rows.
    vector: Matrix<f64>,
    /// Coefficients of the own modes nearest to the outputs.
    of_base: Matrix<f64>,
    /// What the own modes leave of the outputs.
    rest: Matrix<f64>,
}

/// Splits what arrives into the part that the own modes (outputs x modes) hold, and the rest.
fn split_responses(base: &Matrix<f64>, arriving: Vec<ArrivingLight>) -> Vec<Response> {
    let gram = transpose_multiply(base.view(), base.view());
    // The coefficients of the columns whose sum is nearest to a signal.
    let nearest = multiply(pseudo_inverse(&gram).view(), base.transposed().view());
    let split = |ArrivingLight { outputs, vector }| {
        let of_base = multiply(nearest.view(), outputs.view());
        let rest = difference(&outputs, &multiply(base.view(), of_base.view()));
        Response {
            outputs,
            vector,
            of_base,
            rest,
        }
    };
    arriving.into_iter().map(split).collect()
}

/// Modes that are added to a shape's own.
struct ExtraModes {
    /// For each mode, the weights of the columns of all responses, one response after the other.
    weights: Vec<Vec<f64>>,
    kept_energy: f64,
}

impl ExtraModes {
    /// The modes (`rows` x modes) as sums of the columns of one part of all responses.
    fn combined(
        &self,
        responses: &[Response],
        rows: usize,
        part: impl Fn(&Response) -> &Matrix<f64>,
    ) -> Matrix<f64> {
        let columns: Vec<Vec<f64>> = self
            .weights
            .iter()
            .map(|weights| {
                let mut sum = Matrix::zeros(rows, 1);
                let mut rest = &weights[..];
                for part in responses.iter().map(&part) {
                    let (own, others) = rest.split_at(part.columns());
                    rest = others;
                    let own = Matrix::from_column_major(own.len(), 1, own.to_vec());
                    add_to(&mut sum, &multiply(part.view(), own.view()));
                }
                sum.data().to_vec()
            })
            .collect();
        Matrix::from_columns(rows, &columns)
    }

    /// Fraction of the responses' energy that neither the own modes nor these hold.
    fn dropped_energy(&self, responses: &[Response], scales: &[f64]) -> f64 {
        let energy = |m: &Matrix<f64>| {
            let norm = m.scaled_columns(scales).frobenius_norm();
            norm * norm
        };
        let all: f64 = responses.iter().map(|r| energy(&r.outputs)).sum();
        let rest: f64 = responses.iter().map(|r| energy(&r.rest)).sum();
        if all > 0.0 {
            (rest - self.kept_energy).max(0.0) / all
        } else {
            0.0
        }
    }
}

/// The largest singular vectors of what the own modes leave of all responses, class by class.
fn extra_modes(
    classes: &ParityClasses,
    responses: &[Response],
    scales: &[f64],
    modes: usize,
) -> ExtraModes {
    if responses.is_empty() || modes == 0 {
        return ExtraModes {
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
    let mut choice = ModeChoice::largest(values, modes);
    // A frame pays for every mode, so not even the first multiplet may exceed what is asked for.
    choice.truncate(modes);
    let weights = choice.kept.iter().map(|&ParityMode { class, position }| {
        let (folded, part) = &parts[class];
        let vector = part.vectors.column(position);
        let sign = largest_entry_sign(&combined_columns(folded, vector));
        let scale = sign / part.singular_values[position];
        // Mirrors exchange openings and response modes. So these weights, which were found for the class's part of the
        // columns, give the columns themselves the parity of the class.
        let weights = vector.iter().zip(&columns);
        weights
            .map(|(w, &(_, mode))| w * scale * scales[mode])
            .collect()
    });
    ExtraModes {
        weights: weights.collect(),
        kept_energy: choice.scales().iter().map(|s| s * s).sum(),
    }
}
