//! bakes
