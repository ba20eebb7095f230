//! Dictionaries as bytes, in the versioned container of the core.
//!
//! Sections: `preset` and `settings` (text), `sizes` (resolution, shapes, lightfield modes, response
//! modes), `left`, `straight`, `right`, `T_rlf_r`, `U_r`, `dropped`; and for shape number n `n.name`
//! (text), `n.sigma`, `n.T_d_b`, `n.U_b`, `n.L_imp`, `n.drop` and one `n.R<opening>` an opening. Matrices
//! are column-major `f32`.

use crate::dictionary::{Dictionary, InterfaceOperators, ShapeOperators};
use crate::shape::{SHAPES, Shape};
use mrt_core::container::{ByteBudget, Container, ContainerError, Format, Writer};
use mrt_core::cube::Face;
use mrt_core::matrix::Matrix;

/// Version that is written, and the newest that is read.
pub const DICTIONARY_VERSION: u32 = 1;

/// Bytes that reading a dictionary may allocate by default.
pub const DEFAULT_BYTE_BUDGET: u64 = 1 << 30;

/// Largest accepted resolution, texels along an edge of a wall.
pub const MAX_RESOLUTION: usize = 128;

/// Largest accepted number of modes of any kind.
pub const MAX_MODES: usize = 4096;

const FORMAT: Format = Format {
    magic: *b"\x89MRT\r\n\x1a\n",
    kind: *b"DICT",
    version: DICTIONARY_VERSION,
    oldest_version: 1,
};

/// Why bytes are not a dictionary.
#[derive(Debug, thiserror::Error)]
pub enum DictionaryError {
    /// The container is at fault, or the file system.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// A size is out of range.
    #[error("dictionary: {what} is {found}; expected 1 to {limit}")]
    Size {
        /// Which size.
        what: &'static str,
        /// Largest accepted.
        limit: usize,
        /// The size in the file.
        found: usize,
    },
    /// A section's length does not follow from the sizes.
    #[error("dictionary: section `{section}` has {found} numbers; expected {expected}")]
    Length {
        /// Which section.
        section: String,
        /// Numbers that the sizes ask for.
        expected: usize,
        /// Numbers in the section.
        found: usize,
    },
    /// A shape that this release does not know.
    #[error("dictionary: shape {index} is `{found}`; expected one of {expected}")]
    UnknownShape {
        /// Which entry.
        index: usize,
        /// Names of all shapes.
        expected: String,
        /// The name in the file.
        found: String,
    },
    /// The same shape twice.
    #[error("dictionary: shape `{found}` is there twice; expected once")]
    ShapeTwice {
        /// Its name.
        found: &'static str,
    },
}

impl Dictionary {
    /// The bytes of a dictionary file; the same dictionary gives the same bytes.
    ///
    /// # Errors
    /// [`DictionaryError::Container`], if there are more shapes than the container has room for.
    pub fn to_bytes(&self) -> Result<Vec<u8>, DictionaryError> {
        let interface = &self.interface;
        let mut writer = Writer::new(FORMAT);
        writer.add_text("preset", &self.preset)?;
        writer.add_text("settings", &self.settings)?;
        let sizes = [
            self.resolution,
            self.shapes.len(),
            interface.straight.rows(),
            interface.response_basis.columns(),
        ];
        writer.add_numbers("sizes", &sizes.map(|n| n as u32))?;
        for (name, matrix) in [
            ("left", &interface.left),
            ("straight", &interface.straight),
            ("right", &interface.right),
            ("T_rlf_r", &interface.response_from_lightfield),
            ("U_r", &interface.response_basis),
        ] {
            writer.add_numbers(name, matrix.data())?;
        }
        let dropped = [
            interface.lightfield_dropped_energy,
            interface.response_dropped_energy,
        ];
        writer.add_numbers("dropped", &dropped)?;
        for (index, entry) in self.shapes.iter().enumerate() {
            writer.add_text(&format!("{index}.name"), entry.shape.name)?;
            writer.add_numbers(&format!("{index}.sigma"), &entry.singular_values)?;
            for (name, matrix) in [
                ("T_d_b", &entry.coefficients_from_direct),
                ("U_b", &entry.indirect_basis),
                ("L_imp", &entry.implicit_lighting),
            ] {
                writer.add_numbers(&format!("{index}.{name}"), matrix.data())?;
            }
            writer.add_numbers(&format!("{index}.drop"), &[entry.dropped_energy])?;
            for (opening, matrix) in entry.lightfield_from_coefficients.iter().enumerate() {
                writer.add_numbers(&format!("{index}.R{opening}"), matrix.data())?;
            }
        }
        Ok(writer.finish())
    }

    /// Reads the bytes of a dictionary file; no input makes it panic or allocate beyond `budget`.
    ///
    /// # Errors
    /// [`DictionaryError`], at the first thing that is wrong.
    pub fn from_bytes(bytes: &[u8], budget: &mut ByteBudget) -> Result<Self, DictionaryError> {
        let container = Container::read(bytes, &FORMAT, budget)?;
        let mut source = Source {
            container: &container,
            budget,
        };
        let sizes: Vec<u32> = source.container.numbers("sizes", source.budget)?;
        let [resolution, shape_count, lightfield_modes, response_modes] =
            <[u32; 4]>::try_from(sizes)
                .map_err(|sizes| DictionaryError::Length {
                    section: "sizes".to_owned(),
                    expected: 4,
                    found: sizes.len(),
                })?
                .map(|n| n as usize);
        check_size("resolution", resolution, MAX_RESOLUTION)?;
        check_size("number of shapes", shape_count, SHAPES.len())?;
        check_size("number of lightfield modes", lightfield_modes, MAX_MODES)?;
        check_size("number of response modes", response_modes, MAX_MODES)?;
        let receiver_texels = 5 * resolution * resolution;
        let dropped = source.numbers("dropped", 2)?;
        let interface = InterfaceOperators {
            left: source.matrix("left", lightfield_modes, lightfield_modes)?,
            straight: source.matrix("straight", lightfield_modes, lightfield_modes)?,
            right: source.matrix("right", lightfield_modes, lightfield_modes)?,
            response_from_lightfield: source.matrix("T_rlf_r", response_modes, lightfield_modes)?,
            response_basis: source.matrix("U_r", receiver_texels, response_modes)?,
            lightfield_dropped_energy: dropped[0],
            response_dropped_energy: dropped[1],
        };
        let mut shapes: Vec<ShapeOperators> = Vec::with_capacity(shape_count);
        for index in 0..shape_count {
            let entry = read_shape(&mut source, index, resolution, lightfield_modes)?;
            if shapes.iter().any(|other| other.shape == entry.shape) {
                return Err(DictionaryError::ShapeTwice {
                    found: entry.shape.name,
                });
            }
            shapes.push(entry);
        }
        Ok(Dictionary {
            preset: container.text("preset")?.to_owned(),
            settings: container.text("settings")?.to_owned(),
            resolution,
            shapes,
            interface,
        })
    }
}

fn check_size(what: &'static str, found: usize, limit: usize) -> Result<(), DictionaryError> {
    if (1..=limit).contains(&found) {
        Ok(())
    } else {
        Err(DictionaryError::Size { what, limit, found })
    }
}

/// A container with what may still be allocated.
struct Source<'a, 'b> {
    container: &'a Container<'b>,
    budget: &'a mut ByteBudget,
}

impl Source<'_, '_> {
    fn numbers(&mut self, section: &str, expected: usize) -> Result<Vec<f32>, DictionaryError> {
        let numbers: Vec<f32> = self.container.finite_numbers(section, self.budget)?;
        if numbers.len() != expected {
            return Err(DictionaryError::Length {
                section: section.to_owned(),
                expected,
                found: numbers.len(),
            });
        }
        Ok(numbers)
    }

    fn matrix(
        &mut self,
        section: &str,
        rows: usize,
        columns: usize,
    ) -> Result<Matrix<f32>, DictionaryError> {
        let data = self.numbers(section, rows * columns)?;
        Ok(Matrix::from_column_major(rows, columns, data))
    }
}

fn read_shape(
    source: &mut Source,
    index: usize,
    resolution: usize,
    lightfield_modes: usize,
) -> Result<ShapeOperators, DictionaryError> {
    let name = source.container.text(&format!("{index}.name"))?;
    let shape = Shape::from_name(name).ok_or_else(|| DictionaryError::UnknownShape {
        index,
        expected: SHAPES.each_ref().map(|shape| shape.name).join(", "),
        found: name.to_owned(),
    })?;
    let singular_values: Vec<f32> = source
        .container
        .finite_numbers(&format!("{index}.sigma"), source.budget)?;
    let modes = singular_values.len();
    check_size("number of modes", modes, MAX_MODES)?;
    let texels = shape.texel_count(resolution);
    let openings: &[Face] = shape.openings;
    Ok(ShapeOperators {
        shape,
        coefficients_from_direct: source.matrix(&format!("{index}.T_d_b"), modes, texels)?,
        indirect_basis: source.matrix(&format!("{index}.U_b"), texels, modes)?,
        implicit_lighting: source.matrix(&format!("{index}.L_imp"), texels, modes)?,
        lightfield_from_coefficients: (0..openings.len())
            .map(|opening| source.matrix(&format!("{index}.R{opening}"), lightfield_modes, modes))
            .collect::<Result<_, _>>()?,
        singular_values,
        dropped_energy: source.numbers(&format!("{index}.drop"), 1)?[0],
    })
}
