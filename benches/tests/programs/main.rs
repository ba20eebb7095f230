//! The programs `mrt-bench` and `mrt-figures` as a user meets them: exit codes, messages, reports and files.

mod bench;
mod common;
mod figures;
