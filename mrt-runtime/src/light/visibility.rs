//! Shadows of direct light: by the level's openings, or by rays of the caller's.

use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedBlock, PlacedLevel, Portal};
use glam::DVec3;
use mrt_core::geometry::tube::TubeForm;

/// A surface point that asks for light.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The block that it belongs to.
    pub block: BlockIndex,
    /// World position, metres.
    pub position: DVec3,
}

/// Where the light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Toward {
    /// A light at a point of a block.
    Point {
        /// World position, metres.
        position: DVec3,
        /// The block that it stands in.
        block: BlockIndex,
    },
    /// A light at infinity; the unit vector points to it.
    Infinity(DVec3),
}

/// Decides what part of a light reaches a point.
pub trait Visibility: Sync {
    /// Fraction in [0, 1] of the light that arrives, with the value of each of [`PlacedLevel::doors`]; what is more
    /// counts as 1, NaN as 0.
    fn fraction(
        &self,
        level: &PlacedLevel,
        doors: &[f32],
        receiver: Receiver,
        toward: Toward,
    ) -> f32;

    /// Another number whenever answers may differ from those before: with the same one, frames keep what they know.
    /// `None`, the default, makes them ask for every block in every frame.
    fn version(&self) -> Option<u64> {
        None
    }

    /// True for [`Openings`], whose answers frames get faster without asking.
    #[doc(hidden)]
    fn is_by_openings(&self) -> bool {
        false
    }
}

/// Light goes where the level's openings let it.
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

/// Light goes where the caller's function says, such as a ray cast into the real mesh.
///
/// The function gets the receiver's position and the light's, both in metres, the latter pushed
/// [`RAY_REACH`] away for lights at infinity, and returns the fraction in [0, 1] that arrives. Light still
/// crosses walls of blocks only where the function lets it: neither openings nor doors are asked.
#[derive(Clone, Copy, Debug)]
pub struct Rays<F>(pub F);

/// Distance, metres, at which [`Rays`] puts lights at infinity.
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

/// [`Visibility`] whose answers stay the same while `version` does, such as rays into a mesh that moves now and then.
/// With [`FrameConfig::slice`](crate::modular::frame::config::FrameConfig), the rays of a change are spread over frames.
#[derive(Clone, Copy, Debug)]
pub struct Versioned<V> {
    /// Who is asked.
    pub visibility: V,
    /// To be changed whenever answers may change.
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

/// Follows the segment from the receiver through connected openings until it is in the light's
/// block, or outside for lights at infinity; the product of the doors' values on the way.
///
/// Inside a cube or a straight tube nothing is in the way: they count as convex, as they are unless faces are
/// bent. In a bend the part of the segment between its openings is tested in the canonical frame, where it is
/// straight if the warp is affine; for other warps its ends are exact. A line
/// that leaves through an opening to the outside reaches lights at infinity, even if other blocks of the
/// level stand further on.
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
            // Texels and lights are on the wall up to the rounding of their positions in the level.
            let inside = |point| form.drawn_inside(block.unit_from_world.point(point));
            form.segment_is_free(inside(from), inside(to))
        }
        _ => true,
    }
}

/// True when the line from `origin` along `direction` passes the portal outwards.
///
/// The line passes a loop when it runs on the same side of all edges; that depends on the corners
/// alone, so the blocks on both sides of an opening agree, bent openings included.
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
