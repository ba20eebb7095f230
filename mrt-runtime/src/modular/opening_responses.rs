//! `T_b->r` in the paper's form, for tools that compare with it: responses for each opening that light enters by, as
//! they are before [`Scene::assemble`](crate::modular::scene::Scene::assemble) projects them on joint bases (Loos et al. 2011, section 6.3).

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

/// How the light of one block answers behind one opening of another.
#[derive(Clone, Debug)]
pub struct OpeningResponses {
    /// Block that light enters.
    pub target: BlockIndex,
    /// Position in its shape's openings of the one that it enters by.
    pub opening: usize,
    /// True in the opening's frame with x and y exchanged; never in levels whose openings all keep up.
    pub exchanged: bool,
    /// Block that it comes from.
    pub source: BlockIndex,
    /// Response modes x coefficients b of the source.
    pub responses: Matrix<f32>,
}

/// All responses of a scene, source by source, doors taken as open. With the joint basis times
/// [`joint_from_response`](crate::modular::dictionary::OpeningOperators::joint_from_response) as `U_r` of each opening they make
/// the same light as the scene.
///
/// Cost: that of assembling the scene again; k_r x k_b numbers an opening and source.
///
/// # Errors
/// [`AssembleError`], if `scene` could not be assembled so from the level and the dictionary.
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
