//! The pictures of `mrt light`.

use super::args::{Exposure, LightArgs};
use super::error::LightCommandError;
use super::report::ViewReport;
use crate::render::camera::Camera;
use crate::render::lamp::position;
use crate::render::lit::LitScene;
use crate::render::picture::Picture;
use crate::render::placement::{
    Surroundings, VIEW_ANGLE_RAD, camera_at_light, light_places, overview,
};
use crate::render::render;
use crate::render::tone::{auto_exposure, luminance};
use glam::{DVec3, Vec3};
use mrt_runtime::Level;

/// Cameras placed at lamps when none is given.
const DEFAULT_VIEWS: usize = 2;

/// Rays along each axis of a pixel at edges.
const SAMPLES: usize = 2;

/// Pictures of one camera.
pub(super) struct View {
    pub(super) name: String,
    /// Direct light, indirect light, both.
    pub(super) pictures: [Picture; 3],
    pub(super) exposure: f32,
}

impl View {
    pub(super) fn report(&self) -> ViewReport {
        let mean = |picture: &Picture| {
            let sum: f32 = picture.pixels.iter().map(|&colour| luminance(colour)).sum();
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

/// A camera, and the name of its pictures.
struct NamedCamera {
    name: String,
    camera: Camera,
    /// Whether it looks into the level from outside.
    is_outside: bool,
}

/// Where the level's origin is in the mesh, metres.
pub(super) fn level_origin(level: &Level) -> DVec3 {
    level.mesh.as_ref().map_or(DVec3::ZERO, |mesh| mesh.origin)
}

/// Renders the views asked for, or views at the first lamps and one of everything.
pub(super) fn views(
    args: &LightArgs,
    lit: &LitScene<'_>,
    level: &Level,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<View>, LightCommandError> {
    let [width, height] = args.size;
    let aspect = width as f32 / height as f32;
    let cameras = if args.camera.is_empty() {
        default_cameras(lit, level, surroundings, aspect)
    } else {
        cameras_asked_for(args, level_origin(level), aspect)?
    };
    let view = |named: NamedCamera| {
        let lit = LitScene {
            hides_outside: named.is_outside && !surroundings.is_reversed,
            pixel_angle: VIEW_ANGLE_RAD / height as f32,
            ..*lit
        };
        photograph(args, &lit, named)
    };
    Ok(cameras.into_iter().map(view).collect())
}

fn cameras_asked_for(
    args: &LightArgs,
    origin: DVec3,
    aspect: f32,
) -> Result<Vec<NamedCamera>, LightCommandError> {
    let mut cameras = Vec::with_capacity(args.camera.len());
    for (index, view) in args.camera.iter().enumerate() {
        let [from, to] = [view.from, view.to].map(|point| (point - origin).as_vec3());
        let camera = Camera::look_at(from, to, VIEW_ANGLE_RAD, aspect);
        cameras.push(NamedCamera {
            name: format!("view{}", index + 1),
            camera: camera.ok_or(LightCommandError::Camera {
                from: view.from,
                to: view.to,
            })?,
            is_outside: false,
        });
    }
    Ok(cameras)
}

fn default_cameras(
    lit: &LitScene<'_>,
    level: &Level,
    surroundings: &Surroundings<'_>,
    aspect: f32,
) -> Vec<NamedCamera> {
    let mut places: Vec<Vec3> = lit.lamps.iter().filter_map(position).collect();
    if places.is_empty() {
        // The sun has no place, and surfaces that shine may be anywhere.
        let free = light_places(surroundings, level, DEFAULT_VIEWS);
        places.extend(free.iter().map(|place| place.position));
    }
    let mut cameras = Vec::new();
    for (index, place) in places.into_iter().take(DEFAULT_VIEWS).enumerate() {
        let camera = camera_at_light(surroundings, place, aspect);
        cameras.extend(camera.map(|camera| NamedCamera {
            name: format!("view{}", index + 1),
            camera,
            is_outside: false,
        }));
    }
    cameras.extend(overview(level, aspect).map(|camera| NamedCamera {
        name: "overview".to_owned(),
        camera,
        is_outside: true,
    }));
    cameras
}

fn photograph(args: &LightArgs, lit: &LitScene<'_>, named: NamedCamera) -> View {
    let [direct, indirect] = render(&named.camera, args.size, SAMPLES, |origin, direction| {
        let colours = lit.colours(origin, direction);
        [colours.direct, colours.indirect]
    });
    let pixels = direct.pixels.iter().zip(&indirect.pixels);
    let both = Picture {
        pixels: pixels.map(|(direct, indirect)| direct + indirect).collect(),
        ..direct
    };
    let exposure = match args.exposure {
        Exposure::Auto => auto_exposure(&[&both]),
        Exposure::Value(ev) => ev.exp2(),
    };
    View {
        name: named.name,
        pictures: [direct, indirect, both],
        exposure,
    }
}
