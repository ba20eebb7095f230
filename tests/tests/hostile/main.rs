//! Damaged, absurd and hostile input is refused by a named error.

mod corpora;
mod dictionary_bytes;
mod dictionary_memory;
mod dictionary_sections;
mod levels;
mod reference_files;
mod texts;
