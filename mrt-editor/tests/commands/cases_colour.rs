//! Public bug reports about colours, lamps, emission and materials that are left out; and meshes far from their origin.

use crate::common::{ROOM_LEVEL, ROOM_OBJ, assert_refused, case, folder, json, mrt, text};
use serde_json::Value;
use std::ffi::OsString;
use std::fs;
use tempfile::TempDir;

/// The report of `mrt map` on a case.
fn mapped(folder: &TempDir, scene: &str, more: &[&str]) -> Value {
    let mut arguments: Vec<OsString> = vec!["map".into(), "--scene".into(), case(scene).into()];
    arguments.extend(["--out", "l.toml", "--json"].map(OsString::from));
    arguments.extend(more.iter().map(OsString::from));
    json(&mrt(folder, &arguments))
}

/// The report of `mrt light` on a case in the level just mapped.
fn lit(folder: &TempDir, scene: &str, more: &[&str]) -> Value {
    let mut arguments: Vec<OsString> = vec!["light".into(), "--scene".into(), case(scene).into()];
    let usual = [
        "--level", "l.toml", "--out", "o", "--json", "--size", "160x90",
    ];
    arguments.extend(usual.map(OsString::from));
    arguments.extend(["--exposure", "0"].map(OsString::from));
    arguments.extend(more.iter().map(OsString::from));
    json(&mrt(folder, &arguments))
}

/// The level's first albedo.
fn albedo(folder: &TempDir) -> Vec<f64> {
    let level = fs::read_to_string(folder.path().join("l.toml")).expect("written");
    let line = level
        .lines()
        .find_map(|line| line.strip_prefix("albedo = "));
    serde_json::from_str(line.expect("an albedo")).expect("three numbers")
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let pairs = found.iter().zip(expected);
    let far = pairs
        .into_iter()
        .any(|(found, expected)| (found - expected).abs() > tolerance);
    assert!(!far, "{found:?}, expected {expected:?}");
}

/// Mean direct and indirect luminance of a view.
fn view(report: &Value, index: usize) -> [f64; 2] {
    let number = |name: &str| report["views"][index][name].as_f64().expect("a number");
    [number("direct"), number("indirect")]
}

const IN_THE_ROOM: [&str; 4] = ["--light", "2,2,2,20", "--camera", "0.3,1.6,2;4,1.2,2"];

/// Rounding of the printed figures, and of pictures between machines.
const FIGURES: f64 = 2e-3;

#[test]
#[cfg_attr(not(has_cases), ignore = "needs the folder shared/cases")]
fn images_colour_walls_and_pictures() {
    for scene in ["09-textures/brick.glb", "09-textures/brick.obj"] {
        let folder = folder();
        let report = mapped(&folder, scene, &[]);
        assert_eq!(report["mesh"]["images"], 1, "{scene}: {report}");
        assert_eq!(report["paint"]["moved_walls"], 0, "{scene}");
        assert_near(&albedo(&folder), &[0.503, 0.250, 0.125], 0.005);
        let report = lit(&folder, scene, &IN_THE_ROOM);
        assert_near(&view(&report, 0), &[0.2668, 0.1678], FIGURES);
    }
}

#[test]
#[cfg_attr(not(has_cases), ignore = "needs the folder shared/cases")]
fn skies_and_triggers_are_left_out() {
    let folder = folder();
    let report = mapped(&folder, "12-tool-materials/sky.obj", &[]);
    assert_eq!(report["mesh"]["left_out_materials"]["sky"], 12);
    assert_eq!(report["blocks"], 1);
    let cell = report["cell_m"].as_f64().expect("a number");
    // The height is measured in voxels of 0.06 m.
    assert!((cell - 3.0).abs() < 0.1, "{cell}");
    let report = mapped(
        &folder,
        "12-tool-materials/sky.obj",
        &["--keep-tool-materials"],
    );
    assert_eq!(report["mesh"]["left_out_materials"], serde_json::json!({}));

    let corridor = "12-tool-materials/trigger.obj";
    for flags in [
        &[][..],
        &["--skip-material", "trig*"],
        &["--only-material", "brick"],
    ] {
        let report = mapped(&folder, corridor, flags);
        assert_eq!(
            (&report["blocks"], &report["connections"]),
            (&7.into(), &6.into())
        );
        let lamp = [
            "--light",
            "1.5,2,1.5,20",
            "--camera",
            "7,1.6,1.5;11,1.2,1.5",
        ];
        let report = lit(&folder, corridor, &lamp);
        assert!(report["mesh"]["left_out_materials"]["trigger"].as_u64() > Some(0));
        assert_near(&view(&report, 0), &[0.0122, 0.0483], FIGURES);
    }
}

#[test]
#[cfg_attr(not(has_cases), ignore = "needs the folder shared/cases")]
fn vertex_colours_colour_walls() {
    let folder = folder();
    mapped(&folder, "19-ignored-content/vertex-colours.glb", &[]);
    assert_near(&albedo(&folder), &[0.8, 0.1, 0.1], 1e-4);
}

#[test]
#[cfg_attr(not(has_cases), ignore = "needs the folder shared/cases")]
fn surfaces_that_shine_light_their_room() {
    let folder = folder();
    let scene = "19-ignored-content/emissive.glb";
    let report = mapped(&folder, scene, &[]);
    // 80 m² at 10 W/(m² sr).
    let watts = 80.0 * 10.0 * std::f64::consts::PI;
    let emitted: Vec<f64> =
        serde_json::from_value(report["paint"]["emitted_w"].clone()).expect("RGB");
    assert_near(&emitted, &[watts; 3], 1e-3 * watts);
    let report = lit(&folder, scene, &["--camera", "0.3,1.6,2;4,1.2,2"]);
    assert_eq!(report["lights"], serde_json::json!([]));
    assert_eq!(report["emissive_walls"], 6);
    // In a closed room of albedo 0.5 that shines everywhere, as much light is reflected as emitted; the flux limit and 32
    // modes leave a hundredth.
    assert_near(&view(&report, 0), &[10.0, 10.0], 0.3);
}

#[test]
#[cfg_attr(not(has_cases), ignore = "needs the folder shared/cases")]
fn lamps_of_the_file_shine_unless_others_are_given() {
    let folder = folder();
    let scene = "19-ignored-content/light.glb";
    mapped(&folder, scene, &[]);
    let camera = ["--camera", "0.3,1.6,2;4,1.2,2"];
    let of_file = lit(&folder, scene, &camera);
    assert_eq!(of_file["lights_of_mesh"], true);
    let same = lit(
        &folder,
        scene,
        &[&camera[..], &["--light", "2,2,2,40"]].concat(),
    );
    assert_eq!(same["lights_of_mesh"], false);
    assert_eq!(view(&of_file, 0), view(&same, 0));
}

#[test]
#[cfg_attr(not(has_cases), ignore = "needs the folder shared/cases")]
fn instances_become_rooms() {
    let report = mapped(&folder(), "19-ignored-content/instancing.glb", &[]);
    assert_eq!(report["shapes"], serde_json::json!({ "closed": 2 }));
}

#[test]
fn a_level_that_shines_needs_no_lamps() {
    let folder = folder();
    fs::write(folder.path().join("room.obj"), ROOM_OBJ).expect("writable");
    let pi = std::f64::consts::PI;
    let faces = ["-x", "+x", "-y", "+y", "-z", "+z"];
    let emission = faces.map(|face| format!("\"{face}\" = [{pi}, {pi}, {pi}]"));
    let level = format!(
        "{ROOM_LEVEL}face_emission = {{ {} }}\n",
        emission.join(", ")
    );
    fs::write(folder.path().join("l.toml"), level).expect("writable");
    let usual = [
        "light", "--scene", "room.obj", "--level", "l.toml", "--out", "o", "--json",
    ];
    let view_flags = ["--size", "48x27", "--camera", "0.2,1,1;2,1.1,0.9"];
    let report = json(&mrt(&folder, &[&usual[..], &view_flags].concat()));
    assert_eq!(report["lights"], serde_json::json!([]));
    assert_eq!(report["emissive_walls"], 6);
    // Walls of albedo 0.5 that emit pi W/m² get 2 pi; the mesh, which states no colour, reflects 0.53 of it as radiance
    // 2 * 0.53. The built-in dictionary keeps 32 modes of a white room.
    assert_near(&view(&report, 0), &[0.0, 1.06], 0.02);
    // By itself, light places cameras too.
    let alone = json(&mrt(&folder, &[&usual[..], &["--size", "16x9"]].concat()));
    assert!(
        alone["views"]
            .as_array()
            .is_some_and(|views| views.len() >= 2),
        "{alone}"
    );
}

#[test]
fn materials_that_the_mesh_lacks_are_refused_and_named() {
    let folder = folder();
    let room = format!("usemtl plaster\n{ROOM_OBJ}");
    fs::write(folder.path().join("room.obj"), room).expect("writable");
    for flag in ["--skip-material", "--only-material"] {
        let map = [
            "map", "--scene", "room.obj", "--out", "l.toml", flag, "brick",
        ];
        let output = mrt(&folder, &map);
        assert_refused(&output, "`brick`");
        assert!(text(&output.stderr).contains("`plaster`"));
    }
    assert!(!folder.path().join("l.toml").exists());
}

#[test]
fn a_level_remembers_scale_and_axis_and_refuses_others() {
    let folder = folder();
    fs::write(folder.path().join("room.obj"), ROOM_OBJ).expect("writable");
    let map = [
        "map", "--scene", "room.obj", "--out", "l.toml", "--scale", "0.01", "--up", "z",
    ];
    assert!(mrt(&folder, &map).status.success());
    let light = |more: &[&str]| {
        let usual = [
            "light", "--scene", "room.obj", "--level", "l.toml", "--out", "o", "--json",
        ];
        mrt(&folder, &[&usual[..], &["--size", "16x9"], more].concat())
    };
    let report = json(&light(&[]));
    assert_eq!(report["mesh"]["scale"], 0.01);
    json(&light(&["--scale", "0.01", "--up", "z"]));
    assert_refused(&light(&["--scale", "1"]), "100 times");
    assert_refused(&light(&["--up", "y"]), "--up z");
}

/// The level's blocks, and what `light` finds in it, of a room that stands at `x`.
fn far_room(x: f64) -> (String, Value) {
    let folder = folder();
    let moved = |line: &str| match line.strip_prefix("v ") {
        Some(numbers) => {
            let (first, rest) = numbers.split_once(' ').expect("three numbers");
            format!("v {} {rest}\n", first.parse::<f64>().expect("a number") + x)
        }
        None => format!("{line}\n"),
    };
    let room: String = ROOM_OBJ.lines().map(moved).collect();
    fs::write(folder.path().join("room.obj"), room).expect("writable");
    json(&mrt(
        &folder,
        &["map", "--scene", "room.obj", "--out", "l.toml", "--json"],
    ));
    let level = fs::read_to_string(folder.path().join("l.toml")).expect("written");
    let lamp = format!("{},1.2,0.8,5", x + 1.0);
    let camera = format!("{},1,1;{},1.1,0.9", x + 0.2, x + 2.0);
    let mut light = vec![
        "light", "--scene", "room.obj", "--level", "l.toml", "--out", "o", "--json",
    ];
    light.extend([
        "--size",
        "48x27",
        "--exposure",
        "0",
        "--light",
        &lamp,
        "--camera",
        &camera,
    ]);
    let report = json(&mrt(&folder, &light));
    assert_eq!(report["lights"][0][0].as_f64(), Some(x + 1.0));
    let mesh = fs::read_to_string(folder.path().join("o/mesh.obj")).expect("written");
    let vertices = mesh.lines().filter_map(|line| line.strip_prefix("v "));
    let low = vertices
        .map(|line| {
            line.split(' ')
                .next()
                .and_then(|x| x.parse().ok())
                .expect("a number")
        })
        .fold(f64::MAX, f64::min);
    assert_eq!(low, x);
    let blocks = level.find("[[block]]").expect("a block");
    (level[blocks..].to_owned(), report)
}

#[test]
fn a_room_far_from_its_origin_is_mapped_and_lit_as_at_it() {
    // The origin becomes (x + 1, 1, 1), the room's centre; so a room around the origin is what to compare with.
    let (level, report) = far_room(-1.0);
    let numbers = |level: &str| -> Vec<f64> {
        let is_part = |c: char| !(c.is_ascii_digit() || c == '.' || c == '-');
        level
            .split(is_part)
            .filter_map(|word| word.parse().ok())
            .collect()
    };
    for x in [1e6, -1e7, 3e7] {
        let (far, far_report) = far_room(x);
        // Height and depth are 1 m lower in the far level.
        let centred = [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]].concat();
        assert_near(&numbers(&far)[..6], &centred, 1e-6);
        assert_near(
            &numbers(&level)[..6],
            &[-1.0, 0.0, 0.0, 1.0, 2.0, 2.0],
            1e-6,
        );
        // Positions differ by roundings of 1e-7.
        assert_near(&view(&far_report, 0), &view(&report, 0), 1e-4);
    }
}

#[test]
fn causes_are_named_with_their_flags() {
    let folder = folder();
    fs::write(folder.path().join("room.obj"), ROOM_OBJ).expect("writable");
    let huge = ROOM_OBJ.replace("v 2 ", "v 2e12 ");
    fs::write(folder.path().join("huge.obj"), huge).expect("writable");
    let far = ROOM_OBJ
        .replace("v 0 ", "v 2e12 ")
        .replace("v 2 ", "v 2000000000002 ");
    fs::write(folder.path().join("far.obj"), far).expect("writable");
    let map = |scene: &str, more: &[&str]| {
        let usual = ["map", "--scene", scene, "--out", "l.toml"];
        mrt(&folder, &[&usual[..], more].concat())
    };
    assert_refused(&map("huge.obj", &[]), "too large: see --scale");
    assert_refused(&map("far.obj", &[]), "too far from its origin");
    assert_refused(&map("room.obj", &["--cell", "100"]), "--cell");
    // A box with its faces turned outwards, and only fronts wanted.
    let outwards: String = ROOM_OBJ
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => {
                let reversed: Vec<&str> = corners.split(' ').rev().collect();
                format!("f {}\n", reversed.join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    fs::write(folder.path().join("statue.obj"), outwards).expect("writable");
    assert_refused(&map("statue.obj", &["--winding", "front"]), "solid");
}
