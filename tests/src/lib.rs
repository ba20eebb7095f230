//! What tests share: the default dictionary, levels of cells, irradiance by place; [`sequences`] of random frames,
//! checks of direct light by beams ([`beam_check`]), and [`warped`] blocks.

pub mod beam_check;
pub mod sequences;
pub mod warped;

use glam::{DVec3, Vec3};
use mrt_core::container::ByteBudget;
use mrt_core::geometry::cube::Face;
use mrt_core::reference::radiosity::{ExactScene, Side};
use mrt_runtime::BlockIndex;
use mrt_runtime::FrameConfig;
use mrt_runtime::FrameReport;
use mrt_runtime::low_level::modular::dictionary_file::DEFAULT_BYTE_BUDGET;
use mrt_runtime::shadows::Openings;
use mrt_runtime::shadows::Visibility;
use mrt_runtime::{AssembleConfig, Bounces, Dictionary, Frame, Level, Light, Scene};
use std::sync::OnceLock;

/// The committed default dictionary.
pub static DEFAULT_BYTES: &[u8] = include_bytes!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../assets/cubes-2d-standard.mrt"
));

/// The default dictionary, read once.
pub fn default_dictionary() -> &'static Dictionary {
    static DICTIONARY: OnceLock<Dictionary> = OnceLock::new();
    DICTIONARY.get_or_init(|| {
        Dictionary::from_bytes_within(DEFAULT_BYTES, &mut ByteBudget::new(DEFAULT_BYTE_BUDGET))
            .expect("the committed dictionary is sound")
    })
}

/// A level of unit cells at floor height 0, given by (x, z).
pub fn floor_plan(cells: &[[i32; 2]], albedo: f32) -> Level {
    let cells: Vec<[i32; 3]> = cells.iter().map(|&[x, z]| [x, 0, z]).collect();
    Level::from_cells(&cells, Vec3::splat(albedo)).expect("cells side by side are a level")
}

/// Cells (0, 0) to (count - 1, 0).
pub fn corridor(count: i32) -> Vec<[i32; 2]> {
    (0..count).map(|x| [x, 0]).collect()
}

/// Levels without an opening to the outside, by name.
pub fn closed_floor_plans() -> Vec<(&'static str, Vec<[i32; 2]>)> {
    let square = |n: i32| (0..n * n).map(|k| [k % n, k / n]).collect::<Vec<_>>();
    let mut t_junction = corridor(5);
    t_junction.extend([[2, 1], [2, 2]]);
    let mut ring = square(3);
    ring.retain(|&cell| cell != [1, 1]);
    vec![
        ("cube", corridor(1)),
        ("corridor of 2", corridor(2)),
        ("corridor of 5", corridor(5)),
        ("corridor of 12", corridor(12)),
        ("T-junction", t_junction),
        ("loop of 8", ring),
        ("room 2x2", square(2)),
        ("room 3x3", square(3)),
        ("room 5x5", square(5)),
    ]
}

/// The level with the default dictionary and depth.
pub fn assembled(level: &Level) -> Scene {
    Scene::assemble(level, default_dictionary(), &AssembleConfig::default())
        .expect("the level fits the dictionary")
}

/// A sphere light.
pub fn sphere(position: Vec3, radius: f32, intensity: Vec3) -> Light {
    Light::sphere(position, radius, intensity)
}

/// A new frame with the default outputs, solved with the openings' shadows.
pub fn solved(scene: &Scene, lights: &[Light], bounces: Bounces) -> Frame {
    let mut frame = Frame::new(scene, FrameConfig::default());
    frame.light_with(lights, bounces);
    frame
}

/// What tests ask of a frame, in one call.
pub trait FrameForTests {
    /// Solves for these lights alone, all of which must shine.
    fn light_with(&mut self, lights: &[Light], bounces: Bounces) -> FrameReport {
        self.light_through(lights, &Openings, bounces)
    }

    /// As [`FrameForTests::light_with`], with other shadows.
    fn light_through(
        &mut self,
        lights: &[Light],
        visibility: &impl Visibility,
        bounces: Bounces,
    ) -> FrameReport;

    /// Solves for direct light that the test computed.
    fn light_from(&mut self, direct: &[f32], bounces: Bounces) -> FrameReport;

    /// A copy of the direct irradiance of all texels.
    fn direct(&self) -> Vec<f32>;

    /// A copy of the indirect irradiance of all texels.
    fn indirect(&self) -> Vec<f32>;

    /// A copy of the coefficients b of all blocks.
    fn coefficients(&self) -> Vec<f32>;
}

impl FrameForTests for Frame {
    fn light_through(
        &mut self,
        lights: &[Light],
        visibility: &impl Visibility,
        bounces: Bounces,
    ) -> FrameReport {
        self.set_lights(lights);
        self.set_bounces(bounces);
        let report = self.solve_with(visibility);
        assert_eq!(report.skipped_lights(), [], "all lights shine");
        report
    }

    fn light_from(&mut self, direct: &[f32], bounces: Bounces) -> FrameReport {
        self.set_bounces(bounces);
        self.solve_from_direct(direct)
            .expect("the direct light is sound")
    }

    fn direct(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.copy_direct_to(&mut copy);
        copy
    }

    fn indirect(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.copy_indirect_to(&mut copy);
        copy
    }

    fn coefficients(&self) -> Vec<f32> {
        let mut copy = Vec::new();
        self.copy_coefficients_to(&mut copy);
        copy
    }
}

/// World position, metres, of a texel counted over all blocks.
pub fn position_of(scene: &Scene, texel: usize) -> Vec3 {
    scene.texel_position(texel).expect("a texel of the scene")
}

/// Unit normal of a texel counted over all blocks.
pub fn normal_of(scene: &Scene, texel: usize) -> Vec3 {
    scene.texel_normal(texel).expect("a texel of the scene")
}

/// Many bounces, to where `f32` rounding hides the next one.
pub const CONVERGED: Bounces = Bounces::Converged {
    tolerance: 1e-6,
    limit: 2000,
};

/// A signal of a frame texel by texel, channels together, block by block, wall by wall as the level names
/// its faces, row by row: the order of the references.
pub fn in_level_order(level: &Level, scene: &Scene, signal: &[f32]) -> Vec<[f32; 3]> {
    let mut out = Vec::with_capacity(signal.len() / 3);
    for (index, block) in level.blocks.iter().enumerate() {
        let range = &scene.level.blocks[index].texels;
        for face in Face::ALL.into_iter().filter(|&face| !block.is_open(face)) {
            for row in 0..scene.level.resolution {
                for column in 0..scene.level.resolution {
                    let texel = scene
                        .level
                        .level_texel(BlockIndex::new(index), face, row, column)
                        .expect("walls have texels");
                    let start = 3 * range.start + texel;
                    out.push(std::array::from_fn(|c| signal[start + c * range.len()]));
                }
            }
        }
    }
    out
}

/// A signal of a frame in the order of the scene's texels, channels together.
pub fn by_texel(scene: &Scene, signal: &[f32]) -> Vec<[f32; 3]> {
    scene
        .level
        .blocks
        .iter()
        .flat_map(|block| {
            let (start, count) = (3 * block.texels.start, block.texels.len());
            (0..count).map(move |k| std::array::from_fn(|c| signal[start + c * count + k]))
        })
        .collect()
}

/// Largest difference between two signals, over the largest value of the second.
pub fn largest_difference(ours: &[[f32; 3]], theirs: &[[f32; 3]]) -> f64 {
    assert_eq!(ours.len(), theirs.len(), "signal lengths");
    let (a, b) = (ours.as_flattened(), theirs.as_flattened());
    let largest = b.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    let apart = a
        .iter()
        .zip(b)
        .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    f64::from(apart) / f64::from(largest).max(f64::MIN_POSITIVE)
}

/// Area of every texel, m², by the scene's order.
pub fn texel_areas(scene: &Scene) -> Vec<f64> {
    let resolution = scene.level.resolution;
    let mut areas = Vec::with_capacity(scene.texel_count());
    for block in &scene.level.blocks {
        for (face, center) in block.shape.texels(resolution) {
            let half = 0.5 / resolution as f64;
            let mut along = [DVec3::ZERO; 2];
            for (side, axis) in along.iter_mut().zip([face.u_axis(), face.v_axis()]) {
                let mut step = DVec3::ZERO;
                step[axis] = half;
                *side = block.warp.point(center + step) - block.warp.point(center - step);
            }
            areas.push(along[0].cross(along[1]).length());
        }
    }
    areas
}

/// The exact solver's scene of a level of whole openings; openings without a connection lead to the sky.
pub fn exact_of(level: &Level, resolution: usize) -> ExactScene {
    let neighbours = level.neighbours();
    let sides = level
        .blocks
        .iter()
        .enumerate()
        .map(|(index, block)| {
            Face::ALL.map(|face| match neighbours[index][face.index()] {
                Some(there) => Side::Opening(there.block, there.face),
                None if block.is_open(face) => Side::Sky,
                None => Side::Wall,
            })
        })
        .collect();
    let blocks = level.blocks.iter().map(|block| block.warp).collect();
    ExactScene::new(blocks, sides, resolution).expect("the level is sound")
}

/// A connected heap of cells, grown from (0, 0) by random steps.
pub fn random_cells(random: &mut Random, count: usize) -> Vec<[i32; 2]> {
    let mut cells = vec![[0, 0]];
    while cells.len() < count {
        let [x, z] = cells[random.below(cells.len())];
        let next = [[x + 1, z], [x - 1, z], [x, z + 1], [x, z - 1]][random.below(4)];
        if !cells.contains(&next) {
            cells.push(next);
        }
    }
    cells
}

/// SplitMix64: numbers for tests that must be the same everywhere, forever.
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In 0..count.
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}
