//! Reads a scene's mesh and its diffuse colours.
//!
//! Nothing but positions, triangles and one albedo a material comes out; faulty triangles are left
//! out and counted, so that everything after works on clean geometry.

mod glb;
mod obj;

use glam::{DAffine3, DVec3, Vec3};
use mrt_core::geometry::mesh::{self, Material, MeshReport, TriangleMesh, Y_UP_FROM_Z_UP};
use serde::Serialize;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Larger files are refused before they are read.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// Material libraries larger than this are not read.
const MAX_LIBRARY_BYTES: u64 = 16 << 20;

/// Albedos are kept inside this range: at 0 a wall never shows a bounce and at 1 light never dies.
pub const ALBEDO_RANGE: [f32; 2] = [0.05, 0.9];

/// Coordinates beyond this, in metres, are refused: squared distances have to stay finite.
const MAX_COORDINATE_M: f32 = 1e9;

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
    /// As in many modellers; turned about x so that it becomes +Y.
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

/// What was read, left out and made up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Triangles kept.
    pub triangles: usize,
    /// Triangles without area, left out.
    pub degenerate_triangles: usize,
    /// Triangles with a coordinate that is not a number, left out.
    pub not_finite_triangles: usize,
    /// Vertices that no triangle uses, left out.
    pub unused_vertices: usize,
    /// Edges of three or more triangles.
    pub non_manifold_edges: usize,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Metres per unit of the file.
    pub scale: f64,
    /// Size along x, y and z, metres.
    pub size_m: [f32; 3],
    /// Materials that triangles use.
    pub materials: usize,
    /// Of these, how many take their colour from the file but moved into [`ALBEDO_RANGE`].
    pub clamped_albedos: usize,
    /// Of these, how many have a colour made up from their name.
    pub made_up_albedos: usize,
}

/// Why a scene could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file cannot be opened or read.
    #[error("scene {}: {source}", path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Larger than [`MAX_FILE_BYTES`].
    #[error("scene {}: {found} bytes; expected at most {MAX_FILE_BYTES}", path.display())]
    TooLarge {
        /// Which file.
        path: PathBuf,
        /// Its size.
        found: u64,
    },
    /// Neither `.obj` nor `.glb`.
    #[error("scene {}: found a file ending in `{found}`; expected .obj or .glb", path.display())]
    UnknownFormat {
        /// Which file.
        path: PathBuf,
        /// Its ending.
        found: String,
    },
    /// Not what its ending says.
    #[error("scene {}, {place}: expected {expected}", path.display())]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// What should be there.
        expected: &'static str,
    },
    /// Nothing to light.
    #[error(
        "scene {}: found {found} triangles, none with an area and finite corners; expected at least \
         one", path.display()
    )]
    Empty {
        /// Which file.
        path: PathBuf,
        /// Triangles in the file.
        found: usize,
    },
    /// Coordinates, once scaled, beyond what rays can measure.
    #[error(
        "scene {}: coordinates up to {found} m; expected at most {MAX_COORDINATE_M} m (see --scale)",
        path.display()
    )]
    OutOfRange {
        /// Which file.
        path: PathBuf,
        /// Largest coordinate.
        found: f32,
    },
    /// The scale is not a positive number.
    #[error("--scale {found}; expected a positive number of metres per unit")]
    Scale {
        /// The scale given.
        found: f64,
    },
    /// The albedo is not in [0, 1].
    #[error("--albedo {found}; expected a number from 0 to 1")]
    Albedo {
        /// The albedo given.
        found: f32,
    },
}

/// Reads an OBJ or GLB file, by its ending.
///
/// # Errors
/// [`ImportError`]; faulty triangles are no error as long as one is good.
pub fn read_scene(path: &Path, config: &ImportConfig) -> Result<ImportedScene, ImportError> {
    if !(config.scale.is_finite() && config.scale > 0.0) {
        return Err(ImportError::Scale {
            found: config.scale,
        });
    }
    if let Some(found) = config.albedo.filter(|albedo| !(0.0..=1.0).contains(albedo)) {
        return Err(ImportError::Albedo { found });
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let read = match ending.to_ascii_lowercase().as_str() {
        "obj" => obj::read,
        "glb" => glb::read,
        _ => {
            return Err(ImportError::UnknownFormat {
                path: path.to_owned(),
                found: ending.into_owned(),
            });
        }
    };
    let raw = read(path, &read_file(path)?)?;
    tidy(path, raw, config)
}

/// Scales and turns the mesh, and leaves out what cannot be lit.
fn tidy(path: &Path, raw: RawMesh, config: &ImportConfig) -> Result<ImportedScene, ImportError> {
    let found = raw.triangles.len();
    let mut raw_mesh = TriangleMesh {
        positions: raw.positions,
        triangles: raw.triangles,
        normals: None,
        triangle_materials: raw.triangle_materials,
        materials: raw
            .paints
            .iter()
            .map(|paint| paint.material(config))
            .collect(),
    };
    let turn = match config.up {
        UpAxis::Y => DAffine3::IDENTITY,
        UpAxis::Z => DAffine3::from_mat3(Y_UP_FROM_Z_UP),
    };
    let scale = DAffine3::from_scale(DVec3::splat(config.scale));
    mesh::transform(&mut raw_mesh, &(turn * scale));
    let empty = || ImportError::Empty {
        path: path.to_owned(),
        found,
    };
    // Both readers give indices in range, so that nothing but emptiness is left to go wrong.
    let (mesh, tidied) = mesh::clean(&raw_mesh).map_err(|_| empty())?;
    let [low, high] = mesh::bounds(&mesh).ok_or_else(empty)?;
    let farthest = low.abs().max(high.abs()).max_element();
    if farthest > MAX_COORDINATE_M {
        return Err(ImportError::OutOfRange {
            path: path.to_owned(),
            found: farthest,
        });
    }
    let mut is_used = vec![false; mesh.materials.len()];
    for &material in &mesh.triangle_materials {
        is_used[material as usize] = true;
    }
    let used = |test: fn(&Paint) -> bool| {
        let paints = raw.paints.iter().zip(&is_used);
        paints.filter(|&(paint, &used)| used && test(paint)).count()
    };
    let is_overridden = config.albedo.is_some();
    let report = ImportReport {
        triangles: mesh.triangles.len(),
        unused_vertices: tidied.unused_vertices + raw.unused_vertices,
        scale: config.scale,
        size_m: (high - low).to_array(),
        materials: used(|_| true),
        clamped_albedos: if is_overridden {
            0
        } else {
            used(Paint::is_clamped)
        },
        made_up_albedos: if is_overridden {
            0
        } else {
            used(|paint| paint.colour.is_none())
        },
        ..ImportReport::from(tidied)
    };
    Ok(ImportedScene { mesh, report })
}

impl From<MeshReport> for ImportReport {
    fn from(report: MeshReport) -> Self {
        Self {
            degenerate_triangles: report.degenerate_triangles,
            not_finite_triangles: report.not_finite_triangles,
            unused_vertices: report.unused_vertices,
            non_manifold_edges: report.non_manifold_edges,
            boundary_edges: report.boundary_edges,
            ..Self::default()
        }
    }
}

/// A mesh as the file has it; all indices are in range.
#[derive(Clone, Debug, Default)]
struct RawMesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    triangle_materials: Vec<u32>,
    paints: Vec<Paint>,
    /// Vertices of the file that no face uses and that are not among the positions.
    unused_vertices: usize,
}

/// A material of the file.
#[derive(Clone, Debug, PartialEq)]
struct Paint {
    name: String,
    /// Linear RGB, finite; `None` where the file does not say.
    colour: Option<Vec3>,
}

impl Paint {
    fn new(name: &str, colour: Option<Vec3>) -> Self {
        Self {
            name: name.to_owned(),
            colour: colour.filter(|colour| colour.is_finite()),
        }
    }

    /// For triangles that name no material.
    fn unnamed() -> Self {
        Self::new(UNNAMED, None)
    }

    fn is_clamped(&self) -> bool {
        self.colour
            .is_some_and(|colour| colour != clamp_albedo(colour))
    }

    fn material(&self, config: &ImportConfig) -> Material {
        let albedo = match (config.albedo, self.colour) {
            (Some(albedo), _) => Vec3::splat(albedo),
            (None, Some(colour)) => clamp_albedo(colour),
            (None, None) => colour_of_name(&self.name),
        };
        Material {
            name: self.name.clone(),
            albedo,
        }
    }
}

fn clamp_albedo(colour: Vec3) -> Vec3 {
    let [low, high] = ALBEDO_RANGE;
    colour.clamp(Vec3::splat(low), Vec3::splat(high))
}

/// Name of the material of triangles that name none.
const UNNAMED: &str = "unnamed";

/// A colour of little saturation, each channel between 0.47 and 0.59, by FNV-1a: the same on every
/// machine and with every compiler. A mesh without materials stays grey.
fn colour_of_name(name: &str) -> Vec3 {
    if name == UNNAMED {
        return Vec3::splat(0.53);
    }
    let hash = |seed: u32| {
        let hash = name.bytes().fold(0x811c_9dc5 ^ seed, |hash: u32, byte| {
            (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
        });
        (hash >> 8) as f32 / (1u32 << 24) as f32
    };
    Vec3::new(hash(1), hash(2), hash(3)) * 0.12 + 0.47
}

fn read_file(path: &Path) -> Result<Vec<u8>, ImportError> {
    let io = |source| ImportError::Io {
        path: path.to_owned(),
        source,
    };
    let file = std::fs::File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    // One byte more than allowed tells too large from just fitting, for pipes and devices too.
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(ImportError::TooLarge {
            path: path.to_owned(),
            found: bytes.len() as u64,
        });
    }
    Ok(bytes)
}

/// Text of a material library in the scene's folder; `None` when it is missing or not usable.
fn read_beside(folder: &Path, name: &str) -> Option<String> {
    let file = std::fs::File::open(folder.join(name)).ok()?;
    let mut bytes = Vec::new();
    file.take(MAX_LIBRARY_BYTES).read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
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

    #[test]
    fn albedos_leave_the_extremes() {
        let text = b"mtllib none.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let scene = read_text("a.obj", text).expect("reads");
        let made_up = scene.mesh.materials[0].albedo;
        assert!(made_up.min_element() >= 0.47 && made_up.max_element() <= 0.59);
        let paint = Paint::new("red", Some(Vec3::X));
        assert!(paint.is_clamped());
        assert_eq!(paint.material(&CONFIG).albedo, Vec3::new(0.9, 0.05, 0.05));
    }
}
