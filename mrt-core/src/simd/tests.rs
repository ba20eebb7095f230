//! Every level against the scalar reference, and the reference against sums in `f64`.

use super::*;

/// Every operation on 16 numbers; the results one after another.
struct Everything<'a> {
    a: &'a [f32; 16],
    b: &'a [f32; 16],
    halves: &'a [u16; 16],
    bytes: &'a [i8; 16],
}

impl Kernel for Everything<'_> {
    type Output = Vec<f32>;
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Vec<f32> {
        let mut out = vec![0.0; 13 * 16];
        for at in (0..16).step_by(L::N) {
            let (a, b) = (l.load(&self.a[at..]), l.load(&self.b[at..]));
            let results = [
                l.splat(self.a[3]),
                l.load_f16(&self.halves[at..]),
                l.load_i8(&self.bytes[at..]),
                l.add(a, b),
                l.sub(a, b),
                l.mul(a, b),
                l.div(a, b),
                l.mul_add(a, b, a),
                l.sqrt(l.abs(a)),
                l.max(a, b),
                l.min(a, b),
                l.abs(a),
                l.keep_where_ge(a, b, a),
            ];
            for (k, v) in results.into_iter().enumerate() {
                l.store(&mut out[16 * k + at..], v);
            }
        }
        out
    }
}

/// Sums and the largest of 16 numbers, vector by vector.
struct Reductions<'a>(&'a [f32; 16]);

impl Kernel for Reductions<'_> {
    type Output = (f32, f32, [f32; 4]);
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Self::Output {
        let starts = || (0..16).step_by(L::N);
        let sum = starts().map(|at| l.sum(l.load(&self.0[at..]))).sum();
        let largest = starts().map(|at| l.largest(l.load(&self.0[at..])));
        let mut four = [0.0; 4];
        for at in starts() {
            let v = l.load(&self.0[at..]);
            let scaled = [1.0, 2.0, 3.0, 4.0].map(|scale| l.mul(v, l.splat(scale)));
            for (sum, more) in four.iter_mut().zip(l.sum_four(scaled)) {
                *sum += more;
            }
        }
        (sum, largest.fold(f32::MIN, f32::max), four)
    }
}

#[test]
fn operations_of_every_level_agree_with_the_reference() {
    let a = std::array::from_fn(|k| 0.37 * k as f32 - 2.5);
    let b = std::array::from_fn(|k| 1.9 - 0.21 * (k * k) as f32);
    let halves = std::array::from_fn(|k| half::f16::from_f32(a[k] * 1e-4).to_bits());
    let bytes = std::array::from_fn(|k| (17 * k as i32 - 127) as i8);
    let everything = || Everything {
        a: &a,
        b: &b,
        halves: &halves,
        bytes: &bytes,
    };
    let expected = SimdLevel::Scalar.run(everything());
    for level in SimdLevel::available() {
        let found = level.run(everything());
        for (k, (x, y)) in expected.iter().zip(&found).enumerate() {
            // A fused product and sum has one rounding less. All other operations round correctly.
            let slack = if k / 16 == 7 { 1e-6 } else { 0.0 };
            assert!(
                (x - y).abs() <= slack * (1.0 + x.abs()),
                "{level:?}: operation {}, lane {}: {x} and {y}",
                k / 16,
                k % 16
            );
        }
        let (sum, largest, four) = level.run(Reductions(&a));
        let exact = a.iter().sum::<f32>();
        assert!((sum - exact).abs() < 1e-4);
        for (sum, scale) in four.iter().zip([1.0, 2.0, 3.0, 4.0]) {
            assert!((sum - scale * exact).abs() < 4e-4, "{level:?}: {four:?}");
        }
        assert_eq!(largest, a[15]);
    }
}

#[test]
fn every_finite_half_precision_number_decodes() {
    for bits in 0..=u16::MAX {
        let expected = half::f16::from_bits(bits);
        if expected.is_finite() {
            assert_eq!(
                f32_from_f16_bits(bits).to_bits(),
                expected.to_f32_const().to_bits()
            );
        }
    }
}

#[test]
fn detected_levels_are_available_and_within_their_cap() {
    assert!(SimdLevel::detect().is_available());
    assert_eq!(SimdLevel::capped(SimdLevel::Scalar), SimdLevel::Scalar);
    for cap in SimdLevel::ALL {
        assert!(SimdLevel::capped(cap).lanes() <= cap.lanes());
        assert!(SimdLevel::capped(cap).is_available());
        assert_eq!(SimdLevel::from_name(cap.name()), Some(cap));
    }
}

fn out(sums: &mut [[f32; tiles::TILE]; 3]) -> tiles::TileOut<'_> {
    sums.each_mut().map(|sums| &mut sums[..])
}

/// A tile or half tile times three vectors. Every sum must be overwritten, so the 0.5 never shows.
struct Tile<'a, E> {
    panel: &'a [E],
    columns: tiles::Columns<'a>,
    x: &'a [f32],
    is_half: bool,
    finish: Option<tiles::Finish<'a>>,
}

impl<E: tiles::PackedNumber> Kernel for Tile<'_, E> {
    type Output = [[f32; tiles::TILE]; 3];
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> [[f32; tiles::TILE]; 3] {
        let mut sums = [[0.5; tiles::TILE]; 3];
        let x = tiles::Rgb::new(self.x, self.x.len() / 3);
        let columns = self.columns;
        let once = std::iter::once(tiles::Term {
            panel: self.panel,
            columns,
            x,
            scales: &[],
        });
        if self.is_half {
            tiles::sum_half_tile(l, once, self.finish, out(&mut sums));
        } else {
            tiles::sum_tile(l, once, self.finish, out(&mut sums));
        }
        sums
    }
}

/// Rows times three vectors.
struct Dot<'a> {
    rows: &'a [f32],
    x: [&'a [f32]; 3],
}

impl Kernel for Dot<'_> {
    type Output = [[f32; rows::DOT_ROWS]; 3];
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Self::Output {
        rows::dot_rows(l, self.rows.len() / self.x[0].len(), self.rows, self.x)
    }
}

/// Fixed numbers in [-1, 1).
fn numbers(count: usize) -> Vec<f32> {
    (0..count)
        .map(|k| ((k * 7919 + 13) % 2048) as f32 / 1024.0 - 1.0)
        .collect()
}

#[test]
fn tiles_are_products_at_every_level_for_any_number_of_columns() {
    for count in 0..11 {
        let columns: Vec<u32> = (0..count).map(|k| (k * 5 % 12) as u32).collect();
        let mut lists = tiles::ColumnLists::default();
        let range = lists.push(columns.iter().copied());
        let x = numbers(36);
        let panel = numbers(count * 16);
        let others = numbers(64);
        for (is_half, rows) in [(false, 16), (true, 8)] {
            for level in SimdLevel::available() {
                let run = |finish| {
                    level.run(Tile {
                        panel: &panel,
                        columns: lists.get(range.clone()),
                        x: &x,
                        is_half,
                        finish,
                    })
                };
                let factors = &others[..rows];
                let own = [1, 2, 3].map(|channel| &others[16 * channel..][..rows]);
                let scale = 0.75;
                let finish = tiles::Finish {
                    scale,
                    factors,
                    own,
                };
                let (found, finished) = (run(None), run(Some(finish)));
                for channel in 0..3 {
                    // A half tile does not write the rows beyond its own.
                    for row in 0..rows {
                        let product = |(k, &column): (usize, &u32)| {
                            let x = x[channel * 12 + column as usize];
                            f64::from(panel[k * rows + row]) * f64::from(x)
                        };
                        let sum: f64 = columns.iter().enumerate().map(product).sum();
                        let factor = f64::from(scale) * f64::from(factors[row]);
                        let expected = [sum, sum * factor + f64::from(own[channel][row])];
                        for (found, expected) in [found, finished].iter().zip(expected) {
                            let apart = (f64::from(found[channel][row]) - expected).abs();
                            // Numbers of size 1, fourteen roundings of 6e-8.
                            assert!(apart < 2e-6, "{level:?}, {count} columns: {apart}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn dot_products_of_every_level_agree_with_sums_in_f64() {
    let (all, x) = (numbers(4 * 80), numbers(3 * 80));
    let x = std::array::from_fn(|c| &x[c * 80..(c + 1) * 80]);
    let cases = (1..=4).flat_map(|count| SimdLevel::available().map(move |level| (count, level)));
    for (count, level) in cases {
        let rows = &all[..count * 80];
        let found = level.run(Dot { rows, x });
        for (channel, found) in found.iter().enumerate() {
            for (row, &found) in found.iter().enumerate() {
                let products = rows.get(row * 80..).into_iter().flatten().zip(x[channel]);
                let sum: f64 = products.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
                // Eighty numbers of size 1 in `f32`. Rows beyond `count` give zero.
                assert!((f64::from(found) - sum).abs() < 2e-5, "{level:?}");
            }
        }
    }
}

/// Rows with vectors of their own.
struct Unlike<'a> {
    rows: &'a [f32],
    x: &'a [f32],
    starts: [usize; rows::DOT_ROWS],
}

impl Kernel for Unlike<'_> {
    type Output = [[f32; rows::DOT_ROWS]; 3];
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Self::Output {
        rows::dot_unlike_rows(l, self.rows, self.x, self.starts, 80)
    }
}

#[test]
fn rows_with_vectors_of_their_own_agree_with_sums_in_f64() {
    let (rows, x) = (numbers(4 * 80), numbers(6 * 80));
    let starts = [240, 0, 16, 240];
    for level in SimdLevel::available() {
        let found = level.run(Unlike {
            rows: &rows,
            x: &x,
            starts,
        });
        for (channel, found) in found.iter().enumerate() {
            for (row, &found) in found.iter().enumerate() {
                let x = &x[starts[row] + channel * 80..];
                let products = rows[row * 80..(row + 1) * 80].iter().zip(x);
                let sum: f64 = products.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
                // Eighty numbers of size 1 in `f32`.
                assert!((f64::from(found) - sum).abs() < 2e-5, "{level:?}");
            }
        }
    }
}
