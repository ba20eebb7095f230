//! A red box with one white wall (the paper's figure 13): whether bounced light keeps its colour.

use super::error::FigureError;
use super::room::{ClosedCube, MODES, OpenBox, box_of, exact, radiance, reduced, spread};
use super::source::FigureSource;
use crate::canvas::{Anchor, Canvas, Lettering};
use glam::{DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::reference::error_measure::rel_l2;
use mrt_core::reference::radiosity::direct::{PointLight, direct};
use mrt_core::reference::radiosity::{ExactScene, Side};
use mrt_dictionary::config::PriorConfig;
use mrt_editor::render::camera::Camera;
use mrt_editor::render::tone::auto_exposure;

const RED: [f64; 3] = [0.6, 0.05, 0.05];
const WHITE: [f64; 3] = [0.8; 3];
const WHITE_FACE: Face = Face::NegZ;
const LAMP: DVec3 = DVec3::new(0.55, 0.5, 0.4);
const BOUNCES: usize = 10;

/// Pixels along an edge of a picture, to the left of all and above them, and from one picture to the next.
const PANEL: usize = 280;
const LEFT: i32 = 20;
const TOP: i32 = 96;
const STEP: [i32; 2] = [PANEL as i32 + 16, PANEL as i32 + 42];

/// Auto exposure goes by luminance, of which red has little; by itself it would leave red without shades.
const EXPOSURE: f32 = 0.5;

pub(super) fn draw(source: &FigureSource) -> Result<Canvas, FigureError> {
    let room = LitRoom::solve(source.resolution)?;
    let mut canvas = Canvas::titled(
        [3 * STEP[0] + 24, TOP + 2 * STEP[1] - 22],
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
    if let Some(camera) = camera {
        draw_row(&mut canvas, TOP, &camera, &room, Shown::All);
        draw_row(&mut canvas, TOP + STEP[1], &camera, &room, Shown::Indirect);
    }
    Ok(canvas)
}

/// The box, solved in three ways.
struct LitRoom {
    resolution: usize,
    albedo: Vec<[f64; 3]>,
    direct: Vec<f64>,
    /// Indirect irradiance: exact, with enrichment, and without.
    indirect: [Vec<[f64; 3]>; 3],
}

impl LitRoom {
    fn solve(resolution: usize) -> Result<Self, FigureError> {
        let cube = ClosedCube::new(resolution)?;
        let mut walls = [RED; 6];
        walls[WHITE_FACE.index()] = WHITE;
        let albedo = spread(walls, resolution);
        let light = PointLight {
            position: LAMP,
            intensity: 1.0,
            radius: PriorConfig::default().light_radius,
        };
        let unit_box = box_of(DVec3::ONE);
        let scene = ExactScene::new(vec![unit_box], vec![[Side::Wall; 6]], resolution)?;
        let direct = direct(&scene, &light);
        let exact = exact(unit_box, resolution, &light, &albedo, BOUNCES)?;
        let [enriched, plain] = [&cube.enriched, &cube.plain].map(|transport| {
            let operators = [
                &transport.coefficients_from_direct,
                &transport.indirect_basis,
            ];
            reduced(operators, &direct, &albedo, BOUNCES)
        });
        Ok(Self {
            resolution,
            albedo,
            direct,
            indirect: [exact, enriched, plain],
        })
    }

    /// Relative L2 error of indirect irradiance over all channels, %: of the box, and of the white wall.
    fn errors(&self, way: usize) -> [f64; 2] {
        let [exact, ..] = &self.indirect;
        let per_wall = self.resolution * self.resolution;
        let white = WHITE_FACE.index() * per_wall..(WHITE_FACE.index() + 1) * per_wall;
        [0..exact.len(), white].map(|range| {
            let found = self.indirect[way][range.clone()].as_flattened();
            100.0 * rel_l2(found, exact[range].as_flattened())
        })
    }
}

/// Which light a row of pictures shows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Shown {
    All,
    Indirect,
}

/// The exact solution, with enrichment and without.
fn draw_row(canvas: &mut Canvas, y: i32, camera: &Camera, room: &LitRoom, shown: Shown) {
    let pictures = room.indirect.each_ref().map(|indirect| {
        let lights = indirect.iter().zip(&room.direct);
        let irradiance: Vec<[f64; 3]> = match shown {
            Shown::All => lights.map(|(rgb, d)| rgb.map(|e| e + d)).collect(),
            Shown::Indirect => indirect.clone(),
        };
        let inside = OpenBox {
            size: DVec3::ONE,
            open: Face::PosZ,
            resolution: room.resolution,
            radiance: &radiance(&room.albedo, &irradiance),
        };
        inside.picture(camera, [PANEL; 2])
    });
    let exposure = EXPOSURE * auto_exposure(&[&pictures[0][0]]);
    for (way, [picture, covered]) in pictures.iter().enumerate() {
        let x = LEFT + way as i32 * STEP[0];
        let label = label(room, shown, way);
        canvas.text([x, y - 12], Anchor::Start, Lettering::Label, &label);
        canvas.picture([x, y], picture, covered, exposure);
    }
}

fn label(room: &LitRoom, shown: Shown, way: usize) -> String {
    match (shown, way) {
        (Shown::All, 0) => "exact: direct and indirect light".to_owned(),
        (Shown::All, 1) => "with enrichment".to_owned(),
        (Shown::All, _) => "without enrichment".to_owned(),
        (Shown::Indirect, 0) => "exact: indirect light only".to_owned(),
        (Shown::Indirect, way) => {
            let [all, wall] = room.errors(way);
            format!("error {all:.1} %, white wall {wall:.1} %")
        }
    }
}
