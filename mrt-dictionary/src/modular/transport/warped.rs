//! Reduced transport for a warped block (Loos et al. 2011, sections 6.2 and 8, figure 12), in three levels
//! of rising quality and cost:
//!
//! 1. **canonical**: the canonical shape's operators as they are;
//! 2. **re-gathered**: the canonical implicit lighting `L_imp` is placed on the warped walls, and what is
//!    gathered from it is gathered anew there: `U = F_warped L_imp`. The paper calls this "U-vector scaled";
//! 3. **rebuilt**: prior, F and decomposition on the warped walls ("both scaled").
//!
//! A best fit of coefficients to re-gathered vectors would lie between the last two. It needs operators of its
//! own as a rebuild does, and errs by 22 % where a rebuild errs by 10 (a box 1:1:5), so it is not offered.
//!
//! Texels of a warped block differ in area, and squared errors are to count by area. So decompositions
//! run on signals times the root of the texel's area. F between such signals is symmetric but for
//! discretisation, and everything of [`crate::modular::transport::modes`] applies as it stands.

use crate::config::Enrichment;
use crate::matrix_parts::{scaled, scaled_rows, side_by_side};
use crate::modular::light_prior::basis::fold_all;
use crate::modular::surface::mirrors::warped::warped_parity_classes;
use crate::modular::surface::walls::warped::WarpedWalls;
use crate::modular::transport::modes::{BlockTransport, fold_bounce};
use crate::parallel_products::parallel_multiply;
use mrt_core::linalg::matrix::{Matrix, dot};
use mrt_core::linalg::parity::ParityClasses;
use mrt_core::linalg::parity_modes::{ModeChoice, ParityMode, Snapshots, combined_columns};
use rayon::prelude::*;

/// Settings of a rebuild.
#[derive(Clone, Debug, PartialEq)]
pub struct RebuildConfig {
    /// Largest number of modes; fewer are kept where a multiplet would be cut.
    pub modes: usize,
    /// Enrichment of the prior (appendix A); `None` leaves the prior as it is.
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
/// The same steps as a bake's, with two shortcuts that change no result beyond rounding. The samples are
/// used as they are, since a prior that keeps all its vectors spans the same space. And only products of columns
/// are decomposed ([`Snapshots`]), which is good for modes down to 1e-6 of the
/// first. `BlockTransport::dropped_energy` and `singular_values` count by area.
///
/// Cost at 16² on two cores, without that of F: 0.2 s for a box. Blocks without any symmetry take 0.6 s if they are
/// closed, and at most 2 s with openings, because their prior has more lights.
pub fn rebuilt(
    walls: &WarpedWalls,
    bounce: &Matrix<f64>,
    samples: &Matrix<f64>,
    config: &RebuildConfig,
) -> BlockTransport {
    let classes = warped_parity_classes(walls);
    let roots: Vec<f64> = walls.areas.iter().map(|area| area.sqrt()).collect();
    let symmetric = Matrix::from_fn(bounce.rows(), bounce.columns(), |i, j| {
        bounce[(i, j)] * (roots[i] / roots[j])
    });
    let folded = fold_bounce(&symmetric, &classes);
    let decomposed = |prior: &[ImagedPrior]| {
        let parts = Decomposed {
            classes: &classes,
            roots: &roots,
            folded: &folded,
            prior,
        };
        parts.transport(config.modes)
    };
    let samples = normalized(scaled_rows(samples, &roots), 1.0);
    let prior: Vec<ImagedPrior> = folded
        .iter()
        .zip(fold_all(&classes, &samples))
        .map(|(bounce, columns)| ImagedPrior::new(bounce, columns))
        .collect();
    let plain = decomposed(&prior);
    let Some(enrichment) = &config.enrichment else {
        return plain;
    };
    let weighted = |signals: &Matrix<f64>, weight| normalized(scaled_rows(signals, &roots), weight);
    let joining = side_by_side(&[
        &weighted(&wall_constants(walls, 1), enrichment.uniform_weight),
        &weighted(
            &wall_constants(walls, walls.faces.len()),
            enrichment.constant_weight,
        ),
        &weighted(&plain.indirect_basis, enrichment.indirect_weight),
    ]);
    let enriched: Vec<ImagedPrior> = folded
        .iter()
        .zip(fold_all(&classes, &joining))
        .zip(&prior)
        .map(|((bounce, joining), prior)| prior.beside(ImagedPrior::new(bounce, joining)))
        .collect();
    decomposed(&enriched)
}

/// Functions that are constant on one wall, or (one column) on all of them.
fn wall_constants(walls: &WarpedWalls, columns: usize) -> Matrix<f64> {
    let per_wall = walls.resolution * walls.resolution;
    Matrix::from_fn(walls.texel_count(), columns, |texel, wall| {
        f64::from(u8::from(columns == 1 || texel / per_wall == wall))
    })
}

/// Scaled to a Frobenius norm. A matrix of zeros stays as it is.
fn normalized(a: Matrix<f64>, norm: f64) -> Matrix<f64> {
    let found = a.frobenius_norm();
    if found == 0.0 {
        return a;
    }
    scaled(&a, norm / found)
}

/// The part of a prior in one parity class, and what one bounce makes of it.
struct ImagedPrior {
    columns: Matrix<f64>,
    /// F times the columns.
    images: Matrix<f64>,
}

impl ImagedPrior {
    fn new(bounce: &Matrix<f64>, columns: Matrix<f64>) -> Self {
        Self {
            images: parallel_multiply(bounce, &columns),
            columns,
        }
    }

    fn beside(&self, other: Self) -> Self {
        Self {
            columns: side_by_side(&[&self.columns, &other.columns]),
            images: side_by_side(&[&self.images, &other.images]),
        }
    }
}

/// What the modes of a rebuilt block are chosen from.
struct Decomposed<'a> {
    classes: &'a ParityClasses,
    /// Roots of the texels' areas.
    roots: &'a [f64],
    /// F by parity class, between weighted signals.
    folded: &'a [Matrix<f64>],
    /// By parity class.
    prior: &'a [ImagedPrior],
}

impl Decomposed<'_> {
    /// The largest modes over all classes, brought back to plain texel values.
    fn transport(&self, modes: usize) -> BlockTransport {
        let parts: Vec<Snapshots> = self
            .prior
            .par_iter()
            .map(|part| Snapshots::of(&part.images))
            .collect();
        let choice = ModeChoice::largest(parts.iter().map(Snapshots::singular_values), modes);
        let found: Vec<TexelMode> = choice
            .kept
            .par_iter()
            .map(|&mode| self.mode(&parts[mode.class], mode))
            .collect();
        let gather = |part: fn(&TexelMode) -> &[f64]| {
            let columns: Vec<&[f64]> = found.iter().map(part).collect();
            Matrix::from_columns(self.classes.point_count(), &columns)
        };
        BlockTransport {
            indirect_basis: gather(|mode| &mode.indirect),
            implicit_lighting: gather(|mode| &mode.implicit),
            coefficients_from_direct: gather(|mode| &mode.from_direct).transposed(),
            dropped_energy: choice.dropped_energy(),
            singular_values: choice.singular_values,
        }
    }

    fn mode(&self, part: &Snapshots, ParityMode { class, position }: ParityMode) -> TexelMode {
        let (prior, bounce) = (&self.prior[class], &self.folded[class]);
        let sigma = part.singular_values()[position];
        let (u, v) = part.pair(&prior.images, position);
        let implicit = combined_columns(&prior.columns, &v);
        let row: Vec<f64> = (0..bounce.columns())
            .map(|j| dot(bounce.column(j), &u) / sigma)
            .collect();
        let indirect: Vec<f64> = u.iter().map(|x| x * sigma).collect();
        let unweighed = |signal: &[f64]| {
            let signal = self.classes.unfold(class, signal);
            signal.iter().zip(self.roots).map(|(x, r)| x / r).collect()
        };
        let row = self.classes.unfold(class, &row);
        TexelMode {
            indirect: unweighed(&indirect),
            implicit: unweighed(&implicit),
            from_direct: row.iter().zip(self.roots).map(|(x, r)| x * r).collect(),
        }
    }
}

/// One mode, by texel.
struct TexelMode {
    /// Column of `U_b`.
    indirect: Vec<f64>,
    /// Column of `L_imp`.
    implicit: Vec<f64>,
    /// Row of `T_d->b`.
    from_direct: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PriorConfig;
    use crate::modular::light_prior::basis::light_prior;
    use crate::modular::light_prior::cube::{direct_samples, enriched_prior, prior_lights};
    use crate::modular::light_prior::warped::{
        warped_direct_samples, warped_light_radius, warped_prior_lights,
    };
    use crate::modular::one_bounce::cube::{Reconstruction, closed_cube_bounce};
    use crate::modular::one_bounce::warped::warped_bounce;
    use crate::modular::surface::mirrors::cube::texel_parity_classes;
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
        // Uniform light, with its weight of ten, comes first, so its class must be there.
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
