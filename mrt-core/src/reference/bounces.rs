//! Which reflections a reference contains.

/// How many diffuse reflections an indirect irradiance contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceBounces {
    /// Light that was reflected exactly once.
    First,
    /// Light that was reflected at least once and at most this number of times.
    Count(usize),
    /// Light that was reflected at least once.
    All,
}
