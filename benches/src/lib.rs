//! Two programs for whoever works on mrt: `mrt-bench` measures run time against error, and `mrt-figures` draws the
//! pictures of `docs/FIGURES.md`. Both report as the tool `mrt` does.

pub mod canvas;
pub mod bench;
pub mod figures;
