//! All pairs of boxes that overlap, by a segment tree for each axis that is never stored (Zomorodian and Edelsbrunner
//! 2000, "Fast software for box intersections", section 4).
//!
//! Boxes are compared by ranks instead of coordinates, so that no two starts are equal and every split halves the work.
//! The cost is near-linear in boxes and pairs for all arrangements: rows along an axis, sheets, large boxes over small
//! ones, and boxes that share a start.

use glam::DVec3;

/// With this few boxes on one side, all are compared: splitting them further costs more.
const FEW: usize = 8;

/// A box along one axis, by the rank of its start among those of all boxes.
#[derive(Clone, Copy, Default)]
struct Span {
    start: u32,
    /// Boxes that start before this box ends: those of lower rank.
    end: u32,
}

impl Span {
    /// True if `other` starts after this span does and before it ends. Of two spans that overlap, exactly one contains
    /// the start of the other.
    fn contains_start(self, other: Self) -> bool {
        self.start < other.start && other.start < self.end
    }

    fn overlaps(self, other: Self) -> bool {
        self.contains_start(other) || other.contains_start(self)
    }
}

/// Calls `visit` with each pair of boxes (smallest, largest corner) that share a volume, once, until it returns an error.
/// Coordinates are finite, and all boxes have a volume. Returns how many times two boxes were compared along an axis.
///
/// # Errors
/// That of `visit`.
pub(crate) fn for_each_pair<E>(
    boxes: &[(DVec3, DVec3)],
    visit: impl FnMut(usize, usize) -> Result<(), E>,
) -> Result<u64, E> {
    let mut search = Search {
        spans: [0, 1, 2].map(|axis| spans(boxes, axis)),
        visit,
        comparisons: 0,
    };
    let mut all: Vec<u32> = (0..boxes.len() as u32).collect();
    all.sort_unstable_by_key(|&b| search.span(0, b).start);
    search.stream(&all, &all, 2)?;
    Ok(search.comparisons)
}

/// The spans of all boxes along an axis.
fn spans(boxes: &[(DVec3, DVec3)], axis: usize) -> Vec<Span> {
    let start = |b: u32| boxes[b as usize].0[axis];
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    order.sort_by(|&a, &b| start(a).total_cmp(&start(b)));
    let mut spans = vec![Span::default(); boxes.len()];
    for (rank, &b) in order.iter().enumerate() {
        let end = boxes[b as usize].1[axis];
        spans[b as usize] = Span {
            start: rank as u32,
            // Boxes that only touch do not overlap. Plain `<` takes -0 and 0 for equal.
            end: order.partition_point(|&other| start(other) < end) as u32,
        };
    }
    spans
}

struct Search<F> {
    /// By axis and box.
    spans: [Vec<Span>; 3],
    visit: F,
    comparisons: u64,
}

impl<E, F: FnMut(usize, usize) -> Result<(), E>> Search<F> {
    fn span(&self, axis: usize, b: u32) -> Span {
        self.spans[axis][b as usize]
    }

    /// Finds the pairs of a box of `holders` and one of `starters` whose start along `axis` the first contains, and
    /// which overlap along all axes below. Along those above they are known to overlap. Both lists are sorted by their
    /// starts along axis 0.
    fn stream(&mut self, holders: &[u32], starters: &[u32], axis: usize) -> Result<(), E> {
        if holders.is_empty() || starters.is_empty() {
            return Ok(());
        }
        if axis == 0 {
            return self.scan(holders, starters);
        }
        if holders.len().min(starters.len()) <= FEW {
            return self.compare_all(holders, starters, axis);
        }
        let mut starts: Vec<u32> = starters.iter().map(|&b| self.span(axis, b).start).collect();
        let half = starts.len() / 2;
        let middle = *starts.select_nth_unstable(half).1;
        let low = starts.iter().copied().fold(u32::MAX, u32::min);
        let high = starts.iter().copied().fold(0, u32::max);
        self.comparisons += (holders.len() + starters.len()) as u64;
        // Boxes that contain all starts need no further look along this axis. Those of the others that contain some
        // starts of a half go there.
        let mut all = Vec::new();
        let mut holder_halves = [Vec::new(), Vec::new()];
        for &b in holders {
            let span = self.span(axis, b);
            if span.start < low && high < span.end {
                all.push(b);
                continue;
            }
            if span.start < middle && low < span.end {
                holder_halves[0].push(b);
            }
            if span.start < high && middle < span.end {
                holder_halves[1].push(b);
            }
        }
        // Along the axis below, either box may contain the start of the other.
        self.stream(&all, starters, axis - 1)?;
        self.stream(starters, &all, axis - 1)?;
        drop(all);
        let (below, above): (Vec<u32>, Vec<u32>) = starters
            .iter()
            .partition(|&&b| self.span(axis, b).start < middle);
        let [holders_below, holders_above] = holder_halves;
        self.stream(&holders_below, &below, axis)?;
        self.stream(&holders_above, &above, axis)
    }

    /// [`Search::stream`] along the last axis: every pair that is met is one that is sought.
    fn scan(&mut self, holders: &[u32], starters: &[u32]) -> Result<(), E> {
        self.comparisons += (holders.len() + starters.len()) as u64;
        let mut first = 0;
        for &holder in holders {
            let span = self.span(0, holder);
            let is_before = |b: &&u32| self.span(0, **b).start <= span.start;
            first += starters[first..].iter().take_while(is_before).count();
            for &starter in &starters[first..] {
                if !span.contains_start(self.span(0, starter)) {
                    break;
                }
                self.comparisons += 1;
                (self.visit)(holder as usize, starter as usize)?;
            }
        }
        Ok(())
    }

    /// [`Search::stream`] by comparing all pairs.
    fn compare_all(&mut self, holders: &[u32], starters: &[u32], axis: usize) -> Result<(), E> {
        self.comparisons += (holders.len() * starters.len()) as u64;
        for &holder in holders {
            for &starter in starters {
                let is_pair = (0..axis)
                    .all(|k| self.span(k, holder).overlaps(self.span(k, starter)))
                    && self
                        .span(axis, holder)
                        .contains_start(self.span(axis, starter));
                if is_pair {
                    (self.visit)(holder as usize, starter as usize)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// Comparisons allowed: for each box and pair, a few times the depth of a tree of all boxes.
    fn allowed(boxes: usize, pairs: usize) -> u64 {
        let depth = boxes.max(2).ilog2() as u64 + 1;
        8 * depth * (boxes + pairs) as u64
    }

    fn pairs_of(boxes: &[(DVec3, DVec3)]) -> (Vec<(usize, usize)>, u64) {
        let mut pairs = Vec::new();
        let Ok(comparisons) = for_each_pair::<Infallible>(boxes, |a, b| {
            pairs.push((a.min(b), a.max(b)));
            Ok(())
        });
        pairs.sort_unstable();
        (pairs, comparisons)
    }

    fn unit(x: f64, y: f64, z: f64) -> (DVec3, DVec3) {
        let low = DVec3::new(x, y, z);
        (low, low + DVec3::ONE)
    }

    #[test]
    fn the_pairs_are_those_of_a_comparison_of_all_boxes() {
        // Numbers that repeat, so that starts and ends meet; negative zero too.
        let mut state = 7u32;
        let mut next = |range: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from((state >> 16) % range)
        };
        for count in [0, 1, 2, 7, 30, 100, 400] {
            for extent in [1, 3, 20] {
                let boxes: Vec<(DVec3, DVec3)> = (0..count)
                    .map(|_| {
                        let low = DVec3::from_array([0; 3].map(|_| -next(extent)));
                        let size = DVec3::from_array([0; 3].map(|_| 1.0 + next(3) * next(extent)));
                        (low, low + size)
                    })
                    .collect();
                let mut expected = Vec::new();
                for (a, first) in boxes.iter().enumerate() {
                    for (b, second) in boxes.iter().enumerate().skip(a + 1) {
                        if first.0.cmplt(second.1).all() && second.0.cmplt(first.1).all() {
                            expected.push((a, b));
                        }
                    }
                }
                assert_eq!(pairs_of(&boxes).0, expected, "{count} in {extent}");
            }
        }
    }

    #[test]
    fn the_cost_is_near_linear_however_boxes_lie() {
        let count = 20_000;
        let numbers = || (0..count).map(f64::from);
        let side = 142.0;
        let across = |k: f64| [k % side, (k / side).floor()];
        let rows = [0, 1, 2].map(|axis| {
            let unit_at = |k| {
                let low = DVec3::AXES[axis] * k;
                (low, low + DVec3::ONE)
            };
            numbers().map(unit_at).collect::<Vec<_>>()
        });
        let sheets = [0, 1, 2].map(|axis| {
            let unit_at = |k| {
                let [u, v] = across(k);
                let mut low = DVec3::ZERO;
                low[(axis + 1) % 3] = u;
                low[(axis + 2) % 3] = v;
                (low, low + DVec3::ONE)
            };
            numbers().map(unit_at).collect::<Vec<_>>()
        });
        let cube =
            numbers().map(|k| unit(k % 27.0, (k / 27.0).floor() % 27.0, (k / 729.0).floor()));
        let mut covered = rows[0].clone();
        covered.push((DVec3::splat(-1.0), DVec3::splat(f64::from(count) + 2.0)));
        // Rods of three directions that pass each other.
        let length = DVec3::splat(3.0 * side);
        let rods = numbers().map(|k| {
            let axis = k as usize % 3;
            let [u, v] = across((k / 3.0).floor());
            let mut low = DVec3::ZERO;
            low[(axis + 1) % 3] = 3.0 * u;
            low[(axis + 2) % 3] = 3.0 * v + 1.0;
            let mut high = low + DVec3::ONE;
            high[axis] = length[axis];
            (low, high)
        });
        let stairs = numbers().map(|k| unit(0.7 * k, 0.6 * k, 0.5 * k));
        let cases = rows.into_iter().chain(sheets).chain([
            cube.collect(),
            covered,
            rods.collect(),
            stairs.collect(),
        ]);
        for (case, boxes) in cases.enumerate() {
            let (pairs, comparisons) = pairs_of(&boxes);
            let allowed = allowed(boxes.len(), pairs.len());
            assert!(
                comparisons <= allowed,
                "case {case}: {comparisons} over {allowed}"
            );
        }
    }

    #[test]
    fn the_first_error_ends_the_search() {
        let boxes = vec![unit(0.0, 0.0, 0.0); 100_000];
        let mut visits = 0;
        let result = for_each_pair(&boxes, |_, _| {
            visits += 1;
            Err(())
        });
        assert_eq!((result, visits), (Err(()), 1));
    }
}
