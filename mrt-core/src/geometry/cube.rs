//! The unit cube: its faces, the texel grid on them, and the rotations that map it to itself.
//!
//! Texel layout (`docs/CONVENTIONS.md`): texel (row j along v, column i along u) of a face has its centre
//! at u = (i + 0.5) / resolution, v = (j + 0.5) / resolution, measured from the corner of the face with
//! the smallest coordinates. On the faces across the x, y and z axis, u runs along +z, +x and +x, and v
//! along +y, +z and +y.

use glam::DVec3;

/// A face of the unit cube, named by its outward direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Face {
    /// -x
    NegX,
    /// +x
    PosX,
    /// -y
    NegY,
    /// +y
    PosY,
    /// -z
    NegZ,
    /// +z
    PosZ,
}

impl Face {
    /// All faces, in the order -x, +x, -y, +y, -z, +z.
    pub const ALL: [Face; 6] = [
        Face::NegX,
        Face::PosX,
        Face::NegY,
        Face::PosY,
        Face::NegZ,
        Face::PosZ,
    ];

    /// Position in [`Face::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// The face across `axis` (0, 1, 2) on the positive or the negative side.
    pub fn from_axis(axis: usize, positive: bool) -> Face {
        Face::ALL[axis * 2 + usize::from(positive)]
    }

    /// The axis (0, 1, 2) that the face is perpendicular to.
    pub fn axis(self) -> usize {
        self.index() / 2
    }

    /// True for the face at the larger coordinate of its axis.
    pub fn is_positive(self) -> bool {
        self.index() % 2 == 1
    }

    /// The face on the other side of the cube.
    pub fn opposite(self) -> Face {
        Face::ALL[self.index() ^ 1]
    }

    /// Unit normal out of the cube.
    pub fn outward(self) -> DVec3 {
        let mut normal = DVec3::ZERO;
        normal[self.axis()] = if self.is_positive() { 1.0 } else { -1.0 };
        normal
    }

    /// Axis (0, 1, 2) along which u runs.
    pub fn u_axis(self) -> usize {
        [2, 0, 0][self.axis()]
    }

    /// Axis (0, 1, 2) along which v runs.
    pub fn v_axis(self) -> usize {
        [1, 2, 1][self.axis()]
    }

    /// The point of the face at (u, v) in [0, 1]².
    pub fn point(self, u: f64, v: f64) -> DVec3 {
        let mut point = DVec3::ZERO;
        point[self.axis()] = if self.is_positive() { 1.0 } else { 0.0 };
        point[self.u_axis()] = u;
        point[self.v_axis()] = v;
        point
    }

    /// Centre of texel (row j, column i) of a `resolution`² grid.
    pub fn texel_center(self, resolution: usize, j: usize, i: usize) -> DVec3 {
        let step = 1.0 / resolution as f64;
        self.point((i as f64 + 0.5) * step, (j as f64 + 0.5) * step)
    }

    /// The corners of a rectangle on the face, in the order (u0, v0), (u1, v0), (u1, v1), (u0, v1).
    pub fn rectangle(self, u: [f64; 2], v: [f64; 2]) -> [DVec3; 4] {
        [
            self.point(u[0], v[0]),
            self.point(u[1], v[0]),
            self.point(u[1], v[1]),
            self.point(u[0], v[1]),
        ]
    }

    /// Index of the texel that contains a point of the face, row by row. A point outside counts to the
    /// nearest texel.
    pub fn texel_index(self, point: DVec3, resolution: usize) -> usize {
        let along = |axis: usize| {
            let k = (point[axis] * resolution as f64).floor();
            k.clamp(0.0, resolution.saturating_sub(1) as f64) as usize
        };
        along(self.v_axis()) * resolution + along(self.u_axis())
    }

    /// "-x", "+x", "-y", "+y", "-z" or "+z".
    pub fn name(self) -> &'static str {
        ["-x", "+x", "-y", "+y", "-z", "+z"][self.index()]
    }

    /// Inverse of [`Face::name`].
    pub fn from_name(name: &str) -> Option<Face> {
        Face::ALL.into_iter().find(|face| face.name() == name)
    }

    /// Where a map of the cube to itself takes this face, if it takes +x, +y and +z to `images`.
    pub(super) fn image(self, images: [Face; 3]) -> Face {
        let image = images[self.axis()];
        if self.is_positive() {
            image
        } else {
            image.opposite()
        }
    }
}

impl std::fmt::Display for Face {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A rotation that maps the unit cube to itself: one of 24.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CubeRotation {
    /// Where +x, +y and +z point after the rotation.
    images: [Face; 3],
}

impl CubeRotation {
    /// The rotation that changes nothing.
    pub const IDENTITY: CubeRotation = CubeRotation {
        images: [Face::PosX, Face::PosY, Face::PosZ],
    };

    /// The rotation that takes +x to `x` and +y to `y`; `None` if they are not perpendicular.
    pub fn from_images(x: Face, y: Face) -> Option<CubeRotation> {
        if x.axis() == y.axis() {
            return None;
        }
        let z = x.outward().cross(y.outward());
        let z = Face::ALL.into_iter().find(|face| face.outward() == z)?;
        Some(CubeRotation { images: [x, y, z] })
    }

    /// The rotation about +y by a number of quarter turns, each of which takes +z to +x.
    pub fn about_y(quarter_turns: u32) -> CubeRotation {
        let x = [Face::PosX, Face::NegZ, Face::NegX, Face::PosZ][quarter_turns as usize % 4];
        let z = [Face::PosZ, Face::PosX, Face::NegZ, Face::NegX][quarter_turns as usize % 4];
        CubeRotation {
            images: [x, Face::PosY, z],
        }
    }

    /// The rotation about +y that takes +z to `heading`; `None` for +y and -y.
    pub fn about_y_to(heading: Face) -> Option<CubeRotation> {
        (0..4)
            .map(CubeRotation::about_y)
            .find(|rotation| rotation.face(Face::PosZ) == heading)
    }

    /// All 24 rotations.
    pub fn all() -> impl Iterator<Item = CubeRotation> {
        Face::ALL.into_iter().flat_map(|x| {
            Face::ALL
                .into_iter()
                .filter_map(move |y| CubeRotation::from_images(x, y))
        })
    }

    /// Where the rotation takes a face.
    pub fn face(self, face: Face) -> Face {
        face.image(self.images)
    }

    /// Where the rotation takes a point of the unit cube.
    pub fn point(self, point: DVec3) -> DVec3 {
        self.direction(point - DVec3::splat(0.5)) + DVec3::splat(0.5)
    }

    /// Where the rotation takes a direction.
    pub fn direction(self, direction: DVec3) -> DVec3 {
        self.images[0].outward() * direction.x
            + self.images[1].outward() * direction.y
            + self.images[2].outward() * direction.z
    }

    /// The rotation that undoes this one.
    pub fn inverse(self) -> CubeRotation {
        let preimage = |target: Face| {
            Face::ALL
                .into_iter()
                .find(|&face| self.face(face) == target)
                .unwrap_or(target)
        };
        CubeRotation {
            images: [
                preimage(Face::PosX),
                preimage(Face::PosY),
                preimage(Face::PosZ),
            ],
        }
    }

    /// The names of the images of +x and +y: "+x+y" for the identity.
    pub fn name(self) -> String {
        format!("{}{}", self.images[0], self.images[1])
    }

    /// Inverse of [`CubeRotation::name`].
    pub fn from_name(name: &str) -> Option<CubeRotation> {
        let x = Face::from_name(name.get(..2)?)?;
        let y = Face::from_name(name.get(2..)?)?;
        CubeRotation::from_images(x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_24_rotations_and_each_has_its_inverse() {
        let all: Vec<_> = CubeRotation::all().collect();
        assert_eq!(all.len(), 24);
        let probe = DVec3::new(0.125, 0.25, 0.75);
        for rotation in all {
            assert_eq!(rotation.inverse().point(rotation.point(probe)), probe);
            assert_eq!(CubeRotation::from_name(&rotation.name()), Some(rotation));
            for face in Face::ALL {
                let center = rotation.point(face.point(0.5, 0.5));
                assert_eq!(center, rotation.face(face).point(0.5, 0.5));
            }
        }
    }

    #[test]
    fn a_turn_about_y_takes_z_to_every_side_but_not_up_or_down() {
        for heading in Face::ALL {
            let turned = CubeRotation::about_y_to(heading).map(|r| r.face(Face::PosZ));
            assert_eq!(turned, (heading.axis() != 1).then_some(heading));
        }
    }

    #[test]
    fn quarter_turns_about_y_take_z_to_x() {
        assert_eq!(CubeRotation::about_y(1).face(Face::PosZ), Face::PosX);
        for turns in 0..4 {
            let back = CubeRotation::about_y(4 - turns);
            assert_eq!(CubeRotation::about_y(turns).inverse(), back);
        }
    }
}
