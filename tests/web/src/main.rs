//! Prints the number that the native program computes.

fn main() {
    println!("{}", mrt_web_test::mean_of_lightmap());
}
