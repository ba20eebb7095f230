//! The two ends of a path: the cube that its light leaves, the cube that its light enters, and how both stand to the
//! shapes of a set.

use mrt_core::geometry::cube::Face;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::{Aperture, Outline, WallForm};
use mrt_runtime::low_level::modular::path::frame_of_heading;

/// The cube that light leaves through z = 1.
pub static EMITTER: Shape = Shape {
    name: "emitter",
    form: WallForm::Cube,
    openings: &[Aperture {
        face: Face::PosZ,
        outline: Outline::Whole,
    }],
};

/// The cube that light enters through z = 0.
pub static RECEIVER: Shape = Shape {
    name: "receiver",
    form: WallForm::Cube,
    openings: &[Aperture {
        face: Face::NegZ,
        outline: Outline::Whole,
    }],
};

/// How the canonical frame of a path stands at an opening of a shape.
///
/// Paths are mirrored and turned until they are canonical words. In sets with openings up and down that may exchange x
/// and y, so emission and response are known in both frames there, in the order of [`PathFrame::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathFrame {
    /// As [`frame_of_heading`] has it: +y stays up for headings to the side.
    Upright,
    /// As upright, with x and y of the path exchanged.
    Exchanged,
}

impl PathFrame {
    /// Both frames.
    pub const ALL: [PathFrame; 2] = [PathFrame::Upright, PathFrame::Exchanged];

    /// Takes the canonical frame of a path, in which light heads for +z, to the frame of a shape, in which light crosses
    /// the opening with `heading`.
    pub fn of_heading(self, heading: Face) -> CubeSymmetry {
        let frame = frame_of_heading(heading);
        match self {
            PathFrame::Upright => frame,
            PathFrame::Exchanged => frame.after(CubeSymmetry::exchange(0, 1)),
        }
    }
}
