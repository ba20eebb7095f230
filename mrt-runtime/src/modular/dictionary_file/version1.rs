//! Reads dictionary files of version 1, whose operators are those of the paper.
//!
//! Version 1 has no path table, and one response basis for all openings instead of a joint basis for each shape. It
//! becomes a special case of version 2. Lightfield modes serve as emission modes, and `R_b->rlf` as emission. The
//! columns of a joint basis are those of `U_b`, then, for each opening, those of `U_r` turned to the walls behind that
//! opening; each response is a joint coefficient. Scenes are lit by lightfields, with the products of version 1.
//!
//! Sections: `preset`, `settings`, `sizes` (resolution, shapes, lightfield modes, response modes), `left`,
//! `straight`, `right`, `T_rlf_r`, `U_r` (on the five walls of the cube open at -z), `dropped` (of lightfield and
//! response modes); for shape n `n.name`, `n.sigma`, `n.T_d_b`, `n.U_b`, `n.L_imp`, `n.drop` and one `n.R<m>` an
//! opening. All numbers are F32. Shapes open sideways only.

use crate::level::shape::{Outline, SHAPES, Shape};
use crate::modular::dictionary::{
    LightfieldOperators, OpeningOperators, OperatorKind, OperatorMatrix, PathTable, ShapeOperators,
    StoredDictionary,
};
use crate::modular::dictionary_file::format::{
    DictionaryError, MAX_MODES, MAX_RESOLUTION, Source, check_size, known_shape,
};
use crate::modular::path::frame_of_heading;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::storage::{Storage, StoredMatrix};

/// Number of shapes that version 1 has: the first ones of [`SHAPES`].
const SHAPE_COUNT: usize = 6;

pub(super) fn read<'a>(
    source: &mut Source<'a, '_, '_>,
) -> Result<StoredDictionary<'a>, DictionaryError> {
    let [resolution, shape_count, fields, responses] = source.sizes("sizes")?;
    check_size("resolution", resolution, 1, MAX_RESOLUTION)?;
    check_size("number of shapes", shape_count, 1, SHAPE_COUNT)?;
    check_size("number of lightfield modes", fields, 1, MAX_MODES)?;
    check_size("number of response modes", responses, 1, MAX_MODES)?;
    let receiver_texels = 5 * resolution * resolution;
    let kind = OperatorKind::Lightfield;
    let dropped = source.numbers("dropped", 2)?;
    let left = source.matrix(kind, "left", [fields, fields])?;
    let right = source.matrix(kind, "right", [fields, fields])?;
    let identity = source.owned(kind, fields, fields, |i, j| if i == j { 1.0 } else { 0.0 })?;
    let lightfields = LightfieldOperators {
        parity: mirror_parity(&left, &right)?,
        from_emission: identity,
        straight: source.matrix(kind, "straight", [fields, fields])?,
        left,
        exchange: StoredMatrix::empty(0, fields),
        holes: Vec::new(),
        response_from_lightfield: source.matrix(kind, "T_rlf_r", [responses, fields])?,
        dropped_energy: dropped[0],
    };
    let response_basis = source.matrix(
        OperatorKind::ResponseSource,
        "U_r",
        [receiver_texels, responses],
    )?;
    let mut shapes: Vec<ShapeOperators<StoredMatrix>> = Vec::with_capacity(shape_count);
    for index in 0..shape_count {
        let entry = read_shape(source, index, resolution, fields, &response_basis)?;
        if shapes.iter().any(|other| other.shape == entry.shape) {
            return Err(DictionaryError::ShapeTwice {
                found: entry.shape.name,
            });
        }
        shapes.push(entry);
    }
    Ok(StoredDictionary {
        preset: source.owned_text("preset")?,
        settings: source.owned_text("settings")?,
        resolution,
        probes: 0,
        shapes,
        lightfields,
        paths: PathTable {
            // Only path tables and shapes that open upwards use these.
            emission_parity: vec![0; fields],
            response_parity: vec![0; responses],
            depth: 0,
            hole_depth: 0,
            entries: Vec::new(),
            emission_dropped_energy: 0.0,
            response_dropped_energy: dropped[1],
        },
        variants: Vec::new(),
        sources: None,
    })
}

impl<'a> Source<'a, '_, '_> {
    /// A matrix that is not in the file.
    fn owned(
        &mut self,
        kind: OperatorKind,
        rows: usize,
        columns: usize,
        f: impl FnMut(usize, usize) -> f32,
    ) -> Result<StoredMatrix<'a>, DictionaryError> {
        // The matrix exists twice meanwhile: as `f32`, and as stored.
        let bytes = 2 * size_of::<f32>() as u64 * rows as u64 * columns as u64;
        self.budget.spend("operators of version 1", bytes)?;
        let matrix = Matrix::from_fn(rows, columns, f);
        Ok(StoredMatrix::encode(&matrix, Storage::F32, kind.modes()))
    }
}

/// Parity of each mode in x. The mirror turns `left` into `right`: right = D left D, with the signs D of the modes.
///
/// If no sequence of nonzero elements connects two modes, their relative sign is undetermined, and changes no product.
fn mirror_parity(left: &StoredMatrix, right: &StoredMatrix) -> Result<Vec<u8>, DictionaryError> {
    let modes = left.rows();
    let mut parity: Vec<Option<u8>> = vec![None; modes];
    for root in 0..modes {
        if parity[root].is_some() {
            continue;
        }
        parity[root] = Some(0);
        let mut reached = vec![root];
        while let Some(i) = reached.pop() {
            let own = parity[i].unwrap_or(0);
            for (j, other) in parity.iter_mut().enumerate().filter(|(_, p)| p.is_none()) {
                let pairs = [(i, j), (j, i)].map(|(r, c)| (left.get(r, c), right.get(r, c)));
                if let Some((l, r)) = pairs.into_iter().find(|(l, _)| *l != 0.0) {
                    *other = Some(own ^ u8::from((l < 0.0) != (r < 0.0)));
                    reached.push(j);
                }
            }
        }
    }
    let parity: Vec<u8> = parity.into_iter().map(|p| p.unwrap_or(0)).collect();
    for column in 0..modes {
        for row in 0..modes {
            let l = left.get(row, column);
            let expected = if parity[row] == parity[column] { l } else { -l };
            let found = right.get(row, column);
            if found != expected {
                return Err(DictionaryError::NotMirrored {
                    row,
                    column,
                    expected,
                    found,
                });
            }
        }
    }
    Ok(parity)
}

fn read_shape<'a>(
    source: &mut Source<'a, '_, '_>,
    index: usize,
    resolution: usize,
    fields: usize,
    response_basis: &StoredMatrix,
) -> Result<ShapeOperators<StoredMatrix<'a>>, DictionaryError> {
    let section = |suffix: &str| format!("{index}.{suffix}");
    let shape = known_shape(index, source.container.text(&section("name"))?)?;
    // Shapes that were added later are unknown in version 1.
    if !opens_sideways(shape) {
        let names: Vec<&str> = SHAPES[..SHAPE_COUNT].iter().map(|s| s.name).collect();
        return Err(DictionaryError::UnknownShape {
            index,
            expected: names.join(", "),
            found: shape.name.to_owned(),
        });
    }
    let modes = source.container.element_count(&section("sigma"))?;
    check_size("number of modes", modes, 1, MAX_MODES)?;
    let texels = shape.texel_count(resolution);
    let responses = response_basis.columns();
    let joint_modes = modes + shape.openings.len() * responses;
    let own = source.matrix(OperatorKind::JointBasis, &section("U_b"), [texels, modes])?;
    let joint_basis = joint_basis(source, shape, resolution, &own, response_basis)?;
    let mut openings = Vec::with_capacity(shape.openings.len());
    for m in 0..shape.openings.len() {
        let first = modes + m * responses;
        openings.push(OpeningOperators {
            emission_from_coefficients: vec![source.matrix(
                OperatorKind::Emission,
                &section(&format!("R{m}")),
                [fields, modes],
            )?],
            joint_from_response: vec![source.owned(
                OperatorKind::JointFromResponse,
                joint_modes,
                responses,
                |i, j| if i == first + j { 1.0 } else { 0.0 },
            )?],
        });
    }
    Ok(ShapeOperators {
        shape,
        coefficients_from_direct: source.matrix(
            OperatorKind::CoefficientsFromDirect,
            &section("T_d_b"),
            [modes, texels],
        )?,
        joint_basis,
        probe_basis: StoredMatrix::empty(0, joint_modes),
        vector_basis: StoredMatrix::empty(0, joint_modes),
        openings,
        implicit_lighting: source.matrix(
            OperatorKind::ImplicitLighting,
            &section("L_imp"),
            [texels, modes],
        )?,
        singular_values: source.numbers(&section("sigma"), modes)?,
        dropped_energy: source.numbers(&section("drop"), 1)?[0],
        // Nothing is dropped by projection: each response is a joint coefficient.
        joint_dropped_energy: 0.0,
    })
}

/// Columns of `U_b`, then for each opening those of `U_r` as light through it meets the walls.
fn joint_basis<'a>(
    source: &mut Source<'a, '_, '_>,
    shape: &Shape,
    resolution: usize,
    own: &StoredMatrix,
    response_basis: &StoredMatrix,
) -> Result<StoredMatrix<'a>, DictionaryError> {
    let (modes, responses) = (own.columns(), response_basis.columns());
    let rows: Vec<Vec<usize>> = shape
        .openings
        .iter()
        .map(|opening| receiver_texels(shape, opening.face, resolution))
        .collect();
    let columns = modes + shape.openings.len() * responses;
    let kind = OperatorKind::JointBasis;
    source.owned(kind, own.rows(), columns, |i, j| {
        match j.checked_sub(modes) {
            None => own.get(i, j),
            Some(k) => response_basis.get(rows[k / responses][i], k % responses),
        }
    })
}

fn opens_sideways(shape: &Shape) -> bool {
    let mut openings = shape.openings.iter();
    openings.all(|opening| opening.outline == Outline::Whole && opening.face.axis() != 1)
}

/// For each texel of a shape, its row of `U_r` for light that enters by a face. The rows of `U_r` are texels of the
/// cube that is open at -z, which is turned about +Y.
fn receiver_texels(shape: &Shape, entered: Face, resolution: usize) -> Vec<usize> {
    let canonical: CubeSymmetry = frame_of_heading(entered.opposite()).inverse();
    shape
        .texels(resolution)
        .map(|(face, point)| {
            let (face, point) = (canonical.face(face), canonical.point(point));
            let wall = face.index() - usize::from(face > Face::NegZ);
            wall * resolution * resolution + face.texel_index(point, resolution)
        })
        .collect()
}
