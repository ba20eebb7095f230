//! The parts behind the names at the root, for tools and bakes. They follow the needs of this workspace: any of them may
//! change, move or go in any release.

/// Shapes, blocks, checks, and levels whose blocks stand ready to be lit.
pub mod level {
    pub use crate::level::*;
}

/// Lights, their shadows, and direct light at texels.
pub mod light {
    pub use crate::light::*;
}

/// Texel layout, lightmap and probes.
pub mod output {
    pub use crate::output::*;
}

/// Dictionaries, assembly, packed operators and the frame of Modular Radiance Transfer.
pub mod modular {
    pub use crate::modular::*;
}
