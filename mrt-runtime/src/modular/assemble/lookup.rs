//! Finds the operators of a dictionary that a level uses.

use crate::level::block::Level;
use crate::level::warp_form::form_of;
use crate::level::warp_transport::WarpTransport;
use crate::modular::assemble::config::Coupling;
use crate::modular::assemble::error::AssembleError;
use crate::modular::dictionary::{Dictionary, ShapeOperators};

/// The coupling `asked` for; lightfields instead of a table if the dictionary was baked without one.
pub(crate) fn usable_coupling<M>(
    level: &Level,
    dictionary: &Dictionary<M>,
    asked: Coupling,
) -> Result<Coupling, AssembleError> {
    if asked == Coupling::Table && dictionary.paths.depth > 0 {
        return Ok(Coupling::Table);
    }
    if dictionary.lightfields.parity.is_empty() && !level.connections.is_empty() {
        return Err(AssembleError::MissingLightfields);
    }
    Ok(Coupling::Lightfield)
}

/// The operators that the level uses, each once; and for each block, the index of its operators among them.
pub(crate) fn used_operators<'a, M>(
    level: &Level,
    dictionary: &'a Dictionary<M>,
) -> Result<(Vec<&'a ShapeOperators<M>>, Vec<usize>), AssembleError> {
    let mut used: Vec<&ShapeOperators<M>> = Vec::new();
    let mut of_block = Vec::with_capacity(level.blocks.len());
    for (index, block) in level.blocks.iter().enumerate() {
        let position =
            dictionary
                .shape_index(block.shape)
                .ok_or_else(|| AssembleError::MissingShape {
                    block: index,
                    shape: block.shape.name,
                    expected: dictionary
                        .shapes
                        .iter()
                        .map(|entry| entry.shape.name)
                        .collect::<Vec<_>>()
                        .join(", "),
                })?;
        let entry = match block.transport {
            WarpTransport::Canonical => &dictionary.shapes[position],
            transport => {
                let variant = dictionary.variant(block.shape, transport, &form_of(block));
                let missing = || AssembleError::MissingVariant {
                    block: index,
                    shape: block.shape.name,
                    transport: transport.name(),
                };
                &variant.ok_or_else(missing)?.operators
            }
        };
        let known = used.iter().position(|&other| std::ptr::eq(other, entry));
        of_block.push(known.unwrap_or_else(|| {
            used.push(entry);
            used.len() - 1
        }));
    }
    Ok((used, of_block))
}
