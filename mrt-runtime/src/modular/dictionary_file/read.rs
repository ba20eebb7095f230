//! Reads dictionary files of version 2.

use crate::level::shape::{Hole, SHAPES, Shape};
use crate::level::warp_transport::WarpTransport;
use crate::modular::dictionary::{
    LightfieldOperators, OpeningOperators, OperatorKind, PathEntry, PathTable, ShapeOperators,
    Sources, StoredDictionary, Variant,
};
use crate::modular::dictionary_file::format::{
    DictionaryError, MAX_MODES, MAX_PROBES, MAX_RESOLUTION, MAX_VARIANTS, Source, check_size,
    known_shape,
};
use crate::modular::path::{MAX_WORD, Word};
use mrt_core::excerpt::excerpt;
use mrt_core::storage::StoredMatrix;

type Operators<'a> = ShapeOperators<StoredMatrix<'a>>;

pub(super) fn read<'a>(
    source: &mut Source<'a, '_, '_>,
) -> Result<StoredDictionary<'a>, DictionaryError> {
    let sizes = Sizes::read(source)?;
    let dropped = source.numbers("dropped", 3)?;
    let lightfields = read_lightfields(source, &sizes, dropped[0])?;
    let paths = read_paths(source, &sizes, [dropped[1], dropped[2]])?;
    let container = source.container;
    let mut shapes: Vec<Operators> = Vec::with_capacity(sizes.shapes);
    let names = listed("shapes", container.text("shapes")?, sizes.shapes)?;
    for (index, name) in names.into_iter().enumerate() {
        let shape = known_shape(index, name)?;
        if shapes.iter().any(|other| other.shape == shape) {
            return Err(DictionaryError::ShapeTwice { found: shape.name });
        }
        shapes.push(read_shape(source, index, shape, &sizes)?);
    }
    let variants = read_variants(source, &sizes, &shapes)?;
    let walls = 5 * sizes.resolution * sizes.resolution;
    let sources = if container.has("B_e") {
        let receiver = walls + sizes.probe_rows();
        Some(Sources {
            emission_from_radiosity: source.matrix(
                OperatorKind::EmissionSource,
                "B_e",
                [sizes.emission_modes, walls],
            )?,
            response_basis: source.matrix(
                OperatorKind::ResponseSource,
                "U_r",
                [receiver, sizes.response_modes],
            )?,
        })
    } else {
        None
    };
    Ok(StoredDictionary {
        preset: source.owned_text("preset")?,
        settings: source.owned_text("settings")?,
        resolution: sizes.resolution,
        probes: sizes.probes,
        shapes,
        lightfields,
        paths,
        variants,
        sources,
    })
}

/// Content of the section `sizes`.
struct Sizes {
    resolution: usize,
    probes: usize,
    shapes: usize,
    variants: usize,
    lightfield_modes: usize,
    emission_modes: usize,
    response_modes: usize,
    /// 1 with vertical openings.
    vertical: usize,
    holes: usize,
    depth: usize,
    hole_depth: usize,
}

impl Sizes {
    fn read(source: &mut Source) -> Result<Self, DictionaryError> {
        let mut sizes = source.sizes::<11>("sizes")?.into_iter();
        let mut next = |what, low, high| {
            let found = sizes.next().unwrap_or_default();
            check_size(what, found, low, high).map(|()| found)
        };
        // In the order of the file.
        Ok(Self {
            resolution: next("resolution", 1, MAX_RESOLUTION)?,
            probes: next("number of probes along an edge", 0, MAX_PROBES)?,
            shapes: next("number of shapes", 1, SHAPES.len())?,
            variants: next("number of variants", 0, MAX_VARIANTS)?,
            lightfield_modes: next("number of lightfield modes", 0, MAX_MODES)?,
            emission_modes: next("number of emission modes", 1, MAX_MODES)?,
            response_modes: next("number of response modes", 1, MAX_MODES)?,
            vertical: next("mark of vertical openings", 0, 1)?,
            holes: next("number of holes", 0, Hole::ALL.len())?,
            depth: next("depth of paths", 0, MAX_WORD)?,
            hole_depth: next("depth of paths with holes", 0, MAX_WORD)?,
        })
    }

    /// Rows of a basis of probes: nine coefficients for each probe.
    fn probe_rows(&self) -> usize {
        9 * self.probes * self.probes * self.probes
    }
}

/// The words of a text section, which must be exactly `expected`.
fn listed<'t>(
    section: &str,
    text: &'t str,
    expected: usize,
) -> Result<Vec<&'t str>, DictionaryError> {
    // One word more than expected shows that there are too many, and limits the memory.
    let words: Vec<&str> = text.split_ascii_whitespace().take(expected + 1).collect();
    if words.len() == expected {
        Ok(words)
    } else {
        Err(DictionaryError::Length {
            section: section.to_owned(),
            expected,
            found: words.len(),
        })
    }
}

impl<'a> Source<'a, '_, '_> {
    fn parities(&mut self, section: &str, expected: usize) -> Result<Vec<u8>, DictionaryError> {
        self.check_length(section, expected)?;
        let numbers: Vec<u16> = self.container.numbers(section, self.budget)?;
        match numbers.iter().find(|&&parity| parity > 3) {
            Some(&found) => Err(DictionaryError::Parity {
                section: section.to_owned(),
                found,
            }),
            None => Ok(numbers.iter().map(|&parity| parity as u8).collect()),
        }
    }

    /// A matrix of these sizes, or one without rows if the section is empty.
    fn matrix_or_empty(
        &mut self,
        kind: OperatorKind,
        section: &str,
        [rows, columns]: [usize; 2],
    ) -> Result<StoredMatrix<'a>, DictionaryError> {
        let rows = match self.container.element_count(section)? {
            0 => 0,
            _ => rows,
        };
        self.matrix(kind, section, [rows, columns])
    }
}

fn read_lightfields<'a>(
    source: &mut Source<'a, '_, '_>,
    sizes: &Sizes,
    dropped_energy: f32,
) -> Result<LightfieldOperators<StoredMatrix<'a>>, DictionaryError> {
    let kind = OperatorKind::Lightfield;
    let fields = sizes.lightfield_modes;
    let square = [fields; 2];
    Ok(LightfieldOperators {
        parity: source.parities("rlf.par", fields)?,
        from_emission: source.matrix(kind, "e_rlf", [fields, sizes.emission_modes])?,
        straight: source.matrix(kind, "ahead", square)?,
        left: source.matrix(kind, "left", square)?,
        exchange: source.matrix_or_empty(kind, "swap", square)?,
        holes: (0..sizes.holes)
            .map(|hole| source.matrix(kind, &format!("hole{hole}"), square))
            .collect::<Result<_, _>>()?,
        response_from_lightfield: source.matrix(kind, "T_rlf_r", [sizes.response_modes, fields])?,
        dropped_energy,
    })
}

fn read_paths<'a>(
    source: &mut Source<'a, '_, '_>,
    sizes: &Sizes,
    dropped: [f32; 2],
) -> Result<PathTable<StoredMatrix<'a>>, DictionaryError> {
    let names = source.container.text("words")?;
    let size = [sizes.response_modes, sizes.emission_modes];
    let mut entries: Vec<PathEntry<_>> = Vec::new();
    for (index, name) in names.split_ascii_whitespace().enumerate() {
        let word = Word::from_name(name)
            .filter(|word| entries.last().is_none_or(|last| last.word < *word))
            .ok_or_else(|| DictionaryError::Word {
                index,
                found: excerpt(name),
            })?;
        let matrix = source.matrix(OperatorKind::Path, &format!("P{index}"), size)?;
        entries.push(PathEntry {
            word,
            response_from_emission: matrix,
        });
    }
    Ok(PathTable {
        emission_parity: source.parities("e.par", sizes.emission_modes)?,
        response_parity: source.parities("r.par", sizes.response_modes)?,
        depth: sizes.depth,
        hole_depth: sizes.hole_depth,
        entries,
        emission_dropped_energy: dropped[0],
        response_dropped_energy: dropped[1],
    })
}

fn read_variants<'a>(
    source: &mut Source<'a, '_, '_>,
    sizes: &Sizes,
    shapes: &[Operators],
) -> Result<Vec<Variant<StoredMatrix<'a>>>, DictionaryError> {
    let names = listed(
        "variants",
        source.container.text("variants")?,
        sizes.variants,
    )?;
    let corners = source.numbers("corners", 24 * sizes.variants)?;
    let mut variants = Vec::with_capacity(sizes.variants);
    for (index, name) in names.into_iter().enumerate() {
        let (transport, shape) = variant_of_name(name, shapes).ok_or_else(|| {
            let found = excerpt(name);
            DictionaryError::Variant { index, found }
        })?;
        let corner = |k: usize| std::array::from_fn(|axis| corners[24 * index + 3 * k + axis]);
        variants.push(Variant {
            transport,
            corners: std::array::from_fn(corner),
            operators: read_shape(source, sizes.shapes + index, shape, sizes)?,
        });
    }
    Ok(variants)
}

fn variant_of_name(name: &str, shapes: &[Operators]) -> Option<(WarpTransport, &'static Shape)> {
    let (shape, transport) = name.split_once(':')?;
    let shape = shapes.iter().find(|entry| entry.shape.name == shape)?.shape;
    // Round tubes have no variants.
    if shape.tube().is_some() {
        return None;
    }
    Some((WarpTransport::from_name(transport)?, shape))
}

fn read_shape<'a>(
    source: &mut Source<'a, '_, '_>,
    index: usize,
    shape: &'static Shape,
    sizes: &Sizes,
) -> Result<Operators<'a>, DictionaryError> {
    let section = |suffix: &str| format!("{index}.{suffix}");
    let [modes, joint_modes] = source.sizes(&section("k"))?;
    check_size("number of modes", modes, 0, MAX_MODES)?;
    check_size("number of joint modes", joint_modes, modes, MAX_MODES)?;
    let texels = shape.texel_count(sizes.resolution);
    let letters = [("E", "Q"), ("X", "Y")];
    let openings = (0..shape.openings.len())
        .map(|m| {
            let mut operators = OpeningOperators {
                emission_from_coefficients: Vec::new(),
                joint_from_response: Vec::new(),
            };
            for (emission, response) in &letters[..1 + sizes.vertical] {
                operators.emission_from_coefficients.push(source.matrix(
                    OperatorKind::Emission,
                    &section(&format!("{emission}{m}")),
                    [sizes.emission_modes, modes],
                )?);
                operators.joint_from_response.push(source.matrix(
                    OperatorKind::JointFromResponse,
                    &section(&format!("{response}{m}")),
                    [joint_modes, sizes.response_modes],
                )?);
            }
            Ok(operators)
        })
        .collect::<Result<_, DictionaryError>>()?;
    let dropped = source.numbers(&section("d"), 2)?;
    let mut matrix = |kind, suffix, size| source.matrix_or_empty(kind, &section(suffix), size);
    Ok(ShapeOperators {
        shape,
        implicit_lighting: matrix(OperatorKind::ImplicitLighting, "L", [texels, modes])?,
        vector_basis: matrix(OperatorKind::VectorBasis, "Jv", [4 * texels, joint_modes])?,
        coefficients_from_direct: source.matrix(
            OperatorKind::CoefficientsFromDirect,
            &section("T"),
            [modes, texels],
        )?,
        joint_basis: source.matrix(
            OperatorKind::JointBasis,
            &section("J"),
            [texels, joint_modes],
        )?,
        probe_basis: source.matrix(
            OperatorKind::ProbeBasis,
            &section("Jp"),
            [sizes.probe_rows(), joint_modes],
        )?,
        openings,
        singular_values: source.numbers(&section("s"), modes)?,
        dropped_energy: dropped[0],
        joint_dropped_energy: dropped[1],
    })
}
