//! Cuts a level's text into pieces that are parsed one at a time.
//!
//! A parsed text takes up to two hundred times its own memory, so it is never parsed as a whole. The first piece is what
//! stands before the first table, without the elements of its lists; then come those elements, some at a time; then the
//! blocks, some at a time. Only strings, comments and brackets are looked at here. Where the cuts are wrong because the
//! text is no TOML, the parser refuses a piece.

use std::ops::Range;

/// Most bytes of a piece: a block takes under a thousand.
pub const MAX_PIECE_BYTES: usize = 64 << 10;

/// Pieces of several blocks or elements end when they have this many bytes. Larger ones are no faster.
const USUAL_PIECE_BYTES: usize = 16 << 10;

/// A text in pieces, each given by its range of bytes.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Pieces {
    /// What stands before the first table. Between two ranges, the elements of a list are left out.
    pub(super) head: Vec<Range<usize>>,
    /// The lists of the head that stand in no table.
    pub(super) lists: Vec<List>,
    /// Each range is one or several tables.
    pub(super) tables: Vec<Range<usize>>,
}

/// A list.
#[derive(Debug, Default, PartialEq)]
pub(super) struct List {
    /// From its name to the opening bracket.
    pub(super) opening: Range<usize>,
    /// Each range is one or several elements, without the comma behind them. There is at least one range, and the last
    /// ends at the closing bracket.
    pub(super) elements: Vec<Range<usize>>,
}

/// The pieces of a text.
pub(super) fn pieces(text: &str) -> Pieces {
    let bytes = text.as_bytes();
    let mut pieces = Pieces::default();
    let (mut at, mut head_from) = (0, 0);
    let mut is_in_table = false;
    while at < bytes.len() && !is_table(bytes, at) {
        is_in_table |= bytes.get(after_blanks(bytes, at)) == Some(&b'[');
        // Lists of a table, such as names of materials, are short and stay in it.
        let (end, list) = if is_in_table {
            (end_of_statement(bytes, at), None)
        } else {
            read_statement(bytes, at)
        };
        if let Some(list) = list {
            pieces.head.push(head_from..list.opening.end);
            head_from = list.elements.last().map_or(list.opening.end, |e| e.end);
            pieces.lists.push(list);
        }
        at = end;
    }
    pieces.head.push(head_from..at);
    let mut table_from = at;
    while at < bytes.len() {
        if at - table_from >= USUAL_PIECE_BYTES && is_table(bytes, at) {
            pieces.tables.push(table_from..at);
            table_from = at;
        }
        at = end_of_statement(bytes, at);
    }
    if table_from < at {
        pieces.tables.push(table_from..at);
    }
    pieces
}

/// True if the line at byte `at` is the header of a list's table, `[[name]]`.
pub(super) fn is_table(bytes: &[u8], at: usize) -> bool {
    bytes[after_blanks(bytes, at)..].starts_with(b"[[")
}

fn after_blanks(bytes: &[u8], at: usize) -> usize {
    let blanks = bytes[at..].iter().take_while(|b| b" \t".contains(b));
    at + blanks.count()
}

/// The end, behind the line break, of a name with its value that starts a line at byte `start`; and the value, if it is a
/// list.
fn read_statement(bytes: &[u8], start: usize) -> (usize, Option<List>) {
    let mut at = after_blanks(bytes, start);
    while at < bytes.len() {
        match bytes[at] {
            b'\n' => return (at + 1, None),
            b'[' => {
                let list = read_list(bytes, start..at + 1);
                // What comes behind the closing bracket ends with the line.
                let last = list.elements.last().map_or(at + 1, |e| e.end);
                let end = end_of_line(bytes, last);
                return ((end + 1).min(bytes.len()), Some(list));
            }
            _ => at = end_of_token(bytes, at),
        }
    }
    (at, None)
}

/// The end of the statement that starts a line at byte `start`, behind its line break.
fn end_of_statement(bytes: &[u8], start: usize) -> usize {
    let mut at = after_blanks(bytes, start);
    // Only a header's brackets end with the line, closed or not.
    let is_header = bytes.get(at) == Some(&b'[');
    while at < bytes.len() {
        at = match bytes[at] {
            b'\n' => return at + 1,
            b'[' if is_header => at + 1,
            _ => end_of_token(bytes, at),
        };
    }
    at
}

/// The list whose first element is behind `opening`.
fn read_list(bytes: &[u8], opening: Range<usize>) -> List {
    let mut elements = Vec::new();
    let mut at = opening.end;
    let mut from = at;
    while at < bytes.len() && bytes[at] != b']' {
        if bytes[at] == b',' && at - from >= USUAL_PIECE_BYTES {
            elements.push(from..at);
            from = at + 1;
        }
        at = end_of_token(bytes, at);
    }
    elements.push(from..at);
    List { opening, elements }
}

/// The end of what starts at byte `at`: a string, a comment without its line break, brackets with what they enclose, or
/// a single byte.
fn end_of_token(bytes: &[u8], at: usize) -> usize {
    match bytes[at] {
        b'#' => end_of_line(bytes, at),
        b'"' | b'\'' => end_of_string(bytes, at),
        b'[' | b'{' => end_of_brackets(bytes, at),
        _ => at + 1,
    }
}

fn end_of_line(bytes: &[u8], at: usize) -> usize {
    let rest = bytes[at..].iter().position(|&b| b == b'\n');
    rest.map_or(bytes.len(), |length| at + length)
}

/// Brackets that are never closed end with the text.
fn end_of_brackets(bytes: &[u8], start: usize) -> usize {
    let mut depth = 0usize;
    let mut at = start;
    while at < bytes.len() {
        at = match bytes[at] {
            b'[' | b'{' => {
                depth += 1;
                at + 1
            }
            b']' | b'}' => {
                depth -= 1;
                if depth == 0 {
                    return at + 1;
                }
                at + 1
            }
            _ => end_of_token(bytes, at),
        };
    }
    at
}

/// A string of one line that is never closed ends with the line, and one of several lines with the text.
fn end_of_string(bytes: &[u8], start: usize) -> usize {
    let quote = bytes[start];
    let is_long = bytes[start..].starts_with(&[quote; 3]);
    let mut at = start + if is_long { 3 } else { 1 };
    while at < bytes.len() {
        match bytes[at] {
            b'\\' if quote == b'"' => at += 2,
            b'\n' if !is_long => return at,
            found if found != quote => at += 1,
            _ if !is_long => return at + 1,
            _ if bytes[at..].starts_with(&[quote; 3]) => {
                // A long string may end with two quotes of its own.
                let quotes = bytes[at..].iter().take_while(|&&b| b == quote).count();
                return at + quotes.min(5);
            }
            _ => at += 1,
        }
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts<'t>(text: &'t str, ranges: &[Range<usize>]) -> Vec<&'t str> {
        ranges.iter().map(|range| &text[range.clone()]).collect()
    }

    #[test]
    fn a_small_text_has_a_head_lists_and_tables() {
        let head = "a = 1 # [\n\"b]\" = []\nc = {d = [2]}\n\n";
        let elements = "[0, ']'], # ]\n[1]";
        let tables = " [[t]]\nx = [\n[[3]]]\n[t.u]\n[[t]]\n";
        let text = head.replacen("= []", &format!("= [{elements}]"), 1) + tables;
        let found = pieces(&text);
        assert_eq!(parts(&text, &found.head).concat(), head);
        assert_eq!(found.lists.len(), 1);
        assert_eq!(&text[found.lists[0].opening.clone()], "\"b]\" = [");
        assert_eq!(parts(&text, &found.lists[0].elements), [elements]);
        assert_eq!(parts(&text, &found.tables), [tables]);
    }

    #[test]
    fn lists_of_a_table_of_the_head_stay_in_it() {
        let head = "a = []\n [mesh]\nnames = [\n'[[x']\n";
        let text = format!("{head}[[t]]\n");
        let found = pieces(&text);
        assert_eq!(parts(&text, &found.head).concat(), head);
        assert_eq!(found.lists.len(), 1);
        assert_eq!(parts(&text, &found.tables), ["[[t]]\n"]);
    }

    #[test]
    fn strings_end_where_they_should() {
        for (text, end) in [
            (r#""a\"]" x"#, 6),
            (r"'a\' x", 4),
            ("\"a\nb\"", 2),
            ("\"\"\"a\nb\"\"\"\"\"x", 11),
            ("'''a''b''' x", 10),
            ("\"\" x", 2),
            ("\"a\\", 3),
        ] {
            assert_eq!(end_of_string(text.as_bytes(), 0), end, "{text}");
        }
    }

    #[test]
    fn pieces_are_small_and_leave_nothing_out() {
        let connections = "[0, \"+x\", 1, \"-x\"],".repeat(5000);
        let blocks = "[[block]]\nshape = \"closed\"\n\n".repeat(5000);
        let text = format!("version = 1\nconnections = [{connections}]\n{blocks}");
        let found = pieces(&text);
        let elements = &found.lists[0].elements;
        let ranges = || elements.iter().chain(&found.tables);
        assert!(ranges().all(|range| range.len() < 2 * USUAL_PIECE_BYTES));
        assert!(elements.len() > 5 && found.tables.len() > 5);
        let commas = elements.len() - 1;
        let kept: usize = found.head.iter().chain(ranges()).map(Range::len).sum();
        assert_eq!(kept + commas, text.len());
    }

    #[test]
    fn what_is_never_closed_ends_with_the_text() {
        for text in [
            "a = [[[[",
            "a = {{",
            "[[[[",
            "a = [1]]]]]",
            "]]",
            "a = \"\"\"",
            "a = [\"\\",
        ] {
            let found = pieces(text);
            let ends = found.tables.iter().chain(&found.head);
            let ends = ends.map(|range| range.end);
            assert_eq!(ends.max(), Some(text.len()), "{text}");
        }
    }
}
