//! From direct light to indirect irradiance, through any number of bounces.

use super::error::{ExactError, check_length};
use super::krylov::solve_gain;
use super::quarters::{Quarters, quarters_from_centers};
use super::scene::ExactScene;
use super::transport::Transport;
use crate::reference::bounces::ReferenceBounces;

/// Relative residual of the solution for all bounces.
pub const ALL_BOUNCES_TOLERANCE: f64 = 1e-7;

/// Indirect irradiance at texel centres, W/m².
///
/// `direct` is the direct irradiance ([`direct_quarters`](super::direct::direct_quarters)). `albedo`
/// holds one value for each texel, in [0, 1], and below 1 for [`ReferenceBounces::All`].
///
/// # Errors
/// - [`ExactError::Length`] if an input does not have one value for each texel.
/// - [`ExactError::Albedo`] for an albedo out of range.
/// - [`ExactError::NotConverged`] if [`ReferenceBounces::All`] misses [`ALL_BOUNCES_TOLERANCE`].
pub fn solve(
    scene: &ExactScene,
    transport: &Transport,
    direct: &[Quarters],
    bounces: ReferenceBounces,
    albedo: &[f64],
) -> Result<Vec<f64>, ExactError> {
    check_length("direct light", scene.texel_count(), direct.len())?;
    check_length("the list of albedos", scene.texel_count(), albedo.len())?;
    check_albedo(albedo, bounces)?;
    let reflect = |arriving: &[Quarters]| {
        let sent: Vec<Quarters> = arriving
            .iter()
            .zip(albedo)
            .map(|(quarters, a)| quarters.map(|e| e * a))
            .collect();
        transport.irradiance(&sent)
    };
    let bounce_again = |centers: &[f64]| reflect(&quarters_from_centers(scene, centers));
    let first = reflect(direct)?;
    match bounces {
        ReferenceBounces::First => Ok(first),
        ReferenceBounces::Count(0) => Ok(vec![0.0; first.len()]),
        ReferenceBounces::Count(count) => {
            let mut sum = first.clone();
            let mut newest = first;
            for _ in 1..count {
                newest = bounce_again(&newest)?;
                for (s, e) in sum.iter_mut().zip(&newest) {
                    *s += e;
                }
            }
            Ok(sum)
        }
        ReferenceBounces::All => solve_gain(bounce_again, &first, ALL_BOUNCES_TOLERANCE),
    }
}

/// [`solve`] for three channels of albedo and white light: irradiance by texel and channel.
///
/// # Errors
/// As [`solve`].
pub fn solve_rgb(
    scene: &ExactScene,
    transport: &Transport,
    direct: &[Quarters],
    bounces: ReferenceBounces,
    albedo: &[[f64; 3]],
) -> Result<Vec<[f64; 3]>, ExactError> {
    let mut irradiance = vec![[0.0; 3]; scene.texel_count()];
    for channel in 0..3 {
        let albedo: Vec<f64> = albedo.iter().map(|rgb| rgb[channel]).collect();
        let solved = solve(scene, transport, direct, bounces, &albedo)?;
        for (rgb, e) in irradiance.iter_mut().zip(solved) {
            rgb[channel] = e;
        }
    }
    Ok(irradiance)
}

/// Refuses an albedo for which there is no solution.
fn check_albedo(albedo: &[f64], bounces: ReferenceBounces) -> Result<(), ExactError> {
    let all = bounces == ReferenceBounces::All;
    let is_allowed = |a: f64| (0.0..=1.0).contains(&a) && !(all && a == 1.0);
    match albedo.iter().position(|&a| !is_allowed(a)) {
        None => Ok(()),
        Some(texel) => Err(ExactError::Albedo {
            at: format!("texel {texel}"),
            bound: if all {
                "below 1 for all bounces"
            } else {
                "at most 1"
            },
            found: albedo[texel],
        }),
    }
}
