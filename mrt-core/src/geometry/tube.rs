//! Circular tubes in the unit cube: the cylinder shapes of Loos et al. 2011, section 6.1.
//!
//! [`TubeForm::Straight`] runs from the middle of face -x to the middle of +x. [`TubeForm::Bend`] is a
//! quarter of a torus, from the middle of +x to the middle of +z. Its centre line is a quarter circle of
//! radius 1/2 about the vertical edge x = 1, z = 1. The bends to the left and to the right are this one
//! shape, entered at +x and at +z.
//!
//! The wall is cut into four charts of [0, 1]², each a quarter of the circular section. A chart has the
//! name of the face that it would lie on if the tube were blown up to a square one: -y, +y, -z, +z on the
//! straight tube; -y, +y, -x (outer side) and -z (inner side) on the bend. In each chart u runs along the
//! tube and v around it, in the directions in which u and v of the flat face grow
//! ([`cube`](crate::geometry::cube)), so texel layouts of cubes carry over.
//!
//! Let M be the radius of the bend's centre line, and ρ the distance from the edge (1, y, 1). The torus is
//! where (ρ - M)² + (y - 1/2)² <= R². Squaring removes the root in ρ: the inside is where f >= 0 with
//! f = 4 M² ρ² - (ρ² + (y - 1/2)² + M² - R²)², which along a line is a polynomial of degree four. Its
//! Bernstein coefficients decide where rays and segments end (`tube/quartic.rs`).

mod quartic;

use crate::geometry::cube::Face;
use glam::{DVec2, DVec3};
use quartic::Quartic;
use std::f64::consts::FRAC_PI_2;

/// Radius R of every tube, in block widths.
///
/// At 0.4 the tube fills half of the cube's section. The inner side of a bend has a radius of 0.1 about the
/// edge, where a texel is a ninth as long as on the outer side. At 0.5 it would have no length.
pub const TUBE_RADIUS: f64 = 0.4;

/// Radius M of a bend's centre line, which is the distance from the edge to the middle of a face.
const BEND_RADIUS: f64 = 0.5;

/// How far outside the wall, in block widths, a point may lie and still count as on it: the rounding of
/// positions to `f32`, with a margin.
const WALL_TOLERANCE: f64 = 1e-6;

/// Longer than any segment within the unit cube.
const BEYOND_CUBE: f64 = 2.0;

/// The canonical tubes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TubeForm {
    /// From -x to +x. It is convex: any two of its points see one another.
    Straight,
    /// From +x to +z.
    Bend,
}

/// A point of a tube's wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position in the unit cube.
    pub position: DVec3,
    /// Unit normal into the tube.
    pub normal: DVec3,
    /// Unit tangents in the directions of growing u (along the tube) and v (around it).
    pub tangents: [DVec3; 2],
    /// Area of the wall for an area of the chart, d²A / du dv.
    pub area_per_uv: f64,
}

/// Where a ray from inside a tube ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeHit {
    /// Distance from the origin, in lengths of the ray's direction.
    pub distance: f64,
    /// The point of the wall or of an opening where the ray ends.
    pub point: DVec3,
    /// The opening through which the ray leaves; `None` if it ends on the wall.
    pub opening: Option<Face>,
}

impl TubeForm {
    /// Both forms.
    pub const ALL: [TubeForm; 2] = [TubeForm::Straight, TubeForm::Bend];

    /// The two faces at which the tube ends, in the order of [`Face::ALL`].
    pub fn openings(self) -> [Face; 2] {
        match self {
            TubeForm::Straight => [Face::NegX, Face::PosX],
            TubeForm::Bend => [Face::PosX, Face::PosZ],
        }
    }

    /// The four faces that name the wall's charts, in the order of [`Face::ALL`].
    pub fn charts(self) -> [Face; 4] {
        match self {
            TubeForm::Straight => [Face::NegY, Face::PosY, Face::NegZ, Face::PosZ],
            TubeForm::Bend => [Face::NegX, Face::NegY, Face::PosY, Face::NegZ],
        }
    }

    /// The point at `along` in [0, 1], from -x to +x or from +z to +x, and at `section` (across, up) from the
    /// centre line. Across is +z in the straight tube, and away from the edge x = 1, z = 1 in the bend.
    pub fn point(self, along: f64, section: DVec2) -> DVec3 {
        match self {
            TubeForm::Straight => DVec3::new(along, 0.5 + section.y, 0.5 + section.x),
            TubeForm::Bend => {
                let (sine, cosine) = libm::sincos(FRAC_PI_2 * along);
                let radius = BEND_RADIUS + section.x;
                DVec3::new(1.0 - radius * cosine, 0.5 + section.y, 1.0 - radius * sine)
            }
        }
    }

    /// The point of a chart at (u, v) in [0, 1]². A face without a chart counts as +y.
    pub fn surface(self, chart: Face, u: f64, v: f64) -> SurfacePoint {
        let [section, turned] = self.section(chart, arc_angle(v));
        let along = self.along(chart, u);
        let r = TUBE_RADIUS;
        match self {
            TubeForm::Straight => SurfacePoint {
                position: DVec3::new(along, 0.5 + r * section[1], 0.5 + r * section[0]),
                normal: DVec3::new(0.0, -section[1], -section[0]),
                tangents: [DVec3::X, DVec3::new(0.0, turned[1], turned[0])],
                area_per_uv: FRAC_PI_2 * r,
            },
            TubeForm::Bend => {
                let (sine, cosine) = libm::sincos(FRAC_PI_2 * along);
                let out = DVec3::new(-cosine, 0.0, -sine);
                let radius = BEND_RADIUS + r * section[0];
                let growing = if chart == Face::NegX { -1.0 } else { 1.0 };
                SurfacePoint {
                    position: DVec3::new(1.0, 0.5 + r * section[1], 1.0) + out * radius,
                    normal: -(out * section[0] + DVec3::Y * section[1]),
                    tangents: [
                        DVec3::new(sine, 0.0, -cosine) * growing,
                        out * turned[0] + DVec3::Y * turned[1],
                    ],
                    area_per_uv: FRAC_PI_2 * radius * FRAC_PI_2 * r,
                }
            }
        }
    }

    /// The middle, in u and v, of texel (row j, column i) of a chart's `resolution`² grid.
    pub fn texel_center(self, chart: Face, resolution: usize, j: usize, i: usize) -> SurfacePoint {
        let step = 1.0 / resolution as f64;
        self.surface(chart, (i as f64 + 0.5) * step, (j as f64 + 0.5) * step)
    }

    /// Exact area of a texel in row j of a chart's `resolution`² grid. It is the same in all columns.
    pub fn texel_area(self, chart: Face, resolution: usize, j: usize) -> f64 {
        let step = 1.0 / resolution as f64;
        let (from, to) = (arc_angle(j as f64 * step), arc_angle((j + 1) as f64 * step));
        let width = FRAC_PI_2 * step;
        match self {
            TubeForm::Straight => step * TUBE_RADIUS * width,
            TubeForm::Bend => {
                // The turned section is the derivative of the section by the angle, and its own derivative
                // is minus the section. So minus the turned section is an integral of the section.
                let integral = |angle| -self.section(chart, angle)[1][0];
                let across = integral(to) - integral(from);
                width * TUBE_RADIUS * (BEND_RADIUS * width + TUBE_RADIUS * across)
            }
        }
    }

    /// Area of the whole wall: 2πR times the length of the centre line, also for the torus (Pappus).
    pub fn wall_area(self) -> f64 {
        let length = match self {
            TubeForm::Straight => 1.0,
            TubeForm::Bend => FRAC_PI_2 * BEND_RADIUS,
        };
        4.0 * FRAC_PI_2 * TUBE_RADIUS * length
    }

    /// The chart and (u, v) of a point on the wall, or of the point of the wall nearest to a point inside:
    /// the inverse of [`TubeForm::surface`].
    pub fn chart_of(self, point: DVec3) -> (Face, f64, f64) {
        let [across, up] = self.section_of(point);
        let along = match self {
            TubeForm::Straight => point.x,
            TubeForm::Bend => libm::atan2(1.0 - point.z, 1.0 - point.x) / FRAC_PI_2,
        };
        let (chart, angle) = match self {
            _ if up.abs() >= across.abs() => {
                let chart = Face::from_axis(1, up > 0.0);
                let forward = if self == TubeForm::Bend {
                    -across
                } else {
                    across
                };
                (chart, libm::atan2(forward, up.abs()))
            }
            TubeForm::Straight => (
                Face::from_axis(2, across > 0.0),
                libm::atan2(up, across.abs()),
            ),
            TubeForm::Bend if across > 0.0 => (Face::NegX, libm::atan2(up, across)),
            TubeForm::Bend => (Face::NegZ, libm::atan2(up, -across)),
        };
        let unit = |x: f64| x.clamp(0.0, 1.0);
        (
            chart,
            unit(self.along(chart, along)),
            unit(0.5 + angle / FRAC_PI_2),
        )
    }

    /// Distance to the wall, positive inside. Beyond the openings the wall continues as an endless cylinder
    /// or a whole torus.
    pub fn wall_distance(self, point: DVec3) -> f64 {
        let [across, up] = self.section_of(point);
        TUBE_RADIUS - (across * across + up * up).sqrt()
    }

    /// The point itself, or the nearest point of the wall if it is outside.
    pub fn drawn_inside(self, point: DVec3) -> DVec3 {
        let [across, up] = self.section_of(point);
        let scale = TUBE_RADIUS / (across * across + up * up).sqrt();
        // On the centre line the scale is infinite, which is not outside.
        let is_outside = scale < 1.0;
        if !is_outside {
            return point;
        }
        let height = 0.5 + up * scale;
        match self {
            TubeForm::Straight => DVec3::new(point.x, height, 0.5 + across * scale),
            TubeForm::Bend => {
                // On the torus's axis no point of the wall is nearest, and the distance is zero.
                let distance = (BEND_RADIUS + across).max(f64::MIN_POSITIVE);
                let stretch = (BEND_RADIUS + across * scale) / distance;
                DVec3::new(
                    1.0 + (point.x - 1.0) * stretch,
                    height,
                    1.0 + (point.z - 1.0) * stretch,
                )
            }
        }
    }

    /// True for points in the tube or on its wall, between the openings, within a tolerance of 1e-6.
    pub fn contains(self, point: DVec3) -> bool {
        let past = match self {
            TubeForm::Straight => (-point.x).max(point.x - 1.0),
            TubeForm::Bend => point.x.max(point.z) - 1.0,
        };
        past.max(-self.wall_distance(point)) <= WALL_TOLERANCE
    }

    /// True if two points of the tube, inside or on its wall, see one another.
    ///
    /// A segment that dips into the wall for less than 2^-16 of its length counts as free. A point that is
    /// more than about 1e-6 outside a bend's wall sees nothing.
    ///
    /// Cost: nothing in a straight tube. In a bend 40 multiplications and, near the edge of a shadow, some
    /// bisections, 30 ns in all.
    pub fn segment_is_free(self, from: DVec3, to: DVec3) -> bool {
        match self {
            TubeForm::Straight => true,
            TubeForm::Bend => bend_along(from, to - from)
                .with_ends_on_the_wall(WALL_TOLERANCE)
                .is_some_and(|inside| inside.stays_non_negative()),
        }
    }

    /// Where a ray from a point in the tube or on its wall meets the wall, or leaves through an opening.
    ///
    /// A ray that starts on the wall and heads into it ends at distance 0; otherwise the wall at its start
    /// does not count. `direction` must not be zero. Cost: 250 ns in a bend.
    pub fn first_hit(self, origin: DVec3, direction: DVec3) -> TubeHit {
        // The planes of the openings cut this tube out of the endless one. A ray that has farther to go to
        // them than any segment within the cube meets the wall before.
        let mut limit = (BEYOND_CUBE / direction.length(), None);
        for face in self.openings() {
            let axis = face.axis();
            let plane = if face.is_positive() { 1.0 } else { 0.0 };
            if direction[axis] * face.outward()[axis] > 0.0 {
                let distance = ((plane - origin[axis]) / direction[axis]).max(0.0);
                if distance < limit.0 {
                    limit = (distance, Some(face));
                }
            }
        }
        let wall = match self {
            TubeForm::Straight => cylinder_exit(origin, direction),
            TubeForm::Bend => {
                let inside = bend_along(origin, direction * limit.0);
                inside.first_negative().map(|t| t * limit.0)
            }
        };
        let (distance, opening) = match wall {
            Some(distance) if distance < limit.0 => (distance, None),
            _ => limit,
        };
        TubeHit {
            distance,
            point: origin + direction * distance,
            opening,
        }
    }

    /// Unit vector from the centre line at an angle of a chart, and its derivative by the angle, both as
    /// (across, up). Across is +z in the straight tube, and away from the edge in the bend.
    fn section(self, chart: Face, angle: f64) -> [[f64; 2]; 2] {
        let (sine, cosine) = libm::sincos(angle);
        match (self, chart) {
            (TubeForm::Straight, Face::NegY) => [[sine, -cosine], [cosine, sine]],
            (TubeForm::Straight, Face::PosZ) | (TubeForm::Bend, Face::NegX) => {
                [[cosine, sine], [-sine, cosine]]
            }
            (_, Face::NegZ) => [[-cosine, sine], [sine, cosine]],
            (TubeForm::Straight, _) => [[sine, cosine], [cosine, -sine]],
            (TubeForm::Bend, Face::NegY) => [[-sine, -cosine], [-cosine, sine]],
            (TubeForm::Bend, _) => [[-sine, cosine], [-cosine, -sine]],
        }
    }

    /// Offset of a point from the centre line, as (across, up).
    fn section_of(self, point: DVec3) -> [f64; 2] {
        let up = point.y - 0.5;
        match self {
            TubeForm::Straight => [point.z - 0.5, up],
            TubeForm::Bend => {
                let (x, z) = (1.0 - point.x, 1.0 - point.z);
                [(x * x + z * z).sqrt() - BEND_RADIUS, up]
            }
        }
    }

    /// The u of a chart from the position along the tube, which is 0 at -x or +z and 1 at +x; or that
    /// position from u.
    fn along(self, chart: Face, u: f64) -> f64 {
        // On the outer side u grows with z, away from the opening at +x.
        if self == TubeForm::Bend && chart == Face::NegX {
            1.0 - u
        } else {
            u
        }
    }
}

/// Angle between `v` and the middle of its chart.
fn arc_angle(v: f64) -> f64 {
    FRAC_PI_2 * (v - 0.5)
}

/// Distance at which a ray from inside leaves the endless straight tube; `None` if it runs along the axis.
fn cylinder_exit(origin: DVec3, direction: DVec3) -> Option<f64> {
    let (y, z) = (origin.y - 0.5, origin.z - 0.5);
    let a = direction.y * direction.y + direction.z * direction.z;
    if a == 0.0 {
        return None;
    }
    let b = y * direction.y + z * direction.z;
    // Inside this is at most 0. On the wall, rounding must not make it positive.
    let c = (y * y + z * z - TUBE_RADIUS * TUBE_RADIUS).min(0.0);
    let root = (b * b - a * c).sqrt();
    // The larger root, written so that no digits cancel.
    Some(if b > 0.0 {
        -c / (b + root)
    } else {
        (root - b) / a
    })
}

/// The polynomial f of the module documentation along `origin + t * offset`, for t in [0, 1].
fn bend_along(origin: DVec3, offset: DVec3) -> Quartic {
    let start = origin - DVec3::new(1.0, 0.5, 1.0);
    let flat = |a: DVec3, b: DVec3| a.x * b.x + a.z * b.z;
    let m = 4.0 * BEND_RADIUS * BEND_RADIUS;
    let [s0, s1, s2] = [
        flat(start, start),
        2.0 * flat(start, offset),
        flat(offset, offset),
    ];
    let q0 = s0 + start.y * start.y + (BEND_RADIUS * BEND_RADIUS - TUBE_RADIUS * TUBE_RADIUS);
    let q1 = s1 + 2.0 * start.y * offset.y;
    let q2 = s2 + offset.y * offset.y;
    Quartic::new([
        m * s0 - q0 * q0,
        m * s1 - 2.0 * q0 * q1,
        m * s2 - (q1 * q1 + 2.0 * q0 * q2),
        -2.0 * q1 * q2,
        -q2 * q2,
    ])
}

#[cfg(test)]
mod tests;
