//! Writes the first inputs of the fuzzers: `cargo run --release -p mrt-tests --example fuzz_seeds FOLDER` makes a folder in
//! FOLDER for each target. They are small levels, meshes, dictionaries and reference files, made up here.

use glam::{DVec3, Vec3};
use mrt_core::container::{ByteBudget, Writer};
use mrt_core::geometry::cube::Face;
use mrt_core::storage::Storage;
use mrt_dictionary::config::BakeConfig;
use mrt_runtime::blocks::{CubeRotation, Door, SHAPES, WarpTransport, maze};
use mrt_runtime::low_level::modular::dictionary::Variant;
use mrt_runtime::low_level::modular::pack::{PackConfig, pack};
use mrt_runtime::{Dictionary, Level};
use mrt_tests::harness::{GlbParts, TARGETS};
use mrt_tests::{
    Random, baked, corridor, dictionary_format, floor_plan, random_level, set_lightfields,
};
use serde_json::json;
use std::path::Path;

fn main() {
    let folder = std::env::args().nth(1).expect("a folder as argument");
    for target in TARGETS {
        let seeds = match target.name {
            "dictionary" => dictionaries(),
            "generated_level" => random_bytes(),
            "gltf" => glb_files(),
            "level_text" => level_texts(),
            "obj" => obj_files(),
            "reference_file" => reference_files(),
            other => panic!("no seeds for {other}"),
        };
        let folder = Path::new(&folder).join(target.name);
        std::fs::create_dir_all(&folder).expect("a folder");
        for (k, seed) in seeds.iter().enumerate() {
            std::fs::write(folder.join(format!("seed{k:02}")), seed).expect("writes");
        }
        println!("{}: {} seeds", target.name, seeds.len());
    }
}

/// The least that a bake can be asked for.
fn least(config: &mut BakeConfig) {
    config.resolution = 2;
    config.modes = 2;
    config.coupling.emission_modes = 2;
    config.coupling.response_modes = 2;
    config.coupling.foreign_modes = 1;
    config.coupling.depth = 2;
    set_lightfields(config, 2, 2, 2);
}

/// Dictionaries of both versions, each storage, and with every kind of section.
fn dictionaries() -> Vec<Vec<u8>> {
    let mut seeds = vec![version_1()];
    for set in ["cubes-2d", "cubes-3d", "rooms", "cylinders"] {
        let mut whole = baked("mobile", set, |config| {
            least(config);
            config.outputs.vector = set == "cubes-2d";
        });
        // Most shapes only make inputs longer.
        whole.shapes.truncate(3);
        whole.paths.entries.truncate(4);
        if whole.shapes[0].shape.tube().is_none() {
            let operators = whole.shapes[1].clone();
            let corners = [[0.5; 3]; 8];
            let transport = WarpTransport::Rebuilt;
            whole.variants = vec![Variant {
                transport,
                corners,
                operators,
            }];
        }
        for storage in Storage::ALL {
            seeds.push(bytes_of(&whole, storage));
        }
    }
    let whole = baked("mobile", "cubes-2d", least);
    let packed = pack(
        &floor_plan(&corridor(3), 0.5),
        &whole,
        &PackConfig::default(),
    );
    seeds.push(bytes_of(&packed.expect("a corridor fits"), Storage::F32));
    seeds
}

fn bytes_of(dictionary: &Dictionary, storage: Storage) -> Vec<u8> {
    let bytes = dictionary.stored_as(storage).to_bytes();
    bytes.expect("it fits")
}

/// A file of version 1: the closed cell and the dead end, two modes of everything, two texels along an edge.
fn version_1() -> Vec<u8> {
    let mut writer = Writer::new(dictionary_format(1));
    let numbers = |name: &str, count: usize| {
        let numbers: Vec<f32> = (0..count).map(|k| 0.1 + 0.01 * k as f32).collect();
        (name.to_owned(), numbers)
    };
    let mut sections = vec![
        numbers("T_rlf_r", 4),
        numbers("U_r", 40),
        numbers("dropped", 2),
        numbers("straight", 4),
    ];
    let turn = vec![0.3, 0.0, 0.1, 0.2];
    sections.push(("left".to_owned(), turn.clone()));
    sections.push(("right".to_owned(), turn));
    for (shape, walls, openings) in [(0, 6, 0), (1, 5, 1)] {
        let texels = 4 * walls;
        for (name, count) in [("sigma", 2), ("T_d_b", 2 * texels), ("U_b", 2 * texels)] {
            sections.push(numbers(&format!("{shape}.{name}"), count));
        }
        sections.push(numbers(&format!("{shape}.L_imp"), 2 * texels));
        sections.push(numbers(&format!("{shape}.drop"), 1));
        for opening in 0..openings {
            sections.push(numbers(&format!("{shape}.R{opening}"), 4));
        }
    }
    writer.add_text("preset", "made up").expect("legal");
    writer.add_text("settings", "").expect("legal");
    writer
        .add_numbers("sizes", &[2u32, 2, 2, 2])
        .expect("legal");
    for shape in 0..2 {
        let name = format!("{shape}.name");
        writer.add_text(&name, SHAPES[shape].name).expect("legal");
    }
    for (name, numbers) in sections {
        writer.add_numbers(&name, &numbers).expect("legal");
    }
    let bytes = writer.finish();
    let read = Dictionary::from_bytes_within(&bytes, &mut ByteBudget::new(1 << 20));
    read.expect("the seed is sound");
    bytes
}

/// Levels as text: cells, boxes, warped blocks, doors, colours, tubes and rooms.
fn level_texts() -> Vec<Vec<u8>> {
    let mut random = Random(5);
    let mut levels: Vec<Level> = (1..6)
        .map(|blocks| random_level(&mut random, blocks))
        .collect();
    levels.push(maze(9, Vec3::splat(0.5), 3));
    let mut doors = floor_plan(&corridor(3), 0.5);
    doors.doors.push(Door {
        connection: 1,
        value: 0.5,
    });
    doors.blocks[1].transport = WarpTransport::Regathered;
    levels.push(doors);
    for shape in SHAPES.iter().rev().take(6) {
        let mut level = floor_plan(&corridor(1), 0.25);
        level.blocks[0].shape = shape;
        level.blocks[0].orientation = CubeRotation::about_y(1);
        level.blocks[0].emission[3] = Vec3::new(1.0, 0.0, 1e9);
        levels.push(level);
    }
    let texts = levels
        .iter()
        .map(|level| level.to_text().expect("it has text"));
    texts.map(String::into_bytes).collect()
}

/// Bytes of which levels are made.
fn random_bytes() -> Vec<Vec<u8>> {
    let mut random = Random(11);
    let seeds = [16, 64, 128, 256, 512].into_iter().cycle().take(40);
    seeds
        .map(|length| (0..length).map(|_| random.bits() as u8).collect())
        .collect()
}

/// OBJ files, with a library behind a zero byte.
fn obj_files() -> Vec<Vec<u8>> {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let quad = "v 0 0 0 1 0.5 0.2\nv 1 0 0 1 1 1\nv 1 1 0 0 0 0\nv 0 1 0 0.1 0.1 0.1\n";
    [
        format!("{triangle}f 1 2 3\n"),
        format!("# a quad\no q\ng a b\n{quad}vt 0 0\nvt 1 1\nvn 0 0 1\ns off\nf -4/1/1 -3/2/1 -2/1/1 -1/2/1\n"),
        format!("mtllib m.mtl\n{triangle}usemtl red\nf 1//1 2//1 3//1\nl 1 2 3\np 1\0newmtl red\nKd 0.7 0.1 0.1\nKe 1 2 3\nmap_Kd -s 1 1 1 m.png\n"),
        format!("mtllib none.mtl m.mtl\n{triangle}v 1 1 1\nusemtl a b\nf 1 2 3\nf 1 2 \\\n4\nusemtl c\nf 2 3 4\0newmtl a b\nKd spectral x\nd 0.5\nTr 0.5\nnewmtl c\nKd xyz 0.1 0.2 0.3\n"),
        "vp 0 1\ncstype bezier\ncurv 0 1 1 2\nv 1e30 nan inf\nv 1 2 3\nf 1 2 1\n".to_owned(),
    ]
    .map(String::into_bytes)
    .to_vec()
}

/// GLB files and the same as glTF text.
fn glb_files() -> Vec<Vec<u8>> {
    let corners: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let positions = corners.iter().flat_map(|x| x.to_le_bytes());
    let binary: Vec<u8> = positions.chain([0, 1, 2, 1, 3, 2, 0, 0]).collect();
    let plain = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"translation": [0, 0, 5], "children": [1]}, {"mesh": 0, "scale": [2, 2, -2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 0, "byteOffset": 48, "componentType": 5121, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 56}], "buffers": [{"byteLength": 56}],
    });
    let mut strips = plain.clone();
    strips["meshes"][0]["primitives"] = json!([
        {"attributes": {"POSITION": 0, "COLOR_0": 0, "NORMAL": 0, "TEXCOORD_0": 0}, "mode": 5},
        {"attributes": {"POSITION": 0}, "indices": 1, "mode": 6}, {"attributes": {"POSITION": 0}, "mode": 0}]);
    strips["nodes"][1] =
        json!({"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1]});
    let mut lamps = plain.clone();
    lamps["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_emissive_strength"]);
    lamps["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "color": [1, 0.5, 0.2], "intensity": 10, "spot": {"outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 1e9}]}});
    lamps["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    lamps["materials"][0]["emissiveFactor"] = json!([1, 1, 0]);
    lamps["materials"][0]["extensions"] =
        json!({"KHR_materials_emissive_strength": {"emissiveStrength": 5}});
    lamps["materials"][0]["extras"] = json!({"meanBaseColorLinear": [0.1, 0.2, 0.3]});
    let mut images = plain.clone();
    images["images"] = json!([{"uri": "a.png"}, {"bufferView": 0, "mimeType": "image/png"}]);
    images["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648}]);
    images["textures"] = json!([{"source": 1, "sampler": 0}]);
    images["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    let mut sparse = plain.clone();
    sparse["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": 0, "componentType": 5121, "byteOffset": 48},
        "values": {"bufferView": 0}});
    let mut inline = plain.clone();
    inline["buffers"][0]["uri"] = json!("data:application/octet-stream;base64,AAAAAAAAAAAAAAAA");
    let documents = [plain, strips, lamps, images, sparse, inline];
    let mut seeds: Vec<Vec<u8>> = documents
        .iter()
        .map(|d| d.to_string().into_bytes())
        .collect();
    for document in &documents {
        let json = document.to_string().into_bytes();
        seeds.push(
            GlbParts {
                json,
                binary: binary.clone(),
            }
            .bytes(),
        );
    }
    seeds
}

/// Reference files of each kind, for two cells.
fn reference_files() -> Vec<Vec<u8>> {
    let walls: Vec<serde_json::Value> = (0..2)
        .flat_map(|x| Face::ALL.map(|face| (x, face)))
        .filter(|&(x, face)| face != [Face::PosX, Face::NegX][x])
        .map(|(x, face)| json!([[x, 0, 0], face.name()]))
        .collect();
    let light = DVec3::splat(0.5).to_array();
    let plain = json!({
        "name": "level", "cells": [[0, 0, 0], [1, 0, 0]], "lights": [light], "intensity": 1.0,
        "resolution": 1, "bounces": 4, "walls": walls, "shape": [1, 5, 10, 1, 1],
    });
    let mut coloured = plain.clone();
    coloured["kind"] = json!("irradiance_rgb");
    coloured["terms"] = json!(["first_bounce", "all_bounces"]);
    coloured["shape"] = json!([1, 2, 10, 1, 1, 3]);
    coloured["albedo"] = json!(vec![[0.5; 3]; 10]);
    let mut probes = plain.clone();
    probes["kind"] = json!("radiance_sh9");
    probes["terms"] = json!(["a", "b"]);
    probes["albedo"] = json!(0.5);
    probes["points"] = json!([[0.5, 0.5, 0.25]]);
    probes["shape"] = json!([1, 2, 1, 9]);
    let numbers = |k: usize| (k as f32 * 0.25).to_le_bytes();
    let seed = |(description, count): (serde_json::Value, usize)| {
        let text = description.to_string().into_bytes();
        let numbers = (0..count).flat_map(numbers);
        text.into_iter().chain([0]).chain(numbers).collect()
    };
    [(plain, 50), (coloured, 60), (probes, 18)]
        .map(seed)
        .to_vec()
}
