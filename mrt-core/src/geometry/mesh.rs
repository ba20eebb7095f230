//! Triangle meshes: data, checks, cleaning, normals and transforms.
//!
//! Triangles wind counterclockwise seen from the side that their normal points to. Derived quantities are
//! computed in `f64` and rounded once.

use glam::{DAffine3, DMat3, DVec3, Vec3};

#[cfg(test)]
mod tests;

/// The material of a triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in the file that it came from.
    pub name: String,
    /// Diffuse reflectance, linear RGB, each in [0, 1].
    pub albedo: Vec3,
}

/// Triangles over shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Positions of the vertices.
    pub positions: Vec<Vec3>,
    /// Vertices of the triangles, as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// One unit normal for each vertex, if the mesh has normals of its own.
    pub normals: Option<Vec<Vec3>>,
    /// One index into `materials` for each triangle.
    pub triangle_materials: Vec<u32>,
    /// The materials.
    pub materials: Vec<Material>,
}

/// Why a mesh is not valid. Untidy meshes are valid, and [`clean`] tidies them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {found} of {vertex_count}")]
    VertexOutOfRange {
        /// Which triangle.
        triangle: usize,
        /// The vertex that it names.
        found: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A triangle names a material that does not exist.
    #[error("triangle {triangle} uses material {found} of {material_count}")]
    MaterialOutOfRange {
        /// Which triangle.
        triangle: usize,
        /// The material that it names.
        found: u32,
        /// Number of materials.
        material_count: usize,
    },
    /// An albedo is not a number in [0, 1].
    #[error("material \"{name}\" has albedo {found}; expected 0 to 1")]
    AlbedoOutOfRange {
        /// The material's name.
        name: String,
        /// Its albedo.
        found: Vec3,
    },
    /// An array does not have one entry for each vertex or triangle.
    #[error("{what}: {found} entries, expected {expected}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Number of vertices or triangles.
        expected: usize,
        /// Number of entries.
        found: usize,
    },
}

/// What [`clean`] found, and which of it was dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Vertices with an infinite or NaN coordinate. Dropped.
    pub not_finite_vertices: usize,
    /// Triangles with a vertex that is not finite. Dropped.
    pub not_finite_triangles: usize,
    /// Triangles without area. Dropped.
    pub degenerate_triangles: usize,
    /// Finite vertices that no kept triangle uses. Dropped.
    pub unused_vertices: usize,
    /// Normals of kept vertices that are zero or not finite. If there are any, all normals are dropped.
    pub invalid_normals: usize,
    /// Edges with three or more triangles. Kept. Vertices at the same position count as one.
    pub non_manifold_edges: usize,
    /// Edges with one triangle, where the surface ends. Kept. A closed mesh has none.
    pub boundary_edges: usize,
}

impl TriangleMesh {
    /// Triangles without normals, all of one grey material of albedo 0.5.
    pub fn from_triangles(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            triangle_materials: vec![0; triangles.len()],
            positions,
            triangles,
            normals: None,
            materials: vec![Material {
                name: "grey".to_owned(),
                albedo: Vec3::splat(0.5),
            }],
        }
    }

    /// The three corners of a triangle.
    ///
    /// # Panics
    /// If the triangle or one of its vertices does not exist.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }
}

/// Checks that all indices and lengths fit and that albedos are in range.
///
/// # Errors
/// [`MeshError`], for the first fault in the order of the arrays.
pub fn check(mesh: &TriangleMesh) -> Result<(), MeshError> {
    let length = |what, expected, found| {
        let error = MeshError::WrongLength {
            what,
            expected,
            found,
        };
        if expected == found {
            Ok(())
        } else {
            Err(error)
        }
    };
    let (vertex_count, material_count) = (mesh.positions.len(), mesh.materials.len());
    if let Some(normals) = &mesh.normals {
        length("normals", vertex_count, normals.len())?;
    }
    let triangle_count = mesh.triangles.len();
    length(
        "triangle materials",
        triangle_count,
        mesh.triangle_materials.len(),
    )?;
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        if let Some(&found) = vertices.iter().find(|&&v| v as usize >= vertex_count) {
            return Err(MeshError::VertexOutOfRange {
                triangle,
                found,
                vertex_count,
            });
        }
    }
    for (triangle, &found) in mesh.triangle_materials.iter().enumerate() {
        if found as usize >= material_count {
            return Err(MeshError::MaterialOutOfRange {
                triangle,
                found,
                material_count,
            });
        }
    }
    for material in &mesh.materials {
        let albedo = material.albedo;
        // Written so that NaN fails.
        if !(albedo.cmpge(Vec3::ZERO).all() && albedo.cmple(Vec3::ONE).all()) {
            return Err(MeshError::AlbedoOutOfRange {
                name: material.name.clone(),
                found: albedo,
            });
        }
    }
    Ok(())
}

/// Where the parts of a cleaned mesh come from, to take along what belongs to them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// Triangle of the mesh before, of each triangle; ascending.
    pub triangles: Vec<u32>,
    /// Vertex of the mesh before, of each vertex; ascending.
    pub vertices: Vec<u32>,
}

/// A copy without triangles that have no area or a position that is not finite, and without unused
/// vertices. The rest keeps its order, and all materials are kept.
///
/// Normals are brought to unit length. If a normal that is left has no direction, all normals are dropped
/// ([`with_smooth_normals`] makes new ones).
///
/// # Errors
/// Those of [`check`].
pub fn clean(mesh: &TriangleMesh) -> Result<(TriangleMesh, MeshReport), MeshError> {
    let (cleaned, report, _) = clean_and_trace(mesh)?;
    Ok((cleaned, report))
}

/// As [`clean`]; also says which triangles and vertices were kept.
///
/// # Errors
/// Those of [`check`].
pub fn clean_and_trace(mesh: &TriangleMesh) -> Result<(TriangleMesh, MeshReport, Kept), MeshError> {
    check(mesh)?;
    let mut report = MeshReport::default();
    let (kept, new_index) = choose_kept(mesh, &mut report);
    let mut normals = None;
    if let Some(given) = &mesh.normals {
        let unit: Vec<Option<DVec3>> = kept
            .vertices
            .iter()
            .map(|&v| given[v as usize].as_dvec3().try_normalize())
            .collect();
        report.invalid_normals = unit.iter().filter(|n| n.is_none()).count();
        normals = unit.into_iter().map(|n| n.map(|n| n.as_vec3())).collect();
    }
    let of_vertices = kept.vertices.iter().map(|&v| v as usize);
    let of_triangles = || kept.triangles.iter().map(|&t| t as usize);
    let cleaned = TriangleMesh {
        positions: of_vertices.map(|v| mesh.positions[v]).collect(),
        triangles: of_triangles()
            .map(|t| mesh.triangles[t].map(|v| new_index[v as usize]))
            .collect(),
        normals,
        triangle_materials: of_triangles().map(|t| mesh.triangle_materials[t]).collect(),
        materials: mesh.materials.clone(),
    };
    count_edges(&cleaned, &mut report);
    Ok((cleaned, report, kept))
}

/// Which triangles and vertices [`clean`] keeps, and the new index of each vertex that is kept.
fn choose_kept(mesh: &TriangleMesh, report: &mut MeshReport) -> (Kept, Vec<u32>) {
    const UNUSED: u32 = u32::MAX;
    let finite: Vec<bool> = mesh.positions.iter().map(|p| p.is_finite()).collect();
    report.not_finite_vertices = finite.iter().filter(|&&f| !f).count();
    let mut new_index = vec![UNUSED; mesh.positions.len()];
    let mut kept = Kept::default();
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        if vertices.iter().any(|&v| !finite[v as usize]) {
            report.not_finite_triangles += 1;
        } else if is_degenerate(mesh.corners(triangle)) {
            report.degenerate_triangles += 1;
        } else {
            kept.triangles.push(triangle as u32);
            for &vertex in vertices {
                new_index[vertex as usize] = 0;
            }
        }
    }
    for (vertex, index) in new_index.iter_mut().enumerate() {
        if *index != UNUSED {
            *index = kept.vertices.len() as u32;
            kept.vertices.push(vertex as u32);
        }
    }
    report.unused_vertices = finite.len() - kept.vertices.len() - report.not_finite_vertices;
    (kept, new_index)
}

/// The unit normal of each triangle; zero for triangles without area.
pub fn face_normals(mesh: &TriangleMesh) -> Vec<Vec3> {
    area_normals(mesh)
        .into_iter()
        .map(|n| n.normalize_or_zero().as_vec3())
        .collect()
}

/// The area of each triangle.
pub fn areas(mesh: &TriangleMesh) -> Vec<f64> {
    area_normals(mesh).into_iter().map(|n| n.length()).collect()
}

/// Unit normals for the three corners of each triangle.
///
/// A corner's normal is the mean, weighted by area, of the normals of triangles that meet at its position
/// and whose normals lie within `crease_angle_rad` of this triangle's. At an angle of 0 every triangle is
/// flat, at π all are smooth. Vertices at the same position count as one, so seams of split vertices do
/// not show. Where the mean vanishes, the corner has the normal of its triangle.
///
/// Cost: the sum over positions of the square of the number of triangles that meet there.
pub fn corner_normals(mesh: &TriangleMesh, crease_angle_rad: f64) -> Vec<[Vec3; 3]> {
    let area_normals = area_normals(mesh);
    let unit_normals: Vec<DVec3> = area_normals.iter().map(|n| n.normalize_or_zero()).collect();
    // Neighbours in one plane must pass at an angle of 0, in spite of rounding.
    let least_cosine = libm::cos(crease_angle_rad) - 1e-12;
    let place = first_vertex_at_each_place(mesh);
    let mut start = vec![0; mesh.positions.len() + 1];
    for &vertex in mesh.triangles.iter().flatten() {
        start[place[vertex as usize] as usize + 1] += 1;
    }
    for k in 0..mesh.positions.len() {
        start[k + 1] += start[k];
    }
    let mut next = start.clone();
    let mut triangles_at = vec![0; mesh.triangles.len() * 3];
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        for &vertex in vertices {
            let slot = &mut next[place[vertex as usize] as usize];
            triangles_at[*slot] = triangle;
            *slot += 1;
        }
    }
    let corner = |triangle: usize, vertex: u32| {
        let at = place[vertex as usize] as usize;
        let own = unit_normals[triangle];
        let around = triangles_at[start[at]..start[at + 1]].iter();
        let within = around.filter(|&&t| unit_normals[t].dot(own) >= least_cosine);
        let sum: DVec3 = within.map(|&t| area_normals[t]).sum();
        sum.try_normalize().unwrap_or(own).as_vec3()
    };
    let all = mesh.triangles.iter().enumerate();
    all.map(|(triangle, vertices)| vertices.map(|vertex| corner(triangle, vertex)))
        .collect()
}

/// A copy with the normals of [`corner_normals`]. A vertex is split where the normals of its corners
/// differ.
pub fn with_smooth_normals(mesh: &TriangleMesh, crease_angle_rad: f64) -> TriangleMesh {
    let mut positions = Vec::with_capacity(mesh.positions.len());
    let mut normals: Vec<Vec3> = Vec::with_capacity(mesh.positions.len());
    // By old vertex: the new ones. There are nearly always one or two.
    let mut copies: Vec<Vec<u32>> = vec![Vec::new(); mesh.positions.len()];
    let mut triangles = mesh.triangles.clone();
    let corner_normals = corner_normals(mesh, crease_angle_rad);
    for (vertices, corner_normals) in triangles.iter_mut().zip(corner_normals) {
        for (vertex, normal) in vertices.iter_mut().zip(corner_normals) {
            let old = *vertex as usize;
            let same = copies[old].iter().find(|&&v| normals[v as usize] == normal);
            *vertex = same.copied().unwrap_or(positions.len() as u32);
            if *vertex as usize == positions.len() {
                copies[old].push(*vertex);
                positions.push(mesh.positions[old]);
                normals.push(normal);
            }
        }
    }
    TriangleMesh {
        positions,
        triangles,
        normals: Some(normals),
        triangle_materials: mesh.triangle_materials.clone(),
        materials: mesh.materials.clone(),
    }
}

/// Smallest and largest coordinates of all vertices; `None` if there are no vertices.
pub fn bounds(mesh: &TriangleMesh) -> Option<[Vec3; 2]> {
    let first = *mesh.positions.first()?;
    let all = mesh.positions.iter();
    Some(all.fold([first; 2], |[low, high], &p| [low.min(p), high.max(p)]))
}

/// Takes coordinates with z up to coordinates with y up. The x axis and the handedness stay.
pub const Y_UP_FROM_Z_UP: DMat3 = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);

/// Moves, turns and scales a mesh.
///
/// Normals transform by the inverse transpose. A transform with a mirror reverses the winding of the
/// triangles, so that outsides stay outside. A scale is `DAffine3::from_scale`, a change of axes
/// `DAffine3::from_mat3(Y_UP_FROM_Z_UP)`.
pub fn transform(mesh: &mut TriangleMesh, transform: &DAffine3) {
    for position in &mut mesh.positions {
        *position = transform.transform_point3(position.as_dvec3()).as_vec3();
    }
    let [x, y, z] = [0, 1, 2].map(|k| transform.matrix3.col(k));
    let determinant = x.cross(y).dot(z);
    if let Some(normals) = &mut mesh.normals {
        // The cofactor matrix is the inverse transpose times the determinant, without its division.
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        for normal in normals {
            let turned = cofactors * normal.as_dvec3() * determinant.signum();
            *normal = turned.normalize_or_zero().as_vec3();
        }
    }
    if determinant < 0.0 {
        for vertices in &mut mesh.triangles {
            vertices.swap(1, 2);
        }
    }
}

/// True if a triangle's height over its longest side is lost in the rounding of positions.
fn is_degenerate(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    // A height of 1e-7 times the side is one rounding of `f32`.
    area_normal([a, b, c]).length() * 2.0 <= 1e-7 * longest
}

/// Normal of a triangle, with the area as its length.
fn area_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    0.5 * (b - a).cross(c - a)
}

/// [`area_normal`] of each triangle.
fn area_normals(mesh: &TriangleMesh) -> Vec<DVec3> {
    (0..mesh.triangles.len())
        .map(|t| area_normal(mesh.corners(t).map(|corner| corner.as_dvec3())))
        .collect()
}

/// For each vertex, the first vertex at the same position. -0 and 0 are the same.
fn first_vertex_at_each_place(mesh: &TriangleMesh) -> Vec<u32> {
    // Adding zero turns -0 into 0.
    let key = |v: u32| {
        (mesh.positions[v as usize] + Vec3::ZERO)
            .to_array()
            .map(f32::to_bits)
    };
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));
    let mut first = vec![0; order.len()];
    let mut current = None;
    for &vertex in &order {
        let place = match current {
            Some(leader) if key(leader) == key(vertex) => leader,
            _ => vertex,
        };
        first[vertex as usize] = place;
        current = Some(place);
    }
    first
}

/// Counts the edges at which the surface ends or branches.
fn count_edges(mesh: &TriangleMesh, report: &mut MeshReport) {
    let place = first_vertex_at_each_place(mesh);
    let mut edges = Vec::with_capacity(mesh.triangles.len() * 3);
    for vertices in &mesh.triangles {
        let [a, b, c] = vertices.map(|v| place[v as usize]);
        edges.extend([[a, b], [b, c], [c, a]].map(|[v, w]| [v.min(w), v.max(w)]));
    }
    edges.sort_unstable();
    for triangles in edges.chunk_by(|a, b| a == b) {
        report.boundary_edges += usize::from(triangles.len() == 1);
        report.non_manifold_edges += usize::from(triangles.len() > 2);
    }
}
