//! Cuts polygons into triangles.
//!
//! Holes are part of the outline: it runs to the hole, around it, and back along the same edge, the keyhole.

use earcut::Earcut;
use glam::DVec3;

/// Smaller than this times the square of its extent, a polygon's area is rounding.
const NO_AREA: f64 = 1e-12;

/// The triangles of a polygon that does not cross itself have its area to this share.
const AREA_TOLERANCE: f64 = 1e-6;

/// What became of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cut {
    /// The triangles cover the polygon and nothing else.
    Whole,
    /// The outline crosses itself, so that nobody can say what it encloses.
    Crossing,
    /// The corners lie on a line, or the outline encloses as much from either side; the triangles have no area.
    NoArea,
}

/// Cuts polygons into triangles; keeps its memory from one to the next.
#[derive(Default)]
pub(super) struct Cutter {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Cutter {
    /// Triangles of the polygon with these `corners`, three or more, as indices into them; they turn as the polygon does.
    ///
    /// If a corner is not finite, every triangle has such a corner.
    pub(super) fn cut(&mut self, corners: &[DVec3]) -> (&[[u32; 3]], Cut) {
        self.triangles.clear();
        let count = corners.len() as u32;
        let twice_area = twice_area(corners);
        let extent = corners.iter().map(|&corner| (corner - corners[0]).length());
        let extent = extent.fold(0.0, f64::max);
        let cut = if count == 3 {
            self.triangles.push([0, 1, 2]);
            Cut::Whole
        } else if let Some(bad) = corners.iter().position(|c| !c.as_vec3().is_finite()) {
            let fan = (1..count - 1).map(|k| [0, k, k + 1]);
            self.triangles
                .extend(fan.map(|t| t.map(|k| (k + bad as u32) % count)));
            Cut::Whole
        } else if twice_area.length() <= NO_AREA * extent * extent {
            self.triangles.extend((2..count).map(|_| [0, 1, 0]));
            Cut::NoArea
        } else if count == 4 {
            self.cut_quad(corners, twice_area)
        } else {
            self.cut_ears(corners, twice_area)
        };
        (&self.triangles, cut)
    }

    /// Along the diagonal of which both triangles turn as the quad does, the first one if both do.
    fn cut_quad(&mut self, corners: &[DVec3], twice_area: DVec3) -> Cut {
        let turn = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|k| corners[k as usize]);
            (b - a).cross(c - a).dot(twice_area)
        };
        let pairs = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
        let [first, second] = pairs.map(|[a, b]| turn(a).min(turn(b)));
        let enough = NO_AREA * twice_area.length_squared();
        let is_first = first > enough || first >= second;
        self.triangles.extend(pairs[usize::from(!is_first)]);
        match first.max(second) < -AREA_TOLERANCE * twice_area.length_squared() {
            true => Cut::Crossing,
            false => Cut::Whole,
        }
    }

    fn cut_ears(&mut self, corners: &[DVec3], twice_area: DVec3) -> Cut {
        // Along the axis nearest to the normal, because then the coordinates stay as they are, and corners on a line stay
        // on it; seen from where the polygon turns to the left.
        let axis = twice_area.abs().max_position();
        let [mut u, mut v] = [(axis + 1) % 3, (axis + 2) % 3];
        if twice_area[axis] < 0.0 {
            (u, v) = (v, u);
        }
        let origin = corners[0];
        self.flat.clear();
        self.flat.extend(corners.iter().map(|&corner| {
            let corner = corner - origin;
            [corner[u], corner[v]]
        }));
        self.earcut.earcut_slice(&self.flat, &[], &mut self.ears);
        let ears = self.ears.as_chunks::<3>().0;
        let turn = |ear: &[u32; 3]| {
            let [a, b, c] = ear.map(|k| self.flat[k as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let area: f64 = ears.iter().map(turn).sum();
        match area < 0.0 {
            true => self
                .triangles
                .extend(ears.iter().map(|&[a, b, c]| [a, c, b])),
            false => self.triangles.extend(ears),
        }
        let wanted = twice_area[axis].abs();
        match (area.abs() - wanted).abs() <= AREA_TOLERANCE * wanted {
            true => Cut::Whole,
            false => Cut::Crossing,
        }
    }
}

/// Twice the area, along the normal, after Newell.
fn twice_area(corners: &[DVec3]) -> DVec3 {
    let origin = corners[0];
    corners
        .windows(2)
        .map(|pair| (pair[0] - origin).cross(pair[1] - origin))
        .sum()
}

#[cfg(test)]
mod tests;
