//! The frame's kernels one by one, and dense products by the kernels and by libraries: `cargo bench -p mrt-benches
//! --bench kernels`, with `--features faer` for one library more.
//!
//! Every answer is compared with sums in `f64` before it is timed. Rates count products of two numbers. The fastest
//! instructions of the machine are used, or those that the variable `MRT_SIMD` names. `u16` stands for `f16`.

#![allow(
    missing_docs,
    reason = "names of benchmarks say what they measure; the macro leaves public items behind"
)]

mod dense_products;
mod folding;
mod instructions;
mod numbers;
mod rows;
mod tiles;

fn main() {
    println!("instructions: {}", instructions::level().name());
    divan::main();
}
