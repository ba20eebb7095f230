//! The exact first bounce at a sample of a level's texels.

mod error;
mod plan;
mod problem;
mod window;

pub use error::ExactLightError;

use super::lit_maze::LitMaze;
use super::sampled_texel::SampledTexel;
use mrt_core::container::write_file_atomically;
use mrt_dictionary::progress::Progress;
use plan::Plan;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Sampled texels of a level, roughly.
const TEXELS: usize = 2500;

/// Changes whenever a change of the code changes solutions, so that older files are not found.
const REVISION: u32 = 1;

/// Exact light of a level.
#[derive(Clone, Debug)]
pub struct ExactLight {
    /// Sampled texels.
    pub texels: Vec<SampledTexel>,
    /// First-bounce indirect irradiance of each, W/m², RGB.
    pub irradiance: Vec<[f64; 3]>,
}

/// What is kept on disk.
#[derive(Serialize, Deserialize)]
struct Kept {
    irradiance: Vec<[f64; 3]>,
}

impl ExactLight {
    /// The exact light of a maze at the texels of a resolution, from a file in `folder` if it was computed before.
    ///
    /// # Errors
    /// [`ExactLightError`].
    pub fn load_or_solve(
        maze: &LitMaze,
        resolution: usize,
        folder: &Path,
        progress: &Progress,
    ) -> Result<Self, ExactLightError> {
        let plan = Plan::new(maze, resolution, TEXELS);
        let texels = plan.texels();
        let inputs = format!(
            "{REVISION} {resolution} {:?} {texels:?} {}",
            maze.lights,
            maze.level.to_text()?
        );
        let name = format!("{}-{:016x}.json", maze.name, fnv1a(inputs.as_bytes()));
        let path = folder.join(name);
        if let Some(irradiance) = read_kept(&path)
            && irradiance.len() == texels.len()
        {
            return Ok(Self { texels, irradiance });
        }
        let irradiance = plan.solve(progress)?;
        let kept = serde_json::to_vec(&Kept {
            irradiance: irradiance.clone(),
        })?;
        write_file_atomically(&path, &kept)?;
        Ok(Self { texels, irradiance })
    }

    /// Relative L2 error over the level of irradiance at the sampled texels.
    pub fn rel_l2(&self, found: &[[f64; 3]]) -> f64 {
        let (mut miss, mut size) = (0.0, 0.0);
        let pairs = found.iter().zip(&self.irradiance).zip(&self.texels);
        for ((found, exact), texel) in pairs {
            for (a, b) in found.iter().zip(exact) {
                miss += texel.weight * (a - b) * (a - b);
                size += texel.weight * b * b;
            }
        }
        (miss / size).sqrt()
    }

    /// Sum of the irradiance found over the exact sum, all channels together.
    pub fn flux_ratio(&self, found: &[[f64; 3]]) -> f64 {
        let flux = |values: &[[f64; 3]]| -> f64 {
            let weighted = values.iter().zip(&self.texels);
            weighted
                .map(|(e, texel)| texel.weight * e.iter().sum::<f64>())
                .sum()
        };
        flux(found) / flux(&self.irradiance)
    }
}

/// `None` for files that cannot be read, whose contents are computed again.
fn read_kept(path: &Path) -> Option<Vec<[f64; 3]>> {
    let bytes = std::fs::read(path).ok()?;
    let kept: Kept = serde_json::from_slice(&bytes).ok()?;
    Some(kept.irradiance)
}

fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests;
