//! Probes: incident indirect light on a grid in every block, for moving objects (Loos et al. 2011, section 6.5).
//!
//! A probe holds spherical harmonics of incident radiance in world axes. They come from the same joint coefficients as
//! the light of the walls. Between probes, light is interpolated, across openings too.

use crate::level::block_index::BlockIndex;
use crate::level::placed::{Beyond, PlacedLevel};
use crate::output::pixel_formats::f16_bits;
use crate::output::probe_order::{PROBE_COEFFICIENTS, ProbeOrder};
use glam::{DMat3, DVec3, Vec3};
use mrt_core::geometry::cube::Face;
use mrt_core::lighting::sh;
use mrt_core::simd::{Kernel, Lanes, SimdLevel};

/// Matrices that rotate bands 1 and 2, row by row; rotation does not change band 0.
type BandRotations = [[f32; 5]; 3 + 5];

fn band_rotations(rotation: &DMat3) -> BandRotations {
    let bands = sh::rotation_matrices(3, rotation);
    let mut rows = [[0.0; 5]; 8];
    for (band, first) in [(1, 0), (2, 3)] {
        for row in 0..2 * band + 1 {
            for column in 0..2 * band + 1 {
                rows[first + row][column] = bands[band][(row, column)] as f32;
            }
        }
    }
    rows
}

/// Rotates all probes of a block: `to = bands * from`. Both are stored channel by channel, in a channel coefficient by
/// coefficient, for each coefficient probe by probe.
struct Turn<'a> {
    bands: &'a BandRotations,
    coefficients: usize,
    count: usize,
    from: &'a [f32],
    to: &'a mut [f32],
}

impl Kernel for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let whole = self.count / L::N * L::N;
        for channel in 0..3 {
            let start = channel * self.coefficients * self.count;
            let from = &self.from[start..start + self.coefficients * self.count];
            let to = &mut self.to[start..start + self.coefficients * self.count];
            to[..self.count].copy_from_slice(&from[..self.count]);
            for row in 1..self.coefficients {
                let (first, size) = if row < 4 { (1, 3) } else { (4, 5) };
                let factors = &self.bands[row - 1][..size];
                let mut probe = 0;
                while probe < whole {
                    let mut sum = l.splat(0.0);
                    for (k, &factor) in factors.iter().enumerate() {
                        let at = (first + k) * self.count + probe;
                        sum = l.mul_add(l.splat(factor), l.load(&from[at..at + L::N]), sum);
                    }
                    let at = row * self.count + probe;
                    l.store(&mut to[at..at + L::N], sum);
                    probe += L::N;
                }
                for probe in whole..self.count {
                    let mut sum = 0.0;
                    for (k, &factor) in factors.iter().enumerate() {
                        sum += factor * from[(first + k) * self.count + probe];
                    }
                    to[row * self.count + probe] = sum;
                }
            }
        }
    }
}

/// The probes of a scene after a frame.
///
/// They are stored block by block; in a block probe by probe, x fastest, then y, then z, at (i + 0.5) / n of the
/// canonical cube; in a probe coefficient by coefficient, with RGB for each.
#[derive(Clone, Debug)]
pub struct Probes {
    order: ProbeOrder,
    per_axis: usize,
    values: Vec<[f32; 3]>,
    /// Light of one block in its own axes, then in world axes; see [`Turn`] for the order.
    scratch: Vec<f32>,
    /// By block: the rotation to world axes.
    rotations: Vec<BandRotations>,
}

impl Probes {
    /// Dark probes, `per_axis`³ in each block. `world_from_probe` gives, for each block, the matrix from the axes of
    /// its probes to those of the world.
    pub(crate) fn new(
        order: ProbeOrder,
        per_axis: usize,
        world_from_probe: impl Iterator<Item = DMat3>,
    ) -> Self {
        let count = per_axis * per_axis * per_axis;
        let rotations: Vec<_> = world_from_probe.map(|r| band_rotations(&r)).collect();
        Self {
            order,
            per_axis,
            values: vec![[0.0; 3]; rotations.len() * count * order.coefficients()],
            scratch: vec![0.0; 6 * count * order.coefficients()],
            rotations,
        }
    }

    /// Order of each probe, which gives its number of coefficients.
    pub fn order(&self) -> ProbeOrder {
        self.order
    }

    /// Probes along an edge of a block.
    pub fn per_axis(&self) -> usize {
        self.per_axis
    }

    /// All coefficients, W/(m² sr) times the square root of steradian; see [`Probes`] for their order.
    pub fn values(&self) -> &[[f32; 3]] {
        &self.values
    }

    /// The part of [`Probes::values`] of one block; empty if there is no such block.
    pub fn of_block(&self, block: BlockIndex) -> &[[f32; 3]] {
        let size = self.per_axis.pow(3) * self.order.coefficients();
        let start = block.get().saturating_mul(size);
        self.values
            .get(start..start.saturating_add(size))
            .unwrap_or(&[])
    }

    /// Writes all coefficients, in the same order, as bits of half-precision numbers for a texture. Values beyond
    /// ±65,504 become ±65,504. The content of `out` is replaced.
    pub fn write_f16(&self, out: &mut Vec<[u16; 3]>) {
        out.clear();
        out.extend(self.values.iter().map(|value| value.map(f16_bits)));
    }

    /// Sets all probes to 0.
    pub(crate) fn darken(&mut self) {
        self.values.fill([0.0; 3]);
    }

    /// Replaces the probes of one block. `expand` writes their light in the block's own axes: for each channel
    /// coefficient by coefficient, for each coefficient probe by probe.
    pub(crate) fn update(
        &mut self,
        block: BlockIndex,
        simd: SimdLevel,
        expand: impl FnOnce([&mut [f32]; 3]),
    ) {
        let count = self.per_axis * self.per_axis * self.per_axis;
        let kept = self.order.coefficients();
        let (canonical, turned) = self.scratch.split_at_mut(3 * kept * count);
        let (red, rest) = canonical.split_at_mut(kept * count);
        let (green, blue) = rest.split_at_mut(kept * count);
        expand([red, green, blue]);
        simd.run(Turn {
            bands: &self.rotations[block.get()],
            coefficients: kept,
            count,
            from: canonical,
            to: turned,
        });
        let size = count * kept;
        let out = &mut self.values[block.get() * size..(block.get() + 1) * size];
        for (probe, out) in out.chunks_exact_mut(kept).enumerate() {
            for (k, out) in out.iter_mut().enumerate() {
                for (channel, out) in out.iter_mut().enumerate() {
                    *out = turned[(channel * kept + k) * count + probe];
                }
            }
        }
    }

    /// Light at a world position, metres: trilinear between the eight probes around it, those of joined blocks
    /// included; `None` outside all blocks. Coefficients beyond the order of the probes are zero. Doors count as open:
    /// within half the spacing of probes from a door, the result mixes the light of both sides.
    pub fn at(&self, level: &PlacedLevel, point: DVec3) -> Option<[[f32; 3]; PROBE_COEFFICIENTS]> {
        let block = level.block_at(point)?;
        let unit = level.block(block)?.warp.inverse(point)?;
        let place = unit * self.per_axis as f64 - 0.5;
        let low = place.floor();
        let weight = place - low;
        let mut sum = [[0.0f32; 3]; PROBE_COEFFICIENTS];
        for corner in 0..8 {
            let bits = DVec3::new(
                f64::from(corner & 1),
                f64::from(corner >> 1 & 1),
                f64::from(corner >> 2 & 1),
            );
            let share = bits * weight + (DVec3::ONE - bits) * (DVec3::ONE - weight);
            let share = share.element_product() as f32;
            for (sum, value) in sum.iter_mut().zip(self.probe(level, block, low + bits)) {
                for (sum, x) in sum.iter_mut().zip(value) {
                    *sum += share * x;
                }
            }
        }
        Some(sum)
    }

    /// The probe at a position of a block's grid. One step outside the grid, it is the neighbour's probe across an
    /// opening, or the nearest probe inside at a wall.
    fn probe(&self, level: &PlacedLevel, block: BlockIndex, place: DVec3) -> &[[f32; 3]] {
        let n = self.per_axis as f64;
        let mut block = block;
        let mut point = (place + 0.5) / n;
        for _ in 0..3 {
            let outside = Face::ALL.into_iter().find(|face| {
                let along = point[face.axis()];
                if face.is_positive() {
                    along > 1.0
                } else {
                    along < 0.0
                }
            });
            let Some(face) = outside else { break };
            match level.blocks[block.get()].beyond[face.index()] {
                Beyond::Block {
                    block: next,
                    here_from_there,
                    ..
                } if level.blocks[block.get()].shape.is_open(face) => {
                    point = here_from_there.inverse().point(point - face.outward());
                    block = next;
                }
                _ => point[face.axis()] = point[face.axis()].clamp(0.5 / n, 1.0 - 0.5 / n),
            }
        }
        let index = |x: f64| (x * n).floor().clamp(0.0, n - 1.0) as usize;
        let (x, y, z) = (index(point.x), index(point.y), index(point.z));
        let probe = (z * self.per_axis + y) * self.per_axis + x;
        let count = self.per_axis * self.per_axis * self.per_axis;
        let kept = self.order.coefficients();
        &self.values[(block.get() * count + probe) * kept..][..kept]
    }
}

/// Irradiance, W/m², on a surface of unit `normal` under a probe's light. Where truncation makes it negative, the
/// result is 0.
pub fn irradiance_from_probe(coefficients: &[[f32; 3]], normal: Vec3) -> Vec3 {
    let channel = |c: usize| {
        let mut radiance = [0.0f32; PROBE_COEFFICIENTS];
        for (to, from) in radiance.iter_mut().zip(coefficients) {
            *to = from[c];
        }
        sh::irradiance(&radiance, normal.as_dvec3()).max(0.0) as f32
    };
    Vec3::new(channel(0), channel(1), channel(2))
}
