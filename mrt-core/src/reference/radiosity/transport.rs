//! The one-bounce operator of a level: irradiance at every texel centre from the radiosity of every
//! texel, in closed form.
//!
//! From each receiving point a cone is carried from block to block. In a block it cuts the wall texels.
//! Through each opening it goes on, narrowed to the part of the opening that it reaches. In a level of
//! convex blocks every ray crosses one sequence of blocks, so the parts neither overlap nor leave
//! anything out: in a closed level each row adds up to 1.

use super::error::{ExactError, check_length};
use super::gather::{Gather, wall_grids};
use super::quarters::{Quarters, mean_of_quarters};
use super::row::Row;
use super::scene::ExactScene;
use rayon::prelude::*;

/// A row-compressed matrix of form factors, receiving texels x sending texels.
///
/// Factors are stored as `f32`: their rounding, 6e-8 of each, is far below the error of a level's
/// discretisation, and the largest test level takes 0.3 GB instead of 0.6.
#[derive(Clone, Debug)]
pub struct Transport {
    rows: Vec<Row>,
}

impl Transport {
    /// Computes all form factors, in parallel. Each depends on its receiver alone, so the result does
    /// not depend on the number of threads.
    ///
    /// Cost: about 40 ns for each pair of texels that see each other.
    pub fn build(scene: &ExactScene) -> Self {
        let grids = wall_grids(scene);
        let rows = (0..scene.texel_count())
            .into_par_iter()
            .map_init(
                || Gather::new(scene, &grids),
                |gather, texel| gather.row(texel),
            )
            .collect();
        Self { rows }
    }

    /// Number of rows and of columns, which is that of the level's texels.
    pub fn texel_count(&self) -> usize {
        self.rows.len()
    }

    /// Bytes of the stored factors.
    pub fn bytes(&self) -> usize {
        self.rows.iter().map(Row::bytes).sum()
    }

    /// Form factor from a receiving texel centre to a sending texel, in [0, 1].
    ///
    /// # Panics
    /// If a texel does not exist.
    pub fn factor(&self, receiver: usize, sender: usize) -> f64 {
        assert!(sender < self.rows.len(), "sender {sender} does not exist");
        self.rows[receiver].factor(sender)
    }

    /// Irradiance at texel centres, W/m², from the radiosity of every texel's [`Quarters`].
    ///
    /// Sums are `f64`, in the order of the senders.
    ///
    /// # Errors
    /// [`ExactError::Length`] if there is not one value for each texel.
    pub fn irradiance(&self, radiosity: &[Quarters]) -> Result<Vec<f64>, ExactError> {
        check_length("radiosity", self.rows.len(), radiosity.len())?;
        let means: Vec<f64> = radiosity.iter().map(mean_of_quarters).collect();
        let rows = self.rows.par_iter();
        Ok(rows.map(|row| row.gather(&means, radiosity)).collect())
    }
}

/// Irradiance at the centres of some texels from several radiosities, without storing the transport:
/// one vector for each receiver, with one value for each radiosity.
///
/// # Errors
/// [`ExactError::Length`] if a radiosity does not have one value for each texel.
///
/// # Panics
/// If a receiver does not exist.
pub fn irradiance_at(
    scene: &ExactScene,
    receivers: &[usize],
    radiosities: &[Vec<Quarters>],
) -> Result<Vec<Vec<f64>>, ExactError> {
    for radiosity in radiosities {
        check_length("radiosity", scene.texel_count(), radiosity.len())?;
    }
    let grids = wall_grids(scene);
    let means: Vec<Vec<f64>> = radiosities
        .iter()
        .map(|radiosity| radiosity.iter().map(mean_of_quarters).collect())
        .collect();
    Ok(receivers
        .par_iter()
        .map_init(
            || Gather::new(scene, &grids),
            |gather, &texel| {
                let row = gather.row(texel);
                let pairs = means.iter().zip(radiosities);
                pairs.map(|(means, r)| row.gather(means, r)).collect()
            },
        )
        .collect())
}
