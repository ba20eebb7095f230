//! Numbers of accessors: of every type, with strides, normalised, sparse, or zeros where there are no data.

use super::buffers::Buffers;
use super::document::{Accessor, Sparse};
use super::fault::Fault;

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
    F64,
}

impl Component {
    fn new(code: u32, place: &str) -> Result<Self, Fault> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            5130 => Self::F64,
            _ => {
                let place = format!("{place}: componentType {code}");
                return Err(Fault::at(place, "5120 to 5123, 5125, 5126 or 5130"));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number that starts at `offset`; `bytes` reaches behind it.
    fn number(self, bytes: &[u8], offset: usize) -> f64 {
        let bytes = &bytes[offset..];
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(first(bytes))),
            Self::U16 => f64::from(u16::from_le_bytes(first(bytes))),
            Self::U32 => f64::from(u32::from_le_bytes(first(bytes))),
            Self::F32 => f64::from(f32::from_le_bytes(first(bytes))),
            Self::F64 => f64::from_le_bytes(first(bytes)),
        }
    }

    /// What a normalised number is divided by.
    fn largest(self) -> f64 {
        match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    std::array::from_fn(|k| bytes[k])
}

/// The accessor that `place` names.
pub(super) fn get<'a>(
    accessors: &'a [Accessor],
    index: usize,
    place: &str,
) -> Result<&'a Accessor, Fault> {
    let fault = || Fault::index(place, "accessor", index, accessors.len());
    accessors.get(index).ok_or_else(fault)
}

/// The first `count` elements of an accessor of `N` numbers each. The caller has checked that there is memory for them.
pub(super) fn read<const N: usize>(
    buffers: &mut Buffers<'_>,
    index: usize,
    count: usize,
    place: &str,
) -> Result<Vec<[f64; N]>, Fault> {
    let document = buffers.document;
    let accessor = get(&document.accessors, index, place)?;
    let place = format!("accessors[{index}]");
    let found = component_count(&accessor.shape);
    if found != N {
        let shapes = ["SCALAR", "VEC2", "VEC3", "VEC4"];
        let expected = shapes.get(N - 1).copied().unwrap_or("MAT4");
        return Err(Fault::at(format!("{place}: its type"), expected));
    }
    if accessor.count < count {
        let place = format!("{place}: {} elements", accessor.count);
        return Err(Fault::at(
            place,
            "as many as there are vertices, instances or joints",
        ));
    }
    let component = Component::new(accessor.component_type, &place)?;
    let mut values = match accessor.buffer_view {
        None => vec![[0.0; N]; count],
        Some(view) => {
            let stride = document.buffer_views.get(view).map_or(0, |v| v.byte_stride);
            let bytes = buffers.view(view, &place)?;
            elements(bytes, accessor.byte_offset, (stride, component), count)
                .ok_or_else(|| Fault::at(place.as_str(), "its data inside its buffer view"))?
        }
    };
    if let Some(sparse) = &accessor.sparse {
        replace(
            buffers,
            (sparse, accessor.count),
            (component, &place),
            &mut values,
        )?;
    }
    if accessor.normalized {
        // The least integer of a signed type is one further away than the largest.
        let normal = |x: f64| (x / component.largest()).max(-1.0);
        values
            .iter_mut()
            .for_each(|value| *value = value.map(normal));
    }
    Ok(values)
}

/// Unsigned integers.
pub(super) fn read_indices(
    buffers: &mut Buffers<'_>,
    index: usize,
    place: &str,
) -> Result<Vec<u32>, Fault> {
    let accessor = get(&buffers.document.accessors, index, place)?;
    if !matches!(accessor.component_type, 5121 | 5123 | 5125) {
        let place = format!("accessors[{index}]");
        return Err(Fault::at(place, "unsigned integer indices"));
    }
    let indices = read::<1>(buffers, index, accessor.count, place)?;
    Ok(indices.into_iter().map(|[index]| index as u32).collect())
}

/// Numbers in an element of an accessor; 0 for types that are none.
pub(super) fn component_count(shape: &str) -> usize {
    match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => 0,
    }
}

/// `count` elements that start at `offset`, a stride of 0 meaning one behind the other; `None` if they end outside.
fn elements<const N: usize>(
    bytes: &[u8],
    offset: usize,
    (stride, component): (usize, Component),
    count: usize,
) -> Option<Vec<[f64; N]>> {
    let size = component.size();
    let stride = if stride == 0 { N * size } else { stride };
    let bytes = bytes.get(offset..)?;
    if let Some(last) = count.checked_sub(1) {
        let needed = stride.checked_mul(last)?.checked_add(N * size)?;
        bytes.get(..needed)?;
    }
    let number = |element: usize, k: usize| component.number(bytes, element * stride + k * size);
    let element = |element| std::array::from_fn(|k| number(element, k));
    Some((0..count).map(element).collect())
}

/// Puts the sparse values of an accessor in their places.
fn replace<const N: usize>(
    buffers: &mut Buffers<'_>,
    (sparse, count): (&Sparse, usize),
    (component, place): (Component, &str),
    values: &mut [[f64; N]],
) -> Result<(), Fault> {
    let place = format!("{place}.sparse");
    let fault = |expected| Fault::at(place.as_str(), expected);
    let (at, from) = (&sparse.indices, &sparse.values);
    let index_type = Component::new(at.component_type, &place)?;
    let bytes = buffers.view(at.buffer_view, &place)?;
    let indices = elements::<1>(bytes, at.byte_offset, (0, index_type), sparse.count)
        .ok_or_else(|| fault("its indices inside their buffer view"))?;
    let bytes = buffers.view(from.buffer_view, &place)?;
    let replacements = elements::<N>(bytes, from.byte_offset, (0, component), sparse.count)
        .ok_or_else(|| fault("its values inside their buffer view"))?;
    for ([index], replacement) in indices.into_iter().zip(replacements) {
        // Elements behind those that are asked for may be replaced as well.
        match values.get_mut(index as usize) {
            Some(value) => *value = replacement,
            None if (index as usize) < count => {}
            None => return Err(fault("indices below the number of elements")),
        }
    }
    Ok(())
}
