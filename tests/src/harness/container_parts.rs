//! A container file, taken apart however damaged it is, changed, and put together with sound checksums.
//!
//! A changed byte of a container only ever tries its checksums. So changes are made to the parts, and the table and the
//! checksums are then made to fit: what the sections say is what readers meet.

use super::target::ChangeBytes;
use crate::dictionaries::dictionary_format;
use crate::random::Random;

const HEADER: usize = 64;
const ENTRY: usize = 32;
const ALIGNMENT: usize = 64;
const MOST_SECTIONS: usize = 256;

/// Bytes of an element, by the code of its type.
const ELEMENT_SIZES: [usize; 9] = [1, 1, 2, 4, 8, 4, 8, 1, 2];

/// Numbers that are often a limit of something; as `f32`: 0, 1, NaN, infinities, the largest, the smallest.
const NUMBERS: [u32; 16] = [
    0,
    1,
    2,
    3,
    16,
    128,
    4096,
    4097,
    0x3f80_0000,
    0x7fc0_0000,
    0x7f80_0000,
    0xff80_0000,
    0x7f7f_ffff,
    0xff7f_ffff,
    1,
    u32::MAX,
];

/// The sections of a container file, and the version of what they mean.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Version of the content.
    pub version: u32,
    /// In the order of the file.
    pub sections: Vec<Part>,
}

/// A section.
#[derive(Clone, Debug)]
pub struct Part {
    /// Padded with zeros.
    pub name: [u8; 8],
    /// Code of the element type.
    pub element_type: u32,
    /// Its bytes.
    pub content: Vec<u8>,
}

impl Parts {
    /// What the table of a file says, as far as the bytes reach.
    pub fn of(bytes: &[u8]) -> Self {
        let number = |at: usize| {
            let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
            u32::from_le_bytes(word.unwrap_or_default())
        };
        let version = match number(16) {
            1 => 1,
            _ => 2,
        };
        let room = bytes.len().saturating_sub(HEADER) / ENTRY;
        let count = (number(20) as usize).min(room).min(MOST_SECTIONS);
        let mut at = HEADER + ENTRY * count;
        let sections = (0..count).map(|k| {
            let entry = HEADER + ENTRY * k;
            at = at.next_multiple_of(ALIGNMENT).min(bytes.len());
            let end = at + (number(entry + 16) as usize).min(bytes.len() - at);
            let content = bytes[at..end].to_vec();
            at = end;
            Part {
                name: bytes[entry..entry + 8].try_into().unwrap_or_default(),
                element_type: number(entry + 24),
                content,
            }
        });
        Self {
            version,
            sections: sections.collect(),
        }
    }

    /// The file of these parts. Contents are cut to whole elements.
    pub fn bytes(&self) -> Vec<u8> {
        let format = dictionary_format(2);
        let count = self.sections.len();
        let mut bytes = vec![0; HEADER + ENTRY * count];
        bytes[..8].copy_from_slice(&format.magic);
        bytes[8..12].copy_from_slice(&format.kind);
        bytes[12..16].copy_from_slice(&1u32.to_le_bytes());
        bytes[16..20].copy_from_slice(&self.version.to_le_bytes());
        bytes[20..24].copy_from_slice(&(count as u32).to_le_bytes());
        for (k, part) in self.sections.iter().enumerate() {
            bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
            let element_type = part.element_type % ELEMENT_SIZES.len() as u32;
            let size = ELEMENT_SIZES[element_type as usize];
            let content = &part.content[..part.content.len() / size * size];
            let offset = bytes.len() as u64;
            let entry = &mut bytes[HEADER + ENTRY * k..][..ENTRY];
            entry[..8].copy_from_slice(&part.name);
            entry[8..16].copy_from_slice(&offset.to_le_bytes());
            entry[16..24].copy_from_slice(&(content.len() as u64).to_le_bytes());
            entry[24..28].copy_from_slice(&element_type.to_le_bytes());
            entry[28..].copy_from_slice(&crc32fast::hash(content).to_le_bytes());
            bytes.extend_from_slice(content);
        }
        let length = bytes.len() as u64;
        bytes[24..32].copy_from_slice(&length.to_le_bytes());
        let checksum = crc32fast::hash(&bytes[..HEADER + ENTRY * count]);
        bytes[32..36].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// Changes the content, the name, the type or the place of one section.
    pub fn change(&mut self, random: &mut Random, change: &mut ChangeBytes<'_>, most: usize) {
        if self.sections.is_empty() {
            return;
        }
        let at = random.below(self.sections.len());
        let other = random.below(self.sections.len());
        let (other_name, part) = (self.sections[other].name, &mut self.sections[at]);
        match random.below(16) {
            0 => part.element_type = random.below(ELEMENT_SIZES.len()) as u32,
            1 => part.name[random.below(8)] = (b' ' + random.below(95) as u8) & 0x7f,
            2 => part.name = other_name,
            3 => self.sections.swap(at, other),
            4 => drop(self.sections.remove(at)),
            5 => {
                let copy = self.sections[other].content.clone();
                self.sections[at].content = copy;
            }
            6 => self.version = 3 - self.version,
            7 => {
                let length = random.below(2 * part.content.len() + 9);
                part.content.resize(length, random.bits() as u8);
            }
            8..=11 => put_number(random, &mut part.content),
            _ => change(&mut part.content, most),
        }
    }
}

/// Puts a small or a special number into a place of a section.
fn put_number(random: &mut Random, content: &mut [u8]) {
    if content.len() < 4 {
        return;
    }
    let at = 4 * random.below(content.len() / 4);
    let value = match random.below(3) {
        0 => random.below(6) as u32,
        1 => random.bits() as u32,
        _ => NUMBERS[random.below(NUMBERS.len())],
    };
    content[at..at + 4].copy_from_slice(&value.to_le_bytes());
}
