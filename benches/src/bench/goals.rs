//! What the frame is held to: times as multiples of other times, measured in turns with what they are compared with, and
//! bytes.

use super::machine::Shared;
use super::measure::{Bench, MeasureError};
use super::ours::{self, ALL_STAGES, INDIRECT_STAGES, Motion, Ours, Packing, Variant};
use super::paper::{self, Paper};
use super::record::{quoted, significant};
use super::reference::Reference;
use super::setting::Setting;
use super::timing::{Timed, Times, in_turns};
use mrt_core::simd::SimdLevel;
use mrt_editor::cli::table::Table;
use mrt_runtime::{Coupling, Dictionary};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// A limit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Limit {
    AtMost(f64),
    AtLeast(f64),
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Goal {
    /// What was measured.
    pub figure: String,
    /// Its limit, in words.
    pub asked: String,
    /// Its value, by medians where it is a time.
    pub measured: f64,
    /// The same by the shortest times, which other programs disturb less.
    pub of_fastest: f64,
    /// Whether `measured` is within the limit.
    pub met: bool,
    /// What it is a ratio of.
    pub detail: String,
    /// Median times of the stages of both, milliseconds; empty where they have none.
    pub stages_ms: [Vec<f64>; 2],
}

impl Goal {
    fn new(figure: &str, limit: Limit, [measured, of_fastest]: [f64; 2], detail: String) -> Self {
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

    /// A time over another.
    fn ratio(figure: &str, limit: Limit, above: Timing, below: Timing) -> Self {
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
#[derive(Clone, Copy)]
struct Timing<'a> {
    times: &'a Times,
    stages: &'a [usize],
}

fn indirect(times: &Times) -> Timing<'_> {
    let stages = &INDIRECT_STAGES;
    Timing { times, stages }
}

fn whole(times: &Times) -> Timing<'_> {
    let stages = &ALL_STAGES;
    Timing { times, stages }
}

/// Dictionaries of the presets that figures speak of.
#[derive(Clone, Copy, Debug)]
pub struct Presets<'a> {
    /// With 32 modes.
    pub standard: &'a Dictionary,
    /// The smallest.
    pub mobile: &'a Dictionary,
    /// With 64 modes; baking it takes a while.
    pub high: Option<&'a Dictionary>,
}

/// Blocks of the mazes that are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mazes {
    /// Of the usual one.
    pub usual: usize,
    /// Of the largest, and of what is made of islands of ten together.
    pub large: usize,
}

impl Mazes {
    /// What the frame is held to.
    pub const FULL: Mazes = Mazes {
        usual: 41,
        large: 10_000,
    };
    /// A look at all figures, in less time.
    pub const QUICK: Mazes = Mazes {
        usual: 11,
        large: 1000,
    };
}

/// All products of the paper's way.
const PAPER_STAGES: [usize; paper::STAGES.len()] = [0, 1, 2];

/// Steps of [`Bench::goals`].
const STEPS: usize = 8;

/// A tolerance, of the brightest indirect irradiance: far below what an eye sees and operators err by.
const TOLERANCE: f32 = 1e-3;

/// Bytes of operators that the usual maze may take, in units of 1e6.
const MEGABYTES: f64 = 3.0;

/// Lights of the usual maze.
const FOUR_LIGHTS: usize = 4;

/// Lights that are close together, in a small and in a large level.
const LIGHTS_TOGETHER: usize = 10;

impl Bench<'_> {
    /// Measures all figures that the machine and the dictionaries allow; what is left out is said on standard error.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn goals(
        &mut self,
        presets: Presets,
        mazes: Mazes,
        kept: &Path,
    ) -> Result<Vec<Goal>, MeasureError> {
        let Mazes { usual, large } = mazes;
        let maze = format!("maze{usual}");
        let mut goals = Vec::new();
        let mut step = 0;
        let mut next = |what: &str| {
            step += 1;
            self.progress.step(what, step, STEPS)
        };
        next(&format!("{maze}, a light in every block"))?;
        let lit = Setting::new(usual, Some(usual));
        let usual = Setting::new(usual, Some(FOUR_LIGHTS));
        let standard = fastest("standard", presets.standard);
        self.against_paper(presets, &lit, kept, &mut goals)?;

        next(&format!("{maze}, mobile"))?;
        let small = fastest("mobile", presets.mobile);
        for simd in SimdLevel::available() {
            let [small, large] = [small, standard].map(|variant| Variant { simd, ..variant });
            let most = Limit::AtMost(0.12);
            let mut hold = |setting: &Setting, what: &str, of: fn(&Times) -> Timing<'_>| {
                let [small, large] = self.pair((setting, small), (setting, large))?;
                let figure = format!("{maze}, {what}, {}: mobile / standard", simd.name());
                goals.push(Goal::ratio(&figure, most, of(&small), of(&large)));
                Ok::<_, MeasureError>(())
            };
            hold(&lit, "all lit, indirect", indirect)?;
            hold(&usual, "four lamps, indirect", indirect)?;
            hold(&usual, "four lamps, frame", whole)?;
        }

        next(&format!("{maze}, one light moves"))?;
        let mut moving = new(&usual, &standard)?.with_motion(Motion::OneLight);
        let tolerant = new(&usual, &standard)?.with_motion(Motion::OneLight);
        let mut tolerant = tolerant.with_tolerance(TOLERANCE).map_err(|source| {
            let case = format!("{}/{}", usual.name, standard.name());
            MeasureError::Ours { case, source }
        })?;
        let mut anew = new(&usual, &standard)?;
        let mut subjects: [&mut dyn Timed; 3] = [&mut moving, &mut tolerant, &mut anew];
        let times = in_turns(&mut subjects, self.budget, self.progress)?;
        moving.go();
        tolerant.go();
        let errs = tolerant.largest_difference(&moving);
        for (times_of, how) in [
            (&times[0], "to the bit".to_owned()),
            (&times[1], format!("within {TOLERANCE} of the brightest")),
        ] {
            goals.push(Goal::ratio(
                &format!("{maze}, frame: one of four lights moves, {how} / everything anew"),
                Limit::AtMost(0.4),
                whole(times_of),
                whole(&times[2]),
            ));
        }
        goals.push(Goal::new(
            &format!(
                "{maze}, one of four lights moves: largest error of a texel, of what the tolerance states"
            ),
            Limit::AtMost(1.0),
            [errs / tolerant.stated_error(); 2],
            String::new(),
        ));

        next("instructions")?;
        for (slow, fast, least) in [
            (SimdLevel::Scalar, SimdLevel::Sse2, 2.5),
            (SimdLevel::Sse2, SimdLevel::Avx2, 2.0),
        ] {
            if !fast.is_available() {
                eprintln!(
                    "mrt-bench: {} / {} is left out: this machine has no {}",
                    slow.name(),
                    fast.name(),
                    fast.name()
                );
                continue;
            }
            for storage in [Packing::Mixed, Packing::F32] {
                let with = |simd| Variant {
                    simd,
                    storage,
                    ..standard
                };
                let [a, b] = self.pair((&lit, with(slow)), (&lit, with(fast)))?;
                let figure = format!(
                    "{maze} all lit, indirect, {}: {} / {}",
                    storage.name(),
                    slow.name(),
                    fast.name()
                );
                let limit = Limit::AtLeast(least);
                goals.push(Goal::ratio(&figure, limit, indirect(&a), indirect(&b)));
            }
        }

        next("operators")?;
        for storage in [Packing::F16, Packing::Mixed] {
            let ours = new(
                &usual,
                &Variant {
                    storage,
                    ..standard
                },
            )?;
            let bytes = ours.scene.operator_bytes() as f64 / 1e6;
            goals.push(Goal::new(
                &format!("{maze}, {}: MB of operators", storage.name()),
                Limit::AtMost(MEGABYTES),
                [bytes; 2],
                String::new(),
            ));
        }

        let thousand = format!("maze{}", large / 10);
        next(&format!("{thousand}, two threads"))?;
        if std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 1) {
            let level = Setting::new(large / 10, None);
            let two = Variant {
                threads: 2,
                ..standard
            };
            let (mut one, mut two) = (new(&level, &standard)?, new(&level, &two)?);
            let (mut alone, mut shared) = (Shared::new(1)?, Shared::new(2)?);
            let mut subjects: [&mut dyn Timed; 4] = [&mut one, &mut two, &mut alone, &mut shared];
            let times = in_turns(&mut subjects, self.budget, self.progress)?;
            let [one, two, alone, shared] = [0, 1, 2, 3].map(|k| &times[k]);
            let at_most = significant(alone.median(&[0]) / shared.median(&[0]));
            for (of, what) in [indirect, whole].into_iter().zip(["indirect", "frame"]) {
                let figure = format!("{thousand}, {what}: one thread / two threads");
                let goal = Goal::ratio(&figure, Limit::AtLeast(1.7), of(one), of(two));
                let detail = format!("{}; sums in registers {at_most}", goal.detail);
                goals.push(Goal { detail, ..goal });
            }
        } else {
            eprintln!("mrt-bench: two threads are left out: this machine has one core");
        }

        let islands = large / LIGHTS_TOGETHER;
        next(&format!("{islands} mazes of ten, ten blocks lit"))?;
        let many = Setting::islands(islands, LIGHTS_TOGETHER);
        let one = Setting::islands(1, LIGHTS_TOGETHER);
        let mut many = new(&many, &standard)?.with_motion(Motion::AllLights);
        let mut one = new(&one, &standard)?.with_motion(Motion::AllLights);
        let [of_many, of_one] = self.times([&mut many, &mut one])?;
        let goal = Goal::ratio(
            &format!("ten lights move, frame: {islands} mazes of ten, one lit / one of them alone"),
            Limit::AtMost(2.0),
            whole(&of_many),
            whole(&of_one),
        );
        let lit = [many, one].map(|ours| ours.lit_blocks());
        let detail = format!("{}; {} and {} blocks lit", goal.detail, lit[0], lit[1]);
        goals.push(Goal { detail, ..goal });

        next(&format!("maze{large}, ten blocks lit"))?;
        let name = format!("ten lights close together move, frame: maze{large} / maze10");
        let large = Setting::together(large, LIGHTS_TOGETHER);
        let small = Setting::together(LIGHTS_TOGETHER, LIGHTS_TOGETHER);
        let mut large = new(&large, &standard)?.with_motion(Motion::AllLights);
        let mut small = new(&small, &standard)?.with_motion(Motion::AllLights);
        let [of_large, of_small] = self.times([&mut large, &mut small])?;
        let goal = Goal::ratio(
            &name,
            Limit::AtMost(2.0),
            whole(&of_large),
            whole(&of_small),
        );
        let lit = [large, small].map(|ours| ours.lit_blocks());
        let detail = format!("{}; {} and {} blocks lit", goal.detail, lit[0], lit[1]);
        goals.push(Goal { detail, ..goal });
        Ok(goals)
    }

    /// Standard, and high if there is one, against the paper's products of standard.
    fn against_paper(
        &mut self,
        presets: Presets,
        lit: &Setting,
        kept: &Path,
        goals: &mut Vec<Goal>,
    ) -> Result<(), MeasureError> {
        let standard = fastest("standard", presets.standard);
        let mut ours = new(lit, &standard)?;
        let mut paper = Paper::new(lit, presets.standard, &ours, &mut self.libraries)?;
        let mut high = match presets.high {
            Some(dictionary) => Some(new(lit, &fastest("high", dictionary))?),
            None => {
                eprintln!(
                    "mrt-bench: high / paper is left out: no dictionary of that preset (--dictionary FILE, or --presets \
                     high)"
                );
                None
            }
        };
        let mut subjects: Vec<&mut dyn Timed> = vec![&mut ours, &mut paper];
        subjects.extend(high.as_mut().map(|high| high as &mut dyn Timed));
        let times = in_turns(&mut subjects, self.budget, self.progress)?;
        let of_paper = Timing {
            times: &times[1],
            stages: &PAPER_STAGES,
        };
        goals.push(Goal::ratio(
            &format!("{} all lit, indirect: standard / paper dense", lit.name),
            Limit::AtMost(0.35),
            indirect(&times[0]),
            of_paper,
        ));
        let exact =
            Reference::load_or_solve(lit, ours.scene.level.resolution, kept, self.progress)?;
        let errors = [
            ours.irradiance(&exact.receivers),
            paper.irradiance(&ours.scene, &exact.receivers),
        ]
        .map(|light| exact.rel_l2(&light));
        let [x, y] = errors.map(|error| significant(100.0 * error));
        goals.push(Goal::new(
            &format!("{} all lit, error: standard / paper dense", lit.name),
            Limit::AtMost(1.0),
            [errors[0] / errors[1]; 2],
            format!("{x} % / {y} %"),
        ));
        if let Some(times) = times.get(2) {
            goals.push(Goal::ratio(
                &format!(
                    "{} all lit, indirect: high / paper dense of standard",
                    lit.name
                ),
                Limit::AtMost(1.0),
                indirect(times),
                of_paper,
            ));
        }
        Ok(())
    }

    /// Times of two frames in turns.
    fn pair(
        &self,
        first: (&Setting, Variant),
        second: (&Setting, Variant),
    ) -> Result<[Times; 2], MeasureError> {
        let mut first = new(first.0, &first.1)?;
        let mut second = new(second.0, &second.1)?;
        self.times([&mut first, &mut second])
    }

    fn times(&self, [first, second]: [&mut Ours; 2]) -> Result<[Times; 2], MeasureError> {
        let mut times = in_turns(&mut [first, second], self.budget, self.progress)?.into_iter();
        Ok(std::array::from_fn(|_| times.next().unwrap_or_default()))
    }
}

/// One thread, the best instructions, everything as games get it.
fn fastest<'a>(preset: &'a str, dictionary: &'a Dictionary) -> Variant<'a> {
    Variant {
        preset,
        dictionary,
        storage: Packing::Mixed,
        coupling: Coupling::Table,
        simd: SimdLevel::detect(),
        threads: 1,
    }
}

fn new(setting: &Setting, variant: &Variant) -> Result<Ours, MeasureError> {
    Ours::new(setting, variant).map_err(|source| MeasureError::Ours {
        case: format!("{}/{}", setting.name, variant.name()),
        source,
    })
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

/// Stages of whatever the figures compare, above and below the line.
pub fn stages(goals: &[Goal]) -> Table {
    let heads = [&["stages, ms", ""][..], &ours::STAGES].concat();
    let mut table = Table::new(&heads);
    for goal in goals {
        for (stages, side) in goal.stages_ms.iter().zip(["above", "below"]) {
            // The paper's products begin after direct light.
            let skipped = usize::from(stages.len() < ours::STAGES.len());
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
    fn limits_are_met_from_their_own_side() {
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
