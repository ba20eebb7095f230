//! What a target is, and what all of them need.

use crate::random::Random;

/// Changes bytes a little. The number is the most bytes that there may be afterwards.
pub type ChangeBytes<'a> = dyn FnMut(&mut Vec<u8>, usize) + 'a;

/// Something that takes bytes from strangers.
pub struct Target {
    /// Name of the fuzzer and of the folder of its corpus.
    pub name: &'static str,
    /// Tries bytes; panics at a fault.
    pub run: fn(&[u8]),
    /// Changes bytes, the more often usefully the more it knows of the format. Random choices come from the generator,
    /// and changes of a format's parts from the last argument.
    pub mutate: fn(&[u8], &mut Random, &mut ChangeBytes<'_>) -> Vec<u8>,
    /// Words of the format, for changes of text.
    pub words: &'static [&'static str],
}

/// Most bytes of an input: faults hide in structure, not in length, and short inputs are tried sooner.
pub const MAX_INPUT_BYTES: usize = 1 << 16;

/// [`Target::mutate`] for formats of which nothing is known.
pub(super) fn mutate_plain(bytes: &[u8], _: &mut Random, change: &mut ChangeBytes<'_>) -> Vec<u8> {
    let mut changed = bytes.to_vec();
    change(&mut changed, MAX_INPUT_BYTES);
    changed
}

/// Runs `read`, and returns what it returns and the most bytes that were allocated meanwhile.
pub(super) fn measured<T>(read: impl FnOnce() -> T) -> (T, u64) {
    let mut result = None;
    let allocated = allocation_counter::measure(|| result = Some(read()));
    (result.expect("it ran"), allocated.bytes_max)
}
