//! Which operators light a warped block.

/// Which operators light a warped block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum WarpTransport {
    /// Operators of the canonical shape, unchanged.
    #[default]
    Canonical,
    /// Coefficients of the canonical shape; their light is gathered anew on the warped walls.
    Regathered,
    /// All operators computed for the warped shape.
    Rebuilt,
}

impl WarpTransport {
    /// All kinds, from the cheapest to the most accurate.
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

    /// The kind with that [`name`](WarpTransport::name); `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.name() == name)
    }
}
