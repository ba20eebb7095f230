//! Everything that a frame shows is a number.

use crate::frames::FrameForTests;
use mrt_runtime::{Frame, FrameReport};

/// Panics if something that a frame shows is not finite, or if light is negative.
pub(super) fn assert_sound(frame: &Frame) {
    for (what, irradiance) in [("direct", frame.direct()), ("indirect", frame.indirect())] {
        let faulty = irradiance
            .iter()
            .position(|e| !(e.is_finite() && *e >= 0.0));
        if let Some(at) = faulty {
            panic!("{what} irradiance {at} is {}", irradiance[at]);
        }
    }
    let coefficients = frame.coefficients();
    assert!(coefficients.iter().all(|b| b.is_finite()), "coefficients");
    assert!(frame.vector().iter().all(|e| e.is_finite()), "vector");
    let pixels = frame.lightmap().pixels();
    assert!(pixels.iter().flatten().all(|e| e.is_finite()), "lightmap");
    let probes = frame.probes().map_or(&[][..], |probes| probes.values());
    assert!(probes.iter().flatten().all(|c| c.is_finite()), "probes");
}

/// Writes every changed tile and all probes in each format of pixels, which must not panic.
pub(super) fn write_pixels(frame: &Frame, report: &FrameReport) {
    let (mut halves, mut shared) = (Vec::new(), Vec::new());
    for tile in report.changed_tiles() {
        frame.lightmap().write_rgba16f(tile, &mut halves);
        frame.lightmap().write_rgb9e5(tile, &mut shared);
    }
    if let Some(probes) = frame.probes() {
        probes.write_f16(&mut Vec::new());
    }
}
