//! Transport by whole paths: a lookup and a sum for each sequence of openings.
//!
//! Every path from an opening is followed for as long as its word is in the dictionary. In an open room there are
//! binomially many, which bounds the depth of a table rather than that of a level: adding one costs the additions
//! of one small matrix.

use super::transit::Transits;
use super::{Arrivals, arrive, compose, with_door};
use crate::dictionary::{Dictionary, PathEntry, ShapeOperators};
use crate::path::{Crossing, Roll, Word, frame_of_heading, hole_of, response_frame};
use crate::scene::{Beyond, Scene};
use mrt_core::cube::{CubeRotation, Face};
use mrt_core::cube_symmetry::CubeSymmetry;
use mrt_core::matrix::{Matrix, multiply};
use std::collections::HashMap;
use std::rc::Rc;

/// The operators of the paths that a scene has, brought to its sources.
pub(super) struct Table<'a> {
    scene: &'a Scene,
    dictionary: &'a Dictionary,
    used_shapes: &'a [&'a ShapeOperators],
    transits: &'a Transits,
    max_depth: usize,
    /// Responses from coefficients by (shape, opening, word, frame's roll).
    cache: HashMap<(usize, usize, usize, bool, u8), Rc<Matrix<f32>>>,
}

/// A path up to the block that it has just entered.
struct Path {
    word: Word,
    block: usize,
    /// Takes the entered block's canonical directions to the source's.
    source_from_here: CubeRotation,
    /// Headings of the word's x and y in the source's frame, as far as they are used.
    x: Option<Face>,
    y: Option<Face>,
    doors: Vec<u32>,
    /// Product of the transits so far.
    factor: f32,
}

impl<'a> Table<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        dictionary: &'a Dictionary,
        used_shapes: &'a [&'a ShapeOperators],
        transits: &'a Transits,
        max_depth: usize,
    ) -> Self {
        Self {
            scene,
            dictionary,
            used_shapes,
            transits,
            max_depth,
            cache: HashMap::new(),
        }
    }

    /// All light of a block that enters others.
    pub(super) fn follow(&mut self, source: usize) -> Arrivals {
        let mut arrivals = Arrivals::new();
        let block = &self.scene.blocks[source];
        for (opening, aperture) in block.shape.openings.iter().enumerate() {
            let start = Path {
                word: Word::default(),
                block: source,
                source_from_here: CubeRotation::IDENTITY,
                x: None,
                y: None,
                doors: Vec::new(),
                factor: 1.0,
            };
            self.cross(source, opening, aperture.face, &start, &mut arrivals);
        }
        arrivals
    }

    /// Goes on through a face of the block that a path has reached.
    fn cross(
        &mut self,
        source: usize,
        opening: usize,
        exit: Face,
        path: &Path,
        arrivals: &mut Arrivals,
    ) {
        let here = &self.scene.blocks[path.block];
        let Beyond::Block {
            block,
            face: entered,
            here_from_there,
        } = here.beyond[exit.index()]
        else {
            return;
        };
        let first = self.scene.blocks[source].shape.openings[opening].face;
        let heading = path.source_from_here.face(exit);
        let (mut x, mut y) = (path.x, path.y);
        let letter = if heading == first {
            Face::PosZ
        } else if x.is_none() || x == Some(heading) {
            x = Some(heading);
            Face::PosX
        } else {
            y = Some(heading);
            Face::PosY
        };
        let hole = here.shape.opening(exit).and_then(|o| hole_of(o.outline));
        let word = path.word.then(Crossing {
            heading: letter,
            hole,
        });
        let Some(index) = self.entry(&word) else {
            return;
        };
        let mut next = Path {
            word,
            block,
            source_from_here: compose(path.source_from_here, here_from_there),
            x,
            y,
            doors: with_door(&path.doors, here.doors[exit.index()]),
            factor: path.factor,
        };
        let frame = path_frame(first, x, y);
        let responses = self.responses(source, opening, index, frame);
        let target_frame = CubeSymmetry::from(next.source_from_here.inverse())
            .after(frame)
            .after(response_frame(&next.word));
        arrive(
            arrivals,
            &next.doors,
            (block, entered),
            target_frame,
            &self.dictionary.paths.response_parity,
            (&responses, path.factor),
        );
        if next.word.crossings().len() >= self.max_depth {
            return;
        }
        for aperture in self.scene.blocks[block].shape.openings {
            let heading = next.source_from_here.face(aperture.face);
            let used = [Some(first), next.x, next.y];
            if !used.contains(&Some(heading.opposite())) {
                let there = &self.scene.blocks[block];
                let transit = self.transits.factor(there, entered, aperture.face);
                next.factor = path.factor * transit;
                self.cross(source, opening, aperture.face, &next, arrivals);
            }
        }
    }

    fn entry(&self, word: &Word) -> Option<usize> {
        let entries = &self.dictionary.paths.entries;
        entries
            .binary_search_by(|entry: &PathEntry| entry.word.cmp(word))
            .ok()
    }

    /// The path's operator times the emission of the source's shape in the path's frame.
    fn responses(
        &mut self,
        source: usize,
        opening: usize,
        word: usize,
        frame: CubeSymmetry,
    ) -> Rc<Matrix<f32>> {
        let shape = self.scene.blocks[source].shape_index;
        let roll = Roll::of(frame);
        let key = (shape, opening, word, roll.exchanged, roll.mirrors);
        let (dictionary, used) = (self.dictionary, self.used_shapes[shape]);
        self.cache
            .entry(key)
            .or_insert_with(|| {
                let operators = &used.openings[opening];
                let exchanged = usize::from(roll.exchanged);
                // Without vertical openings every frame keeps up, and there is one.
                let emission = operators
                    .emission_from_coefficients
                    .get(exchanged)
                    .unwrap_or(&operators.emission_from_coefficients[0]);
                let parity = &dictionary.paths.emission_parity;
                let mirrored = Matrix::from_fn(emission.rows(), emission.columns(), |i, j| {
                    roll.sign(parity[i]) * emission[(i, j)]
                });
                let operator = &dictionary.paths.entries[word].response_from_emission;
                Rc::new(multiply(operator.view(), mirrored.view()))
            })
            .clone()
    }
}

/// The path's canonical frame in the source's: headings that it does not use are those of the opening's frame.
fn path_frame(first: Face, x: Option<Face>, y: Option<Face>) -> CubeSymmetry {
    let reference = frame_of_heading(first);
    let (side, up) = (reference.face(Face::PosX), reference.face(Face::PosY));
    let x = x.unwrap_or(side);
    let y = y.unwrap_or(if x.axis() == side.axis() { up } else { side });
    CubeSymmetry::from_images(x, y, first).unwrap_or(reference)
}
