//! Readers of meshes.

use super::glb_parts::GlbParts;
use super::target::{ChangeBytes, MAX_INPUT_BYTES, Target, measured, mutate_plain};
use crate::random::Random;
use mrt_editor::import::config::ImportConfig;
use mrt_editor::import::limits::MAX_COORDINATE_M;
use mrt_editor::import::read_scene_bytes;
use mrt_runtime::blocks::UpAxis;
use std::path::Path;
use tempfile::TempDir;

/// An OBJ file, or an OBJ file, a zero byte, and the library `m.mtl` that it may name.
pub const OBJ: Target = Target {
    name: "obj",
    run: run_obj,
    mutate: mutate_plain,
    words: &[
        "v ",
        "vt ",
        "vn ",
        "f ",
        "l ",
        "p ",
        "g ",
        "o ",
        "s off",
        "usemtl ",
        "mtllib m.mtl",
        "newmtl ",
        "Kd ",
        "Ke ",
        "Ka ",
        "Ks ",
        "Ns ",
        "d ",
        "Tr ",
        "map_Kd ",
        "m.png",
        "1/1/1",
        "1//1",
        "-1",
        "-2/-2",
        "0",
        "9223372036854775807",
        "4294967296",
        "nan",
        "inf",
        "1e39",
        "1e-46",
        "\n",
        "\\\n",
        "#",
    ],
};

/// A GLB file, or glTF as text.
pub const GLTF: Target = Target {
    name: "gltf",
    run: run_gltf,
    mutate: mutate_gltf,
    words: &[
        "\"asset\"",
        "\"version\":\"2.0\"",
        "\"scene\"",
        "\"scenes\"",
        "\"nodes\"",
        "\"children\"",
        "\"mesh\"",
        "\"meshes\"",
        "\"primitives\"",
        "\"attributes\"",
        "\"POSITION\"",
        "\"COLOR_0\"",
        "\"TEXCOORD_0\"",
        "\"NORMAL\"",
        "\"indices\"",
        "\"material\"",
        "\"materials\"",
        "\"mode\"",
        "\"accessors\"",
        "\"bufferView\"",
        "\"bufferViews\"",
        "\"buffers\"",
        "\"buffer\"",
        "\"byteOffset\"",
        "\"byteLength\"",
        "\"byteStride\"",
        "\"componentType\"",
        "\"count\"",
        "\"type\"",
        "\"VEC3\"",
        "\"SCALAR\"",
        "\"sparse\"",
        "\"values\"",
        "\"normalized\"",
        "\"min\"",
        "\"max\"",
        "\"matrix\"",
        "\"translation\"",
        "\"rotation\"",
        "\"scale\"",
        "\"textures\"",
        "\"images\"",
        "\"samplers\"",
        "\"source\"",
        "\"uri\"",
        "\"data:;base64,AAAA\"",
        "\"mimeType\"",
        "\"pbrMetallicRoughness\"",
        "\"baseColorFactor\"",
        "\"baseColorTexture\"",
        "\"emissiveFactor\"",
        "\"extras\"",
        "\"meanBaseColorLinear\"",
        "\"extensions\"",
        "\"extensionsUsed\"",
        "\"extensionsRequired\"",
        "\"KHR_lights_punctual\"",
        "\"KHR_materials_emissive_strength\"",
        "\"KHR_texture_transform\"",
        "5120",
        "5121",
        "5123",
        "5125",
        "5126",
        "4294967295",
        "18446744073709551615",
        "-1",
        "1e39",
        "null",
        "[",
        "]",
        "{",
        "}",
        ",",
        ":",
    ],
};

fn config() -> ImportConfig {
    ImportConfig {
        scale: 0.5,
        up: UpAxis::Z,
        ..ImportConfig::default()
    }
}

/// Most bytes that reading allocates beside a fixed part, for each byte of input.
const BYTES_PER_BYTE: u64 = 4096;
const FIXED_BYTES: u64 = 1 << 20;

/// Reads an OBJ file, with its library beside it if the input has one.
pub fn run_obj(bytes: &[u8]) {
    let Some(split) = bytes.iter().position(|&byte| byte == 0) else {
        return read(Path::new("/no-such-folder/scene.obj"), bytes);
    };
    thread_local! {
        // Making a folder takes longer than reading a small mesh.
        static FOLDER: TempDir = tempfile::tempdir().expect("a folder");
    }
    FOLDER.with(|folder| {
        std::fs::write(folder.path().join("m.mtl"), &bytes[split + 1..]).expect("writes");
        read(&folder.path().join("scene.obj"), &bytes[..split]);
    });
}

/// Reads a GLB file, or text as a glTF file.
pub fn run_gltf(bytes: &[u8]) {
    let name = match bytes.starts_with(b"glTF") {
        true => "/no-such-folder/scene.glb",
        false => "/no-such-folder/scene.gltf",
    };
    read(Path::new(name), bytes);
}

/// A mesh that comes out has finite corners, vertices and materials that exist, and albedos of matter.
fn read(path: &Path, bytes: &[u8]) {
    let config = config();
    let (read, allocated) = measured(|| read_scene_bytes(path, bytes, &config));
    let most = FIXED_BYTES + BYTES_PER_BYTE * bytes.len() as u64;
    assert!(allocated <= most, "{allocated} bytes, expected {most}");
    let mesh = match read {
        Ok(scene) => scene.mesh,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    assert!(!mesh.triangles.is_empty());
    assert_eq!(mesh.triangles.len(), mesh.triangle_materials.len());
    let is_near = |x: &f32| f64::from(x.abs()) <= MAX_COORDINATE_M;
    let mut positions = mesh.positions.iter();
    assert!(positions.all(|p| p.to_array().iter().all(is_near)));
    let vertices = mesh.positions.len();
    let mut corners = mesh.triangles.iter().flatten();
    assert!(corners.all(|&corner| (corner as usize) < vertices));
    let materials = mesh.materials.len();
    let mut used = mesh.triangle_materials.iter();
    assert!(used.all(|&material| (material as usize) < materials));
    for material in &mesh.materials {
        let channels = material.albedo.to_array();
        assert!(
            channels.iter().all(|a| (0.0..=1.0).contains(a)),
            "{channels:?}"
        );
    }
}

/// Changes the document or the numbers, mostly; sometimes the bytes, to try header and lengths.
fn mutate_gltf(bytes: &[u8], random: &mut Random, change: &mut ChangeBytes<'_>) -> Vec<u8> {
    let parts = GlbParts::of(bytes).filter(|_| random.below(16) != 0);
    let Some(mut parts) = parts else {
        return mutate_plain(bytes, random, change);
    };
    parts.change(random, change, MAX_INPUT_BYTES / 2);
    parts.bytes()
}
