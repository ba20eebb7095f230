//! Shadows of direct light: by the level's openings, or by the caller's rays.

use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedBlock, PlacedLevel, Portal};
use glam::DVec3;
use mrt_core::geometry::tube::TubeForm;

/// A surface point whose light is computed.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The block whose wall it is on.
    pub block: BlockIndex,
    /// World position, metres.
    pub position: DVec3,
}

/// Where a receiver's light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Toward {
    /// A light at a point of a block.
    Point {
        /// World position, metres.
        position: DVec3,
        /// The block that contains the light.
        block: BlockIndex,
    },
    /// A light at infinity; the unit vector points to it.
    Infinity(DVec3),
}

/// Decides which part of a light reaches a point.
pub trait Visibility: Sync {
    /// Fraction in [0, 1] of the light that arrives. Larger values count as 1, negative ones and NaN as 0. `doors` has
    /// the present value of each of [`PlacedLevel::doors`].
    fn fraction(
        &self,
        level: &PlacedLevel,
        doors: &[f32],
        receiver: Receiver,
        toward: Toward,
    ) -> f32;

    /// A version of the answers: change it whenever they may differ from earlier ones. While it stays the same, frames
    /// keep direct light that nothing else changed. With `None`, the default, every frame asks again for every block.
    fn version(&self) -> Option<u64> {
        None
    }

    /// True for [`Openings`], whose shadows frames compute faster without calling [`Visibility::fraction`].
    #[doc(hidden)]
    fn is_by_openings(&self) -> bool {
        false
    }
}

/// Light passes the level's openings, and nothing else.
#[derive(Clone, Copy, Debug, Default)]
pub struct Openings;

impl Visibility for Openings {
    fn fraction(
        &self,
        level: &PlacedLevel,
        doors: &[f32],
        receiver: Receiver,
        toward: Toward,
    ) -> f32 {
        through_openings(level, doors, receiver, toward)
    }

    fn version(&self) -> Option<u64> {
        Some(0)
    }

    fn is_by_openings(&self) -> bool {
        true
    }
}

/// The caller's function decides where light passes, such as a ray cast into the real mesh.
///
/// The function gets the positions of the receiver and the light, metres, and returns the fraction in [0, 1] that
/// arrives. A light at infinity is put [`RAY_REACH`] away from the receiver. Openings and doors play no part: only the
/// function keeps light from crossing the walls of blocks.
#[derive(Clone, Copy, Debug)]
pub struct Rays<F>(pub F);

/// Distance, metres, at which [`Rays`] puts a light at infinity.
pub const RAY_REACH: f64 = 1e6;

impl<F: Fn(DVec3, DVec3) -> f32 + Sync> Visibility for Rays<F> {
    fn fraction(&self, _: &PlacedLevel, _: &[f32], receiver: Receiver, toward: Toward) -> f32 {
        let target = match toward {
            Toward::Point { position, .. } => position,
            Toward::Infinity(direction) => receiver.position + direction * RAY_REACH,
        };
        (self.0)(receiver.position, target)
    }
}

/// A [`Visibility`] whose answers stay the same while `version` does, such as rays into a mesh that changes now and
/// then. With [`FrameConfig::slice`](crate::modular::frame::config::FrameConfig), the rays after a change are spread
/// over several frames.
#[derive(Clone, Copy, Debug)]
pub struct Versioned<V> {
    /// Decides which part of a light reaches a point.
    pub visibility: V,
    /// Change it whenever the answers of `visibility` may differ from earlier ones.
    pub version: u64,
}

impl<V: Visibility> Visibility for Versioned<V> {
    fn fraction(
        &self,
        level: &PlacedLevel,
        doors: &[f32],
        receiver: Receiver,
        toward: Toward,
    ) -> f32 {
        self.visibility.fraction(level, doors, receiver, toward)
    }

    fn version(&self) -> Option<u64> {
        Some(self.version)
    }
}

/// Follows the segment from the receiver to the light through connected openings, into the light's block, or to the
/// outside for a light at infinity. Returns the product of the values of the doors on the way, or 0 if a wall is in the
/// way.
///
/// Cubes and straight tubes count as convex, so nothing inside them is in the way; they are convex unless faces are
/// bent. In a bend, the part of the segment between its openings is tested in the canonical frame, where it is straight
/// if the warp is affine; for other warps only its ends are exact. A line that leaves through an opening to the outside
/// reaches lights at infinity, even if other blocks of the level stand further on.
fn through_openings(level: &PlacedLevel, doors: &[f32], receiver: Receiver, toward: Toward) -> f32 {
    let (direction, goal) = match toward {
        Toward::Point { position, block } => (position - receiver.position, Some(block)),
        Toward::Infinity(direction) => (direction, None),
    };
    let mut here = receiver.block;
    let mut entered = None;
    let mut from = receiver.position;
    let mut passed = 1.0;
    // A straight line enters each convex block at most once.
    for _ in 0..level.blocks.len() {
        if Some(here) == goal {
            let to = receiver.position + direction;
            let is_lit = is_free_inside(&level.blocks[here.get()], from, to);
            return if is_lit { passed } else { 0.0 };
        }
        let block = &level.blocks[here.get()];
        let exit = block.portals.iter().find(|portal| {
            Some(portal.face) != entered && leaves_through(portal, receiver.position, direction)
        });
        if let Some(door) = exit.and_then(|portal| block.doors[portal.face.index()]) {
            passed *= doors[door as usize];
        }
        if let Some(portal) = exit.filter(|_| block.shape.tube() == Some(TubeForm::Bend)) {
            let to = portal.crossing(receiver.position, direction);
            if !is_free_inside(block, from, to) {
                return 0.0;
            }
        }
        if let Some(portal) = exit {
            from = portal.crossing(receiver.position, direction);
        }
        match exit.map(|portal| block.beyond[portal.face.index()]) {
            Some(Beyond::Block { block, face, .. }) => {
                here = block;
                entered = Some(face);
            }
            Some(Beyond::Outside) if goal.is_none() => return passed,
            _ => return 0.0,
        }
    }
    0.0
}

/// True if no wall of a bend is between two points of its block, in metres.
fn is_free_inside(block: &PlacedBlock, from: DVec3, to: DVec3) -> bool {
    match block.shape.tube() {
        Some(form @ TubeForm::Bend) => {
            // Texels and lights are on the wall only up to the rounding of their world positions.
            let inside = |point| form.drawn_inside(block.unit_from_world.point(point));
            form.segment_is_free(inside(from), inside(to))
        }
        _ => true,
    }
}

/// True when the line from `origin` along `direction` passes the portal outwards.
///
/// A line passes a loop of corners when it is on the same side of all edges. The test depends on the corners alone, so
/// the blocks on both sides of an opening agree, even if it is bent.
fn leaves_through(portal: &Portal, origin: DVec3, direction: DVec3) -> bool {
    if direction.dot(portal.outward) <= 0.0 {
        return false;
    }
    let corners = &portal.corners;
    (0..corners.len()).all(|k| {
        let (corner, next) = (corners[k], corners[(k + 1) % corners.len()]);
        (corner - origin).cross(next - origin).dot(direction) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::shape::Shape;
    use mrt_core::geometry::hexahedron::Hexahedron;

    #[test]
    fn lines_pass_a_disc_where_they_pass_its_plane() {
        let shape = Shape::from_name("tube").expect("a tube");
        let warp = Hexahedron::cell(DVec3::ZERO);
        for opening in shape.openings {
            let portal = Portal::new(&warp, opening);
            let outward = opening.face.outward();
            let origin = DVec3::new(0.5, 0.4, 0.45);
            for (offset, passes) in [(0.0, true), (0.39, true), (0.41, false)] {
                for side in [DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
                    let at = opening.face.point(0.5, 0.5) + side * offset;
                    assert_eq!(leaves_through(&portal, origin, at - origin), passes);
                    assert!(portal.crossing(origin, at - origin).distance(at) < 1e-12);
                }
            }
            assert!(!leaves_through(&portal, origin, -outward));
        }
    }
}
