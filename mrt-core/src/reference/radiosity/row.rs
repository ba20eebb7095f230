//! One row of the transport: the form factors from a receiving texel to all sending texels.

use super::quarters::Quarters;

/// Form factors to runs of consecutive senders, at most one run for each wall, and corrections for near
/// senders.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    runs: Vec<Run>,
    /// Form factors of all runs, one after another.
    values: Vec<f32>,
    near: Vec<NearSender>,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    first_sender: u32,
    length: u32,
}

/// Form factors to the quarters of a sender.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearSender {
    pub(super) sender: u32,
    pub(super) factors: [f32; 4],
}

impl Row {
    /// A row without runs.
    pub(super) fn new(near: Vec<NearSender>) -> Self {
        Self {
            near,
            ..Self::default()
        }
    }

    /// Appends the factors of a wall, whose first texel is `first_sender`, from the first positive one to
    /// the last.
    pub(super) fn push_wall(&mut self, first_sender: usize, factors: &[f64]) {
        let first = factors.iter().position(|&x| x > 0.0);
        let last = factors.iter().rposition(|&x| x > 0.0);
        if let (Some(first), Some(last)) = (first, last) {
            self.runs.push(Run {
                first_sender: (first_sender + first) as u32,
                length: (last - first + 1) as u32,
            });
            self.values
                .extend(factors[first..=last].iter().map(|&x| x as f32));
        }
    }

    /// Returns memory that the row does not need.
    pub(super) fn shrink_to_fit(&mut self) {
        self.values.shrink_to_fit();
    }

    /// Bytes of the stored factors.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.values.as_slice())
            + size_of_val(self.runs.as_slice())
            + size_of_val(self.near.as_slice())
    }

    /// The form factor to a sender, 0 outside all runs.
    pub(super) fn factor(&self, sender: usize) -> f64 {
        let mut from = 0;
        for run in &self.runs {
            let (start, length) = (run.first_sender as usize, run.length as usize);
            if (start..start + length).contains(&sender) {
                return f64::from(self.values[from + sender - start]);
            }
            from += length;
        }
        0.0
    }

    /// Irradiance from the radiosity of every texel: its quarters and their means.
    pub(super) fn gather(&self, means: &[f64], radiosity: &[Quarters]) -> f64 {
        let mut sum = 0.0;
        let mut values = self.values.as_slice();
        for run in &self.runs {
            let (start, length) = (run.first_sender as usize, run.length as usize);
            let (factors, rest) = values.split_at(length);
            values = rest;
            sum += run_product(factors, &means[start..start + length]);
        }
        for near in &self.near {
            let sender = near.sender as usize;
            for (&factor, quarter) in near.factors.iter().zip(radiosity[sender]) {
                sum += f64::from(factor) * (quarter - means[sender]);
            }
        }
        sum
    }
}

/// Sum of products in four interleaved partial sums, which hide the latency of the additions.
fn run_product(factors: &[f32], means: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (factors, means) in factors.chunks(4).zip(means.chunks(4)) {
        for ((sum, &factor), mean) in sums.iter_mut().zip(factors).zip(means) {
            *sum += f64::from(factor) * mean;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}
