//! A logarithmic axis.

/// A logarithmic axis.
pub(super) struct LogAxis {
    /// Decimal logarithms at both ends.
    range: [f64; 2],
    /// Pixels at both ends.
    pixels: [f32; 2],
}

impl LogAxis {
    /// An axis that shows all positive values.
    pub(super) fn new(values: impl Iterator<Item = f64>, pixels: [f32; 2]) -> Self {
        let logarithms = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        // Points keep off the frame, and at least half a decade is shown.
        let margin = (0.25 - 0.5 * (high - low))
            .max(0.06 * (high - low))
            .max(0.1);
        Self {
            range: [low - margin, high + margin],
            pixels,
        }
    }

    /// Pixel of a value.
    pub(super) fn place(&self, value: f64) -> f32 {
        let [low, high] = self.range;
        let share = (value.max(1e-300).log10() - low) / (high - low);
        self.pixels[0] + share as f32 * (self.pixels[1] - self.pixels[0])
    }

    /// Values to name: powers of ten, and some between them where there is room.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        let steps: &[f64] = match high - low {
            4.0.. => &[1.0],
            1.0..4.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        };
        let powers = low.floor() as i32..=high.ceil() as i32;
        powers
            .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
            .filter(|value| (low..=high).contains(&value.log10()))
            .collect()
    }
}

/// A value in one or two digits, without an exponent where that is short.
pub(super) fn tick(value: f64) -> String {
    if value >= 1e7 {
        return format!("{value:.0e}");
    }
    // Values between powers of ten are computed and may be off by a rounding.
    let rounded = format!("{value:.9}");
    rounded
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_on_their_axis_in_its_order() {
        let axis = LogAxis::new([0.03, 40.0].into_iter(), [0.0, 100.0]);
        let ticks = axis.ticks();
        assert!(ticks.len() > 3);
        let places: Vec<f32> = ticks.iter().map(|&t| axis.place(t)).collect();
        assert!(places.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(places.iter().all(|p| (0.0..=100.0).contains(p)));
        assert_eq!(tick(0.05), "0.05");
        assert_eq!(tick(200.0), "200");
    }
}
