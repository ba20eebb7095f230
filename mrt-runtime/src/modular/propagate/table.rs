//! Transport by whole paths: a lookup and a sum for each sequence of openings.
//!
//! Every path from an opening is followed as long as its word is in the table. An open room has binomially many paths;
//! that limits the depth of a table. In a level, each path only costs the addition of one small matrix.

use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedBlock};
use crate::modular::assemble::error::AssembleError;
use crate::modular::dictionary::{OperatorMatrix, PathTable};
use crate::modular::path::{
    Crossing, MAX_WORD, Roll, Word, frame_of_heading, hole_of, response_frame,
};
use crate::modular::propagate::arrivals::{Arrivals, Arriving, arrive, compose, with_door};
use crate::modular::propagate::context::PropagationContext;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::{Matrix, multiply};
use std::collections::HashMap;
use std::rc::Rc;

/// Follows light by the dictionary's table of paths.
pub(super) struct Table<'a, M> {
    context: &'a PropagationContext<'a, M>,
    /// Responses from coefficients b, response modes x modes.
    cache: HashMap<CacheKey, Rc<Matrix<f32>>>,
}

/// What the responses of a path depend on.
#[derive(PartialEq, Eq, Hash)]
struct CacheKey {
    shape: usize,
    opening: usize,
    /// Position of the path's word in the table.
    word: usize,
    roll: Roll,
}

/// A path from its source to the block that it has just entered.
#[derive(Clone)]
struct Path {
    word: Word,
    block: BlockIndex,
    /// The canonical face that it entered by.
    entered: Face,
    /// Rotation from the canonical cube of the entered block to that of the source.
    source_from_here: CubeRotation,
    /// Heading of the word's x in the source's frame; `None` before it is used.
    x: Option<Face>,
    /// Heading of the word's y in the source's frame; `None` before it is used.
    y: Option<Face>,
    /// Doors on the way, ascending.
    doors: Vec<u32>,
    /// Product of the factors of the blocks on the way.
    factor: f32,
}

/// Follows all paths from one opening of a block whose words are in the table.
struct Walk<'a, M> {
    blocks: &'a [PlacedBlock],
    paths: &'a PathTable<M>,
    /// Factor of light that enters a block by one face and leaves by another; `None` if only words matter.
    transit: Option<&'a dyn Fn(BlockIndex, Face, Face) -> f32>,
    max_depth: usize,
    source: BlockIndex,
    /// Position, in the openings of the source's shape, of the first opening that paths cross.
    opening: usize,
}

impl<M> Clone for Walk<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Walk<'_, M> {}

impl<M> Walk<'_, M> {
    /// Calls `visit` with each path and the position of its word in the table.
    fn follow(self, visit: &mut impl FnMut(usize, &Path)) -> Result<(), AssembleError> {
        let start = Path {
            word: Word::default(),
            block: self.source,
            entered: self.first(),
            source_from_here: CubeRotation::IDENTITY,
            x: None,
            y: None,
            doors: Vec::new(),
            factor: 1.0,
        };
        self.cross(self.first(), &start, visit)
    }

    /// The face of the source that paths leave by, which is also their first heading.
    fn first(self) -> Face {
        self.blocks[self.source.get()].shape.openings[self.opening].face
    }

    /// Position of a word in the table; `None` where the table ends. An error if the word was packed away.
    fn position(self, word: &Word) -> Result<Option<usize>, AssembleError> {
        let entries = &self.paths.entries;
        let found = entries.binary_search_by(|entry| entry.word.cmp(word));
        if found.is_err() && self.paths.whole_table_has(word) {
            let source = self.source.get();
            return Err(AssembleError::MissingPath {
                block: source,
                face: self.blocks[source].orientation.face(self.first()),
                word: word.name(),
            });
        }
        Ok(found.ok())
    }

    /// Continues a path through a face of the block that it has reached.
    fn cross(
        self,
        exit: Face,
        path: &Path,
        visit: &mut impl FnMut(usize, &Path),
    ) -> Result<(), AssembleError> {
        let here = &self.blocks[path.block.get()];
        let Beyond::Block {
            block,
            face: entered,
            here_from_there,
        } = here.beyond[exit.index()]
        else {
            return Ok(());
        };
        let first = self.first();
        let mut next = Path {
            block,
            entered,
            source_from_here: compose(path.source_from_here, here_from_there),
            doors: with_door(&path.doors, here.doors[exit.index()]),
            ..path.clone()
        };
        let heading = path.source_from_here.face(exit);
        next.word = path.word.then(Crossing {
            heading: next.letter(heading, first),
            hole: here.shape.opening(exit).and_then(|o| hole_of(o.outline)),
        });
        let Some(index) = self.position(&next.word)? else {
            return Ok(());
        };
        visit(index, &next);
        if next.word.crossings().len() >= self.max_depth {
            return Ok(());
        }
        for aperture in self.blocks[block.get()].shape.openings {
            let heading = next.source_from_here.face(aperture.face);
            let used = [Some(first), next.x, next.y];
            if !used.contains(&Some(heading.opposite())) {
                let transit = self
                    .transit
                    .map_or(1.0, |factor| factor(block, entered, aperture.face));
                let onward = Path {
                    factor: next.factor * transit,
                    ..next.clone()
                };
                self.cross(aperture.face, &onward, visit)?;
            }
        }
        Ok(())
    }
}

impl Path {
    /// The heading, in the word, of a crossing with a heading in the source's frame. A heading that no crossing had
    /// before becomes the word's x or y.
    fn letter(&mut self, heading: Face, first: Face) -> Face {
        if heading == first {
            Face::PosZ
        } else if self.x.is_none() || self.x == Some(heading) {
            self.x = Some(heading);
            Face::PosX
        } else {
            self.y = Some(heading);
            Face::PosY
        }
    }
}

/// By entry of a table: whether a path of the level, of any depth, has it.
pub(crate) fn used_paths<M>(
    blocks: &[PlacedBlock],
    paths: &PathTable<M>,
) -> Result<Vec<bool>, AssembleError> {
    let mut used = vec![false; paths.entries.len()];
    for (source, block) in blocks.iter().enumerate() {
        for opening in 0..block.shape.openings.len() {
            let walk = Walk {
                blocks,
                paths,
                transit: None,
                max_depth: MAX_WORD,
                source: BlockIndex::new(source),
                opening,
            };
            walk.follow(&mut |index, _| used[index] = true)?;
        }
    }
    Ok(used)
}

impl<'a, M: OperatorMatrix> Table<'a, M> {
    pub(super) fn new(context: &'a PropagationContext<'a, M>) -> Self {
        Self {
            context,
            cache: HashMap::new(),
        }
    }

    /// The sum of all light of a block that enters other blocks.
    pub(super) fn follow(&mut self, source: BlockIndex) -> Result<Arrivals, AssembleError> {
        let mut arrivals = Arrivals::new();
        let context = self.context;
        let (scene, paths) = (context.scene, &context.dictionary.paths);
        let transit = |block: BlockIndex, entered: Face, left: Face| {
            let shape = scene.blocks[block.get()].shape_index;
            context.transits.factor(shape, entered, left)
        };
        let openings = scene.level.blocks[source.get()].shape.openings;
        for (opening, aperture) in openings.iter().enumerate() {
            let walk = Walk {
                blocks: &scene.level.blocks,
                paths,
                transit: Some(&transit),
                max_depth: context.config.max_depth,
                source,
                opening,
            };
            walk.follow(&mut |index, path| {
                let frame = path_frame(aperture.face, path.x, path.y);
                let responses = self.responses(source, opening, index, frame);
                let arriving = Arriving {
                    doors: &path.doors,
                    block: path.block,
                    face: path.entered,
                    frame: CubeSymmetry::from(path.source_from_here.inverse())
                        .after(frame)
                        .after(response_frame(&path.word)),
                    parity: &paths.response_parity,
                    responses: &responses,
                    factor: path.factor,
                };
                arrive(&mut arrivals, arriving);
            })?;
        }
        Ok(arrivals)
    }

    /// The operator of a path times the emission of the source in the frame of the path.
    fn responses(
        &mut self,
        source: BlockIndex,
        opening: usize,
        word: usize,
        frame: CubeSymmetry,
    ) -> Rc<Matrix<f32>> {
        let shape = self.context.scene.blocks[source.get()].shape_index;
        let roll = Roll::of(frame);
        let key = CacheKey {
            shape,
            opening,
            word,
            roll,
        };
        let paths = &self.context.dictionary.paths;
        let used = self.context.used_shapes[shape];
        self.cache
            .entry(key)
            .or_insert_with(|| {
                let operators = &used.openings[opening];
                let exchanged = usize::from(roll.exchanged);
                // In sets without vertical openings, +y stays up in every frame, and there is only one operator.
                let emission = operators
                    .emission_from_coefficients
                    .get(exchanged)
                    .unwrap_or(&operators.emission_from_coefficients[0])
                    .decode();
                let mirrored = Matrix::from_fn(emission.rows(), emission.columns(), |i, j| {
                    roll.sign(paths.emission_parity[i]) * emission[(i, j)]
                });
                let operator = paths.entries[word].response_from_emission.decode();
                Rc::new(multiply(operator.view(), mirrored.view()))
            })
            .clone()
    }
}

/// From the canonical frame of a path to the source's. Headings that the path does not use are those of the opening's
/// reference frame.
fn path_frame(first: Face, x: Option<Face>, y: Option<Face>) -> CubeSymmetry {
    let reference = frame_of_heading(first);
    let (side, up) = (reference.face(Face::PosX), reference.face(Face::PosY));
    let x = x.unwrap_or(side);
    let y = y.unwrap_or(if x.axis() == side.axis() { up } else { side });
    CubeSymmetry::from_images(x, y, first).unwrap_or(reference)
}
