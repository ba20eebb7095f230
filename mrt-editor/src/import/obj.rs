//! Wavefront OBJ and MTL: positions, faces with texture coordinates, colours of vertices, and materials.
//!
//! A parser of our own, because files that people have strayed from what parsers in libraries accept: wrapped lines,
//! every encoding, NaN as C runtimes print it, several libraries whose names hold spaces.

mod lines;
mod numbers;
mod polygons;
mod faces;
mod vertex_colours;
mod image_use;
mod materials;
mod notes;
mod libraries;
mod images;

use super::error::ImportError;
use super::file::SceneFolder;
use super::limits::{MAX_LIBRARIES, MAX_OBJ_ELEMENTS, MAX_OBJ_MATERIALS};
use super::raw_mesh::{Paint, RawMesh};
use faces::{FacePlace, Faces, Fault, check_count};
use glam::{DVec3, Vec2, Vec3};
use images::Images;
use libraries::{Libraries, read_libraries};
use lines::{Line, Lines, before_comment, decode, keyword, readable};
use materials::{Material, Materials};
use numbers::numbers;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;
use vertex_colours::linear_colours;

/// Reads an OBJ. Libraries and images are looked for in its folder; a missing one is no error but a warning.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<RawMesh, ImportError> {
    let text = decode(bytes).ok_or_else(|| ImportError::Malformed {
        path: path.to_owned(),
        place: format!("byte {}", bytes.len()),
        expected: "UTF-16 text, as its first bytes say, of an even number of bytes",
    })?;
    let refuse = |(line, fault): (usize, Fault)| ImportError::Line {
        path: path.to_owned(),
        line,
        found: fault.found,
        expected: fault.expected,
    };
    let mut statements = Statements::default();
    for line in Lines::new(&text) {
        let taken = statements.take(&line);
        taken.map_err(|fault| refuse((line.number, fault)))?;
    }
    let statements = statements.finish().map_err(refuse)?;
    Ok(statements.into_mesh(&SceneFolder::of(path)))
}

/// What the lines so far have said.
#[derive(Default)]
struct Statements {
    positions: Vec<DVec3>,
    /// As in the file, NaN for vertices without; empty if no vertex has one.
    colours: Vec<Vec3>,
    textures: Vec<Vec2>,
    /// Texture coordinates that are no numbers.
    wrong_texture_count: usize,
    faces: Faces,
    /// Index of the material of the next face.
    material: Option<u32>,
    /// Materials as lines name them; an empty name for faces that have none.
    materials: Vec<Vec<u8>>,
    material_index: HashMap<Vec<u8>, u32>,
    /// Lines that name libraries, each once.
    libraries: Vec<Vec<u8>>,
    known_libraries: HashSet<Vec<u8>>,
    ignored: BTreeMap<&'static str, usize>,
}

impl Statements {
    fn take(&mut self, line: &Line) -> Result<(), Fault> {
        let (key, rest) = keyword(&line.text);
        match key {
            b"v" => self.take_vertex(rest),
            b"vt" => self.take_texture(rest),
            b"f" | b"fo" => self.take_face(line.number, rest),
            b"usemtl" => {
                self.material = Some(self.material(rest)?);
                Ok(())
            }
            b"mtllib" => {
                // One more than is read, so that the reader knows that there are more.
                if self.libraries.len() <= MAX_LIBRARIES && !self.known_libraries.contains(rest) {
                    self.known_libraries.insert(rest.to_vec());
                    self.libraries.push(rest.to_vec());
                }
                Ok(())
            }
            _ => {
                if let Some(kind) = ignored_kind(key) {
                    *self.ignored.entry(kind).or_default() += 1;
                }
                Ok(())
            }
        }
    }

    /// Three coordinates, perhaps a weight, which only curves use, or a colour.
    fn take_vertex(&mut self, rest: &[u8]) -> Result<(), Fault> {
        let mut values = [0.0; 6];
        let mut count = 0;
        for (value, number) in values.iter_mut().zip(numbers(rest)) {
            *value = number.map_err(|word| Fault::new(word, "a number after `v`"))?;
            count += 1;
        }
        if count < 3 {
            return Err(Fault::new(rest, "`v` and three numbers"));
        }
        let [x, y, z, colour @ ..] = values;
        self.positions.push(DVec3::new(x, y, z));
        if count == 6 {
            self.colours.resize(self.positions.len() - 1, Vec3::NAN);
            self.colours.push(DVec3::from_array(colour).as_vec3());
        }
        check_count(self.positions.len(), MAX_OBJ_ELEMENTS, "vertex")
    }

    /// One or two coordinates; the geometry is sound without them.
    fn take_texture(&mut self, rest: &[u8]) -> Result<(), Fault> {
        let mut coordinates = Vec2::ZERO;
        let mut numbers = numbers(rest);
        let mut next = |default| match numbers.next() {
            None => default,
            Some(number) => number.ok().filter(|x| x.is_finite()),
        };
        match (next(None), next(Some(0.0))) {
            (Some(u), Some(v)) => coordinates = Vec2::new(u as f32, v as f32),
            _ => self.wrong_texture_count += 1,
        }
        self.textures.push(coordinates);
        check_count(self.textures.len(), MAX_OBJ_ELEMENTS, "texture coordinates")
    }

    fn take_face(&mut self, line: usize, rest: &[u8]) -> Result<(), Fault> {
        let material = match self.material {
            Some(material) => material,
            None => self.material(b"")?,
        };
        self.material = Some(material);
        let place = FacePlace { line, material };
        let texture_count = self.textures.len();
        self.faces.add(place, rest, &self.positions, texture_count)
    }

    /// Index of the material that a line names.
    fn material(&mut self, name: &[u8]) -> Result<u32, Fault> {
        if let Some(&index) = self.material_index.get(name) {
            return Ok(index);
        }
        let index = self.materials.len() as u32;
        self.materials.push(name.to_vec());
        self.material_index.insert(name.to_vec(), index);
        check_count(self.materials.len(), MAX_OBJ_MATERIALS, "material")?;
        Ok(index)
    }

    fn finish(mut self) -> Result<Self, (usize, Fault)> {
        self.faces.finish(&self.positions)?;
        if !self.colours.is_empty() {
            self.colours.resize(self.positions.len(), Vec3::NAN);
        }
        Ok(self)
    }

    fn into_mesh(mut self, folder: &SceneFolder) -> RawMesh {
        let Libraries {
            materials,
            mut warnings,
            mut ignored,
        } = read_libraries(folder, &self.libraries);
        let mut images = Images::in_folder(folder);
        let (paints, transforms) = self.paint(&materials, &mut images);
        let (images, missing) = images.finish();
        warnings.extend(missing);
        let mut corner_uvs = Vec::new();
        if !images.is_empty() {
            corner_uvs = self.corner_uvs(&transforms, &mut warnings);
        }
        warnings.extend(self.faults());
        ignored.extend(self.ignored.iter().map(|(kind, &n)| (kind.to_string(), n)));
        if self.faces.short_count > 0 {
            let kind = "polygons of one or two corners".to_owned();
            ignored.insert(kind, self.faces.short_count);
        }
        RawMesh {
            positions: self.positions,
            colours: linear_colours(&self.colours),
            triangles: self.faces.triangles,
            triangle_materials: self.faces.materials,
            corner_uvs,
            paints,
            images,
            ignored,
            warnings,
            ..RawMesh::default()
        }
    }

    /// The paints, and for those that have an image how texture coordinates are to be changed. Materials that turn out to
    /// be one, because a comment follows their name, become one paint.
    fn paint(
        &mut self,
        materials: &Materials,
        images: &mut Images,
    ) -> (Vec<Paint>, Vec<Option<UvTransform>>) {
        let is_coloured = !self.colours.is_empty();
        let mut paints = Vec::new();
        let mut transforms = Vec::new();
        let mut paint_index: HashMap<&[u8], u32> = HashMap::new();
        let mut paint_of_material = Vec::with_capacity(self.materials.len());
        for line in &self.materials {
            let found = materials.find(line);
            let name = match found {
                Some((_, true)) => line,
                _ => before_comment(line),
            };
            let index = *paint_index.entry(name).or_insert_with(|| {
                let material = found.map(|(material, _)| material);
                let (paint, transform) = paint(name, material, is_coloured, images);
                paints.push(paint);
                transforms.push(transform);
                paints.len() as u32 - 1
            });
            paint_of_material.push(index);
        }
        for material in &mut self.faces.materials {
            *material = paint_of_material[*material as usize];
        }
        (paints, transforms)
    }

    /// Where the corners lie in the images of their paints.
    fn corner_uvs(
        &self,
        transforms: &[Option<UvTransform>],
        warnings: &mut Vec<String>,
    ) -> Vec<[Vec2; 3]> {
        let mut without_count = 0;
        let triangle = |(k, &material): (usize, &u32)| {
            let Some(transform) = &transforms[material as usize] else {
                return [Vec2::ZERO; 3];
            };
            let indices = self.faces.textures.get(k);
            let coordinates =
                indices.map(|uvs| uvs.map(|uv| self.textures.get(uv as usize).copied()));
            let coordinates = coordinates.unwrap_or_default();
            without_count += usize::from(coordinates.contains(&None));
            coordinates.map(|uv| transform.apply(uv.unwrap_or_default()))
        };
        let uvs = self.faces.materials.iter().enumerate().map(triangle);
        let uvs = uvs.collect();
        if without_count > 0 {
            warnings.push(format!(
                "{without_count} triangles have a material with an image and a corner without texture coordinates; \
                 (0, 0) stands for them"
            ));
        }
        uvs
    }

    /// Sentences about what is faulty and was worked around.
    fn faults(&self) -> Vec<String> {
        let faults = [
            (
                self.faces.crossing_count,
                "polygons cross themselves, so that which side is inside is a guess",
            ),
            (
                self.wrong_texture_count,
                "texture coordinates are no numbers; (0, 0) stands for them",
            ),
        ];
        let faults = faults.into_iter().filter(|&(count, _)| count > 0);
        faults
            .map(|(count, what)| format!("{count} {what}"))
            .collect()
    }
}

/// How texture coordinates of the file become those of an image, whose v runs downwards.
struct UvTransform {
    scale: Vec2,
    offset: Vec2,
}

impl UvTransform {
    fn apply(&self, uv: Vec2) -> Vec2 {
        let uv = uv * self.scale + self.offset;
        Vec2::new(uv.x, 1.0 - uv.y)
    }
}

/// The paint of a material, if there is one of that name.
fn paint(
    name: &[u8],
    material: Option<&Material>,
    is_coloured: bool,
    images: &mut Images,
) -> (Paint, Option<UvTransform>) {
    let default = Material::default();
    let material = material.unwrap_or(&default);
    let image_use = material.image.as_ref();
    let image = image_use.and_then(|image_use| images.load(image_use, &material.folder));
    // Beside an image, programs write black for a colour that they do not have, and white says nothing of an image that
    // is missing.
    let is_colour = |colour: &Vec3| match (image_use, image) {
        (None, _) => true,
        (Some(_), Some(_)) => *colour != Vec3::ZERO,
        (Some(_), None) => *colour != Vec3::ZERO && *colour != Vec3::ONE,
    };
    let has_factor = image.is_some() || is_coloured;
    let colour = material.diffuse.filter(is_colour);
    let colour = colour.or(has_factor.then_some(Vec3::ONE));
    let mut paint = match name.is_empty() {
        true => Paint {
            colour,
            ..Paint::unnamed()
        },
        false => Paint::new(&readable(name), colour),
    };
    paint.emission = material.emission;
    paint.image = image;
    let transform = image.and(image_use).map(|image_use| UvTransform {
        scale: image_use.scale,
        offset: image_use.offset,
    });
    (paint, transform)
}

/// What kind of thing a keyword begins that could be seen and is not read.
fn ignored_kind(keyword: &[u8]) -> Option<&'static str> {
    match keyword {
        b"l" => Some("line elements (l)"),
        b"p" => Some("point elements (p)"),
        b"curv" | b"curv2" => Some("free-form curves (curv, curv2)"),
        b"surf" => Some("free-form surfaces (surf)"),
        b"bzp" | b"bsp" | b"cdc" | b"cdp" | b"res" => Some("patches of the oldest OBJ files"),
        b"call" => Some("files included with call"),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
