//! The lit mesh as binary glTF 2.0: coordinates of images and of the lightmap, normals, vertex colours, materials with
//! their names, and images as the scene's files have them.

mod buffer;

use super::unwrapped::Unwrapped;
use crate::import::raw_mesh::Wrap;
use crate::import::surface_colours::SurfacePaint;
use crate::render::lit::LitScene;
use buffer::Buffer;
use glam::{DVec3, Vec2, Vec3};
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};

/// Extensions that files may need.
const WEBP: &str = "EXT_texture_webp";
const EMISSIVE_STRENGTH: &str = "KHR_materials_emissive_strength";

/// Numbers of a vertex: position, normal, image and lightmap coordinates, colour.
const VERTEX_NUMBERS: usize = 3 + 3 + 2 + 2 + 3;

/// The bytes of the file. `TEXCOORD_0` are the coordinates of images, and zero where there is none; `TEXCOORD_1` are those
/// of the lightmap beside the file. Positions are of the level, and the node puts them where the scene has them.
pub(super) fn glb_bytes(lit: &LitScene<'_>, unwrapped: &Unwrapped<'_>) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let mut surfaces = Surfaces::default();
    let primitives: Vec<Value> = parts_by_material(lit, unwrapped)
        .into_iter()
        .map(|(material, part)| {
            let name = &lit.mesh.materials[material as usize].name;
            let paint = lit.colours.paint(material as usize);
            let material = surfaces.add(lit, name, paint, &mut buffer);
            part.primitive(material, &mut buffer)
        })
        .collect();
    let DVec3 { x, y, z } = unwrapped.origin;
    let mut root = json!({
        "asset": {"version": "2.0", "generator": "mrt"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [x, y, z]}],
        "meshes": [{
            "primitives": primitives,
            "extras": {"lightmap": "lightmap.ktx2", "lightmapTexCoord": 1},
        }],
    });
    surfaces.describe(&mut root);
    buffer.into_file(root)
}

/// Triangles of one material, over vertices that they share.
#[derive(Default)]
struct Part {
    vertices: Vec<[f32; VERTEX_NUMBERS]>,
    /// By the bits of its numbers.
    index_of_vertex: HashMap<[u32; VERTEX_NUMBERS], u32>,
    indices: Vec<u32>,
    has_colours: bool,
}

impl Part {
    fn add(&mut self, vertex: [f32; VERTEX_NUMBERS]) {
        let next = self.vertices.len() as u32;
        let index = self.index_of_vertex.entry(vertex.map(f32::to_bits));
        let index = *index.or_insert_with(|| {
            self.vertices.push(vertex);
            next
        });
        self.indices.push(index);
    }

    fn primitive(&self, material: usize, buffer: &mut Buffer) -> Value {
        let mut attributes = json!({
            "POSITION": buffer.add_vectors::<3>(&self.vertices, 0),
            "NORMAL": buffer.add_vectors::<3>(&self.vertices, 3),
            "TEXCOORD_0": buffer.add_vectors::<2>(&self.vertices, 6),
            "TEXCOORD_1": buffer.add_vectors::<2>(&self.vertices, 8),
        });
        if self.has_colours {
            attributes["COLOR_0"] = buffer.add_vectors::<3>(&self.vertices, 10).into();
        }
        json!({
            "attributes": attributes,
            "indices": buffer.add_indices(&self.indices),
            "material": material,
        })
    }
}

fn parts_by_material(lit: &LitScene<'_>, unwrapped: &Unwrapped<'_>) -> BTreeMap<u32, Part> {
    let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
    for triangle in unwrapped.triangles {
        let source = triangle.source;
        let part = parts
            .entry(lit.mesh.triangle_materials[source])
            .or_default();
        let uvs = lit.colours.corner_uvs(source);
        let colours = lit.colours.corner_colours(lit.mesh, source);
        part.has_colours |= colours.is_some();
        for (&corner, at) in triangle.corners.iter().zip(&triangle.receivers) {
            let weights = weights_of(lit.mesh.corners(source), corner);
            let normal = weighted(lit.corner_normals[source], weights);
            let uv = uvs.map_or(Vec2::ZERO, |uvs| {
                weighted(uvs.map(|uv| uv.extend(0.0)), weights).truncate()
            });
            let on_lightmap =
                lit.atlas
                    .texture_coordinate(at.block, at.face, at.u as f32, at.v as f32);
            let on_lightmap = on_lightmap.unwrap_or_default();
            let colour = colours.map_or(Vec3::ONE, |colours| weighted(colours, weights));
            let [x, y, z] = corner.to_array();
            let [nx, ny, nz] = unit(normal, lit.mesh.corners(source)).to_array();
            let [r, g, b] = colour.to_array();
            part.add([
                x,
                y,
                z,
                nx,
                ny,
                nz,
                uv.x,
                uv.y,
                on_lightmap.x,
                on_lightmap.y,
                r,
                g,
                b,
            ]);
        }
    }
    parts
}

/// Barycentric weights of a point of a triangle. In `f64`, so that corners keep their own values.
fn weights_of(corners: [Vec3; 3], point: Vec3) -> Vec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    let offset = point.as_dvec3() - a;
    let second = offset.cross(c - a).dot(normal) / squared;
    let third = (b - a).cross(offset).dot(normal) / squared;
    DVec3::new(1.0 - second - third, second, third).as_vec3()
}

fn weighted([a, b, c]: [Vec3; 3], weights: Vec3) -> Vec3 {
    a * weights.x + b * weights.y + c * weights.z
}

/// The unit vector along a smooth normal, or along the triangle's own where smooth ones cancel out.
fn unit(normal: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let flat = || (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize();
    normal.try_normalize().unwrap_or_else(|| flat().as_vec3())
}

/// Materials, textures, samplers and images of the file.
#[derive(Default)]
struct Surfaces {
    materials: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
    images: Vec<Value>,
    image_of_texture: HashMap<usize, usize>,
    uses_webp: bool,
    uses_strength: bool,
}

impl Surfaces {
    /// Adds a material; gives its index.
    fn add(
        &mut self,
        lit: &LitScene<'_>,
        name: &str,
        paint: SurfacePaint,
        buffer: &mut Buffer,
    ) -> usize {
        let [r, g, b] = paint.colour.clamp(Vec3::ZERO, Vec3::ONE).to_array();
        let mut material = json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
        });
        let image = paint.texture.and_then(|(texture, wrap)| {
            let image = self.add_image(texture, lit.colours.file(texture)?, buffer)?;
            Some((image, wrap))
        });
        if let Some((image, wrap)) = image {
            let index = self.add_texture(image, wrap);
            material["pbrMetallicRoughness"]["baseColorTexture"] =
                json!({"index": index, "texCoord": 0});
        }
        let brightest = paint.emission.max_element();
        if brightest > 0.0 {
            material["emissiveFactor"] = json!((paint.emission / brightest).to_array());
            material["extensions"] = json!({EMISSIVE_STRENGTH: {"emissiveStrength": brightest}});
            self.uses_strength = true;
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    fn add_texture(&mut self, (image, is_webp): (usize, bool), wrap: [Wrap; 2]) -> usize {
        let [s, t] = wrap.map(|wrap| match wrap {
            Wrap::Repeat => 10_497,
            Wrap::Mirror => 33_648,
            Wrap::Clamp => 33_071,
        });
        self.samplers.push(json!({"wrapS": s, "wrapT": t}));
        let sampler = self.samplers.len() - 1;
        self.textures.push(match is_webp {
            true => json!({"sampler": sampler, "extensions": {WEBP: {"source": image}}}),
            false => json!({"sampler": sampler, "source": image}),
        });
        self.textures.len() - 1
    }

    /// The image's index, and whether it is a WebP; `None` for files that are none of PNG, JPEG and WebP.
    fn add_image(
        &mut self,
        texture: usize,
        file: &[u8],
        buffer: &mut Buffer,
    ) -> Option<(usize, bool)> {
        let kind = match file {
            [0x89, b'P', b'N', b'G', ..] => "image/png",
            [0xff, 0xd8, ..] => "image/jpeg",
            [b'R', b'I', b'F', b'F', ..] => "image/webp",
            _ => return None,
        };
        let is_webp = kind == "image/webp";
        self.uses_webp |= is_webp;
        let images = &mut self.images;
        let index = *self.image_of_texture.entry(texture).or_insert_with(|| {
            let view = buffer.add_bytes(file);
            images.push(json!({"bufferView": view, "mimeType": kind}));
            images.len() - 1
        });
        Some((index, is_webp))
    }

    /// Puts all lists that are not empty into the document: empty ones are not allowed.
    fn describe(self, root: &mut Value) {
        let mut used = Vec::new();
        if self.uses_strength {
            used.push(EMISSIVE_STRENGTH);
        }
        if self.uses_webp {
            used.push(WEBP);
            root["extensionsRequired"] = json!([WEBP]);
        }
        if !used.is_empty() {
            root["extensionsUsed"] = json!(used);
        }
        for (name, list) in [
            ("materials", self.materials),
            ("textures", self.textures),
            ("samplers", self.samplers),
            ("images", self.images),
        ] {
            if !list.is_empty() {
                root[name] = list.into();
            }
        }
    }
}
