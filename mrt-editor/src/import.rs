//! Reads a scene's mesh, its diffuse colours, what shines by itself, and its lamps.
//!
//! Faulty triangles are left out and counted, so that everything after works on clean geometry.

pub mod limits;
pub mod error;
pub mod config;
mod file;
mod neighbour;
pub(crate) mod raw_mesh;
mod gltf;
mod obj;
mod texture;
pub mod surface_colours;
mod tool_materials;
mod material_filter;
mod origin;
mod lamps;
pub mod report;

use config::ImportConfig;
use error::ImportError;
use file::read_file;
use glam::{DAffine3, DVec3, Vec3};
use limits::UNSTATED_ALBEDO;
use mrt_core::geometry::mesh::{self, Material, TriangleMesh, Y_UP_FROM_Z_UP};
use mrt_runtime::Light;
use mrt_runtime::blocks::{MeshReading, UpAxis};
use origin::Extent;
use raw_mesh::RawMesh;
use report::ImportReport;
use std::path::Path;
use surface_colours::{MadeUp, SurfaceColours};

/// A mesh in metres with +Y up.
#[derive(Clone, Debug)]
pub struct ImportedScene {
    /// Triangles without faults, at least one. Materials have their base colours, without images.
    pub mesh: TriangleMesh,
    /// The mesh's colours at each point.
    pub colours: SurfaceColours,
    /// The file's lamps, where the mesh is; spheres and spots have no radius.
    pub lights: Vec<Light>,
    /// How the mesh was read.
    pub reading: MeshReading,
    /// What was read, left out and made up.
    pub report: ImportReport,
}

/// Reads an OBJ or glTF file, by how its name ends.
///
/// # Errors
/// [`ImportError`]; faulty triangles are no error as long as one is good.
pub fn read_scene(path: &Path, config: &ImportConfig) -> Result<ImportedScene, ImportError> {
    config.check()?;
    let read = reader(path)?;
    tidy(path, read(path, &read_file(path)?)?, config)
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
    config.check()?;
    let read = reader(path)?;
    tidy(path, read(path, bytes)?, config)
}

/// Reads the bytes of a file with this path.
type Reader = fn(&Path, &[u8]) -> Result<RawMesh, ImportError>;

/// The reader for files whose name ends so.
fn reader(path: &Path) -> Result<Reader, ImportError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    match ending.to_ascii_lowercase().as_str() {
        "obj" => Ok(obj::read),
        "glb" | "gltf" => Ok(gltf::read),
        _ => Err(ImportError::UnknownFormat {
            path: path.to_owned(),
            found: ending.into_owned(),
        }),
    }
}

/// Scales, turns and moves the mesh, and leaves out what is not wanted and what cannot be lit.
fn tidy(
    path: &Path,
    mut raw: RawMesh,
    config: &ImportConfig,
) -> Result<ImportedScene, ImportError> {
    let found = raw.triangles.len();
    let empty = || ImportError::Empty {
        path: path.to_owned(),
        found,
    };
    let left_out = material_filter::leave_out(path, &mut raw, config)?;
    let turn = match config.up {
        UpAxis::Y => DAffine3::IDENTITY,
        UpAxis::Z => DAffine3::from_mat3(Y_UP_FROM_Z_UP),
    };
    let metres_from_file = turn * DAffine3::from_scale(DVec3::splat(config.scale));
    let extent = Extent::new(&raw, &metres_from_file).ok_or_else(empty)?;
    extent.check(path)?;
    let reading = reading(config, extent.origin());
    let level_from_file = DAffine3::from_translation(-reading.origin) * metres_from_file;
    let untidy = untidy_mesh(&mut raw, &level_from_file);
    // Readers give indices in range, so only emptiness is left to go wrong.
    let (mut mesh, cleaned, kept) = mesh::clean_and_trace(&untidy).map_err(|_| empty())?;
    if mesh.triangles.is_empty() {
        return Err(empty());
    }
    drop(untidy);
    let (mut colours, made_up) = match config.albedo {
        Some(albedo) => {
            let colours = SurfaceColours::uniform(albedo, &raw.paints);
            (colours, MadeUp::default())
        }
        None => SurfaceColours::new(&raw, &mesh, &kept),
    };
    colours.keep_files(std::mem::take(&mut raw.images));
    colours.paint_materials(&mut mesh);
    let lights = place_lamps(&mut raw, &level_from_file);
    let mut report = ImportReport {
        left_out_materials: left_out.triangles,
        scale: config.scale,
        origin_m: reading.origin.to_array(),
        lamps: lights.len(),
        ..ImportReport::new(&mesh, &cleaned, &mut raw, made_up)
    };
    report.unused_vertices -= left_out.vertices;
    Ok(ImportedScene {
        mesh,
        colours,
        lights,
        reading,
        report,
    })
}

/// The file's lamps in the level. Says how many are faulty.
fn place_lamps(raw: &mut RawMesh, level_from_file: &DAffine3) -> Vec<Light> {
    let lamps = raw.lamps.iter();
    let lights: Vec<Light> = lamps
        .filter_map(|lamp| lamps::light(lamp, level_from_file))
        .collect();
    let faulty = raw.lamps.len() - lights.len();
    if faulty > 0 {
        raw.warnings.push(format!(
            "{faulty} of {} lamps are left out: found values that are negative or not finite",
            raw.lamps.len()
        ));
    }
    lights
}

/// What a level keeps about its mesh.
fn reading(config: &ImportConfig, usual_origin: DVec3) -> MeshReading {
    MeshReading {
        scale: config.scale,
        up: config.up,
        origin: config.origin.unwrap_or(usual_origin),
        skip_materials: config.skip_materials.clone(),
        only_materials: config.only_materials.clone(),
        keeps_tool_materials: config.keeps_tool_materials,
    }
}

/// Takes positions and triangles out of a file's mesh. Materials are grey as yet.
fn untidy_mesh(raw: &mut RawMesh, level_from_file: &DAffine3) -> TriangleMesh {
    let positions = std::mem::take(&mut raw.positions).into_iter();
    let moved = positions.map(|place| level_from_file.transform_point3(place).as_vec3());
    let material = |paint: &raw_mesh::Paint| Material {
        name: paint.name.clone(),
        albedo: Vec3::splat(UNSTATED_ALBEDO),
    };
    TriangleMesh {
        positions: moved.collect(),
        triangles: std::mem::take(&mut raw.triangles),
        normals: None,
        triangle_materials: std::mem::take(&mut raw.triangle_materials),
        materials: raw.paints.iter().map(material).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(name: &str, text: &[u8]) -> Result<ImportedScene, ImportError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("writes");
        read_scene(&path, &ImportConfig::default())
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
    fn a_material_without_its_library_is_grey() {
        let text = b"mtllib none.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let scene = read_text("a.obj", text).expect("reads");
        assert_eq!(scene.mesh.materials[0].albedo, Vec3::splat(UNSTATED_ALBEDO));
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
        let missing = read_scene(Path::new("/nowhere/a.obj"), &ImportConfig::default());
        assert!(matches!(missing, Err(ImportError::Io { .. })));
    }

    #[test]
    fn a_far_mesh_is_moved_in_f64_with_its_lamps() {
        let raw = |x: f64| RawMesh {
            positions: [[0.0, 0.0], [0.1, 0.0], [0.0, 0.3]]
                .map(|[dx, y]| DVec3::new(x + dx, y, 0.0))
                .to_vec(),
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            paints: vec![raw_mesh::Paint::unnamed()],
            lamps: vec![raw_mesh::RawLamp {
                kind: raw_mesh::LampKind::Point,
                position: DVec3::new(x, 0.25, 0.0),
                direction: DVec3::NEG_Y,
                intensity: Vec3::ONE,
            }],
            ..RawMesh::default()
        };
        let tidied = |x: f64, origin: Option<DVec3>| {
            let config = ImportConfig {
                origin,
                ..ImportConfig::default()
            };
            tidy(Path::new("a.obj"), raw(x), &config).expect("a mesh")
        };
        let far = tidied(1e7, None);
        assert_eq!(far.reading.origin, DVec3::X * 1e7);
        assert_eq!(far.report.origin_m, [1e7, 0.0, 0.0]);
        let near = tidied(0.0, None);
        assert_eq!(near.reading.origin, DVec3::ZERO);
        // At 1e7, f64 has steps of 2e-9.
        let pairs = far.mesh.positions.iter().zip(&near.mesh.positions);
        assert!(pairs.into_iter().all(|(a, b)| a.distance(*b) < 1e-8));
        assert_eq!(far.lights, near.lights);
        // Whoever lights the mesh reads it as the level says.
        assert_eq!(tidied(1e7, Some(far.reading.origin)).mesh, far.mesh);
    }
}
