//! Times on machines that others use too. Subjects take turns, so that a disturbance hits all of them, and medians and
//! smallest values are reported. A turn is a burst of runs, the first of which does not count: it finds the caches filled
//! by another subject.

use mrt_dictionary::progress::{Cancelled, Progress};
use std::time::{Duration, Instant};

/// Work that is timed stage by stage.
pub trait Timed {
    /// Does the work once; returns the seconds of each stage. The number of stages never changes.
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

    /// The smallest of these sums, seconds.
    pub fn smallest(&self, stages: &[usize]) -> f64 {
        self.sums(stages).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Number of stages.
    pub fn stages(&self) -> usize {
        self.runs.first().map_or(0, Vec::len)
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

/// Turns of each subject, at least.
const FEWEST: usize = 3;

/// Runs of each subject, at most: more hardly change a median.
const MOST: usize = 1000;

/// A turn takes at least this long, and at least one run.
const TURN: Duration = Duration::from_millis(4);

/// After this number of budgets no further turn begins, however few there were: very large levels take seconds a run.
const PATIENCE: u32 = 20;

/// Runs all subjects in turns until `budget` for each is spent, and at least three turns unless they are very slow.
///
/// # Errors
/// [`Cancelled`].
pub fn in_turns(
    subjects: &mut [&mut dyn Timed],
    budget: Duration,
    progress: &Progress,
) -> Result<Vec<Times>, Cancelled> {
    let mut times = vec![Times::default(); subjects.len()];
    let start = Instant::now();
    let total = budget * subjects.len() as u32;
    let mut turns = 0;
    while turns == 0
        || start.elapsed() < total
        || (turns < FEWEST && start.elapsed() < PATIENCE * total)
    {
        for (subject, times) in subjects.iter_mut().zip(&mut times) {
            progress.check()?;
            // A run that takes longer than a turn does not depend on what the caches held before.
            let is_short = |run: &Vec<f64>| run.iter().sum::<f64>() < TURN.as_secs_f64();
            if times.runs.last().is_none_or(is_short) {
                subject.run();
            }
            let begin = Instant::now();
            loop {
                if times.runs.len() < MOST {
                    times.runs.push(subject.run());
                }
                if begin.elapsed() >= TURN || times.runs.len() == MOST {
                    break;
                }
            }
        }
        turns += 1;
        if times.iter().all(|times| times.count() == MOST) {
            break;
        }
    }
    Ok(times)
}

/// Time of the fastest call; calls are repeated until the budget is spent, and at least three times.
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
    fn the_first_run_of_a_turn_does_not_count() {
        let (mut a, mut b) = (Counter(0.0), Counter(100.0));
        let mut subjects: [&mut dyn Timed; 2] = [&mut a, &mut b];
        let times = in_turns(&mut subjects, Duration::ZERO, &Progress::silent());
        let times = times.expect("nobody cancels");
        assert!(times.iter().all(|t| (1..=MOST).contains(&t.count())));
        assert_eq!(times[0].smallest(&[0]), 2.0);
        assert_eq!(times[1].smallest(&[0, 1]), 112.0);
        assert_eq!(times[0].median(&[1]), 10.0);
    }
}
