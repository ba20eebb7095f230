//! The files that `mrt light` leaves: all of them, or none.

use super::View;
use crate::render::Picture;
use crate::render::file::{Saves, WriteError, write_hdr, write_png};
use crate::render::lit::LitScene;
use crate::render::tone::{auto_exposure, tone_map};
use glam::Vec3;
use mrt_core::container::write_file_atomically;
use mrt_runtime::low_level::output::receiver::UnwrappedTriangle;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes into a folder of its own beside `folder` first, and moves the files once all are there.
pub(super) fn write(
    folder: &Path,
    views: &[View],
    lit: &LitScene<'_>,
    unwrapped: &[UnwrappedTriangle],
) -> Result<(), WriteError> {
    let mut name = folder.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = folder.with_file_name(name);
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| WriteError::Io { path, source }
    };
    let write = || {
        std::fs::create_dir_all(&part).map_err(io(&part))?;
        let files = write_files(&part, views, lit, unwrapped)?;
        std::fs::create_dir_all(folder).map_err(io(folder))?;
        for file in files {
            let target = folder.join(&file);
            std::fs::rename(part.join(&file), &target).map_err(io(&target))?;
        }
        Ok(())
    };
    let result = write();
    // Empty by now, or not wanted; the result says whether all went well.
    let _ = std::fs::remove_dir_all(&part);
    result
}

fn write_files(
    folder: &Path,
    views: &[View],
    lit: &LitScene<'_>,
    unwrapped: &[UnwrappedTriangle],
) -> Result<Vec<PathBuf>, WriteError> {
    let mut files = Vec::new();
    let mut name = |file: String| {
        files.push(PathBuf::from(&file));
        folder.join(file)
    };
    for view in views {
        for (picture, suffix) in view.pictures.iter().zip(["-direct", "-indirect", ""]) {
            let path = name(format!("{}{suffix}.png", view.name));
            let pixels = tone_map(picture, view.exposure);
            write_png(&path, [picture.width, picture.height], &pixels, Saves::Time)?;
        }
    }
    let lightmap = Picture {
        width: lit.atlas.width,
        height: lit.atlas.height,
        pixels: lit.lightmap.iter().map(|&e| Vec3::from_array(e)).collect(),
    };
    let size = [lightmap.width, lightmap.height];
    let pixels = tone_map(&lightmap, auto_exposure(&[&lightmap]));
    write_png(&name("lightmap.png".to_owned()), size, &pixels, Saves::Time)?;
    write_hdr(&name("lightmap.hdr".to_owned()), &lightmap)?;
    let obj = obj_text(lit, unwrapped);
    write_file_atomically(&name("mesh.obj".to_owned()), obj.as_bytes())?;
    let mtl = mtl_text(lit);
    write_file_atomically(&name("mesh.mtl".to_owned()), mtl.as_bytes())?;
    Ok(files)
}

/// The mesh with coordinates into the lightmap; v runs upwards, as is usual in OBJ.
fn obj_text(lit: &LitScene<'_>, unwrapped: &[UnwrappedTriangle]) -> String {
    let mut text = String::from("mtllib mesh.mtl\n");
    let mut positions = HashMap::new();
    let mut coordinates = HashMap::new();
    let mut faces = String::new();
    let mut last_material = None;
    for triangle in unwrapped {
        let material = lit.mesh.triangle_materials[triangle.source];
        if last_material != Some(material) {
            last_material = Some(material);
            line(
                &mut faces,
                format_args!("usemtl {}", material_name(lit, material)),
            );
        }
        let mut indices = [(0, 0); 3];
        for (k, (corner, receiver)) in triangle.corners.iter().zip(&triangle.receivers).enumerate()
        {
            let next = positions.len() + 1;
            let position = *positions
                .entry(corner.to_array().map(f32::to_bits))
                .or_insert_with(|| {
                    line(
                        &mut text,
                        format_args!("v {} {} {}", corner.x, corner.y, corner.z),
                    );
                    next
                });
            let (u, v) = (receiver.u as f32, receiver.v as f32);
            let uv = lit
                .atlas
                .texture_coordinate(receiver.block, receiver.face, u, v)
                .unwrap_or_default();
            let next = coordinates.len() + 1;
            let coordinate = *coordinates
                .entry(uv.to_array().map(f32::to_bits))
                .or_insert_with(|| {
                    line(&mut text, format_args!("vt {} {}", uv.x, 1.0 - uv.y));
                    next
                });
            indices[k] = (position, coordinate);
        }
        let [a, b, c] = indices;
        line(
            &mut faces,
            format_args!("f {}/{} {}/{} {}/{}", a.0, a.1, b.0, b.1, c.0, c.1),
        );
    }
    text + &faces
}

fn mtl_text(lit: &LitScene<'_>) -> String {
    let mut text = String::new();
    for (index, material) in lit.mesh.materials.iter().enumerate() {
        let [r, g, b] = material.albedo.to_array();
        line(
            &mut text,
            format_args!("newmtl {}", material_name(lit, index as u32)),
        );
        line(&mut text, format_args!("Kd {r} {g} {b}"));
        // The indirect light, for a viewer to multiply the colour with.
        line(&mut text, format_args!("map_Kd lightmap.png\n"));
    }
    text
}

/// Names from files may hold blanks, or nothing at all.
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
