//! Dictionary files: read, written again, and used to light levels.

#![no_main]

mrt_fuzz::fuzzer!(mrt_tests::harness::dictionary::TARGET);
