//! Lightfields at openings and the operators between them (Loos et al. 2011, section 5.1).

pub mod grid;
pub mod transfer;
pub mod symmetries;
pub mod basis;
pub mod interface;
pub mod wall_response;
