//! Slots: a shape's texels sorted by their images under its mirrors.

use crate::level::mirrors::{mirrors, texel_permutation};
use crate::level::shape::Shape;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::simd::{Aligned, WIDEST};
use std::cmp::Reverse;

/// An operator's numbers at mirrored texels may differ by this much of the largest of its mode and count as equal: far
/// less than what `f32` sums lose.
const SYMMETRY_TOLERANCE: f32 = 1e-6;

/// Where each texel of a shape is kept: slot `element * stride + orbit`, for each element of the group that the mirrors
/// make, and each orbit of texels under it.
///
/// Element bit k says that mirror k was applied. Modes are even or odd under each mirror, class bit k saying odd under
/// mirror k, so sums over an orbit split into one a class, and a mode needs numbers for one texel of each orbit.
/// A texel on a mirror's plane takes two slots, which always hold the same. Where orbits are so few that they mostly are
/// padding, some of the mirrors are left out.
#[derive(Clone, Debug)]
pub struct Folding {
    /// Number of mirrors, 0 to 3.
    pub mirrors: usize,
    /// Which of them exchanges floor and ceiling, if one does.
    pub up_mirror: Option<usize>,
    /// Orbits, rounded up to a multiple of [`WIDEST`].
    pub stride: usize,
    /// By texel in the shape's order.
    pub slot_of_texel: Vec<u32>,
    /// By slot; `u32::MAX` where there is no texel.
    pub texel_of_slot: Vec<u32>,
    /// By orbit: texels over elements of the group. Sums over slots count texels of mirrors' planes twice.
    pub multiplicity: Aligned<f32>,
    /// By orbit: multiplicity times the area of its texels, over that of a cube's texel.
    pub weight: Aligned<f32>,
}

/// Multiply-adds that take as long as all else that is done with a slot: sums and differences both ways, loads and
/// stores. Measured on x86-64, where 6 and 10 choose alike but for straight blocks at 6²: these are slower at 6.
const SLOT_COST: usize = 10;

/// A mirror that a shape and its operators have.
struct Mirror {
    /// Whether it exchanges floor and ceiling.
    is_up: bool,
    /// By texel: its image.
    permutation: Vec<u32>,
    /// Whether modes are odd.
    coefficients: Vec<bool>,
    joint: Vec<bool>,
}

impl Mirror {
    /// `None` if the texels' areas or a mode of the operators do not have the mirror.
    fn of_operators(
        is_up: bool,
        permutation: Vec<u32>,
        (coefficients, joint): (&Matrix<f32>, &Matrix<f32>),
        areas: &[f32],
    ) -> Option<Self> {
        let area = |k: usize| areas.get(k).copied().unwrap_or(1.0);
        let has_same_areas = (0..joint.rows()).all(|k| {
            let other = area(permutation[k] as usize);
            (area(k) - other).abs() <= SYMMETRY_TOLERANCE * other
        });
        if !has_same_areas {
            return None;
        }
        let coefficients = (0..coefficients.rows())
            .map(|mode| parity(&permutation, |texel| coefficients[(mode, texel)]))
            .collect::<Option<_>>()?;
        let joint = (0..joint.columns())
            .map(|mode| parity(&permutation, |texel| joint[(texel, mode)]))
            .collect::<Option<_>>()?;
        Some(Self {
            is_up,
            permutation,
            coefficients,
            joint,
        })
    }
}

/// The class of each mode of a shape's operators.
#[derive(Clone, Debug)]
pub(crate) struct Classes {
    pub coefficients: Vec<u8>,
    pub joint: Vec<u8>,
}

impl Folding {
    /// By the mirrors that the shape and these operators have: modes x texels, and texels x joint modes.
    pub(crate) fn new(
        shape: &Shape,
        resolution: usize,
        coefficients: &Matrix<f32>,
        joint: &Matrix<f32>,
        areas: &[f32],
    ) -> (Self, Classes) {
        let texels = joint.rows();
        let mut classes = Classes {
            coefficients: vec![0; coefficients.rows()],
            joint: vec![0; joint.columns()],
        };
        let candidates = if shape.tube().is_some() {
            Vec::new()
        } else {
            mirrors(shape)
        };
        let mirror = |map| {
            let permutation = texel_permutation(shape, resolution, map);
            let is_up = map == CubeSymmetry::mirror(1);
            Mirror::of_operators(is_up, permutation, (coefficients, joint), areas)
        };
        let found: Vec<Mirror> = candidates.into_iter().filter_map(mirror).collect();
        let folded = |subset: usize| {
            let bits = (0..found.len()).filter(move |k| subset >> k & 1 == 1);
            let permutations = bits.clone().map(|k| &found[k].permutation[..]).collect();
            (Self::by_mirrors(texels, permutations, areas), bits)
        };
        let modes = coefficients.rows() + joint.columns();
        // Tiles need the mirror between floor and ceiling.
        let (folding, bits) = (0..1usize << found.len())
            .filter(|subset| (0..found.len()).all(|k| !found[k].is_up || subset >> k & 1 == 1))
            .map(folded)
            .min_by_key(|(folding, _)| (folding.cost(modes), Reverse(folding.mirrors)))
            .expect("the subset of all mirrors");
        let up_mirror = bits.clone().position(|k| found[k].is_up);
        for (bit, k) in bits.enumerate() {
            let add = |classes: &mut [u8], is_odd: &[bool]| {
                for (class, &is_odd) in classes.iter_mut().zip(is_odd) {
                    *class |= u8::from(is_odd) << bit;
                }
            };
            add(&mut classes.coefficients, &found[k].coefficients);
            add(&mut classes.joint, &found[k].joint);
        }
        let folding = Self {
            up_mirror,
            ..folding
        };
        (folding, classes)
    }

    /// What a block costs: multiply-adds of so many modes, and work on slots, in units of a number a channel.
    fn cost(&self, modes: usize) -> usize {
        self.stride * modes + self.slots() * SLOT_COST
    }

    fn by_mirrors(texels: usize, permutations: Vec<&[u32]>, areas: &[f32]) -> Self {
        let elements = 1usize << permutations.len();
        let image = |element: usize, texel: usize| {
            (0..permutations.len())
                .filter(|k| element >> k & 1 == 1)
                .fold(texel, |at, k| permutations[k][at] as usize)
        };
        let mut orbit_of_texel = vec![u32::MAX; texels];
        let mut firsts: Vec<usize> = Vec::new();
        for texel in 0..texels {
            if orbit_of_texel[texel] == u32::MAX {
                for element in 0..elements {
                    orbit_of_texel[image(element, texel)] = firsts.len() as u32;
                }
                firsts.push(texel);
            }
        }
        let stride = firsts.len().next_multiple_of(WIDEST);
        let mut folding = Self {
            mirrors: permutations.len(),
            up_mirror: None,
            stride,
            slot_of_texel: vec![u32::MAX; texels],
            texel_of_slot: vec![u32::MAX; elements * stride],
            multiplicity: Aligned::zeroed(stride),
            weight: Aligned::zeroed(stride),
        };
        for (orbit, &first) in firsts.iter().enumerate() {
            let mut distinct = 0;
            for element in 0..elements {
                let (texel, slot) = (image(element, first), element * stride + orbit);
                folding.texel_of_slot[slot] = texel as u32;
                if folding.slot_of_texel[texel] == u32::MAX {
                    folding.slot_of_texel[texel] = slot as u32;
                    distinct += 1;
                }
            }
            folding.multiplicity[orbit] = distinct as f32 / elements as f32;
            let area = areas.get(first).copied().unwrap_or(1.0);
            folding.weight[orbit] = folding.multiplicity[orbit] * area;
        }
        folding
    }

    /// Elements of the group, and number of classes.
    pub fn elements(&self) -> usize {
        1 << self.mirrors
    }

    /// Slots of a block.
    pub fn slots(&self) -> usize {
        self.elements() * self.stride
    }

    /// The texel that an orbit's numbers are those of, if there is such an orbit.
    pub(crate) fn first(&self, orbit: usize) -> Option<usize> {
        match self.texel_of_slot[orbit] {
            u32::MAX => None,
            texel => Some(texel as usize),
        }
    }
}

/// Whether a signal is odd under a mirror; `None` if it is neither odd nor even.
fn parity(permutation: &[u32], signal: impl Fn(usize) -> f32) -> Option<bool> {
    let texels = || 0..permutation.len();
    let largest = texels().fold(0.0f32, |m, k| m.max(signal(k).abs()));
    let is = |sign: f32| {
        texels().all(|k| {
            let apart = signal(k) - sign * signal(permutation[k] as usize);
            apart.abs() <= SYMMETRY_TOLERANCE * largest
        })
    };
    if is(1.0) {
        Some(false)
    } else if is(-1.0) {
        Some(true)
    } else {
        None
    }
}
