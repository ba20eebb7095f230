//! Reference files, and what is computed from them.

#![no_main]

mrt_fuzz::fuzzer!(mrt_tests::harness::reference_file::TARGET);
