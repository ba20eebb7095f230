//! The material libraries that an OBJ names.

use super::lines::{before_comment, decode, readable};
use super::materials::{LibraryReport, Materials};
use super::notes::Notes;
use crate::import::file::{Refusal, SceneFolder, base_name, read_found, spellings};
use crate::import::limits::{MAX_LIBRARIES, MAX_LIBRARY_BYTES};
use std::collections::{BTreeMap, HashSet};
use std::path::PathBuf;

/// A name of more words is not looked for.
const MAX_NAME_WORDS: usize = 8;

/// What the libraries of a scene hold.
pub(super) struct Libraries {
    pub(super) materials: Materials,
    pub(super) warnings: Vec<String>,
    /// What is not used, by kind.
    pub(super) ignored: BTreeMap<String, usize>,
}

/// Reads the libraries that `lines` name, what follows `mtllib` in them.
pub(super) fn read_libraries(folder: &SceneFolder, lines: &[Vec<u8>]) -> Libraries {
    let mut reader = Reader {
        folder,
        opened: HashSet::new(),
        left: MAX_LIBRARY_BYTES,
        notes: Notes::about("material libraries"),
        materials: Materials::default(),
        ignored: BTreeMap::new(),
    };
    let is_there = |name: &[u8]| !matches!(folder.find(spellings(name)), Err(Refusal::Missing));
    let mut known = HashSet::new();
    let names = lines.iter().flat_map(|line| library_names(line, is_there));
    for name in names {
        if !known.insert(name.clone()) {
            continue;
        }
        if reader.opened.len() == MAX_LIBRARIES || known.len() > 2 * MAX_LIBRARIES {
            let sentence = format!("only {MAX_LIBRARIES} material libraries are read");
            reader.notes.add(sentence);
            break;
        }
        if let Err(refusal) = reader.read(&name) {
            let name = readable(&name);
            reader
                .notes
                .add(format!("material library {name} {refusal}"));
        }
    }
    Libraries {
        materials: reader.materials,
        warnings: reader.notes.finish(),
        ignored: reader.ignored,
    }
}

struct Reader<'a> {
    folder: &'a SceneFolder,
    opened: HashSet<PathBuf>,
    /// Bytes that may still be read.
    left: u64,
    notes: Notes,
    materials: Materials,
    ignored: BTreeMap<String, usize>,
}

impl Reader<'_> {
    fn read(&mut self, name: &[u8]) -> Result<(), Refusal> {
        let mut names = spellings(name);
        names.push(base_name(name));
        let path = self.folder.find(&names)?;
        if !self.opened.insert(path.clone()) {
            return Ok(());
        }
        let bytes = read_found(&path, &mut self.left)?;
        let name = readable(name);
        let Some(text) = decode(&bytes) else {
            self.notes
                .add(format!("material library {name} is no text"));
            return Ok(());
        };
        let folder = self.folder.folder_of(&path);
        let report = self.materials.add_library(&text, &folder);
        self.note(&name, report);
        Ok(())
    }

    fn note(&mut self, name: &str, report: LibraryReport) {
        for (kind, count) in report.ignored {
            *self.ignored.entry(kind).or_default() += count;
        }
        if report.material_count == 0 {
            self.notes
                .add(format!("material library {name} holds no material"));
        }
        if let [first, more @ ..] = &report.faulty_lines[..] {
            let more = match more.len() {
                0 => String::new(),
                count => format!("; and {count} more such lines"),
            };
            self.notes.add(format!(
                "material library {name}, line {first}: expected a colour of one or three numbers{more}"
            ));
        }
    }
}

/// The names in what follows `mtllib`. Names may be quoted, hold spaces, with a backslash before them or not, and hold
/// `#`; which files are there decides.
fn library_names(line: &[u8], is_there: impl Fn(&[u8]) -> bool) -> Vec<Vec<u8>> {
    let short = before_comment(line);
    if let Some(whole) = [line, short]
        .into_iter()
        .find(|name| !name.is_empty() && is_there(name))
    {
        return vec![whole.to_vec()];
    }
    let words = split(line);
    let mut names = Vec::new();
    let mut first = 0;
    while first < words.len() && names.len() <= MAX_LIBRARIES {
        let longest = words.len().min(first + MAX_NAME_WORDS);
        let joined = |end: usize| join(line, &words[first..end]);
        let found = (first + 1..=longest)
            .rev()
            .find(|&end| is_there(&joined(end)));
        let end = found.unwrap_or_else(|| {
            // A missing file's name ends where names of libraries do, or before one that is there.
            let ends = |&end: &usize| {
                let is_library = words[end - 1].text.to_ascii_lowercase().ends_with(b".mtl");
                is_library || words.get(end).is_none_or(|next| is_there(&next.text))
            };
            (first + 1..longest).find(ends).unwrap_or(longest)
        });
        names.push(joined(end));
        first = end;
    }
    names
}

/// A word of a line: where it begins and ends, and its text without quotes and escapes.
struct Word {
    begin: usize,
    end: usize,
    text: Vec<u8>,
}

/// Splits at white space that is neither quoted nor after a backslash, up to a comment or more words than all names that
/// are read can have.
fn split(line: &[u8]) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    let mut is_open = false;
    let mut is_quoted = false;
    let mut k = 0;
    while k < line.len() {
        let is_escape = line[k] == b'\\' && line.get(k + 1) == Some(&b' ');
        if line[k].is_ascii_whitespace() && !is_quoted {
            is_open = false;
            k += 1;
            continue;
        }
        if !is_open {
            if line[k] == b'#' || words.len() > MAX_LIBRARIES * MAX_NAME_WORDS {
                break;
            }
            is_open = true;
            words.push(Word {
                begin: k,
                end: k,
                text: Vec::new(),
            });
        }
        k += usize::from(is_escape);
        if let Some(word) = words.last_mut() {
            match line[k] {
                b'"' => is_quoted = !is_quoted,
                byte => word.text.push(byte),
            }
            word.end = k + 1;
        }
        k += 1;
    }
    words
}

/// The name that one or several words make: a single word without quotes and escapes, several as they stand.
fn join(line: &[u8], words: &[Word]) -> Vec<u8> {
    match words {
        [first, .., last] => line[first.begin..last.end].to_vec(),
        [word] => word.text.clone(),
        [] => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_there_decide_where_names_end() {
        let there = [
            "a.mtl",
            "b.mtl",
            "my lib.mtl",
            "a#b.mtl",
            "my #1.mtl",
            "dir\\c.mtl",
            "plain",
        ];
        for (line, names) in [
            ("a.mtl", &["a.mtl"][..]),
            ("a.mtl b.mtl", &["a.mtl", "b.mtl"]),
            ("a.mtl # b.mtl", &["a.mtl"]),
            ("my lib.mtl", &["my lib.mtl"]),
            ("my\\ lib.mtl", &["my lib.mtl"]),
            ("\"my lib.mtl\" b.mtl", &["my lib.mtl", "b.mtl"]),
            ("b.mtl my lib.mtl a.mtl", &["b.mtl", "my lib.mtl", "a.mtl"]),
            ("a#b.mtl", &["a#b.mtl"]),
            ("my #1.mtl", &["my #1.mtl"]),
            ("my\\ #1.mtl # mine", &["my #1.mtl"]),
            ("\"my #1.mtl\" # mine", &["my #1.mtl"]),
            ("dir\\c.mtl plain", &["dir\\c.mtl", "plain"]),
            ("gone.mtl", &["gone.mtl"]),
            ("gone far.mtl b.mtl", &["gone far.mtl", "b.mtl"]),
            ("gone b.mtl", &["gone", "b.mtl"]),
            ("gone.mtl away.mtl", &["gone.mtl", "away.mtl"]),
            ("", &[]),
            ("# none", &[]),
        ] {
            let found = library_names(line.as_bytes(), |name| {
                there.iter().any(|there| there.as_bytes() == name)
            });
            let found: Vec<String> = found.iter().map(|name| readable(name)).collect();
            assert_eq!(found, names, "{line}");
        }
    }
}
