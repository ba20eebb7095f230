//! From the bytes of a file to checked sections.

use super::*;

/// A checked container that borrows its bytes.
#[derive(Clone, Debug)]
pub struct Container<'a> {
    version: u32,
    sections: Vec<Section<'a>>,
}

#[derive(Clone, Debug)]
pub(super) struct Section<'a> {
    name: &'a str,
    element_type: ElementType,
    pub(super) offset: usize,
    pub(super) content: &'a [u8],
}

impl<'a> Container<'a> {
    /// Checks all of `bytes`, checksums included.
    ///
    /// Cost: one pass over the bytes; takes a few dozen bytes a section from `budget`.
    ///
    /// # Errors
    /// Any but `Io`, `MissingSection` and `InvalidSection`.
    pub fn read(
        bytes: &'a [u8],
        format: &Format,
        budget: &mut ByteBudget,
    ) -> Result<Self, ContainerError> {
        let (version, count) = read_header(bytes, format)?;
        let mut used_end = HEADER_SIZE + ENTRY_SIZE * count;
        budget.spend("section table", (count * size_of::<Section>()) as u64)?;
        let mut sections: Vec<Section> = Vec::with_capacity(count);
        for entry in (HEADER_SIZE..used_end).step_by(ENTRY_SIZE) {
            let section = read_entry(bytes, entry, used_end)?;
            if sections.iter().any(|other| other.name == section.name) {
                let found = format!("\"{}\" again", section.name);
                return Err(malformed("section name", entry, "a new name", found));
            }
            let found = crc32fast::hash(section.content);
            let expected = get_u32(bytes, entry + 28);
            if found != expected {
                return Err(ContainerError::Corrupt {
                    section: format!("section \"{}\"", section.name),
                    expected,
                    found,
                });
            }
            used_end = section.offset + section.content.len();
            sections.push(section);
        }
        if used_end != bytes.len() {
            let expected = format!("{used_end} bytes");
            return Err(malformed(
                "end of the sections",
                used_end,
                expected,
                bytes.len(),
            ));
        }
        Ok(Self { version, sections })
    }

    /// Version of the content.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// True if there is a section of that name.
    pub fn has(&self, name: &str) -> bool {
        self.sections().any(|(section, _)| section == name)
    }

    /// Number of elements of a section.
    ///
    /// # Errors
    /// [`ContainerError`], if there is no such section.
    pub fn element_count(&self, name: &str) -> Result<usize, ContainerError> {
        let section = self.section(name)?;
        Ok(section.content.len() / section.element_type.size())
    }

    /// Names and types of all sections, in the order of the file.
    pub fn sections(&self) -> impl Iterator<Item = (&'a str, ElementType)> + '_ {
        self.sections.iter().map(|s| (s.name, s.element_type))
    }

    /// The type of a section's elements.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`].
    pub fn element_type(&self, name: &str) -> Result<ElementType, ContainerError> {
        Ok(self.section(name)?.element_type)
    }

    /// A section's bytes, of whatever type; they start at a multiple of [`ALIGNMENT`] in the file.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`].
    pub fn bytes(&self, name: &str) -> Result<&'a [u8], ContainerError> {
        Ok(self.section(name)?.content)
    }

    /// A section of text.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`], and [`ContainerError::Malformed`] if it is not text or not UTF-8.
    pub fn text(&self, name: &str) -> Result<&'a str, ContainerError> {
        let section = self.typed_section(name, ElementType::Text)?;
        std::str::from_utf8(section.content).map_err(|error| {
            let at = section.offset + error.valid_up_to();
            malformed("text", at, "UTF-8", "another byte")
        })
    }

    /// A copy of a section of numbers, of any bit pattern: check that they are finite where that
    /// matters, or take [`Container::finite_numbers`].
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`], [`ContainerError::Malformed`] if it has another type, and
    /// [`ContainerError::LimitExceeded`] if `budget` has fewer bytes left than it takes.
    pub fn numbers<T: Element>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Vec<T>, ContainerError> {
        let section = self.typed_section(name, T::TYPE)?;
        budget.spend("section", section.content.len() as u64)?;
        let elements = section.content.chunks_exact(T::TYPE.size());
        Ok(elements.map(T::from_bytes).collect())
    }

    /// [`Container::numbers`] of floating point that must be finite.
    ///
    /// # Errors
    /// As there, and [`ContainerError::Malformed`] at the first that is infinite or not a number.
    pub fn finite_numbers<T: Element + Into<f64>>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Vec<T>, ContainerError> {
        let numbers = self.numbers::<T>(name, budget)?;
        check_finite(self.section(name)?, &numbers)?;
        Ok(numbers)
    }

    /// [`Container::bytes`] of a section that must have that type.
    pub(crate) fn typed_bytes(
        &self,
        name: &str,
        element_type: ElementType,
    ) -> Result<&'a [u8], ContainerError> {
        Ok(self.typed_section(name, element_type)?.content)
    }

    /// The error for a section whose content breaks a rule of its reader: `at` counts bytes from the
    /// section's start.
    pub(crate) fn fault(
        &self,
        name: &str,
        what: &'static str,
        at: usize,
        expected: impl ToString,
        found: impl ToString,
    ) -> ContainerError {
        match self.section(name) {
            Ok(section) => malformed(what, section.offset + at, expected, found),
            Err(missing) => missing,
        }
    }

    pub(super) fn section(&self, name: &str) -> Result<&Section<'a>, ContainerError> {
        let found = self.sections.iter().find(|section| section.name == name);
        found.ok_or_else(|| ContainerError::MissingSection {
            name: name.to_owned(),
        })
    }

    pub(super) fn typed_section(
        &self,
        name: &str,
        wanted: ElementType,
    ) -> Result<&Section<'a>, ContainerError> {
        let section = self.section(name)?;
        let found = section.element_type;
        if found == wanted {
            return Ok(section);
        }
        let (expected, found) = (format!("{wanted:?}"), format!("{found:?}"));
        Err(malformed(
            "element type of a section",
            section.offset,
            expected,
            found,
        ))
    }
}

/// Refuses the first number that is infinite or not a number.
pub(super) fn check_finite<T: Element + Into<f64>>(
    section: &Section,
    numbers: &[T],
) -> Result<(), ContainerError> {
    match numbers.iter().position(|&x| !x.into().is_finite()) {
        None => Ok(()),
        Some(k) => {
            let at = section.offset + k * T::TYPE.size();
            let found: f64 = numbers[k].into();
            Err(malformed("number", at, "a finite one", found))
        }
    }
}

/// Content version and section count of a header that passes every check.
fn read_header(bytes: &[u8], format: &Format) -> Result<(u32, usize), ContainerError> {
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
    let truncated = |needed: usize| {
        let expected = format!("at least {needed} bytes");
        malformed("file length", bytes.len(), expected, bytes.len())
    };
    if bytes.len() < HEADER_SIZE {
        return Err(truncated(HEADER_SIZE));
    }
    // Versions come before the checksum: a newer version may place that elsewhere.
    let check_version = |what, at, oldest, newest| {
        let found = get_u32(bytes, at);
        if (oldest..=newest).contains(&found) {
            return Ok(found);
        }
        Err(ContainerError::UnsupportedVersion {
            what,
            found,
            oldest,
            newest,
        })
    };
    check_version("layout", LAYOUT, LAYOUT_VERSION, LAYOUT_VERSION)?;
    let version = check_version("content", CONTENT, format.oldest_version, format.version)?;
    let count = get_u32(bytes, COUNT);
    if count > MAX_SECTIONS {
        return Err(ContainerError::LimitExceeded {
            what: "section count",
            limit: u64::from(MAX_SECTIONS),
            found: u64::from(count),
        });
    }
    let table_end = HEADER_SIZE + ENTRY_SIZE * count as usize;
    if bytes.len() < table_end {
        return Err(truncated(table_end));
    }
    let length = get_u64(bytes, FILE_LENGTH);
    if length != bytes.len() as u64 {
        return Err(malformed("file length", FILE_LENGTH, length, bytes.len()));
    }
    let (crc, found) = (get_u32(bytes, TABLE_CRC), table_crc(&bytes[..table_end]));
    if crc != found {
        return Err(ContainerError::Corrupt {
            section: "header".to_owned(),
            expected: crc,
            found,
        });
    }
    check_zeros("reserved bytes", bytes, RESERVED)?;
    Ok((version, count as usize))
}

/// The section that the table entry at byte `entry` describes, where everything before `used_end` is
/// taken.
fn read_entry(bytes: &[u8], entry: usize, used_end: usize) -> Result<Section<'_>, ContainerError> {
    let name = decode_name(&bytes[entry..entry + 8]).ok_or_else(|| {
        let found = bytes[entry..entry + 8].escape_ascii();
        malformed(
            "section name",
            entry,
            "1 to 8 printing ASCII characters",
            found,
        )
    })?;
    let code = get_u32(bytes, entry + 24);
    let element_type = ElementType::ALL
        .into_iter()
        .find(|&known| known as u32 == code)
        .ok_or_else(|| malformed("element type", entry + 24, "a code from 0 to 8", code))?;
    // One place is legal, so that sections can neither overlap nor hide bytes between them.
    let expected = used_end.next_multiple_of(ALIGNMENT);
    let found = get_u64(bytes, entry + 8);
    if found != expected as u64 {
        return Err(malformed("section offset", entry + 8, expected, found));
    }
    let length = get_u64(bytes, entry + 16);
    let content = usize::try_from(length)
        .ok()
        .and_then(|length| expected.checked_add(length))
        .and_then(|end| bytes.get(expected..end))
        .ok_or_else(|| {
            let left = bytes.len().saturating_sub(expected);
            malformed(
                "section length",
                entry + 16,
                format!("at most {left}"),
                length,
            )
        })?;
    if content.len() % element_type.size() != 0 {
        let expected = format!("a multiple of {}", element_type.size());
        return Err(malformed("section length", entry + 16, expected, length));
    }
    check_zeros("padding", bytes, used_end..expected)?;
    Ok(Section {
        name,
        element_type,
        offset: expected,
        content,
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

fn malformed(
    what: &'static str,
    at: usize,
    expected: impl ToString,
    found: impl ToString,
) -> ContainerError {
    ContainerError::Malformed {
        what,
        at: at as u64,
        expected: expected.to_string(),
        found: found.to_string(),
    }
}
