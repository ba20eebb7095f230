//! Meshes that joints move, in the pose in which the file has the joints.

use super::accessors;
use super::buffers::Buffers;
use super::document::{Attributes, Document};
use super::fault::Fault;
use super::nodes::PlacedNode;
use glam::{DAffine3, DMat4, DVec3};
use std::collections::HashMap;

/// Four joints each; exporters write one or two sets.
const MAX_JOINT_SETS: usize = 8;

/// Where the nodes of the scene stand, by index; of a node that stands in several places, the first.
pub(super) struct Pose(HashMap<usize, DAffine3>);

impl Pose {
    pub(super) fn new(document: &Document, nodes: &[PlacedNode]) -> Self {
        let mut pose = HashMap::new();
        if !document.skins.is_empty() {
            for placed in nodes {
                pose.entry(placed.node).or_insert(placed.world_from_node);
            }
        }
        Self(pose)
    }

    /// For each joint of a skin, where it moves a vertex of the mesh to. The node of the mesh has no part in it.
    pub(super) fn joints(
        &self,
        buffers: &mut Buffers<'_>,
        skin: usize,
    ) -> Result<Vec<DAffine3>, Fault> {
        let skins = &buffers.document.skins;
        let fault = || Fault::index("nodes", "skin", skin, skins.len());
        let skin_place = format!("skins[{skin}]");
        let skin = skins.get(skin).ok_or_else(fault)?;
        let count = skin.joints.len();
        let inverse_binds = match skin.inverse_bind_matrices {
            Some(accessor) => accessors::read::<16>(buffers, accessor, count, &skin_place)?,
            None => vec![DMat4::IDENTITY.to_cols_array(); count],
        };
        let place = |(joint, inverse_bind): (&usize, [f64; 16])| {
            let world_from_joint = self.0.get(joint).copied().unwrap_or_default();
            world_from_joint * DAffine3::from_mat4(DMat4::from_cols_array(&inverse_bind))
        };
        Ok(skin.joints.iter().zip(inverse_binds).map(place).collect())
    }
}

/// Moves each position by its joints; returns whether the mesh is mirrored, as its first vertex is.
pub(super) fn apply(
    buffers: &mut Buffers<'_>,
    (attributes, place): (&Attributes, &str),
    joints: &[DAffine3],
    positions: &mut [DVec3],
) -> Result<bool, Fault> {
    let mut blended = vec![DAffine3::ZERO; positions.len()];
    let mut total_weights = vec![0.0; positions.len()];
    for set in 0..MAX_JOINT_SETS {
        let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
        let [Some(&of_joints), Some(&of_weights)] = names.each_ref().map(|n| attributes.get(n))
        else {
            break;
        };
        let indices = accessors::read::<4>(buffers, of_joints, positions.len(), place)?;
        let weights = accessors::read::<4>(buffers, of_weights, positions.len(), place)?;
        for (vertex, (indices, weights)) in indices.iter().zip(&weights).enumerate() {
            for (&index, &weight) in indices.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                let joint = joints
                    .get(index as usize)
                    .ok_or_else(|| Fault::index(place, "joint", index as usize, joints.len()))?;
                blended[vertex].matrix3 += joint.matrix3 * weight;
                blended[vertex].translation += joint.translation * weight;
                total_weights[vertex] += weight;
            }
        }
    }
    for ((position, &blend), &total) in positions.iter_mut().zip(&blended).zip(&total_weights) {
        // Weights sum to 1 but for rounding; a vertex without any stays where it is.
        if total > 0.0 {
            *position = blend.transform_point3(*position) / total;
        }
    }
    Ok(blended
        .first()
        .is_some_and(|blend| blend.matrix3.determinant() < 0.0))
}
