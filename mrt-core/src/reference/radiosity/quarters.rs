//! Light on the quarters of a texel: direct light and near senders vary within a texel.

use super::scene::ExactScene;

/// Values of the four quarters of a texel, at (u, v) = (low, low), (high, low), (low, high),
/// (high, high).
pub type Quarters = [f64; 4];

/// Mean value of a texel.
pub fn mean_of_quarters(quarters: &Quarters) -> f64 {
    quarters.iter().sum::<f64>() * 0.25
}

/// Means over texel quarters of a function that is known at texel centres, from the texel's mean and
/// slopes.
///
/// The mean is the centre's value plus 1/24 of the second differences along u and v, to fourth order.
/// Measured against the reference files, this correction of the mean is worth little: all bounces at
/// albedo 0.9 in the cube err by 0.05 % instead of 0.17 % in the mean of a wall, two bounces by 0.06 %
/// either way. It is worth more than reflecting the function at the edges of a face, where the function
/// is steepest.
pub fn quarters_from_centers(scene: &ExactScene, centers: &[f64]) -> Vec<Quarters> {
    let resolution = scene.resolution();
    if resolution < 3 {
        return centers.iter().map(|&center| [center; 4]).collect();
    }
    let mut quarters = Vec::with_capacity(centers.len());
    for centers in centers.chunks_exact(resolution * resolution) {
        for (index, &center) in centers.iter().enumerate() {
            let (row, column) = (index / resolution, index % resolution);
            let along_u = Line {
                start: row * resolution,
                stride: 1,
                count: resolution,
            };
            let along_v = Line {
                start: column,
                stride: resolution,
                count: resolution,
            };
            let (slope_u, bend_u) = along_u.derivatives(centers, column);
            let (slope_v, bend_v) = along_v.derivatives(centers, row);
            let mean = center + (bend_u + bend_v) / 24.0;
            let (u, v) = (0.25 * slope_u, 0.25 * slope_v);
            quarters.push([mean - u - v, mean + u - v, mean - u + v, mean + u + v]);
        }
    }
    quarters
}

/// A row or column of texels.
struct Line {
    /// Index of its first texel.
    start: usize,
    /// From a texel to the next.
    stride: usize,
    /// Number of texels, at least 3.
    count: usize,
}

impl Line {
    /// First and second derivative by the position, in texels, at a texel of the line. At an end they
    /// are those of the parabola through the last three texels.
    fn derivatives(&self, values: &[f64], position: usize) -> (f64, f64) {
        let (middle, offset) = if position == 0 {
            (1, -1.0)
        } else if position == self.count - 1 {
            (position - 1, 1.0)
        } else {
            (position, 0.0)
        };
        let at = |position: usize| values[self.start + position * self.stride];
        let (before, after) = (at(middle - 1), at(middle + 1));
        let bend = before - 2.0 * at(middle) + after;
        (0.5 * (after - before) + offset * bend, bend)
    }
}
