//! Slots: the texels of a shape, sorted by their images under the shape's mirrors.

use crate::level::mirrors::{mirrors, texel_permutation};
use crate::level::shape::Shape;
use mrt_core::geometry::cube_symmetry::CubeSymmetry;
use mrt_core::linalg::matrix::Matrix;
use mrt_core::simd::{Aligned, WIDEST};
use std::cmp::Reverse;

/// Numbers of a mode at mirrored texels count as equal if they differ by at most this share of the mode's largest
/// number. Sums in `f32` lose far more.
const SYMMETRY_TOLERANCE: f32 = 1e-6;

/// The slots of a shape's texels. Mirrors generate a group, and the group divides the texels into orbits: the slot of a
/// texel is `element * stride + orbit`.
///
/// Bit k of an element is set if mirror k was applied. Each mode is even or odd under each mirror; bit k of its class
/// is set if it is odd under mirror k. So a sum over an orbit splits into one sum for each class, and a mode needs a
/// number for only one texel of each orbit. A texel on the plane of a mirror has two slots with the same content. Some
/// mirrors are left out where orbits would be so few that most of them are padding.
#[derive(Clone, Debug)]
pub struct Folding {
    /// Number of mirrors in use, 0 to 3.
    pub mirrors: usize,
    /// The mirror that exchanges floor and ceiling; `None` if it is not in use.
    pub up_mirror: Option<usize>,
    /// Number of orbits, rounded up to a multiple of [`WIDEST`].
    pub stride: usize,
    /// By texel, in the order of the shape: its first slot.
    pub slot_of_texel: Vec<u32>,
    /// By slot: its texel; `u32::MAX` for a slot without a texel.
    pub texel_of_slot: Vec<u32>,
    /// By orbit: number of its texels divided by the number of its slots, since sums over slots count a texel on the
    /// plane of a mirror twice.
    pub multiplicity: Aligned<f32>,
    /// By orbit: multiplicity times the area of its texels, in areas of a cube's texel.
    pub weight: Aligned<f32>,
}

/// Time of all work on a slot besides products (sums and differences in both directions, loads and stores), in
/// multiply-adds. Measured on x86-64: with 6 instead of 10, only the choice for straight blocks at 6² texels differs,
/// and is slower.
const SLOT_COST: usize = 10;

/// A mirror under which a shape is symmetric, and its operators are even or odd.
struct Mirror {
    /// Whether it exchanges floor and ceiling.
    is_up: bool,
    /// By texel: its image.
    permutation: Vec<u32>,
    /// By mode of `T_d->b`: whether it is odd.
    coefficients: Vec<bool>,
    /// By joint mode: whether it is odd.
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
    /// Folds by the mirrors of a shape and its operators: `coefficients` is modes x texels, `joint` is texels x joint
    /// modes.
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
        // Tiles of rows need the mirror that exchanges floor and ceiling.
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

    /// Time of one block with `modes` modes, in multiply-adds of one channel: products, and other work on slots.
    fn cost(&self, modes: usize) -> usize {
        self.stride * modes + self.slots() * SLOT_COST
    }

    /// The slots under mirrors with these permutations of texels.
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

    /// Number of elements of the group, which is also the number of classes.
    pub fn elements(&self) -> usize {
        1 << self.mirrors
    }

    /// Number of slots of a block.
    pub fn slots(&self) -> usize {
        self.elements() * self.stride
    }

    /// The texel whose numbers operators store for an orbit; `None` for padding.
    pub(crate) fn first(&self, orbit: usize) -> Option<usize> {
        match self.texel_of_slot[orbit] {
            u32::MAX => None,
            texel => Some(texel as usize),
        }
    }
}

/// True for a signal that is odd under a mirror, false for an even one; `None` if it is neither.
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
