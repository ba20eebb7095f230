//! OBJ files and their libraries.

#![no_main]

mrt_fuzz::fuzzer!(mrt_tests::harness::scene_mesh::OBJ);
