//! The settings in which a frame is measured.

use mrt_core::simd::SimdLevel;
use mrt_runtime::{AssembleConfig, Coupling, Dictionary, Storage};

/// How a scene's operators are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Packing {
    /// `f32` within blocks and `f16` from block to block: what games get by default.
    Mixed,
    /// Four bytes a number, exact.
    F32,
    /// Two bytes a number.
    F16,
    /// One byte a number.
    Int8,
}

impl Packing {
    /// "mixed", "f32", "f16" or "int8".
    pub fn name(self) -> &'static str {
        match self {
            Packing::Mixed => "mixed",
            Packing::F32 => Storage::F32.name(),
            Packing::F16 => Storage::F16.name(),
            Packing::Int8 => Storage::Int8.name(),
        }
    }

    /// Storage within blocks and from block to block.
    pub(super) fn storages(self) -> [Storage; 2] {
        match self {
            Packing::Mixed => {
                let usual = AssembleConfig::default();
                [usual.shape_storage, usual.transport_storage]
            }
            Packing::F32 => [Storage::F32; 2],
            Packing::F16 => [Storage::F16; 2],
            Packing::Int8 => [Storage::Int8; 2],
        }
    }
}

/// Settings of a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameVariant<'a> {
    /// Name of the dictionary.
    pub preset: &'a str,
    /// The operators.
    pub dictionary: &'a Dictionary,
    /// How the operators are stored.
    pub storage: Packing,
    /// How light goes from block to block.
    pub coupling: Coupling,
    /// Instructions that kernels use.
    pub simd: SimdLevel,
    /// Threads that share a frame.
    pub threads: usize,
}

/// Bytes that scenes of the benchmark may take: 10,000 blocks with the quality preset take more than 2 GiB, and the dense
/// products that they are compared with several times as much.
const MAX_BYTES: usize = 4 << 30;

/// Settings for assembling with a coupling.
pub fn assemble_config(coupling: Coupling) -> AssembleConfig {
    AssembleConfig {
        coupling,
        max_bytes: MAX_BYTES,
        ..AssembleConfig::default()
    }
}

impl FrameVariant<'_> {
    /// A name such as "standard/avx2/t1", with the storage unless it is mixed and the coupling unless it is the table.
    pub fn name(&self) -> String {
        let mut name = format!("{}/{}/t{}", self.preset, self.simd.name(), self.threads);
        if self.storage != Packing::Mixed {
            name = format!("{name}/{}", self.storage.name());
        }
        if self.coupling != Coupling::Table {
            name = format!("{name}/lightfield");
        }
        name
    }
}

/// Values to try of each setting; the first of each list is the usual one.
#[derive(Clone, Debug)]
pub struct VariantLists {
    /// How operators are stored.
    pub storages: Vec<Packing>,
    /// How light goes from block to block.
    pub couplings: Vec<Coupling>,
    /// Instructions that kernels use.
    pub simd: Vec<SimdLevel>,
    /// Threads that share a frame.
    pub threads: Vec<usize>,
    /// All combinations, instead of one change at a time.
    pub product: bool,
}

impl VariantLists {
    /// The variants of a dictionary; the first is the one that others differ from.
    pub fn of<'a>(&self, preset: &'a str, dictionary: &'a Dictionary) -> Vec<FrameVariant<'a>> {
        let mut variants = Vec::new();
        for (a, &storage) in self.storages.iter().enumerate() {
            for (b, &coupling) in self.couplings.iter().enumerate() {
                for (c, &simd) in self.simd.iter().enumerate() {
                    for (d, &threads) in self.threads.iter().enumerate() {
                        let changes = [a, b, c, d].iter().filter(|&&k| k > 0).count();
                        if changes <= 1 || self.product {
                            variants.push(FrameVariant {
                                preset,
                                dictionary,
                                storage,
                                coupling,
                                simd,
                                threads,
                            });
                        }
                    }
                }
            }
        }
        variants
    }
}
