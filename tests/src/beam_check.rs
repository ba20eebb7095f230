//! Beams of direct light against the scalar walk, texel by texel.

use crate::normal_of;
use crate::position_of;
use glam::{DVec3, Vec3};
use mrt_core::simd::SimdLevel;
use mrt_runtime::BlockIndex;
use mrt_runtime::low_level::light::beam::{Beam, BeamTracer};
use mrt_runtime::low_level::light::direct_light::add_beam::{TexelPlanes, add_beam};
use mrt_runtime::low_level::light::direct_light::{Shadows, add_exact, irradiance};
use mrt_runtime::low_level::light::placed::{PlacedLight, place};
use mrt_runtime::shadows::{Openings, Receiver, Toward, Visibility};
use mrt_runtime::{Light, Scene};

/// Share of its own irradiance that a texel may differ by.
const RELATIVE: f32 = 1e-5;

/// Share of the irradiance of a surface that faces the light that a texel may differ by: its cosine is rounded.
const OF_FACING: f32 = 1e-6;

/// Radians that the angle from a spot's axis may differ by.
const ANGLE: f32 = 2e-6;

/// A texel whose visibility flips when it moves by this much, in diagonals of its block, is on a shadow's edge.
const EDGE: f64 = 1e-5;

/// The texels of a block, by slot.
pub fn texels(scene: &Scene, block: BlockIndex) -> TexelPlanes<'_> {
    let slots = scene.layout.slots(scene.layout.rank[block.get()]);
    TexelPlanes {
        positions: scene.texels.positions.block(slots.clone()),
        normals: scene.texels.normals.block(slots),
    }
}

fn shadows<'a>(scene: &'a Scene, doors: &'a [f32]) -> Shadows<'a, Openings> {
    Shadows {
        level: &scene.level,
        doors,
        visibility: &Openings,
    }
}

/// The beams of one light; an exact one stands for all of its block.
pub fn beams(
    scene: &Scene,
    tracer: &mut BeamTracer,
    light: &PlacedLight,
    doors: &[f32],
) -> Vec<Beam> {
    let mut beams: Vec<Beam> = Vec::new();
    tracer.trace(&scene.level, 7, light, doors, &mut |beam| {
        assert_eq!(beam.light, 7);
        let of_block = |b: &&Beam| b.block == beam.block;
        assert!(
            !beams.iter().filter(of_block).any(|b| b.exact),
            "exact once"
        );
        if beam.exact {
            beams.retain(|b| b.block != beam.block);
        }
        beams.push(*beam);
    });
    beams
}

/// Irradiance at all texels from some beams, in the order of the scene's texels.
fn lit(
    level: SimdLevel,
    scene: &Scene,
    light: &PlacedLight,
    doors: &[f32],
    beams: &[Beam],
) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; scene.texel_count()];
    for beam in beams {
        let of_block = texels(scene, beam.block);
        let block = beam.block.get();
        let mut planes = [0, 1, 2].map(|_| vec![0.0; of_block.positions[0].len()]);
        let slices = planes.each_mut().map(|plane| &mut plane[..]);
        if beam.exact {
            let shadows = shadows(scene, doors);
            add_exact(shadows, beam.block, &of_block, light, slices);
        } else {
            add_beam(level, &of_block, light, beam, slices);
        }
        let folding = &scene.shapes[scene.blocks[block].shape_index].folding;
        for plane in &planes {
            let slots = plane.iter().zip(&folding.texel_of_slot);
            let mut padding = slots.filter(|(_, texel)| **texel == u32::MAX);
            assert!(padding.all(|(&e, _)| e == 0.0), "padding");
        }
        for (texel, &slot) in scene.level.blocks[block]
            .texels
            .clone()
            .zip(&folding.slot_of_texel)
        {
            let slot = slot as usize;
            out[texel] += Vec3::new(planes[0][slot], planes[1][slot], planes[2][slot]);
        }
    }
    out
}

/// What was compared.
#[derive(Debug, Default)]
pub struct Tally {
    /// Texels compared, once a light.
    pub texels: usize,
    /// Those with light.
    pub lit: usize,
    /// Those on the edge of a shadow, which may differ.
    pub edges: usize,
    /// Those whose shadows planes do not tell.
    pub exact: usize,
    /// Beams traced.
    pub beams: usize,
    /// Most planes of a beam.
    pub most_planes: usize,
}

/// Compares every texel, light and level with the reference.
pub fn compare(scene: &Scene, lights: &[Light], doors: &[f32], tally: &mut Tally) {
    let mut tracer = BeamTracer::new(&scene.level);
    for &light in lights {
        let placed = place(&scene.level, light).expect("a sound light");
        let beams = beams(scene, &mut tracer, &placed, doors);
        tally.beams += beams.len();
        tally.exact += beams.iter().filter(|b| b.exact).count();
        let planes = beams.iter().map(|b| b.planes().len());
        tally.most_planes = planes.max().unwrap_or(0).max(tally.most_planes);
        let found: Vec<Vec<Vec3>> = SimdLevel::available()
            .map(|level| lit(level, scene, &placed, doors, &beams))
            .collect();
        for (index, block) in scene.level.blocks.iter().enumerate() {
            for texel in block.texels.clone() {
                let position = position_of(scene, texel).as_dvec3();
                let normal = normal_of(scene, texel).as_dvec3();
                let at = |position: DVec3, normal: DVec3| {
                    let receiver = Receiver {
                        block: BlockIndex::new(index),
                        position,
                    };
                    irradiance(shadows(scene, doors), &placed, receiver, normal)
                };
                let expected = at(position, normal);
                let to_light = match light {
                    Light::Sphere { position: p, .. } | Light::Spot { position: p, .. } => {
                        (p.as_dvec3() - position).normalize_or_zero()
                    }
                    Light::Directional { direction, .. } => -direction.as_dvec3().normalize(),
                };
                let facing = at(position, to_light);
                let of_falloff = match light {
                    Light::Spot {
                        position: p,
                        radius,
                        intensity,
                        inner_angle,
                        outer_angle,
                        ..
                    } => {
                        let squared = p.as_dvec3().distance_squared(position) as f32;
                        let full = intensity / squared.max(radius * radius);
                        full * 1.5 * ANGLE / (outer_angle - inner_angle)
                    }
                    _ => Vec3::ZERO,
                };
                let slack = RELATIVE * expected + OF_FACING * facing + of_falloff;
                tally.texels += 1;
                tally.lit += usize::from(expected != Vec3::ZERO);
                let is_near = |found: &Vec<Vec3>| {
                    let apart = (found[texel] - expected).abs();
                    found[texel].is_finite() && apart.cmple(slack).all()
                };
                if found.iter().all(is_near) {
                    continue;
                }
                let (low, high) = block.bounds;
                let step = EDGE * (high - low).length();
                let toward = match light {
                    Light::Sphere { position, .. } | Light::Spot { position, .. } => {
                        let position = position.as_dvec3();
                        let block = scene.level.block_at(position);
                        Toward::Point {
                            position,
                            block: block.expect("placed"),
                        }
                    }
                    Light::Directional { .. } => Toward::Infinity(to_light),
                };
                let fraction = |k: i32| {
                    let offset = DVec3::new(
                        f64::from(k % 3 - 1),
                        f64::from(k / 3 % 3 - 1),
                        f64::from(k / 9 - 1),
                    );
                    let receiver = Receiver {
                        block: BlockIndex::new(index),
                        position: position + offset * step,
                    };
                    Openings.fraction(&scene.level, doors, receiver, toward)
                };
                let flips = (1..27).any(|k| fraction(k) != fraction(0));
                let values: Vec<Vec3> = found.iter().map(|f| f[texel]).collect();
                assert!(
                    flips,
                    "texel {texel} of block {index} at {position}, {light:?}: {values:?} where {expected}"
                );
                tally.edges += 1;
            }
        }
    }
}
