//! Dictionaries as bytes, in the versioned container of the core.
//!
//! Sections: `preset` and `settings` (text), `sizes` (resolution, probes, shapes, lightfield modes, emission
//! modes, response modes, 1 with vertical openings, holes), `dropped`; of lightfields `rlf.par`, `e_rlf`,
//! `left`, `straight`, `exchange`, `hole<n>`, `T_rlf_r`; of the path table `words` (text), `e.par`, `r.par` and one
//! `P<n>` a word; of shape number n `n.name` (text), `n.sigma`, `n.T_d_b`, `n.J`, `n.J_prb`, `n.J_vec`,
//! `n.L_imp`, `n.drop`, and for its opening m `n.Em`, `n.Qm` and with vertical openings `n.Xm`, `n.Ym`
//! (the same as `E` and `Q` with x and y exchanged). Last, unless the dictionary is packed, `B_e` and `U_r`.
//! Matrices are column-major `f32`.

use crate::dictionary::{
    Dictionary, LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators,
    Sources,
};
use crate::path::Word;
use crate::shape::{Hole, SHAPES, Shape};
use mrt_core::container::{ByteBudget, Container, ContainerError, Format, Writer};
use mrt_core::matrix::Matrix;

/// Version that is written, and the newest that is read.
pub const DICTIONARY_VERSION: u32 = 2;

/// Bytes that reading a dictionary may allocate by default.
pub const DEFAULT_BYTE_BUDGET: u64 = 1 << 30;

/// Largest accepted resolution, texels along an edge of a wall.
pub const MAX_RESOLUTION: usize = 128;

/// Largest accepted number of probes along an edge of a block.
pub const MAX_PROBES: usize = 16;

/// Largest accepted number of modes of any kind.
pub const MAX_MODES: usize = 4096;

const FORMAT: Format = Format {
    magic: *b"\x89MRT\r\n\x1a\n",
    kind: *b"DICT",
    version: DICTIONARY_VERSION,
    oldest_version: 2,
};

/// Why bytes are not a dictionary.
#[derive(Debug, thiserror::Error)]
pub enum DictionaryError {
    /// The container is at fault, or the file system.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// A size is out of range.
    #[error("dictionary: {what} is {found}; expected {low} to {limit}")]
    Size {
        /// Which size.
        what: &'static str,
        /// Smallest accepted.
        low: usize,
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
    /// Not a path, or not in its place.
    #[error(
        "dictionary: word {index} is `{found}`; expected canonical words, each once, ascending"
    )]
    Word {
        /// Its position.
        index: usize,
        /// Its text.
        found: String,
    },
    /// A parity is not one of the four.
    #[error("dictionary: section `{section}` holds {found}; expected 0 to 3")]
    Parity {
        /// Which section.
        section: String,
        /// The value there.
        found: u16,
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
        let (fields, paths) = (&self.lightfields, &self.paths);
        let mut writer = Writer::new(FORMAT);
        writer.add_text("preset", &self.preset)?;
        writer.add_text("settings", &self.settings)?;
        let sizes = [
            self.resolution,
            self.probes,
            self.shapes.len(),
            fields.parity.len(),
            paths.emission_parity.len(),
            paths.response_parity.len(),
            usize::from(self.has_exchanges()),
            fields.holes.len(),
        ];
        writer.add_numbers("sizes", &sizes.map(|n| n as u32))?;
        let dropped = [
            fields.dropped_energy,
            paths.emission_dropped_energy,
            paths.response_dropped_energy,
        ];
        writer.add_numbers("dropped", &dropped)?;
        writer.add_numbers("rlf.par", &as_u16(&fields.parity))?;
        for (name, matrix) in [
            ("e_rlf", &fields.from_emission),
            ("left", &fields.left),
            ("straight", &fields.straight),
            ("exchange", &fields.exchange),
            ("T_rlf_r", &fields.response_from_lightfield),
        ] {
            writer.add_numbers(name, matrix.data())?;
        }
        for (hole, matrix) in fields.holes.iter().enumerate() {
            writer.add_numbers(&format!("hole{hole}"), matrix.data())?;
        }
        let words: Vec<String> = paths
            .entries
            .iter()
            .map(|entry| entry.word.name())
            .collect();
        writer.add_text("words", &words.join(" "))?;
        writer.add_numbers("e.par", &as_u16(&paths.emission_parity))?;
        writer.add_numbers("r.par", &as_u16(&paths.response_parity))?;
        for (index, entry) in paths.entries.iter().enumerate() {
            writer.add_numbers(&format!("P{index}"), entry.response_from_emission.data())?;
        }
        for (index, entry) in self.shapes.iter().enumerate() {
            writer.add_text(&format!("{index}.name"), entry.shape.name)?;
            writer.add_numbers(&format!("{index}.sigma"), &entry.singular_values)?;
            for (name, matrix) in [
                ("T_d_b", &entry.coefficients_from_direct),
                ("J", &entry.joint_basis),
                ("J_prb", &entry.probe_basis),
                ("J_vec", &entry.vector_basis),
                ("L_imp", &entry.implicit_lighting),
            ] {
                writer.add_numbers(&format!("{index}.{name}"), matrix.data())?;
            }
            let dropped = [entry.dropped_energy, entry.joint_dropped_energy];
            writer.add_numbers(&format!("{index}.drop"), &dropped)?;
            for (m, opening) in entry.openings.iter().enumerate() {
                for (letter, matrix) in ["E", "X"]
                    .iter()
                    .zip(&opening.emission_from_coefficients)
                    .chain(["Q", "Y"].iter().zip(&opening.joint_from_response))
                {
                    writer.add_numbers(&format!("{index}.{letter}{m}"), matrix.data())?;
                }
            }
        }
        if let Some(sources) = &self.sources {
            writer.add_numbers("B_e", sources.emission_from_radiosity.data())?;
            writer.add_numbers("U_r", sources.response_basis.data())?;
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
        let sizes = Sizes::read(&mut source)?;
        let dropped = source.numbers("dropped", 3)?;
        let fields = sizes.lightfield_modes;
        let lightfields = LightfieldOperators {
            parity: source.parities("rlf.par", fields)?,
            from_emission: source.matrix("e_rlf", fields, sizes.emission_modes)?,
            straight: source.matrix("straight", fields, fields)?,
            left: source.matrix("left", fields, fields)?,
            exchange: source.matrix("exchange", if sizes.vertical { fields } else { 0 }, fields)?,
            holes: (0..sizes.holes)
                .map(|hole| source.matrix(&format!("hole{hole}"), fields, fields))
                .collect::<Result<_, _>>()?,
            response_from_lightfield: source.matrix("T_rlf_r", sizes.response_modes, fields)?,
            dropped_energy: dropped[0],
        };
        let paths = read_paths(&mut source, &sizes, [dropped[1], dropped[2]])?;
        let mut shapes: Vec<ShapeOperators> = Vec::with_capacity(sizes.shapes);
        for index in 0..sizes.shapes {
            let entry = read_shape(&mut source, index, &sizes)?;
            if shapes.iter().any(|other| other.shape == entry.shape) {
                return Err(DictionaryError::ShapeTwice {
                    found: entry.shape.name,
                });
            }
            shapes.push(entry);
        }
        let walls = 5 * sizes.resolution * sizes.resolution;
        let sources = if container.has("B_e") {
            Some(Sources {
                emission_from_radiosity: source.matrix("B_e", sizes.emission_modes, walls)?,
                response_basis: source.matrix(
                    "U_r",
                    walls + sizes.probe_rows(),
                    sizes.response_modes,
                )?,
            })
        } else {
            None
        };
        Ok(Dictionary {
            preset: container.text("preset")?.to_owned(),
            settings: container.text("settings")?.to_owned(),
            resolution: sizes.resolution,
            probes: sizes.probes,
            shapes,
            lightfields,
            paths,
            variants: Vec::new(),
            sources,
        })
    }
}

fn as_u16(parity: &[u8]) -> Vec<u16> {
    parity.iter().map(|&p| u16::from(p)).collect()
}

/// The section `sizes`.
struct Sizes {
    resolution: usize,
    probes: usize,
    shapes: usize,
    lightfield_modes: usize,
    emission_modes: usize,
    response_modes: usize,
    vertical: bool,
    holes: usize,
}

impl Sizes {
    fn read(source: &mut Source) -> Result<Self, DictionaryError> {
        let sizes: Vec<u32> = source.container.numbers("sizes", source.budget)?;
        let sizes = <[u32; 8]>::try_from(sizes).map_err(|sizes| DictionaryError::Length {
            section: "sizes".to_owned(),
            expected: 8,
            found: sizes.len(),
        })?;
        let [
            resolution,
            probes,
            shapes,
            lightfield_modes,
            emission_modes,
            response_modes,
            vertical,
            holes,
        ] = sizes.map(|n| n as usize);
        check_size("resolution", resolution, 1, MAX_RESOLUTION)?;
        check_size("number of probes along an edge", probes, 0, MAX_PROBES)?;
        check_size("number of shapes", shapes, 1, SHAPES.len())?;
        check_size("number of lightfield modes", lightfield_modes, 1, MAX_MODES)?;
        check_size("number of emission modes", emission_modes, 1, MAX_MODES)?;
        check_size("number of response modes", response_modes, 1, MAX_MODES)?;
        check_size("mark of vertical openings", vertical, 0, 1)?;
        check_size("number of holes", holes, 0, Hole::ALL.len())?;
        Ok(Self {
            resolution,
            probes,
            shapes,
            lightfield_modes,
            emission_modes,
            response_modes,
            vertical: vertical == 1,
            holes,
        })
    }

    fn probe_rows(&self) -> usize {
        9 * self.probes * self.probes * self.probes
    }
}

fn read_paths(
    source: &mut Source,
    sizes: &Sizes,
    dropped: [f32; 2],
) -> Result<PathTable, DictionaryError> {
    let names = source.container.text("words")?;
    let mut entries: Vec<PathEntry> = Vec::new();
    for (index, name) in names.split_ascii_whitespace().enumerate() {
        let word = Word::from_name(name)
            .filter(|word| entries.last().is_none_or(|last| last.word < *word))
            .ok_or_else(|| DictionaryError::Word {
                index,
                found: name.chars().take(32).collect(),
            })?;
        let (rows, columns) = (sizes.response_modes, sizes.emission_modes);
        entries.push(PathEntry {
            word,
            response_from_emission: source.matrix(&format!("P{index}"), rows, columns)?,
        });
    }
    Ok(PathTable {
        emission_parity: source.parities("e.par", sizes.emission_modes)?,
        response_parity: source.parities("r.par", sizes.response_modes)?,
        entries,
        emission_dropped_energy: dropped[0],
        response_dropped_energy: dropped[1],
    })
}

fn check_size(
    what: &'static str,
    found: usize,
    low: usize,
    high: usize,
) -> Result<(), DictionaryError> {
    if (low..=high).contains(&found) {
        Ok(())
    } else {
        Err(DictionaryError::Size {
            what,
            low,
            limit: high,
            found,
        })
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

    fn parities(&mut self, section: &str, expected: usize) -> Result<Vec<u8>, DictionaryError> {
        let numbers: Vec<u16> = self.container.numbers(section, self.budget)?;
        if numbers.len() != expected {
            return Err(DictionaryError::Length {
                section: section.to_owned(),
                expected,
                found: numbers.len(),
            });
        }
        match numbers.iter().find(|&&parity| parity > 3) {
            Some(&found) => Err(DictionaryError::Parity {
                section: section.to_owned(),
                found,
            }),
            None => Ok(numbers.iter().map(|&parity| parity as u8).collect()),
        }
    }

    /// A matrix of these sizes, or one without rows.
    fn matrix_or_empty(
        &mut self,
        section: &str,
        rows: usize,
        columns: usize,
    ) -> Result<Matrix<f32>, DictionaryError> {
        let data: Vec<f32> = self.container.finite_numbers(section, self.budget)?;
        if data.is_empty() {
            return Ok(Matrix::zeros(0, columns));
        }
        if data.len() != rows * columns {
            return Err(DictionaryError::Length {
                section: section.to_owned(),
                expected: rows * columns,
                found: data.len(),
            });
        }
        Ok(Matrix::from_column_major(rows, columns, data))
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
    sizes: &Sizes,
) -> Result<ShapeOperators, DictionaryError> {
    let name = source.container.text(&format!("{index}.name"))?;
    let shape = Shape::from_name(name).ok_or_else(|| DictionaryError::UnknownShape {
        index,
        expected: SHAPES.each_ref().map(|shape| shape.name).join(", "),
        found: name.to_owned(),
    })?;
    let section = |name: &str| format!("{index}.{name}");
    let singular_values: Vec<f32> = source
        .container
        .finite_numbers(&section("sigma"), source.budget)?;
    let modes = singular_values.len();
    check_size("number of modes", modes, 0, MAX_MODES)?;
    let texels = shape.texel_count(sizes.resolution);
    // Light from other blocks adds modes; their number follows from the basis's length, or where there are no
    // texels from that of the probes.
    let rows = if texels > 0 {
        (section("J"), texels)
    } else {
        (section("J_prb"), sizes.probe_rows())
    };
    let joint_modes = source.container.element_count(&rows.0)? / rows.1.max(1);
    check_size("number of joint modes", joint_modes, modes, MAX_MODES)?;
    let vertical = usize::from(sizes.vertical);
    let openings = (0..shape.openings.len())
        .map(|m| {
            let mut operators = OpeningOperators {
                emission_from_coefficients: Vec::new(),
                joint_from_response: Vec::new(),
            };
            for (emission, response) in &[("E", "Q"), ("X", "Y")][..1 + vertical] {
                let emission = section(&format!("{emission}{m}"));
                let response = section(&format!("{response}{m}"));
                operators.emission_from_coefficients.push(source.matrix(
                    &emission,
                    sizes.emission_modes,
                    modes,
                )?);
                operators.joint_from_response.push(source.matrix(
                    &response,
                    joint_modes,
                    sizes.response_modes,
                )?);
            }
            Ok(operators)
        })
        .collect::<Result<_, DictionaryError>>()?;
    let dropped = source.numbers(&section("drop"), 2)?;
    let implicit_lighting = source.matrix_or_empty(&section("L_imp"), texels, modes)?;
    Ok(ShapeOperators {
        shape,
        coefficients_from_direct: source.matrix(&section("T_d_b"), modes, texels)?,
        joint_basis: source.matrix(&section("J"), texels, joint_modes)?,
        probe_basis: source.matrix(&section("J_prb"), sizes.probe_rows(), joint_modes)?,
        vector_basis: source.matrix_or_empty(&section("J_vec"), 4 * texels, joint_modes)?,
        openings,
        implicit_lighting,
        singular_values,
        dropped_energy: dropped[0],
        joint_dropped_energy: dropped[1],
    })
}
