//! Files that are put together number by number, the public cases, and bytes that nobody should read.

mod cases;
mod files;
mod hostile;
mod shapes;
mod surfaces;

use super::fault::Fault;
use super::read_mesh;
use crate::import::raw_mesh::RawMesh;
use std::path::Path;

/// The document of one triangle in the binary chunk that [`triangle_numbers`] makes.
const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],
    "nodes":[{"translation":[0,0,5],"children":[1]},{"mesh":0,"scale":[2,2,2]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
    "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.2,0.4,0.6,1]}}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
        {"bufferView":0,"byteOffset":36,"componentType":5121,"count":3,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteLength":40}],"buffers":[{"byteLength":40}]}"#;

/// Three positions, then three indices of a byte each.
fn triangle_numbers() -> Vec<u8> {
    let corners = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    [corners, vec![0, 1, 2, 0]].concat()
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A binary file.
fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), b' ');
        let length = (bytes.len() as u32).to_le_bytes();
        [&length[..], kind, &bytes].concat()
    };
    let content = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", bin)].concat();
    let length = (12 + content.len() as u32).to_le_bytes();
    [b"glTF\x02\0\0\0", &length[..], &content].concat()
}

/// [`TRIANGLE`] with the first occurrence of each text replaced.
fn changed(changes: &[(&str, &str)]) -> String {
    let mut json = TRIANGLE.to_owned();
    for (from, to) in changes {
        assert!(json.contains(from), "{from}");
        json = json.replacen(from, to, 1);
    }
    json
}

/// Reads a binary file of a document whose buffer is `bin`.
fn read(json: &str, bin: &[u8]) -> Result<RawMesh, Fault> {
    read_mesh(Path::new("."), &glb(json, bin))
}

/// Reads [`TRIANGLE`] with changes.
fn read_changed(changes: &[(&str, &str)]) -> Result<RawMesh, Fault> {
    read(&changed(changes), &triangle_numbers())
}

/// The sentence that a user sees.
fn sentence(fault: Fault) -> String {
    fault.into_error(Path::new("a.gltf")).to_string()
}

/// A document of one mesh, placed by one node, over one buffer. `views` are offset, length and stride of its views;
/// `accessors` are view, component type, count and type.
struct Document<'a> {
    /// What stands in the node beside its mesh, from the comma on.
    node: &'a str,
    /// The primitives of the mesh.
    primitives: &'a str,
    /// Further parts of the document, from the comma on.
    more: &'a str,
    views: &'a [[usize; 3]],
    accessors: &'a [(usize, u32, usize, &'a str)],
}

impl Document<'_> {
    fn json(&self) -> String {
        let views = self.views.iter().map(|[offset, length, stride]| {
            format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"byteStride":{stride}}}"#)
        });
        let accessors = self.accessors.iter().map(|(view, component, count, shape)| {
            // Normalised are those whose type has an `n` behind it.
            let normalized = shape.ends_with('n');
            let shape = shape.trim_end_matches('n');
            format!(
                r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{shape}","normalized":{normalized}}}"#
            )
        });
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0{}}}],
            "meshes":[{{"primitives":[{}]}}],"bufferViews":[{}],"accessors":[{}],
            "buffers":[{{"byteLength":0}}]{}}}"#,
            self.node,
            self.primitives,
            views.collect::<Vec<_>>().join(","),
            accessors.collect::<Vec<_>>().join(","),
            self.more,
        )
    }
}
