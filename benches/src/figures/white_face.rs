//! A red box with one white wall (the paper's figure 13): whether bounced light keeps its colour.

use super::room::{ClosedCube, MODES, OpenBox, box_of, exact, radiance, reduced, spread};
use super::{FigureError, Setting};
use crate::canvas::{Canvas, Lettering, Side};
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::reference::radiosity::direct::PointLight;
use mrt_core::reference::radiosity::{ExactScene, Side as Beyond};
use mrt_dictionary::config::PriorConfig;
use mrt_editor::render::camera::Camera;
use mrt_editor::render::tone::auto_exposure;

const RED: [f64; 3] = [0.6, 0.05, 0.05];
const WHITE: [f64; 3] = [0.8; 3];
const WHITE_FACE: Face = Face::NegZ;
const LAMP: DVec3 = DVec3::new(0.55, 0.5, 0.4);
const BOUNCES: usize = 10;
const PANEL: usize = 280;
/// Auto exposure goes by luminance, of which red has little, and would leave red without shades.
const EXPOSURE: f32 = 0.5;

pub(super) fn draw(setting: &Setting) -> Result<Canvas, FigureError> {
    let resolution = setting.resolution;
    let cube = ClosedCube::new(resolution)?;
    let mut walls = [RED; 6];
    walls[WHITE_FACE.index()] = WHITE;
    let albedo = spread(walls, resolution);
    let light = PointLight {
        position: LAMP,
        intensity: 1.0,
        radius: PriorConfig::default().light_radius,
    };
    let scene = ExactScene::new(
        vec![box_of(DVec3::ONE)],
        vec![[Beyond::Wall; 6]],
        resolution,
    )?;
    let direct = mrt_core::reference::radiosity::direct::direct(&scene, &light);
    let truth = exact(box_of(DVec3::ONE), resolution, &light, &albedo, BOUNCES)?;
    let found = [&cube.enriched, &cube.plain].map(|transport| {
        let operators = [
            &transport.coefficients_from_direct,
            &transport.indirect_basis,
        ];
        reduced(operators, &direct, &albedo, BOUNCES)
    });
    let columns = [
        ("exact", &truth),
        ("with enrichment", &found[0]),
        ("without enrichment", &found[1]),
    ];
    let panel = PANEL as i32;
    let (left, top, step) = (20, 96, [panel + 16, panel + 42]);
    let mut canvas = Canvas::titled(
        [3 * step[0] + 24, top + 2 * step[1] - 22],
        "A red box with one white wall, under a white lamp",
        &[
            &format!(
                "{BOUNCES} bounces; {MODES} modes, which do not know colours: they have to tell light from one wall from that of"
            ),
            "the next. Enrichment adds such light to what the modes are chosen for (the paper's appendix A).",
        ],
    );
    let camera = Camera::look_at(
        Vec3::new(0.5, 0.5, 2.38),
        Vec3::new(0.5, 0.5, 0.5),
        0.70,
        1.0,
    );
    let Some(camera) = camera else {
        return Ok(canvas);
    };
    for row in 0..2 {
        let y = top + row * step[1];
        let pictures = columns.map(|(_, indirect)| {
            let irradiance: Vec<[f64; 3]> = indirect
                .iter()
                .zip(&direct)
                .map(|(rgb, d)| rgb.map(|e| e + if row == 0 { *d } else { 0.0 }))
                .collect();
            let radiance = radiance(&albedo, &irradiance);
            let room = OpenBox {
                size: DVec3::ONE,
                open: Face::PosZ,
                resolution,
                radiance: &radiance,
            };
            room.picture(&camera, [PANEL; 2])
        });
        let exposure = EXPOSURE * auto_exposure(&[&pictures[0][0]]);
        for (column, ([picture, shown], (label, signal))) in
            pictures.iter().zip(columns).enumerate()
        {
            let x = left + column as i32 * step[0];
            let text = match (row, column) {
                (0, 0) => "exact: direct and indirect light".to_owned(),
                (0, _) => label.to_owned(),
                (_, 0) => "exact: indirect light only".to_owned(),
                _ => {
                    let [all, wall] = errors(signal, &truth, resolution);
                    format!("error {all:.1} %, white wall {wall:.1} %")
                }
            };
            canvas.text([x, y - 12], Side::Right, Lettering::Label, &text);
            canvas.picture([x, y], picture, shown, exposure);
        }
    }
    Ok(canvas)
}

/// Relative L2 of indirect irradiance over all channels, %: of the box, and of the white wall.
fn errors(found: &[[f64; 3]], truth: &[[f64; 3]], resolution: usize) -> [f64; 2] {
    let per_wall = resolution * resolution;
    let white = WHITE_FACE.index() * per_wall..(WHITE_FACE.index() + 1) * per_wall;
    [0..truth.len(), white].map(|range| {
        let error = mrt_core::reference::error_measure::rel_l2(
            found[range.clone()].as_flattened(),
            truth[range].as_flattened(),
        );
        100.0 * error
    })
}
