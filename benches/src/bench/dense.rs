//! The whole level as one matrix: F of all its texels, and truncated decompositions of it.
//!
//! The range is found by random sketches with one power iteration (Halko, Martinsson and Tropp, "Finding structure with
//! randomness", SIAM Review 53(2), 2011, algorithms 4.4 and 5.1).

use super::library::{Libraries, Library, Sum, WrongProduct, difference, product};
use super::ours::Ours;
use super::reference::Receiver;
use super::setting::{ALBEDO, Setting};
use super::timing::Timed;
use mrt_core::lighting::sampling::hash;
use mrt_core::linalg::matrix::{Matrix, MatrixView, dot, multiply};
use mrt_core::linalg::svd::symmetric_eigen;
use mrt_core::reference::radiosity::transport::Transport;
use mrt_core::reference::radiosity::{ExactError, ExactScene};
use mrt_editor::cli::reference_level::exact_scene;
use mrt_runtime::BlockIndex;
use std::f64::consts::TAU;
use std::time::Instant;

/// Texels of a level whose F is made: 268 MB.
pub const MAX_TEXELS: usize = 1 << 13;

/// Columns of a sketch beyond the largest rank.
const SPARE: usize = 10;

/// Why there is no dense operator.
#[derive(Debug, thiserror::Error)]
pub enum DenseError {
    /// The exact solver refuses the level.
    #[error("exact solution: {0}")]
    Exact(#[from] ExactError),
    /// A library is wrong.
    #[error(transparent)]
    Product(#[from] WrongProduct),
    /// The factors do not give the light of F.
    #[error(
        "F as factors of rank {rank} differs by {found:.1e} from F; expected at most {expected:.1e}"
    )]
    Factors {
        /// Kept singular values.
        rank: usize,
        /// Relative difference in the norm of F.
        found: f64,
        /// Twice what the singular values left out amount to.
        expected: f64,
    },
}

/// F of a level and the light that it is applied to.
pub struct Dense {
    exact: ExactScene,
    /// Texels x texels, in the exact solver's order.
    pub operator: Matrix<f32>,
    radiosity: Matrix<f32>,
}

impl Dense {
    /// F by exact form factors, for the direct light of `ours`.
    ///
    /// # Errors
    /// [`DenseError::Exact`].
    pub fn new(setting: &Setting, ours: &Ours) -> Result<Self, DenseError> {
        let resolution = ours.scene.level.resolution;
        let exact = exact_scene(&setting.level, resolution)?;
        let transport = Transport::build(&exact);
        let count = exact.texel_count();
        let operator = Matrix::from_fn(count, count, |i, j| transport.factor(i, j) as f32);
        let mut radiosity = Matrix::zeros(count, 3);
        let direct = ours.direct();
        for wall in exact.walls() {
            let range = &ours.scene.level.blocks[wall.block].texels;
            for k in 0..resolution * resolution {
                let (row, column) = (k / resolution, k % resolution);
                let at = ours.scene.level.level_texel(
                    BlockIndex::new(wall.block),
                    wall.face,
                    row,
                    column,
                );
                for channel in 0..3 {
                    let from = 3 * range.start + channel * range.len() + at.unwrap_or(0);
                    radiosity[(wall.first_texel + k, channel)] = ALBEDO[channel] * direct[from];
                }
            }
        }
        Ok(Self {
            exact,
            operator,
            radiosity,
        })
    }

    /// F as one product.
    ///
    /// # Errors
    /// [`WrongProduct`].
    pub fn whole(&self, libraries: &mut Libraries) -> Result<Product<'_>, WrongProduct> {
        Product::new(vec![&self.operator], &self.radiosity, libraries)
    }

    /// F as two factors, from a decomposition.
    ///
    /// # Errors
    /// [`WrongProduct`].
    pub fn factored<'a>(
        &'a self,
        factors: &'a [Matrix<f32>; 2],
        libraries: &mut Libraries,
    ) -> Result<Product<'a>, WrongProduct> {
        Product::new(factors.iter().collect(), &self.radiosity, libraries)
    }

    /// Truncated decompositions, each as right and left factor: F is nearly left times right.
    ///
    /// # Errors
    /// [`DenseError::Factors`], if one is not as close to F as its singular values say.
    pub fn decompositions(&self, ranks: &[usize]) -> Result<Vec<[Matrix<f32>; 2]>, DenseError> {
        let count = self.operator.rows();
        let most = ranks.iter().copied().max().unwrap_or(0);
        let width = (most + SPARE).min(count);
        let normal = |i: usize, j: usize| {
            let unit = |k| (f64::from(hash((i * width + j) as u32, k)) + 0.5) / 4_294_967_296.0;
            ((-2.0 * unit(0).ln()).sqrt() * (TAU * unit(1)).cos()) as f32
        };
        let times = |a: &Matrix<f32>, b: &Matrix<f32>| {
            let mut out = Matrix::zeros(a.rows(), b.columns());
            product(Library::Gemm, a.view(), b.view(), out.data_mut(), Sum::New);
            out
        };
        let transposed = self.operator.transposed();
        let sketch = times(&self.operator, &Matrix::from_fn(count, width, normal));
        let sketch = times(&transposed, &orthonormal(&sketch));
        let range = orthonormal(&times(&self.operator, &orthonormal(&sketch)));
        // Rows of F in the range: their Gram matrix has the squared singular values.
        let inside = times(&transposed, &range);
        let gram = times(&inside.transposed(), &inside).cast::<f64>();
        let (squares, vectors) = symmetric_eigen(gram.view());
        let size = self.operator.frobenius_norm();
        ranks
            .iter()
            .map(|&rank| rank.min(width))
            .map(|rank| {
                let vectors = vectors.leading_columns(rank).cast::<f32>();
                let right = times(&inside, &vectors).transposed();
                let left = times(&range, &vectors);
                // F less its projection, by Pythagoras.
                let kept: f64 = squares[..rank].iter().sum();
                let expected = 2.0 * (1.0 - kept / (size * size)).max(0.0).sqrt() + 1e-3;
                let found = self.sampled_difference(&left, &right);
                if found.is_nan() || found > expected {
                    return Err(DenseError::Factors {
                        rank,
                        found,
                        expected,
                    });
                }
                Ok([right, left])
            })
            .collect()
    }

    /// Relative difference of every 64th column.
    fn sampled_difference(&self, left: &Matrix<f32>, right: &Matrix<f32>) -> f64 {
        let (mut found, mut exact) = (Vec::new(), Vec::new());
        for column in (0..self.operator.columns()).step_by(64) {
            let weights = MatrixView::new(right.rows(), 1, right.column(column));
            found.extend_from_slice(multiply(left.view(), weights).data());
            exact.extend_from_slice(self.operator.column(column));
        }
        difference(&found, &exact)
    }

    /// Light of a product at receivers.
    pub fn irradiance(&self, light: &Matrix<f32>, receivers: &[Receiver]) -> Vec<[f64; 3]> {
        let resolution = self.exact.resolution();
        let at = |receiver: &Receiver| {
            let mut walls = self.exact.walls().iter();
            let wall = walls.find(|w| (w.block, w.face) == (receiver.block, receiver.face));
            let first = wall.map_or(0, |wall| wall.first_texel);
            let texel = first + receiver.row * resolution + receiver.column;
            std::array::from_fn(|channel| f64::from(light[(texel, channel)]))
        };
        receivers.iter().map(at).collect()
    }
}

/// An orthonormal basis of the columns, by Gram and Schmidt's method, twice.
fn orthonormal(matrix: &Matrix<f32>) -> Matrix<f32> {
    let mut columns: Vec<Vec<f32>> = Vec::with_capacity(matrix.columns());
    for j in 0..matrix.columns() {
        let mut column = matrix.column(j).to_vec();
        for _ in 0..2 {
            for done in &columns {
                let along = dot(done, &column);
                for (x, &d) in column.iter_mut().zip(done) {
                    *x -= along * d;
                }
            }
            let size = dot(&column, &column).sqrt();
            if size > 0.0 {
                column.iter_mut().for_each(|x| *x /= size);
            }
        }
        columns.push(column);
    }
    Matrix::from_columns(matrix.rows(), &columns)
}

/// Factors that are applied to light one after the other.
pub struct Product<'a> {
    factors: Vec<(&'a Matrix<f32>, Library)>,
    radiosity: &'a Matrix<f32>,
    /// What each factor makes; the last is irradiance.
    results: Vec<Matrix<f32>>,
}

impl<'a> Product<'a> {
    fn new(
        factors: Vec<&'a Matrix<f32>>,
        radiosity: &'a Matrix<f32>,
        libraries: &mut Libraries,
    ) -> Result<Self, WrongProduct> {
        let results = factors.iter().map(|f| Matrix::zeros(f.rows(), 3)).collect();
        let mut chosen = Vec::with_capacity(factors.len());
        for factor in factors {
            chosen.push((factor, libraries.fastest(factor.view(), 3)?));
        }
        let mut product = Self {
            factors: chosen,
            radiosity,
            results,
        };
        product.run();
        Ok(product)
    }

    /// Irradiance, texels x channels.
    pub fn light(&self) -> &Matrix<f32> {
        &self.results[self.results.len() - 1]
    }

    /// Libraries in use.
    pub fn library_names(&self) -> Vec<&'static str> {
        let factors = self.factors.iter();
        let mut names: Vec<&str> = factors.map(|(_, library)| library.name()).collect();
        names.dedup();
        names
    }

    /// Bytes of the factors.
    pub fn bytes(&self) -> usize {
        let factors = self.factors.iter();
        factors.map(|(factor, _)| size_of_val(factor.data())).sum()
    }

    /// Operations, a product and a sum being two.
    pub fn flops(&self) -> f64 {
        6.0 * self.bytes() as f64 / 4.0
    }
}

impl Timed for Product<'_> {
    fn run(&mut self) -> Vec<f64> {
        let start = Instant::now();
        for k in 0..self.factors.len() {
            let (factor, library) = self.factors[k];
            let (before, after) = self.results.split_at_mut(k);
            let input = before.last().unwrap_or(self.radiosity);
            product(
                library,
                factor.view(),
                input.view(),
                after[0].data_mut(),
                Sum::New,
            );
        }
        vec![start.elapsed().as_secs_f64()]
    }
}
