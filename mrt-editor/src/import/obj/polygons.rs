//! Cuts polygons into triangles.
//!
//! Holes are part of the outline: it runs to the hole, around it, and back along the same edge, the keyhole.

use earcut::Earcut;
use glam::DVec3;
use std::collections::HashMap;

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
        let wanted = twice_area[axis].abs();
        let order: Vec<u32> = (0..corners.len() as u32).collect();
        if self.clip(&order, &[], wanted) {
            return Cut::Whole;
        }
        // Rounding of keyholes beside one another can leave no ear to clip; as holes they do no harm.
        let plain = std::mem::take(&mut self.triangles);
        match without_keyholes(&self.flat) {
            Some((order, holes)) if self.clip(&order, &holes, wanted) => Cut::Whole,
            _ => {
                self.triangles = plain;
                Cut::Crossing
            }
        }
    }

    /// Clips the ears of the outline that `order` tells, whose holes begin at `holes`; true if the area is as `wanted`.
    fn clip(&mut self, order: &[u32], holes: &[u32], wanted: f64) -> bool {
        let corners = order.iter().map(|&corner| self.flat[corner as usize]);
        self.earcut.earcut(corners, holes, &mut self.ears);
        let ears = self.ears.as_chunks::<3>().0.iter();
        let ears = ears.map(|ear| ear.map(|k| order[k as usize]));
        let area: f64 = ears
            .clone()
            .map(|ear| twice_area_flat(&self.flat, &ear))
            .sum();
        self.triangles.clear();
        match area < 0.0 {
            true => self.triangles.extend(ears.map(|[a, b, c]| [a, c, b])),
            false => self.triangles.extend(ears),
        }
        (area.abs() - wanted).abs() <= AREA_TOLERANCE * wanted
    }
}

/// The corners of an outline in which holes hang on keyholes, and then of its holes, and where each hole begins. `None` if
/// there is no hole, or more than one outline.
fn without_keyholes(flat: &[[f64; 2]]) -> Option<(Vec<u32>, Vec<u32>)> {
    // Where the outline comes back to a corner, what lies between is a ring of its own.
    let key = |corner: u32| flat[corner as usize].map(|x| (x + 0.0).to_bits());
    let mut open: Vec<u32> = Vec::new();
    let mut place_of = HashMap::new();
    let mut rings = Vec::new();
    for corner in 0..flat.len() as u32 {
        match place_of.get(&key(corner)).copied() {
            Some(place) => {
                let ring = open.split_off(place);
                open.push(ring[0]);
                for &corner in &ring[1..] {
                    place_of.remove(&key(corner));
                }
                rings.push(ring);
            }
            None => {
                place_of.insert(key(corner), open.len());
                open.push(corner);
            }
        }
    }
    rings.push(open);
    let mut rings: Vec<(f64, Vec<u32>)> = rings
        .into_iter()
        .map(|ring| (twice_area_flat(flat, &ring), ring))
        .collect();
    rings.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (outer_area, mut order) = rings.swap_remove(0);
    // The two sides of a keyhole may have corners of their own; between them lies nothing but rounding.
    rings.retain(|(area, _)| area.abs() > AREA_TOLERANCE * outer_area);
    if rings.is_empty() || rings.iter().any(|&(area, _)| area > 0.0) {
        return None;
    }
    let mut holes = Vec::new();
    for (_, ring) in rings {
        holes.push(order.len() as u32);
        order.extend(ring);
    }
    Some((order, holes))
}

fn twice_area_flat(flat: &[[f64; 2]], ring: &[u32]) -> f64 {
    let [x, y] = flat[ring[0] as usize];
    let from_first = |corner: u32| {
        let corner = flat[corner as usize];
        [corner[0] - x, corner[1] - y]
    };
    ring.windows(2)
        .map(|pair| {
            let [a, b] = [from_first(pair[0]), from_first(pair[1])];
            a[0] * b[1] - a[1] * b[0]
        })
        .sum()
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
