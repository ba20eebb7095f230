//! Things that a chart is drawn of, for any writer.

use crate::canvas::{Colour, TextStyle};

/// Pixels across and down.
pub const SIZE: [i32; 2] = [1120, 640];

/// Inside the axes: left, top, right, bottom.
pub(super) const AREA: [f32; 4] = [84.0, 96.0, 850.0, 570.0];

/// Something to draw.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A line.
    Line {
        /// Start.
        from: [f32; 2],
        /// End.
        to: [f32; 2],
        /// Pixels.
        width: f32,
        /// Its colour.
        colour: Colour,
    },
    /// A disk.
    Disk {
        /// Centre.
        at: [f32; 2],
        /// Pixels.
        radius: f32,
        /// Its colour.
        colour: Colour,
    },
    /// A line of text.
    Text {
        /// The point at which it stands, at half its height.
        at: [i32; 2],
        /// How it stands and looks.
        style: TextStyle,
        /// Its words.
        text: String,
    },
}
