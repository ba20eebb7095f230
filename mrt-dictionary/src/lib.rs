//! mrt-dictionary
