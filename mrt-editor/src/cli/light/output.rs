//! The files that `mrt light` leaves: all of them, or none.

use super::glb::glb_bytes;
use super::report::in_mesh;
use super::unwrapped::Unwrapped;
use super::view::View;
use crate::render::file::{Saves, WriteError, make_folder, stage_hdr, stage_ktx2, stage_png};
use crate::render::lit::LitScene;
use crate::render::picture::Picture;
use crate::render::tone::{auto_exposure, tone_map};
use glam::{DVec3, Vec3};
use mrt_core::container::StagedFile;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

/// Writes all files beside their places first, and puts them there once all are on the disk.
pub(super) fn write(
    folder: &Path,
    views: &[View],
    lit: &LitScene<'_>,
    unwrapped: &Unwrapped<'_>,
) -> Result<(), WriteError> {
    let is_new = !folder.exists();
    make_folder(folder)?;
    let result = stage_files(folder, views, lit, unwrapped).and_then(|files| {
        let mut files = files.into_iter();
        files.try_for_each(|file| Ok(file.commit()?))
    });
    if result.is_err() && is_new {
        // Only an empty folder goes. An error is ignored: the first one says more.
        let _ = std::fs::remove_dir(folder);
    }
    result
}

fn stage_files(
    folder: &Path,
    views: &[View],
    lit: &LitScene<'_>,
    unwrapped: &Unwrapped<'_>,
) -> Result<Vec<StagedFile>, WriteError> {
    let mut files = Vec::new();
    for view in views {
        for (picture, suffix) in view.pictures.iter().zip(["-direct", "-indirect", ""]) {
            let path = folder.join(format!("{}{suffix}.png", view.name));
            let size = [picture.width, picture.height];
            let pixels = tone_map(picture, view.exposure);
            files.push(stage_png(&path, size, &pixels, Saves::Time)?);
        }
    }
    let lightmap = Picture {
        width: lit.atlas.width,
        height: lit.atlas.height,
        pixels: lit.lightmap.iter().map(|&e| Vec3::from_array(e)).collect(),
    };
    let size = [lightmap.width, lightmap.height];
    let pixels = tone_map(&lightmap, auto_exposure(&[&lightmap]));
    let path = folder.join("lightmap.png");
    files.push(stage_png(&path, size, &pixels, Saves::Time)?);
    files.push(stage_hdr(&folder.join("lightmap.hdr"), &lightmap)?);
    files.push(stage_ktx2(&folder.join("lightmap.ktx2"), &lightmap)?);
    let obj = obj_text(lit, unwrapped);
    files.push(StagedFile::write(&folder.join("mesh.obj"), obj.as_bytes())?);
    let mtl = mtl_text(lit);
    files.push(StagedFile::write(&folder.join("mesh.mtl"), mtl.as_bytes())?);
    let glb = glb_bytes(lit, unwrapped);
    files.push(StagedFile::write(&folder.join("mesh.glb"), &glb)?);
    Ok(files)
}

/// The mesh with coordinates into the lightmap; v runs upwards, as is usual in OBJ. It stands where the file has it.
fn obj_text(lit: &LitScene<'_>, unwrapped: &Unwrapped<'_>) -> String {
    let origin = unwrapped.origin;
    let mut text = String::from("mtllib mesh.mtl\n");
    let mut positions = Numbered::default();
    let mut coordinates = Numbered::default();
    let mut faces = String::new();
    let mut last_material = None;
    for triangle in unwrapped.triangles {
        let material = lit.mesh.triangle_materials[triangle.source];
        if last_material != Some(material) {
            last_material = Some(material);
            let name = material_name(lit, material);
            line(&mut faces, format_args!("usemtl {name}"));
        }
        let corners = triangle.corners.iter().zip(&triangle.receivers);
        let indices: Vec<String> = corners
            .map(|(corner, at)| {
                let position = positions.number(corner.to_array(), || {
                    line(
                        &mut text,
                        format_args!("v {}", coordinates_of(*corner, origin)),
                    );
                });
                let (u, v) = (at.u as f32, at.v as f32);
                let uv = lit.atlas.texture_coordinate(at.block, at.face, u, v);
                let [u, v] = uv.unwrap_or_default().to_array();
                let coordinate = coordinates.number([u, v], || {
                    line(&mut text, format_args!("vt {u} {}", 1.0 - v));
                });
                format!("{position}/{coordinate}")
            })
            .collect();
        line(&mut faces, format_args!("f {}", indices.join(" ")));
    }
    text + &faces
}

/// Points that have been written, by the bits of their coordinates.
struct Numbered<const N: usize>(HashMap<[u32; N], usize>);

impl<const N: usize> Default for Numbered<N> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

impl<const N: usize> Numbered<N> {
    /// The number of a point, counted from 1; a new one is written first.
    fn number(&mut self, point: [f32; N], write: impl FnOnce()) -> usize {
        let next = self.0.len() + 1;
        *self.0.entry(point.map(f32::to_bits)).or_insert_with(|| {
            write();
            next
        })
    }
}

/// A point of the level in the mesh's coordinates, as text: with all digits of its own where the level's origin is the mesh's.
fn coordinates_of(point: Vec3, origin: DVec3) -> String {
    if origin == DVec3::ZERO {
        let [x, y, z] = point.to_array();
        return format!("{x} {y} {z}");
    }
    let [x, y, z] = in_mesh(point, origin).to_array();
    format!("{x} {y} {z}")
}

fn mtl_text(lit: &LitScene<'_>) -> String {
    let mut text = String::new();
    for (index, material) in lit.mesh.materials.iter().enumerate() {
        let [r, g, b] = material.albedo.to_array();
        let name = material_name(lit, index as u32);
        line(&mut text, format_args!("newmtl {name}"));
        line(&mut text, format_args!("Kd {r} {g} {b}"));
        // A viewer multiplies the colour by the indirect light.
        line(&mut text, format_args!("map_Kd lightmap.png\n"));
    }
    text
}

/// A name without blanks that no other material has: names from files may hold blanks, or be empty.
fn material_name(lit: &LitScene<'_>, material: u32) -> String {
    let name = &lit.mesh.materials[material as usize].name;
    let plain: String = name
        .chars()
        .map(|c| if c.is_whitespace() { '_' } else { c })
        .collect();
    format!("{plain}.{material}")
}

fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{arguments}");
}
