//! Joins a level and a dictionary into a scene (Loos et al. 2011, sections 6.2 and 6.3).

pub mod config;
pub mod error;
pub(crate) mod lookup;
pub(crate) mod place;
mod texels;

use crate::level::block::Level;
use crate::modular::assemble::config::{AssembleConfig, MAX_DEPTH};
use crate::modular::assemble::error::AssembleError;
use crate::modular::dictionary::{Dictionary, OperatorMatrix, ShapeOperators};
use crate::modular::packed::{Operators, PackedShape, PackedTransport};
use crate::modular::propagate;
use crate::modular::scene::{Scene, SceneData};
use crate::output::lightmap_atlas::LightmapAtlas;
use mrt_core::storage::Storage;

/// Bytes of positions, normals, albedo, emission, frame buffers and lightmap for each texel.
const BYTES_PER_TEXEL: usize = 4 * 12 + 4 * 12 + 2 * 12;

impl Scene {
    /// Checks the level, looks up its shapes and assembles `T_b->r`. From a
    /// [`StoredDictionary`](crate::modular::dictionary::StoredDictionary), only the operators that the level uses are
    /// decoded. The scene borrows neither the level nor the dictionary.
    ///
    /// Cost: by the path table, a k_r x k_e x k_b product for each path of a shape's light, and the addition of one
    /// such matrix for each path in the level; by lightfields, a k_rlf x k_rlf x k_b product for each opening crossed.
    /// A maze of 13 blocks takes 30 ms on one core, a maze of 10,000 blocks 20 s: assemble large levels on a thread of
    /// their own.
    ///
    /// # Errors
    /// [`AssembleError`], if the level is refused, the dictionary lacks an operator, a setting is out of range, or the
    /// scene would exceed [`AssembleConfig::max_bytes`].
    pub fn assemble(
        level: &Level,
        dictionary: &Dictionary<impl OperatorMatrix>,
        config: &AssembleConfig,
    ) -> Result<Scene, AssembleError> {
        // 1. Check the level and the settings.
        level.check()?;
        check_config(config)?;
        // 2. Look up the operators of each block.
        let (used, operators_of_block) = lookup::used_operators(level, dictionary)?;
        let config = &AssembleConfig {
            coupling: lookup::usable_coupling(level, dictionary, config.coupling)?,
            ..config.clone()
        };
        // 3. Bring blocks to their canonical frames.
        let placed = place::place_level(level, dictionary)?;
        let operator_bytes = bytes_left(config, placed.texel_count())?;
        let blocks = place::scene_blocks(level, &used, &operators_of_block);
        // 4. Pack the operators of each shape.
        let areas = texels::shape_areas(level, &placed, &blocks, &used);
        let shapes: Vec<PackedShape> = used
            .iter()
            .zip(&areas)
            .map(|(&entry, areas)| {
                pack_shape(entry, areas, dictionary.resolution, config.shape_storage)
            })
            .collect();
        // 5. Lay out texels, coefficients and lightmap.
        let layout = texels::texel_layout(&blocks, &shapes);
        let mut data = SceneData {
            texels: texels::texel_geometry(&placed, &layout),
            atlas: LightmapAtlas::new(&placed, &layout),
            rows: texels::coefficient_layout(&shapes),
            transport: PackedTransport::default(),
            probes: dictionary.probes,
            level: placed,
            blocks,
            shapes,
            layout,
        };
        // 6. Follow light from block to block.
        data.transport =
            propagate::joint_from_coefficients(&data, dictionary, &used, config, operator_bytes)?;
        Ok(Scene::new(data))
    }
}

fn check_config(config: &AssembleConfig) -> Result<(), AssembleError> {
    if config.max_depth > MAX_DEPTH {
        return Err(AssembleError::Depth {
            found: config.max_depth,
        });
    }
    match config.negligible {
        Some(found) if !(0.0..1.0).contains(&found) => Err(AssembleError::Negligible { found }),
        _ => Ok(()),
    }
}

/// Bytes that operators may take: those that texels leave of [`AssembleConfig::max_bytes`].
fn bytes_left(config: &AssembleConfig, texels: usize) -> Result<usize, AssembleError> {
    let found = BYTES_PER_TEXEL * texels;
    config
        .max_bytes
        .checked_sub(found)
        .ok_or(AssembleError::TooLarge {
            expected: config.max_bytes,
            found,
        })
}

fn pack_shape(
    entry: &ShapeOperators<impl OperatorMatrix>,
    areas: &[f32],
    resolution: usize,
    storage: Storage,
) -> PackedShape {
    let operators = Operators {
        coefficients_from_direct: &entry.coefficients_from_direct.decode(),
        joint_basis: &entry.joint_basis.decode(),
        probe_basis: &entry.probe_basis.decode(),
        vector_basis: &entry.vector_basis.decode(),
        areas,
    };
    PackedShape::new(entry.shape, resolution, &operators, storage)
}
