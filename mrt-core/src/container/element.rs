//! The types of number that sections hold.

use bytemuck::AnyBitPattern;
use half::f16;

/// Type of a section's elements. The discriminant is the code in the file, so it never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementType {
    /// Bytes that the container does not interpret.
    Bytes = 0,
    /// UTF-8.
    Text = 1,
    /// 16-bit unsigned integers.
    U16 = 2,
    /// 32-bit unsigned integers.
    U32 = 3,
    /// 64-bit unsigned integers.
    U64 = 4,
    /// IEEE single precision.
    F32 = 5,
    /// IEEE double precision.
    F64 = 6,
    /// 8-bit signed integers.
    I8 = 7,
    /// IEEE half precision.
    F16 = 8,
}

impl ElementType {
    pub(super) const ALL: [ElementType; 9] = [
        ElementType::Bytes,
        ElementType::Text,
        ElementType::U16,
        ElementType::U32,
        ElementType::U64,
        ElementType::F32,
        ElementType::F64,
        ElementType::I8,
        ElementType::F16,
    ];

    /// Bytes an element takes.
    pub const fn size(self) -> usize {
        match self {
            ElementType::Bytes | ElementType::Text | ElementType::I8 => 1,
            ElementType::U16 | ElementType::F16 => 2,
            ElementType::U32 | ElementType::F32 => 4,
            ElementType::U64 | ElementType::F64 => 8,
        }
    }
}

/// A number that sections hold: `i8`, `u16`, `u32`, `u64`, `f16`, `f32` or `f64`.
pub trait SectionNumber: AnyBitPattern {
    /// The code of this type in the table.
    const TYPE: ElementType;
    /// Appends the number's little-endian bytes.
    fn write_to(self, bytes: &mut Vec<u8>);
    /// The number of exactly [`ElementType::size`] bytes; zero for any other count of bytes.
    fn from_bytes(bytes: &[u8]) -> Self;
}

macro_rules! section_number {
    ($number:ty, $type:ident) => {
        impl SectionNumber for $number {
            const TYPE: ElementType = ElementType::$type;
            fn write_to(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            fn from_bytes(bytes: &[u8]) -> Self {
                Self::from_le_bytes(bytes.try_into().unwrap_or_default())
            }
        }
    };
}
section_number!(i8, I8);
section_number!(u16, U16);
section_number!(u32, U32);
section_number!(u64, U64);
section_number!(f16, F16);
section_number!(f32, F32);
section_number!(f64, F64);

#[cfg(test)]
mod tests {
    use super::*;

    /// Old files hold these codes, so they may never change.
    #[test]
    fn codes_of_types_are_frozen() {
        let codes = ElementType::ALL.map(|kind| (format!("{kind:?}"), kind as u32));
        let expected = [
            "Bytes", "Text", "U16", "U32", "U64", "F32", "F64", "I8", "F16",
        ];
        for (code, (expected, found)) in expected.into_iter().zip(codes).enumerate() {
            assert_eq!(found, (expected.to_owned(), code as u32));
        }
    }
}
