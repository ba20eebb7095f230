//! Wavefront OBJ and MTL: positions, faces and diffuse colours, nothing else.
//!
//! Our own reader because hostile files are part of the job: the common library panics on a `Kd` of
//! two numbers and drops the name of a material whose MTL is missing, which we hash into an albedo.

use super::{ImportError, Paint, RawMesh};
use glam::Vec3;
use std::collections::HashMap;
use std::path::Path;

/// Faces of more corners than this are refused: no modeller writes them.
const MAX_POLYGON_CORNERS: usize = 4096;

/// Reads an OBJ; material libraries are looked for beside it, and a missing one is no error.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<RawMesh, ImportError> {
    let text = std::str::from_utf8(bytes).map_err(|error| ImportError::Malformed {
        path: path.to_owned(),
        place: format!("byte {}", error.valid_up_to()),
        expected: "UTF-8 text",
    })?;
    let mut mesh = RawMesh::default();
    let mut colours = HashMap::new();
    let mut material_index = HashMap::new();
    let mut material = 0;
    let mut corners = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let malformed = |expected| ImportError::Malformed {
            path: path.to_owned(),
            place: format!("line {}", number + 1),
            expected,
        };
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match keyword {
            "v" => {
                let position = three_numbers(rest);
                mesh.positions
                    .push(position.ok_or_else(|| malformed("`v` and three numbers"))?);
            }
            "f" => {
                corners.clear();
                for word in rest.split_whitespace() {
                    let corner = corner_index(word, mesh.positions.len())
                        .ok_or_else(|| malformed("`f` and indices of vertices above it"))?;
                    corners.push(corner);
                }
                if !(3..=MAX_POLYGON_CORNERS).contains(&corners.len()) {
                    return Err(malformed("a face of 3 to 4096 corners"));
                }
                if mesh.paints.is_empty() {
                    mesh.paints.push(Paint::unnamed());
                }
                for pair in corners[1..].windows(2) {
                    mesh.triangles.push([corners[0], pair[0], pair[1]]);
                    mesh.triangle_materials.push(material);
                }
            }
            "usemtl" => {
                let name = rest.trim();
                material = *material_index.entry(name.to_owned()).or_insert_with(|| {
                    mesh.paints
                        .push(Paint::new(name, colours.get(name).copied()));
                    mesh.paints.len() as u32 - 1
                });
            }
            "mtllib" => {
                let folder = path.parent().unwrap_or(Path::new(""));
                if let Some(text) = super::read_beside(folder, rest.trim()) {
                    read_colours(&text, &mut colours);
                }
            }
            _ => {}
        }
    }
    Ok(mesh)
}

fn three_numbers(text: &str) -> Option<Vec3> {
    let mut numbers = text.split_whitespace().map(str::parse::<f32>);
    let mut next = || numbers.next()?.ok();
    Some(Vec3::new(next()?, next()?, next()?))
}

/// The position's index in `3`, `3/1`, `3//2`, `3/1/2` or, counted from the last vertex, `-1`.
fn corner_index(word: &str, vertex_count: usize) -> Option<u32> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let from_zero = if index < 0 {
        index.checked_add(vertex_count as i64)?
    } else {
        index - 1
    };
    let in_range = (0..vertex_count as i64).contains(&from_zero);
    in_range.then(|| u32::try_from(from_zero).ok()).flatten()
}

/// Diffuse colours by material name. Lines that make no sense are skipped: a mesh with a broken
/// material file can still be lit.
fn read_colours(text: &str, colours: &mut HashMap<String, Vec3>) {
    let mut name = String::new();
    for line in text.lines() {
        let line = line.trim();
        match line.split_once(char::is_whitespace) {
            Some(("newmtl", rest)) => name = rest.trim().to_owned(),
            Some(("Kd", rest)) => {
                if let Some(colour) = three_numbers(rest).filter(|colour| colour.is_finite()) {
                    colours.insert(name.clone(), colour);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<RawMesh, ImportError> {
        read(Path::new("test.obj"), text.as_bytes())
    }

    #[test]
    fn polygons_and_relative_indices_become_triangles() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3//7 3/1/2 -1 # quad\n";
        let mesh = read_text(text).expect("reads");
        assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn each_fault_names_its_line() {
        for text in [
            "v 0 0 0\nf 1 2 3\n",
            "v 0 0 0\nf 1 1\n",
            "v 0 0 0\nf 0 1 1\n",
            "v 0 0 0\nf 1 1 -9223372036854775808\n",
            "v 0 0 0\nv 1 2\n",
            "v 0 0 0\nv a b c\n",
        ] {
            let error = read_text(text).expect_err("refused").to_string();
            assert!(error.contains("line 2"), "{text:?}: {error}");
        }
    }

    #[test]
    fn broken_colours_are_skipped() {
        let mut colours = HashMap::new();
        read_colours(
            "Kd 1 1 1\nnewmtl a\nKd 1 0\nnewmtl b\nKd 0.1 0.2 0.3\nnewmtl c\nKd nan 0 0",
            &mut colours,
        );
        assert_eq!(colours.get("a"), None);
        assert_eq!(colours.get("b"), Some(&Vec3::new(0.1, 0.2, 0.3)));
        assert_eq!(colours.get("c"), None);
    }
}
