//! Warnings about files that a scene names.

/// So many files are named one by one; a level of a game can miss hundreds.
const MOST_NAMED: usize = 20;

/// Sentences about files of one kind.
pub(super) struct Notes {
    /// What the files are, in the plural.
    kind: &'static str,
    sentences: Vec<String>,
    unnamed_count: usize,
}

impl Notes {
    pub(super) fn about(kind: &'static str) -> Self {
        Self {
            kind,
            sentences: Vec::new(),
            unnamed_count: 0,
        }
    }

    /// Adds a sentence about a file that is missing or faulty.
    pub(super) fn add(&mut self, sentence: String) {
        match self.sentences.len() < MOST_NAMED {
            true => self.sentences.push(sentence),
            false => self.unnamed_count += 1,
        }
    }

    /// All sentences; the last says how many files are not named.
    pub(super) fn finish(mut self) -> Vec<String> {
        if self.unnamed_count > 0 {
            let Self {
                kind,
                unnamed_count,
                ..
            } = self;
            self.sentences
                .push(format!("{unnamed_count} more {kind} are missing or faulty"));
        }
        self.sentences
    }
}
