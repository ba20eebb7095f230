//! Reduced transport for a warped block (Loos et al. 2011, sections 6.2 and 8, figure 12), in three levels
//! of rising quality and cost:
//!
//! 1. the canonical shape's operators as they are;
//! 2. **re-gathered**: the canonical implicit lighting `L_imp` is placed on the warped walls, and whatever is
//!    gathered from it is gathered anew there: `U = F_warped L_imp`. The paper calls this "U-vector scaled";
//! 3. **rebuilt**: prior, F and decomposition on the warped walls ("both scaled").
//!
//! Between the last two lies the best fit of coefficients to re-gathered vectors. It needs operators of its
//! own as a rebuild does, and gives 22 % where that gives 10 (a box 1:1:5), so it is not offered.
//!
//! Texels of a warped block differ in area, and squared errors are to be counted by area. So decompositions
//! run on signals times the root of the texel's area. F between such signals is symmetric but for
//! discretisation, and everything of [`crate::modular::transport::modes`] applies as it stands.

use crate::config::Enrichment;
use crate::modular::one_bounce::warped::WarpedWalls;
use crate::modular::surface::warped_mirrors::warped_parity_classes;
use crate::modular::transport::modes::{BlockTransport, fold_bounce};
use crate::parallel_products::parallel_multiply;
use mrt_core::linalg::matrix::{Matrix, dot};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{ModeChoice, ParityMode, Snapshots, combined_columns};
use rayon::prelude::*;

/// What a rebuild is free to choose.
#[derive(Clone, Debug, PartialEq)]
pub struct RebuildConfig {
    /// Modes, at most; fewer where a multiplet would be cut.
    pub modes: usize,
    /// Appendix A; `None` leaves the prior as it is.
    pub enrichment: Option<Enrichment>,
}

/// `U = F L_imp`: indirect irradiance on the warped walls, texels x modes, when they emit the canonical
/// implicit lighting.
pub fn regathered(bounce: &Matrix<f64>, implicit_lighting: &Matrix<f64>) -> Matrix<f64> {
    parallel_multiply(bounce, implicit_lighting)
}

/// The reduced operators of the warped walls themselves, from F and samples `L_d` of direct light
/// ([`crate::modular::light_prior::warped::warped_direct_samples`]).
///
/// The same steps as a bake's, with two shortcuts that change no result beyond rounding: the samples are
/// used as they are, since a prior that keeps all its vectors spans the same, and only products of columns
/// are decomposed (method of snapshots), which is good for modes down to 1e-6 of the
/// first. `BlockTransport::dropped_energy` and `singular_values` count by area.
///
/// Cost at 16² on two cores, F not included: 0.2 s for a box; without any symmetry 0.6 s for a closed block
/// and at most 2 s for one with openings, whose prior has more lights.
pub fn rebuilt(
    walls: &WarpedWalls,
    bounce: &Matrix<f64>,
    samples: &Matrix<f64>,
    config: &RebuildConfig,
) -> BlockTransport {
    let classes = warped_parity_classes(walls);
    let roots = root_areas(walls);
    let symmetric = Matrix::from_fn(bounce.rows(), bounce.columns(), |i, j| {
        bounce[(i, j)] * (roots[i] / roots[j])
    });
    let folded = fold_bounce(&symmetric, &classes);
    let samples = normalized(scaled_rows(samples, &roots), 1.0);
    let samples = folded_columns(&classes, &samples);
    let emitted: Vec<(Matrix<f64>, Matrix<f64>)> = folded
        .iter()
        .zip(samples)
        .map(|(bounce, columns)| (parallel_multiply(bounce, &columns), columns))
        .collect();
    let Some(enrichment) = &config.enrichment else {
        return assembled(&classes, &roots, &folded, &emitted, config.modes);
    };
    let plain = assembled(&classes, &roots, &folded, &emitted, config.modes);
    let joining = [
        normalized(
            scaled_rows(&wall_constants(walls, 1), &roots),
            enrichment.uniform_weight,
        ),
        normalized(
            scaled_rows(&wall_constants(walls, walls.faces.len()), &roots),
            enrichment.constant_weight,
        ),
        normalized(
            scaled_rows(&plain.indirect_basis, &roots),
            enrichment.indirect_weight,
        ),
    ];
    let joining = folded_columns(&classes, &side_by_side(&joining));
    let enriched: Vec<(Matrix<f64>, Matrix<f64>)> = folded
        .iter()
        .zip(&joining)
        .zip(&emitted)
        .map(|((bounce, joining), (images, columns))| {
            let joined = parallel_multiply(bounce, joining);
            (
                side_by_side(&[images.clone(), joined]),
                side_by_side(&[columns.clone(), joining.clone()]),
            )
        })
        .collect();
    assembled(&classes, &roots, &folded, &enriched, config.modes)
}

/// Functions that are constant on one wall, or (one column) on all of them.
fn wall_constants(walls: &WarpedWalls, columns: usize) -> Matrix<f64> {
    let per_wall = walls.resolution * walls.resolution;
    Matrix::from_fn(walls.texel_count(), columns, |texel, wall| {
        f64::from(u8::from(columns == 1 || texel / per_wall == wall))
    })
}

/// The largest modes over all classes, brought back to texels. `emitted` holds, for each class, F times
/// the columns of the prior, and these columns.
fn assembled(
    classes: &ParityClasses,
    roots: &[f64],
    folded: &[Matrix<f64>],
    emitted: &[(Matrix<f64>, Matrix<f64>)],
    modes: usize,
) -> BlockTransport {
    let parts: Vec<Snapshots> = emitted
        .par_iter()
        .map(|(images, _)| Snapshots::of(images))
        .collect();
    let choice = ModeChoice::largest(parts.iter().map(Snapshots::singular_values), modes);
    let columns: Vec<[Vec<f64>; 3]> = choice
        .kept
        .par_iter()
        .map(|&ParityMode { class, position }| {
            let sigma = parts[class].singular_values()[position];
            let (images, prior) = &emitted[class];
            let (u, v) = parts[class].pair(images, position);
            let implicit = combined_columns(prior, &v);
            let row: Vec<f64> = (0..folded[class].columns())
                .map(|j| dot(folded[class].column(j), &u) / sigma)
                .collect();
            let scaled: Vec<f64> = u.iter().map(|x| x * sigma).collect();
            let unweighted = |signal: Vec<f64>| {
                let signal = classes.unfold(class, &signal);
                signal.iter().zip(roots).map(|(x, r)| x / r).collect()
            };
            let row = classes.unfold(class, &row);
            [
                unweighted(scaled),
                unweighted(implicit),
                row.iter().zip(roots).map(|(x, r)| x * r).collect(),
            ]
        })
        .collect();
    let gather = |which: usize| {
        let columns: Vec<&[f64]> = columns.iter().map(|c| c[which].as_slice()).collect();
        Matrix::from_columns(classes.point_count(), &columns)
    };
    BlockTransport {
        indirect_basis: gather(0),
        implicit_lighting: gather(1),
        coefficients_from_direct: gather(2).transposed(),
        dropped_energy: choice.dropped_energy(),
        singular_values: choice.singular_values,
    }
}

fn root_areas(walls: &WarpedWalls) -> Vec<f64> {
    walls.areas.iter().map(|area| area.sqrt()).collect()
}

fn scaled_rows(a: &Matrix<f64>, scales: &[f64]) -> Matrix<f64> {
    Matrix::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)] * scales[i])
}

/// Scaled to a Frobenius norm.
fn normalized(a: Matrix<f64>, norm: f64) -> Matrix<f64> {
    let found = a.frobenius_norm();
    // Samples of lights that light nothing.
    if found == 0.0 {
        return a;
    }
    a.scaled_columns(&vec![norm / found; a.columns()])
}

fn folded_columns(classes: &ParityClasses, signals: &Matrix<f64>) -> Vec<Matrix<f64>> {
    (0..classes.class_count())
        .into_par_iter()
        .map(|class| classes.fold_columns(class, signals))
        .collect()
}

fn side_by_side(parts: &[Matrix<f64>]) -> Matrix<f64> {
    let rows = parts.first().map_or(0, Matrix::rows);
    let data: Vec<f64> = parts
        .iter()
        .flat_map(|m| m.data().iter().copied())
        .collect();
    Matrix::from_column_major(rows, data.len() / rows.max(1), data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PriorConfig;
    use crate::modular::light_prior::cube::{
        direct_samples, enriched_prior, light_prior, prior_lights,
    };
    use crate::modular::light_prior::warped::{
        warped_direct_samples, warped_light_radius, warped_prior_lights,
    };
    use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
    use crate::modular::one_bounce::warped::warped_bounce;
    use crate::modular::surface::mirrors::texel_parity_classes;
    use crate::modular::transport::modes::block_transport;
    use crate::progress::Progress;
    use glam::DVec3;
    use mrt_core::geometry::cube::Face;
    use mrt_core::geometry::hexahedron::Hexahedron;
    use mrt_core::linalg::matrix::multiply;
    use mrt_runtime::blocks::SHAPES;

    const RESOLUTION: usize = 8;

    fn config() -> RebuildConfig {
        RebuildConfig {
            modes: 20,
            enrichment: Some(Enrichment::default()),
        }
    }

    fn product(transport: &BlockTransport) -> Matrix<f64> {
        multiply(
            transport.indirect_basis.view(),
            transport.coefficients_from_direct.view(),
        )
    }

    fn relative(a: &Matrix<f64>, b: &Matrix<f64>) -> f64 {
        let miss: Vec<f64> = a.data().iter().zip(b.data()).map(|(x, y)| x - y).collect();
        dot(&miss, &miss).sqrt() / b.frobenius_norm()
    }

    #[test]
    fn rebuilding_the_cube_gives_what_a_bake_gives() {
        let shape = &SHAPES[0];
        let prior_config = PriorConfig::default();
        let classes = texel_parity_classes(shape, RESOLUTION);
        let cube = closed_cube_bounce(RESOLUTION, Reconstruction::Constant, &Progress::silent())
            .expect("nobody cancels");
        let folded = fold_bounce(&cube, &classes);
        let samples = direct_samples(shape, RESOLUTION, &prior_config);
        let prior = light_prior(&samples, &classes, usize::MAX);
        let plain = block_transport(&folded, &folded, &prior.basis, &classes, 20);
        let enriched = enriched_prior(
            &prior,
            &plain.indirect_basis,
            shape,
            &classes,
            &Enrichment::default(),
        );
        let baked = block_transport(&folded, &folded, &enriched.basis, &classes, 20);

        let walls = WarpedWalls::new(&Face::ALL, RESOLUTION, &Hexahedron::cell(DVec3::ZERO));
        let bounce = warped_bounce(&walls);
        let lights = warped_prior_lights(&walls, &[], prior_config.lights_per_axis);
        assert_eq!(lights, prior_lights(shape, prior_config.lights_per_axis));
        let radius = warped_light_radius(&walls, prior_config.light_radius);
        let samples = warped_direct_samples(&walls, &lights, radius);
        let found = rebuilt(&walls, &bounce, &samples, &config());
        assert_eq!(
            found.indirect_basis.columns(),
            baked.indirect_basis.columns()
        );
        // Gram matrices lose half the digits of small modes, and uniform light with its weight of ten makes
        // the last one kept 2e-3 of the first. Products leave out the order within multiplets.
        let implicit = |t: &BlockTransport| {
            multiply(
                t.implicit_lighting.view(),
                t.coefficients_from_direct.view(),
            )
        };
        assert!(relative(&product(&found), &product(&baked)) < 1e-6);
        assert!(relative(&implicit(&found), &implicit(&baked)) < 1e-6);
    }

    #[test]
    fn implicit_lighting_produces_the_basis() {
        let mut warp = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(1.0, 1.0, 2.0));
        warp.corners[7] += DVec3::new(0.1, 0.2, -0.3);
        let walls = WarpedWalls::new(&Face::ALL, RESOLUTION, &warp);
        let bounce = warped_bounce(&walls);
        let lights = warped_prior_lights(&walls, &[], 4);
        let samples = warped_direct_samples(&walls, &lights, 0.1);
        let found = rebuilt(&walls, &bounce, &samples, &config());
        let gathered = regathered(&bounce, &found.implicit_lighting);
        assert!(relative(&gathered, &found.indirect_basis) < 1e-9);
    }

    #[test]
    fn the_number_of_threads_changes_no_bit() {
        let warp = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(1.0, 1.0, 2.0));
        let mut bent = warp;
        bent.corners[7] += DVec3::new(0.1, 0.2, -0.3);
        for warp in [warp, bent] {
            let with_threads = |threads| {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .expect("a pool of threads");
                pool.install(|| {
                    let walls = WarpedWalls::new(&Face::ALL, RESOLUTION, &warp);
                    let bounce = warped_bounce(&walls);
                    let lights = warped_prior_lights(&walls, &[Face::PosX], 3);
                    let samples = warped_direct_samples(&walls, &lights, 0.1);
                    let found = rebuilt(&walls, &bounce, &samples, &config());
                    [
                        regathered(&bounce, &found.implicit_lighting),
                        found.indirect_basis,
                        found.coefficients_from_direct,
                        found.implicit_lighting,
                    ]
                })
            };
            assert_eq!(with_threads(1), with_threads(3));
        }
    }

    #[test]
    fn a_prior_of_dependent_lights_loses_no_mode() {
        let warp = Hexahedron {
            corners: std::array::from_fn(|k| {
                let unit = Hexahedron::unit_corner(k);
                unit + DVec3::X * (0.25 * unit.y)
            }),
        };
        let walls = WarpedWalls::new(&Face::ALL, 16, &warp);
        let bounce = warped_bounce(&walls);
        let lights = warped_prior_lights(&walls, &[], 6);
        let radius = warped_light_radius(&walls, 0.1);
        let samples = warped_direct_samples(&walls, &lights, radius);
        let many = RebuildConfig {
            modes: 96,
            ..config()
        };
        let found = rebuilt(&walls, &bounce, &samples, &many);
        // Uniform light, with its weight of ten, comes first; its class was lost once.
        assert!(found.singular_values[0] > 10.0);
        assert!(found.singular_values.iter().all(|s| s.is_finite()));
    }

    #[test]
    fn feedback_never_gains() {
        let warp = Hexahedron::cuboid(DVec3::ZERO, DVec3::new(1.0, 1.0, 4.0));
        let walls = WarpedWalls::new(&Face::ALL, RESOLUTION, &warp);
        let bounce = warped_bounce(&walls);
        let lights = warped_prior_lights(&walls, &[], 6);
        let samples = warped_direct_samples(&walls, &lights, 0.1);
        let found = rebuilt(&walls, &bounce, &samples, &config());
        let feedback = multiply(
            found.coefficients_from_direct.view(),
            found.indirect_basis.view(),
        );
        let radius = mrt_core::linalg::svd::spectral_radius(feedback.view());
        // Uniform light is kept exactly; texel centres stand for texels, which costs 1e-3 at 8².
        assert!(radius < 1.001 && radius > 0.999, "{radius}");
    }
}
