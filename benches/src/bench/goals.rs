//! What the frame is held to: times as multiples of other times, measured in turns with what they are compared with, and
//! bytes.

use super::exact_light::ExactLight;
use super::frame_variant::{FrameVariant, Packing};
use super::goal::{Goal, Limit, Timing, indirect, whole};
use super::lit_maze::LitMaze;
use super::machine::Shared;
use super::measure::{Bench, timed_frame};
use super::measure_error::MeasureError;
use super::paper::{self, Paper};
use super::record::significant;
use super::timed_frame::{Motion, TimedFrame};
use super::timing::{Timed, Times, in_turns};
use mrt_core::simd::SimdLevel;
use mrt_dictionary::progress::Cancelled;
use mrt_editor::cli::output::warn;
use mrt_runtime::{Coupling, Dictionary};

/// Dictionaries of the presets that goals speak of.
#[derive(Clone, Copy, Debug)]
pub struct Presets<'a> {
    /// With 32 modes.
    pub standard: &'a Dictionary,
    /// The smallest.
    pub mobile: &'a Dictionary,
    /// With 64 modes; baking it takes a while.
    pub high: Option<&'a Dictionary>,
}

/// Sizes of the mazes that are measured, in blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mazes {
    /// The usual maze.
    pub usual: usize,
    /// The largest maze, and all islands of ten blocks together.
    pub large: usize,
}

impl Mazes {
    /// The mazes for which limits are stated.
    pub const FULL: Mazes = Mazes {
        usual: 41,
        large: 10_000,
    };
    /// Smaller mazes, for a look at all figures in less time.
    pub const QUICK: Mazes = Mazes {
        usual: 11,
        large: 1000,
    };
}

/// Steps of [`measure_goals`].
const STEPS: usize = 8;

/// A tolerance, as a share of the brightest indirect irradiance: far below what an eye sees and what operators err by.
const TOLERANCE: f32 = 1e-3;

/// Bytes of operators that the usual maze may take, in units of 1e6.
const MEGABYTES: f64 = 3.0;

/// Lights of the usual maze.
const FOUR_LIGHTS: usize = 4;

/// Lights that are close together, in a small and in a large level.
const LIGHTS_TOGETHER: usize = 10;

/// Measures all figures that the machine and the dictionaries allow, and names on standard error what is left out.
///
/// # Errors
/// [`MeasureError`].
pub fn measure_goals(
    bench: &mut Bench,
    presets: Presets,
    mazes: Mazes,
) -> Result<Vec<Goal>, MeasureError> {
    let mut goals = Goals {
        maze: format!("maze{}", mazes.usual),
        lit: LitMaze::new(mazes.usual, Some(mazes.usual)),
        usual: LitMaze::new(mazes.usual, Some(FOUR_LIGHTS)),
        standard: fastest("standard", presets.standard),
        bench,
        found: Vec::new(),
        step: 0,
    };
    goals.against_paper(presets)?;
    goals.mobile(presets)?;
    goals.one_light_moves()?;
    goals.instructions()?;
    goals.operators()?;
    goals.two_threads(mazes.large / 10)?;
    goals.islands(mazes.large / LIGHTS_TOGETHER)?;
    goals.large_maze(mazes.large)?;
    Ok(goals.found)
}

/// The figures measured so far, and what they are measured on.
struct Goals<'a, 'b> {
    bench: &'a mut Bench<'b>,
    /// Name of the usual maze.
    maze: String,
    /// The usual maze with a light in every block.
    lit: LitMaze,
    /// The usual maze with a few lights.
    usual: LitMaze,
    /// The standard preset as games get it, on one thread.
    standard: FrameVariant<'a>,
    found: Vec<Goal>,
    step: usize,
}

impl Goals<'_, '_> {
    fn next_step(&mut self, what: &str) -> Result<(), Cancelled> {
        self.step += 1;
        self.bench.progress.step(what, self.step, STEPS)
    }

    /// Standard, and high if there is one, against the paper's products of standard.
    fn against_paper(&mut self, presets: Presets) -> Result<(), MeasureError> {
        self.next_step(&format!("{}, a light in every block", self.maze))?;
        let lit = &self.lit;
        let mut frame = timed_frame(lit, &self.standard)?;
        let mut paper = Paper::new(lit, presets.standard, &frame, &mut self.bench.libraries)?;
        let mut high = match presets.high {
            Some(dictionary) => Some(timed_frame(lit, &fastest("high", dictionary))?),
            None => {
                warn(format_args!(
                    "high / paper is left out: no dictionary of that preset (--dictionary FILE, or --presets high)"
                ));
                None
            }
        };
        let mut subjects: Vec<&mut dyn Timed> = vec![&mut frame, &mut paper];
        subjects.extend(high.as_mut().map(|high| high as &mut dyn Timed));
        let times = in_turns(&mut subjects, self.bench.budget, self.bench.progress)?;
        let of_paper = Timing {
            times: &times[1],
            stages: &paper::ALL_STAGES,
        };
        let name = &lit.name;
        self.found.push(Goal::ratio(
            &format!("{name} all lit, indirect: standard / paper dense"),
            Limit::AtMost(0.35),
            indirect(&times[0]),
            of_paper,
        ));
        let exact = self.bench.exact_light(lit, frame.resolution())?;
        self.found
            .push(error_against_paper(name, &exact, &frame, &paper));
        if let Some(times) = times.get(2) {
            self.found.push(Goal::ratio(
                &format!("{name} all lit, indirect: high / paper dense of standard"),
                Limit::AtMost(1.0),
                indirect(times),
                of_paper,
            ));
        }
        Ok(())
    }

    /// Mobile against standard, with all instructions that the machine has.
    fn mobile(&mut self, presets: Presets) -> Result<(), MeasureError> {
        self.next_step(&format!("{}, mobile", self.maze))?;
        let mobile = fastest("mobile", presets.mobile);
        for simd in SimdLevel::available() {
            let variants = [mobile, self.standard].map(|variant| FrameVariant { simd, ..variant });
            let hold = |maze: &LitMaze, what: &str, of: fn(&Times) -> Timing<'_>| {
                let [mobile, standard] = self.pair(maze, variants)?;
                let name = &self.maze;
                let figure = format!("{name}, {what}, {}: mobile / standard", simd.name());
                let limit = Limit::AtMost(0.12);
                Ok::<_, MeasureError>(Goal::ratio(&figure, limit, of(&mobile), of(&standard)))
            };
            let goals = [
                hold(&self.lit, "all lit, indirect", indirect)?,
                hold(&self.usual, "four lamps, indirect", indirect)?,
                hold(&self.usual, "four lamps, frame", whole)?,
            ];
            self.found.extend(goals);
        }
        Ok(())
    }

    /// One of four lights moves: what a frame saves, to the bit and within a tolerance, and how far it then is off.
    fn one_light_moves(&mut self) -> Result<(), MeasureError> {
        self.next_step(&format!("{}, one light moves", self.maze))?;
        let frame = || timed_frame(&self.usual, &self.standard);
        let mut moving = frame()?.with_motion(Motion::OneLight);
        let tolerant = frame()?.with_motion(Motion::OneLight);
        let mut tolerant = tolerant.with_tolerance(TOLERANCE).map_err(|source| {
            let case = format!("{}/{}", self.usual.name, self.standard.name());
            MeasureError::Frame { case, source }
        })?;
        let mut anew = frame()?;
        let mut subjects: [&mut dyn Timed; 3] = [&mut moving, &mut tolerant, &mut anew];
        let times = in_turns(&mut subjects, self.bench.budget, self.bench.progress)?;
        moving.go();
        tolerant.go();
        let error = tolerant.largest_difference(&moving) / tolerant.stated_error();
        let maze = &self.maze;
        for (times_of, how) in [
            (&times[0], "to the bit".to_owned()),
            (&times[1], format!("within {TOLERANCE} of the brightest")),
        ] {
            self.found.push(Goal::ratio(
                &format!("{maze}, frame: one of four lights moves, {how} / everything anew"),
                Limit::AtMost(0.4),
                whole(times_of),
                whole(&times[2]),
            ));
        }
        self.found.push(Goal::new(
            &format!(
                "{maze}, one of four lights moves: largest error of a texel, of what the tolerance states"
            ),
            Limit::AtMost(1.0),
            [error; 2],
            String::new(),
        ));
        Ok(())
    }

    /// Slower instructions against faster ones.
    fn instructions(&mut self) -> Result<(), MeasureError> {
        self.next_step("instructions")?;
        for (slow, fast, least) in [
            (SimdLevel::Scalar, SimdLevel::Sse2, 2.5),
            (SimdLevel::Sse2, SimdLevel::Avx2, 2.0),
        ] {
            let [slow_name, fast_name] = [slow, fast].map(SimdLevel::name);
            if !fast.is_available() {
                warn(format_args!(
                    "{slow_name} / {fast_name} is left out: this machine has no {fast_name}"
                ));
                continue;
            }
            for storage in [Packing::Mixed, Packing::F32] {
                let variants = [slow, fast].map(|simd| FrameVariant {
                    simd,
                    storage,
                    ..self.standard
                });
                let [slow, fast] = self.pair(&self.lit, variants)?;
                self.found.push(Goal::ratio(
                    &format!(
                        "{} all lit, indirect, {}: {slow_name} / {fast_name}",
                        self.maze,
                        storage.name()
                    ),
                    Limit::AtLeast(least),
                    indirect(&slow),
                    indirect(&fast),
                ));
            }
        }
        Ok(())
    }

    /// Bytes of operators.
    fn operators(&mut self) -> Result<(), MeasureError> {
        self.next_step("operators")?;
        for storage in [Packing::F16, Packing::Mixed] {
            let variant = FrameVariant {
                storage,
                ..self.standard
            };
            let frame = timed_frame(&self.usual, &variant)?;
            let bytes = frame.scene.operator_bytes() as f64 / 1e6;
            self.found.push(Goal::new(
                &format!("{}, {}: MB of operators", self.maze, storage.name()),
                Limit::AtMost(MEGABYTES),
                [bytes; 2],
                String::new(),
            ));
        }
        Ok(())
    }

    /// One thread against two, on a machine with two cores.
    fn two_threads(&mut self, blocks: usize) -> Result<(), MeasureError> {
        let name = format!("maze{blocks}");
        self.next_step(&format!("{name}, two threads"))?;
        if !std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 1) {
            warn(format_args!(
                "two threads are left out: this machine has one core"
            ));
            return Ok(());
        }
        let maze = LitMaze::new(blocks, None);
        let two = FrameVariant {
            threads: 2,
            ..self.standard
        };
        let (mut one, mut two) = (
            timed_frame(&maze, &self.standard)?,
            timed_frame(&maze, &two)?,
        );
        let (mut alone, mut shared) = (Shared::new(1)?, Shared::new(2)?);
        let mut subjects: [&mut dyn Timed; 4] = [&mut one, &mut two, &mut alone, &mut shared];
        let times = in_turns(&mut subjects, self.bench.budget, self.bench.progress)?;
        let [one, two, alone, shared] = [0, 1, 2, 3].map(|k| &times[k]);
        let most = significant(alone.median(&[0]) / shared.median(&[0]));
        for (what, alone, shared) in [
            ("indirect", indirect(one), indirect(two)),
            ("frame", whole(one), whole(two)),
        ] {
            let figure = format!("{name}, {what}: one thread / two threads");
            let goal = Goal::ratio(&figure, Limit::AtLeast(1.7), alone, shared);
            self.found
                .push(goal.with_remark(&format!("sums in registers {most}")));
        }
        Ok(())
    }

    /// Many small mazes of which one is lit, against one of them.
    fn islands(&mut self, count: usize) -> Result<(), MeasureError> {
        self.next_step(&format!("{count} mazes of ten, ten blocks lit"))?;
        self.all_lights_move(
            &format!("ten lights move, frame: {count} mazes of ten, one lit / one of them alone"),
            [count, 1].map(|mazes| LitMaze::islands(mazes, LIGHTS_TOGETHER)),
        )
    }

    /// A large maze in which ten blocks close together are lit, against one of ten blocks.
    fn large_maze(&mut self, blocks: usize) -> Result<(), MeasureError> {
        self.next_step(&format!("maze{blocks}, ten blocks lit"))?;
        self.all_lights_move(
            &format!("ten lights close together move, frame: maze{blocks} / maze10"),
            [blocks, LIGHTS_TOGETHER].map(|blocks| LitMaze::together(blocks, LIGHTS_TOGETHER)),
        )
    }

    /// Frames of a large level over those of a small one, when all lights move.
    fn all_lights_move(&mut self, figure: &str, mazes: [LitMaze; 2]) -> Result<(), MeasureError> {
        let frame = |maze| timed_frame(maze, &self.standard);
        let [large, small] = mazes.each_ref().map(frame);
        let [mut large, mut small] =
            [large?, small?].map(|frame| frame.with_motion(Motion::AllLights));
        let [of_large, of_small] = self.times([&mut large, &mut small])?;
        let limit = Limit::AtMost(2.0);
        let goal = Goal::ratio(figure, limit, whole(&of_large), whole(&of_small));
        let [in_large, in_small] = [large, small].map(|frame| frame.lit_blocks());
        let remark = format!("{in_large} and {in_small} blocks lit");
        self.found.push(goal.with_remark(&remark));
        Ok(())
    }

    /// Times of two variants in turns.
    fn pair(
        &self,
        maze: &LitMaze,
        variants: [FrameVariant; 2],
    ) -> Result<[Times; 2], MeasureError> {
        let [first, second] = variants.map(|variant| timed_frame(maze, &variant));
        self.times([&mut first?, &mut second?])
    }

    fn times(&self, [first, second]: [&mut TimedFrame; 2]) -> Result<[Times; 2], MeasureError> {
        let (budget, progress) = (self.bench.budget, self.bench.progress);
        let mut times = in_turns(&mut [first, second], budget, progress)?.into_iter();
        Ok(std::array::from_fn(|_| times.next().unwrap_or_default()))
    }
}

/// One thread, the best instructions, everything else as games get it.
fn fastest<'a>(preset: &'a str, dictionary: &'a Dictionary) -> FrameVariant<'a> {
    FrameVariant {
        preset,
        dictionary,
        storage: Packing::Mixed,
        coupling: Coupling::Table,
        simd: SimdLevel::detect(),
        threads: 1,
    }
}

fn error_against_paper(name: &str, exact: &ExactLight, frame: &TimedFrame, paper: &Paper) -> Goal {
    let [ours, theirs] = [
        frame.irradiance(&exact.texels),
        paper.irradiance(&frame.scene, &exact.texels),
    ]
    .map(|light| exact.rel_l2(&light));
    let [x, y] = [ours, theirs].map(|error| significant(100.0 * error));
    Goal::new(
        &format!("{name} all lit, error: standard / paper dense"),
        Limit::AtMost(1.0),
        [ours / theirs; 2],
        format!("{x} % / {y} %"),
    )
}
