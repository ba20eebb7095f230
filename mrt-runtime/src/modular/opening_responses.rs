//! `T_b->r` in the form of the paper, for tools that compare with it: responses for each opening that light enters by,
//! before [`Scene::assemble`](crate::modular::scene::Scene::assemble) projects them on joint bases (Loos et al. 2011,
//! section 6.3).

use crate::level::block::Level;
use crate::level::block_index::BlockIndex;
use crate::modular::assemble::config::AssembleConfig;
use crate::modular::assemble::error::AssembleError;
use crate::modular::assemble::lookup::{usable_coupling, used_operators};
use crate::modular::dictionary::{Dictionary, OperatorMatrix};
use crate::modular::propagate::context::PropagationContext;
use crate::modular::propagate::follow_all;
use crate::modular::scene::SceneData;
use mrt_core::linalg::matrix::Matrix;

/// Responses to the light of one block behind one opening of another.
#[derive(Clone, Debug)]
pub struct OpeningResponses {
    /// The block that light enters.
    pub target: BlockIndex,
    /// Position, in the openings of that block's shape, of the opening that light enters by.
    pub opening: usize,
    /// Whether responses are in the opening's frame with x and y exchanged. Always false in levels whose openings all
    /// have +y up.
    pub exchanged: bool,
    /// The block that light comes from.
    pub source: BlockIndex,
    /// Response modes x coefficients b of the source.
    pub responses: Matrix<f32>,
}

/// All responses of a scene, source by source, with open doors. Multiplied by `U_r` of each opening, they make the same
/// light as the scene; `U_r` is the joint basis times
/// [`joint_from_response`](crate::modular::dictionary::OpeningOperators::joint_from_response).
///
/// Cost: the time of assembling the scene again, and k_r x k_b numbers for each opening and source.
///
/// # Errors
/// [`AssembleError`], if a scene cannot be assembled from the level, the dictionary and the settings.
pub fn responses_by_opening(
    level: &Level,
    scene: &SceneData,
    dictionary: &Dictionary<impl OperatorMatrix>,
    config: &AssembleConfig,
) -> Result<Vec<OpeningResponses>, AssembleError> {
    let (used, _) = used_operators(level, dictionary)?;
    let config = AssembleConfig {
        coupling: usable_coupling(level, dictionary, config.coupling)?,
        ..config.clone()
    };
    let context = PropagationContext::new(scene, dictionary, &used, &config);
    let mut all = Vec::new();
    follow_all(&context, |source, arrivals| {
        for (key, responses) in arrivals {
            let target = &scene.level.blocks[key.block.get()];
            let mut openings = target.shape.openings.iter();
            if let Some(opening) = openings.position(|opening| opening.face == key.face) {
                all.push(OpeningResponses {
                    target: key.block,
                    opening,
                    exchanged: key.exchanged,
                    source,
                    responses,
                });
            }
        }
        Ok(())
    })?;
    Ok(all)
}
