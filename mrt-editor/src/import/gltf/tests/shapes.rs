//! Positions, triangles and where nodes put them.

use super::{Document, floats, read, read_changed};
use glam::{DVec3, Vec3};

const FLOAT: u32 = 5126;
const U8: u32 = 5121;

fn points(points: &[[f64; 3]]) -> Vec<DVec3> {
    points.iter().map(|&p| DVec3::from_array(p)).collect()
}

/// Corners of strips and fans: (0, 0), (0, 1), (1, 0), (1, 1), (2, 0).
fn zigzag() -> Vec<u8> {
    floats(&[0., 0., 0., 0., 1., 0., 1., 0., 0., 1., 1., 0., 2., 0., 0.])
}

#[test]
fn triangles_stand_where_their_nodes_put_them() {
    let mesh = read_changed(&[]).expect("reads");
    let corners = [[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [0.0, 2.0, 5.0]];
    assert_eq!(mesh.positions, points(&corners));
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.triangle_materials, [0]);
    assert!(mesh.ignored.is_empty() && mesh.warnings.is_empty());
}

#[test]
fn a_matrix_or_a_turn_places_a_node() {
    let matrix = r#""matrix":[0,0,-1,0, 0,1,0,0, 1,0,0,0, 7,8,9,1]"#;
    let corners = points(&[[7.0, 8.0, 9.0], [7.0, 8.0, 8.0], [7.0, 9.0, 9.0]]);
    let mesh = read_changed(&[(r#""translation":[0,0,5]"#, matrix), ("[2,2,2]", "[1,1,1]")]);
    assert_eq!(mesh.expect("reads").positions, corners);
    // A quarter turn about y, by a quaternion that is not quite of unit length.
    let turn = r#""translation":[7,8,9],"rotation":[0,0.71,0,0.71]"#;
    let mesh = read_changed(&[(r#""translation":[0,0,5]"#, turn), ("[2,2,2]", "[1,1,1]")]);
    for (found, expected) in mesh.expect("reads").positions.iter().zip(corners) {
        // Rounding of 64-bit numbers below 10.
        assert!(found.distance(expected) < 1e-14, "{found} {expected}");
    }
}

#[test]
fn a_mirrored_node_turns_its_triangles_over() {
    let mesh = read_changed(&[("[2,2,2]", "[-2,2,2]")]).expect("reads");
    assert_eq!(mesh.positions[1], DVec3::new(-2.0, 0.0, 5.0));
    assert_eq!(mesh.triangles, [[0, 2, 1]]);
    let mesh = read_changed(&[("[2,2,2]", "[-2,2,-2]")]).expect("reads");
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn strips_and_fans_become_triangles_and_the_rest_is_counted() {
    let read = |mode: u32| {
        let primitives = format!(r#"{{"attributes":{{"POSITION":0}},"mode":{mode}}}"#);
        let document = Document {
            node: "",
            primitives: &primitives,
            more: "",
            views: &[[0, 60, 0]],
            accessors: &[(0, FLOAT, 5, "VEC3")],
        };
        read(&document.json(), &zigzag()).expect("reads")
    };
    assert_eq!(read(4).triangles, [[0, 1, 2]]);
    assert_eq!(read(5).triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(read(6).triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    for (mode, kind) in [(0, "points"), (1, "lines"), (2, "lines"), (3, "lines")] {
        let mesh = read(mode);
        assert!(mesh.triangles.is_empty());
        assert_eq!(mesh.ignored[&format!("primitives of {kind}")], 1);
    }
    // All of a strip faces the same way.
    let mesh = read(5);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        assert!((b - a).cross(c - a).z < 0.0);
    }
}

#[test]
fn integers_are_read_with_their_stride_and_normalised() {
    let bytes = [127, 0, 0x81, 9, 0x80, 64, 0, 9, 0, 0, 0, 9];
    for (component, shape, first, second) in [
        (5120, "VEC3", [127.0, 0.0, -127.0], [-128.0, 64.0, 0.0]),
        (5120, "VEC3n", [1.0, 0.0, -1.0], [-1.0, 64.0 / 127.0, 0.0]),
        (5121, "VEC3", [127.0, 0.0, 129.0], [128.0, 64.0, 0.0]),
        (
            5121,
            "VEC3n",
            [127.0 / 255.0, 0.0, 129.0 / 255.0],
            [128.0 / 255.0, 64.0 / 255.0, 0.0],
        ),
    ] {
        let document = Document {
            node: "",
            primitives: r#"{"attributes":{"POSITION":0}}"#,
            more: r#","extensionsRequired":["KHR_mesh_quantization"]"#,
            views: &[[0, 12, 4]],
            accessors: &[(0, component, 3, shape)],
        };
        let mesh = read(&document.json(), &bytes).expect("reads");
        assert_eq!(mesh.positions, points(&[first, second, [0.0; 3]]));
    }
    let words: Vec<u8> = [65535u16, 0, 0x8000, 0]
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect();
    for (component, shape, expected) in [
        (5122, "VEC3n", [-1.0 / 32767.0, 0.0, -1.0]),
        (5123, "VEC3n", [1.0, 0.0, 32768.0 / 65535.0]),
        (5123, "VEC3", [65535.0, 0.0, 32768.0]),
    ] {
        let document = Document {
            node: "",
            primitives: r#"{"attributes":{"POSITION":0}}"#,
            more: "",
            views: &[[0, 8, 8]],
            accessors: &[(0, component, 1, shape)],
        };
        let mesh = read(&document.json(), &words).expect("reads");
        assert_eq!(mesh.positions, points(&[expected]));
    }
}

#[test]
fn indices_of_each_size_are_read() {
    for (component, bytes) in [
        (5121, vec![2, 1, 0]),
        (5123, vec![2, 0, 1, 0, 0, 0]),
        (5125, vec![2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        let document = Document {
            node: "",
            primitives: r#"{"attributes":{"POSITION":0},"indices":1}"#,
            more: "",
            views: &[[0, 36, 0], [36, bytes.len(), 0]],
            accessors: &[(0, FLOAT, 3, "VEC3"), (1, component, 3, "SCALAR")],
        };
        let bin = [floats(&[0.0; 9]), bytes].concat();
        assert_eq!(
            read(&document.json(), &bin).expect("reads").triangles,
            [[2, 1, 0]]
        );
    }
}

#[test]
fn sparse_numbers_replace_zeros_or_data() {
    let sparse = r#""sparse":{"count":1,"indices":{"bufferView":0,"byteOffset":37,"componentType":5121},
        "values":{"bufferView":0,"byteOffset":12}},"componentType":5126"#;
    let at = |from: &'static str| {
        [
            (from, ""),
            (r#""componentType":5126"#, sparse),
            ("[2,2,2]", "[1,1,1]"),
        ]
    };
    let mesh = read_changed(&at(r#""bufferView":0,"#)).expect("reads");
    assert_eq!(
        mesh.positions,
        points(&[[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 0.0, 5.0]])
    );
    let mesh = read_changed(&at("")).expect("reads");
    assert_eq!(
        mesh.positions,
        points(&[[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]])
    );
}

#[test]
fn instances_stand_where_their_attributes_put_them() {
    let document = Document {
        node: r#","translation":[0,0,5],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":
            {"TRANSLATION":1,"ROTATION":2,"SCALE":3}}}"#,
        primitives: r#"{"attributes":{"POSITION":0}}"#,
        more: r#","extensionsRequired":["EXT_mesh_gpu_instancing"]"#,
        views: &[[0, 36, 0], [36, 24, 0], [60, 8, 0], [68, 24, 0]],
        accessors: &[
            (0, FLOAT, 3, "VEC3"),
            (1, FLOAT, 2, "VEC3"),
            (2, 5120, 2, "VEC4n"),
            (3, FLOAT, 2, "VEC3"),
        ],
    };
    let corners = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let translations = floats(&[0., 0., 0., 10., 0., 0.]);
    // No turn, and half a turn about z.
    let rotations = vec![0, 0, 0, 127, 0, 0, 127, 0];
    let scales = floats(&[1., 1., 1., 1., 1., -1.]);
    let bin = [corners, translations, rotations, scales].concat();
    let mesh = read(&document.json(), &bin).expect("reads");
    let expected = [
        [0., 0., 5.],
        [1., 0., 5.],
        [0., 1., 5.],
        [10., 0., 5.],
        [9., 0., 5.],
        [10., -1., 5.],
    ];
    for (found, expected) in mesh.positions.iter().zip(points(&expected)) {
        // Rounding of 64-bit numbers up to 10.
        assert!(found.distance(expected) < 1e-14, "{found} {expected}");
    }
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 5, 4]]);
}

#[test]
fn joints_and_targets_move_vertices_as_the_file_poses_them() {
    let document = Document {
        // The mesh stands where its joints are, and its own node moves it only through them.
        node: r#","skin":0,"translation":[100,0,0],"weights":[0.5],"children":[1,2]},
            {"translation":[0,10,0]},{"translation":[0,20,0]"#,
        primitives: r#"{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2},"targets":[{"POSITION":3}]}"#,
        more: r#","skins":[{"joints":[1,2]}]"#,
        views: &[[0, 36, 0], [36, 12, 0], [48, 12, 0], [60, 36, 0]],
        accessors: &[
            (0, FLOAT, 3, "VEC3"),
            (1, U8, 3, "VEC4"),
            (2, U8, 3, "VEC4n"),
            (3, FLOAT, 3, "VEC3"),
        ],
    };
    let corners = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let joints = vec![0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
    let weights = vec![255, 0, 0, 0, 255, 0, 0, 0, 51, 204, 0, 0];
    let target = floats(&[0., 0., 0., 0., 0., 0., 0., 0., 4.]);
    let bin = [corners, joints, weights, target].concat();
    let mesh = read(&document.json(), &bin).expect("reads");
    let expected = points(&[[100.0, 10.0, 0.0], [101.0, 20.0, 0.0], [100.0, 19.0, 2.0]]);
    for (found, expected) in mesh.positions.iter().zip(expected) {
        // Rounding of 64-bit numbers up to 101.
        assert!(found.distance(expected) < 1e-14, "{found} {expected}");
    }
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn the_default_scene_is_read_or_what_there_is() {
    let count = |changes: &[(&str, &str)]| read_changed(changes).expect("reads").triangles.len();
    let scenes = r#""scenes":[{"nodes":[0]}]"#;
    assert_eq!(
        count(&[(scenes, r#""scenes":[{},{"nodes":[0]}],"scene":1"#)]),
        1
    );
    assert_eq!(
        count(&[(scenes, r#""scenes":[{"nodes":[0]},{"name":"no nodes"}]"#)]),
        1
    );
    assert_eq!(count(&[(scenes, r#""scenes":[{"name":"no nodes"}]"#)]), 0);
    assert_eq!(count(&[(scenes, r#""scenes":[]"#)]), 1);
    assert_eq!(count(&[(r#""scenes":[{"nodes":[0]}],"#, "")]), 1);
    let hidden = r#""extensions":{"KHR_node_visibility":{"visible":false}},"children""#;
    let mesh = read_changed(&[(r#""children""#, hidden)]).expect("reads");
    assert_eq!((mesh.triangles.len(), mesh.ignored["hidden nodes"]), (0, 1));
}

#[test]
fn vertex_colours_are_linear_and_white_where_there_are_none() {
    for (component, shape, bytes, expected) in [
        (
            FLOAT,
            "VEC3",
            floats(&[0.25, 0.5, -1.0]),
            Vec3::new(0.25, 0.5, 0.0),
        ),
        (
            FLOAT,
            "VEC4",
            floats(&[0.25, 0.5, 1.0, 0.0]),
            Vec3::new(0.25, 0.5, 1.0),
        ),
        (U8, "VEC4n", vec![51, 0, 255, 9], Vec3::new(0.2, 0.0, 1.0)),
        (
            5123,
            "VEC3n",
            vec![255, 255, 0, 0, 0x33, 0x33],
            Vec3::new(1.0, 0.0, 0.2),
        ),
    ] {
        let bin = [floats(&[1.0, 2.0, 3.0]), bytes].concat();
        let document = Document {
            node: "",
            primitives: r#"{"attributes":{"POSITION":0}},{"attributes":{"POSITION":0,"COLOR_0":1}},
                {"attributes":{"POSITION":0}}"#,
            more: "",
            views: &[[0, 12, 0], [12, bin.len() - 12, 0]],
            accessors: &[(0, FLOAT, 1, "VEC3"), (1, component, 1, shape)],
        };
        let mesh = read(&document.json(), &bin).expect("reads");
        assert_eq!(mesh.colours, [Vec3::ONE, expected, Vec3::ONE]);
    }
    assert!(read_changed(&[]).expect("reads").colours.is_empty());
}
