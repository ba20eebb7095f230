//! The rotation in a linear map: a matrix with positive determinant is a rotation after a symmetric stretch.

use glam::DMat3;

/// The rotation nearest to a matrix with positive determinant: Newton's iteration for the polar decomposition, whose
/// step is the mean of a matrix and its inverse transposed (Higham 1986).
///
/// The matrix is first scaled to determinant one. Each of the `steps` then at least halves the logarithm of a stretch,
/// and doubles the digits once the stretch is near one: 10 steps reach rounding from a stretch of 1:100. Further steps
/// change last bits only, so a caller whose results must keep their bits keeps its number of steps.
pub fn rotation_part(matrix: &DMat3, steps: usize) -> DMat3 {
    let size = libm::cbrt(matrix.determinant());
    let mut rotation = *matrix * (1.0 / size);
    for _ in 0..steps {
        rotation = (rotation + rotation.inverse().transpose()) * 0.5;
    }
    rotation
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_turned_stretch_leaves_its_turn() {
        let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-1.1);
        for (stretch, steps) in [([9.0, 1.0, 0.3], 16), ([1e6, 1.0, 1.0], 40)] {
            let stretch = DMat3::from_diagonal(DVec3::from_array(stretch));
            let miss = rotation_part(&(turn * stretch), steps) - turn;
            // Newton's steps end at rounding, of numbers up to the root of the stretch before.
            assert!(miss.to_cols_array().iter().all(|x| x.abs() < 1e-9));
        }
    }

    #[test]
    fn a_rotation_is_left_as_it_is() {
        let turn = DMat3::from_rotation_y(0.7);
        let miss = rotation_part(&turn, 16) - turn;
        assert!(miss.to_cols_array().iter().all(|x| x.abs() < 1e-15));
        assert_eq!(rotation_part(&DMat3::IDENTITY, 16), DMat3::IDENTITY);
    }
}
