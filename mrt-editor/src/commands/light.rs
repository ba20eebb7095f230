//! `mrt light`: lights a real mesh through its blocks and takes pictures.

mod args;
mod output;

pub use args::{Exposure, LightArg, LightArgs, Shadows, ViewArg};

use crate::dictionary_source::{SourceError, load};
use crate::import::{ImportError, ImportReport, read_scene};
use crate::picture::camera::Camera;
use crate::picture::file::WriteError;
use crate::picture::lit::{LitScene, SphereLight};
use crate::picture::placement::{
    Surroundings, VIEW_ANGLE_RAD, camera_at_light, light_places, overview,
};
use crate::picture::tone::auto_exposure;
use crate::picture::{Picture, render};
use crate::receiver::ReceiverMap;
use glam::{DVec3, Vec3};
use mrt_core::bvh::Bvh;
use mrt_core::mesh::corner_normals;
use mrt_runtime::assemble::{AssembleConfig, AssembleError, assemble};
use mrt_runtime::frame::{Bounces, Frame, FrameError};
use mrt_runtime::level::Level;
use mrt_runtime::level_text::{LevelTextError, MAX_TEXT_BYTES, from_text};
use mrt_runtime::light::Light;
use mrt_runtime::scene::Scene;
use mrt_runtime::visibility::{Openings, Rays};
use serde::Serialize;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A light's radius where none is given, in widths of its block: 1.6 texels of the standard dictionary.
const LIGHT_RADIUS: f64 = 0.1;

/// Lights placed when none is given: one for this many blocks, up to the most.
const BLOCKS_A_LIGHT: usize = 12;
const MOST_DEFAULT_LIGHTS: usize = 6;

/// Cameras placed at lights when none is given.
const DEFAULT_VIEWS: usize = 2;

/// Faces that meet at less than this angle look smooth, radians.
const CREASE_ANGLE_RAD: f64 = 0.7;

/// `--bounces all` stops when a pass changes less than this share.
const CONVERGED: Bounces = Bounces::Converged {
    tolerance: 1e-3,
    limit: 64,
};

/// How far a block's wall may stand behind the real surface, in widths of the smallest block, before a
/// shadow ray takes the surface for something in the way.
const WALL_SLACK: f64 = 0.15;

/// Why there are no pictures.
#[derive(Debug, thiserror::Error)]
pub enum LightCommandError {
    /// The mesh cannot be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The level's file cannot be read.
    #[error("level {}: {source}", path.display())]
    LevelFile {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The level is faulty.
    #[error("level {}: {source}", path.display())]
    Level {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: LevelTextError,
    },
    /// There is no dictionary.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// A light is refused.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A light is outside every block.
    #[error(
        "light {light} at {position} m lies in no block: {distance:.3} m outside block {block}, the \
         nearest; expected a point inside the level"
    )]
    OutsideBlocks {
        /// Which light.
        light: usize,
        /// Its position.
        position: Vec3,
        /// The nearest block.
        block: usize,
        /// Metres to it.
        distance: f64,
    },
    /// A light is behind the mesh's faces.
    #[error(
        "light {light} at {position} m lies inside a wall: it sees the backs of faces in {backs:.0} % \
         of all directions; expected a point in a room"
    )]
    InWall {
        /// Which light.
        light: usize,
        /// Its position.
        position: Vec3,
        /// Share of directions, percent.
        backs: f32,
    },
    /// Nowhere to put the default light.
    #[error(
        "no light was given and none of the level's blocks has free space at its centre; expected \
         --light x,y,z,intensity"
    )]
    NoPlace,
    /// The camera has no direction.
    #[error("--camera {from};{to}: expected two different points")]
    Camera {
        /// Where it stands.
        from: Vec3,
        /// Where it looks.
        to: Vec3,
    },
    /// The files cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

#[derive(Serialize)]
struct Report {
    mesh: ImportReport,
    blocks: usize,
    connections: usize,
    lights: Vec<[f32; 8]>,
    passes: u32,
    dictionary_seconds: f64,
    assemble_seconds: f64,
    frame_milliseconds: f64,
    lightmap: [usize; 2],
    lightmap_triangles: usize,
    views: Vec<ViewReport>,
    seconds: f64,
}

#[derive(Serialize)]
struct ViewReport {
    name: String,
    exposure_ev: f32,
    /// Means over the picture of relative luminance.
    direct: f32,
    indirect: f32,
}

/// Pictures of one camera.
struct View {
    name: String,
    /// Direct, indirect, both.
    pictures: [Picture; 3],
    exposure: f32,
}

/// Reads everything, solves one frame, renders, and writes all files at the end.
///
/// # Errors
/// [`LightCommandError`]; then the output folder is as it was before.
pub fn run(args: &LightArgs) -> Result<(), LightCommandError> {
    let start = Instant::now();
    let imported = read_scene(&args.scene, &args.import.config())?;
    let mesh = &imported.mesh;
    let level = read_level(&args.level)?;
    let bvh = Bvh::build(mesh);
    let surroundings = Surroundings::new(mesh, &bvh, &level);
    let receivers = ReceiverMap::with_mesh(&level, &bvh);
    let lights = place_lights(args, &level, &receivers, &surroundings)?;

    let dictionary_start = Instant::now();
    let dictionary = load(args.dictionary.as_deref(), args.preset.as_deref())?;
    let dictionary_seconds = dictionary_start.elapsed().as_secs_f64();
    let assemble_start = Instant::now();
    let scene = assemble(&level, &dictionary, &AssembleConfig::default())?;
    let assemble_seconds = assemble_start.elapsed().as_secs_f64();
    let mut frame = Frame::new(&scene);
    let frame_start = Instant::now();
    solve(&mut frame, &scene, &lights, &bvh, args)?;
    let frame_milliseconds = frame_start.elapsed().as_secs_f64() * 1e3;

    let lit = LitScene {
        mesh,
        corner_normals: &corner_normals(mesh, CREASE_ANGLE_RAD),
        bvh: &bvh,
        receivers: &receivers,
        atlas: &scene.atlas,
        lightmap: frame.lightmap(),
        lights: &lights,
        restart: surroundings.restart(),
        hides_outside: false,
    };
    let views = views(args, &lit, &level, &surroundings)?;
    let unwrapped = crate::receiver::unwrap::unwrap(mesh, &receivers);
    let report = Report {
        mesh: imported.report,
        blocks: level.blocks.len(),
        connections: level.connections.len(),
        lights: lights.iter().map(light_row).collect(),
        passes: frame.passes(),
        dictionary_seconds,
        assemble_seconds,
        frame_milliseconds,
        lightmap: [scene.atlas.width, scene.atlas.height],
        lightmap_triangles: unwrapped.len(),
        views: views.iter().map(View::report).collect(),
        seconds: 0.0,
    };
    output::write(&args.out, &views, &lit, &unwrapped)?;
    let report = Report {
        seconds: start.elapsed().as_secs_f64(),
        ..report
    };
    if args.json {
        // A struct of numbers and names always has a text.
        println!("{}", serde_json::to_string(&report).unwrap_or_default());
    } else {
        report.print();
    }
    Ok(())
}

fn read_level(path: &Path) -> Result<Level, LightCommandError> {
    let io = |source| LightCommandError::LevelFile {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    std::fs::File::open(path)
        .map_err(io)?
        // One byte more than a level may have tells too long from just fitting.
        .take(MAX_TEXT_BYTES as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    let text = String::from_utf8_lossy(&bytes);
    from_text(&text).map_err(|source| LightCommandError::Level {
        path: path.to_owned(),
        source,
    })
}

/// The lights asked for, or a few in the largest blocks.
fn place_lights(
    args: &LightArgs,
    level: &Level,
    receivers: &ReceiverMap,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<SphereLight>, LightCommandError> {
    let width = |block: usize| {
        let volume = level.blocks[block]
            .warp
            .jacobian(DVec3::splat(0.5))
            .determinant();
        volume.abs().cbrt()
    };
    if args.light.is_empty() {
        let count = level
            .blocks
            .len()
            .div_ceil(BLOCKS_A_LIGHT)
            .min(MOST_DEFAULT_LIGHTS);
        let places = light_places(surroundings, level, count);
        if places.is_empty() {
            return Err(LightCommandError::NoPlace);
        }
        let lights = places.into_iter().map(|(block, position)| SphereLight {
            position,
            radius: args
                .light_radius
                .unwrap_or((LIGHT_RADIUS * width(block)) as f32),
            // About 1 W/m² on the walls of its block.
            intensity: Vec3::splat((0.25 * width(block) * width(block)) as f32),
        });
        return Ok(lights.collect());
    }
    let mut lights = Vec::with_capacity(args.light.len());
    for (index, light) in args.light.iter().enumerate() {
        let position = light.position;
        let mut radius = args.light_radius.unwrap_or(0.0);
        if position.is_finite()
            && let Some((block, distance)) = receivers.nearest_block(position)
        {
            if distance > 1e-3 * width(block) {
                return Err(LightCommandError::OutsideBlocks {
                    light: index,
                    position,
                    block,
                    distance,
                });
            }
            if surroundings.is_in_wall(position) {
                return Err(LightCommandError::InWall {
                    light: index,
                    position,
                    backs: 100.0 * surroundings.look_around(position).backs,
                });
            }
            radius = args
                .light_radius
                .unwrap_or((LIGHT_RADIUS * width(block)) as f32);
        }
        // Whatever else is wrong with the numbers, the frame refuses by name.
        lights.push(SphereLight {
            position,
            radius,
            intensity: light.colour * light.intensity,
        });
    }
    Ok(lights)
}

fn solve(
    frame: &mut Frame,
    scene: &Scene,
    lights: &[SphereLight],
    bvh: &Bvh,
    args: &LightArgs,
) -> Result<(), FrameError> {
    let lights: Vec<Light> = lights
        .iter()
        .map(|light| Light::Sphere {
            position: light.position,
            radius: light.radius,
            intensity: light.intensity,
        })
        .collect();
    let bounces = args.bounces.map_or(CONVERGED, Bounces::Count);
    match args.shadows {
        Shadows::Openings => frame.solve(scene, &lights, &Openings, bounces),
        Shadows::Rays => {
            let slack = WALL_SLACK * smallest_width(scene);
            let rays = Rays(|receiver: DVec3, light: DVec3| {
                // From the light, and short of the receiver: a block's wall stands a little behind the
                // real one.
                let towards = receiver - light;
                let reach = 1.0 - slack / towards.length();
                let is_blocked = reach > 0.0
                    && bvh.is_occluded(light.as_vec3(), towards.as_vec3(), reach as f32);
                if is_blocked { 0.0 } else { 1.0 }
            });
            frame.solve(scene, &lights, &rays, bounces)
        }
    }
}

fn smallest_width(scene: &Scene) -> f64 {
    scene
        .blocks
        .iter()
        .map(|block| {
            block
                .warp
                .jacobian(DVec3::splat(0.5))
                .determinant()
                .abs()
                .cbrt()
        })
        .fold(f64::MAX, f64::min)
}

/// Renders the views asked for, or one at the first light and one of everything.
fn views(
    args: &LightArgs,
    lit: &LitScene<'_>,
    level: &Level,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<View>, LightCommandError> {
    let [width, height] = args.size;
    let aspect = width as f32 / height as f32;
    let mut cameras: Vec<(String, Camera, bool)> = Vec::new();
    for (index, view) in args.camera.iter().enumerate() {
        let camera = Camera::look_at(view.from, view.to, VIEW_ANGLE_RAD, aspect);
        let camera = camera.ok_or(LightCommandError::Camera {
            from: view.from,
            to: view.to,
        })?;
        cameras.push((format!("view{}", index + 1), camera, false));
    }
    if cameras.is_empty() {
        for (index, light) in lit.lights.iter().take(DEFAULT_VIEWS).enumerate() {
            let camera = camera_at_light(surroundings, light.position, aspect);
            cameras.extend(camera.map(|camera| (format!("view{}", index + 1), camera, false)));
        }
        let camera = overview(level, aspect);
        cameras.extend(camera.map(|camera| ("overview".to_owned(), camera, true)));
    }
    Ok(cameras
        .into_iter()
        .map(|(name, camera, is_outside)| {
            let lit = LitScene {
                hides_outside: is_outside && !surroundings.is_reversed,
                ..*lit
            };
            let [direct, indirect] = render(&camera, args.size, 2, |origin, direction| {
                let colours = lit.colours(origin, direction);
                [colours.direct, colours.indirect]
            });
            let both = sum(&direct, &indirect);
            let exposure = match args.exposure {
                Exposure::Auto => auto_exposure(&[&both]),
                Exposure::Value(ev) => ev.exp2(),
            };
            View {
                name,
                pictures: [direct, indirect, both],
                exposure,
            }
        })
        .collect())
}

fn sum(a: &Picture, b: &Picture) -> Picture {
    Picture {
        pixels: a.pixels.iter().zip(&b.pixels).map(|(a, b)| a + b).collect(),
        ..*a
    }
}

fn light_row(light: &SphereLight) -> [f32; 8] {
    let [x, y, z] = light.position.to_array();
    let [r, g, b] = light.intensity.to_array();
    let strongest = light.intensity.max_element();
    [x, y, z, light.radius, strongest, r, g, b]
}

impl View {
    fn report(&self) -> ViewReport {
        let mean = |picture: &Picture| {
            let sum: f32 = picture
                .pixels
                .iter()
                .map(|&colour| crate::picture::tone::luminance(colour))
                .sum();
            sum / picture.pixels.len() as f32
        };
        ViewReport {
            name: self.name.clone(),
            exposure_ev: self.exposure.log2(),
            direct: mean(&self.pictures[0]),
            indirect: mean(&self.pictures[1]),
        }
    }
}

impl Report {
    fn print(&self) {
        self.mesh.print();
        let row = |name: &str, value: String| println!("{name:<22} {value}");
        row("blocks", self.blocks.to_string());
        row("connections", self.connections.to_string());
        for [x, y, z, radius, _, r, g, b] in &self.lights {
            row(
                "light",
                format!(
                    "({x:.3}, {y:.3}, {z:.3}) m, radius {radius:.3} m, ({r:.3}, {g:.3}, {b:.3}) W/sr"
                ),
            );
        }
        row("dictionary", format!("{:.2} s", self.dictionary_seconds));
        row("assembly", format!("{:.2} s", self.assemble_seconds));
        row(
            "frame",
            format!(
                "{:.2} ms with direct light, {} passes",
                self.frame_milliseconds, self.passes
            ),
        );
        let [width, height] = self.lightmap;
        row(
            "lightmap",
            format!("{width} x {height}, {} triangles", self.lightmap_triangles),
        );
        for view in &self.views {
            row(
                &view.name,
                format!(
                    "exposure {:+.1} EV, mean direct {:.4}, indirect {:.4}",
                    view.exposure_ev, view.direct, view.indirect
                ),
            );
        }
        row("seconds", format!("{:.2}", self.seconds));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::map::{MapArgs, run as run_map};
    use clap::Parser;
    use std::ffi::OsString;
    use std::fs;

    #[derive(Parser)]
    struct MapLine {
        #[command(flatten)]
        args: MapArgs,
    }

    #[derive(Parser)]
    struct LightLine {
        #[command(flatten)]
        args: LightArgs,
    }

    /// A room of 4 x 3 x 4 m, seen from inside.
    const ROOM: &str = "v 0 0 0\nv 4 0 0\nv 0 3 0\nv 4 3 0\nv 0 0 4\nv 4 0 4\nv 0 3 4\nv 4 3 4\n\
        f 1 5 6 2\nf 3 4 8 7\nf 1 2 4 3\nf 5 7 8 6\nf 1 3 7 5\nf 2 6 8 4\n";

    fn words(command: &str, folder: &Path) -> Vec<OsString> {
        let place = folder.display().to_string();
        let words = command
            .split(' ')
            .map(|word| word.replace('@', &place).into());
        std::iter::once("mrt".into()).chain(words).collect()
    }

    fn light(folder: &Path, more: &str) -> Result<(), LightCommandError> {
        let command = format!("--scene @/room.obj --level @/level.toml --out @/out {more}");
        run(&LightLine::parse_from(words(command.trim(), folder)).args)
    }

    fn mapped_room() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("room.obj"), ROOM).expect("writes");
        let command = "--scene @/room.obj --out @/level.toml --json";
        let line = MapLine::parse_from(words(command, folder.path()));
        run_map(&line.args).expect("maps");
        folder
    }

    #[test]
    fn a_room_is_mapped_and_lit() {
        let folder = mapped_room();
        light(folder.path(), "--size 32x18 --json").expect("lights");
        let out = folder.path().join("out");
        for file in [
            "view1.png",
            "overview-direct.png",
            "lightmap.hdr",
            "mesh.obj",
            "mesh.mtl",
        ] {
            assert!(out.join(file).exists(), "{file}");
        }
        // Nothing but the scene, the level and the pictures.
        assert_eq!(fs::read_dir(folder.path()).expect("reads").count(), 3);
        let picture = image::open(out.join("view1-indirect.png")).expect("a picture");
        let lit = picture
            .to_luma8()
            .pixels()
            .filter(|pixel| pixel.0[0] > 10)
            .count();
        assert!(lit > 32 * 18 / 2, "{lit} lit pixels");
    }

    #[test]
    fn shadow_rays_and_openings_agree_in_an_empty_room() {
        let folder = mapped_room();
        let mean = |shadows: &str| {
            light(
                folder.path(),
                &format!("--size 16x9 --shadows {shadows} --exposure 0"),
            )
            .expect("lights");
            let picture = image::open(folder.path().join("out/view1-indirect.png"));
            let picture = picture.expect("a picture").to_luma8();
            picture
                .pixels()
                .map(|pixel| u64::from(pixel.0[0]))
                .sum::<u64>()
        };
        assert_eq!(mean("openings"), mean("rays"));
    }

    #[test]
    fn bad_lights_are_refused_and_nothing_is_written() {
        let folder = mapped_room();
        let error = |more: &str| {
            let error = light(folder.path(), &format!("--size 8x8 {more}")).expect_err("refused");
            assert!(!folder.path().join("out").exists());
            error.to_string()
        };
        assert!(error("--light 9,1,1,5").contains("lies in no block"));
        assert!(error("--light nan,1,1,5").contains("position"));
        assert!(error("--light 1,1,1,-5").contains("intensity"));
        assert!(error("--light 1,1,1,inf").contains("intensity"));
        assert!(error("--camera 1,1,1;1,1,1").contains("two different points"));
        assert!(error("--dictionary @/room.obj").contains("room.obj"));
    }

    #[test]
    fn lights_behind_faces_are_in_a_wall() {
        let folder = mapped_room();
        // A box of solid rock in the middle of the room's floor.
        let rock = "v 1 0 1\nv 2 0 1\nv 1 1 1\nv 2 1 1\nv 1 0 2\nv 2 0 2\nv 1 1 2\nv 2 1 2\n\
            f 9 10 14 13\nf 11 15 16 12\nf 9 11 12 10\nf 13 14 16 15\nf 9 13 15 11\nf 10 12 16 14\n";
        fs::write(folder.path().join("room.obj"), format!("{ROOM}{rock}")).expect("writes");
        let error = light(folder.path(), "--size 8x8 --light 1.5,0.5,1.5,5").expect_err("refused");
        assert!(
            matches!(error, LightCommandError::InWall { light: 0, .. }),
            "{error}"
        );
    }

    #[test]
    fn truncated_files_leave_nothing() {
        let folder = mapped_room();
        let level = fs::read_to_string(folder.path().join("level.toml")).expect("reads");
        for cut in [0, 10, level.len() / 2] {
            fs::write(folder.path().join("level.toml"), &level[..cut]).expect("writes");
            assert!(light(folder.path(), "").is_err());
        }
        assert!(!folder.path().join("out").exists());
    }
}
