//! The light prior: a basis of plausible direct light in a shape (Loos et al. 2011, section 4), and
//! its enrichment (appendix A).

use crate::config::{Enrichment, PriorConfig};
use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::sphere_light::sphere_light_irradiance;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::ModeChoice;
use mrt_core::linalg::svd::{Svd, svd};
use mrt_runtime::blocks::Shape;

/// Columns `P S` (basis vectors of direct irradiance times their singular values), in the coordinates
/// of each parity class of the texels.
#[derive(Clone, Debug)]
pub struct ScaledBasis {
    /// One matrix a class: class dimension x vectors.
    pub classes: Vec<Matrix<f64>>,
}

/// A light prior with all its singular values, largest first.
#[derive(Clone, Debug)]
pub struct LightPrior {
    /// `P S`, cut to the configured number of vectors over all classes.
    pub basis: ScaledBasis,
    /// Singular values of the samples `L_d`.
    pub singular_values: Vec<f64>,
}

/// Centres of the sphere lights: a lattice at (i + 1) / (n + 1) inside the cube, and the same lattice
/// in the cell beyond each opening, from where the light shines in.
pub fn prior_lights(shape: &Shape, per_axis: usize) -> Vec<DVec3> {
    let step = 1.0 / (per_axis + 1) as f64;
    let lattice: Vec<DVec3> = (0..per_axis * per_axis * per_axis)
        .map(|k| {
            let (x, rest) = (k % per_axis, k / per_axis);
            let (y, z) = (rest % per_axis, rest / per_axis);
            DVec3::new((x + 1) as f64, (y + 1) as f64, (z + 1) as f64) * step
        })
        .collect();
    let cells = std::iter::once(DVec3::ZERO).chain(shape.openings.iter().map(|o| o.face.outward()));
    cells
        .flat_map(|cell| lattice.iter().map(move |&p| p + cell))
        .collect()
}

/// The samples `L_d`: direct irradiance, texels x lights, from lights of unit intensity.
///
/// Every texel sees every light inside: the cube is convex. A light in the cell beyond an opening is seen
/// through it, and from a missing face wholly. Texels in holes stay dark.
pub fn direct_samples(shape: &Shape, resolution: usize, config: &PriorConfig) -> Matrix<f64> {
    let texels: Vec<(Face, DVec3)> = shape.texels(resolution).collect();
    let lights = prior_lights(shape, config.lights_per_axis);
    Matrix::from_fn(texels.len(), lights.len(), |texel, light| {
        let (face, point) = texels[texel];
        if shape.is_in_hole(face, point) || !is_seen(shape, point, lights[light]) {
            return 0.0;
        }
        sphere_light_irradiance(lights[light] - point, -face.outward(), config.light_radius)
    })
}

/// True if no wall is between a texel and a light in the shape or in the cell beyond an opening.
fn is_seen(shape: &Shape, point: DVec3, light: DVec3) -> bool {
    let outside = |face: Face| {
        let along = light[face.axis()];
        if face.is_positive() {
            along > 1.0
        } else {
            along < 0.0
        }
    };
    let Some(face) = Face::ALL.into_iter().find(|&face| outside(face)) else {
        return true;
    };
    let plane = if face.is_positive() { 1.0 } else { 0.0 };
    let t = (plane - point[face.axis()]) / (light[face.axis()] - point[face.axis()]);
    let at = point + (light - point) * t;
    shape.is_open(face) || shape.is_in_hole(face, at)
}

/// Decomposes the samples and keeps the `k_d` largest vectors.
pub fn light_prior(samples: &Matrix<f64>, classes: &ParityClasses, k_d: usize) -> LightPrior {
    let folded: Vec<Matrix<f64>> = (0..classes.class_count())
        .map(|class| classes.fold_columns(class, samples))
        .collect();
    decompose(&folded, k_d)
}

/// Appendix A: the prior, functions that are constant on one wall, and the indirect light basis `U_b`,
/// each scaled to its weight in Frobenius norm, put side by side and decomposed again.
///
/// The first keeps what the prior had, the second follows shadows and differing albedos, the third what
/// indirect light looks like when it becomes the direct light of the next bounce. To the paper's three we
/// add uniform light with a large weight, so that the bases hold it exactly: it is what many bounces tend
/// to, and an error in it is an error in the level's energy.
pub fn enriched_prior(
    prior: &LightPrior,
    indirect_basis: &Matrix<f64>,
    shape: &Shape,
    classes: &ParityClasses,
    config: &Enrichment,
) -> LightPrior {
    let roots = vec![1.0; classes.point_count()];
    enriched_weighted_prior(
        prior,
        indirect_basis,
        shape.wall_count(),
        &roots,
        classes,
        config,
    )
}

/// [`enriched_prior`] for a prior and an indirect basis that are weighted by the texels' `roots` (of area, over the
/// mean), on so many walls of equally many texels.
pub fn enriched_weighted_prior(
    prior: &LightPrior,
    indirect_basis: &Matrix<f64>,
    walls: usize,
    roots: &[f64],
    classes: &ParityClasses,
    config: &Enrichment,
) -> LightPrior {
    let per_wall = classes.point_count() / walls.max(1);
    let constants = Matrix::from_fn(classes.point_count(), walls, |texel, wall| {
        if texel / per_wall == wall {
            roots[texel]
        } else {
            0.0
        }
    });
    let uniform = Matrix::from_fn(classes.point_count(), 1, |texel, _| roots[texel]);
    let parts: Vec<(f64, Vec<Matrix<f64>>)> = vec![
        (1.0, prior.basis.classes.clone()),
        (config.uniform_weight, fold_all(classes, &uniform)),
        (config.constant_weight, fold_all(classes, &constants)),
        (config.indirect_weight, fold_all(classes, indirect_basis)),
    ];
    let stacked: Vec<Matrix<f64>> = (0..classes.class_count())
        .map(|class| {
            let mut columns: Vec<Vec<f64>> = Vec::new();
            for (weight, part) in &parts {
                let norm = root_sum_of_squares(part.iter().map(Matrix::frobenius_norm));
                for j in 0..part[class].columns() {
                    let scale = weight / norm;
                    columns.push(part[class].column(j).iter().map(|x| x * scale).collect());
                }
            }
            Matrix::from_columns(classes.dimension(class), &columns)
        })
        .collect();
    decompose(&stacked, usize::MAX)
}

fn fold_all(classes: &ParityClasses, signals: &Matrix<f64>) -> Vec<Matrix<f64>> {
    (0..classes.class_count())
        .map(|class| classes.fold_columns(class, signals))
        .collect()
}

/// Norm of a matrix from the norms of its parts.
pub(crate) fn root_sum_of_squares(norms: impl Iterator<Item = f64>) -> f64 {
    norms.map(|norm| norm * norm).sum::<f64>().sqrt()
}

/// Left singular vectors times singular values, class by class, keeping at most the `keep` largest overall:
/// whole multiplets that are not lost in rounding.
fn decompose(folded: &[Matrix<f64>], keep: usize) -> LightPrior {
    let parts: Vec<Svd> = folded.iter().map(|m| svd(m.view())).collect();
    let choice = ModeChoice::largest(parts.iter().map(|part| &part.singular_values[..]), keep);
    let classes = parts
        .iter()
        .enumerate()
        .map(|(class, part)| {
            let count = choice.count_of_class(class);
            let scales = &part.singular_values[..count];
            part.u.leading_columns(count).scaled_columns(scales)
        })
        .collect();
    LightPrior {
        basis: ScaledBasis { classes },
        singular_values: choice.singular_values,
    }
}
