//! Colours, images, emission, lamps, and what is counted.

use super::{Document, floats, glb, read, read_changed, triangle_numbers};
use crate::import::gltf::read_mesh;
use crate::import::raw_mesh::{LampKind, RawMesh, Wrap};
use glam::{DVec3, Vec2, Vec3};
use std::path::Path;

/// The first bytes of a PNG, which is all that this reader looks at.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

const MATERIAL: &str = r#"{"pbrMetallicRoughness":{"baseColorFactor":[0.2,0.4,0.6,1]}}"#;

fn with_material(material: &str) -> RawMesh {
    read_changed(&[(MATERIAL, material)]).expect("reads")
}

/// A triangle with two sets of coordinates, of a material whose texture information is `info`.
fn textured(info: &str, textures: &str, image: &[u8]) -> RawMesh {
    let more = format!(
        r#","materials":[{{"name":"brick","pbrMetallicRoughness":{{"baseColorTexture":{info}}}}}],
        "textures":[{textures}],"samplers":[{{"wrapS":33071,"wrapT":33648}}],
        "images":[{{"bufferView":3,"mimeType":"image/png"}},{{"uri":"none.png"}}]"#
    );
    let document = Document {
        node: "",
        primitives: r#"{"attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2},"material":0}"#,
        more: &more,
        views: &[[0, 36, 0], [36, 24, 0], [60, 12, 4], [72, image.len(), 0]],
        accessors: &[
            (0, 5126, 3, "VEC3"),
            (1, 5126, 3, "VEC2"),
            (2, 5123, 3, "VEC2n"),
        ],
    };
    let positions = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let first = floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let second = vec![0, 0, 255, 255, 0, 0, 0, 0, 255, 255, 255, 255];
    let bin = [positions, first, second, image.to_vec()].concat();
    read(&document.json(), &bin).expect("reads")
}

#[test]
fn base_colours_come_from_factors_or_stated_means() {
    let colour = |material: &str| with_material(material).paints[0].colour;
    assert_eq!(colour(MATERIAL), Some(Vec3::new(0.2, 0.4, 0.6)));
    assert_eq!(colour("{}"), Some(Vec3::ONE));
    let stated = r#"{"extras":{"meanBaseColorLinear":[0.1,0.2,0.3]}}"#;
    assert_eq!(colour(stated), Some(Vec3::new(0.1, 0.2, 0.3)));
    for other in [
        r#"{"extras":7}"#,
        r#"{"extras":{"meanBaseColorLinear":[1]}}"#,
    ] {
        assert_eq!(colour(other), Some(Vec3::ONE));
    }
    let glossy = r#"{"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.25,0,1]}},
        "pbrMetallicRoughness":{"baseColorFactor":[1,1,1,1]}}"#;
    assert_eq!(colour(glossy), Some(Vec3::new(0.5, 0.25, 0.0)));
    // Triangles without a material have a paint of their own, without colour.
    let mesh = read_changed(&[(r#","material":0"#, "")]).expect("reads");
    assert_eq!(mesh.triangle_materials, [1]);
    assert_eq!((mesh.paints.len(), mesh.paints[1].colour), (2, None));
}

#[test]
fn an_image_lies_where_its_coordinates_say() {
    let texture = r#"{"source":0,"sampler":0}"#;
    let mesh = textured(r#"{"index":0}"#, texture, PNG);
    assert_eq!(mesh.images[0].bytes, PNG);
    let image = mesh.paints[0].image.expect("an image");
    assert_eq!((image.image, image.wrap), (0, [Wrap::Clamp, Wrap::Mirror]));
    assert_eq!(mesh.corner_uvs, [[Vec2::ZERO, Vec2::X, Vec2::Y]]);
    let second_set = r#"{"index":0,"texCoord":1}"#;
    let corners = [[Vec2::Y, Vec2::ZERO, Vec2::ONE]];
    assert_eq!(textured(second_set, texture, PNG).corner_uvs, corners);
    let over = r#"{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"texCoord":0,"scale":[2,3],
        "offset":[0.5,0.25]}}}"#;
    let corners = [[
        Vec2::new(0.5, 0.25),
        Vec2::new(2.5, 0.25),
        Vec2::new(0.5, 3.25),
    ]];
    assert_eq!(textured(over, texture, PNG).corner_uvs, corners);
}

#[test]
fn images_turn_counter_clockwise_as_their_coordinates_are_seen() {
    // A quarter turn brings what lies to the right, (1, 0), upwards, where the second coordinate is less.
    let info =
        r#"{"index":0,"extensions":{"KHR_texture_transform":{"rotation":1.5707963267948966}}}"#;
    let mesh = textured(info, r#"{"source":0}"#, PNG);
    let [_, right, down] = mesh.corner_uvs[0];
    // Rounding of 32-bit sines.
    assert!(right.distance(Vec2::NEG_Y) < 1e-6, "{right}");
    assert!(down.distance(Vec2::X) < 1e-6, "{down}");
}

#[test]
fn an_image_that_cannot_be_used_is_named_with_its_materials() {
    let info = r#"{"index":0}"#;
    let webp = b"RIFF\x04\0\0\0WEBP";
    let mesh = textured(
        info,
        r#"{"extensions":{"EXT_texture_webp":{"source":0}}}"#,
        webp,
    );
    assert_eq!((mesh.images.len(), mesh.warnings.len()), (1, 0));
    for (texture, image, reason) in [
        (
            r#"{"extensions":{"KHR_texture_basisu":{"source":0}}}"#,
            PNG,
            "neither PNG, JPEG nor WebP",
        ),
        (
            r#"{"source":0}"#,
            b"\xabKTX 20\xbb",
            "`images[0]` is neither PNG",
        ),
        (r#"{"source":1}"#, PNG, "`none.png`: No such file"),
        (r#"{"source":9}"#, PNG, "image 9 of 2"),
        ("", PNG, "texture 0 of 0"),
    ] {
        let mesh = textured(info, texture, image);
        assert!(mesh.images.is_empty() && mesh.corner_uvs.is_empty());
        assert_eq!(
            (mesh.paints[0].image, mesh.paints[0].colour),
            (None, Some(Vec3::ONE))
        );
        let [warning] = &mesh.warnings[..] else {
            panic!("one warning: {:?}", mesh.warnings);
        };
        assert!(
            warning.contains("`brick`") && warning.contains(reason),
            "{warning}"
        );
    }
}

#[test]
fn each_image_is_read_once_and_only_if_it_is_used() {
    let more = r#","materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
        {"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}},
        {"pbrMetallicRoughness":{"baseColorTexture":{"index":2}}}],
        "textures":[{"source":0},{"source":0},{"source":1}],"images":[{"bufferView":1},{"uri":"none.png"}]"#;
    let document = Document {
        node: "",
        primitives: r#"{"attributes":{"POSITION":0},"material":0},{"attributes":{"POSITION":0},"material":1}"#,
        more,
        views: &[[0, 36, 0], [36, 8, 0]],
        accessors: &[(0, 5126, 3, "VEC3")],
    };
    let bin = [floats(&[0.0; 9]), PNG.to_vec()].concat();
    let mesh = read(&document.json(), &bin).expect("reads");
    assert_eq!(mesh.images.len(), 1);
    assert!(mesh.warnings[0].starts_with("2 primitives have an image but no coordinates"));
    assert!((0..2).all(|k| mesh.paints[k].image.is_some_and(|image| image.image == 0)));
    assert_eq!(mesh.paints[2].image, None);
    assert_eq!(mesh.corner_uvs, [[Vec2::ZERO; 3]; 2]);
}

#[test]
fn emission_is_factor_times_strength_and_none_with_an_image() {
    let strong = r#"{"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":
        {"emissiveStrength":10}}}"#;
    assert_eq!(
        with_material(strong).paints[0].emission,
        Vec3::new(10.0, 5.0, 0.0)
    );
    let plain = r#"{"emissiveFactor":[1,0.5,0]}"#;
    assert_eq!(
        with_material(plain).paints[0].emission,
        Vec3::new(1.0, 0.5, 0.0)
    );
    assert_eq!(with_material("{}").paints[0].emission, Vec3::ZERO);
    let image = r#"{"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}}"#;
    let mesh = with_material(image);
    assert_eq!(mesh.paints[0].emission, Vec3::ZERO);
    assert_eq!(mesh.ignored["emissive textures"], 1);
}

#[test]
fn what_is_not_used_is_counted_by_kind() {
    let unlit = r#"{"alphaMode":"BLEND","extensions":{"KHR_materials_unlit":{}}}"#;
    let more = r#""animations":[{},{}],"cameras":[{}],"extensionsUsed":["ABC_x","EXT_lights_image_based",
        "KHR_materials_ior"],"scenes":[{"nodes":[0]},{}]"#;
    let mesh = read_changed(&[(MATERIAL, unlit), (r#""scenes":[{"nodes":[0]}]"#, more)]);
    let ignored = mesh.expect("reads").ignored;
    let counts: Vec<(&str, usize)> = ignored
        .iter()
        .map(|(kind, &n)| (kind.as_str(), n))
        .collect();
    let expected = [
        ("animations", 2),
        ("cameras", 1),
        ("extension ABC_x", 1),
        ("extension EXT_lights_image_based", 1),
        ("other scenes", 1),
        ("transparent materials", 1),
        ("unlit materials", 1),
    ];
    assert_eq!(counts, expected);
}

#[test]
fn lamps_stand_and_shine_where_their_nodes_say() {
    // A quarter turn about x: what shone along -z shines along +y.
    let node = r#""nodes":[{"translation":[1,2,3],"rotation":[0.7071067811865476,0,0,0.7071067811865476],
        "scale":[3,3,3],"extensions":{"KHR_lights_punctual":{"light":LIGHT}}},"#;
    let lights = r#""extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"point","intensity":40,"color":[1,0.5,0]},
        {"type":"spot","intensity":7,"spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}},
        {"type":"directional"},{"type":"spot"},{"type":"area"},{"type":"point","intensity":1e300}]}},"meshes""#;
    let read = |light: &str| {
        let node = node.replace("LIGHT", light) + "{";
        let changes = [(r#""nodes":[{"#, node.as_str()), (r#""meshes""#, lights)];
        read_changed(&changes).expect("reads")
    };
    let kinds = [
        LampKind::Point,
        LampKind::Spot {
            inner_angle: 0.25,
            outer_angle: 0.5,
        },
        LampKind::Sun,
        LampKind::Spot {
            inner_angle: 0.0,
            outer_angle: std::f32::consts::FRAC_PI_4,
        },
    ];
    let intensities = [
        Vec3::new(40.0, 20.0, 0.0),
        Vec3::splat(7.0),
        Vec3::ONE,
        Vec3::ONE,
    ];
    for (index, (kind, intensity)) in kinds.into_iter().zip(intensities).enumerate() {
        let lamp = read(&index.to_string()).lamps[0];
        assert_eq!((lamp.kind, lamp.intensity), (kind, intensity));
        assert_eq!(lamp.position, DVec3::new(1.0, 2.0, 3.0));
        // Rounding of the quaternion.
        assert!(
            lamp.direction.distance(DVec3::Y) < 1e-15,
            "{}",
            lamp.direction
        );
    }
    for index in ["4", "5"] {
        let mesh = read(index);
        assert!(mesh.lamps.is_empty());
        assert_eq!(
            mesh.ignored["lamps of unknown kinds or without finite numbers"],
            1
        );
    }
}

#[test]
fn names_of_materials_are_cut_and_any_bytes_may_stand_in_them() {
    let long = format!(r#"{{"name":"{}"}}"#, "x".repeat(1000));
    assert_eq!(with_material(&long).paints[0].name, "x".repeat(128));
    // A byte of Latin-1 instead of UTF-8.
    let json = super::changed(&[(MATERIAL, r#"{"name":"Wand?"}"#)]);
    let mut bytes = glb(&json, &triangle_numbers());
    let at = bytes.iter().position(|&byte| byte == b'?').expect("there");
    bytes[at] = 0xe4;
    let mesh = read_mesh(Path::new("."), &bytes).expect("reads");
    assert_eq!(mesh.paints[0].name, "Wand\u{fffd}");
}
