//! Texels of the walls of a warped block (Loos et al. 2011, section 6.2).

use glam::DVec3;
use mrt_core::geometry::cube::Face;
use mrt_core::geometry::hexahedron::Hexahedron;

/// The walls of a cube with the images of their texels under a warp. Texels are numbered as in a
/// shape: wall by wall, row by row, column by column.
#[derive(Clone, Debug)]
pub struct WarpedWalls {
    /// Takes points of the unit cube to the world; passes [`Hexahedron::check`].
    pub warp: Hexahedron,
    /// The faces that are walls, in the order of [`Face::ALL`].
    pub faces: Vec<Face>,
    /// Texels along an edge of a wall.
    pub resolution: usize,
    /// Images of the texel centres.
    pub centers: Vec<DVec3>,
    /// Unit normals into the block at the centres.
    pub normals: Vec<DVec3>,
    /// Texel areas: the length of the vector area of the loop through a texel's four corners.
    pub areas: Vec<f64>,
}

impl WarpedWalls {
    /// Places `resolution`² texels on each face.
    pub fn new(faces: &[Face], resolution: usize, warp: &Hexahedron) -> Self {
        let step = 1.0 / resolution as f64;
        let mut walls = Self {
            warp: *warp,
            faces: faces.to_vec(),
            resolution,
            centers: Vec::new(),
            normals: Vec::new(),
            areas: Vec::new(),
        };
        for &face in faces {
            for k in 0..resolution * resolution {
                let (i, j) = ((k % resolution) as f64, (k / resolution) as f64);
                let (u, v) = ((i + 0.5) * step, (j + 0.5) * step);
                walls.centers.push(warp.point(face.point(u, v)));
                walls.normals.push(warp.face_normal(face, u, v));
                let along = |k: f64| [k * step, (k + 1.0) * step];
                let [a, b, c, d] = face
                    .rectangle(along(i), along(j))
                    .map(|unit| warp.point(unit));
                walls.areas.push((c - a).cross(d - b).length() * 0.5);
            }
        }
        walls
    }

    /// Number of texels.
    pub fn texel_count(&self) -> usize {
        self.centers.len()
    }

    /// Face and centre of every texel in the unit cube.
    pub fn unit_texels(&self) -> impl Iterator<Item = (Face, DVec3)> + '_ {
        let resolution = self.resolution;
        self.faces.iter().flat_map(move |&face| {
            (0..resolution * resolution).map(move |k| {
                let (row, column) = (k / resolution, k % resolution);
                (face, face.texel_center(resolution, row, column))
            })
        })
    }

    /// The frame in which a texel's vector irradiance is stored, as unit vectors: along u, across u on the side of v,
    /// along the inward normal.
    pub fn texel_axes(&self, texel: usize) -> [DVec3; 3] {
        let (resolution, per_wall) = (self.resolution, self.resolution * self.resolution);
        let face = self.faces[texel / per_wall];
        let k = texel % per_wall;
        let unit = face.texel_center(resolution, k / resolution, k % resolution);
        let jacobian = self.warp.jacobian(unit);
        let normal = self.normals[texel];
        let tangent = |axis: usize| jacobian.col(axis).reject_from(normal);
        let u = tangent(face.u_axis()).normalize();
        let v = tangent(face.v_axis()).reject_from(u).normalize();
        [u, v, normal]
    }
}
