//! The cone of light that passes a sequence of openings.
//!
//! Each opening's polygon is clipped by the cone (Sutherland and Hodgman, "Reentrant polygon clipping", CACM 1974), and
//! the planes through the light and the remaining edges bound the next cone.

use crate::level::placed::{PlacedBlock, Portal};
use crate::light::source::Light;
use glam::{DVec3, Vec3};

/// Most planes of a beam. Openings with four corners give four planes, and more where crooked openings overlap; round
/// openings exceed it.
pub const MAX_PLANES: usize = 16;

/// Most corners of an opening: a tube's end has these.
const MAX_CORNERS: usize = 32;

/// Most corners of an opening after clipping: each plane replaces one corner by two.
const MAX_CLIPPED: usize = MAX_CORNERS + MAX_PLANES;

/// Distance, in sizes of the opening or block, within which a point counts as on a plane: a thousand roundings of
/// coordinates at [`FAR_LIMIT`](crate::level::error::FAR_LIMIT). Positions of texels in `f32` do not resolve a sliver
/// of that width.
pub(super) const ON_PLANE: f64 = 1e-9;

/// An opening passes no light if the cone meets less than this share of its area. It ends paths that only rounding
/// keeps open, such as those around an edge where four blocks meet.
const SMALLEST_SHARE: f64 = 1e-10;

/// A half-space: `p · normal + offset >= 0`, for p relative to the trace's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Unit normal.
    pub(super) normal: DVec3,
    /// Metres.
    offset: f64,
}

impl Plane {
    const NONE: Plane = Plane {
        normal: DVec3::ZERO,
        offset: 0.0,
    };

    pub(super) fn at(&self, point: DVec3) -> f64 {
        self.normal.dot(point) + self.offset
    }
}

/// An intersection of half-spaces that contains the light.
#[derive(Clone, Debug)]
pub(super) struct Cone {
    planes: [Plane; MAX_PLANES],
    count: usize,
    /// False if the light may fill only a part of the cone.
    pub(super) is_exact: bool,
}

impl Cone {
    pub(super) const EVERYWHERE: Cone = Cone {
        planes: [Plane::NONE; MAX_PLANES],
        count: 0,
        is_exact: true,
    };

    pub(super) fn planes(&self) -> &[Plane] {
        &self.planes[..self.count]
    }

    /// Same as a clone of `other`, but copies only the planes in use: most cones have few.
    pub(super) fn copy_from(&mut self, other: &Cone) {
        self.planes[..other.count].copy_from_slice(other.planes());
        (self.count, self.is_exact) = (other.count, other.is_exact);
    }

    fn push(&mut self, plane: Plane) {
        if self.count < MAX_PLANES {
            self.planes[self.count] = plane;
            self.count += 1;
        } else {
            self.is_exact = false;
        }
    }
}

/// The geometry of a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Origin of coordinates: the light, or the world's origin for a light at infinity.
    pub(super) origin: DVec3,
    /// Unit vector to a light at infinity; `None` for other lights.
    pub(super) toward: Option<DVec3>,
    cone: Option<SpotCone>,
}

/// The cone that a spot shines into.
#[derive(Clone, Copy, Debug)]
struct SpotCone {
    /// Unit vector along the axis.
    axis: DVec3,
    /// Sine and cosine of the outer angle.
    sine: f64,
    cosine: f64,
}

impl SpotCone {
    /// A lower bound of the distance of a point from the cone, metres; negative inside. It is the distance, in the
    /// plane of axis and point, from the line along the cone's side.
    fn distance(&self, point: DVec3) -> f64 {
        let along = point.dot(self.axis);
        let across = (point - along * self.axis).length();
        across * self.cosine - along * self.sine
    }
}

/// Memory of [`Passing::narrow`]; earlier content does not matter.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    outline: Clipped,
    spare: Clipped,
    sides: [Plane; MAX_CORNERS],
}

impl Scratch {
    pub(super) const NEW: Scratch = Scratch {
        outline: Clipped::EMPTY,
        spare: Clipped::EMPTY,
        sides: [Plane::NONE; MAX_CORNERS],
    };
}

/// A cone of light at an opening that it may pass.
pub(super) struct Passing<'a> {
    pub(super) cone: &'a Cone,
    pub(super) source: &'a Source,
    /// The opening, as a portal of the block beyond it.
    pub(super) portal: &'a Portal,
    /// Number of openings passed before.
    pub(super) depth: u32,
}

impl Passing<'_> {
    /// Writes the part of the cone that passes the opening to `out`; false if no light passes.
    pub(super) fn narrow(&self, scratch: &mut Scratch, out: &mut Cone) -> bool {
        let count = self.portal.corners.len();
        if count > MAX_CORNERS {
            out.copy_from(self.cone);
            out.is_exact = false;
            return true;
        }
        let size = self.portal.outward.length().sqrt();
        let slack = ON_PLANE * size;
        // 1. Clip the opening by the cone.
        let Some(outline) = self.clipped(slack, &mut scratch.outline, &mut scratch.spare) else {
            return false;
        };
        if outline.area() <= SMALLEST_SHARE * size * size {
            return false;
        }
        // 2. The planes through the light and the opening's edges.
        let sides = &mut scratch.sides[..count];
        let turns = self.find_sides(slack, sides);
        // A light that stands in an opening of its own block, or beyond it by rounding, shines into the next block.
        if !turns.has_front && (self.depth > 0 || self.source.toward.is_some()) {
            return false;
        }
        // 3. The planes that bound the next cone.
        let mut taken = 0u64;
        for &edge in &outline.edges[..outline.count] {
            taken |= 1 << edge;
        }
        if turns.has_front && turns.has_back {
            // A bent opening that is not convex as the light sees it: the planes of edges that are clipped away still
            // cut.
            taken = u64::MAX;
        }
        (out.count, out.is_exact) = (0, self.cone.is_exact);
        let planes = sides.iter().chain(self.cone.planes());
        for (k, &plane) in planes.enumerate() {
            if taken & (1 << k) != 0 && plane.normal != DVec3::ZERO {
                out.push(plane);
            }
        }
        self.leaves_outwards(slack, out)
    }

    /// Corner `k` of the opening, counted on around the loop, from the trace's origin.
    fn corner(&self, k: usize) -> DVec3 {
        let corners = &self.portal.corners;
        let k = if k < corners.len() {
            k
        } else {
            k - corners.len()
        };
        corners[k] - self.source.origin
    }

    /// The opening's polygon, clipped by the planes of the cone; `None` if nothing is left.
    fn clipped<'s>(
        &self,
        slack: f64,
        mut outline: &'s mut Clipped,
        mut spare: &'s mut Clipped,
    ) -> Option<&'s Clipped> {
        let count = self.portal.corners.len();
        outline.count = 0;
        for k in 0..count {
            outline.push(self.corner(k), k as u8);
        }
        for (k, plane) in self.cone.planes().iter().enumerate() {
            if outline.clip(plane, (count + k) as u8, slack, spare)? {
                std::mem::swap(&mut outline, &mut spare);
            }
        }
        Some(outline)
    }

    /// Writes the plane of each edge, and tells on which sides of them the corners after the edges are. Where the light
    /// sees a convex outline from its front, all are in front.
    fn find_sides(&self, slack: f64, sides: &mut [Plane]) -> Turns {
        let mut turns = Turns::default();
        for (k, side) in sides.iter_mut().enumerate() {
            *side = self
                .source
                .plane_through(self.corner(k), self.corner(k + 1));
            let turn = side.at(self.corner(k + 2));
            turns.has_front |= turn > slack;
            turns.has_back |= turn < -slack;
        }
        turns
    }

    /// Keeps light that runs against a bent opening's direction out of the cone: it can graze such an opening and pass
    /// its outline, and receivers refuse it too. False if no light is left.
    fn leaves_outwards(&self, slack: f64, out: &mut Cone) -> bool {
        let corners = &self.portal.corners;
        let outward = self.portal.outward.normalize();
        let lift = |&c: &DVec3| (c - corners[0]).dot(outward).abs();
        if corners.iter().any(|c| lift(c) > slack) {
            match self.source.toward {
                None => out.push(Plane {
                    normal: -outward,
                    offset: 0.0,
                }),
                Some(toward) if toward.dot(outward) <= 0.0 => return false,
                Some(_) => {}
            }
        }
        true
    }
}

/// On which sides of the planes of an opening's edges its corners are.
#[derive(Clone, Copy, Debug, Default)]
struct Turns {
    has_front: bool,
    has_back: bool,
}

/// A polygon, relative to the trace's origin, with the plane that each edge is in.
#[derive(Clone, Debug)]
struct Clipped {
    corners: [DVec3; MAX_CLIPPED],
    /// For the edge from each corner to the next: the index of an edge of the opening, or the number of those edges
    /// plus the index of a plane of the cone.
    edges: [u8; MAX_CLIPPED],
    /// Distance of each corner from the plane of the last clipping.
    distances: [f64; MAX_CLIPPED],
    count: usize,
}

impl Clipped {
    const EMPTY: Self = Self {
        corners: [DVec3::ZERO; MAX_CLIPPED],
        edges: [0; MAX_CLIPPED],
        distances: [0.0; MAX_CLIPPED],
        count: 0,
    };

    /// Drops corners beyond [`MAX_CLIPPED`]. Only polygons that are not convex have so many, and the edges of those are
    /// not used.
    fn push(&mut self, corner: DVec3, edge: u8) {
        if self.count < MAX_CLIPPED {
            (self.corners[self.count], self.edges[self.count]) = (corner, edge);
            self.count += 1;
        }
    }

    /// Writes the part of the polygon that is inside a plane, or outside by at most `slack` metres, to `out`. `None` if
    /// no corner is inside; `Some(false)`, with `out` unchanged, if all are.
    fn clip(&mut self, plane: &Plane, edge: u8, slack: f64, out: &mut Self) -> Option<bool> {
        let mut inside = 0;
        let corners = &self.corners[..self.count];
        for (distance, &corner) in self.distances.iter_mut().zip(corners) {
            *distance = plane.at(corner);
            inside += usize::from(*distance >= -slack);
        }
        if inside == self.count {
            return Some(false);
        }
        if inside == 0 {
            return None;
        }
        out.count = 0;
        for k in 0..self.count {
            let next = if k + 1 == self.count { 0 } else { k + 1 };
            let (here, there) = (self.distances[k], self.distances[next]);
            let crossing = || {
                let t = (here / (here - there)).clamp(0.0, 1.0);
                self.corners[k] + (self.corners[next] - self.corners[k]) * t
            };
            match (here >= -slack, there >= -slack) {
                (true, true) => out.push(self.corners[k], self.edges[k]),
                (true, false) => {
                    out.push(self.corners[k], self.edges[k]);
                    out.push(crossing(), edge);
                }
                (false, true) => out.push(crossing(), self.edges[k]),
                (false, false) => {}
            }
        }
        (out.count >= 3).then_some(true)
    }

    /// Area of the polygon, square metres; for a bent polygon, the length of its vector area.
    fn area(&self) -> f64 {
        let corners = &self.corners[..self.count];
        let first = corners[0];
        let fans = corners.windows(2);
        let sum: DVec3 = fans.map(|c| (c[0] - first).cross(c[1] - first)).sum();
        0.5 * sum.length()
    }
}

impl Source {
    /// The light's geometry, and its intensity or irradiance.
    pub(super) fn new(light: &Light) -> (Self, Vec3) {
        let at = |position: Vec3, cone| Source {
            origin: position.as_dvec3(),
            toward: None,
            cone,
        };
        match *light {
            Light::Sphere {
                position,
                intensity,
                ..
            } => (at(position, None), intensity),
            Light::Spot {
                position,
                intensity,
                direction,
                outer_angle,
                ..
            } => {
                let (sine, cosine) = f64::from(outer_angle).sin_cos();
                let cone = SpotCone {
                    axis: direction.as_dvec3().normalize(),
                    sine,
                    cosine,
                };
                (at(position, Some(cone)), intensity)
            }
            Light::Directional {
                direction,
                irradiance,
            } => {
                let source = Source {
                    origin: DVec3::ZERO,
                    toward: Some(-direction.as_dvec3().normalize()),
                    cone: None,
                };
                (source, irradiance)
            }
        }
    }

    /// The plane through the light and an edge, with the opening inside; [`Plane::NONE`], which everything is inside
    /// of, if the light is on the line of the edge.
    fn plane_through(&self, from: DVec3, to: DVec3) -> Plane {
        let normal = match self.toward {
            None => to.cross(from),
            Some(toward) => toward.cross(to - from),
        };
        let Some(normal) = normal.try_normalize() else {
            return Plane::NONE;
        };
        let offset = match self.toward {
            None => 0.0,
            // The blocks on both sides choose the same end of the edge, so that their planes are equal to the bit.
            Some(_) if from.to_array() < to.to_array() => -normal.dot(from),
            Some(_) => -normal.dot(to),
        };
        Plane { normal, offset }
    }

    /// True if the cone of a spot misses a block. Its light then reaches nothing through that block.
    pub(super) fn misses(&self, block: &PlacedBlock) -> bool {
        let (low, high) = block.bounds;
        // A margin, since kernels round angles.
        let (center, radius) = (0.5 * (low + high), 0.501 * (high - low).length());
        self.cone
            .is_some_and(|cone| cone.distance(center - self.origin) > radius)
    }
}
