//! Damaged, absurd and hostile input.

mod dictionaries;
mod files;
mod levels;
mod references;
