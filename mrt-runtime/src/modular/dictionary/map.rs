//! Replaces every matrix of a dictionary.

use crate::modular::dictionary::operator::OperatorKind;
use crate::modular::dictionary::types::{
    Dictionary, LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators,
    Sources, Variant,
};

/// The dictionary with every matrix replaced by the result of `f`.
pub(super) fn map<'s, M, N>(
    dictionary: &'s Dictionary<M>,
    f: &mut impl FnMut(OperatorKind, &'s M) -> N,
) -> Dictionary<N> {
    let paths = &dictionary.paths;
    let lightfields = map_lightfields(&dictionary.lightfields, f);
    let entries = paths.entries.iter().map(|entry| PathEntry {
        word: entry.word.clone(),
        response_from_emission: f(OperatorKind::Path, &entry.response_from_emission),
    });
    let paths = PathTable {
        emission_parity: paths.emission_parity.clone(),
        response_parity: paths.response_parity.clone(),
        depth: paths.depth,
        hole_depth: paths.hole_depth,
        entries: entries.collect(),
        emission_dropped_energy: paths.emission_dropped_energy,
        response_dropped_energy: paths.response_dropped_energy,
    };
    let sources = dictionary.sources.as_ref().map(|sources| Sources {
        emission_from_radiosity: f(
            OperatorKind::EmissionSource,
            &sources.emission_from_radiosity,
        ),
        response_basis: f(OperatorKind::ResponseSource, &sources.response_basis),
    });
    let shapes = dictionary.shapes.iter().map(|entry| map_shape(entry, f));
    let shapes = shapes.collect();
    let variants = dictionary.variants.iter().map(|variant| Variant {
        transport: variant.transport,
        corners: variant.corners,
        operators: map_shape(&variant.operators, f),
    });
    Dictionary {
        preset: dictionary.preset.clone(),
        settings: dictionary.settings.clone(),
        resolution: dictionary.resolution,
        probes: dictionary.probes,
        shapes,
        lightfields,
        paths,
        variants: variants.collect(),
        sources,
    }
}

/// Same as [`map`], for the lightfield operators only.
pub(super) fn map_lightfields<'s, M, N>(
    fields: &'s LightfieldOperators<M>,
    f: &mut impl FnMut(OperatorKind, &'s M) -> N,
) -> LightfieldOperators<N> {
    let mut field = |matrix| f(OperatorKind::Lightfield, matrix);
    LightfieldOperators {
        parity: fields.parity.clone(),
        from_emission: field(&fields.from_emission),
        straight: field(&fields.straight),
        left: field(&fields.left),
        exchange: field(&fields.exchange),
        holes: fields.holes.iter().map(&mut field).collect(),
        response_from_lightfield: field(&fields.response_from_lightfield),
        dropped_energy: fields.dropped_energy,
    }
}

fn map_shape<'s, M, N>(
    entry: &'s ShapeOperators<M>,
    f: &mut impl FnMut(OperatorKind, &'s M) -> N,
) -> ShapeOperators<N> {
    let openings = entry.openings.iter().map(|opening| OpeningOperators {
        emission_from_coefficients: opening
            .emission_from_coefficients
            .iter()
            .map(|matrix| f(OperatorKind::Emission, matrix))
            .collect(),
        joint_from_response: opening
            .joint_from_response
            .iter()
            .map(|matrix| f(OperatorKind::JointFromResponse, matrix))
            .collect(),
    });
    let openings = openings.collect();
    ShapeOperators {
        shape: entry.shape,
        coefficients_from_direct: f(
            OperatorKind::CoefficientsFromDirect,
            &entry.coefficients_from_direct,
        ),
        joint_basis: f(OperatorKind::JointBasis, &entry.joint_basis),
        probe_basis: f(OperatorKind::ProbeBasis, &entry.probe_basis),
        vector_basis: f(OperatorKind::VectorBasis, &entry.vector_basis),
        openings,
        implicit_lighting: f(OperatorKind::ImplicitLighting, &entry.implicit_lighting),
        singular_values: entry.singular_values.clone(),
        dropped_energy: entry.dropped_energy,
        joint_dropped_energy: entry.joint_dropped_energy,
    }
}
