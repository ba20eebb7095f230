//! Leaves out triangles by the names of their materials.

use super::config::ImportConfig;
use super::error::ImportError;
use super::raw_mesh::RawMesh;
use super::tool_materials::{fits, is_tool};
use std::collections::BTreeMap;
use std::path::Path;

/// Names that an error lists, at most.
const MOST_NAMES: usize = 12;

/// Characters of a name in an error, at most.
const MOST_CHARACTERS: usize = 80;

/// What was left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    /// Triangles by name of their material.
    pub(super) triangles: BTreeMap<String, usize>,
    /// Vertices that only these triangles use.
    pub(super) vertices: usize,
}

/// Takes out the triangles whose materials are not wanted.
///
/// # Errors
/// [`ImportError::NoSuchMaterial`] and [`ImportError::AllLeftOut`].
pub(super) fn leave_out(
    path: &Path,
    raw: &mut RawMesh,
    config: &ImportConfig,
) -> Result<LeftOut, ImportError> {
    for pattern in config.skip_materials.iter().chain(&config.only_materials) {
        if !raw.paints.iter().any(|paint| fits(pattern, &paint.name)) {
            return Err(ImportError::NoSuchMaterial {
                path: path.to_owned(),
                found: readable(pattern),
                expected: names(raw),
            });
        }
    }
    let paints = raw.paints.iter();
    let is_wanted: Vec<bool> = paints.map(|paint| is_wanted(&paint.name, config)).collect();
    let mut counts = vec![0; raw.paints.len()];
    for &material in &raw.triangle_materials {
        counts[material as usize] += usize::from(!is_wanted[material as usize]);
    }
    let mut left_out = LeftOut::default();
    for (paint, &count) in raw
        .paints
        .iter()
        .zip(&counts)
        .filter(|&(_, &count)| count > 0)
    {
        *left_out.triangles.entry(paint.name.clone()).or_default() += count;
    }
    if left_out.triangles.is_empty() {
        return Ok(left_out);
    }
    let kept: Vec<bool> = raw
        .triangle_materials
        .iter()
        .map(|&m| is_wanted[m as usize])
        .collect();
    if !kept.contains(&true) {
        return Err(ImportError::AllLeftOut {
            path: path.to_owned(),
            found: kept.len(),
            names: names(raw),
        });
    }
    let before = used_vertices(raw);
    keep(&mut raw.triangles, &kept);
    left_out.vertices = before - used_vertices(raw);
    keep(&mut raw.triangle_materials, &kept);
    keep(&mut raw.corner_uvs, &kept);
    Ok(left_out)
}

/// Number of vertices that triangles use.
fn used_vertices(raw: &RawMesh) -> usize {
    let mut is_used = vec![false; raw.positions.len()];
    for &vertex in raw.triangles.iter().flatten() {
        is_used[vertex as usize] = true;
    }
    is_used.iter().filter(|&&used| used).count()
}

fn is_wanted(name: &str, config: &ImportConfig) -> bool {
    let is_named = |patterns: &[String]| patterns.iter().any(|pattern| fits(pattern, name));
    if is_named(&config.skip_materials) {
        return false;
    }
    if config.only_materials.is_empty() {
        return config.keeps_tool_materials || !is_tool(name);
    }
    is_named(&config.only_materials)
}

/// Keeps the items that are marked, if there are as many items as marks: a list of coordinates may be empty.
fn keep<T>(items: &mut Vec<T>, marks: &[bool]) {
    if items.len() == marks.len() {
        let mut marks = marks.iter();
        items.retain(|_| marks.next() == Some(&true));
    }
}

/// A name of bounded length that tells a terminal nothing but what to show.
fn readable(name: &str) -> String {
    name.chars()
        .take(MOST_CHARACTERS)
        .flat_map(char::escape_debug)
        .collect()
}

/// The first names of materials, and how many more there are.
fn names(raw: &RawMesh) -> String {
    let quoted = raw
        .paints
        .iter()
        .map(|paint| format!("`{}`", readable(&paint.name)));
    let mut names = quoted.take(MOST_NAMES).collect::<Vec<_>>().join(", ");
    let more = raw.paints.len().saturating_sub(MOST_NAMES);
    if more > 0 {
        names += &format!(" and {more} more");
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::raw_mesh::Paint;
    use glam::DVec3;

    const BRICK: &str = "brick";

    fn raw(names: &[&str]) -> RawMesh {
        let count = names.len() as u32;
        RawMesh {
            positions: vec![DVec3::ZERO; names.len()],
            triangles: (0..count).map(|k| [k, 0, 0]).collect(),
            triangle_materials: (0..count).collect(),
            paints: names.iter().map(|name| Paint::new(name, None)).collect(),
            ..RawMesh::default()
        }
    }

    fn config(skip: &[&str], only: &[&str], keeps_tool_materials: bool) -> ImportConfig {
        let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        ImportConfig {
            skip_materials: owned(skip),
            only_materials: owned(only),
            keeps_tool_materials,
            ..ImportConfig::default()
        }
    }

    /// Names of materials that are left out, with counts.
    fn left_out(
        names: &[&str],
        config: &ImportConfig,
    ) -> Result<Vec<(String, usize)>, ImportError> {
        let mut raw = raw(names);
        let left_out = leave_out(Path::new("a.obj"), &mut raw, config)?;
        // Every triangle uses vertex 0 and one of its own.
        let with_vertex = left_out.triangles.values().sum::<usize>() - left_out.vertices;
        assert!(with_vertex <= 1);
        let left_out = left_out.triangles;
        let gone: usize = left_out.values().sum();
        assert_eq!(raw.triangles.len(), names.len() - gone);
        let kept = raw
            .triangle_materials
            .iter()
            .map(|&m| raw.paints[m as usize].name.clone());
        assert!(kept.into_iter().all(|name| !left_out.contains_key(&name)));
        Ok(left_out.into_iter().collect())
    }

    #[test]
    fn tools_are_left_out_unless_wanted() {
        let names = [BRICK, "common/caulk", "sky", "sky"];
        let count = |config| left_out(&names, &config).expect("leaves some").len();
        assert_eq!(count(config(&[], &[], false)), 2);
        assert_eq!(count(config(&[], &[], true)), 0);
        assert_eq!(count(config(&["sk*"], &[], true)), 1);
        assert_eq!(count(config(&[BRICK], &[], true)), 1);
        // What is asked for by name is read, tool or not.
        assert_eq!(count(config(&[], &["sky"], false)), 2);
        let sky = ("sky".to_owned(), 2);
        let found = left_out(&names, &config(&["sky"], &["*"], false));
        assert_eq!(found.expect("leaves some"), [sky]);
    }

    #[test]
    fn names_that_the_mesh_lacks_and_empty_rests_are_refused() {
        let refused = |config| {
            left_out(&[BRICK, "sky"], &config)
                .expect_err("refused")
                .to_string()
        };
        let error = refused(config(&["brock"], &[], false));
        assert!(
            error.contains("`brock`") && error.contains("`brick`, `sky`"),
            "{error}"
        );
        assert!(refused(config(&[], &["a*"], false)).contains("`a*`"));
        let error = refused(config(&[BRICK], &[], false));
        assert!(error.contains("all 2 triangles"), "{error}");
    }
}
