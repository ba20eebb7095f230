//! Whose operators a warped block uses.

/// Which transport a warped block uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum WarpTransport {
    /// The canonical shape's, as it is.
    #[default]
    Canonical,
    /// Coefficients of the canonical shape, whose light is gathered anew on the warped walls.
    Regathered,
    /// Everything computed for the warped shape.
    Rebuilt,
}

impl WarpTransport {
    /// From the cheapest to the best.
    pub const ALL: [WarpTransport; 3] = [
        WarpTransport::Canonical,
        WarpTransport::Regathered,
        WarpTransport::Rebuilt,
    ];

    /// "canonical", "regathered" or "rebuilt".
    pub fn name(self) -> &'static str {
        match self {
            WarpTransport::Canonical => "canonical",
            WarpTransport::Regathered => "regathered",
            WarpTransport::Rebuilt => "rebuilt",
        }
    }

    /// Inverse of [`WarpTransport::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.name() == name)
    }
}
