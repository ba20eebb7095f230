//! Levels as text, and their text again.

#![no_main]

mrt_fuzz::fuzzer!(mrt_tests::harness::level_text::TARGET);
