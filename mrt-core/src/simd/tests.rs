use super::*;

/// Every operation on 16 numbers, results one after another.
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

/// Sums and largest of each vector of 16 numbers.
struct Reductions<'a>(&'a [f32; 16]);

impl Kernel for Reductions<'_> {
    type Output = (f32, f32);
    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> (f32, f32) {
        let starts = || (0..16).step_by(L::N);
        let sum = starts().map(|at| l.sum(l.load(&self.0[at..]))).sum();
        let largest = starts().map(|at| l.largest(l.load(&self.0[at..])));
        (sum, largest.fold(f32::MIN, f32::max))
    }
}

#[test]
fn every_operation_of_every_level_is_that_of_the_reference() {
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
            // One rounding less where products and sums are fused; all else is rounded correctly everywhere.
            let slack = if k / 16 == 7 { 1e-6 } else { 0.0 };
            assert!(
                (x - y).abs() <= slack * (1.0 + x.abs()),
                "{level:?}: operation {}, lane {}: {x} and {y}",
                k / 16,
                k % 16
            );
        }
        let (sum, largest) = level.run(Reductions(&a));
        assert!((sum - a.iter().sum::<f32>()).abs() < 1e-4);
        assert_eq!(largest, a[15]);
    }
}

#[test]
fn all_halves_that_are_numbers_decode() {
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
fn what_is_detected_runs_and_caps_hold() {
    assert!(SimdLevel::detect().is_available());
    assert_eq!(SimdLevel::capped(SimdLevel::Scalar), SimdLevel::Scalar);
    for cap in SimdLevel::ALL {
        assert!(SimdLevel::capped(cap).lanes() <= cap.lanes());
        assert!(SimdLevel::capped(cap).is_available());
        assert_eq!(SimdLevel::from_name(cap.name()), Some(cap));
    }
}
