//! Weights that make decompositions count by area.

use crate::matrix_parts::scaled_rows;
use crate::modular::surface::walls::tube::TubeWall;
use mrt_core::linalg::matrix::Matrix;

/// Area weights of a tube's texels.
///
/// A texel on the inner side of a bend has a ninth of the area of one on the outer side. Errors are to count
/// by area, so decompositions run on signals times the root D of the texels' areas: F becomes D F D⁻¹,
/// samples become D L_d, and the results come back through D⁻¹. D commutes with the mirrors. Cubes need no weights,
/// because all their texels have one size.
#[derive(Clone, Debug)]
pub struct AreaWeights {
    /// Root of each texel's area over the mean area.
    pub roots: Vec<f64>,
}

impl AreaWeights {
    /// The weights of a tube's texels.
    pub fn of_tube(wall: &TubeWall) -> Self {
        let mean = wall.form.wall_area() / wall.texels.len() as f64;
        let roots = wall.texels.iter().map(|t| (t.area / mean).sqrt());
        Self {
            roots: roots.collect(),
        }
    }

    /// D times signals (texels x columns).
    pub fn weigh(&self, signals: &Matrix<f64>) -> Matrix<f64> {
        scaled_rows(signals, &self.roots)
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrt_core::geometry::tube::TubeForm;

    #[test]
    fn weights_have_the_mean_one_and_those_of_equal_texels_are_one() {
        let roots = |form| AreaWeights::of_tube(&TubeWall::new(form, 8)).roots;
        let bend = roots(TubeForm::Bend);
        let mean = bend.iter().map(|r| r * r).sum::<f64>() / bend.len() as f64;
        assert!((mean - 1.0).abs() < 1e-13);
        let straight = roots(TubeForm::Straight);
        assert!(straight.iter().all(|r| (r - 1.0).abs() < 1e-14));
    }
}
