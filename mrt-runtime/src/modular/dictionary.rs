//! The dictionary: the operators of the canonical shapes.
//!
//! A bake makes matrices in `f32`. A game may leave them in the bytes of a mapped file, as they are stored
//! ([`StoredDictionary`]). [`Scene::assemble`](crate::modular::scene::Scene::assemble) takes either, and decodes only
//! what the level uses.

mod map;
pub mod operator;
pub mod types;

pub use operator::{OperatorKind, OperatorMatrix};
pub use types::{
    Dictionary, LightfieldOperators, OpeningOperators, PathEntry, PathTable, ShapeOperators,
    Sources, StoredDictionary, Variant,
};

use crate::level::shape::Shape;
use crate::level::warp_form::{WarpForm, same_form};
use crate::level::warp_transport::WarpTransport;
use crate::modular::path::Word;
use mrt_core::geometry::cube::Face;
use mrt_core::storage::{Storage, StoredMatrix};

impl<M> Dictionary<M> {
    /// Position of a shape in [`Dictionary::shapes`]; `None` if it is not there.
    pub fn shape_index(&self, shape: &Shape) -> Option<usize> {
        self.shapes.iter().position(|entry| entry.shape == shape)
    }

    /// The variant of a shape for a form, made in the given way; `None` if there is none.
    pub fn variant(
        &self,
        shape: &Shape,
        transport: WarpTransport,
        form: &WarpForm,
    ) -> Option<&Variant<M>> {
        self.variants.iter().find(|variant| {
            variant.transport == transport
                && variant.operators.shape == shape
                && same_form(&variant.corners, form)
        })
    }

    /// True if the parities of response modes under both mirrors are known. Files of version 1 do not have them.
    pub fn knows_parities(&self) -> bool {
        self.paths
            .response_parity
            .iter()
            .any(|&parity| parity & 2 != 0)
    }

    /// Number of response modes.
    pub fn response_modes(&self) -> usize {
        self.paths.response_parity.len()
    }

    /// True if joined openings may have their up directions a quarter turn apart.
    pub fn has_exchanges(&self) -> bool {
        self.shapes
            .iter()
            .flat_map(|shape| &shape.openings)
            .any(|opening| opening.emission_from_coefficients.len() == 2)
    }

    /// The same dictionary with every matrix replaced by the result of `f`.
    pub fn map<'s, N>(&'s self, mut f: impl FnMut(OperatorKind, &'s M) -> N) -> Dictionary<N> {
        map::map(self, &mut f)
    }
}

impl<M: OperatorMatrix> Dictionary<M> {
    /// The same dictionary with every matrix as `f32`.
    pub fn decode(&self) -> Dictionary {
        self.map(|_, matrix| matrix.decode().into_owned())
    }

    /// The same dictionary with every matrix stored as [`OperatorKind::storage`] of `storage`. Matrices that are stored
    /// so already keep their bits.
    pub fn stored_as(&self, storage: Storage) -> StoredDictionary<'_> {
        self.map(|kind, matrix| {
            let stored = matrix.as_stored(kind.modes());
            let storage = kind.storage(storage);
            if stored.storage() == storage {
                stored
            } else {
                StoredMatrix::encode(&stored.to_matrix(), storage, kind.modes())
            }
        })
    }

    /// Bytes of all matrices.
    pub fn bytes(&self) -> usize {
        let mut bytes = 0;
        self.map(|_, matrix| bytes += matrix.bytes());
        bytes
    }
}

impl<M: OperatorMatrix> LightfieldOperators<M> {
    /// The same operators with every matrix as `f32`.
    pub fn decode(&self) -> LightfieldOperators {
        map::map_lightfields(self, &mut |_, matrix: &M| matrix.decode().into_owned())
    }
}

impl<M> PathTable<M> {
    /// Most openings that paths of the baked table cross: paths without a hole, with one, and with more.
    pub fn depths(&self) -> [usize; 3] {
        [self.depth, self.hole_depth, 0]
    }

    /// Whether the baked table had a word. If it had, and [`PathTable::entries`] has not, packing has left the word
    /// out.
    pub fn whole_table_has(&self, word: &Word) -> bool {
        let mut holes = word.crossings().iter().filter(|c| c.hole.is_some());
        let length = word.crossings().len();
        match (holes.next(), holes.next()) {
            (None, _) => length <= self.depth,
            // Doors and windows are in side faces.
            (Some(hole), None) => hole.heading != Face::PosY && length <= self.hole_depth,
            _ => false,
        }
    }
}

impl<M: OperatorMatrix> ShapeOperators<M> {
    /// Number of modes `k_b`.
    pub fn modes(&self) -> usize {
        self.coefficients_from_direct.rows()
    }

    /// Number of joint modes: the modes of the block's own light, and further ones for light from other blocks.
    pub fn joint_modes(&self) -> usize {
        self.joint_basis.columns()
    }

    /// Bytes of this shape's matrices.
    pub fn bytes(&self) -> usize {
        let of_openings = self.openings.iter().flat_map(|opening| {
            opening
                .emission_from_coefficients
                .iter()
                .chain(&opening.joint_from_response)
        });
        [
            &self.coefficients_from_direct,
            &self.joint_basis,
            &self.probe_basis,
            &self.vector_basis,
            &self.implicit_lighting,
        ]
        .into_iter()
        .chain(of_openings)
        .map(OperatorMatrix::bytes)
        .sum()
    }
}
