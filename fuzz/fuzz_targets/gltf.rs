//! GLB and glTF files.

#![no_main]

mrt_fuzz::fuzzer!(mrt_tests::harness::scene_mesh::GLTF);
