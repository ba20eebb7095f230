//! What this machine can do at most, measured in the same process as what it is compared with.

use super::timing::fastest;
use mrt_core::simd::{Kernel, Lanes, SimdLevel};
use std::hint::black_box;
use std::time::Duration;

/// Sums that a core can keep going at once: four cycles of latency times two units is eight, and some are spare.
const ACCUMULATORS: usize = 12;

/// Products and sums of a lane in one call: long against the clock's resolution, short against a time slice.
const STEPS: usize = 20_000;

/// Numbers in the large buffer: 256 MiB, far more than the caches of one core reach.
const LARGE: usize = 64 << 20;

/// Numbers in the small buffer: 256 KiB, in the second level of any cache of the last ten years.
const SMALL: usize = 64 << 10;

/// Time spent on each figure.
const BUDGET: Duration = Duration::from_millis(120);

/// Limits of one core.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Floating-point operations a second in units of 1e9, a fused product and sum being two, of each level.
    pub gflops: Vec<(SimdLevel, f64)>,
    /// GB/s read from memory.
    pub memory: f64,
    /// GB/s read from a buffer that stays in the caches.
    pub cache: f64,
}

impl Machine {
    /// Measures all levels that there are; takes about a second.
    pub fn measure() -> Self {
        let level = SimdLevel::detect();
        let large = vec![1.0f32; LARGE];
        let small = vec![1.0f32; SMALL];
        Self {
            gflops: SimdLevel::available()
                .map(|level| (level, peak(level)))
                .collect(),
            memory: bandwidth(level, &large),
            cache: bandwidth(level, &small),
        }
    }

    /// Peak of so many threads with a level's instructions.
    pub fn peak(&self, level: SimdLevel, threads: usize) -> f64 {
        let of_level = self.gflops.iter().find(|(known, _)| *known == level);
        of_level.map_or(f64::NAN, |(_, gflops)| gflops * threads as f64)
    }

    /// GB/s at which so many bytes can be read again and again: those of the cache where they fit.
    pub fn bandwidth(&self, bytes: usize) -> f64 {
        if bytes <= SMALL * size_of::<f32>() {
            self.cache
        } else {
            self.memory
        }
    }
}

fn peak(level: SimdLevel) -> f64 {
    let time = fastest(BUDGET, || {
        black_box(level.run(FusedSums {
            factor: black_box(0.999),
            term: black_box(1e-3),
        }));
    });
    let operations = 2 * STEPS * ACCUMULATORS * level.lanes();
    operations as f64 / time.as_secs_f64() / 1e9
}

fn bandwidth(level: SimdLevel, buffer: &[f32]) -> f64 {
    let time = fastest(BUDGET, || {
        black_box(level.run(Sum(black_box(buffer))));
    });
    size_of_val(buffer) as f64 / time.as_secs_f64() / 1e9
}

/// Independent chains of `x * factor + term`, which stay near 1.
struct FusedSums {
    factor: f32,
    term: f32,
}

impl Kernel for FusedSums {
    type Output = f32;
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> f32 {
        let (factor, term) = (l.splat(self.factor), l.splat(self.term));
        let mut sums = [l.splat(1.0); ACCUMULATORS];
        for _ in 0..STEPS {
            for sum in &mut sums {
                *sum = l.mul_add(*sum, factor, term);
            }
        }
        sums.into_iter().map(|sum| l.sum(sum)).sum()
    }
}

/// Sum of a buffer.
struct Sum<'a>(&'a [f32]);

impl Kernel for Sum<'_> {
    type Output = f32;
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> f32 {
        const CHAINS: usize = 8;
        let mut sums = [l.splat(0.0); CHAINS];
        for part in self.0.chunks_exact(CHAINS * L::N) {
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum = l.add(*sum, l.load(&part[k * L::N..]));
            }
        }
        sums.into_iter().map(|sum| l.sum(sum)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_does_the_same_sums() {
        for level in SimdLevel::available() {
            let buffer = vec![0.5f32; 1 << 12];
            assert_eq!(level.run(Sum(&buffer)), 2048.0);
            let sums = level.run(FusedSums {
                factor: 1.0,
                term: 0.0,
            });
            assert_eq!(sums, (ACCUMULATORS * level.lanes()) as f32);
        }
    }
}
