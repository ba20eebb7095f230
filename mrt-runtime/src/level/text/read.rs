//! Reads a level's text piece by piece.

use super::pieces::{List, MAX_PIECE_BYTES, is_table, pieces};
use super::whole::Whole;
use super::{
    BlockText, FORMAT, LEVEL_VERSION, LevelTextError, MeshText, read_block, read_face, read_mesh,
};
use crate::level::block::{Connection, Door, Level, MAX_BLOCKS, Opening};
use crate::level::error::LevelError;
use mrt_core::excerpt::{excerpt, printable};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::ops::Range;

/// Most characters of the parser's message: room for the names of all keys.
const LONGEST_MESSAGE: usize = 200;

#[derive(Deserialize)]
struct Header {
    #[serde(default)]
    format: String,
    #[serde(default)]
    version: u32,
}

/// A piece of a level. Format and version stand in the first.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    #[serde(default, rename = "format")]
    _format: String,
    #[serde(default, rename = "version")]
    _version: u32,
    #[serde(default)]
    connections: Vec<Whole<(usize, String, usize, String)>>,
    #[serde(default)]
    doors: Vec<Whole<(usize, f32)>>,
    #[serde(default)]
    mesh: Option<MeshText>,
    #[serde(default, rename = "block")]
    blocks: Vec<BlockText>,
}

/// The level of a text, unchecked.
pub(super) fn read(text: &str) -> Result<Level, LevelTextError> {
    let pieces = pieces(text);
    let head = Piece::of(text, &pieces.head, "what stands before the first block")?;
    // Format and version come first: another version may have keys that this one does not know.
    let header: Header = head.parse()?;
    if header.format != FORMAT {
        return Err(LevelTextError::NotALevel {
            found: excerpt(&header.format),
        });
    }
    if header.version != LEVEL_VERSION {
        return Err(LevelTextError::UnsupportedVersion {
            found: header.version,
        });
    }
    let mut level = Level::default();
    add(&mut level, head.parse()?)?;
    for List { opening, elements } in &pieces.lists {
        for range in elements {
            let place = "an element of a list, with its name";
            let ranges = [opening.clone(), range.clone()];
            let piece = Piece::of(text, &ranges, place)?;
            add(&mut level, piece.closed().parse()?)?;
        }
    }
    if let (Some(first), false) = (pieces.tables.first(), level.blocks.is_empty()) {
        let line = line_of(text, first.start);
        let message = format!("line {line}: a list of blocks; expected one, and found it above");
        return Err(LevelTextError::Malformed(message));
    }
    for range in &pieces.tables {
        let piece = Piece::of(text, std::slice::from_ref(range), "a block")?;
        add(&mut level, piece.parse()?)?;
        check_block_count(&level, &text[range.end..])?;
    }
    Ok(level)
}

/// Stops early when there are too many blocks, and counts those of the `rest` without parsing them.
fn check_block_count(level: &Level, rest: &str) -> Result<(), LevelTextError> {
    if level.blocks.len() <= MAX_BLOCKS {
        return Ok(());
    }
    let others = rest.lines().filter(|line| is_table(line.as_bytes(), 0));
    Err(LevelTextError::Level(LevelError::TooManyBlocks {
        expected: MAX_BLOCKS,
        found: level.blocks.len() + others.count(),
    }))
}

/// Adds the blocks, connections and doors of a piece.
fn add(level: &mut Level, content: Content) -> Result<(), LevelTextError> {
    if let Some(mesh) = content.mesh {
        level.mesh = Some(read_mesh(mesh)?);
    }
    for block in &content.blocks {
        level.blocks.push(read_block(level.blocks.len(), block)?);
    }
    for Whole((a, a_face, b, b_face)) in &content.connections {
        let index = level.connections.len();
        let end = |block: usize, face: &str| {
            let face = read_face(face, || format!("connection {index}"))?;
            Ok::<_, LevelTextError>(Opening { block, face })
        };
        level.connections.push(Connection {
            a: end(*a, a_face)?,
            b: end(*b, b_face)?,
        });
    }
    let doors = content.doors.iter();
    level
        .doors
        .extend(doors.map(|&Whole((connection, value))| Door { connection, value }));
    Ok(())
}

/// A piece of a text, joined from several ranges of it.
struct Piece<'t> {
    whole: &'t str,
    ranges: &'t [Range<usize>],
    text: String,
}

impl<'t> Piece<'t> {
    /// `place` says in an error what the piece is.
    fn of(whole: &'t str, ranges: &'t [Range<usize>], place: &str) -> Result<Self, LevelTextError> {
        let found = ranges.iter().map(Range::len).sum();
        if found > MAX_PIECE_BYTES {
            let line = line_of(whole, ranges.last().map_or(0, |range| range.start));
            return Err(LevelTextError::PartTooLong {
                place: format!("{place}, at line {line}"),
                expected: MAX_PIECE_BYTES,
                found,
            });
        }
        let parts = ranges.iter().map(|range| &whole[range.clone()]);
        Ok(Self {
            whole,
            ranges,
            text: parts.collect(),
        })
    }

    /// The elements of a list with the bracket that closes it. They may end with a comment, which ends with its line.
    fn closed(mut self) -> Self {
        self.text.push_str("\n]");
        self
    }

    fn parse<T: DeserializeOwned>(&self) -> Result<T, LevelTextError> {
        toml::from_str(&self.text).map_err(|error| LevelTextError::Malformed(self.message(&error)))
    }

    /// The parser's message with the line, without the excerpt of several lines that the parser adds.
    fn message(&self, error: &toml::de::Error) -> String {
        let message = error.message().trim().replace('\n', "; ");
        let message = printable(&message, LONGEST_MESSAGE);
        match error.span() {
            Some(span) => format!("line {}: {message}", self.line(span.start)),
            None => message,
        }
    }

    /// The line of the whole text, from 1, that a byte of the piece is on.
    fn line(&self, at: usize) -> usize {
        let mut before = 0;
        for range in self.ranges {
            if at < before + range.len() {
                return line_of(self.whole, range.start + at - before);
            }
            before += range.len();
        }
        line_of(self.whole, self.ranges.last().map_or(0, |range| range.end))
    }
}

/// The line, from 1, that a byte of a text is on.
fn line_of(text: &str, at: usize) -> usize {
    let before = &text.as_bytes()[..at.min(text.len())];
    before.iter().filter(|&&byte| byte == b'\n').count() + 1
}
