//! Packs a dictionary for a level: leaves out what the level does not use, so that a game ships less.

use crate::level::block::Level;
use crate::modular::assemble::config::Coupling;
use crate::modular::assemble::error::AssembleError;
use crate::modular::assemble::lookup::{usable_coupling, used_operators};
use crate::modular::assemble::place::place_level;
use crate::modular::dictionary::{Dictionary, LightfieldOperators, OperatorMatrix, ShapeOperators};
use crate::modular::propagate::table::used_paths;

/// What a packed dictionary keeps besides the operators that the level needs.
#[derive(Clone, Debug, PartialEq)]
pub struct PackConfig {
    /// Whether to keep the bases of probes.
    pub probes: bool,
    /// Whether to keep the bases of vector irradiance.
    pub vector: bool,
    /// Whether to keep what only tools need: `L_imp`, and with probes [`Dictionary::sources`].
    pub sources: bool,
    /// Whether to keep lightfields, for [`Coupling::Lightfield`].
    pub lightfields: bool,
}

impl Default for PackConfig {
    /// Everything that frames can use.
    fn default() -> Self {
        Self {
            probes: true,
            vector: true,
            sources: false,
            lightfields: true,
        }
    }
}

/// The part of a dictionary that a level uses: its shapes, their variants, and the paths that light takes in it.
///
/// If lightfields are kept, the scene of the level is the same to the last bit, at every depth. Otherwise, light ends
/// at the longest path of the table. Matrices are cloned; borrowed ones are not copied.
///
/// # Errors
/// The errors of [`Scene::assemble`](crate::modular::scene::Scene::assemble) with default settings, except
/// [`AssembleError::TooLarge`].
pub fn pack<M: OperatorMatrix>(
    level: &Level,
    dictionary: &Dictionary<M>,
    config: &PackConfig,
) -> Result<Dictionary<M>, AssembleError> {
    level.check()?;
    let (used, _) = used_operators(level, dictionary)?;
    let placed = place_level(level, dictionary)?;
    let needs_lightfields =
        usable_coupling(level, dictionary, Coupling::Table)? == Coupling::Lightfield;
    let used_paths = used_paths(&placed.blocks, &dictionary.paths)?;
    // Removing from a clone is simpler than choosing: everything but the matrices is small.
    let mut packed = dictionary.clone();
    packed
        .shapes
        .retain(|entry| level.blocks.iter().any(|block| block.shape == entry.shape));
    let is_used = |entry: &ShapeOperators<M>| used.iter().any(|&other| std::ptr::eq(other, entry));
    packed.variants = dictionary
        .variants
        .iter()
        .filter(|variant| is_used(&variant.operators))
        .cloned()
        .collect();
    let mut used_paths = used_paths.into_iter();
    packed
        .paths
        .entries
        .retain(|_| used_paths.next() == Some(true));
    let variants = packed.variants.iter_mut().map(|v| &mut v.operators);
    for entry in packed.shapes.iter_mut().chain(variants) {
        let joint_modes = entry.joint_modes();
        if !config.probes {
            entry.probe_basis = M::empty(0, joint_modes);
        }
        if !config.vector {
            entry.vector_basis = M::empty(0, joint_modes);
        }
        if !config.sources {
            entry.implicit_lighting = M::empty(0, entry.modes());
        }
    }
    if !config.probes {
        packed.probes = 0;
    }
    // The response basis in the sources has rows for probes, so it does not fit a dictionary without them.
    if !config.sources || packed.probes != dictionary.probes {
        packed.sources = None;
    }
    if !config.lightfields && !needs_lightfields {
        packed.lightfields = no_lightfields(dictionary);
    }
    Ok(packed)
}

/// Lightfield operators without modes, for the emission and response modes of a dictionary.
fn no_lightfields<M: OperatorMatrix>(dictionary: &Dictionary<M>) -> LightfieldOperators<M> {
    LightfieldOperators {
        parity: Vec::new(),
        from_emission: M::empty(0, dictionary.paths.emission_parity.len()),
        straight: M::empty(0, 0),
        left: M::empty(0, 0),
        exchange: M::empty(0, 0),
        holes: Vec::new(),
        response_from_lightfield: M::empty(dictionary.response_modes(), 0),
        dropped_energy: dictionary.lightfields.dropped_energy,
    }
}
