//! Materials of MTL files.
//!
//! Colours are taken as linear; the format does not say, and programs that know the difference write them so.

use super::image_use::{ImageUse, image_use};
use super::lines::{Lines, before_comment, keyword};
use super::numbers::numbers;
use glam::Vec3;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// A material as its library has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Material {
    /// Linear RGB.
    pub(super) diffuse: Option<Vec3>,
    /// Radiance, linear RGB.
    pub(super) emission: Vec3,
    /// The image that multiplies the colour.
    pub(super) image: Option<ImageUse>,
    /// Where its library lies, relative to the scene.
    pub(super) folder: PathBuf,
}

/// The materials of all libraries; the first of a name counts.
///
/// A `#` after white space may begin a comment or be part of a name (`Material #25`), so a name is looked for with and
/// without what follows it.
#[derive(Debug, Default)]
pub(super) struct Materials {
    materials: Vec<Material>,
    by_whole_line: HashMap<Vec<u8>, usize>,
    by_name: HashMap<Vec<u8>, usize>,
}

/// What a library has besides sound materials.
#[derive(Debug, Default, PartialEq)]
pub(super) struct LibraryReport {
    pub(super) material_count: usize,
    /// Lines of colours that are none; they are left out, because a mesh with a broken library can still be lit.
    pub(super) faulty_lines: Vec<usize>,
    /// What is not used, by kind.
    pub(super) ignored: BTreeMap<String, usize>,
}

impl Materials {
    /// The material that a line names, and whether the whole line is its name.
    pub(super) fn find(&self, line: &[u8]) -> Option<(&Material, bool)> {
        let name = before_comment(line);
        let whole = self.by_whole_line.get(line);
        let part = || self.by_whole_line.get(name).or(self.by_name.get(name));
        let index = whole.or_else(part)?;
        Some((&self.materials[*index], whole.is_some()))
    }

    /// Adds the materials of a library, which lies in `folder`, relative to the scene.
    pub(super) fn add_library(&mut self, text: &[u8], folder: &Path) -> LibraryReport {
        let mut report = LibraryReport::default();
        let mut current = None;
        for line in Lines::new(text) {
            let (key, rest) = keyword(&line.text);
            if key.eq_ignore_ascii_case(b"newmtl") {
                current = self.add(rest, folder);
                report.material_count += usize::from(!rest.is_empty());
            } else if let Some(index) = current {
                let material: &mut Material = &mut self.materials[index];
                if material.read(key, rest, &mut report.ignored).is_none() {
                    report.faulty_lines.push(line.number);
                }
            }
        }
        report
    }

    fn add(&mut self, line: &[u8], folder: &Path) -> Option<usize> {
        let name = before_comment(line);
        if name.is_empty() {
            return None;
        }
        let index = self.materials.len();
        self.materials.push(Material {
            folder: folder.to_owned(),
            ..Material::default()
        });
        self.by_whole_line.entry(line.to_vec()).or_insert(index);
        self.by_name.entry(name.to_vec()).or_insert(index);
        Some(index)
    }
}

impl Material {
    /// Takes a line of the material; `None` if it should be a colour and is none.
    fn read(
        &mut self,
        key: &[u8],
        rest: &[u8],
        ignored: &mut BTreeMap<String, usize>,
    ) -> Option<()> {
        let is = |name: &str| key.eq_ignore_ascii_case(name.as_bytes());
        if is("Kd") {
            self.diffuse = Some(colour(rest)?);
        } else if is("Ke") {
            self.emission = colour(rest)?;
        } else if is("map_Kd") {
            self.image = image_use(rest, ignored);
        } else if is("map_Ke") {
            *ignored
                .entry("images of emission (map_Ke)".to_owned())
                .or_default() += 1;
        }
        Some(())
    }
}

/// One number for all channels, or three; not negative.
fn colour(line: &[u8]) -> Option<Vec3> {
    let numbers: Vec<f64> = numbers(line).collect::<Result<_, _>>().ok()?;
    let colour = match numbers[..] {
        [grey] => Vec3::splat(grey as f32),
        [r, g, b, ..] => Vec3::new(r as f32, g as f32, b as f32),
        _ => return None,
    };
    (colour.is_finite() && colour.min_element() >= 0.0).then_some(colour)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> (Materials, LibraryReport) {
        let mut materials = Materials::default();
        let report = materials.add_library(text, Path::new(""));
        (materials, report)
    }

    fn diffuse(materials: &Materials, name: &[u8]) -> Option<Vec3> {
        materials
            .find(name)
            .and_then(|(material, _)| material.diffuse)
    }

    #[test]
    fn broken_colours_are_left_out_and_counted() {
        let (materials, report) = read(
            b"Kd 1 1 1\nnewmtl a\nKd 1 0\nnewmtl b\nKd 0.1 0.2 \\\n0.3 # red\nKe 2\nnewmtl c\n\
              Kd nan 0 0\nKd -1 0 0\n\nnewmtl\nKd 0 0 0\n  newmtl  d\n\tkd .5\nmap_Ke a.png\nKd spectral a.rfl",
        );
        assert_eq!(diffuse(&materials, b"a"), None);
        assert_eq!(diffuse(&materials, b"b"), Some(Vec3::new(0.1, 0.2, 0.3)));
        assert_eq!(
            materials.find(b"b").map(|(b, _)| b.emission),
            Some(Vec3::splat(2.0))
        );
        assert_eq!(diffuse(&materials, b"c"), None);
        assert_eq!(diffuse(&materials, b"d"), Some(Vec3::splat(0.5)));
        assert_eq!(report.faulty_lines, [3, 9, 10, 17]);
        assert_eq!(report.material_count, 4);
        assert_eq!(report.ignored.values().sum::<usize>(), 1);
    }

    #[test]
    fn names_match_with_and_without_comments_and_byte_by_byte() {
        let (materials, _) = read(
            b"newmtl red # plaster\nKd 1\nnewmtl Material #1\nKd 0.1\nnewmtl Material #2\nKd 0.2\n\
              newmtl B\xf6den\nKd 0.3\nnewmtl a b\nKd 0.4\nnewmtl a b\nKd 0.5\n",
        );
        let is = |name: &[u8], grey: f32| diffuse(&materials, name) == Some(Vec3::splat(grey));
        assert!(is(b"red", 1.0) && is(b"red # other", 1.0));
        assert!(is(b"Material #1", 0.1) && is(b"Material #2", 0.2));
        assert!(is(b"B\xf6den", 0.3) && !is(b"B\xf7den", 0.3));
        assert!(is(b"a b", 0.4));
        assert_eq!(materials.find(b"gone"), None);
    }
}
