//! The lines of OBJ and MTL files, in whatever encoding and however wrapped.

use std::borrow::Cow;

/// The bytes of a text without its byte order mark; UTF-16 becomes UTF-8, and every other encoding stays as it is.
/// `None` for UTF-16 of half a unit.
pub(super) fn decode(bytes: &[u8]) -> Option<Cow<'_, [u8]>> {
    let utf16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let (units, rest) = bytes.as_chunks::<2>();
        let units: Vec<u16> = units.iter().map(|&pair| unit(pair)).collect();
        let text = String::from_utf16_lossy(&units);
        rest.is_empty().then(|| Cow::Owned(text.into_bytes()))
    };
    match bytes {
        [0xef, 0xbb, 0xbf, text @ ..] => Some(Cow::Borrowed(text)),
        [0xff, 0xfe, text @ ..] => utf16(text, u16::from_le_bytes),
        [0xfe, 0xff, text @ ..] => utf16(text, u16::from_be_bytes),
        text => Some(Cow::Borrowed(text)),
    }
}

/// A line of a text.
pub(super) struct Line<'a> {
    /// From 1; of a wrapped line, its first.
    pub(super) number: usize,
    /// Without white space around it; a wrapped line is in one piece.
    pub(super) text: Cow<'a, [u8]>,
}

/// Lines end as on Unix, Windows or old Macintoshes. One that ends in a backslash goes on in the next.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self {
            rest: text,
            number: 0,
        }
    }

    fn next_unwrapped(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
        let end = self.rest.iter().position(is_end);
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = match rest {
            [b'\r', b'\n', rest @ ..] | [_, rest @ ..] => rest,
            [] => rest,
        };
        self.number += 1;
        Some(line)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let first = self.next_unwrapped()?;
        let number = self.number;
        if !is_wrapped(first) {
            let text = Cow::Borrowed(first.trim_ascii());
            return Some(Line { number, text });
        }
        let mut text = first[..first.len() - 1].to_vec();
        while let Some(next) = self.next_unwrapped() {
            text.push(b' ');
            let goes_on = is_wrapped(next);
            text.extend(&next[..next.len() - usize::from(goes_on)]);
            if !goes_on {
                break;
            }
        }
        let text = Cow::Owned(text.trim_ascii().to_vec());
        Some(Line { number, text })
    }
}

/// A comment never goes on: many name a folder of Windows at their end, and the next line must not vanish in them.
fn is_wrapped(line: &[u8]) -> bool {
    line.ends_with(b"\\") && before_comment(line).len() == line.len()
}

/// A line up to its comment: a `#` at its beginning or after white space, so that names may hold one.
pub(super) fn before_comment(line: &[u8]) -> &[u8] {
    let starts = |k: &usize| line[*k] == b'#' && (*k == 0 || line[*k - 1].is_ascii_whitespace());
    match line.contains(&b'#') {
        true => {
            let end = (0..line.len()).find(starts);
            line[..end.unwrap_or(line.len())].trim_ascii_end()
        }
        false => line,
    }
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// The first word of a line, and what follows it without white space around.
pub(super) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let end = line.iter().position(u8::is_ascii_whitespace);
    let (keyword, rest) = line.split_at(end.unwrap_or(line.len()));
    (keyword, rest.trim_ascii())
}

/// Names longer than this are cut where they are shown.
const LONGEST_SHOWN: usize = 120;

/// Bytes of a file as people can read them: control characters and what is not UTF-8 are escaped, and the end of
/// something long is left out.
pub(super) fn readable(bytes: &[u8]) -> String {
    let mut text = String::new();
    for chunk in bytes[..bytes.len().min(4 * LONGEST_SHOWN)].utf8_chunks() {
        for character in chunk.valid().chars() {
            match character.is_control() {
                true => text.extend(character.escape_default()),
                false => text.push(character),
            }
        }
        text.extend(chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}")));
    }
    match text.char_indices().nth(LONGEST_SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<(usize, String)> {
        let line = |line: Line| (line.number, readable(&line.text));
        Lines::new(text.as_bytes()).map(line).collect()
    }

    #[test]
    fn lines_end_in_three_ways_and_are_wrapped_with_a_backslash() {
        let expected = |lines: &[(usize, &str)]| -> Vec<(usize, String)> {
            lines.iter().map(|&(n, l)| (n, l.to_owned())).collect()
        };
        for end in ["\n", "\r\n", "\r"] {
            let text = "a\n\n b 1 \\\n 2\\\n\\\n3 \nc".replace('\n', end);
            assert_eq!(
                lines(&text),
                expected(&[(1, "a"), (2, ""), (3, "b 1   2  3"), (7, "c")]),
                "{end:?}"
            );
        }
        assert_eq!(lines("a\\"), expected(&[(1, "a")]));
        assert_eq!(lines("\\\n\\\n"), expected(&[(1, "")]));
        assert_eq!(
            lines("# C:\\\nv\nv 1 # D:\\\nv"),
            expected(&[(1, "# C:\\"), (2, "v"), (3, "v 1 # D:\\"), (4, "v")])
        );
    }

    #[test]
    fn comments_begin_after_white_space() {
        assert_eq!(before_comment(b"red # plaster"), b"red");
        assert_eq!(before_comment(b"wall#2"), b"wall#2");
        assert_eq!(before_comment(b"a#b\t#c"), b"a#b");
        assert_eq!(before_comment(b"# all"), b"");
    }

    #[test]
    fn byte_order_marks_are_dropped() {
        let decoded = |bytes: &[u8]| decode(bytes).map(|text| readable(&text));
        let text = |text: &str| Some(text.to_owned());
        assert_eq!(decoded(b"\xef\xbb\xbfv 1"), text("v 1"));
        assert_eq!(decoded(b"\xff\xfev\0 \0\xf6\0"), text("v ö"));
        assert_eq!(decoded(b"\xfe\xff\0v\0\xf6"), text("vö"));
        assert_eq!(decoded(b"\xff\xfev"), None);
        assert_eq!(decoded(b"B\xf6den\x1b[2J"), text("B\\xf6den\\u{1b}[2J"));
    }

    #[test]
    fn long_names_are_cut_where_they_are_shown() {
        let shown = readable("ä".repeat(100_000).as_bytes());
        assert_eq!(shown.chars().count(), LONGEST_SHOWN + 1);
    }
}
