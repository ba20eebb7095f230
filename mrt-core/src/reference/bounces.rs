//! Which reflections a reference holds.

/// How many diffuse reflections an indirect irradiance contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounces {
    /// Light that was reflected once.
    First,
    /// Light that was reflected at least once and at most this often.
    Count(usize),
    /// Light that was reflected at least once.
    All,
}
