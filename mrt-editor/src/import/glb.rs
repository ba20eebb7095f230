//! Binary glTF: the triangles of the default scene with their node transforms, and base colours.
//!
//! Textures are not read: a material's colour is `extras.meanBaseColorLinear` where that is given, else its base colour.
//! The document is read here rather than by a library: a file may name any index and any offset, each of which is
//! checked where it is used, and a library for all of glTF takes longer to compile than the rest of the import.

mod container;
mod document;

use super::error::ImportError;
use super::raw_mesh::{Paint, RawMesh};
use container::chunks;
use document::{
    Accessor, Document, FLOAT, Material, Node, Primitive, TRIANGLES, UNSIGNED_BYTE, UNSIGNED_INT,
    UNSIGNED_SHORT,
};
use glam::{Mat4, Quat, Vec3};
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
    let chunks =
        chunks(bytes).ok_or_else(|| Fault::at("header", "a complete binary glTF 2.0 file"))?;
    let document = parse(chunks.json)?;
    let mut reader = Reader {
        document: &document,
        bin: chunks.bin,
        mesh: RawMesh::default(),
        node_visits: 0,
    };
    reader.mesh.paints = document.materials.iter().map(paint).collect();
    reader.mesh.paints.push(Paint::unnamed());
    let scene = document
        .scenes
        .get(document.scene.unwrap_or(0))
        .ok_or_else(|| Fault::at("scenes", "the default scene, or at least one"))?;
    for &node in &scene.nodes {
        reader.add_node(node, Mat4::IDENTITY, 0)?;
    }
    Ok(reader.mesh)
}

fn parse(json: &[u8]) -> Result<Document, Fault> {
    let document: Document = serde_json::from_slice(json)
        .map_err(|error| Fault::at(format!("document: {error}"), "valid glTF 2.0"))?;
    if !document.asset.version.starts_with("2.") {
        return Err(Fault::at("asset", "glTF of version 2"));
    }
    match document.extensions_required.first() {
        Some(name) => Err(Fault::at(
            format!("extension {name}"),
            "a file that can be read without extensions",
        )),
        None => Ok(document),
    }
}

fn paint(material: &Material) -> Paint {
    let mean = || {
        let mean = material.extras.get("meanBaseColorLinear")?.as_array()?;
        let channel = |k: usize| mean.get(k)?.as_f64().map(|x| x as f32);
        Some(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
    };
    let base = material.pbr_metallic_roughness.base_color_factor;
    let [r, g, b, _] = base.unwrap_or([1.0; 4]);
    let name = material.name.as_deref().unwrap_or("unnamed");
    Paint::new(name, Some(mean().unwrap_or(Vec3::new(r, g, b))))
}

/// Walks through the document and collects triangles.
struct Reader<'a> {
    document: &'a Document,
    bin: &'a [u8],
    mesh: RawMesh,
    node_visits: usize,
}

impl<'a> Reader<'a> {
    fn add_node(&mut self, index: usize, parent: Mat4, depth: usize) -> Result<(), Fault> {
        self.node_visits += 1;
        if depth > MAX_NODE_DEPTH || self.node_visits > MAX_NODE_VISITS {
            return Err(Fault::at(
                format!("node {index}"),
                "nodes nested at most 256 deep, without cycles, and at most 1,000,000",
            ));
        }
        let document = self.document;
        let node = item(&document.nodes, index, "node")?;
        let world_from_node = parent * transform(node);
        if let Some(mesh) = node.mesh {
            for primitive in &item(&document.meshes, mesh, "mesh")?.primitives {
                if primitive.mode.unwrap_or(TRIANGLES) == TRIANGLES {
                    self.add_primitive(primitive, world_from_node)?;
                }
            }
        }
        for &child in &node.children {
            self.add_node(child, world_from_node, depth + 1)?;
        }
        Ok(())
    }

    fn add_primitive(&mut self, primitive: &Primitive, world_from_node: Mat4) -> Result<(), Fault> {
        let Some(positions) = primitive.attributes.position else {
            return Ok(());
        };
        let first = self.mesh.positions.len() as u32;
        let positions = self.positions(positions)?;
        let to_world = |position| world_from_node.transform_point3(position);
        let vertex_count = positions.len();
        self.mesh
            .positions
            .extend(positions.into_iter().map(to_world));
        let indices: Vec<u32> = match primitive.indices {
            None => (0..vertex_count as u32).collect(),
            Some(accessor) => self.indices(accessor)?,
        };
        if let Some(bad) = indices.iter().find(|&&k| k as usize >= vertex_count) {
            let place = format!("index {bad}");
            return Err(Fault::at(place, "indices below the number of vertices"));
        }
        if self.mesh.triangles.len() + indices.len() / 3 > MAX_TRIANGLES {
            return Err(Fault::at("nodes", "at most 50,000,000 triangles"));
        }
        let unnamed = self.mesh.paints.len() - 1;
        let material = primitive.material.unwrap_or(unnamed);
        if material > unnamed {
            return Err(absent("material", material));
        }
        for corners in indices.as_chunks::<3>().0 {
            self.mesh.triangles.push(corners.map(|k| first + k));
            self.mesh.triangle_materials.push(material as u32);
        }
        Ok(())
    }

    fn positions(&self, index: usize) -> Result<Vec<Vec3>, Fault> {
        let accessor = self.accessor(index)?;
        if accessor.component_type != FLOAT || accessor.element_type != "VEC3" {
            let place = format!("accessor {index}");
            return Err(Fault::at(place, "positions as three 32-bit floats"));
        }
        let number = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes);
        let position = |element: &[u8]| match element.as_chunks::<4>().0 {
            [x, y, z] => Vec3::new(number(x), number(y), number(z)),
            _ => Vec3::NAN,
        };
        Ok(self.elements(index, 12)?.map(position).collect())
    }

    fn indices(&self, index: usize) -> Result<Vec<u32>, Fault> {
        let size = match self.accessor(index)?.component_type {
            UNSIGNED_BYTE => 1,
            UNSIGNED_SHORT => 2,
            UNSIGNED_INT => 4,
            _ => {
                let place = format!("accessor {index}");
                return Err(Fault::at(place, "unsigned integer indices"));
            }
        };
        let little_endian = |bytes: &[u8]| {
            let bytes = bytes.iter().rev();
            bytes.fold(0u32, |value, &byte| value << 8 | u32::from(byte))
        };
        Ok(self.elements(index, size)?.map(little_endian).collect())
    }

    fn accessor(&self, index: usize) -> Result<&'a Accessor, Fault> {
        item(&self.document.accessors, index, "accessor")
    }

    /// The accessor's elements of `size` bytes each, all inside the file.
    fn elements(
        &self,
        index: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, Fault> {
        let fault = |expected| Fault::at(format!("accessor {index}"), expected);
        let accessor = self.accessor(index)?;
        if accessor.sparse.is_some() {
            return Err(fault("no sparse data"));
        }
        let views = &self.document.buffer_views;
        let view = accessor
            .buffer_view
            .and_then(|view| views.get(view))
            .ok_or_else(|| fault("a buffer view that is in the file"))?;
        let buffer = self.document.buffers.get(view.buffer);
        if buffer.is_none_or(|buffer| buffer.uri.is_some()) {
            return Err(fault("its data in the file's own binary chunk"));
        }
        let stride = view.byte_stride.unwrap_or(size);
        let count = accessor.count;
        let range = || {
            let end = view.byte_offset.checked_add(view.byte_length)?;
            let view_bytes = self.bin.get(view.byte_offset..end)?;
            let bytes = view_bytes.get(accessor.byte_offset..)?;
            let needed = stride
                .checked_mul(count.checked_sub(1)?)?
                .checked_add(size)?;
            (stride >= size).then(|| bytes.get(..needed)).flatten()
        };
        let bytes = range().ok_or_else(|| fault("its data inside the file"))?;
        Ok((0..count).map(move |k| &bytes[k * stride..k * stride + size]))
    }
}

fn item<'a, T>(list: &'a [T], index: usize, kind: &str) -> Result<&'a T, Fault> {
    list.get(index).ok_or_else(|| absent(kind, index))
}

/// The file names an index of something that it does not have.
fn absent(kind: &str, index: usize) -> Fault {
    Fault::at(format!("{kind} {index}"), "an index of what is in the file")
}

fn transform(node: &Node) -> Mat4 {
    match node.matrix {
        Some(columns) => Mat4::from_cols_array(&columns),
        None => Mat4::from_scale_rotation_translation(
            Vec3::from_array(node.scale.unwrap_or([1.0; 3])),
            Quat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
            Vec3::from_array(node.translation.unwrap_or([0.0; 3])),
        ),
    }
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
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
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
        assert_eq!(mesh.positions, corners.map(Vec3::from_array));
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.paints[0].colour, Some(Vec3::new(0.2, 0.4, 0.6)));
        let mean = r#"{"extras":{"meanBaseColorLinear":[0.1,0.2,0.3]},"pbrMetallicRoughness":{"#;
        let mesh = read_mesh(&glb(&[(r#"{"pbrMetallicRoughness":{"#, mean)])).expect("reads");
        assert_eq!(mesh.paints[0].colour, Some(Vec3::new(0.1, 0.2, 0.3)));
    }

    #[test]
    fn every_index_and_offset_is_checked() {
        for (from, to, place) in [
            (r#""nodes":[0]"#, r#""nodes":[7]"#, "node 7"),
            (r#""children":[1]"#, r#""children":[0]"#, "node 0"),
            (r#""mesh":0"#, r#""mesh":9"#, "mesh 9"),
            (r#""POSITION":0"#, r#""POSITION":9"#, "accessor 9"),
            (r#""indices":1"#, r#""indices":0"#, "accessor 0"),
            (r#""material":0"#, r#""material":5"#, "material 5"),
            (r#""count":3"#, r#""count":0"#, "accessor 0"),
            (r#""count":3"#, r#""count":4"#, "accessor 0"),
            (r#""byteOffset":36"#, r#""byteOffset":38"#, "accessor 1"),
            (r#""byteOffset":36"#, r#""byteOffset":1"#, "index"),
            (r#""byteLength":40"#, r#""byteLength":41"#, "accessor 0"),
            (r#""buffer":0"#, r#""buffer":1"#, "accessor 0"),
            (
                r#"[{"byteLength":40}]"#,
                r#"[{"uri":"a.bin"}]"#,
                "accessor 0",
            ),
            (r#""version":"2.0""#, r#""version":"1.0""#, "asset"),
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
