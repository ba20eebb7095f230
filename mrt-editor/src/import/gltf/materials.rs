//! Base colours, their images and emission.

use super::buffers::Buffers;
use super::document::{Document, Material, TextureInfo};
use super::images::Images;
use crate::import::limits::MAX_NAME_CHARACTERS;
use crate::import::raw_mesh::{Paint, PaintImage, RawMesh, Wrap};
use glam::{Affine2, Vec2, Vec3};

/// Where a material's image lies on a mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImageCoordinates {
    /// The set of texture coordinates.
    pub(super) set: usize,
    pub(super) image_from_set: Affine2,
}

/// Adds the paints of all materials and one more for triangles without, and the images of the used ones; returns where
/// the images lie, for each paint.
pub(super) fn read(
    buffers: &mut Buffers<'_>,
    is_used: &[bool],
    mesh: &mut RawMesh,
) -> Vec<Option<ImageCoordinates>> {
    let document = buffers.document;
    let mut images = Images::default();
    let mut coordinates = Vec::new();
    for (index, material) in document.materials.iter().enumerate() {
        let mut paint = read_paint(material);
        let mut of_image = None;
        if is_used[index] {
            count_unused(material, mesh);
            if let Some(texture) =
                base_texture(material).filter(|_| stated_mean(material).is_none())
            {
                paint.image = images
                    .add(buffers, texture, &paint.name, &mut mesh.images)
                    .map(|image| PaintImage {
                        image,
                        wrap: wrap(document, texture),
                    });
                of_image = paint.image.map(|_| image_coordinates(texture));
            }
        }
        mesh.paints.push(paint);
        coordinates.push(of_image);
    }
    mesh.paints.push(Paint::unnamed());
    coordinates.push(None);
    mesh.warnings.extend(images.into_warnings());
    coordinates
}

fn read_paint(material: &Material) -> Paint {
    let name = material.name.as_deref().unwrap_or("unnamed");
    let name: String = name.chars().take(MAX_NAME_CHARACTERS).collect();
    let colour = stated_mean(material).unwrap_or_else(|| base_factor(material));
    let strength = material.extensions.emissive_strength.as_ref();
    let strength = strength.and_then(|s| s.emissive_strength).unwrap_or(1.0);
    let emission = material.emissive_factor.map(|e| (e * strength) as f32);
    let emission = Vec3::from_array(emission).max(Vec3::ZERO);
    let mut paint = Paint::new(&name, Some(colour));
    // Most images of emission are black but for a few lamps, so that the factor alone would light far too much.
    if emission.is_finite() && material.emissive_texture.is_none() {
        paint.emission = emission;
    }
    paint
}

fn base_factor(material: &Material) -> Vec3 {
    let factor = match &material.extensions.specular_glossiness {
        Some(pbr) => pbr.diffuse_factor,
        None => material.pbr_metallic_roughness.base_color_factor,
    };
    let [r, g, b, _] = factor.unwrap_or([1.0; 4]).map(|c| c as f32);
    Vec3::new(r, g, b)
}

fn base_texture(material: &Material) -> Option<&TextureInfo> {
    match &material.extensions.specular_glossiness {
        Some(pbr) => pbr.diffuse_texture.as_ref(),
        None => material.pbr_metallic_roughness.base_color_texture.as_ref(),
    }
}

/// `extras.meanBaseColorLinear`: the mean of factor times image, as some tools state it.
fn stated_mean(material: &Material) -> Option<Vec3> {
    let extras = material.extras.as_ref()?;
    let extras: serde_json::Value = serde_json::from_str(extras.get()).ok()?;
    let mean = extras.get("meanBaseColorLinear")?.as_array()?;
    let channel = |k: usize| mean.get(k)?.as_f64().map(|x| x as f32);
    Some(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
}

fn count_unused(material: &Material, mesh: &mut RawMesh) {
    let extensions = &material.extensions;
    let is_transparent = extensions.transmission.is_some()
        || matches!(material.alpha_mode.as_deref(), Some("MASK" | "BLEND"));
    let has_emissive_image =
        material.emissive_texture.is_some() && material.emissive_factor.iter().any(|&e| e > 0.0);
    for (kind, is_there) in [
        ("emissive textures", has_emissive_image),
        ("transparent materials", is_transparent),
        ("unlit materials", extensions.unlit.is_some()),
    ] {
        if is_there {
            *mesh.ignored.entry(kind.to_owned()).or_default() += 1;
        }
    }
}

fn image_coordinates(texture: &TextureInfo) -> ImageCoordinates {
    let Some(transform) = &texture.extensions.transform else {
        return ImageCoordinates {
            set: texture.tex_coord,
            image_from_set: Affine2::IDENTITY,
        };
    };
    let vector = |v: [f64; 2]| Vec2::from_array(v.map(|x| x as f32));
    // The extension turns counter-clockwise as seen in the image, whose second coordinate points down.
    ImageCoordinates {
        set: transform.tex_coord.unwrap_or(texture.tex_coord),
        image_from_set: Affine2::from_scale_angle_translation(
            vector(transform.scale.unwrap_or([1.0; 2])),
            -transform.rotation as f32,
            vector(transform.offset),
        ),
    }
}

fn wrap(document: &Document, texture: &TextureInfo) -> [Wrap; 2] {
    let texture = document.textures.get(texture.index);
    let sampler = texture.and_then(|texture| document.samplers.get(texture.sampler?));
    let wrap = |code: Option<u32>| match code {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    [
        wrap(sampler.and_then(|s| s.wrap_s)),
        wrap(sampler.and_then(|s| s.wrap_t)),
    ]
}
