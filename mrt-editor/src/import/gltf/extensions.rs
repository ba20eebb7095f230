//! Which extensions a file may require, and which it has that are not used.

use super::document::Document;
use super::fault::{Fault, shown};
use std::collections::{BTreeMap, BTreeSet};

/// Extensions that are read.
const READ: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_accessor_float64",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Compressed meshes: refused where a mesh that is placed has no plain data beside the compressed ones.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
pub(super) const MESHOPT: &str = "EXT_meshopt_compression";
pub(super) const KHR_MESHOPT: &str = "KHR_meshopt_compression";

/// Starts of names of extensions that neither move a vertex nor change a material's diffuse colour.
const HARMLESS: [&str; 21] = [
    "AGI_",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_lights_",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "FB_",
    "GODOT_",
    "GRIFFEL_",
    "KHR_animation_",
    "KHR_audio",
    "KHR_interactivity",
    "KHR_node_",
    "KHR_physics_",
    "KHR_technique",
    "KHR_xmp",
    "MSFT_",
    "MOZ_",
    "OMI_",
    "VRM",
];

/// Of unknown names, only this many are counted by name.
const MAX_COUNTED_NAMES: usize = 32;

fn is_harmless(name: &str) -> bool {
    let surface = ["_materials_", "_texture_"];
    surface.iter().any(|part| name.contains(part))
        || HARMLESS.iter().any(|start| name.starts_with(start))
}

/// Refuses what may change the mesh in ways that nobody here knows.
pub(super) fn check(document: &Document) -> Result<(), Fault> {
    let is_known = |name: &str| {
        READ.contains(&name) || [DRACO, MESHOPT, KHR_MESHOPT].contains(&name) || is_harmless(name)
    };
    match document
        .extensions_required
        .iter()
        .find(|name| !is_known(name))
    {
        None => Ok(()),
        Some(name) => Err(Fault::Unsupported(format!(
            "it requires the glTF extension {}, which is not supported; export it without that extension",
            shown(name)
        ))),
    }
}

/// The refusal of a mesh whose only data are compressed.
pub(super) fn compressed(name: &str) -> Fault {
    Fault::Unsupported(format!(
        "its meshes are compressed with {name}, which is not supported; export it without compression"
    ))
}

/// Counts extensions that may matter and are not used.
pub(super) fn count_unused(document: &Document, ignored: &mut BTreeMap<String, usize>) {
    let names = document.extensions_used.iter().map(String::as_str);
    let matters = |name: &&str| {
        let lights = name.contains("_lights_");
        let known = READ.contains(name) || [DRACO, MESHOPT, KHR_MESHOPT].contains(name);
        !known && (lights || !is_harmless(name))
    };
    let unused: BTreeSet<&str> = names.filter(matters).collect();
    for name in unused.into_iter().take(MAX_COUNTED_NAMES) {
        ignored.insert(format!("extension {}", shown(name)), 1);
    }
}
