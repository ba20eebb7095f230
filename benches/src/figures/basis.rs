//! The first modes of the closed cube, unfolded (the paper's figure 2): implicit lights and the indirect light
//! that they make.

use super::{FigureError, Setting};
use crate::canvas::{Area, Canvas, Lettering, RULE, Side, diverging};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_runtime::blocks::SHAPES;

/// Modes shown, in rows of [`MODES_A_ROW`].
const MODES: usize = 8;
const MODES_A_ROW: usize = 4;
/// Pixels of a face.
const FACE: i32 = 50;
const NET: [i32; 2] = [4 * FACE, 3 * FACE];
const GAP: i32 = 22;
const LEFT: i32 = 96;
const TOP: i32 = 92;
/// Pixels from one row of modes to the next: two nets, the labels, a gap.
const ROW: i32 = 2 * NET[1] + 58;

/// Faces of the unfolded cube as seen from inside looking at -z: column and row from the top left.
const PLACES: [(Face, [i32; 2]); 6] = [
    (Face::NegX, [0, 1]),
    (Face::PosX, [2, 1]),
    (Face::NegY, [1, 2]),
    (Face::PosY, [1, 0]),
    (Face::NegZ, [1, 1]),
    (Face::PosZ, [3, 1]),
];

pub(super) fn draw(setting: &Setting) -> Result<Canvas, FigureError> {
    let missing = |missing| FigureError::NotInDictionary { missing };
    let dictionary = setting.dictionary;
    let index = dictionary
        .shape_index(&SHAPES[0])
        .ok_or(missing("closed cube"))?;
    let entry = &dictionary.shapes[index];
    if entry.implicit_lighting.columns() == 0 {
        return Err(missing("implicit lighting"));
    }
    let rows = (MODES / MODES_A_ROW) as i32;
    let width = LEFT + MODES_A_ROW as i32 * (NET[0] + GAP) + 10;
    let mut canvas = Canvas::titled(
        [width, TOP + rows * ROW + 16],
        "The first modes of a closed cube, unfolded",
        &[
            "Lights on the walls (above) and the indirect light that they make (below). A block's indirect light is a sum",
            "of such patterns; a frame computes their weights, one number each. Numbers: strength relative to mode 2.",
        ],
    );
    // Enrichment makes the first mode, uniform light, as strong as it likes: the second is the measure.
    let measure = entry.singular_values.get(1).copied().unwrap_or(1.0);
    for mode in 0..MODES.min(entry.modes()) {
        let (row, column) = ((mode / MODES_A_ROW) as i32, (mode % MODES_A_ROW) as i32);
        let [x, y] = [LEFT + column * (NET[0] + GAP), TOP + row * ROW];
        let label = match entry.singular_values[mode] / measure {
            _ if mode == 0 => "mode 1 (even light)".to_owned(),
            strength => format!("mode {}: {strength:.2}", mode + 1),
        };
        canvas.text([x, y], Side::Right, Lettering::Heading, &label);
        let resolution = dictionary.resolution;
        let light = entry.implicit_lighting.column(mode);
        let indirect = entry.joint_basis.column(mode);
        unfold(&mut canvas, [x, y + 12], resolution, light);
        unfold(&mut canvas, [x, y + 20 + NET[1]], resolution, indirect);
        if column == 0 {
            for (lines, y) in [
                (["implicit", "light", "L_imp"], y + 12),
                (["indirect", "light", "U_b"], y + 20 + NET[1]),
            ] {
                for (k, line) in lines.into_iter().enumerate() {
                    let y = y + NET[1] / 2 + 16 * (k as i32 - 1);
                    canvas.text([LEFT - 12, y], Side::Left, Lettering::Label, line);
                }
            }
        }
    }
    draw_key(&mut canvas, [LEFT, TOP + rows * ROW - 8]);
    Ok(canvas)
}

/// A signal on the walls of the closed cube as a cross of its faces, each from inside.
fn unfold(canvas: &mut Canvas, [x, y]: [i32; 2], resolution: usize, signal: &[f32]) {
    let largest = signal.iter().fold(0.0f32, |sum, x| sum.max(x.abs()));
    let per_wall = resolution * resolution;
    for (face, [column, row]) in PLACES {
        let area = Area {
            x: x + column * FACE,
            y: y + row * FACE,
            width: FACE - 1,
            height: FACE - 1,
        };
        canvas.outline(area, RULE);
        for j in 0..area.height {
            for i in 0..area.width {
                let place = |k: i32| (f64::from(k) + 0.5) / f64::from(FACE - 1);
                let unit = on_face(face, place(i), 1.0 - place(j));
                let texel = face.index() * per_wall + face.texel_index(unit, resolution);
                let value = f64::from(signal[texel] / largest.max(f32::MIN_POSITIVE));
                canvas.set(area.x + i, area.y + j, diverging(value));
            }
        }
    }
}

/// The point of the unit cube that lies `right` and `up` on an unfolded face.
fn on_face(face: Face, right: f64, up: f64) -> DVec3 {
    match face {
        Face::NegZ => DVec3::new(right, up, 0.0),
        Face::NegX => DVec3::new(0.0, up, 1.0 - right),
        Face::PosX => DVec3::new(1.0, up, right),
        Face::PosZ => DVec3::new(1.0 - right, up, 1.0),
        Face::PosY => DVec3::new(right, 1.0, up),
        Face::NegY => DVec3::new(right, 0.0, 1.0 - up),
    }
}

fn draw_key(canvas: &mut Canvas, [x, y]: [i32; 2]) {
    const WIDTH: i32 = 180;
    for i in 0..WIDTH {
        let value = 2.0 * f64::from(i) / f64::from(WIDTH - 1) - 1.0;
        let column = Area {
            x: x + 76 + i,
            y: y - 7,
            width: 1,
            height: 14,
        };
        canvas.fill(column, diverging(value));
    }
    canvas.text([x + 70, y], Side::Left, Lettering::Label, "negative");
    canvas.text(
        [x + 76 + WIDTH + 6, y],
        Side::Right,
        Lettering::Label,
        "positive",
    );
    canvas.text(
        [x + 76 + WIDTH + 90, y],
        Side::Right,
        Lettering::Remark,
        "each pattern scaled to its largest value; white is zero",
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_that_touch_in_the_net_touch_in_the_cube() {
        let at = |k: f64| {
            [
                (on_face(Face::NegX, 1.0, k), on_face(Face::NegZ, 0.0, k)),
                (on_face(Face::NegZ, 1.0, k), on_face(Face::PosX, 0.0, k)),
                (on_face(Face::PosX, 1.0, k), on_face(Face::PosZ, 0.0, k)),
                (on_face(Face::NegZ, k, 1.0), on_face(Face::PosY, k, 0.0)),
                (on_face(Face::NegZ, k, 0.0), on_face(Face::NegY, k, 1.0)),
            ]
        };
        for (a, b) in [0.0, 0.3, 1.0].into_iter().flat_map(at) {
            assert_eq!(a, b);
        }
    }
}
