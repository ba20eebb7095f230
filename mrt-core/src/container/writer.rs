//! From sections to the bytes of a file.

use super::element::{ElementType, SectionNumber};
use super::error::ContainerError;
use super::layout::{
    ALIGNMENT, CONTENT, COUNT, ENTRY_CRC, ENTRY_LENGTH, ENTRY_NAME, ENTRY_OFFSET, ENTRY_SIZE,
    ENTRY_TYPE, FILE_LENGTH, Format, HEADER_SIZE, KIND, LAYOUT, LAYOUT_VERSION, MAGIC,
    MAX_SECTIONS, TABLE_CRC, decode_name, encode_name, put_u32, put_u64, table_crc,
};

/// Collects sections and lays them out; the same sections give the same bytes.
#[derive(Clone, Debug)]
pub struct Writer {
    format: Format,
    sections: Vec<NewSection>,
}

#[derive(Clone, Debug)]
struct NewSection {
    name: String,
    element_type: ElementType,
    content: Vec<u8>,
}

impl Writer {
    /// A container without sections.
    pub fn new(format: Format) -> Self {
        Self {
            format,
            sections: Vec::new(),
        }
    }

    /// Appends a section of numbers, of any bit pattern.
    ///
    /// # Errors
    /// As [`Writer::add_bytes`].
    pub fn add_numbers<T: SectionNumber>(
        &mut self,
        name: &str,
        numbers: &[T],
    ) -> Result<(), ContainerError> {
        let mut bytes = Vec::with_capacity(numbers.len() * T::TYPE.size());
        for number in numbers {
            number.write_to(&mut bytes);
        }
        self.add(name, T::TYPE, bytes)
    }

    /// Appends a section of text.
    ///
    /// # Errors
    /// As [`Writer::add_bytes`].
    pub fn add_text(&mut self, name: &str, text: &str) -> Result<(), ContainerError> {
        self.add(name, ElementType::Text, text.as_bytes().to_vec())
    }

    /// Appends a section of bytes.
    ///
    /// # Errors
    /// [`ContainerError::InvalidSection`] if the name is not 1 to 8 printing ASCII characters without
    /// space, or is taken; [`ContainerError::LimitExceeded`] beyond [`MAX_SECTIONS`] sections.
    pub fn add_bytes(&mut self, name: &str, bytes: &[u8]) -> Result<(), ContainerError> {
        self.add(name, ElementType::Bytes, bytes.to_vec())
    }

    fn add(
        &mut self,
        name: &str,
        element_type: ElementType,
        content: Vec<u8>,
    ) -> Result<(), ContainerError> {
        let invalid = |reason| ContainerError::InvalidSection {
            name: name.to_owned(),
            reason,
        };
        if name.len() > 8 || decode_name(&encode_name(name)) != Some(name) {
            return Err(invalid("a name is 1 to 8 printing ASCII characters"));
        }
        if self.sections.iter().any(|section| section.name == name) {
            return Err(invalid("the name is taken"));
        }
        if self.sections.len() >= MAX_SECTIONS as usize {
            return Err(ContainerError::LimitExceeded {
                what: "section count",
                limit: u64::from(MAX_SECTIONS),
                found: u64::from(MAX_SECTIONS) + 1,
            });
        }
        self.sections.push(NewSection {
            name: name.to_owned(),
            element_type,
            content,
        });
        Ok(())
    }

    /// The bytes of the whole file.
    pub fn finish(&self) -> Vec<u8> {
        let table_end = HEADER_SIZE + ENTRY_SIZE * self.sections.len();
        let mut bytes = vec![0; table_end];
        bytes[MAGIC].copy_from_slice(&self.format.magic);
        bytes[KIND].copy_from_slice(&self.format.kind);
        put_u32(&mut bytes, LAYOUT, LAYOUT_VERSION);
        put_u32(&mut bytes, CONTENT, self.format.version);
        put_u32(&mut bytes, COUNT, self.sections.len() as u32);
        for (k, section) in self.sections.iter().enumerate() {
            bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
            let (offset, content) = (bytes.len() as u64, &section.content);
            let entry = &mut bytes[HEADER_SIZE + ENTRY_SIZE * k..][..ENTRY_SIZE];
            entry[ENTRY_NAME].copy_from_slice(&encode_name(&section.name));
            put_u64(entry, ENTRY_OFFSET, offset);
            put_u64(entry, ENTRY_LENGTH, content.len() as u64);
            put_u32(entry, ENTRY_TYPE, section.element_type as u32);
            put_u32(entry, ENTRY_CRC, crc32fast::hash(content));
            bytes.extend_from_slice(content);
        }
        let length = bytes.len() as u64;
        put_u64(&mut bytes, FILE_LENGTH, length);
        let crc = table_crc(&bytes[..table_end]);
        put_u32(&mut bytes, TABLE_CRC, crc);
        bytes
    }
}
