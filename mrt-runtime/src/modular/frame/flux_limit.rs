//! A limit of flux that keeps bounces from growing without end.

use crate::modular::frame::light_buffers::LightBuffers;
use crate::modular::frame::schedule::Schedule;
use crate::modular::scene::SceneData;

/// More flux than left the walls may arrive, by this share of reflected direct light and emission. Irradiance is
/// sampled at texel centres, and the mean of the samples differs from the mean over the wall where light comes from
/// nearby: by 0.1 % for even light at 3² texels. Without this margin, exact operators would be scaled, and the light of
/// several lamps would not add up.
const SPOT_GAIN: f64 = 0.05;

/// While blocks wait, this many times the most flux that left the walls may arrive: a lamp that moved lights its old
/// and its new place until both are up to date.
const WAITING_GAIN: f64 = 2.0;

/// Scales a channel down if more flux arrives on all walls than left them. Returns how many channels were scaled.
///
/// Exact transport never needs it. With truncated operators, bounces could grow without end; with the limit, the flux
/// of indirect light falls by the largest albedo at each bounce, in every level. Direct light and emission have a
/// margin of [`SPOT_GAIN`]. Areas are those of the canonical blocks.
///
/// While blocks wait for their light ([`FrameConfig::slice`](crate::modular::frame::config::FrameConfig::slice)), some
/// of the flux that arrived is from earlier frames, and may rightly exceed the flux that leaves now. The limit is then
/// [`WAITING_GAIN`] times the most flux that left the walls since no block waited.
pub(super) fn limit_flux(
    scene: &SceneData,
    blocks: &mut Schedule,
    light: &mut LightBuffers,
    nothing_waits: bool,
) -> usize {
    let mut limited = 0;
    let layout = &scene.layout;
    // Sums always in the same order, whichever blocks were lit first.
    blocks.alive.sort_unstable();
    let (mut sent, mut arrived) = ([0.0; 3], [0.0; 3]);
    for &block in &blocks.alive {
        let state = &blocks.state[block.get()];
        // Light that was kept may be brighter than its present joint coefficients.
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
