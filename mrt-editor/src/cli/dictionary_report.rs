//! What commands say about dictionaries, and how they store them.

use mrt_runtime::low_level::modular::dictionary::{OperatorKind, StoredDictionary};
use mrt_runtime::{Coupling, Dictionary, Storage};
use serde::Serialize;
use std::collections::BTreeMap;

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum StorageArg {
    /// Four bytes a number, exact.
    F32,
    /// Two bytes: within 0.03 % of f32.
    F16,
    /// One byte for most: within 0.5 % of f32.
    Int8,
}

impl From<StorageArg> for Storage {
    fn from(arg: StorageArg) -> Storage {
        match arg {
            StorageArg::F32 => Storage::F32,
            StorageArg::F16 => Storage::F16,
            StorageArg::Int8 => Storage::Int8,
        }
    }
}

/// How light is taken from block to block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CouplingArg {
    /// By the operator of each whole path of openings.
    Table,
    /// By lightfields passed on from opening to opening, as in the paper.
    Lightfield,
}

impl From<CouplingArg> for Coupling {
    fn from(arg: CouplingArg) -> Self {
        match arg {
            CouplingArg::Table => Coupling::Table,
            CouplingArg::Lightfield => Coupling::Lightfield,
        }
    }
}

/// Bytes of a kind of operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindBytes {
    /// Of all matrices of the kind.
    pub bytes: usize,
    /// How they are stored; "mixed" if not all alike.
    pub storage: &'static str,
}

/// Bytes of each kind of operator that has elements.
pub fn kind_bytes(dictionary: &StoredDictionary) -> BTreeMap<OperatorKind, KindBytes> {
    let mut kinds: BTreeMap<OperatorKind, KindBytes> = BTreeMap::new();
    dictionary.map(|kind, matrix| {
        if matrix.rows() * matrix.columns() == 0 {
            return;
        }
        let storage = matrix.storage().name();
        let entry = kinds.entry(kind).or_insert(KindBytes { bytes: 0, storage });
        entry.bytes += matrix.bytes();
        if entry.storage != storage {
            entry.storage = "mixed";
        }
    });
    kinds
}

/// Ranks of the operators that take light from block to block.
#[derive(Clone, Debug, Serialize)]
pub struct CouplingReport {
    lightfield_modes: usize,
    lightfield_dropped_energy: f32,
    emission_modes: usize,
    emission_dropped_energy: f32,
    response_modes: usize,
    response_dropped_energy: f32,
    paths: usize,
}

impl CouplingReport {
    /// Of a dictionary.
    pub fn of<M>(dictionary: &Dictionary<M>) -> Self {
        let (fields, paths) = (&dictionary.lightfields, &dictionary.paths);
        Self {
            lightfield_modes: fields.parity.len(),
            lightfield_dropped_energy: fields.dropped_energy,
            emission_modes: paths.emission_parity.len(),
            emission_dropped_energy: paths.emission_dropped_energy,
            response_modes: paths.response_parity.len(),
            response_dropped_energy: paths.response_dropped_energy,
            paths: paths.entries.len(),
        }
    }

    /// Prints it as one sentence.
    pub fn print(&self) {
        crate::report_line!(
            "between blocks: {} paths from {} emission modes (energy dropped {:.2e}) to {} response modes \
             ({:.2e}); {} lightfield modes ({:.2e})",
            self.paths,
            self.emission_modes,
            self.emission_dropped_energy,
            self.response_modes,
            self.response_dropped_energy,
            self.lightfield_modes,
            self.lightfield_dropped_energy,
        );
    }
}
