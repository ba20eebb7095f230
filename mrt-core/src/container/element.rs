//! The types of number that sections hold.

use bytemuck::AnyBitPattern;
use half::f16;

/// Type of a section's elements; the discriminant is the code in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementType {
    /// Bytes with no meaning here.
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

    /// Bytes an element.
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
pub trait Element: AnyBitPattern {
    /// Its code in the table.
    const TYPE: ElementType;
    /// Appends its bytes.
    fn write_to(self, bytes: &mut Vec<u8>);
    /// From exactly [`ElementType::size`] bytes; from fewer or more, as if they were zeros.
    fn from_bytes(bytes: &[u8]) -> Self;
}

macro_rules! element {
    ($number:ty, $type:ident) => {
        impl Element for $number {
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
element!(i8, I8);
element!(u16, U16);
element!(u32, U32);
element!(u64, U64);
element!(f16, F16);
element!(f32, F32);
element!(f64, F64);
