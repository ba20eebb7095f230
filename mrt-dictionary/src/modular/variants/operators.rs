//! The operators of one warped block.

use crate::config::{Enrichment, PriorConfig};
use crate::matrix_parts::{rows, scaled_rows, stack};
use crate::modular::joint::{JointBasis, JointInput, OwnLight, joint_basis};
use crate::modular::light_prior::warped::{
    warped_direct_samples, warped_light_radius, warped_prior_lights,
};
use crate::modular::one_bounce::warped::warped_bounce;
use crate::modular::outputs::probe_samples::{PROBE_WEIGHT, ProbeSamples};
use crate::modular::outputs::warped::{warped_probe_light, warped_vector_irradiance};
use crate::modular::paths::arrival::ArrivingLight;
use crate::modular::paths::ends::{PathFrame, RECEIVER};
use crate::modular::paths::response::ResponseBasis;
use crate::modular::paths::warped::OpeningView;
use crate::modular::surface::probes::{probe_points, probe_sample_count};
use crate::modular::surface::walls::cube::wall_fraction;
use crate::modular::surface::walls::warped::WarpedWalls;
use crate::modular::transport::warped::{RebuildConfig, rebuilt, regathered};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_runtime::Dictionary;
use mrt_runtime::blocks::WarpTransport;
use mrt_runtime::low_level::level::shape::Outline;
use mrt_runtime::low_level::level::warp_form::{WarpForm, warp_of};
use mrt_runtime::low_level::modular::dictionary::{OpeningOperators, ShapeOperators, Sources};

/// The response basis as a bake has it, without vector irradiance and without the operators of paths. A dictionary does not
/// store its scales; they follow from what shapes emit and what the paths make of that.
pub(super) fn stored_response(dictionary: &Dictionary, sources: &Sources) -> ResponseBasis {
    let walls = RECEIVER.texel_count(dictionary.resolution);
    let stored: Matrix<f64> = sources.response_basis.cast();
    let probes = rows(&stored, walls..stored.rows());
    let samples = ProbeSamples::default().from_sh(&probes, PROBE_WEIGHT);
    let basis = stack(&[&rows(&stored, 0..walls), &samples]);
    let mut emitted = vec![0.0; dictionary.paths.emission_parity.len()];
    for sent in dictionary
        .shapes
        .iter()
        .flat_map(|shape| &shape.openings)
        .flat_map(|opening| &opening.emission_from_coefficients)
    {
        for (k, sum) in emitted.iter_mut().enumerate() {
            *sum += (0..sent.columns())
                .map(|j| f64::from(sent[(k, j)]))
                .map(|x| x * x)
                .sum::<f64>();
        }
    }
    let emitted: Vec<f64> = emitted.into_iter().map(f64::sqrt).collect();
    let mut squares = vec![0.0; basis.columns()];
    for entry in &dictionary.paths.entries {
        let operator: Matrix<f64> = entry.response_from_emission.cast();
        let light = operator.scaled_columns(&emitted);
        let norm = light.frobenius_norm();
        if norm > 0.0 {
            for (k, square) in squares.iter_mut().enumerate() {
                *square += (0..light.columns())
                    .map(|j| light[(k, j)] * light[(k, j)] / norm)
                    .sum::<f64>();
            }
        }
    }
    ResponseBasis {
        vector: Matrix::zeros(0, basis.columns()),
        basis,
        scales: squares.into_iter().map(f64::sqrt).collect(),
        parity: dictionary.paths.response_parity.clone(),
        dropped_energy: f64::from(dictionary.paths.response_dropped_energy),
        paths: Vec::new(),
    }
}

/// What the variants of one shape are made from.
pub(super) struct VariantContext<'a> {
    pub dictionary: &'a Dictionary,
    pub sources: &'a Sources,
    /// The dictionary's response basis ([`stored_response`]).
    pub response: &'a ResponseBasis,
    /// Lights of the prior of rebuilt blocks.
    pub prior: &'a PriorConfig,
    /// Enrichment of that prior.
    pub enrichment: Option<&'a Enrichment>,
    /// The canonical operators of the shape.
    pub canonical: &'a ShapeOperators,
}

/// A block's own transport, in terms of plain texel values.
struct OwnTransport {
    coefficients_from_direct: Matrix<f64>,
    implicit_lighting: Matrix<f64>,
    indirect_basis: Matrix<f64>,
    singular_values: Vec<f32>,
    dropped_energy: f32,
}

impl VariantContext<'_> {
    /// The operators of a block of this shape with a form and a transport.
    pub fn operators(&self, form: &WarpForm, transport: WarpTransport) -> ShapeOperators {
        let canonical = self.canonical;
        let shape = canonical.shape;
        let faces: Vec<Face> = shape.walls().collect();
        let walls = WarpedWalls::new(&faces, self.dictionary.resolution, &warp_of(form));
        let own = self.own_transport(&walls, transport);
        let frames = self.frames();
        let samples = probe_sample_count(self.dictionary.probes);
        let joint = joint_basis(JointInput {
            own: &self.own_light(&walls, &own),
            arriving: self.arriving_light(&walls, frames),
            frames: frames.len(),
            scales: &self.response.scales,
            classes: &ParityClasses::new(walls.texel_count() + samples, &[]),
            extra_modes: canonical.joint_modes() - canonical.modes(),
        });
        ShapeOperators {
            shape,
            coefficients_from_direct: own.coefficients_from_direct.cast(),
            openings: self.openings(&walls, &own.implicit_lighting, &joint, frames),
            joint_basis: joint.irradiance.cast(),
            probe_basis: joint.probes.cast(),
            vector_basis: joint.vector.cast(),
            implicit_lighting: own.implicit_lighting.cast(),
            singular_values: own.singular_values,
            dropped_energy: own.dropped_energy,
            joint_dropped_energy: joint.dropped_energy as f32,
        }
    }

    /// The frames in which the dictionary knows light at openings.
    fn frames(&self) -> &'static [PathFrame] {
        let openings = self.canonical.openings.first();
        let count = openings.map_or(1, |opening| opening.joint_from_response.len());
        &PathFrame::ALL[..count]
    }

    fn own_transport(&self, walls: &WarpedWalls, transport: WarpTransport) -> OwnTransport {
        let canonical = self.canonical;
        let bounce = self.bounce(walls);
        if transport != WarpTransport::Rebuilt {
            let implicit_lighting: Matrix<f64> = canonical.implicit_lighting.cast();
            return OwnTransport {
                coefficients_from_direct: canonical.coefficients_from_direct.cast(),
                indirect_basis: regathered(&bounce, &implicit_lighting),
                implicit_lighting,
                singular_values: canonical.singular_values.clone(),
                dropped_energy: canonical.dropped_energy,
            };
        }
        let prior = self.prior;
        // Lights beyond a hole are left out: they would have to be cut to what the hole shows.
        let openings: Vec<Face> = canonical
            .shape
            .openings
            .iter()
            .filter(|opening| opening.outline == Outline::Whole)
            .map(|opening| opening.face)
            .collect();
        let lights = warped_prior_lights(walls, &openings, prior.lights_per_axis);
        let radius = warped_light_radius(walls, prior.light_radius);
        let samples = warped_direct_samples(walls, &lights, radius);
        let config = RebuildConfig {
            modes: canonical.modes(),
            enrichment: self.enrichment.cloned(),
        };
        let own = rebuilt(walls, &bounce, &samples, &config);
        let modes = own.implicit_lighting.columns();
        OwnTransport {
            coefficients_from_direct: own.coefficients_from_direct,
            implicit_lighting: own.implicit_lighting,
            indirect_basis: own.indirect_basis,
            singular_values: own.singular_values[..modes]
                .iter()
                .map(|&s| s as f32)
                .collect(),
            dropped_energy: own.dropped_energy as f32,
        }
    }

    /// F of the warped walls. What is in a hole neither sends nor receives.
    fn bounce(&self, walls: &WarpedWalls) -> Matrix<f64> {
        let shape = self.canonical.shape;
        let bounce = warped_bounce(walls);
        let texels: Vec<(f64, f64)> = walls
            .unit_texels()
            .map(|(face, center)| {
                let receives = if shape.is_in_hole(face, center) {
                    0.0
                } else {
                    1.0
                };
                (
                    receives,
                    wall_fraction(shape, face, center, walls.resolution),
                )
            })
            .collect();
        Matrix::from_fn(bounce.rows(), bounce.columns(), |i, j| {
            bounce[(i, j)] * texels[i].0 * texels[j].1
        })
    }

    /// What the block's own modes do to its walls and probes.
    fn own_light(&self, walls: &WarpedWalls, own: &OwnTransport) -> OwnLight {
        let shape = self.canonical.shape;
        let fractions: Vec<f64> = shape
            .texels(walls.resolution)
            .map(|(face, center)| wall_fraction(shape, face, center, walls.resolution))
            .collect();
        let sent = scaled_rows(&own.implicit_lighting, &fractions);
        let points: Vec<DVec3> = probe_points(self.dictionary.probes)
            .map(|unit| walls.warp.point(unit))
            .collect();
        let has_vector = self.canonical.vector_basis.rows() > 0;
        OwnLight {
            irradiance: own.indirect_basis.clone(),
            probes: warped_probe_light(walls, &points, &sent),
            vector: if has_vector {
                warped_vector_irradiance(walls, &sent)
            } else {
                Matrix::zeros(0, sent.columns())
            },
        }
    }

    /// What enters through each opening, in each frame.
    fn arriving_light(&self, walls: &WarpedWalls, frames: &[PathFrame]) -> Vec<ArrivingLight> {
        let canonical = self.canonical;
        let shape = canonical.shape;
        let vector_basis: Matrix<f64> = canonical.vector_basis.cast();
        let mut all = Vec::with_capacity(shape.openings.len() * frames.len());
        for (aperture, operators) in shape.openings.iter().zip(&canonical.openings) {
            let view = OpeningView::new(shape, walls, aperture);
            for (&frame, joint_from_response) in frames.iter().zip(&operators.joint_from_response) {
                // Response modes are stored without directions; the canonical joint basis has them.
                let vector = match vector_basis.rows() {
                    0 => Matrix::zeros(0, joint_from_response.columns()),
                    _ => multiply(vector_basis.view(), joint_from_response.cast().view()),
                };
                let probes = self.dictionary.probes;
                all.push(view.arriving_light(frame, self.response, probes, &vector));
            }
        }
        all
    }

    /// What leaves through each opening, and what the joint basis makes of what enters.
    fn openings(
        &self,
        walls: &WarpedWalls,
        implicit_lighting: &Matrix<f64>,
        joint: &JointBasis,
        frames: &[PathFrame],
    ) -> Vec<OpeningOperators> {
        let from_radiosity: Matrix<f64> = self.sources.emission_from_radiosity.cast();
        let shape = self.canonical.shape;
        let openings = shape.openings.iter().zip(&joint.joint_from_response);
        openings
            .map(|(aperture, joint_from_response)| {
                let view = OpeningView::new(shape, walls, aperture);
                let emission = frames.iter().map(|&frame| {
                    let sent = view.emitter_radiosity(frame, implicit_lighting);
                    multiply(from_radiosity.view(), sent.view()).cast()
                });
                OpeningOperators {
                    emission_from_coefficients: emission.collect(),
                    joint_from_response: joint_from_response.iter().map(Matrix::cast).collect(),
                }
            })
            .collect()
    }
}
