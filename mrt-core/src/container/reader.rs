//! From the bytes of a file to checked sections.

use super::budget::ByteBudget;
use super::element::{ElementType, SectionNumber};
use super::error::{ContainerError, malformed};
use super::layout::{ENTRY_SIZE, Format, HEADER_SIZE};
use super::table::{Section, read_header, read_section};

/// A checked container that borrows its bytes.
#[derive(Clone, Debug)]
pub struct Container<'a> {
    version: u32,
    sections: Vec<Section<'a>>,
}

impl<'a> Container<'a> {
    /// Checks all of `bytes`, checksums included.
    ///
    /// Cost: one pass over the bytes. Takes a few dozen bytes per section from `budget`.
    ///
    /// # Errors
    /// Any [`ContainerError`] but `Io`, `MissingSection` and `InvalidSection`.
    pub fn read(
        bytes: &'a [u8],
        format: &Format,
        budget: &mut ByteBudget,
    ) -> Result<Self, ContainerError> {
        let header = read_header(bytes, format)?;
        let count = header.section_count;
        budget.spend("section table", (count * size_of::<Section>()) as u64)?;
        let mut sections: Vec<Section> = Vec::with_capacity(count);
        let mut used_end = header.table_end();
        for entry in (HEADER_SIZE..used_end).step_by(ENTRY_SIZE) {
            let section = read_section(bytes, entry, used_end)?;
            if sections.iter().any(|other| other.name == section.name) {
                let (what, found) = ("section name", format!("\"{}\" again", section.name));
                return Err(malformed(what, entry, "a new name", found));
            }
            used_end = section.offset + section.content.len();
            sections.push(section);
        }
        if used_end != bytes.len() {
            let (what, expected) = ("end of the sections", format!("{used_end} bytes"));
            return Err(malformed(what, used_end, expected, bytes.len()));
        }
        Ok(Self {
            version: header.content_version,
            sections,
        })
    }

    /// Version of the content.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// True if there is a section of the given name.
    pub fn has(&self, name: &str) -> bool {
        self.sections().any(|(section, _)| section == name)
    }

    /// Number of elements of a section.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`].
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

    /// The bytes of a section of any type. They start at a multiple of
    /// [`ALIGNMENT`](super::ALIGNMENT) in the file.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`].
    pub fn bytes(&self, name: &str) -> Result<&'a [u8], ContainerError> {
        Ok(self.section(name)?.content)
    }

    /// A section of text.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`], and [`ContainerError::Malformed`] if the section has
    /// another type or is not UTF-8.
    pub fn text(&self, name: &str) -> Result<&'a str, ContainerError> {
        let section = self.typed_section(name, ElementType::Text)?;
        std::str::from_utf8(section.content).map_err(|error| {
            let at = section.offset + error.valid_up_to();
            malformed("text", at, "UTF-8", "another byte")
        })
    }

    /// A copy of a section of numbers, of any bit pattern. Use [`Container::finite_numbers`] where
    /// infinities and NaN must be refused.
    ///
    /// # Errors
    /// [`ContainerError::MissingSection`], [`ContainerError::Malformed`] if the section has another
    /// type, and [`ContainerError::LimitExceeded`] if the copy takes more than is left of `budget`.
    pub fn numbers<T: SectionNumber>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Vec<T>, ContainerError> {
        let section = self.typed_section(name, T::TYPE)?;
        budget.spend("section", section.content.len() as u64)?;
        let elements = section.content.chunks_exact(T::TYPE.size());
        Ok(elements.map(T::from_bytes).collect())
    }

    /// [`Container::numbers`] of floating point, all of which must be finite.
    ///
    /// # Errors
    /// As [`Container::numbers`], and [`ContainerError::Malformed`] for the first number that is
    /// infinite or NaN.
    pub fn finite_numbers<T: SectionNumber + Into<f64>>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Vec<T>, ContainerError> {
        let numbers = self.numbers::<T>(name, budget)?;
        self.check_finite(name, &numbers)?;
        Ok(numbers)
    }

    /// [`Container::bytes`] of a section that must have the given type.
    pub(crate) fn typed_bytes(
        &self,
        name: &str,
        element_type: ElementType,
    ) -> Result<&'a [u8], ContainerError> {
        Ok(self.typed_section(name, element_type)?.content)
    }

    /// Where a section starts in the file, in bytes.
    pub(crate) fn offset(&self, name: &str) -> Result<usize, ContainerError> {
        Ok(self.section(name)?.offset)
    }

    /// Refuses the first of a section's `numbers` that is infinite or NaN.
    pub(super) fn check_finite<T: SectionNumber + Into<f64>>(
        &self,
        name: &str,
        numbers: &[T],
    ) -> Result<(), ContainerError> {
        match numbers.iter().position(|&x| !x.into().is_finite()) {
            None => Ok(()),
            Some(k) => {
                let at = self.offset(name)? + k * T::TYPE.size();
                let found: f64 = numbers[k].into();
                Err(malformed("number", at, "a finite one", found))
            }
        }
    }

    fn section(&self, name: &str) -> Result<&Section<'a>, ContainerError> {
        let found = self.sections.iter().find(|section| section.name == name);
        found.ok_or_else(|| ContainerError::MissingSection {
            name: name.to_owned(),
        })
    }

    fn typed_section(
        &self,
        name: &str,
        wanted: ElementType,
    ) -> Result<&Section<'a>, ContainerError> {
        let section = self.section(name)?;
        if section.element_type == wanted {
            return Ok(section);
        }
        let (expected, found) = (format!("{wanted:?}"), format!("{:?}", section.element_type));
        let what = "element type of a section";
        Err(malformed(what, section.offset, expected, found))
    }
}
