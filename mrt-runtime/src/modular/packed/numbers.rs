//! Packed numbers of operators: `f32`, `f16` or `int8`, aligned to cache lines.

use half::f16;
use mrt_core::simd::Aligned;
use mrt_core::storage::Storage;

/// Numbers in one of three formats.
#[derive(Clone, Debug)]
pub enum PackedNumbers {
    /// Single precision.
    F32(Aligned<f32>),
    /// Bits of half-precision numbers; a scale multiplies them.
    F16(Aligned<u16>),
    /// Integers; a scale multiplies them.
    Int8(Aligned<i8>),
}

impl PackedNumbers {
    /// No numbers yet.
    pub(crate) fn new(storage: Storage) -> Self {
        match storage {
            Storage::F32 => PackedNumbers::F32(Aligned::new()),
            Storage::F16 => PackedNumbers::F16(Aligned::new()),
            Storage::Int8 => PackedNumbers::Int8(Aligned::new()),
        }
    }

    /// Number of numbers.
    pub fn len(&self) -> usize {
        match self {
            PackedNumbers::F32(v) => v.len(),
            PackedNumbers::F16(v) => v.len(),
            PackedNumbers::Int8(v) => v.len(),
        }
    }

    /// True if there are no numbers.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of all numbers.
    pub fn bytes(&self) -> usize {
        match self {
            PackedNumbers::F32(v) => size_of_val(&**v),
            PackedNumbers::F16(v) => size_of_val(&**v),
            PackedNumbers::Int8(v) => size_of_val(&**v),
        }
    }

    /// Appends a number. Readers multiply it by `scale`, which comes from [`PackedNumbers::scale`].
    pub(crate) fn push(&mut self, value: f32, scale: f32) {
        match self {
            PackedNumbers::F32(v) => v.push(value),
            PackedNumbers::F16(v) => v.push(f16::from_f32_const(value / scale).to_bits()),
            PackedNumbers::Int8(v) => v.push((value / scale).round().clamp(-127.0, 127.0) as i8),
        }
    }

    /// Appends zeros until the next number is at the start of a cache line.
    pub(crate) fn fill_line(&mut self) {
        match self {
            PackedNumbers::F32(v) => v.fill_line(),
            PackedNumbers::F16(v) => v.fill_line(),
            PackedNumbers::Int8(v) => v.fill_line(),
        }
    }

    /// The scale for numbers of magnitude up to `largest`: 1 for `f32`; for `f16`, a power of two that keeps them well
    /// above subnormal numbers; `largest` / 127 for `int8`.
    pub(crate) fn scale(storage: Storage, largest: f32) -> f32 {
        // Even the brightest light that frames accept is nothing when multiplied by such a number.
        if largest < 1e-30 {
            return 1.0;
        }
        match storage {
            Storage::F32 => 1.0,
            Storage::F16 => {
                let exponent = (largest.to_bits() >> 23) as i32 - 127 - 14;
                f32::from_bits(((exponent + 127).clamp(1, 254) as u32) << 23)
            }
            Storage::Int8 => largest / 127.0,
        }
    }
}
