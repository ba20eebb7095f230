//! What colour a mesh has at each point: base colours times vertex colours times images.

use super::limits::{ALBEDO_RANGE, UNSTATED_ALBEDO};
use super::raw_mesh::{Paint, PaintImage, RawImage, RawMesh, Wrap};
use super::texture::{Texture, longest_side};
use glam::{Vec2, Vec3};
use mrt_core::geometry::mesh::{Kept, TriangleMesh};
use rayon::prelude::*;

/// Images decoded at the same time, which bounds the memory that hostile ones take.
const IMAGES_AT_ONCE: usize = 4;

/// The colours of a mesh at each of its points. Made for one mesh, and of no use with another.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceColours {
    /// Factor at each vertex, linear RGB; empty if there is none.
    vertex_colours: Vec<Vec3>,
    /// Corners of each triangle in its image; empty if there are none.
    corner_uvs: Vec<[Vec2; 3]>,
    /// By material.
    paints: Vec<SurfacePaint>,
    textures: Vec<Texture>,
    /// The file of each texture, to be written again.
    files: Vec<RawImage>,
    /// For each texture, which of the scene's images it is.
    image_of_texture: Vec<usize>,
    /// Into which mean albedos of walls are moved.
    albedo_range: [f32; 2],
}

/// What covers a material's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SurfacePaint {
    pub(crate) colour: Vec3,
    /// Index into the textures, and what stands beyond its edges.
    pub(crate) texture: Option<(usize, [Wrap; 2])>,
    /// Radiance, linear RGB, W/(m² sr).
    pub(crate) emission: Vec3,
}

/// A point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Which triangle.
    pub triangle: usize,
    /// Weights of its second and third corner.
    pub barycentric: Vec2,
    /// The area around it over which colours are averaged, square metres.
    pub area: f32,
}

/// What was made up because the file does not state it, or cannot be read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MadeUp {
    /// Materials without a colour.
    pub(super) colours: usize,
    /// Images that were read.
    pub(super) images: usize,
    /// A sentence for each image that cannot be read.
    pub(super) warnings: Vec<String>,
}

impl SurfaceColours {
    fn colourless() -> Self {
        Self {
            vertex_colours: Vec::new(),
            corner_uvs: Vec::new(),
            paints: Vec::new(),
            textures: Vec::new(),
            files: Vec::new(),
            image_of_texture: Vec::new(),
            albedo_range: ALBEDO_RANGE,
        }
    }

    /// One albedo for everything, which the user set, and the file's emission.
    pub(super) fn uniform(albedo: f32, paints: &[Paint]) -> Self {
        let paint = |paint: &Paint| SurfacePaint {
            colour: Vec3::splat(albedo),
            texture: None,
            emission: finite_emission(paint),
        };
        Self {
            paints: paints.iter().map(paint).collect(),
            albedo_range: [0.0, 1.0],
            ..Self::colourless()
        }
    }

    /// The albedos of a mesh's materials, without emission.
    pub fn of_materials(mesh: &TriangleMesh) -> Self {
        let paint = |albedo| SurfacePaint {
            colour: albedo,
            ..SurfacePaint::default()
        };
        let albedos = mesh.materials.iter().map(|material| material.albedo);
        Self {
            paints: albedos.map(paint).collect(),
            ..Self::colourless()
        }
    }

    /// The colours of what was `kept` of a file's mesh. Reads the images that it uses.
    pub(super) fn new(raw: &RawMesh, mesh: &TriangleMesh, kept: &Kept) -> (Self, MadeUp) {
        let mut made_up = MadeUp::default();
        let mut colours = Self::colourless();
        if !raw.colours.is_empty() {
            let colour = |&v: &u32| raw.colours[v as usize];
            colours.vertex_colours = kept.vertices.iter().map(colour).collect();
        }
        let is_used = used(mesh, raw.paints.len());
        let texture_of_image = colours.read_images(raw, &is_used, &mut made_up);
        if !colours.textures.is_empty() {
            let uvs = |&t: &u32| raw.corner_uvs.get(t as usize).copied();
            let uvs = kept.triangles.iter().map(|t| uvs(t).unwrap_or_default());
            colours.corner_uvs = uvs.collect();
        }
        let is_coloured = colours.materials_with_vertex_colours(mesh, raw.paints.len());
        for (k, paint) in raw.paints.iter().enumerate() {
            let texture = paint.image.and_then(|PaintImage { image, wrap }| {
                texture_of_image
                    .get(image)
                    .copied()
                    .flatten()
                    .map(|texture| (texture, wrap))
            });
            let is_image_missing = paint.image.is_some() && texture.is_none();
            let is_stated = paint.colour.is_some() || texture.is_some() || is_coloured[k];
            if is_used[k] && !is_stated {
                made_up.colours += 1;
            }
            let unread = if is_stated && !is_image_missing {
                1.0
            } else {
                UNSTATED_ALBEDO
            };
            colours.paints.push(SurfacePaint {
                colour: paint.colour.unwrap_or(Vec3::ONE) * unread,
                texture,
                emission: if is_used[k] {
                    finite_emission(paint)
                } else {
                    Vec3::ZERO
                },
            });
        }
        (colours, made_up)
    }

    /// Reads the images of used paints; gives the index of the texture of each image that could be read.
    fn read_images(
        &mut self,
        raw: &RawMesh,
        is_used: &[bool],
        made_up: &mut MadeUp,
    ) -> Vec<Option<usize>> {
        let users = first_users(raw, is_used);
        let wanted: Vec<(usize, &Paint)> = (0..users.len())
            .filter_map(|k| Some((k, users[k]?)))
            // Its reader has said already that it is missing.
            .filter(|&(k, _)| !raw.images[k].bytes.is_empty())
            .collect();
        let longest = longest_side(wanted.len());
        let mut texture_of_image = vec![None; users.len()];
        for batch in wanted.chunks(IMAGES_AT_ONCE) {
            let decode = |&(k, _): &(usize, &Paint)| Texture::decode(&raw.images[k].bytes, longest);
            let decoded: Vec<_> = batch.par_iter().map(decode).collect();
            for (&(k, user), decoded) in batch.iter().zip(decoded) {
                match decoded {
                    Ok(texture) => {
                        texture_of_image[k] = Some(self.textures.len());
                        self.textures.push(texture);
                        self.image_of_texture.push(k);
                    }
                    Err(reason) => made_up.warnings.push(format!(
                        "material `{}`: image `{}` cannot be read ({reason}); expected a sound PNG, JPEG or WebP. It \
                         counts as grey",
                        user.name, raw.images[k].name
                    )),
                }
            }
        }
        made_up.images = self.textures.len();
        texture_of_image
    }

    /// Keeps the files of the textures, out of all images of the scene.
    pub(super) fn keep_files(&mut self, mut images: Vec<RawImage>) {
        let files = self.image_of_texture.iter();
        self.files = files.map(|&k| std::mem::take(&mut images[k])).collect();
    }

    /// What covers a material's triangles.
    pub(crate) fn paint(&self, material: usize) -> SurfacePaint {
        self.paints[material]
    }

    /// The file of a texture, as the scene has it; `None` if it was not kept.
    pub(crate) fn file(&self, texture: usize) -> Option<&[u8]> {
        self.files.get(texture).map(|file| file.bytes.as_slice())
    }

    /// A triangle's corners in its image.
    pub(crate) fn corner_uvs(&self, triangle: usize) -> Option<[Vec2; 3]> {
        self.corner_uvs.get(triangle).copied()
    }

    /// The factors at a triangle's corners.
    pub(crate) fn corner_colours(&self, mesh: &TriangleMesh, triangle: usize) -> Option<[Vec3; 3]> {
        let colour = |v: u32| self.vertex_colours[v as usize];
        (!self.vertex_colours.is_empty()).then(|| mesh.triangles[triangle].map(colour))
    }

    /// Materials of which a vertex has another colour than white, which readers give to vertices without one.
    fn materials_with_vertex_colours(&self, mesh: &TriangleMesh, count: usize) -> Vec<bool> {
        let mut found = vec![false; count];
        if self.vertex_colours.is_empty() {
            return found;
        }
        for (vertices, &material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
            let is_white = |&v: &u32| self.vertex_colours[v as usize] == Vec3::ONE;
            found[material as usize] |= !vertices.iter().all(is_white);
        }
        found
    }

    /// All materials shine with one radiance.
    #[cfg(test)]
    pub(crate) fn with_emission(mut self, radiance: Vec3) -> Self {
        for paint in &mut self.paints {
            paint.emission = radiance;
        }
        self
    }

    /// The range into which mean albedos of walls are moved: [`ALBEDO_RANGE`], or everything from 0 to 1 where the user set
    /// the albedo.
    pub fn albedo_range(&self) -> [f32; 2] {
        self.albedo_range
    }

    /// Gives a mesh's materials their base colours.
    pub(super) fn paint_materials(&self, mesh: &mut TriangleMesh) {
        for (material, paint) in mesh.materials.iter_mut().zip(&self.paints) {
            material.albedo = limited(paint.colour);
        }
    }

    /// Diffuse reflectance around a point, linear RGB, each in [0, 1].
    ///
    /// # Panics
    /// If the triangle does not exist, or the mesh is another than that of the colours.
    pub fn albedo(&self, mesh: &TriangleMesh, at: &SurfacePoint) -> Vec3 {
        let paint = self.paints[mesh.triangle_materials[at.triangle] as usize];
        let mut colour = paint.colour;
        if !self.vertex_colours.is_empty() {
            let corners = mesh.triangles[at.triangle].map(|v| self.vertex_colours[v as usize]);
            colour *= interpolated(corners, at.barycentric);
        }
        if let Some((texture, wrap)) = paint.texture {
            let uvs = self.corner_uvs[at.triangle];
            let [a, b, c] = mesh.corners(at.triangle);
            let area = (b - a).cross(c - a).length();
            let uv_area = (uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0]).abs();
            let [p, q, r] = uvs;
            let place = p + (q - p) * at.barycentric.x + (r - p) * at.barycentric.y;
            colour *= self.textures[texture].sample(place, wrap, at.area * uv_area / area);
        }
        limited(colour)
    }

    /// Radiance that a triangle sends out to all sides of its front, linear RGB, W/(m² sr).
    ///
    /// # Panics
    /// As [`SurfaceColours::albedo`].
    pub fn emission(&self, mesh: &TriangleMesh, triangle: usize) -> Vec3 {
        self.paints[mesh.triangle_materials[triangle] as usize].emission
    }
}

/// The first used paint of each image.
fn first_users<'a>(raw: &'a RawMesh, is_used: &[bool]) -> Vec<Option<&'a Paint>> {
    let mut users = vec![None; raw.images.len()];
    for (paint, _) in raw.paints.iter().zip(is_used).filter(|&(_, &used)| used) {
        if let Some(user) = paint.image.and_then(|used| users.get_mut(used.image)) {
            user.get_or_insert(paint);
        }
    }
    users
}

/// Which materials triangles use.
pub(super) fn used(mesh: &TriangleMesh, count: usize) -> Vec<bool> {
    let mut is_used = vec![false; count];
    for &material in &mesh.triangle_materials {
        is_used[material as usize] = true;
    }
    is_used
}

/// An albedo that conserves energy, and grey for one that is no number.
fn limited(colour: Vec3) -> Vec3 {
    if colour.is_finite() {
        colour.clamp(Vec3::ZERO, Vec3::ONE)
    } else {
        Vec3::splat(UNSTATED_ALBEDO)
    }
}

fn finite_emission(paint: &Paint) -> Vec3 {
    if paint.emission.is_finite() {
        paint.emission.max(Vec3::ZERO)
    } else {
        Vec3::ZERO
    }
}

fn interpolated([a, b, c]: [Vec3; 3], at: Vec2) -> Vec3 {
    a + (b - a) * at.x + (c - a) * at.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::raw_mesh::RawImage;
    use glam::DVec3;
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};
    use mrt_core::geometry::mesh::clean_and_trace;

    /// White on the left, black on the right.
    fn image(name: &str) -> RawImage {
        let row = [[255; 3], [255; 3], [0; 3], [0; 3]].concat();
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes)
            .write_image(&row.repeat(4), 4, 4, ExtendedColorType::Rgb8)
            .expect("encodes");
        RawImage {
            name: name.to_owned(),
            bytes,
        }
    }

    /// A triangle without area and one of 2 m², both of the first of `paints`.
    fn raw(paints: Vec<Paint>) -> RawMesh {
        let uvs = [Vec2::ZERO, 0.4 * Vec2::X, 0.4 * Vec2::Y];
        RawMesh {
            positions: [[9.0, 9.0], [0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]
                .map(|[x, y]| DVec3::new(x, y, 0.0))
                .to_vec(),
            triangles: vec![[0, 0, 1], [1, 2, 3]],
            triangle_materials: vec![0, 0],
            corner_uvs: vec![[Vec2::ONE; 3], uvs],
            paints,
            images: vec![image("a.png")],
            ..RawMesh::default()
        }
    }

    fn paint(colour: Option<Vec3>, image: Option<usize>) -> Paint {
        let wrap = [Wrap::Repeat; 2];
        Paint {
            image: image.map(|image| PaintImage { image, wrap }),
            ..Paint::new("wall", colour)
        }
    }

    /// The albedo in the middle of the triangle that is left, averaged over `area`.
    fn albedo(raw: &RawMesh, area: f32) -> (Vec3, MadeUp) {
        let untidy = TriangleMesh {
            triangle_materials: raw.triangle_materials.clone(),
            ..TriangleMesh::from_triangles(
                raw.positions.iter().map(|p| p.as_vec3()).collect(),
                raw.triangles.clone(),
            )
        };
        let (mesh, _, kept) = clean_and_trace(&untidy).expect("indices in range");
        assert_eq!(
            (&kept.triangles[..], &kept.vertices[..]),
            (&[1][..], &[1, 2, 3][..])
        );
        let (colours, made_up) = SurfaceColours::new(raw, &mesh, &kept);
        let at = SurfacePoint {
            triangle: 0,
            barycentric: Vec2::splat(1.0 / 3.0),
            area,
        };
        (colours.albedo(&mesh, &at), made_up)
    }

    #[test]
    fn colour_vertices_and_image_are_factors() {
        let colour = Vec3::new(0.5, 0.4, 0.2);
        let mut mesh = raw(vec![paint(Some(colour), Some(0))]);
        mesh.colours = vec![Vec3::ZERO, Vec3::ONE, Vec3::ONE, Vec3::splat(0.1)];
        // The triangle uses white texels only, though half of the image is black.
        let (found, made_up) = albedo(&mesh, 0.1);
        assert!((found - colour * 0.7).abs().max_element() < 1e-4, "{found}");
        assert_eq!((made_up.colours, made_up.images), (0, 1));
        // Over all of the image, half is black.
        let (found, _) = albedo(&mesh, 1e6);
        assert!(
            (found - colour * 0.35).abs().max_element() < 1e-4,
            "{found}"
        );
    }

    #[test]
    fn what_states_no_colour_is_grey_and_counted() {
        let (found, made_up) = albedo(&raw(vec![paint(None, None)]), 0.0);
        assert_eq!((found, made_up.colours), (Vec3::splat(UNSTATED_ALBEDO), 1));
        assert_eq!(made_up.images, 0);
        // An image or vertex colours alone are a colour.
        let (found, made_up) = albedo(&raw(vec![paint(None, Some(0))]), 0.0);
        assert_eq!((found, made_up.colours), (Vec3::ONE, 0));
        let mut mesh = raw(vec![paint(None, None)]);
        mesh.colours = vec![Vec3::splat(0.25); 4];
        assert_eq!(albedo(&mesh, 0.0).0, Vec3::splat(0.25));
        // White is what readers give to vertices without a colour.
        mesh.colours = vec![Vec3::ONE; 4];
        assert_eq!(albedo(&mesh, 0.0).0, Vec3::splat(UNSTATED_ALBEDO));
    }

    #[test]
    fn an_image_that_cannot_be_read_is_grey_and_named_once() {
        let mut mesh = raw(vec![paint(Some(Vec3::ONE), Some(0)), paint(None, Some(0))]);
        mesh.images[0].bytes.truncate(40);
        let (found, made_up) = albedo(&mesh, 0.0);
        assert_eq!(found, Vec3::splat(UNSTATED_ALBEDO));
        let [warning] = &made_up.warnings[..] else {
            panic!("expected one warning, found {:?}", made_up.warnings);
        };
        assert!(
            warning.contains("`wall`") && warning.contains("`a.png`"),
            "{warning}"
        );
        // Of an image without bytes, its reader has told.
        mesh.images[0].bytes.clear();
        let (found, made_up) = albedo(&mesh, 0.0);
        assert_eq!(found, Vec3::splat(UNSTATED_ALBEDO));
        assert!(made_up.warnings.is_empty());
        // A paint may name an image that is not there.
        let (found, _) = albedo(&raw(vec![paint(Some(Vec3::ONE), Some(7))]), 0.0);
        assert_eq!(found, Vec3::splat(UNSTATED_ALBEDO));
    }
}
