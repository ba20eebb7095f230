//! The demo's maze with a sphere at each probe of one layer, lit by the probe alone.

use super::{FigureError, Setting};
use crate::canvas::Canvas;
use glam::{DVec3, Vec3};
use mrt_editor::cli::demo::MAZE;
use mrt_editor::render::camera::Camera;
use mrt_editor::render::level_view::LevelView;
use mrt_editor::render::render;
use mrt_editor::render::tone::auto_exposure;
use mrt_runtime::FrameConfig;
use mrt_runtime::Level;
use mrt_runtime::low_level::output::probes::irradiance_from_probe;
use mrt_runtime::{AssembleConfig, Bounces, Frame, Light, Outputs, ProbeOrder, Scene};
use std::f32::consts::PI;

const BOUNCES: u32 = 8;
/// Metres; blocks are cubes of 1 m.
const SPHERE_RADIUS: f32 = 0.07;
const SPHERE_ALBEDO: f32 = 0.75;
/// Over the floor, of a block's height: at most this.
const LAYER: f64 = 0.5;
const PICTURE: [usize; 2] = [820, 448];

struct Sphere {
    center: Vec3,
    light: Vec<[f32; 3]>,
}

pub(super) fn draw(setting: &Setting) -> Result<Canvas, FigureError> {
    let level = Level::from_text(MAZE)?;
    let scene = Scene::assemble(&level, setting.dictionary, &AssembleConfig::default())?;
    let outputs = Outputs {
        lightmap: true,
        probes: Some(ProbeOrder::L2),
        vector: false,
    };
    let config = FrameConfig {
        outputs,
        bounces: Bounces::Count(BOUNCES),
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    // A warm lamp in the red arm, a cool one in the blue arm, a weak one in the far corner.
    let lamp = |position, intensity| Light::Sphere {
        position,
        radius: 0.1,
        intensity,
    };
    let lights = [
        lamp(Vec3::new(0.55, 0.62, 0.5), Vec3::new(1.0, 0.82, 0.6)),
        lamp(Vec3::new(0.6, 0.62, 2.5), Vec3::new(0.6, 0.78, 1.0)),
        lamp(Vec3::new(4.5, 0.62, 3.5), Vec3::splat(0.5)),
    ];
    frame.set_lights(&lights);
    frame.solve().require_all_lights()?;
    let spheres =
        spheres(&scene, &frame).ok_or(FigureError::NotInDictionary { missing: "probes" })?;
    let shown = LevelView::new(&scene, &frame, &lights, false)?;
    let [width, height] = PICTURE.map(|k| k as i32);
    let mut canvas = Canvas::titled(
        [width + 40, height + 100],
        "Probes in the demo's maze, shown as white spheres",
        &[
            "Indirect light only, seen from above without ceilings. Each sphere shows what its probe would light a white thing",
            "with: colours come from the walls around it, and from blocks beyond the openings.",
        ],
    );
    let aspect = PICTURE[0] as f32 / PICTURE[1] as f32;
    let camera = Camera::look_at(
        Vec3::new(2.5, 6.4, 6.6),
        Vec3::new(2.5, 0.2, 1.93),
        0.51,
        aspect,
    );
    let Some(camera) = camera else {
        return Ok(canvas);
    };
    let [picture, covered] = render(&camera, PICTURE, 3, |origin, direction| {
        let wall = shown.distance(origin, direction).unwrap_or(f32::MAX);
        let sphere = spheres
            .iter()
            .filter_map(|sphere| Some((sphere.distance(origin, direction)?, sphere)))
            .filter(|(distance, _)| *distance < wall)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match (sphere, shown.radiance(origin, direction)) {
            (Some((distance, sphere)), _) => {
                let normal = (origin + distance * direction - sphere.center) / SPHERE_RADIUS;
                let light = irradiance_from_probe(&sphere.light, normal);
                [light * SPHERE_ALBEDO / PI, Vec3::ONE]
            }
            (None, Some((_, indirect))) => [indirect, Vec3::ONE],
            (None, None) => [Vec3::ZERO; 2],
        }
    });
    canvas.picture([20, 84], &picture, &covered, auto_exposure(&[&picture]));
    Ok(canvas)
}

impl Sphere {
    /// Along a ray of unit direction to the sphere's near side.
    fn distance(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let to = self.center - origin;
        let along = to.dot(direction);
        let squared = SPHERE_RADIUS * SPHERE_RADIUS - (to - along * direction).length_squared();
        (squared > 0.0 && along > 0.0).then(|| along - squared.sqrt())
    }
}

/// One layer of each block's probes; `None` in a scene without.
fn spheres(scene: &Scene, frame: &Frame) -> Option<Vec<Sphere>> {
    let probes = frame.probes()?;
    let n = probes.per_axis();
    let kept = probes.order().coefficients();
    let place = |k: usize| (k as f64 + 0.5) / n as f64;
    // All shapes of the maze stand upright, so the canonical y is the level's.
    let layer = (0..n).rev().find(|&k| place(k) <= LAYER)?;
    let mut spheres = Vec::new();
    for (block, placed) in scene.level.blocks.iter().enumerate() {
        for z in 0..n {
            for x in 0..n {
                let unit = DVec3::new(place(x), place(layer), place(z));
                let probe = ((block * n + z) * n + layer) * n + x;
                spheres.push(Sphere {
                    center: placed.warp.point(unit).as_vec3(),
                    light: probes.values()[probe * kept..][..kept].to_vec(),
                });
            }
        }
    }
    Some(spheres)
}
