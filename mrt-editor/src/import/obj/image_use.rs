//! Which image a line of an MTL file names, and how it is to be used.

use super::lines::{keyword, words};
use super::numbers::number;
use glam::Vec2;
use std::collections::BTreeMap;

/// An image as a material names it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ImageUse {
    /// As in the file; may end in a comment.
    pub(super) name: Vec<u8>,
    /// Texture coordinates are multiplied by this,
    pub(super) scale: Vec2,
    /// and then moved by this.
    pub(super) offset: Vec2,
    /// Nothing stands beyond the image's edge but its last texels.
    pub(super) is_clamped: bool,
}

/// How many words follow an option.
#[derive(Clone, Copy, PartialEq)]
enum Values {
    Words(usize),
    /// One to three, as long as they are numbers.
    Numbers,
}

const OPTIONS: [(&str, Values); 14] = [
    ("-blendu", Values::Words(1)),
    ("-blendv", Values::Words(1)),
    ("-bm", Values::Words(1)),
    ("-boost", Values::Words(1)),
    ("-cc", Values::Words(1)),
    ("-clamp", Values::Words(1)),
    ("-colorspace", Values::Words(1)),
    ("-imfchan", Values::Words(1)),
    ("-mm", Values::Words(2)),
    ("-o", Values::Numbers),
    ("-s", Values::Numbers),
    ("-t", Values::Numbers),
    ("-texres", Values::Words(1)),
    ("-type", Values::Words(1)),
];

/// Options that would change what the image looks like, and are not used.
const IGNORED: [&str; 3] = ["-imfchan", "-mm", "-t"];

/// Reads what follows `map_Kd`: options, a name that may be quoted or hold spaces, and options again. `None` without a
/// name; options that are not used are counted.
pub(super) fn image_use(line: &[u8], ignored: &mut BTreeMap<String, usize>) -> Option<ImageUse> {
    let mut found = ImageUse {
        name: Vec::new(),
        scale: Vec2::ONE,
        offset: Vec2::ZERO,
        is_clamped: false,
    };
    let rest = found.take_options(line, ignored);
    let (name, rest) = split_name(rest);
    found.take_options(rest, ignored);
    found.name = name.to_vec();
    (!name.is_empty()).then_some(found)
}

impl ImageUse {
    /// Takes the options at the beginning of a line; returns what follows them.
    fn take_options<'a>(
        &mut self,
        mut line: &'a [u8],
        ignored: &mut BTreeMap<String, usize>,
    ) -> &'a [u8] {
        while let Some((name, values)) = option(line) {
            line = keyword(line).1;
            if IGNORED.contains(&name) {
                let kind = format!("options of images ({name})");
                *ignored.entry(kind).or_default() += 1;
            }
            match values {
                Values::Words(count) => {
                    if name == "-clamp" {
                        self.is_clamped = keyword(line).0.eq_ignore_ascii_case(b"on");
                    }
                    line = (0..count).fold(line, |line, _| keyword(line).1);
                }
                Values::Numbers => {
                    let numbers: Vec<f64> = words(line).map_while(number).take(3).collect();
                    line = numbers.iter().fold(line, |line, _| keyword(line).1);
                    self.place(name, &numbers);
                }
            }
        }
        line
    }

    /// Takes `-s` and `-o`, whose values default to 1 and 0.
    fn place(&mut self, option: &str, numbers: &[f64]) {
        let value = |k: usize, default: f32| {
            let number = numbers.get(k).map(|&number| number as f32);
            number
                .filter(|number| number.is_finite())
                .unwrap_or(default)
        };
        match option {
            "-s" => self.scale = Vec2::new(value(0, 1.0), value(1, 1.0)),
            "-o" => self.offset = Vec2::new(value(0, 0.0), value(1, 0.0)),
            _ => {}
        }
    }
}

/// The option that a line begins with.
fn option(line: &[u8]) -> Option<(&'static str, Values)> {
    let word = keyword(line).0;
    let is_word = |(name, _): &&(&str, Values)| word.eq_ignore_ascii_case(name.as_bytes());
    OPTIONS.iter().find(is_word).copied()
}

/// The name that a line begins with, which ends at its closing quote or before an option, and what follows.
fn split_name(line: &[u8]) -> (&[u8], &[u8]) {
    if let [b'"', quoted @ ..] = line
        && let Some(end) = quoted.iter().position(|&byte| byte == b'"')
    {
        return (&quoted[..end], quoted[end + 1..].trim_ascii());
    }
    let is_option = |&k: &usize| line[k - 1].is_ascii_whitespace() && option(&line[k..]).is_some();
    match (1..line.len()).filter(|&k| line[k] == b'-').find(is_option) {
        Some(end) => (line[..end].trim_ascii_end(), &line[end..]),
        None => (line, &[]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> (Option<ImageUse>, usize) {
        let mut ignored = BTreeMap::new();
        let found = image_use(line.as_bytes(), &mut ignored);
        (found, ignored.values().sum())
    }

    #[test]
    fn names_are_found_between_options() {
        for (line, name, ignored) in [
            ("a.png", "a.png", 0),
            ("texture 01.png", "texture 01.png", 0),
            ("-texres 512 input.jpg", "input.jpg", 0),
            ("-clamp on -s 2 a b.png", "a b.png", 0),
            ("\"a b.png\" -bm 1.5", "a b.png", 0),
            ("-imfchan r bumpmap2.jpg -bm 1.5", "bumpmap2.jpg", 1),
            ("-mm 0.1 0.3 specular.jpg", "specular.jpg", 1),
            (
                "-s 1 1 1 -o 0 0 0 -t 0 C:\\maps\\a-s.png",
                "C:\\maps\\a-s.png",
                1,
            ),
            ("-colorspace sRGB -o 0.1 diffuse.jpg", "diffuse.jpg", 0),
            ("-unknown.png", "-unknown.png", 0),
            ("a#1.png # grey", "a#1.png # grey", 0),
            ("\"open.png", "\"open.png", 0),
        ] {
            let (found, count) = read(line);
            let found = found.map(|found| found.name);
            assert_eq!(found.as_deref(), Some(name.as_bytes()), "{line}");
            assert_eq!(count, ignored, "{line}");
        }
        for line in ["", "-clamp on", "-s 1 2 3", "-mm"] {
            assert_eq!(read(line).0, None, "{line}");
        }
    }

    #[test]
    fn scale_offset_and_clamping_are_kept() {
        let found = read("-s 2 3 1 -o 0.5 a.png -clamp on").0.expect("a name");
        assert_eq!(found.scale, Vec2::new(2.0, 3.0));
        assert_eq!(found.offset, Vec2::new(0.5, 0.0));
        assert!(found.is_clamped);
        let found = read("-s 4 -clamp off a.png").0.expect("a name");
        assert_eq!(
            (found.scale, found.is_clamped),
            (Vec2::new(4.0, 1.0), false)
        );
    }
}
