//! mrt-runtime
