//! Lists of a fixed length, read to their end: the parser drops what stands behind the last element wanted.

use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// A list whose every element is part of `T`.
pub(super) struct Whole<T>(pub(super) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Whole<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct List<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for List<T> {
            type Value = T;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<T, A::Error> {
                let value = T::deserialize(SeqAccessDeserializer::new(&mut elements))?;
                if elements.next_element::<IgnoredAny>()?.is_some() {
                    return Err(A::Error::custom("found more elements than expected"));
                }
                Ok(value)
            }
        }

        from.deserialize_seq(List(PhantomData)).map(Self)
    }
}

/// `N` numbers.
pub(super) fn numbers<'de, D, T, const N: usize>(from: D) -> Result<[T; N], D::Error>
where
    D: Deserializer<'de>,
    [T; N]: Deserialize<'de>,
{
    Whole::deserialize(from).map(|numbers| numbers.0)
}

/// [`numbers`] that need not be there.
pub(super) fn some_numbers<'de, D, T, const N: usize>(from: D) -> Result<Option<[T; N]>, D::Error>
where
    D: Deserializer<'de>,
    [T; N]: Deserialize<'de>,
{
    numbers(from).map(Some)
}

/// `N` points, which need not be there.
pub(super) fn some_points<'de, D, const N: usize>(
    from: D,
) -> Result<Option<[[f64; 3]; N]>, D::Error>
where
    D: Deserializer<'de>,
    [Whole<[f64; 3]>; N]: Deserialize<'de>,
{
    let points: Whole<[Whole<[f64; 3]>; N]> = Whole::deserialize(from)?;
    Ok(Some(points.0.map(|point| point.0)))
}

/// Colours by name.
pub(super) fn colours<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<BTreeMap<String, [f32; 3]>, D::Error> {
    let colours: BTreeMap<String, Whole<[f32; 3]>> = BTreeMap::deserialize(from)?;
    let colours = colours.into_iter();
    Ok(colours.map(|(name, colour)| (name, colour.0)).collect())
}
