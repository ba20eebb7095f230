//! Wavefront OBJ and MTL, through tobj: positions, faces and diffuse colours, nothing else.
//!
//! tobj gets the lines that matter one by one. So its errors, which name no place, get the number of the line that it had
//! read. It sees no texture coordinates and normals, over whose absence it can panic, and no materials of faces: it drops
//! their names when the library is missing, and colours are made up from those names.

use super::error::ImportError;
use super::file::read_library;
use super::raw_mesh::{Paint, RawMesh};
use glam::Vec3;
use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::Path;
use tobj::{LoadError, LoadOptions};

/// Faces of more corners than this are refused: no modeller writes them.
const MAX_POLYGON_CORNERS: usize = 4096;

/// Reads an OBJ; material libraries are looked for beside it, and a missing one is no error.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<RawMesh, ImportError> {
    let text = std::str::from_utf8(bytes).map_err(|error| ImportError::Malformed {
        path: path.to_owned(),
        place: format!("byte {}", error.valid_up_to()),
        expected: "UTF-8 text",
    })?;
    let mut lines = ObjLines::new(path, text);
    let options = LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    let loaded = tobj::load_obj_buf(
        &mut BufReader::with_capacity(1, &mut lines),
        &options,
        |_| Ok((Vec::new(), HashMap::new())),
    );
    let malformed = |expected| ImportError::Malformed {
        path: path.to_owned(),
        place: format!("line {}", lines.number),
        expected,
    };
    if lines.has_bad_face {
        return Err(malformed("a face of 3 to 4096 corners"));
    }
    let (models, _) = loaded.map_err(|error| match error {
        LoadError::PositionParseError | LoadError::ColorParseError => {
            malformed("`v` and three numbers")
        }
        LoadError::FaceVertexOutOfBounds => ImportError::Malformed {
            path: path.to_owned(),
            place: "a face".to_owned(),
            expected: "indices of vertices that are in the file",
        },
        _ => malformed("`v` with three numbers or `f` with indices of vertices above it"),
    })?;
    let mut mesh = RawMesh {
        paints: std::mem::take(&mut lines.paints),
        triangle_materials: std::mem::take(&mut lines.triangle_materials),
        ..RawMesh::default()
    };
    for model in models {
        let first = mesh.positions.len() as u32;
        let positions = model.mesh.positions.as_chunks::<3>().0;
        mesh.positions
            .extend(positions.iter().map(|&p| Vec3::from_array(p).as_dvec3()));
        let triangles = model.mesh.indices.as_chunks::<3>().0;
        mesh.triangles
            .extend(triangles.iter().map(|t| t.map(|k| first + k)));
    }
    mesh.unused_vertices = lines.vertex_count.saturating_sub(mesh.positions.len());
    Ok(mesh)
}

/// The lines of an OBJ as tobj should see them, handed out one at a time.
struct ObjLines<'a> {
    path: &'a Path,
    lines: std::str::Lines<'a>,
    /// Bytes of the current line that tobj has not read yet, last first.
    pending: Vec<u8>,
    /// Number of the line handed out last, from 1.
    number: usize,
    vertex_count: usize,
    has_bad_face: bool,
    material: u32,
    material_index: HashMap<&'a str, u32>,
    colours: HashMap<String, Vec3>,
    paints: Vec<Paint>,
    /// For each triangle that tobj makes of the faces.
    triangle_materials: Vec<u32>,
}

impl<'a> ObjLines<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        Self {
            path,
            lines: text.lines(),
            pending: Vec::new(),
            number: 0,
            vertex_count: 0,
            has_bad_face: false,
            material: 0,
            material_index: HashMap::new(),
            colours: HashMap::new(),
            paints: Vec::new(),
            triangle_materials: Vec::new(),
        }
    }

    /// What tobj should read instead of a line.
    fn translate(&mut self, line: &'a str) -> String {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let mut words = rest.split_whitespace();
        match keyword {
            "v" => {
                self.vertex_count += 1;
                let numbers: Vec<&str> = words.by_ref().take(3).collect();
                format!("v {}", numbers.join(" "))
            }
            "f" => {
                let corners: Vec<&str> = words
                    .map(|corner| corner.split('/').next().unwrap_or_default())
                    .collect();
                if !(3..=MAX_POLYGON_CORNERS).contains(&corners.len()) {
                    self.has_bad_face = true;
                    return String::new();
                }
                if self.paints.is_empty() {
                    self.paints.push(Paint::unnamed());
                }
                let triangles = corners.len() - 2;
                self.triangle_materials
                    .extend(std::iter::repeat_n(self.material, triangles));
                format!("f {}", corners.join(" "))
            }
            "usemtl" => {
                let name = rest.trim();
                let colour = self.colours.get(name).copied();
                self.material = *self.material_index.entry(name).or_insert_with(|| {
                    self.paints.push(Paint::new(name, colour));
                    self.paints.len() as u32 - 1
                });
                String::new()
            }
            "mtllib" => {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                if let Some(text) = read_library(folder, rest.trim()) {
                    self.colours.extend(read_colours(&text));
                }
                String::new()
            }
            _ => String::new(),
        }
    }
}

impl Read for ObjLines<'_> {
    /// One byte a call, so that the reader above never holds a line that tobj has not asked for.
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.pending.is_empty() && !self.has_bad_face {
            let Some(line) = self.lines.next() else {
                return Ok(0);
            };
            self.number += 1;
            let mut translated = self.translate(line);
            translated.push('\n');
            self.pending = translated.into_bytes();
            self.pending.reverse();
        }
        match (self.pending.pop(), buffer.first_mut()) {
            (Some(byte), Some(slot)) => {
                *slot = byte;
                Ok(1)
            }
            _ => Ok(0),
        }
    }
}

/// Diffuse colours by material name. Lines that make no sense are skipped: a mesh with a broken
/// material file can still be lit.
fn read_colours(text: &str) -> HashMap<String, Vec3> {
    let is_sound = |line: &&str| match line.split_once(char::is_whitespace) {
        Some(("newmtl", name)) => !name.trim().is_empty(),
        Some(("Kd", rest)) => {
            let numbers: Vec<Option<f32>> =
                rest.split_whitespace().map(|w| w.parse().ok()).collect();
            // tobj panics on fewer than three.
            numbers.len() >= 3 && numbers.iter().all(|x| x.is_some_and(f32::is_finite))
        }
        _ => false,
    };
    let lines: Vec<&str> = text.lines().map(str::trim).filter(is_sound).collect();
    let Ok((materials, _)) = tobj::load_mtl_buf(&mut lines.join("\n").as_bytes()) else {
        return HashMap::new();
    };
    materials
        .into_iter()
        .filter_map(|material| Some((material.name, Vec3::from_array(material.diffuse?))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<RawMesh, ImportError> {
        read(Path::new("test.obj"), text.as_bytes())
    }

    #[test]
    fn polygons_and_relative_indices_become_triangles() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\n\
                    usemtl a b\nf -5 -4//7 3/1/2 -2 # quad\nusemtl c\nf 1 2 3\n";
        let mesh = read_text(text).expect("reads");
        assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        assert_eq!(mesh.triangle_materials, vec![0, 0, 1]);
        assert_eq!(mesh.paints[0].name, "a b");
        assert_eq!(mesh.unused_vertices, 1);
    }

    #[test]
    fn each_fault_is_refused_with_its_place() {
        for text in [
            "v 0 0 0\nf 1 1\n",
            "v 0 0 0\nf x 1 1\n",
            "v 0 0 0\nv 1 2\n",
            "v 0 0 0\nv a b c\n",
        ] {
            let error = read_text(text).expect_err("refused").to_string();
            assert!(error.contains("line 2"), "{text:?}: {error}");
        }
        for text in [
            "v 0 0 0\nf 1 2 3\n",
            "v 0 0 0\nf 0 1 1\n",
            "v 0 0 0\nf 1 1 -9223372036854775808\n",
        ] {
            let error = read_text(text).expect_err("refused").to_string();
            assert!(
                error.contains("face") || error.contains("line 2"),
                "{error}"
            );
        }
    }

    #[test]
    fn broken_colours_are_skipped() {
        let colours = read_colours(
            "Kd 1 1 1\nnewmtl a\nKd 1 0\nnewmtl b\nKd 0.1 0.2 0.3\nnewmtl c\nKd nan 0 0",
        );
        assert_eq!(colours.get("a"), None);
        assert_eq!(colours.get("b"), Some(&Vec3::new(0.1, 0.2, 0.3)));
        assert_eq!(colours.get("c"), None);
    }
}
