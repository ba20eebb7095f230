//! Frames: solving one in a call, and all that it shows.

use crate::irradiance::by_texel;
use mrt_runtime::low_level::modular::frame::report::FrameWork;
use mrt_runtime::shadows::{Openings, Visibility};
use mrt_runtime::{Bounces, Frame, FrameConfig, FrameReport, Light, Outputs, Scene};

/// Bounces until `f32` rounding hides the next one.
pub const CONVERGED: Bounces = Bounces::Converged {
    tolerance: 1e-6,
    limit: 2000,
};

/// A new frame with the default outputs, solved with the openings' shadows.
pub fn solved(scene: &Scene, lights: &[Light], bounces: Bounces) -> Frame {
    let mut frame = Frame::new(scene, FrameConfig::default());
    frame.light_with(lights, bounces);
    frame
}

/// A new frame with these outputs and otherwise default settings.
pub fn with_outputs(scene: &Scene, outputs: Outputs) -> Frame {
    let config = FrameConfig {
        outputs,
        ..FrameConfig::default()
    };
    Frame::new(scene, config)
}

/// A new frame, solved with direct irradiance 1 W/m² on all texels.
pub fn uniformly_lit(scene: &Scene, bounces: Bounces) -> Frame {
    let mut frame = Frame::new(scene, FrameConfig::default());
    frame.light_from(&vec![1.0; 3 * scene.texel_count()], bounces);
    frame
}

/// What tests ask of a frame, in one call.
pub trait FrameForTests {
    /// Solves with these lights and no others. None of them may be skipped.
    fn light_with(&mut self, lights: &[Light], bounces: Bounces) -> FrameReport {
        self.light_through(lights, &Openings, bounces)
    }

    /// As [`FrameForTests::light_with`], with other shadows.
    fn light_through(
        &mut self,
        lights: &[Light],
        visibility: &impl Visibility,
        bounces: Bounces,
    ) -> FrameReport;

    /// Solves with direct light that the test computed.
    fn light_from(&mut self, direct: &[f32], bounces: Bounces) -> FrameReport;

    /// How much the last frame computed.
    fn work(&self) -> FrameWork;

    /// A copy of the direct irradiance of all texels.
    fn direct(&self) -> Vec<f32>;

    /// A copy of the indirect irradiance of all texels.
    fn indirect(&self) -> Vec<f32>;

    /// A copy of the coefficients b of all blocks.
    fn coefficients(&self) -> Vec<f32>;
}

impl FrameForTests for Frame {
    fn light_through(
        &mut self,
        lights: &[Light],
        visibility: &impl Visibility,
        bounces: Bounces,
    ) -> FrameReport {
        self.set_lights(lights);
        self.set_bounces(bounces);
        let report = self.solve_with(visibility);
        assert_eq!(report.skipped_lights(), [], "all lights shine");
        report
    }

    fn light_from(&mut self, direct: &[f32], bounces: Bounces) -> FrameReport {
        self.set_bounces(bounces);
        self.solve_from_direct(direct)
            .expect("the direct light is sound")
    }

    fn work(&self) -> FrameWork {
        self.last_report().work()
    }

    fn direct(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.copy_direct_to(&mut copy);
        copy
    }

    fn indirect(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.copy_indirect_to(&mut copy);
        copy
    }

    fn coefficients(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.copy_coefficients_to(&mut copy);
        copy
    }
}

/// All outputs of a frame, by name.
pub fn outputs(frame: &Frame) -> [(&'static str, Vec<f32>); 6] {
    let probes = frame.probes().map(|p| p.values().as_flattened().to_vec());
    [
        ("direct", frame.direct()),
        ("coefficients", frame.coefficients()),
        ("indirect", frame.indirect()),
        (
            "lightmap",
            frame.lightmap().pixels().as_flattened().to_vec(),
        ),
        ("probes", probes.unwrap_or_default()),
        ("vector", frame.vector().to_vec()),
    ]
}

/// The bits of all outputs of a frame, by name.
pub fn shown(frame: &Frame) -> Vec<(&'static str, Vec<u32>)> {
    let outputs = outputs(frame).into_iter();
    outputs
        .map(|(name, values)| (name, values.into_iter().map(f32::to_bits).collect()))
        .collect()
}

/// The first number that two frames show differently: output, index and both values. `None` if all bits are the same.
pub fn difference(a: &Frame, b: &Frame) -> Option<String> {
    for ((name, a), (_, b)) in shown(a).into_iter().zip(shown(b)) {
        assert_eq!(a.len(), b.len(), "{name}");
        let differ = a.iter().zip(&b).filter(|(a, b)| a != b).count();
        if let Some(k) = a.iter().zip(&b).position(|(a, b)| a != b) {
            let (a, b) = (f32::from_bits(a[k]), f32::from_bits(b[k]));
            return Some(format!("{name}[{k}]: {a:e}, {b:e} ({differ} differ)"));
        }
    }
    None
}

/// Indirect irradiance of all texels in the first channel, in the order of the scene's texels.
pub fn red(frame: &Frame) -> Vec<f64> {
    let light = by_texel(frame.scene(), &frame.indirect());
    light.iter().map(|e| f64::from(e[0])).collect()
}
