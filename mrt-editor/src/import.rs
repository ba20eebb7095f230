//! Reads a scene's mesh and its diffuse colours.
//!
//! Nothing but positions, triangles and one albedo a material comes out. Faulty triangles are left out and counted, so
//! that everything after works on clean geometry.

pub mod error;
pub mod limits;
mod file;
mod glb;
mod obj;
mod raw_mesh;
pub mod report;

use error::ImportError;
use file::read_file;
use glam::{DAffine3, DVec3};
use limits::MAX_COORDINATE_M;
use mrt_core::geometry::mesh::{self, TriangleMesh, Y_UP_FROM_Z_UP};
use raw_mesh::RawMesh;
use report::ImportReport;
use std::path::Path;

/// How to read a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportConfig {
    /// Metres per unit of the file.
    pub scale: f64,
    /// Which axis of the file points up.
    pub up: UpAxis,
    /// Albedo for everything, instead of the file's colours.
    pub albedo: Option<f32>,
}

/// The file's vertical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum UpAxis {
    /// As in the level.
    Y,
    /// As in many modellers; the mesh is turned about x so that this axis becomes +Y.
    Z,
}

/// A mesh in metres with +Y up.
#[derive(Clone, Debug)]
pub struct ImportedScene {
    /// Triangles without faults, at least one.
    pub mesh: TriangleMesh,
    /// What was read, left out and made up.
    pub report: ImportReport,
}

/// Reads an OBJ or GLB file, by how its name ends.
///
/// # Errors
/// [`ImportError`]; faulty triangles are no error as long as one is good.
pub fn read_scene(path: &Path, config: &ImportConfig) -> Result<ImportedScene, ImportError> {
    check(config)?;
    let read = reader(path)?;
    scene_of(path, read(path, &read_file(path)?)?, config)
}

/// Same as [`read_scene`], from the bytes of a file that need not exist. Files that the scene names are looked for in the
/// folder of `path`.
///
/// # Errors
/// As [`read_scene`].
pub fn read_scene_bytes(
    path: &Path,
    bytes: &[u8],
    config: &ImportConfig,
) -> Result<ImportedScene, ImportError> {
    check(config)?;
    let read = reader(path)?;
    scene_of(path, read(path, bytes)?, config)
}

/// Brings a mesh to metres and tidies it.
fn scene_of(
    path: &Path,
    raw: RawMesh,
    config: &ImportConfig,
) -> Result<ImportedScene, ImportError> {
    let (mesh, report) = tidy(path, raw, config)?;
    check_extent(path, &mesh)?;
    Ok(ImportedScene { mesh, report })
}

fn check(config: &ImportConfig) -> Result<(), ImportError> {
    let found = config.scale;
    if !(found.is_finite() && found > 0.0) {
        return Err(ImportError::Scale { found });
    }
    match config.albedo {
        Some(found) if !(0.0..=1.0).contains(&found) => Err(ImportError::Albedo { found }),
        _ => Ok(()),
    }
}

/// Reads the bytes of a file with this path.
type Reader = fn(&Path, &[u8]) -> Result<RawMesh, ImportError>;

/// The reader for files whose name ends so.
fn reader(path: &Path) -> Result<Reader, ImportError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    match ending.to_ascii_lowercase().as_str() {
        "obj" => Ok(obj::read),
        "glb" => Ok(glb::read),
        _ => Err(ImportError::UnknownFormat {
            path: path.to_owned(),
            found: ending.into_owned(),
        }),
    }
}

/// Scales and turns the mesh, and leaves out what cannot be lit.
fn tidy(
    path: &Path,
    mut raw: RawMesh,
    config: &ImportConfig,
) -> Result<(TriangleMesh, ImportReport), ImportError> {
    let found = raw.triangles.len();
    let paints = raw.paints.iter();
    let mut untidy = TriangleMesh {
        positions: raw.positions.iter().map(|p| p.as_vec3()).collect(),
        triangles: std::mem::take(&mut raw.triangles),
        normals: None,
        triangle_materials: std::mem::take(&mut raw.triangle_materials),
        materials: paints.map(|paint| paint.material(config.albedo)).collect(),
    };
    let turn = match config.up {
        UpAxis::Y => DAffine3::IDENTITY,
        UpAxis::Z => DAffine3::from_mat3(Y_UP_FROM_Z_UP),
    };
    let scale = DAffine3::from_scale(DVec3::splat(config.scale));
    mesh::transform(&mut untidy, &(turn * scale));
    // Both readers give indices in range, so only emptiness is left to go wrong.
    let empty = || ImportError::Empty {
        path: path.to_owned(),
        found,
    };
    let (mesh, cleaned) = mesh::clean(&untidy).map_err(|_| empty())?;
    let [low, high] = mesh::bounds(&mesh).ok_or_else(empty)?;
    let mut report = ImportReport {
        scale: config.scale,
        size_m: (high - low).to_array(),
        ..ImportReport::new(&mesh, &cleaned, &raw)
    };
    if config.albedo.is_some() {
        (report.clamped_albedos, report.made_up_albedos) = (0, 0);
    }
    Ok((mesh, report))
}

/// Refuses coordinates beyond [`MAX_COORDINATE_M`].
fn check_extent(path: &Path, mesh: &TriangleMesh) -> Result<(), ImportError> {
    let farthest =
        mesh::bounds(mesh).map_or(0.0, |[low, high]| low.abs().max(high.abs()).max_element());
    if farthest > MAX_COORDINATE_M {
        return Err(ImportError::OutOfRange {
            path: path.to_owned(),
            found: farthest,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: ImportConfig = ImportConfig {
        scale: 1.0,
        up: UpAxis::Y,
        albedo: None,
    };

    fn read_text(name: &str, text: &[u8]) -> Result<ImportedScene, ImportError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("writes");
        read_scene(&path, &CONFIG)
    }

    #[test]
    fn faulty_triangles_are_left_out_and_counted() {
        let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 9 9 9\nf 1 2 3\nf 1 2 4\nf 1 1 2\n";
        let report = read_text("a.obj", text).expect("reads").report;
        assert_eq!(report.triangles, 1);
        assert_eq!(report.not_finite_triangles, 1);
        assert_eq!(report.degenerate_triangles, 1);
        assert_eq!(report.unused_vertices, 1);
        assert_eq!(report.made_up_albedos, 1);
    }

    #[test]
    fn a_material_without_its_library_takes_a_colour_from_its_name() {
        let text = b"mtllib none.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let scene = read_text("a.obj", text).expect("reads");
        let made_up = scene.mesh.materials[0].albedo;
        assert!(made_up.min_element() >= 0.47 && made_up.max_element() <= 0.59);
        assert_eq!(scene.report.made_up_albedos, 1);
    }

    #[test]
    fn hostile_files_are_refused_by_kind() {
        let kind = |name: &str, bytes: &[u8]| read_text(name, bytes).expect_err("refused");
        assert!(matches!(
            kind("a.obj", b""),
            ImportError::Empty { found: 0, .. }
        ));
        assert!(matches!(
            kind("a.obj", b"\xff\xfe\0"),
            ImportError::Malformed { .. }
        ));
        assert!(matches!(kind("a.glb", b""), ImportError::Malformed { .. }));
        assert!(matches!(
            kind("a.glb", b"glTF\x02\0\0\0\0\0\0\0"),
            ImportError::Malformed { .. }
        ));
        assert!(matches!(
            kind("a.ply", b"ply"),
            ImportError::UnknownFormat { .. }
        ));
        let huge = b"v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nf 1 2 3\n";
        assert!(matches!(
            kind("a.obj", huge),
            ImportError::OutOfRange { .. }
        ));
        let missing = read_scene(Path::new("/nowhere/a.obj"), &CONFIG);
        assert!(matches!(missing, Err(ImportError::Io { .. })));
    }
}
