//! Binary glTF: the triangles of the default scene with their node transforms, and base colours.
//!
//! Accessors are read here, with every offset checked, because the library's iterators slice
//! without asking; its document model is validated and used for everything else. Textures are not
//! read: a material's colour is `extras.meanBaseColorLinear` where given, else its base colour.

use super::error::ImportError;
use super::raw_mesh::{Paint, RawMesh};
use glam::{Mat4, Vec3};
use gltf::accessor::{DataType, Dimensions};
use std::path::Path;

/// Nodes nested deeper than this are refused; a cycle is deeper than any limit.
const MAX_NODE_DEPTH: usize = 256;

/// More visits to nodes than this are refused: a few nodes that share children can ask for 2^256.
const MAX_NODE_VISITS: usize = 1_000_000;

/// More triangles than this, counted with instances, are refused before they are made.
const MAX_TRIANGLES: usize = 50_000_000;

/// Reads a GLB.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<RawMesh, ImportError> {
    read_mesh(bytes).map_err(|Fault { place, expected }| ImportError::Malformed {
        path: path.to_owned(),
        place,
        expected,
    })
}

/// A place in the file, and what should be there.
#[derive(Debug)]
struct Fault {
    place: String,
    expected: &'static str,
}

impl Fault {
    fn at(place: impl Into<String>, expected: &'static str) -> Self {
        let place = place.into();
        Self { place, expected }
    }
}

fn read_mesh(bytes: &[u8]) -> Result<RawMesh, Fault> {
    let header = || Fault::at("header", "a complete binary glTF 2.0 file");
    // The library subtracts the header from this length unchecked.
    let length = bytes.get(8..12).map_or(0, |word| {
        u32::from_le_bytes([word[0], word[1], word[2], word[3]])
    });
    if length < 12 {
        return Err(header());
    }
    let glb = gltf::binary::Glb::from_slice(bytes).map_err(|_| header())?;
    let document = parse_document(&glb.json).map_err(|error| Fault::at(error, "valid glTF 2.0"))?;
    let asset = &document.as_json().asset;
    let needed = asset.min_version.as_ref().unwrap_or(&asset.version);
    // Every 2.x promises to read as 2.0 does, unless it names a later least version.
    if needed.split('.').next() != Some("2") {
        let place = format!("asset: version {needed}");
        return Err(Fault::at(place, "glTF 2"));
    }
    let mut reader = Reader {
        bin: glb.bin.as_deref().unwrap_or_default(),
        mesh: RawMesh::default(),
        node_visits: 0,
    };
    reader.mesh.paints = document.materials().map(|m| read_paint(&m)).collect();
    reader.mesh.paints.push(Paint::unnamed());
    let scene = document
        .default_scene()
        .or_else(|| document.scenes().next())
        .ok_or_else(|| Fault::at("scenes", "at least one scene"))?;
    for node in scene.nodes() {
        reader.add_node(&node, Mat4::IDENTITY, 0)?;
    }
    Ok(reader.mesh)
}

/// Textures are taken out first: an extension's texture has no `source`, which the library refuses,
/// and none is needed here.
fn parse_document(json: &[u8]) -> Result<gltf::Document, String> {
    let mut json: serde_json::Value =
        serde_json::from_slice(json).map_err(|error| format!("JSON: {error}"))?;
    if let Some(root) = json.as_object_mut() {
        for key in ["textures", "images", "samplers", "animations", "skins"] {
            root.remove(key);
        }
        let remove = |value: &mut serde_json::Value, keys: &[&str]| {
            if let Some(object) = value.as_object_mut() {
                for key in keys {
                    object.remove(*key);
                }
            }
        };
        for material in list_mut(root.get_mut("materials")) {
            remove(
                material,
                &[
                    "normalTexture",
                    "occlusionTexture",
                    "emissiveTexture",
                    "extensions",
                ],
            );
            if let Some(pbr) = material.get_mut("pbrMetallicRoughness") {
                remove(pbr, &["baseColorTexture", "metallicRoughnessTexture"]);
            }
        }
        for node in list_mut(root.get_mut("nodes")) {
            remove(node, &["skin"]);
        }
        check_position_accessors(root)?;
    }
    // Reading from text again compiles in a third of the time that reading from a value takes.
    let root = gltf::json::Root::from_slice(json.to_string().as_bytes())
        .map_err(|error| format!("document: {error}"))?;
    gltf::Document::from_json(root).map_err(|error| format!("document: {error}"))
}

/// The library's own check of a primitive takes its positions' accessor without asking whether
/// there is one.
fn check_position_accessors(
    root: &serde_json::Map<String, serde_json::Value>,
) -> Result<(), String> {
    let accessor_count = list(root.get("accessors")).count() as u64;
    for (mesh_index, mesh) in list(root.get("meshes")).enumerate() {
        for (index, primitive) in list(mesh.get("primitives")).enumerate() {
            let accessor = primitive["attributes"]["POSITION"].as_u64();
            if let Some(accessor) = accessor.filter(|&accessor| accessor >= accessor_count) {
                return Err(format!(
                    "document: meshes[{mesh_index}].primitives[{index}]: accessor {accessor} of \
                     {accessor_count}"
                ));
            }
        }
    }
    Ok(())
}

fn list(value: Option<&serde_json::Value>) -> impl Iterator<Item = &serde_json::Value> {
    value.and_then(|v| v.as_array()).into_iter().flatten()
}

fn list_mut(value: Option<&mut serde_json::Value>) -> impl Iterator<Item = &mut serde_json::Value> {
    value.and_then(|v| v.as_array_mut()).into_iter().flatten()
}

fn read_paint(material: &gltf::Material<'_>) -> Paint {
    let mean = material
        .extras()
        .as_ref()
        .and_then(|extras| serde_json::from_str::<serde_json::Value>(extras.get()).ok())
        .and_then(|extras| {
            let mean = extras.get("meanBaseColorLinear")?.as_array()?;
            let channel = |k: usize| mean.get(k)?.as_f64().map(|x| x as f32);
            Some(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
        });
    let [r, g, b, _] = material.pbr_metallic_roughness().base_color_factor();
    let name = material.name().unwrap_or("unnamed");
    Paint::new(name, Some(mean.unwrap_or(Vec3::new(r, g, b))))
}

/// Walks through the document and collects triangles.
struct Reader<'a> {
    bin: &'a [u8],
    mesh: RawMesh,
    node_visits: usize,
}

impl Reader<'_> {
    fn add_node(&mut self, node: &gltf::Node<'_>, parent: Mat4, depth: usize) -> Result<(), Fault> {
        self.node_visits += 1;
        if depth > MAX_NODE_DEPTH || self.node_visits > MAX_NODE_VISITS {
            return Err(Fault::at(
                format!("node {}", node.index()),
                "nodes nested at most 256 deep, without cycles, and at most 1,000,000",
            ));
        }
        let world_from_node = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
            if primitive.mode() == gltf::mesh::Mode::Triangles {
                self.add_primitive(&primitive, world_from_node)?;
            }
        }
        for child in node.children() {
            self.add_node(&child, world_from_node, depth + 1)?;
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        world_from_node: Mat4,
    ) -> Result<(), Fault> {
        let Some(accessor) = primitive.get(&gltf::Semantic::Positions) else {
            return Ok(());
        };
        if accessor.data_type() != DataType::F32 || accessor.dimensions() != Dimensions::Vec3 {
            let place = format!("accessor {}", accessor.index());
            return Err(Fault::at(place, "positions as three 32-bit floats"));
        }
        let first = self.mesh.positions.len() as u32;
        let vertex_count = accessor.count();
        for element in elements(self.bin, &accessor, 12)? {
            let number = |k: usize| {
                f32::from_le_bytes([element[k], element[k + 1], element[k + 2], element[k + 3]])
            };
            let position = Vec3::new(number(0), number(4), number(8));
            self.mesh
                .positions
                .push(world_from_node.transform_point3(position).as_dvec3());
        }
        let indices: Vec<u32> = match primitive.indices() {
            None => (0..vertex_count as u32).collect(),
            Some(accessor) => read_indices(self.bin, &accessor)?,
        };
        if let Some(bad) = indices
            .iter()
            .find(|&&index| index as usize >= vertex_count)
        {
            let place = format!("index {bad}");
            return Err(Fault::at(place, "indices below the number of vertices"));
        }
        if self.mesh.triangles.len() + indices.len() / 3 > MAX_TRIANGLES {
            return Err(Fault::at("nodes", "at most 50,000,000 triangles"));
        }
        let material = primitive
            .material()
            .index()
            .unwrap_or(self.mesh.paints.len() - 1);
        for corners in indices.as_chunks::<3>().0 {
            self.mesh.triangles.push(corners.map(|k| first + k));
            self.mesh.triangle_materials.push(material as u32);
        }
        Ok(())
    }
}

fn read_indices(bin: &[u8], accessor: &gltf::Accessor<'_>) -> Result<Vec<u32>, Fault> {
    let size = match accessor.data_type() {
        DataType::U8 => 1,
        DataType::U16 => 2,
        DataType::U32 => 4,
        _ => {
            let place = format!("accessor {}", accessor.index());
            return Err(Fault::at(place, "unsigned integer indices"));
        }
    };
    let little_endian = |bytes: &[u8]| {
        bytes
            .iter()
            .rev()
            .fold(0u32, |value, &byte| value << 8 | u32::from(byte))
    };
    Ok(elements(bin, accessor, size)?.map(little_endian).collect())
}

/// The accessor's elements of `size` bytes each, all inside the file.
fn elements<'a>(
    bin: &'a [u8],
    accessor: &gltf::Accessor<'_>,
    size: usize,
) -> Result<impl Iterator<Item = &'a [u8]>, Fault> {
    let fault = |expected| Fault::at(format!("accessor {}", accessor.index()), expected);
    if accessor.sparse().is_some() {
        return Err(fault("no sparse data"));
    }
    let view = accessor.view().ok_or_else(|| fault("a buffer view"))?;
    if !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
        return Err(fault("its data in the file's own binary chunk"));
    }
    let stride = view.stride().unwrap_or(size);
    let count = accessor.count();
    let range = || {
        let end = view.offset().checked_add(view.length())?;
        let view_bytes = bin.get(view.offset()..end)?;
        let bytes = view_bytes.get(accessor.offset()..)?;
        let needed = stride
            .checked_mul(count.checked_sub(1)?)?
            .checked_add(size)?;
        (stride >= size).then(|| bytes.get(..needed)).flatten()
    };
    let bytes = range().ok_or_else(|| fault("its data inside the file"))?;
    Ok((0..count).map(move |k| &bytes[k * stride..k * stride + size]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One triangle: three positions, then three indices of a byte each.
    fn numbers() -> Vec<u8> {
        let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let positions = corners.iter().flat_map(|x| x.to_le_bytes());
        positions.chain([0, 1, 2, 0]).collect()
    }

    /// A document around [`numbers`], with `changes` in it.
    fn glb(changes: &[(&str, &str)]) -> Vec<u8> {
        let mut json = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],
            "nodes":[{"translation":[0,0,5],"children":[1]},{"mesh":0,"scale":[2,2,2]}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
            "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.2,0.4,0.6,1]}}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
             "min":[0,0,0],"max":[1,1,0]},
            {"bufferView":0,"byteOffset":36,"componentType":5121,"count":3,"type":"SCALAR"}],
            "bufferViews":[{"buffer":0,"byteLength":40}],"buffers":[{"byteLength":40}]}"#
            .to_owned();
        for (from, to) in changes {
            assert!(json.contains(from), "{from}");
            json = json.replacen(from, to, 1);
        }
        let chunk = |kind: &[u8; 4], bytes: &[u8]| {
            let length = (bytes.len() as u32).to_le_bytes();
            [&length[..], kind, bytes].concat()
        };
        let content = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &numbers())].concat();
        let length = (12 + content.len() as u32).to_le_bytes();
        [b"glTF\x02\0\0\0", &length[..], &content].concat()
    }

    #[test]
    fn triangles_stand_where_their_nodes_put_them() {
        let mesh = read_mesh(&glb(&[])).expect("reads");
        let corners = [[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [0.0, 2.0, 5.0]];
        assert_eq!(mesh.positions, corners.map(glam::DVec3::from_array));
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.paints[0].colour, Some(Vec3::new(0.2, 0.4, 0.6)));
        let mean = r#"{"extras":{"meanBaseColorLinear":[0.1,0.2,0.3]},"pbrMetallicRoughness":{"#;
        let mesh = read_mesh(&glb(&[(r#"{"pbrMetallicRoughness":{"#, mean)])).expect("reads");
        assert_eq!(mesh.paints[0].colour, Some(Vec3::new(0.1, 0.2, 0.3)));
    }

    #[test]
    fn every_index_and_offset_is_checked() {
        for (from, to, place) in [
            (r#""nodes":[0]"#, r#""nodes":[7]"#, "scenes[0].nodes[0]"),
            (r#""children":[1]"#, r#""children":[0]"#, "node 0"),
            (r#""mesh":0"#, r#""mesh":9"#, "nodes[1].mesh"),
            (r#""POSITION":0"#, r#""POSITION":9"#, "accessor 9 of 2"),
            (r#""indices":1"#, r#""indices":0"#, "accessor 0"),
            (
                r#""material":0"#,
                r#""material":5"#,
                "primitives[0].material",
            ),
            (r#""count":3"#, r#""count":0"#, "accessor 0"),
            (r#""count":3"#, r#""count":4"#, "accessor 0"),
            (r#""byteOffset":36"#, r#""byteOffset":38"#, "accessor 1"),
            (r#""byteOffset":36"#, r#""byteOffset":14"#, "index 128"),
            (r#""byteLength":40"#, r#""byteLength":41"#, "accessor 0"),
            (r#""buffer":0"#, r#""buffer":1"#, "bufferViews[0].buffer"),
            (
                r#"[{"byteLength":40}]"#,
                r#"[{"uri":"a.bin"}]"#,
                "accessor 0",
            ),
            (
                r#""version":"2.0""#,
                r#""version":"1.0""#,
                "asset: version 1.0",
            ),
            (r#""scenes""#, r#""other""#, "scenes"),
            (
                r#""scenes""#,
                r#""extensionsRequired":["DRACO"],"scenes""#,
                "DRACO",
            ),
        ] {
            let fault = read_mesh(&glb(&[(from, to)])).expect_err(to);
            assert!(fault.place.contains(place), "{to}: {}", fault.place);
        }
    }
}
