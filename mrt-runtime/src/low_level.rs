//! The parts behind the names at the root, for tools and bakes. They follow the needs of this workspace: any release
//! may change, move or remove any of them.

/// Shapes, blocks, the checks of a level, and levels ready to be lit.
pub mod level {
    pub use crate::level::*;
}

/// Lights, their shadows, and direct light at texels.
pub mod light {
    pub use crate::light::*;
}

/// Layout of texels, lightmap and probes.
pub mod output {
    pub use crate::output::*;
}

/// Dictionaries, assembly, packed operators and the frame of Modular Radiance Transfer.
pub mod modular {
    pub use crate::modular::*;
}
