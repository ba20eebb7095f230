//! From bytes to a document: the binary container, the JSON, the version and what the file requires.

use super::document::{Document, Head};
use super::extensions;
use super::fault::{Fault, shown};
use crate::import::limits::{MAX_JSON_CONTAINERS, MAX_JSON_VALUES};
use serde_json::Value;

/// The first bytes of a binary file.
const MAGIC: &[u8; 4] = b"glTF";

/// A file's document, and the binary chunk that a binary file may have.
pub(super) struct Content<'a> {
    pub(super) document: Document,
    pub(super) bin: Option<&'a [u8]>,
}

/// Reads either kind of file, whatever its name: some exporters mix the endings up.
pub(super) fn read(bytes: &[u8]) -> Result<Content<'_>, Fault> {
    let (json, bin) = if bytes.starts_with(MAGIC) {
        split(bytes)?
    } else {
        (bytes, None)
    };
    let document = parse(json)?;
    extensions::check(&document)?;
    Ok(Content { document, bin })
}

/// The JSON and the binary chunk of a binary file.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let header = || Fault::at("header", "a complete binary glTF 2.0 file");
    let version = word(bytes, 4).ok_or_else(header)?;
    if version != 2 {
        let place = format!("header: version {version}");
        return Err(Fault::at(place, "binary glTF 2"));
    }
    let length = word(bytes, 8).ok_or_else(header)? as usize;
    let file = bytes.get(..length).ok_or_else(header)?;
    let (kind, json) = chunk(file, 12).ok_or_else(header)?;
    if kind != b"JSON" {
        return Err(Fault::at("first chunk", "the kind `JSON`"));
    }
    // Chunks of other kinds may follow, but the binary one comes second; some exporters forget to pad the first.
    let end = 20 + json.len();
    let bin = [end.next_multiple_of(4), end]
        .into_iter()
        .find_map(|start| {
            let (kind, bytes) = chunk(file, start)?;
            (kind == b"BIN\0").then_some(bytes)
        });
    Ok((json, bin))
}

/// The little-endian number at `offset`.
fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    let word = bytes.get(offset..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word))
}

/// Kind and content of the chunk at `offset`.
fn chunk(file: &[u8], offset: usize) -> Option<(&[u8], &[u8])> {
    let size = word(file, offset)? as usize;
    let kind = file.get(offset + 4..offset + 8)?;
    Some((kind, file.get(offset + 8..)?.get(..size)?))
}

fn parse(json: &[u8]) -> Result<Document, Fault> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    // Some exporters write names in the code page of their machine.
    let json = String::from_utf8_lossy(json);
    check_size(&json)?;
    let fault = |error: serde_json::Error| {
        let text = error.to_string();
        let reason = text.split(" at line ").next().unwrap_or_default();
        let (line, column) = (error.line(), error.column());
        Fault::Malformed {
            place: format!("JSON, line {line}, column {column}: {}", shown(reason)),
            expected: "a glTF 2.0 document",
        }
    };
    let head: Head = serde_json::from_str(&json).map_err(fault)?;
    check_version(&head)?;
    serde_json::from_str(&json)
        .or_else(|error| serde_json::from_str(&without_empty_fractions(&json)).map_err(|_| error))
        .map_err(fault)
}

/// Counts what takes memory: an empty object of the text can become a few hundred bytes.
fn check_size(json: &str) -> Result<(), Fault> {
    let (mut in_string, mut after_backslash) = (false, false);
    let (mut containers, mut values) = (0usize, 0usize);
    for byte in json.bytes() {
        match byte {
            _ if after_backslash => after_backslash = false,
            b'\\' => after_backslash = in_string,
            b'"' => in_string = !in_string,
            b'{' | b'[' if !in_string => containers += 1,
            b',' if !in_string => values += 1,
            _ => {}
        }
    }
    if values > MAX_JSON_VALUES {
        let place = format!("JSON: {values} numbers and names");
        return Err(Fault::at(place, "at most 32,000,000"));
    }
    if containers > MAX_JSON_CONTAINERS {
        let place = format!("JSON: {containers} objects and lists");
        return Err(Fault::at(place, "at most 4,000,000"));
    }
    Ok(())
}

/// Every 2.x promises to read as 2.0 does, unless it names a later least version.
fn check_version(head: &Head) -> Result<(), Fault> {
    let text = |version: &Value| match version {
        Value::Null => "none".to_owned(),
        Value::String(text) => shown(text),
        other => shown(&other.to_string()),
    };
    let [version, least] = [&head.asset.version, &head.asset.min_version].map(text);
    if version.split('.').next() != Some("2") {
        return Err(Fault::at(format!("asset: version {version}"), "glTF 2"));
    }
    if !["none", "2", "2.0"].contains(&least.as_str()) {
        let place = format!("asset: least version {least}");
        return Err(Fault::at(place, "glTF 2.0"));
    }
    Ok(())
}

/// JSON takes 3.0 for an integer, which the library does not: leaves out fractions of zeros.
fn without_empty_fractions(json: &str) -> String {
    let (mut in_string, mut after_backslash) = (false, false);
    let mut text = String::with_capacity(json.len());
    let mut rest = json;
    while let Some(c) = rest.chars().next() {
        rest = &rest[c.len_utf8()..];
        match c {
            _ if after_backslash => after_backslash = false,
            '\\' => after_backslash = in_string,
            '"' => in_string = !in_string,
            '.' if !in_string => {
                let after = rest.trim_start_matches('0');
                let ends = !after.starts_with(|c: char| c.is_ascii_digit() || "eE".contains(c));
                if ends && after.len() < rest.len() {
                    rest = after;
                    continue;
                }
            }
            _ => {}
        }
        text.push(c);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_fractions_of_zeros_are_left_out() {
        let json = r#"{"a.0\".0":[1.0,2.000 ,3.05,4.0e1,-5.0],"b":6.0}"#;
        let expected = r#"{"a.0\".0":[1,2 ,3.05,4.0e1,-5],"b":6}"#;
        assert_eq!(without_empty_fractions(json), expected);
    }
}
