//! `mrt light`.

use crate::common::{
    ROOM_LEVEL, assert_failed, assert_refused, bad_meshes, case, folder_with_room, json, mrt,
    names, text,
};
use glam::{Vec2, Vec3};
use std::fs;
use std::process::Output;
use tempfile::TempDir;

/// Lights `scene` in `level` with small pictures, into the folder `out`.
fn light(folder: &TempDir, scene: &str, level: &str, more: &[&str]) -> Output {
    let mut arguments = vec!["light", "--scene", scene, "--level", level];
    arguments.extend(["--out", "out", "--size", "48x27", "--json"]);
    arguments.extend(more);
    mrt(folder, &arguments)
}

fn assert_nothing_written(folder: &TempDir) {
    assert_eq!(names(folder.path()), ["room.obj", "room.toml"]);
}

#[test]
fn a_lit_room_leaves_pictures_lightmap_and_mesh() {
    let folder = folder_with_room();
    let lamp = ["--light", "1,1.2,0.8,5"];
    let report = json(&light(&folder, "room.obj", "room.toml", &lamp));
    assert_eq!(report["blocks"], 1);
    let written = names(&folder.path().join("out"));
    for expected in ["lightmap.hdr", "lightmap.png", "mesh.mtl", "mesh.obj"] {
        assert!(written.iter().any(|name| name == expected), "{written:?}");
    }
    assert_eq!(names(folder.path()), ["out", "room.obj", "room.toml"]);
}

#[test]
fn meshes_that_cannot_be_read_leave_nothing() {
    let folder = folder_with_room();
    for (name, bytes) in bad_meshes() {
        fs::write(folder.path().join(name), bytes).expect("writable");
        assert_failed(&light(&folder, name, "room.toml", &[]), name);
        fs::remove_file(folder.path().join(name)).expect("still there");
        assert_nothing_written(&folder);
    }
    let missing = light(&folder, "missing.obj", "room.toml", &[]);
    assert_refused(&missing, "missing.obj");
    assert_nothing_written(&folder);
}

#[test]
fn files_that_are_no_level_leave_nothing() {
    let folder = folder_with_room();
    let truncated = &ROOM_LEVEL.as_bytes()[..ROOM_LEVEL.len() - 20];
    for (name, content) in [
        ("empty.toml", &b""[..]),
        ("binary.toml", &[0xff; 100]),
        ("truncated.toml", truncated),
        ("foreign.toml", b"format = \"other\"\nversion = 1\n"),
    ] {
        fs::write(folder.path().join(name), content).expect("writable");
        let output = light(&folder, "room.obj", name, &[]);
        assert_failed(&output, name);
        let error = text(&output.stderr);
        assert!(error.contains(name), "{error}");
        fs::remove_file(folder.path().join(name)).expect("still there");
        assert_nothing_written(&folder);
    }
    let missing = light(&folder, "room.obj", "missing.toml", &[]);
    assert_refused(&missing, "missing.toml");
    assert_nothing_written(&folder);
}

#[test]
fn faulty_flags_leave_nothing() {
    let folder = folder_with_room();
    for (faulty, what) in [
        (["--dictionary", "room.obj"], "a mesh as a dictionary"),
        (["--preset", "ultra"], "an unknown preset"),
        (["--light", "9,1,1,5"], "a light outside"),
        (["--light", "1,1,1,nan"], "an intensity that is no number"),
        (["--camera", "1,1,1;1,1,1"], "a camera that looks at itself"),
    ] {
        assert_failed(&light(&folder, "room.obj", "room.toml", &faulty), what);
        assert_nothing_written(&folder);
    }
}

/// A floor with an image and a ceiling without, around a room: the lit mesh as another reader finds it.
#[cfg_attr(not(has_cases), ignore = "needs shared/cases")]
#[test]
fn the_lit_mesh_as_gltf_keeps_its_image_and_has_lightmap_coordinates() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = case("09-textures/brick.glb");
    let mapped = mrt(&folder, &["map", "--scene", &scene, "--out", "brick.toml"]);
    assert!(mapped.status.success());
    json(&light(&folder, &scene, "brick.toml", &[]));
    let bytes = fs::read(folder.path().join("out/mesh.glb")).expect("is there");
    let file = gltf::Gltf::from_slice(&bytes).expect("valid glTF 2.0");
    let blob = file.blob.as_deref().expect("a binary chunk");
    let mesh = file.meshes().next().expect("a mesh");
    let mut area = 0.0;
    for primitive in mesh.primitives() {
        let reader = primitive.reader(|_| Some(blob));
        let positions: Vec<_> = reader.read_positions().expect("positions").collect();
        let on_lightmap = reader.read_tex_coords(1).expect("lightmap coordinates");
        let on_lightmap: Vec<_> = on_lightmap.into_f32().collect();
        assert_eq!(on_lightmap.len(), positions.len());
        let is_inside = |uv: &[f32; 2]| uv.iter().all(|x| (0.0..=1.0).contains(x));
        assert!(on_lightmap.iter().all(is_inside));
        let normals: Vec<_> = reader.read_normals().expect("normals").collect();
        let indices: Vec<_> = reader.read_indices().expect("indices").into_u32().collect();
        for corners in indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|k| Vec3::from_array(positions[k as usize]));
            let doubled = (b - a).cross(c - a);
            area += f64::from(doubled.length()) / 2.0;
            let normal = Vec3::from_array(normals[corners[0] as usize]);
            assert!(doubled.dot(normal) > 0.0, "the outside stays outside");
            let [p, q, r] = corners.map(|k| Vec2::from_array(on_lightmap[k as usize]));
            assert!((q - p).perp_dot(r - p) != 0.0, "it covers texels");
        }
        let image = primitive.material().pbr_metallic_roughness();
        let image = image.base_color_texture().expect("its image");
        let gltf::image::Source::View { view, mime_type } = image.texture().source().source()
        else {
            panic!("the image is in the file");
        };
        assert_eq!(mime_type, "image/png");
        let kept = &blob[view.offset()..][..view.length()];
        let original = fs::read(case("09-textures/brick.png")).expect("is there");
        assert_eq!(kept, original);
    }
    // A room of 4 x 3 x 4 m.
    assert!((area - 80.0).abs() < 1e-3, "{area} square metres");
    // It can be mapped again.
    let again = ["map", "--scene", "out/mesh.glb", "--out", "again.toml"];
    assert!(mrt(&folder, &again).status.success());
}
