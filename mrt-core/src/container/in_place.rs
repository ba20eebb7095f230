//! Numbers used where they lie in the bytes of a file.
//!
//! A file that is mapped, or read into aligned memory, needs no second copy of its large sections.
//! Borrowed and copied numbers have the same bits.

use super::budget::ByteBudget;
use super::element::SectionNumber;
use super::error::ContainerError;
use super::reader::Container;
use std::borrow::Cow;

impl<'a> Container<'a> {
    /// [`Container::numbers`] that borrows from the file's bytes where it can.
    ///
    /// It can if the section starts at a multiple of the element's size in memory and the machine is
    /// little-endian. Otherwise it copies, and only then takes the section's length from `budget`.
    ///
    /// # Errors
    /// As [`Container::numbers`].
    pub fn numbers_in_place<T: SectionNumber>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Cow<'a, [T]>, ContainerError> {
        let bytes = self.typed_bytes(name, T::TYPE)?;
        // A big-endian machine has the order of bytes in the file only for single bytes.
        let same_bits = cfg!(target_endian = "little") || T::TYPE.size() == 1;
        if same_bits && let Ok(numbers) = bytemuck::try_cast_slice(bytes) {
            return Ok(Cow::Borrowed(numbers));
        }
        self.numbers(name, budget).map(Cow::Owned)
    }

    /// [`Container::numbers_in_place`] of floating point, all of which must be finite.
    ///
    /// # Errors
    /// As [`Container::finite_numbers`].
    pub fn finite_numbers_in_place<T: SectionNumber + Into<f64>>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Cow<'a, [T]>, ContainerError> {
        let numbers = self.numbers_in_place::<T>(name, budget)?;
        self.check_finite(name, &numbers)?;
        Ok(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::fixtures::{FORMAT, Placed, open};
    use crate::container::{ALIGNMENT, Writer};
    use half::f16;

    fn sample() -> Vec<u8> {
        let mut writer = Writer::new(FORMAT);
        let halves = [1.5, -0.0, f32::INFINITY].map(f16::from_f32_const);
        writer.add_numbers("i8", &[-128i8, 0, 127]).unwrap();
        writer.add_numbers("u16", &[7u16, u16::MAX]).unwrap();
        writer.add_numbers("u64", &[7u64, u64::MAX]).unwrap();
        writer.add_numbers("f16", &halves).unwrap();
        writer.add_numbers("f32", &[1.5f32, 2e-40]).unwrap();
        writer.add_numbers("nan", &[1.0f32, f32::NAN]).unwrap();
        writer.add_numbers::<f32>("empty", &[]).unwrap();
        writer.finish()
    }

    /// Whether the numbers are borrowed. They must equal the copy, lie in the file if and only if
    /// they are borrowed, and cost nothing if they are.
    fn borrows<T: SectionNumber + PartialEq + std::fmt::Debug>(bytes: &[u8], name: &str) -> bool {
        let container = open(bytes);
        let mut budget = ByteBudget::new(100);
        let numbers = container.numbers_in_place::<T>(name, &mut budget).unwrap();
        let copy = container
            .numbers::<T>(name, &mut ByteBudget::new(100))
            .unwrap();
        assert_eq!(&numbers[..], &copy[..]);
        let borrowed = matches!(numbers, Cow::Borrowed(_));
        let size = size_of_val(&numbers[..]) as u64;
        assert_eq!(100 - budget.remaining(), if borrowed { 0 } else { size });
        let within = bytes.as_ptr_range().contains(&numbers.as_ptr().cast());
        assert_eq!(within, borrowed, "{name}");
        borrowed
    }

    #[cfg(target_endian = "little")]
    #[test]
    fn aligned_numbers_are_borrowed_and_others_copied() {
        for shift in 0..ALIGNMENT {
            let file = Placed::new(&sample(), shift);
            let bytes = file.bytes();
            assert!(borrows::<i8>(bytes, "i8"));
            assert_eq!(borrows::<u16>(bytes, "u16"), shift % 2 == 0);
            assert_eq!(borrows::<f16>(bytes, "f16"), shift % 2 == 0);
            assert_eq!(borrows::<f32>(bytes, "f32"), shift % 4 == 0);
            assert_eq!(borrows::<u64>(bytes, "u64"), shift % 8 == 0);
        }
    }

    #[test]
    fn copies_stay_within_the_budget() {
        let file = Placed::new(&sample(), 1);
        let error = open(file.bytes())
            .numbers_in_place::<f32>("f32", &mut ByteBudget::new(7))
            .unwrap_err();
        assert!(
            matches!(error, ContainerError::LimitExceeded { found: 8, .. }),
            "{error}"
        );
    }

    /// The first number of a section that is not finite lies at byte `at_in_section` and is refused.
    fn assert_refused_at<T>(file: &Placed, name: &str, at_in_section: u64)
    where
        T: SectionNumber + Into<f64> + std::fmt::Debug,
    {
        let container = open(file.bytes());
        let error = container
            .finite_numbers_in_place::<T>(name, &mut ByteBudget::new(100))
            .unwrap_err();
        let content = container.bytes(name).unwrap();
        let start = (content.as_ptr() as usize - file.bytes().as_ptr() as usize) as u64;
        let expected = start + at_in_section;
        assert!(
            matches!(error, ContainerError::Malformed { what: "number", at, .. } if at == expected),
            "{error}"
        );
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused_borrowed_or_copied() {
        for shift in [0, 1] {
            let file = Placed::new(&sample(), shift);
            assert_refused_at::<f32>(&file, "nan", 4);
            assert_refused_at::<f16>(&file, "f16", 4);
            let fine = open(file.bytes())
                .finite_numbers_in_place::<f32>("f32", &mut ByteBudget::new(100))
                .unwrap()
                .into_owned();
            assert_eq!(fine, [1.5, 2e-40]);
        }
    }

    #[test]
    fn other_types_and_missing_sections_are_refused() {
        let bytes = sample();
        let container = open(&bytes);
        let mut budget = ByteBudget::new(100);
        // Both types have two bytes, so only the table tells them apart.
        let error = container
            .numbers_in_place::<u16>("f16", &mut budget)
            .unwrap_err();
        assert!(
            error.to_string().contains("expected U16, found F16"),
            "{error}"
        );
        let error = container
            .numbers_in_place::<u16>("none", &mut budget)
            .unwrap_err();
        assert!(
            matches!(error, ContainerError::MissingSection { .. }),
            "{error}"
        );
        let empty = container
            .numbers_in_place::<f32>("empty", &mut budget)
            .unwrap();
        assert!(empty.is_empty());
    }
}
