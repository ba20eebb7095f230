//! Numbers used where they lie in the bytes of a file.
//!
//! A file that is mapped, or read into aligned memory, then needs no second copy of its large
//! sections. The bits are the same either way: only where they lie differs.

use super::reader::check_finite;
use super::{ByteBudget, Container, ContainerError, Element};
use std::borrow::Cow;

impl<'a> Container<'a> {
    /// [`Container::numbers`] that borrows from the file's bytes where it can: if the section starts at a
    /// multiple of the element's size in memory and the machine is little-endian. Otherwise it
    /// copies, and only then takes the section's length from `budget`.
    ///
    /// # Errors
    /// As [`Container::numbers`].
    pub fn numbers_in_place<T: Element>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Cow<'a, [T]>, ContainerError> {
        let section = self.typed_section(name, T::TYPE)?;
        // On a big-endian machine the bits of a file are numbers only if they are single bytes.
        let same_bits = cfg!(target_endian = "little") || T::TYPE.size() == 1;
        if same_bits && let Ok(numbers) = bytemuck::try_cast_slice(section.content) {
            return Ok(Cow::Borrowed(numbers));
        }
        self.numbers(name, budget).map(Cow::Owned)
    }

    /// [`Container::numbers_in_place`] of floating point that must be finite.
    ///
    /// # Errors
    /// As [`Container::finite_numbers`].
    pub fn finite_numbers_in_place<T: Element + Into<f64>>(
        &self,
        name: &str,
        budget: &mut ByteBudget,
    ) -> Result<Cow<'a, [T]>, ContainerError> {
        let numbers = self.numbers_in_place::<T>(name, budget)?;
        check_finite(self.section(name)?, &numbers)?;
        Ok(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ALIGNMENT, ElementType, Format, Writer};
    use super::*;
    use half::f16;

    const FORMAT: Format = Format {
        magic: *b"TESTDATA",
        kind: *b"unit",
        version: 1,
        oldest_version: 1,
    };

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

    /// The sample, starting `shift` bytes after a multiple of 64.
    fn placed(shift: usize) -> (Vec<u8>, usize) {
        let sample = sample();
        let mut room = vec![0; sample.len() + 2 * ALIGNMENT];
        let start = room.as_ptr().align_offset(ALIGNMENT) + shift;
        room[start..start + sample.len()].copy_from_slice(&sample);
        (room, start)
    }

    fn open(bytes: &[u8]) -> Container<'_> {
        Container::read(bytes, &FORMAT, &mut ByteBudget::new(1 << 16)).unwrap()
    }

    /// Whether the numbers are borrowed; they must equal the copy, lie in the file if and only if they
    /// are borrowed, and cost nothing if they are.
    fn borrows<T: Element + PartialEq + std::fmt::Debug>(bytes: &[u8], name: &str) -> bool {
        let container = open(bytes);
        let mut budget = ByteBudget::new(100);
        let numbers = container.numbers_in_place::<T>(name, &mut budget).unwrap();
        let copy = container
            .numbers::<T>(name, &mut ByteBudget::new(100))
            .unwrap();
        assert_eq!(&numbers[..], &copy[..]);
        let borrowed = matches!(numbers, Cow::Borrowed(_));
        let spent = 100 - budget.remaining();
        assert_eq!(
            spent,
            if borrowed {
                0
            } else {
                size_of_val(&numbers[..]) as u64
            }
        );
        let within = bytes.as_ptr_range().contains(&numbers.as_ptr().cast());
        assert_eq!(within, borrowed, "{name}");
        borrowed
    }

    #[cfg(target_endian = "little")]
    #[test]
    fn aligned_numbers_are_borrowed_and_others_copied() {
        for shift in 0..ALIGNMENT {
            let (room, start) = placed(shift);
            let bytes = &room[start..start + sample().len()];
            assert!(borrows::<i8>(bytes, "i8"));
            assert_eq!(borrows::<u16>(bytes, "u16"), shift % 2 == 0);
            assert_eq!(borrows::<f16>(bytes, "f16"), shift % 2 == 0);
            assert_eq!(borrows::<f32>(bytes, "f32"), shift % 4 == 0);
            assert_eq!(borrows::<u64>(bytes, "u64"), shift % 8 == 0);
        }
    }

    #[test]
    fn copies_stay_within_the_budget() {
        let (room, start) = placed(1);
        let container = open(&room[start..start + sample().len()]);
        let mut budget = ByteBudget::new(7);
        let error = container
            .numbers_in_place::<f32>("f32", &mut budget)
            .unwrap_err();
        assert!(
            matches!(error, ContainerError::LimitExceeded { found: 8, .. }),
            "{error}"
        );
    }

    #[test]
    fn what_is_not_finite_is_refused_wherever_it_lies() {
        for shift in [0, 1] {
            let (room, start) = placed(shift);
            let container = open(&room[start..start + sample().len()]);
            let mut budget = ByteBudget::new(100);
            let offset = |name| {
                let content = container.bytes(name).unwrap();
                (content.as_ptr() as usize - room[start..].as_ptr() as usize) as u64
            };
            let nan = container
                .finite_numbers_in_place::<f32>("nan", &mut budget)
                .unwrap_err();
            let expected = offset("nan") + 4;
            assert!(
                matches!(nan, ContainerError::Malformed { what: "number", at, .. } if at == expected),
                "{nan}"
            );
            let infinite = container
                .finite_numbers_in_place::<f16>("f16", &mut budget)
                .unwrap_err();
            let expected = offset("f16") + 4;
            assert!(
                matches!(infinite, ContainerError::Malformed { what: "number", at, .. } if at == expected),
                "{infinite}"
            );
            let fine = container
                .finite_numbers_in_place::<f32>("f32", &mut budget)
                .unwrap();
            assert_eq!(fine[..], [1.5, 2e-40]);
        }
    }

    #[test]
    fn other_types_and_missing_sections_are_refused() {
        let bytes = sample();
        let container = open(&bytes);
        let mut budget = ByteBudget::new(100);
        // Of the same size, so that only the type tells them apart.
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

    /// The codes are what old files hold, so they may never change.
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
