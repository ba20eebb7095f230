//! A block as receivers are looked for in it.

use crate::level::block::Block;
use crate::output::receiver::trilinear::Trilinear;
use crate::output::receiver::wall_receiver::WallReceiver;
use glam::DVec3;
use mrt_core::geometry::cube::{CubeRotation, Face};
use mrt_core::geometry::tube::TubeForm;

/// Distances over which light ends on surfaces that have their block behind them, in block widths.
const BEHIND_RANGE: [f64; 2] = [0.1, 0.3];

/// Distances over which light ends on surfaces away from any block, in block widths.
const FAR_RANGE: [f64; 2] = [0.6, 1.2];

/// A block in its canonical frame, with what the search for receivers asks of it.
#[derive(Clone, Debug)]
pub(super) struct BlockInPlace {
    /// From the canonical cube to the world.
    pub map: Trilinear,
    pub orientation: CubeRotation,
    /// Smallest and largest corner of a box around it, metres.
    pub bounds: (DVec3, DVec3),
    /// Cube root of the volume, metres.
    pub width: f64,
    /// By canonical face.
    is_wall: [bool; 6],
    /// `None` for cubes.
    tube: Option<TubeForm>,
    /// Blocks that it is connected to.
    pub neighbours: Vec<usize>,
}

impl BlockInPlace {
    pub fn new(block: &Block) -> Self {
        let warp = block.canonical_warp();
        Self {
            map: Trilinear::new(&warp),
            orientation: block.orientation,
            bounds: warp.bounds(),
            width: warp.jacobian(DVec3::splat(0.5)).determinant().abs().cbrt(),
            neighbours: Vec::new(),
            is_wall: Face::ALL.map(|face| !block.shape.is_open(face)),
            tube: block.shape.tube(),
        }
    }

    /// The nearest point of a tube's wall, which is smooth: no normal is needed to choose a chart. `None` for cubes.
    pub fn on_tube(&self, block: usize, unit: DVec3) -> Option<WallReceiver> {
        let (face, u, v) = self.tube?.chart_of(unit);
        Some(WallReceiver {
            u,
            v,
            ..WallReceiver::on_face(block, face, unit)
        })
    }

    pub fn walls(&self) -> impl Iterator<Item = Face> + '_ {
        Face::ALL
            .into_iter()
            .filter(|face| self.is_wall[face.index()])
    }

    /// Cosines between a surface's normal and the inward normals of the faces around a point.
    pub fn facing(&self, unit: DVec3, normal: DVec3) -> [f64; 6] {
        let gradients = self.map.gradients(unit).unwrap_or([DVec3::ZERO; 3]);
        let along = gradients.map(|gradient| gradient.normalize_or_zero().dot(normal));
        Face::ALL.map(|face| {
            let cosine = along[face.axis()];
            if face.is_positive() { -cosine } else { cosine }
        })
    }

    /// The share of its light that a surface gets whose nearest point in the block is `unit`: 1 in the block or in niches
    /// before it, 0 for surfaces that turn their back on it or are far off.
    pub fn share_lit(&self, point: DVec3, normal: DVec3, unit: DVec3) -> f64 {
        let offset = point - self.map.point(unit);
        let fade = |distance: f64, range: [f64; 2]| {
            let [start, end] = range.map(|share| share * self.width);
            (1.0 - (distance - start) / (end - start)).clamp(0.0, 1.0)
        };
        fade(offset.dot(normal), BEHIND_RANGE) * fade(offset.length(), FAR_RANGE)
    }

    /// The point's place in the unit cube, moved inside it.
    pub fn unit(&self, point: DVec3) -> DVec3 {
        self.unit_from(DVec3::splat(0.5), point)
    }

    /// As [`BlockInPlace::unit`], faster from a good guess.
    pub fn unit_from(&self, guess: DVec3, point: DVec3) -> DVec3 {
        // Far outside, the inverse of a warp may not exist; the nearest point of the bounds serves instead.
        let inside = point.clamp(self.bounds.0, self.bounds.1);
        let unit = self.map.inverse(guess, inside).unwrap_or(guess);
        unit.clamp(DVec3::ZERO, DVec3::ONE)
    }
}
