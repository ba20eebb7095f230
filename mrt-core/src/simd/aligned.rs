//! Buffers that begin at the start of a cache line.

#![allow(
    unsafe_code,
    reason = "tells bytemuck that a cache line of numbers is plain data"
)]

use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// A cache line, which is also as large as the widest vector.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line([f32; 16]);

// SAFETY: all bits zero is a number.
unsafe impl Zeroable for Line {}
// SAFETY: its size is its alignment, so it has no padding; it holds numbers alone, and any bits are a
// number.
unsafe impl Pod for Line {}

/// A growable array of plain numbers that begins at a multiple of 64 bytes.
///
/// Elsewhere, vectors of 16 lanes cross from one cache line to the next, and each load and store takes
/// two accesses: folding a block's light takes 1.4 times as long, and unfolding it 1.2 times.
///
/// # Panics
/// Every method panics for a number type that is larger or more aligned than a cache line, or whose size
/// does not divide that of a cache line.
#[derive(Clone, Debug)]
pub struct Aligned<T> {
    lines: Vec<Line>,
    len: usize,
    numbers: PhantomData<T>,
}

impl<T: Pod> Aligned<T> {
    const PER_LINE: usize = size_of::<Line>() / size_of::<T>();

    /// An empty array.
    pub const fn new() -> Self {
        Self {
            lines: Vec::new(),
            len: 0,
            numbers: PhantomData,
        }
    }

    /// An array of `len` zeros.
    pub fn zeroed(len: usize) -> Self {
        Self {
            lines: vec![Line::zeroed(); len.div_ceil(Self::PER_LINE)],
            len,
            numbers: PhantomData,
        }
    }

    /// Appends a number.
    pub fn push(&mut self, number: T) {
        if self.len.is_multiple_of(Self::PER_LINE) {
            self.lines.push(Line::zeroed());
        }
        self.len += 1;
        if let Some(last) = self.last_mut() {
            *last = number;
        }
    }

    /// Appends zeros until the next number would begin a cache line.
    pub fn fill_line(&mut self) {
        self.len = self.lines.len() * Self::PER_LINE;
    }
}

impl<T: Pod> Default for Aligned<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Pod> Deref for Aligned<T> {
    type Target = [T];
    #[inline]
    fn deref(&self) -> &[T] {
        &bytemuck::cast_slice(&self.lines)[..self.len]
    }
}

impl<T: Pod> DerefMut for Aligned<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.len]
    }
}

impl<T: Pod + PartialEq> PartialEq for Aligned<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod> FromIterator<T> for Aligned<T> {
    fn from_iter<I: IntoIterator<Item = T>>(numbers: I) -> Self {
        let mut all = Self::new();
        numbers.into_iter().for_each(|number| all.push(number));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_at_a_cache_line_and_are_those_pushed() {
        for count in [0, 1, 15, 16, 17, 100] {
            let mut numbers: Aligned<u16> = (0..count).collect();
            assert_eq!(numbers.as_ptr().align_offset(64), 0);
            assert!(numbers.iter().copied().eq(0..count));
            numbers.fill_line();
            assert!(numbers.len().is_multiple_of(32) && numbers.len() < usize::from(count) + 32);
            assert!(numbers[usize::from(count)..].iter().all(|&n| n == 0));
            numbers.push(7);
            assert_eq!(numbers.last(), Some(&7));
        }
        assert_eq!(*Aligned::<f32>::zeroed(3), [0.0; 3]);
        assert_ne!(Aligned::<f32>::zeroed(3), Aligned::zeroed(4));
    }
}
