//! A figure that the frame is held to, and how figures are written.

use super::record::{quoted, significant};
use super::timed_frame::{self, ALL_STAGES, INDIRECT_STAGES};
use super::timing::Times;
use mrt_editor::cli::table::Table;
use serde::Serialize;
use std::fmt::Write;

/// A limit of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// The figure must not be larger.
    AtMost(f64),
    /// The figure must not be smaller.
    AtLeast(f64),
}

/// A figure, its limit and whether it is met.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Goal {
    /// What was measured.
    pub figure: String,
    /// The limit, in words.
    pub asked: String,
    /// The value, by median times.
    pub measured: f64,
    /// The value by the shortest times, which other programs disturb less.
    pub of_fastest: f64,
    /// Whether `measured` is within the limit.
    pub met: bool,
    /// What the value is a ratio of.
    pub detail: String,
    /// Median times of the stages above and below the line, milliseconds; empty where there are none.
    pub stages_ms: [Vec<f64>; 2],
}

impl Goal {
    /// A figure with its value, by medians and by the shortest times.
    pub fn new(
        figure: &str,
        limit: Limit,
        [measured, of_fastest]: [f64; 2],
        detail: String,
    ) -> Self {
        let (asked, met) = match limit {
            Limit::AtMost(most) => (format!("at most {most}"), measured <= most),
            Limit::AtLeast(least) => (format!("at least {least}"), measured >= least),
        };
        Self {
            figure: figure.to_owned(),
            asked,
            measured,
            of_fastest,
            met,
            detail,
            stages_ms: [Vec::new(), Vec::new()],
        }
    }

    /// Adds a remark.
    pub fn with_remark(self, remark: &str) -> Self {
        let detail = format!("{}; {remark}", self.detail);
        Self { detail, ..self }
    }

    /// One time over another.
    pub fn ratio(figure: &str, limit: Limit, above: Timing, below: Timing) -> Self {
        let [a, b] = [above, below].map(|timing| timing.times.median(timing.stages));
        let [c, d] = [above, below].map(|timing| timing.times.smallest(timing.stages));
        let [x, y] = [a, b].map(|seconds| significant(1e3 * seconds));
        let stages = |timing: Timing| {
            let of_stage = |stage| 1e3 * timing.times.median(&[stage]);
            (0..timing.times.stages()).map(of_stage).collect()
        };
        Self {
            stages_ms: [above, below].map(stages),
            ..Self::new(figure, limit, [a / b, c / d], format!("{x} ms / {y} ms"))
        }
    }
}

/// Some stages of what was timed.
#[derive(Clone, Copy, Debug)]
pub struct Timing<'a> {
    /// Times of all stages.
    pub times: &'a Times,
    /// The stages that count.
    pub stages: &'a [usize],
}

/// From direct light to indirect light of a frame.
pub fn indirect(times: &Times) -> Timing<'_> {
    let stages = &INDIRECT_STAGES;
    Timing { times, stages }
}

/// A whole frame.
pub fn whole(times: &Times) -> Timing<'_> {
    let stages = &ALL_STAGES;
    Timing { times, stages }
}

/// All figures, one a line.
pub fn csv(goals: &[Goal]) -> String {
    let mut text = "figure,asked,measured,of_fastest,met,detail\n".to_owned();
    for goal in goals {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{}",
            quoted(&goal.figure),
            goal.asked,
            goal.measured,
            goal.of_fastest,
            goal.met,
            quoted(&goal.detail)
        );
    }
    text
}

/// All figures for people.
pub fn table(goals: &[Goal]) -> Table {
    let mut table = Table::new(&["figure", "asked", "measured", "of fastest", "met", "detail"]);
    for goal in goals {
        table.row([
            goal.figure.clone(),
            goal.asked.clone(),
            significant(goal.measured),
            significant(goal.of_fastest),
            if goal.met { "yes" } else { "no" }.to_owned(),
            goal.detail.clone(),
        ]);
    }
    table
}

/// Stages of the times that figures compare, above and below the line.
pub fn stages(goals: &[Goal]) -> Table {
    let heads = [&["stages, ms", ""][..], &timed_frame::STAGES].concat();
    let mut table = Table::new(&heads);
    for goal in goals {
        for (stages, side) in goal.stages_ms.iter().zip(["above", "below"]) {
            // The paper's products begin after direct light, so they have fewer stages.
            let skipped = usize::from(stages.len() < timed_frame::STAGES.len());
            if stages.is_empty() {
                continue;
            }
            let blanks = std::iter::repeat_n(String::new(), skipped);
            let times = stages.iter().map(|&ms| significant(ms));
            let names = [goal.figure.clone(), side.to_owned()];
            table.row(names.into_iter().chain(blanks).chain(times));
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_met_on_its_own_side_and_nan_never_meets_one() {
        let goal = |limit, value| Goal::new("a, b", limit, [value; 2], String::new());
        assert!(goal(Limit::AtMost(0.4), 0.4).met);
        assert!(!goal(Limit::AtMost(0.4), 0.5).met);
        assert!(goal(Limit::AtLeast(2.0), 2.5).met);
        assert!(!goal(Limit::AtLeast(2.0), f64::NAN).met);
        let text = csv(&[goal(Limit::AtMost(0.4), 0.5)]);
        assert!(
            text.ends_with("\"a, b\",at most 0.4,0.5,0.5,false,\n"),
            "{text}"
        );
    }
}
