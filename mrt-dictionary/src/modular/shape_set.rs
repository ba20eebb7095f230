//! What a set of shapes asks of its bake.

use crate::modular::paths::ends::PathFrame;
use mrt_runtime::blocks::Shape;
use mrt_runtime::low_level::level::shape::{Hole, Outline};

/// A set of shapes that are cubes, with what they have in common.
#[derive(Clone, Debug)]
pub struct ShapeSet {
    /// The shapes, in the order of the dictionary.
    pub shapes: Vec<&'static Shape>,
    /// True with openings up or down: light at an opening is then known in both frames ([`PathFrame`]).
    pub has_exchanges: bool,
    /// Outlines of the openings: the whole face, and each hole that occurs.
    pub outlines: Vec<Outline>,
    /// All of [`Hole::ALL`] if a hole occurs, because words and masks are indexed by the position there; else none.
    pub holes: Vec<Hole>,
}

impl ShapeSet {
    /// Looks at the openings of all shapes.
    pub fn of(shapes: Vec<&'static Shape>) -> Self {
        let openings = || shapes.iter().flat_map(|shape| shape.openings);
        let has = |outline: Outline| openings().any(|opening| opening.outline == outline);
        let holes = Hole::ALL.into_iter().map(Outline::Hole);
        let holes: Vec<Outline> = holes.filter(|&outline| has(outline)).collect();
        Self {
            has_exchanges: openings().any(|opening| opening.face.axis() == 1),
            holes: if holes.is_empty() {
                Vec::new()
            } else {
                Hole::ALL.to_vec()
            },
            outlines: std::iter::once(Outline::Whole).chain(holes).collect(),
            shapes,
        }
    }

    /// The frames in which light at openings is known.
    pub fn frames(&self) -> &'static [PathFrame] {
        if self.has_exchanges {
            &PathFrame::ALL
        } else {
            &[PathFrame::Upright]
        }
    }
}
