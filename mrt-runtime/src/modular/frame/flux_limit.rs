//! Bounces must not grow without end.

use crate::modular::frame::light_buffers::LightBuffers;
use crate::modular::frame::schedule::Schedule;
use crate::modular::scene::SceneData;

/// Share by which more may arrive of direct light that left the walls, and of what they emit: irradiance is that at
/// texel centres, whose mean differs from a wall's where light comes from nearby. At 3² texels that is 0.1 % for even
/// light, and without it exact operators would be scaled, and lights not add up.
const SPOT_GAIN: f64 = 0.05;

/// What arrived may be this many times the most that left, while blocks wait: a lamp that moves lights its old place and
/// its new one, until both are up to date.
const WAITING_GAIN: f64 = 2.0;

/// Scales a channel down where more flux would arrive on all walls than left them.
///
/// Exact transport never does that. Where truncated operators did, bounces would grow without end; so the flux of
/// indirect light falls by the largest albedo at each bounce, whatever the level. Direct light and what walls emit
/// have some [`SPOT_GAIN`]. Areas are those of the canonical blocks.
///
/// While blocks wait for their light ([`FrameConfig::slice`](crate::modular::frame::config::FrameConfig)), what arrived is partly of earlier
/// frames, and more than leaves now may be right. [`WAITING_GAIN`] times the most that left since nothing waited is then
/// the limit.
///
/// Returns how many channels were scaled.
pub(super) fn limit_flux(
    scene: &SceneData,
    blocks: &mut Schedule,
    light: &mut LightBuffers,
    nothing_waits: bool,
) -> usize {
    let mut limited = 0;
    let layout = &scene.layout;
    // Sums in one order, whichever blocks came to have light first.
    blocks.alive.sort_unstable();
    let (mut sent, mut arrived) = ([0.0; 3], [0.0; 3]);
    for &block in &blocks.alive {
        let state = &blocks.state[block.get()];
        // What arrived may be of joint coefficients that were more.
        let shape = &scene.shapes[layout.shape(block)];
        let lag = f64::from(state.lag * shape.area);
        for channel in 0..3 {
            sent[channel] += state.sent[channel] + SPOT_GAIN * state.fresh[channel] + lag;
            arrived[channel] += state.arrived[channel];
        }
    }
    for (channel, (mut sent, arrived)) in sent.into_iter().zip(arrived).enumerate() {
        let most = &mut blocks.most_sent[channel];
        if nothing_waits {
            *most = sent;
        } else {
            *most = most.max(sent);
            sent = *most * WAITING_GAIN;
        }
        if arrived <= sent {
            continue;
        }
        let scale = sent / arrived;
        limited += 1;
        for k in 0..blocks.alive.len() {
            let block = blocks.alive[k];
            let state = &mut blocks.state[block.get()];
            if !state.has_indirect {
                continue;
            }
            state.arrived[channel] *= scale;
            let plane = &mut light.indirect.channels_mut()[channel][layout.slots(block)];
            plane.iter_mut().for_each(|e| *e *= scale as f32);
            let joint = &mut light.joint[scene.rows.of_block(block)];
            let rows = scene.rows.count;
            let joint = &mut joint[channel * rows..(channel + 1) * rows];
            joint.iter_mut().for_each(|c| *c *= scale as f32);
            blocks.mark_changed(block);
        }
        // Scaling invalidates every cached block: the next pass computes all of them anew.
        blocks.all_stale = true;
    }
    limited
}
