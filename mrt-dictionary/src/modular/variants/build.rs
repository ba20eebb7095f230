//! Operators for the warped blocks of a level, from nothing but a dictionary: a list of calls, like [`crate::modular::bake`].
//!
//! A variant's responses and emission are in the dictionary's own modes, so that blocks with and without variants
//! exchange light through the same table of paths.

use crate::config::{Enrichment, PriorConfig};
use crate::modular::joint::{ForeignLight, JointBasis, OwnLight, joint_basis_of};
use crate::modular::light_prior::warped::{
    warped_direct_samples, warped_light_radius, warped_prior_lights,
};
use crate::modular::one_bounce::cube::wall_fraction;
use crate::modular::one_bounce::warped::{WarpedWalls, warped_bounce};
use crate::modular::outputs::cube::{PROBE_WEIGHT, ProbeSamples, probe_points};
use crate::modular::outputs::warped::{warped_probe_light, warped_vector_irradiance};
use crate::modular::paths::response::{ResponseBasis, rows, stack};
use crate::modular::paths::transport::RECEIVER;
use crate::modular::paths::warped::OpeningView;
use crate::modular::transport::warped::{RebuildConfig, rebuilt, regathered};
use crate::progress::{Cancelled, Progress};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::linalg::parity::ParityClasses;
use mrt_runtime::blocks::{Shape, WarpTransport};
use mrt_runtime::low_level::level::shape::Outline;
use mrt_runtime::low_level::level::warp_form::{WarpForm, form_of, same_form, warp_of};
use mrt_runtime::low_level::modular::dictionary::{
    OpeningOperators, ShapeOperators, Sources, Variant,
};
use mrt_runtime::{Dictionary, Level};

/// What making variants is free to choose.
#[derive(Clone, Debug, PartialEq)]
pub struct VariantConfig {
    /// Lights for rebuilding.
    pub prior: PriorConfig,
    /// Appendix A for rebuilding.
    pub enrichment: Option<Enrichment>,
}

impl Default for VariantConfig {
    fn default() -> Self {
        Self {
            prior: PriorConfig::default(),
            enrichment: Some(Enrichment::default()),
        }
    }
}

/// Why there are no variants.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VariantError {
    /// The dictionary was packed.
    #[error(
        "the dictionary has no {found}, which warped blocks are computed from; expected a full dictionary, as \
         `mrt bake` writes it (packed ones leave it out)"
    )]
    NoSources {
        /// What is missing.
        found: &'static str,
    },
    /// The dictionary lacks a shape.
    #[error("block {block}: the dictionary has no shape `{shape}`")]
    MissingShape {
        /// Which block.
        block: usize,
        /// Its shape.
        shape: &'static str,
    },
    /// A round tube has canonical operators only.
    #[error("block {block}: shape `{shape}` is round; expected transport \"canonical\"")]
    Tube {
        /// Which block.
        block: usize,
        /// Its shape.
        shape: &'static str,
    },
    /// A shape with a hole is to be rebuilt.
    #[error(
        "block {block}: shape `{shape}` has a hole in a wall and cannot be rebuilt for its warp; expected transport \
         \"regathered\" or \"canonical\""
    )]
    Hole {
        /// Which block.
        block: usize,
        /// Its shape.
        shape: &'static str,
    },
    /// The caller stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Makes a variant for every shape, form and transport of the level's blocks that are not canonical.
///
/// The same inputs give the same bits on every machine and thread count. Cost at 16² on two cores: 1 s for a
/// re-gathered and 2 s for a rebuilt block.
///
/// # Errors
/// [`VariantError`].
pub fn make_variants(
    level: &Level,
    dictionary: &Dictionary,
    config: &VariantConfig,
    progress: &Progress,
) -> Result<Vec<Variant>, VariantError> {
    let wanted = wanted(level, dictionary)?;
    if wanted.is_empty() {
        return Ok(Vec::new());
    }
    let sources = dictionary.sources.as_ref().ok_or(VariantError::NoSources {
        found: "emission and response bases",
    })?;
    let response = response_of(dictionary, sources);
    let steps = wanted.len();
    let mut variants = Vec::with_capacity(steps);
    for (step, (canonical, form, transport)) in wanted.into_iter().enumerate() {
        let texels = canonical.shape.texel_count(dictionary.resolution);
        if canonical.implicit_lighting.rows() != texels {
            return Err(VariantError::NoSources {
                found: "implicit lighting",
            });
        }
        let what = format!("{} {}", transport.name(), canonical.shape.name);
        progress.step(&what, step, steps)?;
        let operators = if canonical.shape.wall_count() == 0 {
            canonical.clone()
        } else {
            let maker = Maker {
                dictionary,
                sources,
                response: &response,
                config,
                canonical,
            };
            maker.operators(&form, transport)
        };
        variants.push(Variant {
            transport,
            corners: form,
            operators,
        });
    }
    progress.check()?;
    Ok(variants)
}

/// The distinct shapes, forms and transports of a level, in the order of its blocks.
fn wanted<'a>(
    level: &Level,
    dictionary: &'a Dictionary,
) -> Result<Vec<(&'a ShapeOperators, WarpForm, WarpTransport)>, VariantError> {
    let mut wanted: Vec<(&ShapeOperators, WarpForm, WarpTransport)> = Vec::new();
    for (index, block) in level.blocks.iter().enumerate() {
        let position = dictionary
            .shape_index(block.shape)
            .ok_or(VariantError::MissingShape {
                block: index,
                shape: block.shape.name,
            })?;
        if block.transport != WarpTransport::Canonical && block.shape.tube().is_some() {
            return Err(VariantError::Tube {
                block: index,
                shape: block.shape.name,
            });
        }
        if block.transport == WarpTransport::Rebuilt && has_hole(block.shape) {
            return Err(VariantError::Hole {
                block: index,
                shape: block.shape.name,
            });
        }
        let form = form_of(block);
        let is_known = wanted.iter().any(|(entry, other, transport)| {
            entry.shape == block.shape && *transport == block.transport && same_form(other, &form)
        });
        if block.transport != WarpTransport::Canonical && !is_known {
            wanted.push((&dictionary.shapes[position], form, block.transport));
        }
    }
    Ok(wanted)
}

/// True for doors and windows: the symmetries of their walls, which a rebuild decomposes by, are not theirs.
pub fn has_hole(shape: &Shape) -> bool {
    let mut openings = shape.openings.iter();
    openings.any(|opening| matches!(opening.outline, Outline::Hole(_)))
}

/// The response basis as a bake has it. Its scales are not in the file; they follow from what shapes emit and what
/// paths make of it.
fn response_of(dictionary: &Dictionary, sources: &Sources) -> ResponseBasis {
    let walls = RECEIVER.texel_count(dictionary.resolution);
    let stored: Matrix<f64> = sources.response_basis.cast();
    let probes = rows(&stored, walls..stored.rows());
    let samples = ProbeSamples::default().from_sh(&probes, PROBE_WEIGHT);
    let basis = stack(&rows(&stored, 0..walls), &samples);
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
struct Maker<'a> {
    dictionary: &'a Dictionary,
    sources: &'a Sources,
    response: &'a ResponseBasis,
    config: &'a VariantConfig,
    canonical: &'a ShapeOperators,
}

/// Operators of the block's own light.
struct OwnTransport {
    coefficients_from_direct: Matrix<f64>,
    implicit_lighting: Matrix<f64>,
    indirect_basis: Matrix<f64>,
    singular_values: Vec<f32>,
    dropped_energy: f32,
}

impl Maker<'_> {
    fn operators(&self, form: &WarpForm, transport: WarpTransport) -> ShapeOperators {
        let (resolution, probes) = (self.dictionary.resolution, self.dictionary.probes);
        let shape = self.canonical.shape;
        let faces: Vec<Face> = shape.walls().collect();
        let walls = WarpedWalls::new(&faces, resolution, &warp_of(form));
        let own = self.own_transport(&walls, transport);
        let fractions: Vec<f64> = shape
            .texels(resolution)
            .map(|(face, center)| wall_fraction(shape, face, center, resolution))
            .collect();
        let sent = Matrix::from_fn(
            own.implicit_lighting.rows(),
            own.implicit_lighting.columns(),
            |i, j| fractions[i] * own.implicit_lighting[(i, j)],
        );
        let points: Vec<DVec3> = probe_points(probes)
            .map(|unit| walls.warp.point(unit))
            .collect();
        let has_vector = self.canonical.vector_basis.rows() > 0;
        let light = OwnLight {
            probes: warped_probe_light(&walls, &points, &sent),
            vector: if has_vector {
                warped_vector_irradiance(&walls, &sent)
            } else {
                Matrix::zeros(0, sent.columns())
            },
            irradiance: own.indirect_basis,
        };
        let frames = self
            .canonical
            .openings
            .first()
            .map_or(1, |opening| opening.joint_from_response.len());
        let samples = probes * probes * probes * crate::modular::outputs::cube::DIRECTIONS.len();
        let joint = joint_basis_of(
            &light,
            self.foreign_light(&walls, frames),
            &self.response.scales,
            &ParityClasses::new(walls.texel_count() + samples, &[]),
            self.canonical.joint_modes() - self.canonical.modes(),
            frames,
        );
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
        let prior = &self.config.prior;
        // Lights beyond a hole would have to be cut to what it shows.
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
            enrichment: self.config.enrichment.clone(),
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

    /// F of the warped walls; what is in a hole neither sends nor receives.
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

    /// What enters through each opening, in each frame.
    fn foreign_light(&self, walls: &WarpedWalls, frames: usize) -> Vec<ForeignLight> {
        let probes = self.dictionary.probes;
        let canonical = self.canonical;
        let shape = canonical.shape;
        let vector_basis: Matrix<f64> = canonical.vector_basis.cast();
        let mut all = Vec::with_capacity(shape.openings.len() * frames);
        for (aperture, operators) in shape.openings.iter().zip(&canonical.openings) {
            let view = OpeningView::new(shape, walls, aperture);
            for (frame, joint_from_response) in operators.joint_from_response.iter().enumerate() {
                let is_exchanged = frame == 1;
                // Response modes are stored without directions; the canonical joint basis has them.
                let vector = match vector_basis.rows() {
                    0 => Matrix::zeros(0, joint_from_response.columns()),
                    _ => multiply(vector_basis.view(), joint_from_response.cast().view()),
                };
                all.push(view.response(is_exchanged, self.response, probes, &vector));
            }
        }
        all
    }

    fn openings(
        &self,
        walls: &WarpedWalls,
        implicit_lighting: &Matrix<f64>,
        joint: &JointBasis,
        frames: usize,
    ) -> Vec<OpeningOperators> {
        let from_radiosity: Matrix<f64> = self.sources.emission_from_radiosity.cast();
        let openings = self.canonical.shape.openings.iter();
        openings
            .zip(&joint.joint_from_response)
            .map(|(aperture, joint_from_response)| {
                let view = OpeningView::new(self.canonical.shape, walls, aperture);
                let emission = (0..frames).map(|frame| {
                    let sent = view.emitter_radiosity(frame == 1, implicit_lighting);
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
