//! Changes of inputs by libFuzzer and by what each target knows of its format.

use libfuzzer_sys::fuzzer_mutate;
use mrt_tests::Random;
use mrt_tests::harness::{Target, change_tokens};

/// Changes the first `size` bytes of `data`, within `most` bytes; returns how many there are afterwards.
pub fn mutate(target: &Target, data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut random = Random(u64::from(seed));
    // Content is changed by a generator of its own, since `mutate` borrows the other.
    let mut inner = Random(random.bits());
    let mut change = |bytes: &mut Vec<u8>, limit: usize| {
        let limit = limit.min(most).max(bytes.len()).max(1);
        if !target.words.is_empty() && inner.below(3) == 0 {
            change_tokens(&mut inner, bytes, limit, target.words);
            return;
        }
        let length = bytes.len();
        bytes.resize(limit, 0);
        let length = fuzzer_mutate(bytes, length, limit);
        bytes.truncate(length);
    };
    let changed = (target.mutate)(&data[..size], &mut random, &mut change);
    if changed.len() > most {
        return size;
    }
    data[..changed.len()].copy_from_slice(&changed);
    changed.len()
}

/// A fuzzer of a target.
#[macro_export]
macro_rules! fuzzer {
    ($target:expr) => {
        libfuzzer_sys::fuzz_target!(|bytes: &[u8]| ($target.run)(bytes));

        libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| {
            $crate::mutate(&$target, data, size, most, seed)
        });
    };
}
