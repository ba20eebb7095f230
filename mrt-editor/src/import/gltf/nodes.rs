//! Nodes of the scene, and where they stand.

use super::accessors;
use super::buffers::Buffers;
use super::document::{Document, Node};
use super::fault::Fault;
use crate::import::limits::MAX_NODE_VISITS;
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

/// A node where the scene has it.
pub(super) struct PlacedNode {
    pub(super) node: usize,
    pub(super) world_from_node: DAffine3,
}

/// What the scene shows.
pub(super) struct Placement {
    /// Parents before their children, in the order of the file.
    pub(super) nodes: Vec<PlacedNode>,
    /// Nodes that the file hides with all below them.
    pub(super) hidden: usize,
}

/// Nodes of the default scene, else of the first scene, else all nodes, with their transforms.
pub(super) fn place(document: &Document) -> Result<Placement, Fault> {
    let mut placement = Placement {
        nodes: Vec::new(),
        hidden: 0,
    };
    let (place, roots) = roots(document)?;
    let mut pending = Vec::new();
    push(
        document,
        &mut pending,
        &place,
        (&roots, DAffine3::IDENTITY, 0),
    )?;
    while let Some((index, world_from_parent, depth)) = pending.pop() {
        let node = &document.nodes[index];
        let here = format!("nodes[{index}]");
        // No path without a circle is longer than the list of nodes.
        if depth >= document.nodes.len() {
            return Err(Fault::at(here, "nodes without a circle"));
        }
        if placement.nodes.len() + pending.len() + node.children.len() >= MAX_NODE_VISITS {
            return Err(Fault::at(
                here,
                "at most 1,000,000 nodes, counted each time that one is a child",
            ));
        }
        if is_hidden(node) {
            placement.hidden += 1;
            continue;
        }
        let world_from_node = world_from_parent * local(node);
        placement.nodes.push(PlacedNode {
            node: index,
            world_from_node,
        });
        push(
            document,
            &mut pending,
            &here,
            (&node.children, world_from_node, depth + 1),
        )?;
    }
    Ok(placement)
}

/// Nodes still to visit, last first: index, transform of the parent, depth.
type Pending = Vec<(usize, DAffine3, usize)>;

fn push(
    document: &Document,
    pending: &mut Pending,
    place: &str,
    (nodes, world_from_parent, depth): (&[usize], DAffine3, usize),
) -> Result<(), Fault> {
    for &node in nodes.iter().rev() {
        if node >= document.nodes.len() {
            return Err(Fault::index(place, "node", node, document.nodes.len()));
        }
        pending.push((node, world_from_parent, depth));
    }
    Ok(())
}

/// Where the scene begins, and what lists it.
fn roots(document: &Document) -> Result<(String, Vec<usize>), Fault> {
    let scenes = &document.scenes;
    if !scenes.is_empty() {
        let scene = document.scene.unwrap_or(0);
        let fault = || Fault::index("scene", "scene", scene, scenes.len());
        let nodes = scenes.get(scene).ok_or_else(fault)?.nodes.clone();
        return Ok((format!("scenes[{scene}]"), nodes));
    }
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(is_child) = is_child.get_mut(child) {
            *is_child = true;
        }
    }
    let roots = (0..is_child.len()).filter(|&node| !is_child[node]);
    Ok(("nodes".to_owned(), roots.collect()))
}

fn is_hidden(node: &Node) -> bool {
    let visibility = node.extensions.as_ref().and_then(|e| e.visibility.as_ref());
    visibility.is_some_and(|v| v.visible == Some(false))
}

fn local(node: &Node) -> DAffine3 {
    match &node.matrix {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(matrix)),
        None => compose(
            node.translation.unwrap_or_default(),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    }
}

/// Scales first, then turns, then moves. Quaternions of integers, and of some exporters, are not quite of unit length.
fn compose(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DAffine3 {
    let rotation = DQuat::from_array(rotation);
    let length = rotation.length();
    let rotation = if length.is_normal() {
        rotation / length
    } else {
        DQuat::IDENTITY
    };
    DAffine3 {
        matrix3: DMat3::from_quat(rotation) * DMat3::from_diagonal(DVec3::from_array(scale)),
        translation: DVec3::from_array(translation),
    }
}

/// How many instances of its mesh a node has.
pub(super) fn instance_count(document: &Document, node: usize) -> Result<usize, Fault> {
    let Some(attributes) = instancing(&document.nodes[node]) else {
        return Ok(1);
    };
    // Of the three, those that are there have the same count.
    let place = format!("nodes[{node}]: EXT_mesh_gpu_instancing");
    let accessors = ["TRANSLATION", "ROTATION", "SCALE"];
    let Some(&accessor) = accessors.iter().find_map(|&name| attributes.get(name)) else {
        return Ok(1);
    };
    Ok(accessors::get(&document.accessors, accessor, &place)?.count)
}

/// Where the instances of a node's mesh stand.
pub(super) fn instances(
    buffers: &mut Buffers<'_>,
    placed: &PlacedNode,
) -> Result<Vec<DAffine3>, Fault> {
    let document = buffers.document;
    let count = instance_count(document, placed.node)?;
    let Some(attributes) = instancing(&document.nodes[placed.node]) else {
        return Ok(vec![placed.world_from_node]);
    };
    let place = format!("nodes[{}]: EXT_mesh_gpu_instancing", placed.node);
    let translations = match attributes.get("TRANSLATION") {
        Some(&accessor) => accessors::read::<3>(buffers, accessor, count, &place)?,
        None => vec![[0.0; 3]; count],
    };
    let rotations = match attributes.get("ROTATION") {
        Some(&accessor) => accessors::read::<4>(buffers, accessor, count, &place)?,
        None => vec![[0.0, 0.0, 0.0, 1.0]; count],
    };
    let scales = match attributes.get("SCALE") {
        Some(&accessor) => accessors::read::<3>(buffers, accessor, count, &place)?,
        None => vec![[1.0; 3]; count],
    };
    let node_from_instance = |k: usize| compose(translations[k], rotations[k], scales[k]);
    Ok((0..count)
        .map(|k| placed.world_from_node * node_from_instance(k))
        .collect())
}

fn instancing(node: &Node) -> Option<&super::document::Attributes> {
    let extensions = node.extensions.as_ref()?;
    Some(&extensions.instancing.as_ref()?.attributes)
}
