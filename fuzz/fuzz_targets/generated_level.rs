//! Levels, colours, lights and changes made of bytes: frames stay finite, and light never multiplies.

#![no_main]

mrt_fuzz::fuzzer!(mrt_tests::harness::generated_level::TARGET);
