//! What figures are drawn from.

use mrt_runtime::Dictionary;

/// What figures are drawn from.
pub(super) struct FigureSource<'a> {
    pub(super) dictionary: &'a Dictionary,
    /// Further presets to compare.
    pub(super) presets: &'a [String],
    /// Texels along an edge of a wall where a figure computes its own transport.
    pub(super) resolution: usize,
}
