//! Lightfields at openings: the sampling grid, its interpolation and its measure (Loos et al. 2011,
//! sections 5.1 and 7.1).
//!
//! The canonical interface is the face z = 0 of the unit cube, crossed towards +z, with u = x and v = y. A
//! lightfield is radiance at positions on that face and directions into the half-space z > 0, the latter on
//! Shirley and Chiu's square with equal solid angles. What a sample is worth to anything behind the
//! interface is its flux, so scalar products weigh it with cos θ; the paper leaves samples unweighted.
//!
//! At the round openings of tubes (section 6.1) only the positions differ: the square of positions is carried to the
//! disc of radius [`TUBE_RADIUS`] by the concentric map of Shirley and Chiu. All samples then lie in the
//! opening, with equal areas, and interpolation never mixes light with the dark beside the opening, as it
//! would where a square grid is masked. The map has every mirror and quarter turn of the grid.

use crate::config::LightfieldConfig;
use glam::{DVec2, DVec3};
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::tube::TUBE_RADIUS;
use mrt_core::lighting::sampling::{
    cell_center, square_from_uniform_hemisphere, uniform_hemisphere_from_square,
};
use mrt_core::linalg::matrix::Matrix;
use mrt_core::linalg::parity::ParityClasses;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The sample grid of the canonical interface. Directions count fastest ([`LightfieldGrid::sample`]).
#[derive(Clone, Debug)]
pub struct LightfieldGrid {
    /// Positions along each axis.
    pub positions: usize,
    /// Directions along each axis of the square.
    pub directions: usize,
    /// Square root of each direction's weight: its solid angle times cos θ times the area of a
    /// position.
    root_weights: Vec<f64>,
    /// Unit directions of the super-samples of each direction cell.
    super_directions: Vec<Vec<DVec3>>,
}

/// Column and row of a sample's position and of its direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplePlace {
    /// Column of the position, along u.
    pub u: usize,
    /// Row of the position, along v.
    pub v: usize,
    /// Column of the direction.
    pub x: usize,
    /// Row of the direction.
    pub y: usize,
}

/// One term of an interpolation: a sample and its weight.
pub type Tap = (usize, f64);

impl LightfieldGrid {
    /// A grid on square openings, with `super_samples`² directions for each direction cell.
    pub fn on_squares(config: &LightfieldConfig) -> Self {
        let (positions, directions) = (config.positions, config.directions);
        let fine = directions * config.super_samples;
        let super_directions: Vec<Vec<DVec3>> = (0..directions * directions)
            .map(|cell| {
                let (row, column) = (cell / directions, cell % directions);
                (0..config.super_samples * config.super_samples)
                    .map(|part| {
                        let row = row * config.super_samples + part / config.super_samples;
                        let column = column * config.super_samples + part % config.super_samples;
                        uniform_hemisphere_from_square(cell_center(fine, row, column))
                    })
                    .collect()
            })
            .collect();
        let solid_angle = 2.0 * PI / (directions * directions) as f64;
        let area = 1.0 / (positions * positions) as f64;
        let root_weights = super_directions
            .iter()
            .map(|cell| {
                let cosine = cell.iter().map(|d| d.z).sum::<f64>() / cell.len() as f64;
                (cosine * solid_angle * area).sqrt()
            })
            .collect();
        Self {
            positions,
            directions,
            root_weights,
            super_directions,
        }
    }

    /// A grid on the round openings of tubes: weights have the disc's share of the square's area.
    pub fn on_discs(config: &LightfieldConfig) -> Self {
        let mut grid = Self::on_squares(config);
        let root_share = (PI * TUBE_RADIUS * TUBE_RADIUS).sqrt();
        grid.root_weights.iter_mut().for_each(|w| *w *= root_share);
        grid
    }

    /// Number of samples.
    pub fn sample_count(&self) -> usize {
        self.positions * self.positions * self.direction_count()
    }

    /// Number of directions at each position.
    pub fn direction_count(&self) -> usize {
        self.directions * self.directions
    }

    /// Index of the sample at a place: `((v * positions + u) * directions + y) * directions + x`.
    pub fn sample(&self, SamplePlace { u, v, x, y }: SamplePlace) -> usize {
        ((v * self.positions + u) * self.directions + y) * self.directions + x
    }

    /// Inverse of [`LightfieldGrid::sample`].
    pub fn place(&self, sample: usize) -> SamplePlace {
        let (x, rest) = (sample % self.directions, sample / self.directions);
        let (y, rest) = (rest % self.directions, rest / self.directions);
        SamplePlace {
            u: rest % self.positions,
            v: rest / self.positions,
            x,
            y,
        }
    }

    /// The place that the mirror of u takes a sample to.
    pub fn mirrored_u(&self, place: SamplePlace) -> SamplePlace {
        SamplePlace {
            u: self.positions - 1 - place.u,
            x: self.directions - 1 - place.x,
            ..place
        }
    }

    /// The place that the mirror of v takes a sample to.
    pub fn mirrored_v(&self, place: SamplePlace) -> SamplePlace {
        SamplePlace {
            v: self.positions - 1 - place.v,
            y: self.directions - 1 - place.y,
            ..place
        }
    }

    /// Root of the weight of a sample in scalar products.
    pub fn root_weight(&self, sample: usize) -> f64 {
        self.root_weights[sample % self.direction_count()]
    }

    /// Unit directions of the super-samples of a direction cell.
    pub fn super_directions(&self, direction: usize) -> &[DVec3] {
        &self.super_directions[direction]
    }

    /// (u, v) in [0, 1]² of a position.
    pub fn position(&self, position: usize) -> DVec2 {
        let (row, column) = (position / self.positions, position % self.positions);
        (cell_center(self.positions, row, column) + DVec2::ONE) * 0.5
    }

    /// The samples between which a ray through (u, v) in a direction with z > 0 lies: bilinear in
    /// position times bilinear in direction, clamped at the borders.
    pub fn taps(&self, position: DVec2, direction: DVec3) -> [Tap; 16] {
        let square = (square_from_uniform_hemisphere(direction) + DVec2::ONE) * 0.5;
        let [pu, pv] = [position.x, position.y].map(|x| bracket(x, self.positions));
        let [dx, dy] = [square.x, square.y].map(|x| bracket(x, self.directions));
        let mut taps = [(0, 0.0); 16];
        let mut next = 0;
        for (v, wv) in pv {
            for (u, wu) in pu {
                for (y, wy) in dy {
                    for (x, wx) in dx {
                        let sample = self.sample(SamplePlace { u, v, x, y });
                        taps[next] = (sample, wv * wu * wy * wx);
                        next += 1;
                    }
                }
            }
        }
        taps
    }

    /// Parity classes of the samples under the mirrors of u (bit 0) and of v (bit 1).
    pub fn parity_classes(&self) -> ParityClasses {
        let permutation = |image: &dyn Fn(SamplePlace) -> SamplePlace| -> Vec<u32> {
            (0..self.sample_count())
                .map(|sample| self.sample(image(self.place(sample))) as u32)
                .collect()
        };
        let mirror_u = permutation(&|place| self.mirrored_u(place));
        let mirror_v = permutation(&|place| self.mirrored_v(place));
        ParityClasses::new(self.sample_count(), &[mirror_u, mirror_v])
    }

    /// Evaluates `modes` signals at all samples, samples x modes, over the threads.
    ///
    /// `at(position, direction cell, out)` writes the values of all modes at one sample over zeros.
    pub fn tabulate(
        &self,
        modes: usize,
        at: impl Fn(usize, usize, &mut [f64]) + Sync,
    ) -> Matrix<f64> {
        let directions = self.direction_count();
        let chunks: Vec<Vec<f64>> = (0..self.positions * self.positions)
            .into_par_iter()
            .map(|position| {
                let mut chunk = vec![0.0; directions * modes];
                for (direction, out) in chunk.chunks_exact_mut(modes.max(1)).enumerate() {
                    at(position, direction, out);
                }
                chunk
            })
            .collect();
        let mut data = vec![0.0; self.sample_count() * modes];
        if modes > 0 {
            data.par_chunks_exact_mut(self.sample_count())
                .enumerate()
                .for_each(|(mode, column)| {
                    for (chunk, part) in chunks.iter().zip(column.chunks_exact_mut(directions)) {
                        for (direction, value) in part.iter_mut().enumerate() {
                            *value = chunk[direction * modes + mode];
                        }
                    }
                });
        }
        Matrix::from_column_major(self.sample_count(), modes, data)
    }
}

/// The two of n cells between whose centres x in [0, 1] lies, with weights.
fn bracket(x: f64, n: usize) -> [(usize, f64); 2] {
    let x = x * n as f64 - 0.5;
    let low = x.floor();
    let weight = x - low;
    let clamp = |k: f64| k.clamp(0.0, (n - 1) as f64) as usize;
    [(clamp(low), 1.0 - weight), (clamp(low + 1.0), weight)]
}

/// The rotation about +Y that takes the canonical interface's heading +z to `heading`, a side
/// direction.
pub fn turn_to_heading(heading: Face) -> CubeRotation {
    CubeRotation::about_y_to(heading).unwrap_or(CubeRotation::IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> LightfieldGrid {
        LightfieldGrid::on_squares(&LightfieldConfig {
            positions: 4,
            directions: 6,
            super_samples: 2,
            ..LightfieldConfig::default()
        })
    }

    #[test]
    fn weights_measure_the_flux_of_unit_radiance() {
        let grid = grid();
        let flux: f64 = (0..grid.sample_count())
            .map(|s| grid.root_weight(s) * grid.root_weight(s))
            .sum();
        // The mean cosine over equal solid angles is 1/2. It is 1 - max(a, b)² on the square, whose
        // midpoint rule over n² cells is too large by the fraction 2/n²; n is 6 cells of 2 super-samples.
        let excess = flux / PI - 1.0;
        assert!((excess - 2.0 / 144.0).abs() < 1e-12, "{excess}");
    }

    #[test]
    fn interpolation_is_exact_at_samples_and_weights_add_up() {
        let grid = grid();
        let direction = uniform_hemisphere_from_square(cell_center(6, 2, 4));
        let taps = grid.taps(grid.position(7), direction);
        let at_sample: f64 = taps
            .iter()
            .filter(|(sample, _)| *sample == 7 * 36 + 2 * 6 + 4)
            .map(|(_, weight)| weight)
            .sum();
        // The hemisphere map and its inverse lose a few digits.
        assert!((at_sample - 1.0).abs() < 1e-9);
        let total: f64 = taps.iter().map(|(_, weight)| weight).sum();
        assert!((total - 1.0).abs() < 1e-12);
    }
}
