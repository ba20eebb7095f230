//! Numbers of OBJ and MTL files.

use super::lines::words;

/// The numbers in a line; `Err` with the first word that is none.
pub(super) fn numbers(line: &[u8]) -> impl Iterator<Item = Result<f64, &[u8]>> {
    words(before_comment(line)).map(|word| number(word).ok_or(word))
}

/// A number; NaN and the infinities also as C runtimes print them.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let parsed = std::str::from_utf8(word).ok()?.parse().ok();
    parsed.or_else(|| is_not_finite(word).then_some(f64::NAN))
}

/// True for `nan(ind)`, `NANQ`, `1.#IND00`, `-1.#INF` and their like.
fn is_not_finite(word: &[u8]) -> bool {
    let word = word.to_ascii_lowercase();
    let word = match &word[..] {
        [b'+' | b'-', rest @ ..] => rest,
        word => word,
    };
    match word {
        [b'n', b'a', b'n', rest @ ..] => {
            matches!(rest, b"q" | b"s") || rest.starts_with(b"(") && rest.ends_with(b")")
        }
        [b'1', b'.', b'#', rest @ ..] => names_no_number(rest),
        _ => false,
    }
}

/// What follows `1.#` in the output of Microsoft's older runtimes, in lower case; `j` is `inf` rounded to one digit, and
/// zeros fill up a printed width.
fn names_no_number(rest: &[u8]) -> bool {
    let end = rest.iter().rposition(|&byte| byte != b'0');
    let name = &rest[..end.map_or(0, |last| last + 1)];
    matches!(name, b"ind" | b"inf" | b"qnan" | b"snan" | b"nan" | b"j")
}

/// A line of numbers up to its comment, which may follow a number without white space.
fn before_comment(line: &[u8]) -> &[u8] {
    let starts = |k: &usize| {
        let is_nan = || line[..*k].ends_with(b"1.") && is_not_finite(first_word(&line[*k - 2..]));
        line[*k] == b'#' && !is_nan()
    };
    match line.contains(&b'#') {
        true => &line[..(0..line.len()).find(starts).unwrap_or(line.len())],
        false => line,
    }
}

fn first_word(line: &[u8]) -> &[u8] {
    words(line).next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_of_what_is_no_number_is_one() {
        for word in [
            "nan",
            "NaN",
            "-nan",
            "nan(ind)",
            "-nan(ind)",
            "nan(snan)",
            "-nan(0x8000)",
            "NANQ",
            "1.#IND",
            "-1.#IND00",
            "1.#QNAN",
            "-1.#QNAN0",
            "1.#SNAN",
            "1.#INF",
            "-1.#INF00",
            "1.#J",
            "inf",
            "-INF",
            "Infinity",
            "+INFINITY",
            "1e999",
        ] {
            let value = number(word.as_bytes());
            assert!(value.is_some_and(|x| !x.is_finite()), "{word}: {value:?}");
        }
        for word in [
            "abc", "nano", "1.#", "1.#X", "1.0.0", "0x10", "", "-", "nan(", "1,5", "\u{f6}",
        ] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        for (word, value) in [
            ("1e-3", 1e-3),
            (".8e-001", 0.08),
            ("-.7e+2", -70.0),
            ("5.", 5.0),
            ("+1", 1.0),
        ] {
            assert_eq!(number(word.as_bytes()), Some(value), "{word}");
        }
    }

    #[test]
    fn a_comment_ends_the_numbers_but_is_not_part_of_them() {
        let read = |line: &'static str| numbers(line.as_bytes()).collect::<Result<Vec<f64>, _>>();
        assert_eq!(read("1 2 3 # a 4"), Ok(vec![1.0, 2.0, 3.0]));
        assert_eq!(read("1 2 3#a 4"), Ok(vec![1.0, 2.0, 3.0]));
        assert_eq!(read("1 2 1.#comment"), Ok(vec![1.0, 2.0, 1.0]));
        assert_eq!(
            read("1.#INF 1.#IND 1 #x").map(|numbers| numbers.len()),
            Ok(3)
        );
        assert_eq!(read("1 abc 3"), Err(&b"abc"[..]));
    }
}
