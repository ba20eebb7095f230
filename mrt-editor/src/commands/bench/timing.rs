//! Times on machines that others use too: subjects take turns, so that what disturbs one disturbs all, and medians
//! and smallest values are reported.

use mrt_dictionary::progress::{Cancelled, Progress};
use std::time::{Duration, Instant};

/// Something that is timed stage by stage.
pub trait Timed {
    /// Does it once; seconds of each stage, always equally many.
    fn run(&mut self) -> Vec<f64>;
}

/// Times of many runs.
#[derive(Clone, Debug, Default)]
pub struct Times {
    runs: Vec<Vec<f64>>,
}

impl Times {
    /// Median over the runs of the sum of some stages, seconds.
    pub fn median(&self, stages: &[usize]) -> f64 {
        let mut sums = self.sums(stages);
        sums.sort_by(f64::total_cmp);
        sums.get(sums.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Smallest such sum, seconds.
    pub fn smallest(&self, stages: &[usize]) -> f64 {
        self.sums(stages).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Number of runs.
    pub fn count(&self) -> usize {
        self.runs.len()
    }

    fn sums(&self, stages: &[usize]) -> Vec<f64> {
        let sum = |run: &Vec<f64>| stages.iter().map(|&stage| run[stage]).sum();
        self.runs.iter().map(sum).collect()
    }
}

/// Runs of each subject, at least.
const FEWEST: usize = 3;

/// Runs of each subject, at most: more change a median no further.
const MOST: usize = 1000;

/// Runs all subjects in turn until `budget` for each is spent, at least three times, after one run that does not count.
///
/// # Errors
/// [`Cancelled`].
pub fn in_turns(
    subjects: &mut [&mut dyn Timed],
    budget: Duration,
    progress: &Progress,
) -> Result<Vec<Times>, Cancelled> {
    let mut times = vec![Times::default(); subjects.len()];
    // A first run finds caches cold and pages missing.
    for subject in subjects.iter_mut() {
        progress.check()?;
        subject.run();
    }
    let start = Instant::now();
    let total = budget * subjects.len() as u32;
    for round in 0..MOST {
        if round >= FEWEST && start.elapsed() >= total {
            break;
        }
        for (subject, times) in subjects.iter_mut().zip(&mut times) {
            progress.check()?;
            times.runs.push(subject.run());
        }
    }
    Ok(times)
}

/// Time of the fastest of many calls within a budget.
pub fn fastest(budget: Duration, mut call: impl FnMut()) -> Duration {
    call();
    let start = Instant::now();
    let mut best = Duration::MAX;
    let mut runs = 0;
    while runs < FEWEST || start.elapsed() < budget {
        let begin = Instant::now();
        call();
        best = best.min(begin.elapsed());
        runs += 1;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Counter(f64);

    impl Timed for Counter {
        fn run(&mut self) -> Vec<f64> {
            self.0 += 1.0;
            vec![self.0, 10.0]
        }
    }

    #[test]
    fn the_first_run_does_not_count_and_subjects_run_equally_often() {
        let (mut a, mut b) = (Counter(0.0), Counter(100.0));
        let times = in_turns(&mut [&mut a, &mut b], Duration::ZERO, &Progress::silent())
            .expect("nobody cancels");
        assert_eq!([times[0].count(), times[1].count()], [FEWEST; 2]);
        assert_eq!(times[0].median(&[0]), 3.0);
        assert_eq!(times[0].smallest(&[0, 1]), 12.0);
        assert_eq!(times[1].smallest(&[0]), 102.0);
    }
}
