//! Numbers as `f32`, `f16` or `int8`, in whole cache lines.

use half::f16;
use mrt_core::simd::Aligned;
use mrt_core::storage::Storage;

/// Packed numbers.
#[derive(Clone, Debug)]
pub enum PackedNumbers {
    /// As they are.
    F32(Aligned<f32>),
    /// Bits of half-precision numbers, to be multiplied by a scale.
    F16(Aligned<u16>),
    /// Integers, to be multiplied by a scale.
    Int8(Aligned<i8>),
}

impl PackedNumbers {
    /// None yet.
    pub(crate) fn new(storage: Storage) -> Self {
        match storage {
            Storage::F32 => PackedNumbers::F32(Aligned::new()),
            Storage::F16 => PackedNumbers::F16(Aligned::new()),
            Storage::Int8 => PackedNumbers::Int8(Aligned::new()),
        }
    }

    /// How many.
    pub fn len(&self) -> usize {
        match self {
            PackedNumbers::F32(v) => v.len(),
            PackedNumbers::F16(v) => v.len(),
            PackedNumbers::Int8(v) => v.len(),
        }
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Their bytes.
    pub fn bytes(&self) -> usize {
        match self {
            PackedNumbers::F32(v) => size_of_val(&**v),
            PackedNumbers::F16(v) => size_of_val(&**v),
            PackedNumbers::Int8(v) => size_of_val(&**v),
        }
    }

    /// Appends numbers that are to be multiplied by `scale`, which is a power of two.
    pub(crate) fn push(&mut self, value: f32, scale: f32) {
        match self {
            PackedNumbers::F32(v) => v.push(value),
            PackedNumbers::F16(v) => v.push(f16::from_f32_const(value / scale).to_bits()),
            PackedNumbers::Int8(v) => v.push((value / scale).round().clamp(-127.0, 127.0) as i8),
        }
    }

    /// Appends zeros until the next number begins a cache line.
    pub(crate) fn fill_line(&mut self) {
        match self {
            PackedNumbers::F32(v) => v.fill_line(),
            PackedNumbers::F16(v) => v.fill_line(),
            PackedNumbers::Int8(v) => v.fill_line(),
        }
    }

    /// The scale that numbers of up to this magnitude need: 1 for `f32`, a power of two for `f16` that keeps them well
    /// above its subnormal numbers, a 127th for `int8`.
    pub(crate) fn scale(storage: Storage, largest: f32) -> f32 {
        // Below this nothing is left of a light that frames accept.
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
