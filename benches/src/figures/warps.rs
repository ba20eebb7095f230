//! Warped blocks: error against stretch, and a long hall (the paper's figure 12), by the three levels of transport that a
//! block may have.

use super::error::FigureError;
use super::plot::{Axis, Plot, Scale, Stroke, draw_legend};
use super::room::{ClosedCube, MODES, OpenBox, box_of, exact, radiance, reduced, spread};
use super::source::FigureSource;
use crate::canvas::{Anchor, Area, Canvas, Lettering, SERIES};
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::sampling::hash;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_core::reference::radiosity::direct::PointLight;
use mrt_dictionary::config::{Enrichment, PriorConfig};
use mrt_dictionary::modular::light_prior::warped::{
    warped_direct_samples, warped_light_radius, warped_prior_lights,
};
use mrt_dictionary::modular::one_bounce::warped::warped_bounce;
use mrt_dictionary::modular::surface::walls::warped::WarpedWalls;
use mrt_dictionary::modular::transport::warped::{RebuildConfig, rebuilt, regathered};
use mrt_editor::render::camera::Camera;
use mrt_editor::render::tone::auto_exposure;

/// The levels of transport.
const LEVELS: [&str; 3] = [
    "canonical operators as they are",
    "re-gathered on the warped walls",
    "rebuilt for the warped walls",
];
/// Lengths of boxes that are 1 high and 1 wide.
const STRETCHES: [f64; 8] = [1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0];
/// Lamps over which an error is the median.
const LIGHTS: u32 = 40;

/// The hall: a cube stretched along z, a lamp a tenth from its end.
const HALL: DVec3 = DVec3::new(1.0, 1.0, 4.0);
const HALL_LIGHT: DVec3 = DVec3::new(0.4, 0.55, 0.1);
const HALL_ALBEDO: [f64; 3] = [0.6; 3];
const HALL_BOUNCES: usize = 20;

/// Pixels of a picture of the hall, across and down, and from one to the next.
const STRIP: [usize; 2] = [800, 200];
const STRIP_STEP: i32 = STRIP[1] as i32 + 32;

pub(super) fn draw(source: &FigureSource) -> Result<Canvas, FigureError> {
    let cube = ClosedCube::new(source.resolution)?;
    let top = 430;
    let mut canvas = Canvas::titled(
        [900, top + 42 + 4 * STRIP_STEP],
        "Blocks that are not cubes",
        &[
            "First bounce in closed boxes of 1:1:a, against closed-form transport between their texels; median of 40 lamps.",
        ],
    );
    draw_errors(&mut canvas, source.resolution, &cube);
    canvas.text(
        [20, top + 6],
        Anchor::Start,
        Lettering::Heading,
        "A hall of 1:1:4, its lamp at the left end: indirect light only, one exposure",
    );
    draw_hall(&mut canvas, [50, top + 42], source.resolution, &cube)?;
    Ok(canvas)
}

/// A stretched closed block.
struct Stretched {
    walls: WarpedWalls,
    bounce: Matrix<f64>,
    /// T and U of each level of transport.
    levels: [[Matrix<f64>; 2]; 3],
    light_radius: f64,
}

impl Stretched {
    fn new(size: DVec3, cube: &ClosedCube, resolution: usize) -> Self {
        let walls = WarpedWalls::new(&Face::ALL, resolution, &box_of(size));
        let bounce = warped_bounce(&walls);
        let prior = PriorConfig::default();
        let light_radius = warped_light_radius(&walls, prior.light_radius);
        let lights = warped_prior_lights(&walls, &[], prior.lights_per_axis);
        let samples = warped_direct_samples(&walls, &lights, light_radius);
        let config = RebuildConfig {
            modes: MODES,
            enrichment: Some(Enrichment::default()),
        };
        let own = rebuilt(&walls, &bounce, &samples, &config);
        let gathered = regathered(&bounce, &cube.enriched.implicit_lighting);
        let coefficients = &cube.enriched.coefficients_from_direct;
        Self {
            levels: [
                [coefficients.clone(), cube.enriched.indirect_basis.clone()],
                [coefficients.clone(), gathered],
                [own.coefficients_from_direct, own.indirect_basis],
            ],
            walls,
            bounce,
            light_radius,
        }
    }

    /// For each level of transport, the median over lamps of the relative L2 error of the first bounce, weighted by area, %.
    fn errors(&self) -> [f64; 3] {
        let direct = warped_direct_samples(&self.walls, &lamps(), self.light_radius);
        let truth = multiply(self.bounce.view(), direct.view());
        [0, 1, 2].map(|level| {
            let [t, u] = &self.levels[level];
            let found = multiply(u.view(), multiply(t.view(), direct.view()).view());
            let mut errors: Vec<f64> = (0..truth.columns())
                .map(|j| relative(&self.walls.areas, found.column(j), truth.column(j)))
                .collect();
            errors.sort_by(f64::total_cmp);
            100.0 * errors[errors.len() / 2]
        })
    }
}

/// Random places in the unit cube, a tenth or more from every wall.
fn lamps() -> Vec<DVec3> {
    let random = |index| f64::from(hash(1, index)) / 4_294_967_296.0;
    (0..LIGHTS)
        .map(|k| DVec3::from_array([0, 1, 2].map(|axis| 0.1 + 0.8 * random(3 * k + axis))))
        .collect()
}

/// Relative L2 error, weighted by area.
fn relative(areas: &[f64], found: &[f64], truth: &[f64]) -> f64 {
    let (mut miss, mut size) = (0.0, 0.0);
    for ((f, t), area) in found.iter().zip(truth).zip(areas) {
        miss += (f - t) * (f - t) * area;
        size += t * t * area;
    }
    (miss / size).sqrt()
}

fn draw_errors(canvas: &mut Canvas, resolution: usize, cube: &ClosedCube) {
    let tick = |value: f64, name: String| (value, name);
    let plot = Plot {
        area: Area {
            x: 84,
            y: 88,
            width: 780,
            height: 270,
        },
        x: Axis {
            label: "length a of a box 1:1:a",
            scale: Scale::Logarithmic,
            range: [0.96, 5.2],
            ticks: STRETCHES.map(|a| tick(a, a.to_string())).into(),
        },
        y: Axis {
            label: "relative L2 error of irradiance",
            scale: Scale::Linear,
            range: [0.0, 65.0],
            ticks: [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
                .map(|e| tick(e, format!("{e} %")))
                .into(),
        },
    };
    plot.draw_axes(canvas);
    let measured =
        STRETCHES.map(|a| Stretched::new(DVec3::new(1.0, 1.0, a), cube, resolution).errors());
    let strokes = [SERIES[1], SERIES[4], SERIES[0]].map(|colour| Stroke {
        colour,
        is_dashed: false,
        mark: 4.0,
    });
    for (level, stroke) in strokes.into_iter().enumerate() {
        let points: Vec<[f64; 2]> = STRETCHES
            .into_iter()
            .zip(&measured)
            .map(|(a, errors)| [a, errors[level]])
            .collect();
        plot.draw_series(canvas, &points, stroke);
    }
    let legend: Vec<(Stroke, String)> = strokes
        .into_iter()
        .zip(LEVELS)
        .map(|(stroke, name)| (stroke, name.to_owned()))
        .collect();
    draw_legend(canvas, [plot.area.x + 30, plot.area.y + 20], &legend);
}

/// The hall as the exact solution and the three levels of transport light it, below one another.
fn draw_hall(
    canvas: &mut Canvas,
    [x, y]: [i32; 2],
    resolution: usize,
    cube: &ClosedCube,
) -> Result<(), FigureError> {
    let albedo = spread([HALL_ALBEDO; 6], resolution);
    let strips = strips(resolution, cube, &albedo)?;
    // From the side, the long wall x = 0 left out; the lit end is on the left.
    let middle = (0.5 * HALL).as_vec3();
    let aspect = STRIP[0] as f32 / STRIP[1] as f32;
    let camera = Camera::look_at(middle - Vec3::X * 4.2, middle, 0.27, aspect);
    let Some(camera) = camera else {
        return Ok(());
    };
    let photograph = |strip: &Strip| {
        let room = OpenBox {
            size: HALL,
            open: Face::NegX,
            resolution,
            radiance: &radiance(&albedo, &strip.irradiance),
        };
        room.picture(&camera, STRIP)
    };
    let pictures: Vec<_> = strips.iter().map(photograph).collect();
    let exposure = auto_exposure(&[&pictures[0][0]]);
    for (k, (strip, [picture, shown])) in (0..).zip(strips.iter().zip(&pictures)) {
        let y = y + k * STRIP_STEP;
        canvas.text([x, y - 12], Anchor::Start, Lettering::Label, &strip.name);
        canvas.picture([x, y], picture, shown, exposure);
    }
    Ok(())
}

/// The hall's indirect irradiance, by texel, and how it was found.
struct Strip {
    name: String,
    irradiance: Vec<[f64; 3]>,
}

fn strips(
    resolution: usize,
    cube: &ClosedCube,
    albedo: &[[f64; 3]],
) -> Result<Vec<Strip>, FigureError> {
    let hall = Stretched::new(HALL, cube, resolution);
    let light = PointLight {
        position: HALL_LIGHT * HALL,
        intensity: 1.0,
        radius: hall.light_radius,
    };
    let truth = exact(box_of(HALL), resolution, &light, albedo, HALL_BOUNCES)?;
    let direct = warped_direct_samples(&hall.walls, &[HALL_LIGHT], hall.light_radius);
    let green = |signal: &[[f64; 3]]| signal.iter().map(|rgb| rgb[1]).collect::<Vec<_>>();
    let found = hall.levels.iter().zip(LEVELS).map(|([t, u], name)| {
        let irradiance = reduced([t, u], direct.column(0), albedo, HALL_BOUNCES);
        let error = relative(&hall.walls.areas, &green(&irradiance), &green(&truth));
        Strip {
            name: format!("{name}: relative L2 error {:.0} %", 100.0 * error),
            irradiance,
        }
    });
    let found: Vec<Strip> = found.collect();
    let exact = Strip {
        name: "exact".to_owned(),
        irradiance: truth,
    };
    Ok(std::iter::once(exact).chain(found).collect())
}
