//! What this machine can do at most, measured in the same process as the frames that are compared with it.

use super::timing::{Timed, fastest};
use mrt_core::simd::{Kernel, Lanes, SimdLevel};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Sums that a core computes at once: four cycles of latency times two units make eight, and some are spare.
const ACCUMULATORS: usize = 12;

/// Multiplications and additions of a lane in one call: long against the clock's resolution, short against a time slice.
const STEPS: usize = 20_000;

/// Bytes of the buffers that are read: the first fits into the second-level cache of any processor of the last ten years,
/// two fit into the third level of most, and the last is far larger than the caches that a core reaches.
const BUFFERS: [usize; 4] = [256 << 10, 4 << 20, 16 << 20, 256 << 20];

/// Time spent on each measurement.
const BUDGET: Duration = Duration::from_millis(120);

/// Limits of one core.
#[derive(Clone, Debug)]
pub struct Machine {
    /// For each level of instructions, floating-point operations a second in units of 1e9; a fused multiply-add is two.
    pub gflops: Vec<(SimdLevel, f64)>,
    /// Bytes of a buffer, and GB/s at which it is read again and again; the smallest first.
    pub reads: Vec<(usize, f64)>,
}

impl Machine {
    /// Measures all levels of instructions that the machine has; takes about a second.
    pub fn measure() -> Self {
        let level = SimdLevel::detect();
        let read = |bytes: usize| (bytes, bandwidth(level, &vec![1.0f32; bytes / 4]));
        Self {
            gflops: SimdLevel::available()
                .map(|level| (level, peak(level)))
                .collect(),
            reads: BUFFERS.into_iter().map(read).collect(),
        }
    }

    /// Operations a second of a number of threads with a level's instructions, in units of 1e9.
    pub fn peak(&self, level: SimdLevel, threads: usize) -> f64 {
        let of_level = self.gflops.iter().find(|(known, _)| *known == level);
        of_level.map_or(f64::NAN, |(_, gflops)| gflops * threads as f64)
    }

    /// GB/s at which a number of bytes can be read again and again: that of the smallest buffer in which they fit.
    pub fn bandwidth(&self, bytes: usize) -> f64 {
        let fitting = self.reads.iter().find(|(buffer, _)| bytes <= *buffer);
        fitting
            .or(self.reads.last())
            .map_or(f64::NAN, |(_, rate)| *rate)
    }

    /// GB/s read from memory.
    pub fn memory(&self) -> f64 {
        self.bandwidth(usize::MAX)
    }
}

/// Sums that fit into registers, shared out between threads that need nothing from each other. No other work gains more
/// by these threads on this machine.
pub struct Shared(ThreadPool);

/// Parts of [`Shared`].
const PARTS: usize = 16;

impl Shared {
    /// Starts a number of threads.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
        Ok(Self(pool))
    }
}

impl Timed for Shared {
    fn run(&mut self) -> Vec<f64> {
        let level = SimdLevel::detect();
        let part = |_| {
            black_box(level.run(FusedSums {
                factor: black_box(0.999),
                term: black_box(1e-3),
            }));
        };
        let start = Instant::now();
        self.0
            .install(|| (0..PARTS).into_par_iter().with_max_len(1).for_each(part));
        vec![start.elapsed().as_secs_f64()]
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
        black_box(level.run(BufferSum(black_box(buffer))));
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

/// The sum of a buffer.
struct BufferSum<'a>(&'a [f32]);

impl Kernel for BufferSum<'_> {
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
    fn all_levels_of_instructions_sum_alike() {
        for level in SimdLevel::available() {
            let buffer = vec![0.5f32; 1 << 12];
            assert_eq!(level.run(BufferSum(&buffer)), 2048.0);
            let sums = level.run(FusedSums {
                factor: 1.0,
                term: 0.0,
            });
            assert_eq!(sums, (ACCUMULATORS * level.lanes()) as f32);
        }
    }
}
