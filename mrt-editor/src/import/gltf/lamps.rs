//! Lamps of KHR_lights_punctual.

use super::document::{Document, Light};
use super::fault::Fault;
use super::nodes::PlacedNode;
use crate::import::limits::MAX_LAMPS;
use crate::import::raw_mesh::{LampKind, RawLamp, RawMesh};
use glam::{DVec3, Vec3};
use std::f64::consts::FRAC_PI_4;

/// Adds the lamp of a node, if it has one.
pub(super) fn add(
    document: &Document,
    placed: &PlacedNode,
    mesh: &mut RawMesh,
) -> Result<(), Fault> {
    let extensions = document.nodes[placed.node].extensions.as_ref();
    let Some(of_node) = extensions.and_then(|e| e.light.as_ref()) else {
        return Ok(());
    };
    let place = format!("nodes[{}]", placed.node);
    let lights = document.extensions.lights.as_ref();
    let lights = lights.map_or(&[][..], |l| &l.lights);
    let light = lights
        .get(of_node.light)
        .ok_or_else(|| Fault::index(&place, "light", of_node.light, lights.len()))?;
    let lamp = lamp(light, placed);
    let is_finite = |l: &RawLamp| l.position.is_finite() && l.intensity.is_finite();
    let Some(lamp) = lamp.filter(is_finite) else {
        let kind = "lamps of unknown kinds or without finite numbers";
        *mesh.ignored.entry(kind.to_owned()).or_default() += 1;
        return Ok(());
    };
    if mesh.lamps.len() == MAX_LAMPS {
        return Err(Fault::at(place, "at most 4096 lamps"));
    }
    mesh.lamps.push(lamp);
    Ok(())
}

/// `None` for kinds that the extension does not have.
fn lamp(light: &Light, placed: &PlacedNode) -> Option<RawLamp> {
    let kind = match light.kind.as_str() {
        "point" => LampKind::Point,
        "directional" => LampKind::Sun,
        "spot" => {
            let angles = light.spot.as_ref();
            let inner = angles.and_then(|spot| spot.inner_cone_angle);
            let outer = angles.and_then(|spot| spot.outer_cone_angle);
            LampKind::Spot {
                inner_angle: inner.unwrap_or(0.0) as f32,
                outer_angle: outer.unwrap_or(FRAC_PI_4) as f32,
            }
        }
        _ => return None,
    };
    let world_from_node = &placed.world_from_node;
    let axis = world_from_node.transform_vector3(DVec3::NEG_Z);
    let colour = Vec3::from_array(light.color.unwrap_or([1.0; 3]).map(|c| c as f32));
    let intensity = colour * light.intensity.unwrap_or(1.0) as f32;
    Some(RawLamp {
        kind,
        position: world_from_node.translation,
        direction: axis.try_normalize().unwrap_or(DVec3::NEG_Z),
        intensity: intensity.max(Vec3::ZERO),
    })
}
