//! What reading a dictionary takes beside its budget does not grow with the file.

use mrt_core::container::ByteBudget;
use mrt_runtime::{Dictionary, DictionaryError};
use mrt_tests::MOBILE_BYTES;
use mrt_tests::harness::Parts;

/// A word of a table of paths once took as many bytes again as its name, and a time that grew with their square: hours
/// for this one.
#[test]
fn the_name_of_a_word_may_be_as_long_as_the_file() {
    const LENGTH: usize = 8 << 20;
    const BUDGET: u64 = 1 << 20;
    let mut parts = Parts::of(MOBILE_BYTES);
    let words = parts.sections.iter_mut();
    let words = words.filter(|part| part.name == *b"words\0\0\0");
    let turns = ["z".repeat(LENGTH), "x".to_owned(), "y".repeat(LENGTH)];
    words.for_each(|part| part.content = turns.concat().into_bytes());
    let bytes = parts.bytes();
    let mut refused = None;
    let allocated = allocation_counter::measure(|| {
        let mut budget = ByteBudget::new(BUDGET);
        refused = Dictionary::from_bytes_within(&bytes, &mut budget).err();
    });
    assert!(
        matches!(refused, Some(DictionaryError::Word { index: 0, .. })),
        "{refused:?}"
    );
    assert!(allocated.bytes_max < BUDGET, "{}", allocated.bytes_max);
}
