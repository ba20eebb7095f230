//! The frame of `mrt light`.

use super::args::{LightArgs, Shadows};
use super::error::LightCommandError;
use crate::cli::dictionary_source::load;
use crate::render::placement::{Surroundings, block_width};
use glam::DVec3;
use mrt_runtime::shadows::Rays;
use mrt_runtime::{AssembleConfig, Bounces, Frame, FrameConfig, FrameReport, Level, Light, Scene};
use std::time::Instant;

/// When all bounces are asked for, passes end when one changes light by less than this share.
const CONVERGED: Bounces = Bounces::Converged {
    tolerance: 1e-3,
    limit: 64,
};

/// How far a block's wall may stand behind the real surface, in widths of the smallest block, before a shadow ray takes the
/// surface for something in the way.
const WALL_SLACK: f64 = 0.15;

/// A solved frame, and how long it took.
pub(super) struct Solved {
    pub(super) frame: Frame,
    pub(super) passes: u32,
    pub(super) dictionary_seconds: f64,
    pub(super) assemble_seconds: f64,
    pub(super) frame_milliseconds: f64,
}

/// Finds the dictionary, assembles the level and solves one frame.
pub(super) fn solve(
    args: &LightArgs,
    level: &Level,
    lamps: &[Light],
    surroundings: &Surroundings<'_>,
) -> Result<Solved, LightCommandError> {
    let start = Instant::now();
    let dictionary = load(args.dictionary.as_deref(), args.preset.as_deref())?;
    let after_dictionary = Instant::now();
    let scene = Scene::assemble(level, &dictionary, &AssembleConfig::default())?;
    let after_assembly = Instant::now();
    let config = FrameConfig {
        bounces: args.bounces.map_or(CONVERGED, Bounces::Count),
        ..FrameConfig::default()
    };
    let mut frame = Frame::new(&scene, config);
    let frame_start = Instant::now();
    let report = solve_frame(&mut frame, lamps, surroundings, args.shadows);
    report.require_all_lights()?;
    Ok(Solved {
        frame,
        passes: report.passes(),
        dictionary_seconds: (after_dictionary - start).as_secs_f64(),
        assemble_seconds: (after_assembly - after_dictionary).as_secs_f64(),
        frame_milliseconds: frame_start.elapsed().as_secs_f64() * 1e3,
    })
}

fn solve_frame(
    frame: &mut Frame,
    lamps: &[Light],
    surroundings: &Surroundings<'_>,
    shadows: Shadows,
) -> FrameReport {
    frame.set_lights(lamps);
    match shadows {
        Shadows::Openings => frame.solve(),
        Shadows::Rays => {
            let blocks = frame.scene().level.blocks.iter();
            let widths = blocks.map(|block| block_width(&block.warp));
            let slack = WALL_SLACK * widths.fold(f64::MAX, f64::min);
            frame.solve_with(&Rays(|receiver: DVec3, light: DVec3| {
                // From the light, and short of the receiver: a block's wall stands a little behind the real one.
                // The sun is far away, where f32 is coarse: nothing stands beyond the mesh's size.
                let towards = receiver - light;
                let towards = towards.clamp_length_max(f64::from(surroundings.reach()));
                let start = (receiver - towards).as_vec3();
                let reach = 1.0 - slack / towards.length();
                let bvh = surroundings.bvh;
                let is_blocked =
                    reach > 0.0 && bvh.is_occluded(start, towards.as_vec3(), reach as f32);
                if is_blocked { 0.0 } else { 1.0 }
            }))
        }
    }
}
