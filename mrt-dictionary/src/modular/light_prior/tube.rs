//! Direct light in the tubes: the lights of the prior, their irradiance with shadows, and the area weights
//! of the texels (Loos et al. 2011, sections 4 and 6.1).

use crate::modular::one_bounce::tube::{TubeTexel, tube_texels};
use crate::modular::transport::modes::BlockTransport;
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::tube::{TUBE_RADIUS, TubeForm};
use mrt_core::lighting::sampling::{cell_center, disk_from_square};
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;

/// A light of the prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeLight {
    /// Centre, in the unit cube's coordinates.
    pub position: DVec3,
    /// The opening beyond which it lies, in a straight tube attached there; `None` inside.
    pub beyond: Option<Face>,
}

/// Sphere lights in a tube and in a straight tube attached to each opening, `per_axis`³ in each.
///
/// The lattice is that of the cubes, at (i + 1) / (n + 1), with one axis laid along the tube and the other
/// two carried to its section by the concentric map. All lights are kept, none is nearer to the wall than
/// R times 2 / (n + 1) (0.114 for n = 6), and the lattice has every mirror of the tube. Filtering a cubic
/// lattice instead would leave a ragged edge at the wall.
pub fn tube_prior_lights(form: TubeForm, per_axis: usize) -> Vec<TubeLight> {
    lattice(form, per_axis)
        .into_iter()
        .map(|(light, _)| light)
        .collect()
}

/// Place of a light in its lattice: cell (0 inside, 1 and 2 beyond the openings), index along, row, column.
type Place = [usize; 4];

fn lattice(form: TubeForm, per_axis: usize) -> Vec<(TubeLight, Place)> {
    let n = per_axis;
    let openings = form.openings();
    let mut lights = Vec::with_capacity(3 * n * n * n);
    for cell in 0..3usize {
        let beyond = cell.checked_sub(1).map(|k| openings[k]);
        for i in 0..n {
            let along = (i + 1) as f64 / (n + 1) as f64;
            for row in 0..n {
                for column in 0..n {
                    // Centres of n cells lie at (k + 1/2) / n; those of the lattice at (k + 1) / (n + 1).
                    let square = cell_center(n, row, column) * (n as f64 / (n + 1) as f64);
                    let section = disk_from_square(square) * TUBE_RADIUS;
                    let position = match beyond {
                        Some(face) => beyond_opening(face, along, section),
                        None => form.point(along, section),
                    };
                    lights.push((TubeLight { position, beyond }, [cell, i, row, column]));
                }
            }
        }
    }
    lights
}

fn beyond_opening(face: Face, along: f64, section: DVec2) -> DVec3 {
    let mut point = face.point(0.5, 0.5) + face.outward() * along;
    point.y += section.y;
    // Both openings of either form are side faces, whose u runs horizontally.
    point[face.u_axis()] += section.x;
    point
}

/// Irradiance at a texel's centre from a sphere light of unit intensity, zero where the wall is in the way
/// of its centre.
pub fn tube_irradiance(
    form: TubeForm,
    texel: &TubeTexel,
    light: &TubeLight,
    light_radius: f64,
) -> f64 {
    let at = &texel.center;
    let irradiance = sphere_light_irradiance(light.position - at.position, at.normal, light_radius);
    if irradiance > 0.0 && sees(form, at.position, light) {
        irradiance
    } else {
        0.0
    }
}

fn sees(form: TubeForm, point: DVec3, light: &TubeLight) -> bool {
    let Some(face) = light.beyond else {
        return form.segment_is_free(point, light.position);
    };
    let plane = if face.is_positive() { 1.0 } else { 0.0 };
    let offset = light.position - point;
    let crossing = point + offset * ((plane - point[face.axis()]) / offset[face.axis()]);
    // The rest of the way is in a straight tube, which is convex.
    crossing.distance(face.point(0.5, 0.5)) < TUBE_RADIUS && form.segment_is_free(point, crossing)
}

/// The samples `L_d`, texels x lights, with one light for each orbit of the mirrors, scaled by the root of the
/// orbit's size.
///
/// In the coordinates of one parity class the lights of an orbit give the same column up to its sign, so
/// these few columns have the singular values and left vectors of all of them, for an eighth or a
/// quarter of the work. Only class by class: the columns of different classes are to be folded from this matrix
/// by [`crate::modular::light_prior::cube::light_prior`].
pub fn tube_direct_samples(
    form: TubeForm,
    resolution: usize,
    lights_per_axis: usize,
    light_radius: f64,
) -> Matrix<f64> {
    let texels = tube_texels(form, resolution);
    let lights = tube_prior_lights(form, lights_per_axis);
    let classes = light_parity_classes(form, lights_per_axis);
    let orbits: Vec<(TubeLight, f64)> = classes
        .orbits()
        .map(|orbit| (lights[orbit[0].0 as usize], (orbit.len() as f64).sqrt()))
        .collect();
    Matrix::from_fn(texels.len(), orbits.len(), |texel, k| {
        let (light, scale) = &orbits[k];
        scale * tube_irradiance(form, &texels[texel], light, light_radius)
    })
}

/// The mirrors of [`crate::modular::one_bounce::tube::tube_parity_classes`], acting on the lights.
fn light_parity_classes(form: TubeForm, per_axis: usize) -> ParityClasses {
    let lights = lattice(form, per_axis);
    let n = per_axis;
    let permutation = |image: &dyn Fn(Place) -> Place| -> Vec<u32> {
        let index = |[cell, i, row, column]: Place| ((cell * n + i) * n + row) * n + column;
        lights
            .iter()
            .map(|&(_, place)| index(image(place)) as u32)
            .collect()
    };
    let ends = permutation(&|[cell, i, row, column]| match cell {
        0 => [0, n - 1 - i, row, column],
        // Beyond the openings, i counts away from them.
        _ => [3 - cell, i, row, column],
    });
    let up = permutation(&|[cell, i, row, column]| [cell, i, n - 1 - row, column]);
    match form {
        TubeForm::Straight => {
            let across = permutation(&|[cell, i, row, column]| [cell, i, row, n - 1 - column]);
            ParityClasses::new(lights.len(), &[ends, up, across])
        }
        TubeForm::Bend => ParityClasses::new(lights.len(), &[up, ends]),
    }
}

/// Area weights of a tube's texels.
///
/// A texel at the inner side of a bend has a ninth of the area of one at the outer side. Errors are to count
/// by area, so decompositions run on signals times the root D of the texels' areas: F becomes D F D⁻¹,
/// samples D L_d, and the results come back through D⁻¹. D commutes with the mirrors. Cubes need none
/// of this, their texels being all of one size.
#[derive(Clone, Debug)]
pub struct AreaWeights {
    /// Root of each texel's area over the mean area.
    pub roots: Vec<f64>,
}

impl AreaWeights {
    /// The weights of a tube's texels.
    pub fn new(form: TubeForm, resolution: usize) -> Self {
        let mean = form.wall_area() / (4 * resolution * resolution) as f64;
        let texels = tube_texels(form, resolution);
        Self {
            roots: texels.iter().map(|t| (t.area / mean).sqrt()).collect(),
        }
    }

    /// D times signals (texels x columns).
    pub fn weigh(&self, signals: &Matrix<f64>) -> Matrix<f64> {
        Matrix::from_fn(signals.rows(), signals.columns(), |i, j| {
            self.roots[i] * signals[(i, j)]
        })
    }

    /// D⁻¹ times signals (texels x columns).
    pub fn unweigh(&self, signals: &Matrix<f64>) -> Matrix<f64> {
        Matrix::from_fn(signals.rows(), signals.columns(), |i, j| {
            signals[(i, j)] / self.roots[i]
        })
    }

    /// D F D⁻¹ for an operator on texels.
    pub fn weigh_operator(&self, operator: &Matrix<f64>) -> Matrix<f64> {
        Matrix::from_fn(operator.rows(), operator.columns(), |i, j| {
            self.roots[i] * operator[(i, j)] / self.roots[j]
        })
    }

    /// The operators of a block in terms of plain texel values, from those that
    /// [`crate::modular::transport::modes::block_transport`] gave for weighted F and prior.
    pub fn unweigh_transport(&self, weighted: BlockTransport) -> BlockTransport {
        let coefficients = &weighted.coefficients_from_direct;
        BlockTransport {
            indirect_basis: self.unweigh(&weighted.indirect_basis),
            coefficients_from_direct: coefficients.scaled_columns(&self.roots),
            implicit_lighting: self.unweigh(&weighted.implicit_lighting),
            singular_values: weighted.singular_values,
            dropped_energy: weighted.dropped_energy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::light_prior::cube::light_prior;
    use crate::modular::one_bounce::tube::{Parts, tube_bounce, tube_parity_classes};
    use crate::modular::transport::modes::{block_transport, fold_bounce};
    use crate::progress::Progress;
    use mrt_core::linalg::matrix::{multiply, transpose_multiply};
    use mrt_core::linalg::svd::svd;

    const RADIUS: f64 = 0.1;

    fn all_samples(form: TubeForm, resolution: usize, per_axis: usize) -> Matrix<f64> {
        let texels = tube_texels(form, resolution);
        let lights = tube_prior_lights(form, per_axis);
        Matrix::from_fn(texels.len(), lights.len(), |i, j| {
            tube_irradiance(form, &texels[i], &lights[j], RADIUS)
        })
    }

    #[test]
    fn lights_keep_their_radius_from_the_wall() {
        for form in TubeForm::ALL {
            let lights = tube_prior_lights(form, 6);
            assert_eq!(lights.len(), 3 * 216);
            for light in lights {
                match light.beyond {
                    None => {
                        assert!(form.contains(light.position));
                        assert!(form.wall_distance(light.position) > RADIUS);
                    }
                    Some(face) => {
                        let past = light.position - face.point(0.5, 0.5);
                        let along = past.dot(face.outward());
                        assert!(along > 0.0 && along < 1.0);
                        let across = past - face.outward() * along;
                        assert!(across.length() < TUBE_RADIUS - RADIUS);
                    }
                }
            }
        }
    }

    #[test]
    fn one_light_an_orbit_stands_for_all() {
        for form in TubeForm::ALL {
            let (resolution, per_axis) = (4, 3);
            let classes = tube_parity_classes(form, resolution);
            let few = tube_direct_samples(form, resolution, per_axis, RADIUS);
            let all = all_samples(form, resolution, per_axis);
            for class in 0..classes.class_count() {
                let values =
                    |m: &Matrix<f64>| svd(classes.fold_columns(class, m).view()).singular_values;
                let (few, all) = (values(&few), values(&all));
                // Positions of mirrored lights differ by rounding.
                for (k, &s) in all.iter().enumerate() {
                    let found = few.get(k).copied().unwrap_or(0.0);
                    assert!((found - s).abs() < 1e-10 * all[0], "{form:?} {class} {k}");
                }
            }
        }
    }

    #[test]
    fn what_is_lit_is_what_rays_reach() {
        for form in TubeForm::ALL {
            let (mut lit, mut shadowed) = (0, 0);
            for texel in tube_texels(form, 6) {
                for light in tube_prior_lights(form, 4) {
                    let offset = light.position - texel.center.position;
                    if texel.center.normal.dot(offset) <= 0.0 {
                        continue;
                    }
                    let hit = form.first_hit(texel.center.position, offset);
                    let reached = match light.beyond {
                        None => hit.distance >= 1.0,
                        Some(face) => hit.opening == Some(face),
                    };
                    assert_eq!(tube_irradiance(form, &texel, &light, RADIUS) > 0.0, reached);
                    lit += usize::from(reached);
                    shadowed += usize::from(!reached);
                }
            }
            // The straight tube and those attached to it are one convex region.
            match form {
                TubeForm::Straight => assert_eq!(shadowed, 0),
                // No light of the prior hugs the inner side: shadows are few.
                TubeForm::Bend => assert!(shadowed > 0 && shadowed < lit / 10),
            }
        }
    }

    #[test]
    fn weights_have_the_texels_mean_and_cancel() {
        let weights = AreaWeights::new(TubeForm::Bend, 8);
        let mean = weights.roots.iter().map(|r| r * r).sum::<f64>() / weights.roots.len() as f64;
        assert!((mean - 1.0).abs() < 1e-13);
        let straight = AreaWeights::new(TubeForm::Straight, 8);
        assert!(straight.roots.iter().all(|r| (r - 1.0).abs() < 1e-14));
    }

    /// The operators of a bend, weighted: all modes hold F on the prior's light, few of them nearly.
    #[test]
    fn reduced_transport_projects_by_area() {
        let (form, resolution) = (TubeForm::Bend, 8);
        let classes = tube_parity_classes(form, resolution);
        let weights = AreaWeights::new(form, resolution);
        let bounce = tube_bounce(form, resolution, Parts::STANDARD, &Progress::silent())
            .expect("nobody cancels");
        let samples = tube_direct_samples(form, resolution, 4, RADIUS);
        let prior = light_prior(&weights.weigh(&samples), &classes, usize::MAX);
        let folded = fold_bounce(&weights.weigh_operator(&bounce), &classes);
        let transport = |modes| {
            weights.unweigh_transport(block_transport(
                &folded,
                &folded,
                &prior.basis,
                &classes,
                modes,
            ))
        };
        let all = all_samples(form, resolution, 4);
        let exact = multiply(bounce.view(), all.view());
        let norm = |m: &Matrix<f64>| weights.weigh(m).frobenius_norm();
        let error = |transport: &BlockTransport| {
            let b = multiply(transport.coefficients_from_direct.view(), all.view());
            let found = multiply(transport.indirect_basis.view(), b.view());
            let difference = Matrix::from_fn(found.rows(), found.columns(), |i, j| {
                found[(i, j)] - exact[(i, j)]
            });
            norm(&difference) / norm(&exact)
        };
        assert!(error(&transport(usize::MAX)) < 1e-9);
        let reduced = transport(32);
        assert!(error(&reduced) < 0.02, "{}", error(&reduced));
        // U_b = F L_imp, and its columns are orthogonal by area.
        let made = multiply(bounce.view(), reduced.implicit_lighting.view());
        let weighted = weights.weigh(&reduced.indirect_basis);
        let gram = transpose_multiply(weighted.view(), weighted.view());
        for j in 0..gram.columns() {
            for i in 0..gram.rows() {
                let s = reduced.singular_values[j];
                let expected = if i == j { s * s } else { 0.0 };
                let scale = s * reduced.singular_values[i];
                assert!((gram[(i, j)] - expected).abs() < 1e-9 * scale);
            }
        }
        for (a, b) in made.data().iter().zip(reduced.indirect_basis.data()) {
            assert!((a - b).abs() < 1e-9 * reduced.singular_values[0]);
        }
    }
}
