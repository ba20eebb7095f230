//! The public cases of glTF, as far as a mesh as its file has it goes.

use crate::import::error::ImportError;
use crate::import::gltf::read;
use crate::import::raw_mesh::{LampKind, RawMesh};
use glam::{DVec3, Vec3};
use mrt_core::reference::oracle_file::ground_truth_folder;

fn read_case(name: &str) -> Result<RawMesh, ImportError> {
    let folder = ground_truth_folder("cases").expect("the folder of cases");
    let path = folder.join(name);
    read(&path, &std::fs::read(&path).expect("a case"))
}

fn bounds(mesh: &RawMesh) -> [DVec3; 2] {
    let low = mesh.positions.iter().copied().reduce(DVec3::min);
    let high = mesh.positions.iter().copied().reduce(DVec3::max);
    [low.expect("positions"), high.expect("positions")]
}

/// Volume inside, by the divergence theorem; positive if all triangles face inwards.
fn inward_volume(mesh: &RawMesh) -> f64 {
    let volume = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        -a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(volume).sum()
}

/// A closed room of 4 x 3 x 4 m that is seen from inside.
fn assert_room(name: &str, mesh: &RawMesh, tolerance: f64) {
    assert_eq!(mesh.triangles.len(), 12, "{name}");
    let [low, high] = bounds(mesh);
    assert!(low.distance(DVec3::ZERO) <= tolerance, "{name}: {low}");
    assert!(
        high.distance(DVec3::new(4.0, 3.0, 4.0)) <= tolerance,
        "{name}: {high}"
    );
    // 48 m³, to within the tolerance along each axis.
    let volume = inward_volume(mesh);
    assert!(
        (volume - 48.0).abs() <= 40.0 * tolerance + 1e-12,
        "{name}: {volume}"
    );
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn rooms_are_closed_and_face_inwards_however_they_are_stored() {
    for name in [
        "06-triangle-strips/wall-strip.glb",
        "06-triangle-strips/all-strips.glb",
        "07-required-extensions/basisu.glb",
        "08-gltf-json/embedded.gltf",
        "08-gltf-json/external.gltf",
        "08-gltf-json/empty-second-scene.glb",
        "09-textures/brick.glb",
        "19-ignored-content/emissive.glb",
        "19-ignored-content/light.glb",
        "19-ignored-content/vertex-colours.glb",
    ] {
        assert_room(name, &read_case(name).expect(name), 0.0);
    }
    let name = "07-required-extensions/quantized-u16.glb";
    assert_room(name, &read_case(name).expect(name), 1e-4);
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn a_mirrored_half_closes_the_hall() {
    let mesh = read_case("05-mirrored-node/half-mirrored.glb").expect("reads");
    assert_eq!(mesh.triangles.len(), 20);
    assert_eq!(
        bounds(&mesh),
        [DVec3::new(-4.0, 0.0, 0.0), DVec3::new(4.0, 3.0, 4.0)]
    );
    // A hall of 8 x 3 x 4 m whose triangles all face inwards; without the turn the halves cancel out.
    assert_eq!(inward_volume(&mesh), 96.0);
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn instances_colours_emission_lamps_and_images_are_read() {
    let read = |name: &str| read_case(name).expect(name);
    let mesh = read("19-ignored-content/instancing.glb");
    assert_eq!((mesh.triangles.len(), inward_volume(&mesh)), (24, 96.0));
    assert_eq!(bounds(&mesh)[1], DVec3::new(14.0, 3.0, 4.0));
    let mesh = read("19-ignored-content/vertex-colours.glb");
    assert_eq!(mesh.colours, [Vec3::new(0.8, 0.1, 0.1); 24]);
    let mesh = read("19-ignored-content/emissive.glb");
    assert_eq!(mesh.paints[0].emission, Vec3::splat(10.0));
    let lamps = read("19-ignored-content/light.glb").lamps;
    assert_eq!((lamps.len(), lamps[0].kind), (1, LampKind::Point));
    assert_eq!(
        (lamps[0].position, lamps[0].intensity),
        (DVec3::splat(2.0), Vec3::splat(40.0))
    );
    let mesh = read("09-textures/brick.glb");
    assert_eq!(mesh.images[0].bytes.len(), 73);
    assert_eq!(mesh.paints[0].image.map(|image| image.image), Some(0));
    assert_eq!(
        (mesh.corner_uvs.len(), mesh.paints[0].colour),
        (12, Some(Vec3::ONE))
    );
}

#[cfg_attr(not(has_cases), ignore = "the folder of cases is not there")]
#[test]
fn what_cannot_be_read_says_why() {
    for (name, expected) in [
        (
            "07-required-extensions/draco.glb",
            "compressed with KHR_draco_mesh_compression, which is not supported; export",
        ),
        (
            "20-hostile/glb-panic-position-index.glb",
            "meshes[0].primitives[0]: accessor 0 of 0",
        ),
        (
            "20-hostile/positions-bomb.glb",
            "at most 50,000,000 positions",
        ),
    ] {
        let error = read_case(name).expect_err(name).to_string();
        assert!(
            error.contains(expected) && !error.contains("invalid"),
            "{error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
