//! The cone that a light shines in through a sequence of openings.
//!
//! Each opening's polygon is clipped by the cone (Sutherland and Hodgman, "Reentrant polygon clipping", CACM 1974), and
//! the planes through the light and its remaining edges are the next cone.

use crate::level::placed::{PlacedBlock, Portal};
use crate::light::source::Light;
use glam::{DVec3, Vec3};

/// Planes of a beam, at most. Openings of four corners give four, and more where crooked ones overlap; round openings
/// are beyond it.
pub const MAX_PLANES: usize = 16;

/// Corners of an opening, at most: those of a tube's end.
const MAX_CORNERS: usize = 32;

/// Corners of an opening after clipping by every plane: each cuts off one corner and leaves two.
const MAX_CLIPPED: usize = MAX_CORNERS + MAX_PLANES;

/// A point this near to a plane, in sizes of the opening or block, is on it: a thousand roundings of its coordinates
/// at [`FAR_LIMIT`](crate::level::block::FAR_LIMIT). A sliver of shadow or light of that width is below what `f32` texels
/// resolve.
pub(super) const ON_PLANE: f64 = 1e-9;

/// Openings of which the light sees less than this share of the area are closed. It ends paths that only rounding
/// keeps open, such as those around an edge where four blocks meet.
const SMALLEST_SHARE: f64 = 1e-10;

/// A half-space: `p · normal + offset >= 0`, p from the trace's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Of unit length.
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

/// The intersection of half-spaces that light is in.
#[derive(Clone, Debug)]
pub(super) struct Cone {
    planes: [Plane; MAX_PLANES],
    count: usize,
    /// False if light is in a part of the cone only.
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

    /// Takes over another, without the planes that it does not use: most cones have few.
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

/// The light, as the geometry sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Where coordinates start: the light, or the world's origin if it is at infinity.
    pub(super) origin: DVec3,
    /// To a light at infinity.
    pub(super) toward: Option<DVec3>,
    cone: Option<SpotCone>,
}

/// The directions that a spot shines in.
#[derive(Clone, Copy, Debug)]
struct SpotCone {
    /// Of unit length.
    axis: DVec3,
    /// Of the outer angle.
    sine: f64,
    cosine: f64,
}

impl SpotCone {
    /// At most the distance of a point from the cone, metres; negative inside. In the plane of axis and point, it is
    /// the distance from the cone's side, continued beyond the light.
    fn distance(&self, point: DVec3) -> f64 {
        let along = point.dot(self.axis);
        let across = (point - along * self.axis).length();
        across * self.cosine - along * self.sine
    }
}

/// What [`narrowed`] works on; what was there before does not matter.
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

/// Puts what of a cone passes an opening into the block whose portal it is in `out`; false if nothing does. `depth`
/// openings were passed before.
pub(super) fn narrowed(
    cone: &Cone,
    source: &Source,
    portal: &Portal,
    depth: u32,
    scratch: &mut Scratch,
    out: &mut Cone,
) -> bool {
    let count = portal.corners.len();
    if count > MAX_CORNERS {
        out.copy_from(cone);
        out.is_exact = false;
        return true;
    }
    let corner = |k: usize| portal.corners[if k < count { k } else { k - count }] - source.origin;
    let size = portal.outward.length().sqrt();
    let slack = ON_PLANE * size;
    let (mut outline, mut spare) = (&mut scratch.outline, &mut scratch.spare);
    outline.count = 0;
    for k in 0..count {
        outline.push(corner(k), k as u8);
    }
    for (k, plane) in cone.planes().iter().enumerate() {
        match outline.clip(plane, (count + k) as u8, slack, spare) {
            None => return false,
            Some(true) => std::mem::swap(&mut outline, &mut spare),
            Some(false) => {}
        }
    }
    if outline.area() <= SMALLEST_SHARE * size * size {
        return false;
    }
    // On which side of each edge the corner after it is: inside all in the outline of a convex opening, as the light
    // sees it.
    let sides = &mut scratch.sides[..count];
    let (mut is_front, mut is_back) = (false, false);
    for (k, side) in sides.iter_mut().enumerate() {
        *side = source.plane_through(corner(k), corner(k + 1));
        let turn = side.at(corner(k + 2));
        is_front |= turn > slack;
        is_back |= turn < -slack;
    }
    // A light that stands in an opening of its own block, or beyond it by rounding, shines into the next.
    if !is_front && (depth > 0 || source.toward.is_some()) {
        return false;
    }
    let mut taken = 0u64;
    for &edge in &outline.edges[..outline.count] {
        taken |= 1 << edge;
    }
    if is_front && is_back {
        // A bent opening that is not convex from here: the planes of edges that are clipped away still cut.
        taken = u64::MAX;
    }
    (out.count, out.is_exact) = (0, cone.is_exact);
    let planes = sides.iter().chain(cone.planes());
    for (k, &plane) in planes.enumerate() {
        if taken & (1 << k) != 0 && plane.normal != DVec3::ZERO {
            out.push(plane);
        }
    }
    // Light that grazes a bent opening can pass its outline and run against its direction, which receivers ask too.
    let outward = portal.outward.normalize();
    let lift = |&c: &DVec3| (c - portal.corners[0]).dot(outward).abs();
    if portal.corners.iter().any(|c| lift(c) > slack) {
        match source.toward {
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

/// A polygon, from the trace's origin, whose edges know the planes that they are on.
#[derive(Clone, Debug)]
struct Clipped {
    corners: [DVec3; MAX_CLIPPED],
    /// Of the edge from each corner to the next: an edge of the opening, or their number and a plane of the cone.
    edges: [u8; MAX_CLIPPED],
    /// From the plane that it was last clipped by.
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

    /// Drops what does not fit, as only a polygon that is not convex has so many corners; of such a one the edges
    /// are not asked.
    fn push(&mut self, corner: DVec3, edge: u8) {
        if self.count < MAX_CLIPPED {
            (self.corners[self.count], self.edges[self.count]) = (corner, edge);
            self.count += 1;
        }
    }

    /// Puts what is inside a plane, or outside by at most `slack` metres, in `out`; `None` if nothing is. False if
    /// all is, and `out` is then left alone.
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

    /// Square metres, of the polygon laid flat.
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

    /// The plane through the light and an edge, with the light's part of the opening inside; one that keeps
    /// everything if the light is on the edge's line.
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
            // The same end of the edge from both sides, so that planes are equal to the bit.
            Some(_) if from.to_array() < to.to_array() => -normal.dot(from),
            Some(_) => -normal.dot(to),
        };
        Plane { normal, offset }
    }

    /// True if a spot's cone passes a block by, and so everything beyond it that light reaches through the block.
    pub(super) fn misses(&self, block: &PlacedBlock) -> bool {
        let (low, high) = block.bounds;
        // With a margin for angles that kernels round.
        let (center, radius) = (0.5 * (low + high), 0.501 * (high - low).length());
        self.cone
            .is_some_and(|cone| cone.distance(center - self.origin) > radius)
    }
}
