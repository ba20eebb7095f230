//! What the frame reads: a level joined with a dictionary, packed and immutable.

use crate::atlas::AtlasLayout;
use crate::light::MAX_LIGHT_VALUE;
use crate::shape::{Aperture, Shape};
use crate::wall::UnitFromWorld;
use glam::{DMat3, DVec3, Vec3};
use mrt_core::block_sparse::BlockSparse;
use mrt_core::cube::{CubeRotation, Face};
use mrt_core::hexahedron::Hexahedron;
use mrt_core::matrix::Matrix;
use std::ops::Range;

/// A level ready for frames. Made by [`assemble`](crate::assemble::assemble).
///
/// Everything inside a block is in its canonical frame: faces, texels and warps already contain the
/// orientation.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// In the order of the level's blocks.
    pub blocks: Vec<SceneBlock>,
    /// Operators of each shape that the level uses.
    pub shapes: Vec<SceneShape>,
    /// World positions of all texels, metres, block by block.
    pub texel_positions: Vec<Vec3>,
    /// Unit normals into the blocks.
    pub texel_normals: Vec<Vec3>,
    /// Linear RGB albedo of all texels; [`Scene::set_texel_albedo`] changes it.
    pub texel_albedo: Vec<Vec3>,
    /// Radiosity that texels emit of themselves, linear RGB, W/m².
    pub texel_emission: Vec<Vec3>,
    /// `T_b->r`: from the coefficients b of all blocks to the joint coefficients of all blocks.
    pub transport: Transport,
    /// Number of coefficients b over all blocks.
    pub coefficient_count: usize,
    /// Number of joint coefficients over all blocks.
    pub joint_count: usize,
    /// Doors in the order of the level's, with the value that each has at first.
    pub doors: Vec<f32>,
    /// Probes along an edge of a block; 0 if the dictionary has none.
    pub probes: usize,
    /// Where each wall's texels go in the lightmap.
    pub atlas: AtlasLayout,
}

/// A block of the scene.
#[derive(Clone, Debug)]
pub struct SceneBlock {
    /// Index into [`Scene::shapes`].
    pub shape_index: usize,
    /// Its canonical shape.
    pub shape: &'static Shape,
    /// Takes the canonical shape to the level's turned cube.
    pub orientation: CubeRotation,
    /// From the canonical cube to the world, metres.
    pub warp: Hexahedron,
    /// The way back.
    pub unit_from_world: UnitFromWorld,
    /// What lies beyond each canonical face.
    pub beyond: [Beyond; 6],
    /// Its part of the scene's texels.
    pub texels: Range<usize>,
    /// Its part of the coefficients b.
    pub coefficients: Range<usize>,
    /// Its part of the joint coefficients; the first of them take its own coefficients b.
    pub joint: Range<usize>,
    /// Takes the axes of the block's probes to the world's: an orthogonal matrix.
    pub world_from_probe: DMat3,
    /// Index into [`Scene::doors`] of the door in each canonical face.
    pub doors: [Option<u32>; 6],
    /// All openings as loops in the world, in the order of the shape's list.
    pub portals: Vec<Portal>,
    /// Axis-aligned bounds (smallest, largest), metres.
    pub bounds: (DVec3, DVec3),
}

/// An opening's outline in the world.
#[derive(Clone, Debug)]
pub struct Portal {
    /// The canonical face.
    pub face: Face,
    /// Corners in a loop that runs clockwise seen from inside the block, metres: four, or those of a polygon
    /// around a disc.
    pub corners: Vec<DVec3>,
    /// Out of the block, at the first corner; not of unit length.
    pub outward: DVec3,
}

impl Portal {
    /// The outline of an opening of a warped cube.
    pub(crate) fn new(warp: &Hexahedron, opening: &Aperture) -> Self {
        let mut corners: Vec<DVec3> = opening
            .corners()
            .into_iter()
            .map(|corner| warp.point(corner))
            .collect();
        let quarter = corners.len() / 4;
        let turn = |c: &[DVec3]| (c[quarter] - c[0]).cross(c[3 * quarter] - c[0]);
        let middle = corners.iter().copied().sum::<DVec3>() / corners.len() as f64;
        if turn(&corners).dot(middle - warp.center()) < 0.0 {
            corners.reverse();
        }
        Self {
            face: opening.face,
            outward: turn(&corners),
            corners,
        }
    }

    /// Where a line passes the plane of the opening; the origin if it runs along it.
    pub(crate) fn crossing(&self, origin: DVec3, direction: DVec3) -> DVec3 {
        let along = direction.dot(self.outward);
        if along == 0.0 {
            return origin;
        }
        origin + direction * ((self.corners[0] - origin).dot(self.outward) / along)
    }
}

/// `T_b->r` of a scene, parted by the doors that light passes on its way.
#[derive(Clone, Debug)]
pub struct Transport {
    /// Through openings that nothing closes: row and column parts are blocks.
    pub steady: BlockSparse<f32>,
    /// Through doors.
    pub gated: Vec<Gate>,
}

/// What passes exactly these doors.
#[derive(Clone, Debug)]
pub struct Gate {
    /// Indices into [`Scene::doors`], ascending.
    pub doors: Vec<u32>,
    /// To be multiplied by the product of the doors' values.
    pub operator: BlockSparse<f32>,
}

impl Transport {
    /// Bytes of all operators.
    pub fn bytes(&self) -> usize {
        self.steady.bytes() + self.gated.iter().map(|g| g.operator.bytes()).sum::<usize>()
    }

    /// Joint coefficients of light from other blocks, three channels, from the coefficients b and the doors'
    /// values.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn multiply(&self, coefficients: &[f32], doors: &[f32], joint: &mut [f32]) {
        self.steady.multiply(coefficients, 3, joint);
        for gate in &self.gated {
            let value: f32 = gate
                .doors
                .iter()
                .map(|&door| doors[door as usize])
                .product();
            if value > 0.0 {
                gate.operator
                    .multiply_add_scaled(coefficients, 3, value, joint);
            }
        }
    }
}

/// What lies beyond a face of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beyond {
    /// A wall.
    Wall,
    /// The outside of the level.
    Outside,
    /// Another block.
    Block {
        /// Its index.
        block: usize,
        /// The canonical face of it that is joined to this one.
        face: Face,
        /// Takes directions of its canonical cube to directions of this block's.
        here_from_there: CubeRotation,
    },
}

/// Why the surface of a block was not changed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// No such block.
    #[error("block {found}; expected an index below {expected}")]
    Block {
        /// Number of blocks.
        expected: usize,
        /// The index given.
        found: usize,
    },
    /// Not one value a texel.
    #[error("block {block}: {found} values of {what}; expected {expected}, one a texel")]
    Length {
        /// Which block.
        block: usize,
        /// What was to be set.
        what: &'static str,
        /// Texels of the block.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value that is negative, too large or NaN.
    #[error(
        "block {block}, texel {texel}: {what} {found}; expected three values in [0, {largest:e}]"
    )]
    Value {
        /// Which block.
        block: usize,
        /// Which texel of it.
        texel: usize,
        /// What was to be set.
        what: &'static str,
        /// Largest accepted.
        largest: f32,
        /// The value given.
        found: Vec3,
    },
}

/// Operators of a shape that frames use.
#[derive(Clone, Debug)]
pub struct SceneShape {
    /// `T_d->b`, modes x texels.
    pub coefficients_from_direct: Matrix<f32>,
    /// Texels x joint modes: irradiance from joint coefficients.
    pub joint_basis: Matrix<f32>,
    /// 9 probes³ x joint modes: SH coefficients of probes.
    pub probe_basis: Matrix<f32>,
    /// 4 texels x joint modes: vector irradiance, or no rows.
    pub vector_basis: Matrix<f32>,
    /// Area of each texel over that of a cube's; empty for cubes.
    pub texel_areas: Vec<f32>,
}

impl SceneBlock {
    /// True unless a point of the block's cube is outside the round wall in it by more than `tolerance`, in block
    /// widths.
    fn is_inside_walls(&self, point: DVec3, tolerance: f64) -> bool {
        self.shape.tube().is_none()
            || self
                .shape
                .is_inside_walls(self.unit_from_world.point(point), tolerance)
    }
}

impl Scene {
    /// Gives each texel of a block an albedo of its own, linear RGB, in the order of the canonical shape's texels;
    /// texels in holes keep none. The next frame sees it.
    ///
    /// # Errors
    /// [`SurfaceError`], if there is no such block, not as many values as texels, or one outside [0, 1]; the scene
    /// is then as it was.
    pub fn set_texel_albedo(&mut self, block: usize, albedo: &[Vec3]) -> Result<(), SurfaceError> {
        let range = self.check_surface(block, albedo, "albedo", 1.0)?;
        let in_holes = self.in_holes(block);
        for ((to, &from), is_in_hole) in self.texel_albedo[range]
            .iter_mut()
            .zip(albedo)
            .zip(in_holes)
        {
            if !is_in_hole {
                *to = from;
            }
        }
        Ok(())
    }

    /// Lets each texel of a block emit radiosity of its own, linear RGB, W/m², in the same order.
    ///
    /// # Errors
    /// [`SurfaceError`], as for [`Scene::set_texel_albedo`], with values in [0, [`MAX_LIGHT_VALUE`]].
    pub fn set_texel_emission(
        &mut self,
        block: usize,
        emission: &[Vec3],
    ) -> Result<(), SurfaceError> {
        let range = self.check_surface(block, emission, "emission", MAX_LIGHT_VALUE)?;
        let in_holes = self.in_holes(block);
        for ((to, &from), is_in_hole) in self.texel_emission[range]
            .iter_mut()
            .zip(emission)
            .zip(in_holes)
        {
            if !is_in_hole {
                *to = from;
            }
        }
        Ok(())
    }

    fn check_surface(
        &self,
        block: usize,
        values: &[Vec3],
        what: &'static str,
        largest: f32,
    ) -> Result<Range<usize>, SurfaceError> {
        let placed = self.blocks.get(block).ok_or(SurfaceError::Block {
            found: block,
            expected: self.blocks.len(),
        })?;
        if values.len() != placed.texels.len() {
            return Err(SurfaceError::Length {
                block,
                what,
                expected: placed.texels.len(),
                found: values.len(),
            });
        }
        let is_legal = |value: &Vec3| value.to_array().iter().all(|x| (0.0..=largest).contains(x));
        match values.iter().position(|value| !is_legal(value)) {
            Some(texel) => Err(SurfaceError::Value {
                block,
                texel,
                what,
                largest,
                found: values[texel],
            }),
            None => Ok(placed.texels.clone()),
        }
    }

    /// For each texel of a block whether it is in a hole.
    fn in_holes(&self, block: usize) -> impl Iterator<Item = bool> + use<> {
        let shape = self.blocks[block].shape;
        shape
            .texels(self.resolution)
            .map(move |(face, center)| shape.is_in_hole(face, center))
    }

    /// True if every shape has vector irradiance.
    pub fn has_vector(&self) -> bool {
        self.blocks.iter().all(|block| {
            let rows = self.shapes[block.shape_index].vector_basis.rows();
            rows == 4 * block.texels.len()
        })
    }

    /// Number of texels over all blocks.
    pub fn texel_count(&self) -> usize {
        self.texel_positions.len()
    }

    /// The first block that contains a point, else the first that it lies within `tolerance` (in block
    /// widths) of.
    pub fn block_at(&self, point: DVec3, tolerance: f64) -> Option<usize> {
        let containing = |slack: f64| {
            self.blocks.iter().position(|block| {
                // Most blocks are far away, and this is asked in every frame.
                let (min, max) = block.bounds;
                let margin = DVec3::splat(slack) * (max - min).length();
                point.cmpge(min - margin).all()
                    && point.cmple(max + margin).all()
                    && block.warp.contains(point, slack)
                    && block.is_inside_walls(point, slack)
            })
        };
        containing(0.0).or_else(|| containing(tolerance))
    }

    /// The first block whose cube contains a point that is outside the round wall in it.
    pub(crate) fn tube_around(&self, point: DVec3) -> Option<usize> {
        let is_around =
            |block: &SceneBlock| block.shape.tube().is_some() && block.warp.contains(point, 0.0);
        self.blocks.iter().position(is_around)
    }

    /// Index within a block of the texel at (row, column) of a face *as the level names it*, after
    /// orientation; `None` for openings and texels that do not exist. Rows and columns of a tube are those of the
    /// flat face that its chart is named by.
    pub fn level_texel(
        &self,
        block: usize,
        face: Face,
        row: usize,
        column: usize,
    ) -> Option<usize> {
        let resolution = self.resolution;
        let placed = self.blocks.get(block)?;
        if row >= resolution || column >= resolution {
            return None;
        }
        let canonical = placed.orientation.inverse();
        let center = canonical.point(face.texel_center(resolution, row, column));
        let face = canonical.face(face);
        let offset = placed.shape.wall_offset(face, resolution)?;
        Some(offset + face.texel_index(center, resolution))
    }

    /// Bytes of the operators that frames read.
    pub fn operator_bytes(&self) -> usize {
        let of_shapes: usize = self
            .shapes
            .iter()
            .flat_map(|shape| {
                [
                    &shape.coefficients_from_direct,
                    &shape.joint_basis,
                    &shape.probe_basis,
                    &shape.vector_basis,
                ]
            })
            .map(|matrix| std::mem::size_of_val(matrix.data()))
            .sum();
        of_shapes + self.transport.bytes()
    }
}
