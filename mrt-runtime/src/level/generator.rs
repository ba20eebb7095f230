//! Mazes of any size, for measurements.

use crate::level::block::{Level, MAX_BLOCKS};
use glam::Vec3;
use std::collections::BTreeSet;

/// Share of the walls between neighbouring cells that a maze leaves out to make loops, once all cells are joined.
const LOOPS: f64 = 0.1;

/// A flat, nearly square maze of `count` cells of 1 m, with corridors, bends, junctions and some loops. The same `seed`
/// gives the same maze on every machine. `count` is clamped to 1 ..= [`MAX_BLOCKS`].
pub fn maze(count: usize, albedo: Vec3, seed: u64) -> Level {
    let count = count.clamp(1, MAX_BLOCKS);
    let width = (1..).find(|w| w * w >= count).unwrap_or(count);
    let mut random = SplitMix(seed);
    let mut joined = BTreeSet::new();
    let neighbours = |cell: usize| {
        let (x, z) = (cell % width, cell / width);
        let sides = [
            (x > 0).then(|| cell - 1),
            (x + 1 < width).then_some(cell + 1),
            (z > 0).then(|| cell - width),
            Some(cell + width),
        ];
        sides.into_iter().flatten().filter(|&next| next < count)
    };
    // A walk depth first from the first cell makes long corridors and reaches every cell.
    let mut seen = vec![false; count];
    seen[0] = true;
    let mut trail = vec![0];
    while let Some(&cell) = trail.last() {
        let unseen: Vec<usize> = neighbours(cell).filter(|&next| !seen[next]).collect();
        if unseen.is_empty() {
            trail.pop();
            continue;
        }
        let next = unseen[random.below(unseen.len())];
        seen[next] = true;
        joined.insert((cell.min(next), cell.max(next)));
        trail.push(next);
    }
    for cell in 0..count {
        for next in neighbours(cell).filter(|&next| next > cell) {
            if (random.below(1 << 20) as f64) < LOOPS * f64::from(1 << 20) {
                joined.insert((cell, next));
            }
        }
    }
    let cells: Vec<[i32; 3]> = (0..count)
        .map(|cell| [(cell % width) as i32, 0, (cell / width) as i32])
        .collect();
    Level::from_joined_cells(&cells, albedo, |a, b| {
        joined.contains(&(a.min(b), a.max(b)))
    })
    .expect("cells differ, and any flat cell has a shape")
}

/// Random numbers by SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
struct SplitMix(u64);

impl SplitMix {
    /// A number below `count`.
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % count as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_maze_is_sound_and_in_one_piece() {
        for count in [1, 2, 5, 41, 300] {
            let level = maze(count, Vec3::splat(0.5), 7);
            assert_eq!(level.check(), Ok(()));
            let neighbours = level.neighbours();
            let mut reached = BTreeSet::from([0]);
            let mut next = vec![0];
            while let Some(block) = next.pop() {
                let ways = neighbours[block].iter().flatten();
                next.extend(ways.map(|o| o.block).filter(|&b| reached.insert(b)));
            }
            assert_eq!(reached.len(), count);
        }
        assert_eq!(maze(41, Vec3::ONE, 1), maze(41, Vec3::ONE, 1));
    }
}
