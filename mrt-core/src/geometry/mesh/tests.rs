use super::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// The closed unit cube: two triangles a side, normals outwards.
fn cube() -> TriangleMesh {
    let corner = |k: u32| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2 & 1) as f32);
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    TriangleMesh::from_triangles((0..8).map(corner).collect(), triangles)
}

#[test]
fn cleaning_changes_nothing_in_a_closed_cube() {
    let (cleaned, report) = clean(&cube()).unwrap();
    assert_eq!(cleaned, cube());
    assert_eq!(report, MeshReport::default());
    assert_eq!(areas(&cleaned).iter().sum::<f64>(), 6.0);
    for (triangle, normal) in face_normals(&cleaned).into_iter().enumerate() {
        let center = cleaned.corners(triangle).iter().sum::<Vec3>() / 3.0;
        assert!((center - Vec3::splat(0.5)).dot(normal) > 0.49);
    }
    assert_eq!(bounds(&cleaned), Some([Vec3::ZERO, Vec3::ONE]));
    assert_eq!(bounds(&TriangleMesh::default()), None);
}

#[test]
fn every_kind_of_fault_is_dropped_and_counted() {
    let mut mesh = cube();
    mesh.positions.insert(0, Vec3::splat(9.0));
    for vertex in mesh.triangles.iter_mut().flatten() {
        *vertex += 1;
    }
    mesh.positions.push(Vec3::new(f32::NAN, 0.0, 0.0));
    mesh.positions.push(Vec3::new(0.0, f32::NEG_INFINITY, 0.0));
    mesh.positions.push(Vec3::splat(0.1));
    mesh.positions.push(Vec3::splat(0.3));
    // Two triangles with a bad vertex, one that repeats a vertex, one whose corners are in line up to
    // rounding, and a fin on an edge of the cube and a diagonal of a side.
    mesh.triangles
        .extend([[1, 2, 9], [10, 2, 3], [4, 4, 5], [1, 11, 12], [1, 2, 8]]);
    mesh.triangle_materials.resize(17, 0);
    let (cleaned, report, kept) = clean_and_trace(&mesh).unwrap();
    let position = |&v: &u32| mesh.positions[v as usize];
    assert!(
        kept.vertices
            .iter()
            .map(position)
            .eq(cleaned.positions.iter().copied())
    );
    for (triangle, &source) in kept.triangles.iter().enumerate() {
        assert_eq!(cleaned.corners(triangle), mesh.corners(source as usize));
    }
    assert_eq!(kept.triangles.len(), cleaned.triangles.len());
    let expected = MeshReport {
        not_finite_vertices: 2,
        not_finite_triangles: 2,
        degenerate_triangles: 2,
        unused_vertices: 3,
        invalid_normals: 0,
        non_manifold_edges: 2,
        boundary_edges: 1,
    };
    assert_eq!(report, expected);
    assert_eq!(cleaned.positions, cube().positions);
    assert_eq!(cleaned.triangles[..12], cube().triangles);
    assert_eq!(cleaned.triangles[12..], [[0, 1, 7]]);
    let (again, second_report) = clean(&cleaned).unwrap();
    assert_eq!(again, cleaned);
    assert_eq!(second_report.degenerate_triangles, 0);
}

#[test]
fn normals_are_brought_to_unit_length_or_dropped() {
    let mut mesh = cube();
    mesh.normals = Some(vec![Vec3::new(0.0, 3.0, 0.0); 8]);
    let (cleaned, report) = clean(&mesh).unwrap();
    assert_eq!(cleaned.normals, Some(vec![Vec3::Y; 8]));
    assert_eq!(report.invalid_normals, 0);
    for bad in [Vec3::ZERO, Vec3::splat(f32::NAN)] {
        let mut normals = vec![Vec3::Y; 8];
        normals[3] = bad;
        mesh.normals = Some(normals);
        let (cleaned, report) = clean(&mesh).unwrap();
        assert_eq!((cleaned.normals, report.invalid_normals), (None, 1));
    }
}

#[test]
fn meshes_that_are_not_valid_are_refused_by_name() {
    let mut mesh = cube();
    mesh.triangles[3][1] = 8;
    let expected = MeshError::VertexOutOfRange {
        triangle: 3,
        found: 8,
        vertex_count: 8,
    };
    assert_eq!(clean(&mesh), Err(expected));
    let mut mesh = cube();
    mesh.triangle_materials[2] = 1;
    assert!(matches!(
        check(&mesh),
        Err(MeshError::MaterialOutOfRange { triangle: 2, .. })
    ));
    let mut mesh = cube();
    mesh.triangle_materials.pop();
    assert!(matches!(
        check(&mesh),
        Err(MeshError::WrongLength { expected: 12, .. })
    ));
    let mut mesh = cube();
    mesh.normals = Some(vec![Vec3::Y; 7]);
    assert!(matches!(
        check(&mesh),
        Err(MeshError::WrongLength { found: 7, .. })
    ));
    for albedo in [1.01, -0.1, f32::NAN] {
        let mut mesh = cube();
        mesh.materials[0].albedo.y = albedo;
        assert!(matches!(
            check(&mesh),
            Err(MeshError::AlbedoOutOfRange { .. })
        ));
    }
}

#[test]
fn an_open_cube_has_a_boundary_and_a_seam_of_split_vertices_has_none() {
    let mut open = cube();
    open.triangles.truncate(10);
    open.triangle_materials.truncate(10);
    assert_eq!(clean(&open).unwrap().1.boundary_edges, 4);
    let split = with_smooth_normals(&cube(), 0.0);
    assert_eq!(split.positions.len(), 24);
    assert_eq!(clean(&split).unwrap().1, MeshReport::default());
}

#[test]
fn the_crease_angle_separates_flat_from_smooth() {
    let flat = with_smooth_normals(&cube(), FRAC_PI_2 - 0.01);
    let faces = face_normals(&flat);
    for (vertices, face) in flat.triangles.iter().zip(faces) {
        for &vertex in vertices {
            assert_eq!(flat.normals.as_ref().unwrap()[vertex as usize], face);
        }
    }
    let smooth = with_smooth_normals(&cube(), PI);
    assert_eq!(smooth.positions.len(), 8);
    // At every corner of the cube meet one or two triangles of equal area from each of three sides.
    for (normal, position) in smooth.normals.unwrap().iter().zip(&smooth.positions) {
        let outward = (*position - Vec3::splat(0.5)).normalize();
        assert!(normal.dot(outward) > 0.9, "{normal} at {position}");
    }
}

#[test]
fn smooth_normals_are_weighted_by_area() {
    // Two triangles share an edge at a right angle. One has three times the area of the other.
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 3.0, 0.0), Vec3::Z];
    let mesh = TriangleMesh::from_triangles(positions, vec![[0, 1, 2], [0, 3, 1]]);
    let normals = corner_normals(&mesh, PI);
    let expected = Vec3::new(0.0, 1.0, 3.0).normalize();
    assert!((normals[0][0] - expected).length() < 1e-7);
    assert_eq!(normals[0][2], Vec3::Z);
}

#[test]
fn transforms_keep_the_outside_outside() {
    let mirror = DAffine3::from_scale(DVec3::new(-2.0, 1.0, 3.0));
    let axes = DAffine3::from_mat3(Y_UP_FROM_Z_UP);
    for change in [mirror, axes, axes * mirror] {
        let mut mesh = with_smooth_normals(&cube(), 0.0);
        transform(&mut mesh, &change);
        let faces = face_normals(&mesh);
        let center = change.transform_point3(DVec3::splat(0.5)).as_vec3();
        for (triangle, face) in faces.into_iter().enumerate() {
            assert!((mesh.corners(triangle)[0] - center).dot(face) > 0.0);
            let vertex = mesh.triangles[triangle][0] as usize;
            assert!((mesh.normals.as_ref().unwrap()[vertex] - face).length() < 1e-6);
        }
    }
    assert_eq!(Y_UP_FROM_Z_UP * DVec3::Z, DVec3::Y);
    assert_eq!(Y_UP_FROM_Z_UP.determinant(), 1.0);
}
