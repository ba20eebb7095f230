//! Compares beams of direct light with the scalar walk through openings, texel by texel.

use crate::irradiance::{normal_of, position_of};
use glam::{DVec3, Vec3};
use mrt_core::simd::SimdLevel;
use mrt_runtime::BlockIndex;
use mrt_runtime::low_level::light::beam::{Beam, BeamTracer};
use mrt_runtime::low_level::light::direct_light::add_beam::{TexelPlanes, add_beam};
use mrt_runtime::low_level::light::direct_light::{Shadows, add_exact, irradiance};
use mrt_runtime::low_level::light::placed::{PlacedLight, place};
use mrt_runtime::shadows::{Openings, Receiver, Toward, Visibility};
use mrt_runtime::{Light, Scene};

/// Tolerated difference of a texel's irradiance, relative to that irradiance.
const RELATIVE: f32 = 1e-5;

/// Tolerated difference of a texel's irradiance, relative to that of a surface which faces the light: the cosine is
/// rounded.
const OF_FACING: f32 = 1e-6;

/// Tolerated difference of the angle from a spot's axis, radians.
const ANGLE: f32 = 2e-6;

/// Share of its block's diagonal by which a texel is moved. If its visibility flips, it is on the edge of a shadow.
const EDGE: f64 = 1e-5;

/// Positions and normals of a block's texels, by slot.
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

/// The beams of one light. An exact beam replaces all other beams of its block.
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

/// Irradiance of all texels from these beams, in the order of the scene's texels.
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

/// Counts of what was compared.
#[derive(Debug, Default)]
pub struct Tally {
    /// Texels compared, counted once for each light.
    pub texels: usize,
    /// Texels with light.
    pub lit: usize,
    /// Texels on the edge of a shadow that differ, as they may.
    pub edges: usize,
    /// Exact beams: the planes of a beam cannot describe the shadows in their blocks.
    pub exact: usize,
    /// Beams traced.
    pub beams: usize,
    /// Largest number of planes of a beam.
    pub most_planes: usize,
}

impl Tally {
    fn count_beams(&mut self, beams: &[Beam]) {
        self.beams += beams.len();
        self.exact += beams.iter().filter(|b| b.exact).count();
        let planes = beams.iter().map(|b| b.planes().len());
        self.most_planes = planes.max().unwrap_or(0).max(self.most_planes);
    }
}

/// Compares the irradiance that beams give with that of the walk, for every light, texel and instruction set.
pub fn compare(scene: &Scene, lights: &[Light], doors: &[f32], tally: &mut Tally) {
    let mut tracer = BeamTracer::new(&scene.level);
    for &light in lights {
        let placed = place(&scene.level, light).expect("a sound light");
        let beams = beams(scene, &mut tracer, &placed, doors);
        tally.count_beams(&beams);
        let found: Vec<Vec<Vec3>> = SimdLevel::available()
            .map(|level| lit(level, scene, &placed, doors, &beams))
            .collect();
        let walk = Walk {
            scene,
            doors,
            light,
            placed,
        };
        for (index, block) in scene.level.blocks.iter().enumerate() {
            for texel in block.texels.clone() {
                let receiver = Receiver {
                    block: BlockIndex::new(index),
                    position: position_of(scene, texel).as_dvec3(),
                };
                let found: Vec<Vec3> = found.iter().map(|found| found[texel]).collect();
                walk.compare_texel(receiver, texel, &found, tally);
            }
        }
    }
}

/// The scalar walk from texels to one light.
struct Walk<'a> {
    scene: &'a Scene,
    doors: &'a [f32],
    light: Light,
    placed: PlacedLight,
}

impl Walk<'_> {
    /// Compares the irradiance that each instruction set found at a texel.
    fn compare_texel(&self, receiver: Receiver, texel: usize, found: &[Vec3], tally: &mut Tally) {
        let normal = normal_of(self.scene, texel).as_dvec3();
        let expected = self.irradiance(receiver, normal);
        let slack = self.slack(receiver, expected);
        tally.texels += 1;
        tally.lit += usize::from(expected != Vec3::ZERO);
        let is_near = |found: &Vec3| {
            let apart = (found - expected).abs();
            found.is_finite() && apart.cmple(slack).all()
        };
        if found.iter().all(is_near) {
            return;
        }
        let Receiver { block, position } = receiver;
        assert!(
            self.is_on_edge(receiver),
            "texel {texel} of block {block:?} at {position}, {:?}: {found:?} where {expected}",
            self.light
        );
        tally.edges += 1;
    }

    fn irradiance(&self, receiver: Receiver, normal: DVec3) -> Vec3 {
        irradiance(
            shadows(self.scene, self.doors),
            &self.placed,
            receiver,
            normal,
        )
    }

    /// Direction from a point to the light; zero in the light's very position.
    fn to_light(&self, point: DVec3) -> DVec3 {
        match self.light {
            Light::Sphere { position, .. } | Light::Spot { position, .. } => {
                (position.as_dvec3() - point).normalize_or_zero()
            }
            Light::Directional { direction, .. } => -direction.as_dvec3().normalize(),
        }
    }

    /// Tolerated difference of a texel's irradiance.
    fn slack(&self, receiver: Receiver, expected: Vec3) -> Vec3 {
        let facing = self.irradiance(receiver, self.to_light(receiver.position));
        let of_falloff = match self.light {
            Light::Spot {
                position,
                radius,
                intensity,
                inner_angle,
                outer_angle,
                ..
            } => {
                let squared = position.as_dvec3().distance_squared(receiver.position) as f32;
                let full = intensity / squared.max(radius * radius);
                full * 1.5 * ANGLE / (outer_angle - inner_angle)
            }
            _ => Vec3::ZERO,
        };
        RELATIVE * expected + OF_FACING * facing + of_falloff
    }

    /// True if a small move of the receiver hides the light or uncovers it.
    fn is_on_edge(&self, receiver: Receiver) -> bool {
        let level = &self.scene.level;
        let toward = match self.light {
            Light::Sphere { position, .. } | Light::Spot { position, .. } => {
                let position = position.as_dvec3();
                let block = level.block_at(position).expect("the light is inside");
                Toward::Point { position, block }
            }
            Light::Directional { .. } => Toward::Infinity(self.to_light(receiver.position)),
        };
        let (low, high) = level.blocks[receiver.block.get()].bounds;
        let step = EDGE * (high - low).length();
        let fraction = |k: i32| {
            let offset = DVec3::new(
                f64::from(k % 3 - 1),
                f64::from(k / 3 % 3 - 1),
                f64::from(k / 9 - 1),
            );
            let moved = Receiver {
                position: receiver.position + offset * step,
                ..receiver
            };
            Openings.fraction(level, self.doors, moved, toward)
        };
        (1..27).any(|k| fraction(k) != fraction(0))
    }
}
