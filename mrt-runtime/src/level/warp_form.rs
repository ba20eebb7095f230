//! The form of a block: its warp without place, size and orientation. Warped blocks of one form share their operators.

use crate::level::block::Block;
use glam::DVec3;
use mrt_core::geometry::hexahedron::Hexahedron;

/// The eight corners of a form, in the order of [`Hexahedron`]; see [`form_of`].
pub type WarpForm = [[f32; 3]; 8];

/// Two forms are the same if their coordinates differ by less than this, in diagonals of the block. Levels give corners
/// as decimal numbers, perhaps far from the origin, which are good to 1e-6 of a block; a texel at 16² is forty times as
/// wide as this tolerance.
pub const FORM_TOLERANCE: f32 = 1e-3;

/// The form of a block. Its corners are the images of the canonical cube's corners, turned back by the block's
/// orientation, minus the first of them, divided by the length of the diagonal of their bounds.
///
/// A cube has the same form in all of its 24 orientations, and so has every other box. A block at another angle to the
/// level's axes has another form, since its probes have those axes.
pub fn form_of(block: &Block) -> WarpForm {
    let warp = block.canonical_warp();
    let back = block.orientation.inverse();
    let corners = warp
        .corners
        .map(|corner| back.direction(corner - warp.corners[0]));
    let (low, high) = Hexahedron { corners }.bounds();
    let scale = 1.0 / (high - low).length();
    corners.map(|corner| (corner * scale).as_vec3().to_array())
}

/// True if two forms differ by less than [`FORM_TOLERANCE`].
pub fn same_form(a: &WarpForm, b: &WarpForm) -> bool {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < FORM_TOLERANCE)
}

/// The warp of the canonical cube that has a form.
pub fn warp_of(form: &WarpForm) -> Hexahedron {
    Hexahedron {
        corners: form.map(|corner| DVec3::from_array(corner.map(f64::from))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level::shape::SHAPES;
    use glam::Vec3;
    use mrt_core::geometry::cube::CubeRotation;

    #[test]
    fn form_ignores_place_size_and_orientation() {
        let long = DVec3::new(3.0, 1.0, 1.5);
        let block = |orientation: CubeRotation, scale: f64, place: DVec3| {
            // The box that the turned cube fills.
            let size = orientation.direction(long).abs() * scale;
            let warp = Hexahedron::cuboid(place, place + size);
            Block::new(&SHAPES[2], orientation, warp, Vec3::ONE)
        };
        let form = form_of(&block(CubeRotation::IDENTITY, 1.0, DVec3::ZERO));
        assert_eq!(form[0], [0.0; 3]);
        for orientation in CubeRotation::all() {
            let other = form_of(&block(orientation, 7.3, DVec3::new(-300.0, 20.0, 0.1)));
            assert!(same_form(&form, &other), "{}", orientation.name());
        }
        let mut bent = block(CubeRotation::IDENTITY, 1.0, DVec3::ZERO);
        bent.warp.corners[6].y += 0.02;
        assert!(!same_form(&form, &form_of(&bent)));
    }

    #[test]
    fn a_form_is_its_own_form() {
        let mut warp = Hexahedron::cuboid(DVec3::ONE, DVec3::new(3.0, 2.5, 9.0));
        warp.corners[7] += DVec3::new(0.1, -0.2, 0.3);
        let form = form_of(&Block::new(
            &SHAPES[0],
            CubeRotation::IDENTITY,
            warp,
            Vec3::ONE,
        ));
        let again = Block::new(
            &SHAPES[0],
            CubeRotation::IDENTITY,
            warp_of(&form),
            Vec3::ONE,
        );
        assert!(same_form(&form, &form_of(&again)));
    }
}
