//! What has to be refused, in one sentence, before memory is taken; and bytes at random.

use super::{Document, TRIANGLE, floats, glb, read, read_changed, sentence, triangle_numbers};
use crate::import::gltf::read_mesh;
use std::path::Path;

/// A text of the document, what stands there instead, and what the message says.
const FAULTS: [[&str; 3]; 25] = [
    [r#""nodes":[0]"#, r#""nodes":[7]"#, "scenes[0]: node 7 of 2"],
    [
        r#""children":[1]"#,
        r#""children":[7]"#,
        "nodes[0]: node 7 of 2",
    ],
    [
        r#""children":[1]"#,
        r#""children":[0]"#,
        "nodes[0]: expected nodes without a circle",
    ],
    [
        r#""scenes""#,
        r#""scene":3,"scenes""#,
        "scene: scene 3 of 1",
    ],
    [r#""mesh":0"#, r#""mesh":9"#, "nodes[1]: mesh 9 of 1"],
    [r#""mesh":0"#, r#""mesh":0,"skin":0"#, "skin 0 of 0"],
    [
        r#""POSITION":0"#,
        r#""POSITION":9"#,
        "meshes[0].primitives[0]: accessor 9 of 2",
    ],
    [
        r#""POSITION":0"#,
        r#""POSITION":1"#,
        "accessors[1]: its type: expected VEC3",
    ],
    [
        r#""indices":1"#,
        r#""indices":0"#,
        "accessors[0]: expected unsigned",
    ],
    [r#""indices":1"#, r#""indices":2"#, "accessor 2 of 2"],
    [r#""material":0"#, r#""material":5"#, "material 5 of 1"],
    [r#""material":0"#, r#""mode":7"#, "mode 7"],
    [r#""count":3"#, r#""count":0"#, "vertex 0 of 0"],
    [
        r#""count":3"#,
        r#""count":4"#,
        "accessors[0]: expected its data",
    ],
    [
        r#""componentType":5126"#,
        r#""componentType":5124"#,
        "componentType 5124",
    ],
    [
        r#""byteOffset":36"#,
        r#""byteOffset":38"#,
        "accessors[1]: expected its data",
    ],
    [
        r#""byteOffset":36"#,
        r#""byteOffset":14"#,
        "vertex 128 of 3",
    ],
    [
        r#""byteLength":40"#,
        r#""byteLength":41"#,
        "bufferViews[0]: expected its data",
    ],
    [
        r#""byteLength":40"#,
        r#""byteOffset":18446744073709551615,"byteLength":40"#,
        "bufferViews[0]",
    ],
    [
        r#""buffer":0"#,
        r#""buffer":1"#,
        "bufferViews[0]: buffer 1 of 1",
    ],
    [
        r#""bufferView":0"#,
        r#""bufferView":8"#,
        "accessors[0]: buffer view 8 of 1",
    ],
    [
        r#""version":"2.0""#,
        r#""version":"1.0""#,
        "asset: version 1.0",
    ],
    [r#""version":"2.0""#, r#""version":1"#, "asset: version 1"],
    [
        r#""version":"2.0""#,
        r#""version":"2.1","minVersion":"2.1""#,
        "asset: least version 2.1",
    ],
    [r#""mesh":0"#, r#""mesh":-1"#, "JSON, line 2"],
];

#[test]
fn every_index_and_offset_is_checked() {
    for [from, to, place] in FAULTS {
        let error = sentence(read_changed(&[(from, to)]).expect_err(to));
        assert!(error.contains(place), "{to}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn required_extensions_are_accepted_if_they_leave_the_mesh_alone() {
    let read = |name: &str| {
        let required = format!(r#""extensionsRequired":["{name}"],"scenes""#);
        read_changed(&[(r#""scenes""#, &required)])
    };
    for name in [
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "KHR_materials_unlit",
        "KHR_lights_punctual",
        "MSFT_texture_dds",
        "KHR_animation_pointer",
        "KHR_xmp_json_ld",
        "KHR_mesh_quantization",
        "EXT_mesh_gpu_instancing",
        "KHR_materials_variants",
        "GOOGLE_texture_basis",
        // Nothing in the file is compressed.
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
    ] {
        assert_eq!(
            read(name).map_err(sentence).expect(name).triangles.len(),
            1,
            "{name}"
        );
    }
    let error = sentence(read("ABC_bent_space").expect_err("refused"));
    assert!(
        error.contains("requires the glTF extension ABC_bent_space, which is not supported"),
        "{error}"
    );
}

#[test]
fn compressed_meshes_are_refused_unless_plain_numbers_stand_beside() {
    let draco = r#""material":0,"extensions":{"KHR_draco_mesh_compression":{"bufferView":0}}"#;
    let meshopt = |name: &str| {
        format!(r#""bufferViews":[{{"extensions":{{"{name}":{{"buffer":1}}}},"buffer":0"#)
    };
    let mesh = read_changed(&[(r#""material":0"#, draco)]).expect("reads");
    assert_eq!(mesh.triangles.len(), 1);
    let view = r#""bufferViews":[{"buffer":0"#;
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let with = meshopt(name);
        assert_eq!(
            read_changed(&[(view, &with)])
                .expect("reads")
                .triangles
                .len(),
            1
        );
        let required = format!(r#""extensionsRequired":["{name}"],"scenes""#);
        let error = read_changed(&[(view, &with), (r#""scenes""#, &required)]);
        let error = sentence(error.expect_err("refused"));
        assert!(
            error.contains(&format!(
                "compressed with {name}, which is not supported; export it without"
            )),
            "{error}"
        );
    }
    let required = r#""extensionsRequired":["KHR_draco_mesh_compression"],"scenes""#;
    for changes in [
        [(r#""material":0"#, draco), (r#""scenes""#, required)],
        [
            (r#""material":0"#, draco),
            (
                r#""bufferView":0,"componentType":5126"#,
                r#""componentType":5126"#,
            ),
        ],
    ] {
        let error = sentence(read_changed(&changes).expect_err("refused"));
        assert!(
            error.contains("compressed with KHR_draco_mesh_compression, which"),
            "{error}"
        );
        assert!(!error.contains("invalid"), "{error}");
    }
}

#[test]
fn too_much_is_refused_before_it_is_made() {
    let pairs = |depth: usize| {
        let nodes = (1..depth).map(|child| format!(r#"{{"children":[{child},{child}]}}"#));
        nodes.collect::<Vec<_>>().join(",")
    };
    let nodes = format!(r#""nodes":[{},{{"mesh":0}}],"meshes""#, pairs(30));
    let many_nodes = TRIANGLE.replacen(
        r#""nodes":[{"translation":[0,0,5],"children":[1]},{"mesh":0,"scale":[2,2,2]}],
    "meshes""#,
        &nodes,
        1,
    );
    let light = r#""extensions":{"KHR_lights_punctual":{"light":0}}"#;
    let nodes = format!(
        r#""extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point"}}]}}}},"nodes":[{},{{{light}}}],"meshes""#,
        pairs(14)
    );
    let many_lamps = TRIANGLE.replacen(
        r#""nodes":[{"translation":[0,0,5],"children":[1]},{"mesh":0,"scale":[2,2,2]}],
    "meshes""#,
        &nodes,
        1,
    );
    let zeros = r#""accessors":[{"componentType":5126,"count":60000000,"type":"VEC3","#;
    let many_positions = TRIANGLE.replacen(
        r#""accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","#,
        zeros,
        1,
    );
    let many_triangles = TRIANGLE.replacen(
        r#"36,"componentType":5121,"count":3"#,
        r#"36,"componentType":5121,"count":180000000"#,
        1,
    );
    let instances =
        r#""scale":[2,2,2],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"SCALE":0}}}"#;
    let many_instances = many_positions.replacen(r#""scale":[2,2,2]"#, instances, 1);
    let empty = format!(
        "{}{}]",
        r#"{"asset":{"version":"2.0"},"nodes":["#,
        "{},".repeat(4_000_001)
    );
    let children = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"children":[{}0]}}]}}"#,
        "0,".repeat(32_000_001)
    );
    for (json, expected) in [
        (&many_nodes, "at most 1,000,000 nodes"),
        (&many_lamps, "at most 4096 lamps"),
        (&many_positions, "at most 50,000,000 positions"),
        (&many_triangles, "at most 50,000,000 triangles"),
        (&many_instances, "at most 50,000,000 positions"),
        (&empty, "at most 4,000,000"),
        (&children, "at most 32,000,000"),
    ] {
        let error = sentence(read(json, &triangle_numbers()).expect_err(expected));
        assert!(error.contains(expected), "{error}");
        assert!(error.len() < 500, "{error}");
    }
}

#[test]
fn messages_are_short_and_steer_no_terminal() {
    let name = format!("\\u001b[2J{}", "x".repeat(100_000));
    let required = format!(r#""extensionsRequired":["{name}"],"scenes""#);
    let error = sentence(read_changed(&[(r#""scenes""#, &required)]).expect_err("refused"));
    assert!(
        error.len() < 500 && !error.chars().any(char::is_control),
        "{error}"
    );
}

/// A file with most of what the reader knows.
fn rich_file() -> Vec<u8> {
    let more = r#","skins":[{"joints":[1],"inverseBindMatrices":3}],"samplers":[{"wrapS":33071}],
        "materials":[{"name":"m","emissiveFactor":[1,1,1],"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,1],
        "baseColorTexture":{"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":{"scale":[2,2]}}}}}],
        "textures":[{"source":0,"sampler":0}],"images":[{"bufferView":5}],"extensionsUsed":["KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","intensity":4}]}}"#;
    let document = Document {
        node: r#","skin":0,"weights":[0.5],"scale":[-1,1,1],"children":[1,2]},{"rotation":[0,0,0,1],
            "extensions":{"KHR_lights_punctual":{"light":0}}},{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],
            "extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0,"SCALE":0}}}"#,
        primitives: r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1,"COLOR_0":2,"JOINTS_0":4,"WEIGHTS_0":2},"indices":5,
            "material":0,"mode":5,"targets":[{"POSITION":0}]}"#,
        more,
        views: &[
            [0, 48, 0],
            [48, 32, 0],
            [80, 16, 4],
            [96, 64, 0],
            [160, 8, 0],
            [168, 8, 0],
        ],
        accessors: &[
            (0, 5126, 4, "VEC3"),
            (1, 5126, 4, "VEC2"),
            (2, 5121, 4, "VEC4n"),
            (3, 5126, 1, "MAT4"),
            (2, 5121, 4, "VEC4"),
            (4, 5123, 4, "SCALAR"),
        ],
    };
    let identity = floats(&glam::Mat4::IDENTITY.to_cols_array());
    let corners = [0, 0, 1, 0, 2, 0, 3, 0];
    let image = b"\x89PNG\r\n\x1a\n";
    let numbers = [
        floats(&[0.5; 20]),
        vec![0; 16],
        identity,
        corners.to_vec(),
        image.to_vec(),
    ];
    glb(&document.json(), &numbers.concat())
}

/// Numbers without pattern; SplitMix64, whose source is Steele, Lea and Flood, 2014.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end as u64) as usize
    }
}

/// Changes bytes, numbers of the document, or the end.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    const NUMBERS: [&str; 8] = [
        "0",
        "1",
        "7",
        "-1",
        "4294967295",
        "1e308",
        "2.5",
        "99999999",
    ];
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len());
        match random.below(8) {
            0 => bytes.truncate(at.max(1)),
            1 => bytes[at] = random.below(256) as u8,
            2 => bytes[at] ^= 1 << random.below(8),
            _ => {
                let digit = |byte: &u8| byte.is_ascii_digit();
                let Some(start) = bytes[at..].iter().position(digit) else {
                    continue;
                };
                let start = at + start;
                let rest = bytes[start..].iter().position(|byte| !digit(byte));
                let end = rest.map_or(bytes.len(), |rest| start + rest);
                let number = NUMBERS[random.below(NUMBERS.len())];
                bytes.splice(start..end, number.bytes());
            }
        }
    }
}

/// Puts the lengths of a binary file right again, so that damage gets past the container.
fn mend_lengths(json: &[u8], bin: &[u8]) -> Vec<u8> {
    glb(&String::from_utf8_lossy(json), bin)
}

#[test]
fn damaged_files_are_read_or_refused_and_never_panic() {
    let rich = rich_file();
    let whole = read_mesh(Path::new("."), &rich)
        .map_err(sentence)
        .expect("reads");
    assert_eq!((whole.lamps.len(), whole.images.len()), (1, 1));
    let json_length = u32::from_le_bytes([rich[12], rich[13], rich[14], rich[15]]) as usize;
    let (json, bin) = (&rich[20..20 + json_length], &rich[28 + json_length..]);
    let mut random = Random(1);
    let mut read_count = 0;
    for round in 0..20_000 {
        let bytes = if round % 4 == 0 {
            let mut bytes = rich.clone();
            damage(&mut bytes, &mut random);
            bytes
        } else {
            let (mut json, mut bin) = (json.to_vec(), bin.to_vec());
            damage(
                if round % 4 == 1 { &mut bin } else { &mut json },
                &mut random,
            );
            mend_lengths(&json, &bin)
        };
        let Ok(mesh) = read_mesh(Path::new("."), &bytes) else {
            continue;
        };
        read_count += 1;
        let (positions, paints) = (mesh.positions.len(), mesh.paints.len());
        assert!(
            mesh.triangles
                .iter()
                .flatten()
                .all(|&corner| (corner as usize) < positions)
        );
        assert!(
            mesh.triangle_materials
                .iter()
                .all(|&paint| (paint as usize) < paints)
        );
        assert_eq!(mesh.triangle_materials.len(), mesh.triangles.len());
        assert!([0, positions].contains(&mesh.colours.len()));
        assert!([0, mesh.triangles.len()].contains(&mesh.corner_uvs.len()));
        let images = mesh.paints.iter().filter_map(|paint| paint.image);
        assert!(
            images
                .into_iter()
                .all(|image| image.image < mesh.images.len())
        );
    }
    // Enough get through that the checks above mean something.
    assert!(read_count > 2_000, "{read_count}");
}
