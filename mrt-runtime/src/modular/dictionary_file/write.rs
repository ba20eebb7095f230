//! Writes dictionary files of version 2.

use crate::modular::dictionary::{
    Dictionary, LightfieldOperators, OperatorKind, OperatorMatrix, PathTable, ShapeOperators,
};
use crate::modular::dictionary_file::format::{
    DictionaryError, FORMAT, MAX_VARIANTS, check_size, scales_name,
};
use mrt_core::container::{ContainerError, Writer};
use mrt_core::storage::write_stored;

impl<M: OperatorMatrix> Dictionary<M> {
    /// The bytes of a dictionary file, with matrices in their present number formats. The same dictionary gives the
    /// same bytes.
    ///
    /// # Errors
    /// [`DictionaryError::Container`], if there are more matrices than a container can hold; [`DictionaryError::Size`],
    /// if there are more than [`MAX_VARIANTS`] variants.
    ///
    /// # Panics
    /// If an element is infinite or NaN.
    pub fn to_bytes(&self) -> Result<Vec<u8>, DictionaryError> {
        check_size("number of variants", self.variants.len(), 0, MAX_VARIANTS)?;
        let mut writer = Writer::new(FORMAT);
        writer.add_text("preset", &self.preset)?;
        writer.add_text("settings", &self.settings)?;
        self.add_sizes(&mut writer)?;
        add_lightfields(&mut writer, &self.lightfields)?;
        add_paths(&mut writer, &self.paths)?;
        self.add_shapes(&mut writer)?;
        if let Some(sources) = &self.sources {
            let (emission, response) = (&sources.emission_from_radiosity, &sources.response_basis);
            add(&mut writer, "B_e", OperatorKind::EmissionSource, emission)?;
            add(&mut writer, "U_r", OperatorKind::ResponseSource, response)?;
        }
        Ok(writer.finish())
    }

    /// Sizes, shares of energy left out, and parities.
    fn add_sizes(&self, writer: &mut Writer) -> Result<(), ContainerError> {
        let (fields, paths) = (&self.lightfields, &self.paths);
        let sizes = [
            self.resolution,
            self.probes,
            self.shapes.len(),
            self.variants.len(),
            fields.parity.len(),
            paths.emission_parity.len(),
            paths.response_parity.len(),
            usize::from(self.has_exchanges()),
            fields.holes.len(),
            paths.depth,
            paths.hole_depth,
        ];
        writer.add_numbers("sizes", &sizes.map(|n| n as u32))?;
        let dropped = [
            fields.dropped_energy,
            paths.emission_dropped_energy,
            paths.response_dropped_energy,
        ];
        writer.add_numbers("dropped", &dropped)?;
        for (name, parity) in [
            ("rlf.par", &fields.parity),
            ("e.par", &paths.emission_parity),
            ("r.par", &paths.response_parity),
        ] {
            let numbers: Vec<u16> = parity.iter().map(|&p| u16::from(p)).collect();
            writer.add_numbers(name, &numbers)?;
        }
        Ok(())
    }

    /// Names and operators of shapes and variants.
    fn add_shapes(&self, writer: &mut Writer) -> Result<(), ContainerError> {
        let shapes = self.shapes.iter().map(|entry| entry.shape.name);
        writer.add_text("shapes", &shapes.collect::<Vec<_>>().join(" "))?;
        let variants = self.variants.iter().map(|variant| {
            let transport = variant.transport.name();
            format!("{}:{transport}", variant.operators.shape.name)
        });
        writer.add_text("variants", &variants.collect::<Vec<_>>().join(" "))?;
        let corners: Vec<f32> = self
            .variants
            .iter()
            .flat_map(|variant| variant.corners.as_flattened())
            .copied()
            .collect();
        writer.add_numbers("corners", &corners)?;
        let variants = self.variants.iter().map(|variant| &variant.operators);
        for (index, entry) in self.shapes.iter().chain(variants).enumerate() {
            add_shape(writer, index, entry)?;
        }
        Ok(())
    }
}

fn add_lightfields(
    writer: &mut Writer,
    fields: &LightfieldOperators<impl OperatorMatrix>,
) -> Result<(), ContainerError> {
    let kind = OperatorKind::Lightfield;
    for (name, matrix) in [
        ("e_rlf", &fields.from_emission),
        ("left", &fields.left),
        ("ahead", &fields.straight),
        ("swap", &fields.exchange),
        ("T_rlf_r", &fields.response_from_lightfield),
    ] {
        add(writer, name, kind, matrix)?;
    }
    for (hole, matrix) in fields.holes.iter().enumerate() {
        add(writer, &format!("hole{hole}"), kind, matrix)?;
    }
    Ok(())
}

fn add_paths(
    writer: &mut Writer,
    paths: &PathTable<impl OperatorMatrix>,
) -> Result<(), ContainerError> {
    let words = paths.entries.iter().map(|entry| entry.word.name());
    writer.add_text("words", &words.collect::<Vec<_>>().join(" "))?;
    for (index, entry) in paths.entries.iter().enumerate() {
        let matrix = &entry.response_from_emission;
        add(writer, &format!("P{index}"), OperatorKind::Path, matrix)?;
    }
    Ok(())
}

fn add(
    writer: &mut Writer,
    name: &str,
    kind: OperatorKind,
    matrix: &impl OperatorMatrix,
) -> Result<(), ContainerError> {
    let stored = matrix.as_stored(kind.modes());
    write_stored(writer, name, &scales_name(name), &stored)
}

fn add_shape(
    writer: &mut Writer,
    index: usize,
    entry: &ShapeOperators<impl OperatorMatrix>,
) -> Result<(), ContainerError> {
    let name = |suffix: &str| format!("{index}.{suffix}");
    let modes = [entry.modes(), entry.joint_modes()].map(|n| n as u32);
    writer.add_numbers(&name("k"), &modes)?;
    writer.add_numbers(&name("s"), &entry.singular_values)?;
    let dropped = [entry.dropped_energy, entry.joint_dropped_energy];
    writer.add_numbers(&name("d"), &dropped)?;
    for (suffix, kind, matrix) in [
        (
            "T",
            OperatorKind::CoefficientsFromDirect,
            &entry.coefficients_from_direct,
        ),
        ("J", OperatorKind::JointBasis, &entry.joint_basis),
        ("Jp", OperatorKind::ProbeBasis, &entry.probe_basis),
        ("Jv", OperatorKind::VectorBasis, &entry.vector_basis),
        (
            "L",
            OperatorKind::ImplicitLighting,
            &entry.implicit_lighting,
        ),
    ] {
        add(writer, &name(suffix), kind, matrix)?;
    }
    for (m, opening) in entry.openings.iter().enumerate() {
        for (letter, matrix) in ["E", "X"].iter().zip(&opening.emission_from_coefficients) {
            add(
                writer,
                &name(&format!("{letter}{m}")),
                OperatorKind::Emission,
                matrix,
            )?;
        }
        for (letter, matrix) in ["Q", "Y"].iter().zip(&opening.joint_from_response) {
            let section = name(&format!("{letter}{m}"));
            add(writer, &section, OperatorKind::JointFromResponse, matrix)?;
        }
    }
    Ok(())
}
