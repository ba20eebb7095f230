//! Operators for the warped blocks of a level, computed from a dictionary alone.
//!
//! A variant's responses and emission are in the dictionary's own modes, so that blocks with and without variants
//! exchange light through the same table of paths.

use crate::config::{Enrichment, PriorConfig};
use crate::modular::variants::operators::{VariantContext, stored_response};
use crate::progress::{Cancelled, Progress};
use mrt_runtime::blocks::{Shape, WarpTransport};
use mrt_runtime::low_level::level::shape::Outline;
use mrt_runtime::low_level::level::warp_form::{WarpForm, form_of, same_form};
use mrt_runtime::low_level::modular::dictionary::{ShapeOperators, Variant};
use mrt_runtime::{Dictionary, Level};

/// Settings of rebuilt operators; the other transports have none.
#[derive(Clone, Debug, PartialEq)]
pub struct VariantConfig {
    /// Lights of the prior on warped walls.
    pub prior: PriorConfig,
    /// Enrichment of that prior (appendix A); `None` leaves it as it is.
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

/// Why operators of warped blocks cannot be made, or the need for them cannot be measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VariantError {
    /// The dictionary was packed for shipping, and lacks what operators of warped blocks are computed from.
    #[error(
        "the dictionary has no {found}, which warped blocks are computed from; expected a full dictionary, as it was \
         baked (packed ones leave it out)"
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
    /// A shape with a hole in a wall cannot be rebuilt.
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
    /// The caller has asked to stop.
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
    let response = stored_response(dictionary, sources);
    let steps = wanted.len();
    let mut variants = Vec::with_capacity(steps);
    for (step, wanted) in wanted.into_iter().enumerate() {
        let Wanted {
            canonical,
            form,
            transport,
        } = wanted;
        let shape = canonical.shape;
        let texels = shape.texel_count(dictionary.resolution);
        if canonical.implicit_lighting.rows() != texels {
            return Err(VariantError::NoSources {
                found: "implicit lighting",
            });
        }
        let what = format!("{} {}", transport.name(), shape.name);
        progress.step(&what, step, steps)?;
        let operators = if shape.wall_count() == 0 {
            canonical.clone()
        } else {
            let context = VariantContext {
                dictionary,
                sources,
                response: &response,
                prior: &config.prior,
                enrichment: config.enrichment.as_ref(),
                canonical,
            };
            context.operators(&form, transport)
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

/// A variant that a level asks for.
struct Wanted<'a> {
    canonical: &'a ShapeOperators,
    form: WarpForm,
    transport: WarpTransport,
}

/// The distinct shapes, forms and transports of a level's blocks that are not canonical, in the order of its blocks.
fn wanted<'a>(level: &Level, dictionary: &'a Dictionary) -> Result<Vec<Wanted<'a>>, VariantError> {
    let mut wanted: Vec<Wanted> = Vec::new();
    for (index, block) in level.blocks.iter().enumerate() {
        let shape = block.shape;
        let position = dictionary
            .shape_index(shape)
            .ok_or(VariantError::MissingShape {
                block: index,
                shape: shape.name,
            })?;
        let transport = block.transport;
        if transport != WarpTransport::Canonical && shape.tube().is_some() {
            return Err(VariantError::Tube {
                block: index,
                shape: shape.name,
            });
        }
        if transport == WarpTransport::Rebuilt && has_hole(shape) {
            return Err(VariantError::Hole {
                block: index,
                shape: shape.name,
            });
        }
        let form = form_of(block);
        let is_known = wanted.iter().any(|other| {
            other.canonical.shape == shape
                && other.transport == transport
                && same_form(&other.form, &form)
        });
        if transport != WarpTransport::Canonical && !is_known {
            wanted.push(Wanted {
                canonical: &dictionary.shapes[position],
                form,
                transport,
            });
        }
    }
    Ok(wanted)
}

/// True for shapes with a door or a window. A rebuild decomposes by the symmetries of the walls, which the hole does not
/// have.
pub fn has_hole(shape: &Shape) -> bool {
    let mut openings = shape.openings.iter();
    openings.any(|opening| matches!(opening.outline, Outline::Hole(_)))
}
