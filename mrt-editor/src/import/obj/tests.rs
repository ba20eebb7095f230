use super::*;
use crate::import::raw_mesh::Wrap;
use std::fs;
use tempfile::TempDir;

fn read_text(text: &str) -> Result<RawMesh, ImportError> {
    read(Path::new("nowhere/test.obj"), text.as_bytes())
}

/// A triangle with texture coordinates; lines before and after it.
fn triangle(before: &str, after: &str) -> Vec<u8> {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nf 1/1 2/2 3/1\n";
    format!("{before}\n{triangle}{after}\n").into_bytes()
}

/// A folder with these files.
fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        fs::write(path, bytes).expect("writable");
    }
    folder
}

fn read_in(folder: &TempDir, text: &[u8]) -> RawMesh {
    read(&folder.path().join("test.obj"), text).expect("reads")
}

#[test]
fn polygons_and_relative_indices_become_triangles() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\n\
                usemtl a b\nf -5 -4//7 3/1/2 -2 # quad\nusemtl c\nf 1 2 3\n";
    let mesh = read_text(text).expect("reads");
    assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(mesh.triangle_materials, vec![0, 0, 1]);
    assert_eq!(mesh.paints[0].name, "a b");
    assert_eq!(mesh.positions.len(), 5);
    assert!(mesh.corner_uvs.is_empty() && mesh.colours.is_empty());
}

#[test]
fn each_fault_is_refused_with_its_line_and_word() {
    for (text, line, found) in [
        ("v 0 0 0\nf x 1 1\n", 2, "`x`"),
        ("v 0 0 0\nv 1 2\n", 2, "`1 2`"),
        ("v 0 0 0\nv a b c\n", 2, "`a`"),
        ("v 0 0 0\nv 1 2 3 red 0 0\n", 2, "`red`"),
        ("v 0 0 0\nf 1 2 3\n", 2, "`2`"),
        ("v 0 0 0\nf 0 1 1\n", 2, "`0`"),
        (
            "v 0 0 0\nf 1 1 -9223372036854775808\n",
            2,
            "-9223372036854775808",
        ),
        ("v 0 \\\r\n0 0\r\n\r\nf 1 1 \\\r\nx\r\n", 4, "`x`"),
        ("# C:\\\nv 0 0 \u{1b}[2J", 2, "`\\u{1b}[2J`"),
    ] {
        let error = read_text(text).expect_err("refused").to_string();
        assert!(
            error.contains(&format!("line {line}:")),
            "{text:?}: {error}"
        );
        assert!(error.contains(found), "{text:?}: {error}");
    }
    let long = format!("v 0 0 {}", "x".repeat(1 << 20));
    assert!(read_text(&long).expect_err("refused").to_string().len() < 1000);
    let half = read(Path::new("a.obj"), b"\xff\xfev").expect_err("refused");
    assert!(half.to_string().contains("UTF-16"), "{half}");
}

#[test]
fn every_encoding_reads_and_spoils_only_names() {
    let plain = triangle("usemtl Böden", "");
    let utf16 = |text: &[u8]| -> Vec<u8> {
        let text = format!("\u{feff}{}", String::from_utf8_lossy(text));
        text.encode_utf16().flat_map(u16::to_be_bytes).collect()
    };
    let latin1: Vec<u8> = String::from_utf8_lossy(&plain)
        .chars()
        .map(|c| c as u8)
        .collect();
    let marked = [b"\xef\xbb\xbf", &plain[..]].concat();
    for (text, name) in [
        (plain.clone(), "Böden"),
        (marked, "Böden"),
        (utf16(&plain), "Böden"),
        (latin1, "B\\xf6den"),
    ] {
        let mesh = read(Path::new("nowhere/a.obj"), &text).expect("reads");
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.paints[0].name, name);
    }
    let folder = folder(&[("a.mtl", b"newmtl B\xf6den\nKd 0.25 0.5 0.75\n")]);
    let mesh = read_in(
        &folder,
        b"mtllib a.mtl\nusemtl B\xf6den\nv 0 0 0\nf 1 1 1\n",
    );
    assert_eq!(mesh.paints[0].colour, Some(Vec3::new(0.25, 0.5, 0.75)));
}

#[test]
fn libraries_are_found_in_every_form() {
    let red = Some(Vec3::new(0.8, 0.1, 0.1));
    let red_text = b"\xef\xbb\xbfnewmtl red # plaster\r\n  Kd 0.8 0.1 0.1 # diffuse\r\n";
    let folder = folder(&[
        ("a.mtl", b"newmtl other\nKd 0.2 0.2 0.2\n"),
        ("b.mtl", red_text),
        ("my lib #1.mtl", red_text),
        ("lib/b c.mtl", red_text),
    ]);
    for line in [
        "mtllib b.mtl",
        "mtllib a.mtl b.mtl",
        "mtllib a.mtl\nmtllib b.mtl",
        "mtllib \"my lib #1.mtl\" # red",
        "mtllib a.mtl my\\ lib\\ #1.mtl",
        "mtllib my lib #1.mtl",
        "mtllib lib\\b c.mtl",
        "mtllib .\\b.mtl",
        "mtllib C:\\models\\b.mtl",
        "mtllib a.mtl \\\r\n b.mtl",
    ] {
        for text in [
            triangle(&format!("{line}\nusemtl red"), ""),
            triangle("usemtl red", line),
        ] {
            let mesh = read_in(&folder, &text);
            assert_eq!(mesh.paints[0].colour, red, "{line}");
            assert_eq!(mesh.paints[0].name, "red", "{line}");
            assert!(mesh.warnings.is_empty(), "{line}: {:?}", mesh.warnings);
        }
    }
}

#[test]
fn missing_and_faulty_libraries_are_named() {
    let folder = folder(&[
        ("good.mtl", b"newmtl red\nKd 0.8 0.1 0.1\n"),
        ("bad.mtl", b"newmtl a\n\nKd x\nKd 1 2\n"),
        ("scene/empty.mtl", b""),
        ("secret.mtl", b"newmtl red\nKd 0 0 0\n"),
    ]);
    fs::create_dir(folder.path().join("folder.mtl")).expect("writable");
    let warnings = |line: &str| read_in(&folder, &triangle(line, "usemtl red")).warnings;
    for (line, parts) in [
        ("mtllib gone.mtl good.mtl", ["gone.mtl", "is not there"]),
        ("mtllib bad.mtl", ["bad.mtl, line 3", "1 more"]),
        ("mtllib folder.mtl", ["folder.mtl", "no regular file"]),
        ("mtllib scene/empty.mtl", ["empty.mtl", "no material"]),
        ("mtllib /etc/passwd", ["/etc/passwd", "outside"]),
    ] {
        let warnings = warnings(line);
        assert_eq!(warnings.len(), 1, "{line}: {warnings:?}");
        for part in parts {
            assert!(warnings[0].contains(part), "{line}: {warnings:?}");
        }
    }
    let text = triangle("mtllib ../secret.mtl", "");
    let inner = folder.path().join("scene/a.obj");
    let mesh = read(&inner, &text).expect("reads");
    assert!(mesh.warnings[0].contains("outside"), "{:?}", mesh.warnings);
    // Names are not repeated, and not without end.
    assert_eq!(warnings("mtllib gone.mtl\nmtllib gone.mtl").len(), 1);
    let many: Vec<String> = (0..1000).map(|k| format!("mtllib gone{k}.mtl")).collect();
    assert!(warnings(&many.join("\n")).len() < 30);
}

#[test]
fn too_many_libraries_are_not_opened() {
    let folder = folder(&[]);
    let mut text = Vec::new();
    for k in 0..=MAX_LIBRARIES {
        let library = format!("newmtl m{k}\nKd 0.5\n");
        fs::write(folder.path().join(format!("{k}.mtl")), library).expect("writable");
        text.extend(format!("mtllib {k}.mtl\nusemtl m{k}\nv 0 0 0\nf 1 1 1\n").into_bytes());
    }
    let mesh = read_in(&folder, &text);
    let colours = mesh.paints.iter().filter(|paint| paint.colour.is_some());
    assert_eq!(colours.count(), MAX_LIBRARIES);
    assert_eq!(mesh.warnings, ["only 256 material libraries are read"]);
}

#[cfg(unix)]
#[test]
fn pipes_are_refused_without_waiting() {
    let folder = folder(&[("a.mtl", b"newmtl red\nmap_Kd pipe\n")]);
    let made = std::process::Command::new("mkfifo")
        .arg(folder.path().join("pipe"))
        .status();
    assert!(made.expect("mkfifo starts").success());
    let mesh = read_in(&folder, &triangle("mtllib pipe a.mtl\nusemtl red", ""));
    let [library, image] = &mesh.warnings[..] else {
        panic!("{:?}", mesh.warnings);
    };
    assert_eq!(library, "material library pipe is no regular file");
    assert_eq!(image, "image pipe is no regular file");
}

#[test]
fn images_are_read_once_with_where_corners_lie_in_them() {
    let folder = folder(&[
        (
            "maps/a.mtl",
            b"newmtl red\nKd 1 1 1\nmap_Kd a.png\nnewmtl blue\nKd 0 0 0\nKe 1 2 3\n\
              map_Kd -s 2 4 -o 0.5 -clamp on C:\\work\\a.png\nnewmtl plain\nKd 0.5",
        ),
        ("maps/a.png", b"png"),
    ]);
    let faces = "usemtl blue\nf 1/1 2/2 3/9\nusemtl plain\nf 1 2 3\nusemtl red\nf 1 2 3";
    let mesh = read_in(&folder, &triangle("mtllib maps/a.mtl\nusemtl red", faces));
    assert_eq!(mesh.images.len(), 1);
    assert_eq!(
        (&mesh.images[0].name[..], &mesh.images[0].bytes[..]),
        ("a.png", &b"png"[..])
    );
    let [red, blue, plain] = &mesh.paints[..] else {
        panic!("{:?}", mesh.paints);
    };
    assert_eq!(
        (red.colour, blue.colour),
        (Some(Vec3::ONE), Some(Vec3::ONE))
    );
    assert_eq!(blue.emission, Vec3::new(1.0, 2.0, 3.0));
    let wraps = [red, blue].map(|paint| paint.image.map(|image| image.wrap));
    assert_eq!(wraps, [Some([Wrap::Repeat; 2]), Some([Wrap::Clamp; 2])]);
    assert_eq!((plain.image, plain.colour), (None, Some(Vec3::splat(0.5))));
    let uvs = |uvs: [[f32; 2]; 3]| uvs.map(Vec2::from_array);
    assert_eq!(
        mesh.corner_uvs,
        [
            uvs([[0.0, 1.0], [1.0, 0.75], [0.0, 1.0]]),
            uvs([[0.5, 1.0], [2.5, 0.0], [0.5, 1.0]]),
            [Vec2::ZERO; 3],
            [Vec2::Y; 3],
        ]
    );
    assert_eq!(mesh.triangle_materials, [0, 1, 2, 0]);
    assert!(
        mesh.warnings[0].starts_with("2 triangles"),
        "{:?}",
        mesh.warnings
    );
}

#[test]
fn a_missing_image_is_named_and_white_is_no_colour_then() {
    let folder = folder(&[(
        "a.mtl",
        b"newmtl white\nKd 1 1 1\nmap_Kd gone.png # here\nnewmtl red\nKd 1 0 0\nmap_Kd gone.png # here\n",
    )]);
    let text = triangle("mtllib a.mtl\nusemtl white", "usemtl red\nf 1 2 3");
    let mesh = read_in(&folder, &text);
    assert_eq!(mesh.warnings, ["image gone.png is not there"]);
    let colours: Vec<Option<Vec3>> = mesh.paints.iter().map(|paint| paint.colour).collect();
    assert_eq!(colours, [None, Some(Vec3::X)]);
    assert!(mesh.images.is_empty() && mesh.corner_uvs.is_empty());
}

#[test]
fn vertices_may_have_colours_or_weights() {
    let text = "v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0.5\nv 0 1 0 0.5 0.5 0.5 1\nv 0 0 1\nf 1 2 3\n";
    let mesh = read_text(text).expect("reads");
    assert_eq!(mesh.positions[2], DVec3::Y);
    let grey = mesh.colours[3].x;
    assert!((grey - 0.2140).abs() < 1e-4, "{grey}");
    assert_eq!(mesh.colours.len(), 5);
    assert_eq!([mesh.colours[0], mesh.colours[1]], [Vec3::ONE, Vec3::X]);
    assert_eq!([mesh.colours[2], mesh.colours[4]], [Vec3::ONE; 2]);
    assert_eq!(
        mesh.paints[0].colour,
        Some(Vec3::ONE),
        "the colours alone count"
    );
}

#[test]
fn what_is_no_face_is_counted() {
    let mut text = triangle(
        "",
        "f 1\nf 1 2\nl 1 2 3\np 1\ncurv 0 1 1 2\ncurv2 1 2\nsurf 0 1 0 1 1 2",
    );
    text.extend(b"cstype bspline\ng a\no b\ns 1\nvn 0 0 1\nvp 0\nl 1 2\nwhatever\n");
    let mesh = read(Path::new("nowhere/a.obj"), &text).expect("reads");
    assert_eq!(mesh.triangles.len(), 1);
    let count = |kind: &str| {
        mesh.ignored
            .iter()
            .find(|(k, _)| k.contains(kind))
            .map(|(_, &n)| n)
    };
    assert_eq!(count("one or two corners"), Some(2));
    assert_eq!(count("(l)"), Some(2));
    assert_eq!(count("(p)"), Some(1));
    assert_eq!(count("curv"), Some(2));
    assert_eq!(count("surf"), Some(1));
    assert_eq!(mesh.ignored.len(), 5);
}

#[test]
fn comments_behind_names_do_not_split_materials() {
    let text = triangle(
        "usemtl red # one",
        "usemtl red\nf 1 2 3\nusemtl red#2\nf 1 2 3\nusemtl\nf 1 2 3",
    );
    let mesh = read(Path::new("nowhere/a.obj"), &text).expect("reads");
    assert_eq!(mesh.triangle_materials, [0, 0, 1, 2]);
    let names: Vec<&str> = mesh.paints.iter().map(|paint| &paint.name[..]).collect();
    assert_eq!(names, ["red", "red#2", "unnamed"]);
}

#[test]
fn crossing_polygons_and_wrong_texture_coordinates_are_told() {
    let text = triangle(
        "",
        "v 3 1 0\nv 3 0 0\nv 0 2 0\nvt nan 0\nvt\nvt x\nf 1 4 5 6",
    );
    let mesh = read(Path::new("nowhere/a.obj"), &text).expect("reads");
    let begins = |k: usize, part: &str| mesh.warnings[k].starts_with(part);
    assert!(
        begins(0, "1 polygons cross") && begins(1, "3 texture"),
        "{:?}",
        mesh.warnings
    );
}
