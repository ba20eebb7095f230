//! Text of a file inside a message: short, on one line, and without signs that a terminal would obey.

/// Most characters of an [`excerpt`], before the dots that mark a cut.
pub const EXCERPT_LENGTH: usize = 100;

/// The start of a text from a file, for a message: at most [`EXCERPT_LENGTH`] characters and three dots, with control
/// characters and others that cannot be seen written as escapes.
///
/// Cost: that of the excerpt, however long the text is.
pub fn excerpt(text: &str) -> String {
    printable(text, EXCERPT_LENGTH)
}

/// Same as [`excerpt`], with at most `longest` characters before the dots.
pub fn printable(text: &str, longest: usize) -> String {
    let mut shown = String::new();
    let mut length = 0;
    for c in text.chars() {
        let is_plain = c.is_ascii_graphic() || c == ' ';
        let escaped = c.escape_debug();
        length += if is_plain { 1 } else { escaped.len() };
        if length > longest {
            shown.push_str("...");
            break;
        }
        if is_plain {
            shown.push(c);
        } else {
            shown.extend(escaped);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_that_a_terminal_obeys_are_escaped_and_others_stay() {
        assert_eq!(excerpt("tür \"a\\b\" `'`"), "tür \"a\\b\" `'`");
        assert_eq!(
            excerpt("\u{1b}[2J\r\n\u{9b}\u{202e}x\0"),
            r"\u{1b}[2J\r\n\u{9b}\u{202e}x\0"
        );
    }

    #[test]
    fn the_cut_counts_what_is_shown() {
        let whole = "x".repeat(EXCERPT_LENGTH);
        assert_eq!(excerpt(&whole), whole);
        assert_eq!(excerpt(&format!("{whole}y")), format!("{whole}..."));
        for hostile in ["\u{1b}", "ä", "\u{10ffff}", "\n"] {
            let shown = excerpt(&hostile.repeat(10_000_000 / hostile.len()));
            assert!(shown.chars().count() <= EXCERPT_LENGTH + 3, "{shown}");
            assert!(shown.ends_with("..."), "{shown}");
            assert!(!shown.contains(char::is_control), "{shown}");
        }
    }
}
