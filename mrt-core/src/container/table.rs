//! Checks of the header and the section table.

use super::element::ElementType;
use super::error::{ContainerError, malformed};
use super::layout::{
    ALIGNMENT, CONTENT, COUNT, ENTRY_CRC, ENTRY_LENGTH, ENTRY_NAME, ENTRY_OFFSET, ENTRY_SIZE,
    ENTRY_TYPE, FILE_LENGTH, Format, HEADER_SIZE, KIND, LAYOUT, LAYOUT_VERSION, MAGIC,
    MAX_SECTIONS, RESERVED, TABLE_CRC, decode_name, get_u32, get_u64, table_crc,
};
use std::ops::Range;

/// What a sound header says.
pub(super) struct Header {
    pub(super) content_version: u32,
    pub(super) section_count: usize,
}

/// A section of a file.
#[derive(Clone, Debug)]
pub(super) struct Section<'a> {
    pub(super) name: &'a str,
    pub(super) element_type: ElementType,
    /// Where `content` starts, in bytes from the start of the file.
    pub(super) offset: usize,
    pub(super) content: &'a [u8],
}

impl Header {
    /// Bytes of header and table.
    pub(super) fn table_end(&self) -> usize {
        HEADER_SIZE + ENTRY_SIZE * self.section_count
    }
}

/// Reads the header, and checks everything in it and the checksum of the table.
pub(super) fn read_header(bytes: &[u8], format: &Format) -> Result<Header, ContainerError> {
    check_format(bytes, format)?;
    check_length(bytes, HEADER_SIZE)?;
    // Versions come before the checksum: a newer layout may place the checksum elsewhere.
    check_version(
        "layout",
        get_u32(bytes, LAYOUT),
        LAYOUT_VERSION..=LAYOUT_VERSION,
    )?;
    let content_version = get_u32(bytes, CONTENT);
    check_version(
        "content",
        content_version,
        format.oldest_version..=format.version,
    )?;
    let count = get_u32(bytes, COUNT);
    if count > MAX_SECTIONS {
        return Err(ContainerError::LimitExceeded {
            what: "section count",
            limit: u64::from(MAX_SECTIONS),
            found: u64::from(count),
        });
    }
    let header = Header {
        content_version,
        section_count: count as usize,
    };
    check_length(bytes, header.table_end())?;
    let length = get_u64(bytes, FILE_LENGTH);
    if length != bytes.len() as u64 {
        let found = bytes.len();
        return Err(malformed("file length", FILE_LENGTH, length, found));
    }
    let expected = get_u32(bytes, TABLE_CRC);
    let found = table_crc(&bytes[..header.table_end()]);
    if found != expected {
        return Err(ContainerError::Corrupt {
            section: "header".to_owned(),
            expected,
            found,
        });
    }
    check_zeros("reserved bytes", bytes, RESERVED)?;
    Ok(header)
}

/// Reads the section that the table entry at byte `entry` describes. Everything before `used_end` is
/// already taken.
pub(super) fn read_section(
    bytes: &[u8],
    entry: usize,
    used_end: usize,
) -> Result<Section<'_>, ContainerError> {
    let section = locate_section(bytes, entry, used_end)?;
    let found = crc32fast::hash(section.content);
    let expected = get_u32(bytes, entry + ENTRY_CRC);
    if found != expected {
        return Err(ContainerError::Corrupt {
            section: format!("section \"{}\"", section.name),
            expected,
            found,
        });
    }
    Ok(section)
}

/// [`read_section`] without the checksum.
fn locate_section(
    bytes: &[u8],
    entry: usize,
    used_end: usize,
) -> Result<Section<'_>, ContainerError> {
    let encoded_name = &bytes[entry..][ENTRY_NAME];
    let name = decode_name(encoded_name).ok_or_else(|| {
        let expected = "1 to 8 printing ASCII characters";
        malformed("section name", entry, expected, encoded_name.escape_ascii())
    })?;
    let code = get_u32(bytes, entry + ENTRY_TYPE);
    let mut types = ElementType::ALL.into_iter();
    let element_type = types.find(|&known| known as u32 == code).ok_or_else(|| {
        malformed(
            "element type",
            entry + ENTRY_TYPE,
            "a code from 0 to 8",
            code,
        )
    })?;
    // Only one offset is legal, so sections can neither overlap nor hide bytes between them.
    let offset = used_end.next_multiple_of(ALIGNMENT);
    let found = get_u64(bytes, entry + ENTRY_OFFSET);
    if found != offset as u64 {
        return Err(malformed(
            "section offset",
            entry + ENTRY_OFFSET,
            offset,
            found,
        ));
    }
    let length = get_u64(bytes, entry + ENTRY_LENGTH);
    let wrong_length =
        |expected: String| malformed("section length", entry + ENTRY_LENGTH, expected, length);
    let content = usize::try_from(length)
        .ok()
        .and_then(|length| offset.checked_add(length))
        .and_then(|end| bytes.get(offset..end))
        .ok_or_else(|| wrong_length(format!("at most {}", bytes.len().saturating_sub(offset))))?;
    if content.len() % element_type.size() != 0 {
        return Err(wrong_length(format!(
            "a multiple of {}",
            element_type.size()
        )));
    }
    check_zeros("padding", bytes, used_end..offset)?;
    Ok(Section {
        name,
        element_type,
        offset,
        content,
    })
}

fn check_format(bytes: &[u8], format: &Format) -> Result<(), ContainerError> {
    let mut expected = [0; 12];
    expected[MAGIC].copy_from_slice(&format.magic);
    expected[KIND].copy_from_slice(&format.kind);
    let start = &bytes[..bytes.len().min(expected.len())];
    // An empty file, or one cut within the magic, is not known to be of this kind.
    if start != expected {
        return Err(ContainerError::NotThisFormat {
            expected,
            found: start.to_vec(),
        });
    }
    Ok(())
}

fn check_length(bytes: &[u8], needed: usize) -> Result<(), ContainerError> {
    if bytes.len() >= needed {
        return Ok(());
    }
    let (expected, found) = (format!("at least {needed} bytes"), bytes.len());
    Err(malformed("file length", found, expected, found))
}

fn check_version(
    what: &'static str,
    found: u32,
    supported: std::ops::RangeInclusive<u32>,
) -> Result<(), ContainerError> {
    if supported.contains(&found) {
        return Ok(());
    }
    Err(ContainerError::UnsupportedVersion {
        what,
        found,
        oldest: *supported.start(),
        newest: *supported.end(),
    })
}

fn check_zeros(
    what: &'static str,
    bytes: &[u8],
    range: Range<usize>,
) -> Result<(), ContainerError> {
    match bytes[range.clone()].iter().position(|&byte| byte != 0) {
        None => Ok(()),
        Some(k) => {
            let at = range.start + k;
            Err(malformed(what, at, 0, bytes[at]))
        }
    }
}
