//! A level the paper's way, by libraries of dense products: `T_d->b` and `U_b` of each shape on all its blocks at once,
//! `T_b->r` block-sparse, and one `U_r` an opening (Loos et al. 2011, section 7.3).
//!
//! Nothing is folded, skipped or packed; a library chosen by trial computes each product. The reflected direct light is
//! computed beforehand and not timed, and results are not clamped.

mod operators;

use super::frame_variant::assemble_config;
use super::library::{Libraries, WrongProduct};
use super::lit_maze::LitMaze;
use super::sampled_texel::SampledTexel;
use super::timed_frame::{Cost, TimedFrame, texel_of};
use super::timing::Timed;
use crate::dense_product::{Library, Output, difference, product};
use mrt_core::linalg::matrix::{Matrix, MatrixView, multiply, multiply_add};
use mrt_runtime::low_level::modular::opening_responses::responses_by_opening;
use mrt_runtime::{AssembleError, Coupling, Dictionary, Scene};
use operators::{Arrival, Group, PaperOperators, Place};
use std::time::Instant;

/// Names of the stages that are timed.
pub const STAGES: [&str; 3] = ["T_d->b", "T_b->r", "U_b, U_r"];

/// All stages.
pub const ALL_STAGES: [usize; STAGES.len()] = [0, 1, 2];

/// Blocks whose light is computed a second time by reference products, at most.
const CHECKED_BLOCKS: usize = 24;

/// Relative difference from the reference products above which the answer is wrong.
const TOLERANCE: f64 = 1e-4;

/// Why the paper's way was not measured.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// Level and dictionary do not fit.
    #[error(transparent)]
    Assemble(#[from] AssembleError),
    /// A library is wrong.
    #[error(transparent)]
    Product(#[from] WrongProduct),
    /// The answer is wrong.
    #[error(
        "block {block}: the dense products differ by {found:.1e} from reference ones; expected at most {TOLERANCE:e}"
    )]
    Answer {
        /// Which block.
        block: usize,
        /// Relative difference.
        found: f64,
    },
}

/// A level the paper's way.
pub struct Paper {
    groups: Vec<Group>,
    /// By block of the level.
    places: Vec<Place>,
    arrivals: Vec<Arrival>,
    /// The coefficients of an arrival's sources.
    gathered: Vec<f32>,
    /// Number of response modes kept.
    pub response_modes: usize,
}

impl Paper {
    /// Prepares all operators for the direct light of a frame, chooses libraries and checks the answer.
    ///
    /// Transport between blocks is by lightfields, as in the paper, where the dictionary has them. As many response
    /// modes are kept as a block has modes: those that carry most light in this level.
    ///
    /// # Errors
    /// [`PaperError`].
    pub fn new(
        maze: &LitMaze,
        dictionary: &Dictionary,
        frame: &TimedFrame,
        libraries: &mut Libraries,
    ) -> Result<Self, PaperError> {
        let scene = &frame.scene;
        let config = assemble_config(Coupling::Lightfield);
        let responses = responses_by_opening(&maze.level, scene, dictionary, &config)?;
        let operators = PaperOperators::new(scene, dictionary, &responses);
        let groups = operators.groups(&frame.direct(), libraries)?;
        let places = places(&groups, scene.blocks.len());
        let arrivals = operators.arrivals(&responses, &places, libraries)?;
        let longest = arrivals.iter().map(|a| 3 * a.operator.columns()).max();
        let mut paper = Self {
            groups,
            places,
            arrivals,
            gathered: vec![0.0; longest.unwrap_or(0)],
            response_modes: operators.kept.len(),
        };
        paper.run();
        paper.check()?;
        Ok(paper)
    }

    /// Libraries in use.
    pub fn library_names(&self) -> Vec<&'static str> {
        let of_groups = self.groups.iter().flat_map(|group| group.libraries);
        let all = of_groups.chain(self.arrivals.iter().map(|arrival| arrival.library));
        let mut names: Vec<&str> = all.map(Library::name).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Bytes of operators and signals.
    pub fn bytes(&self) -> usize {
        let of_groups = self.groups.iter().flat_map(|group| {
            let one = [
                &group.coefficients_from_direct,
                &group.indirect_basis,
                &group.light,
                &group.coefficients,
                &group.irradiance,
            ];
            one.into_iter()
                .chain(&group.response_bases)
                .chain(&group.responses)
        });
        let of_arrivals = self.arrivals.iter().map(|arrival| &arrival.operator);
        let matrices = of_groups.chain(of_arrivals);
        matrices.map(|matrix| size_of_val(matrix.data())).sum()
    }

    /// The least that each stage has to do.
    pub fn costs(&self) -> [Cost; STAGES.len()] {
        let flops = self.flops();
        let mut bytes = [0; STAGES.len()];
        let size = |matrix: &Matrix<f32>| size_of_val(matrix.data());
        for group in &self.groups {
            let responses = group.responses.iter().map(size).sum::<usize>();
            let coefficients = size(&group.coefficients);
            bytes[0] += size(&group.coefficients_from_direct) + size(&group.light) + coefficients;
            bytes[1] += coefficients + responses;
            bytes[2] += size(&group.indirect_basis) + coefficients + responses;
            bytes[2] += group.response_bases.iter().map(size).sum::<usize>();
            bytes[2] += size(&group.irradiance);
        }
        bytes[1] += self
            .arrivals
            .iter()
            .map(|a| size(&a.operator))
            .sum::<usize>();
        std::array::from_fn(|stage| Cost {
            flops: flops[stage],
            bytes: bytes[stage] as f64,
        })
    }

    /// Operations of each stage, a multiplication and an addition being two.
    fn flops(&self) -> [f64; STAGES.len()] {
        let of =
            |matrix: &Matrix<f32>, columns: usize| 2.0 * (matrix.data().len() * columns) as f64;
        let mut flops = [0.0; STAGES.len()];
        for group in &self.groups {
            let columns = group.light.columns();
            flops[0] += of(&group.coefficients_from_direct, columns);
            flops[2] += of(&group.indirect_basis, columns);
            flops[2] += group
                .response_bases
                .iter()
                .map(|u| of(u, columns))
                .sum::<f64>();
        }
        flops[1] = self.arrivals.iter().map(|a| of(&a.operator, 3)).sum();
        flops
    }

    /// Indirect irradiance of the last run at sampled texels, W/m².
    pub fn irradiance(&self, scene: &Scene, texels: &[SampledTexel]) -> Vec<[f64; 3]> {
        let at = |sampled: &SampledTexel| {
            let Place { group, position } = self.places[sampled.block];
            let texel = texel_of(scene, sampled);
            let irradiance = &self.groups[group].irradiance;
            std::array::from_fn(|c| f64::from(irradiance[(texel, 3 * position + c)]))
        };
        texels.iter().map(at).collect()
    }

    /// Compares some blocks with products of the reference.
    fn check(&self) -> Result<(), PaperError> {
        let step = self.places.len().div_ceil(CHECKED_BLOCKS);
        for block in (0..self.places.len()).step_by(step) {
            let Place { group, position } = self.places[block];
            let columns = 3 * position..3 * position + 3;
            let found = difference(
                self.groups[group].irradiance.columns_view(columns).data(),
                self.reference_irradiance(self.places[block]).data(),
            );
            if found.is_nan() || found > TOLERANCE {
                return Err(PaperError::Answer { block, found });
            }
        }
        Ok(())
    }

    fn reference_irradiance(&self, place: Place) -> Matrix<f32> {
        let group = &self.groups[place.group];
        let own = self.reference_coefficients(place);
        let mut irradiance = multiply(group.indirect_basis.view(), own.view());
        for arrival in self.arrivals.iter().filter(|a| a.target == place) {
            let basis = &group.response_bases[arrival.opening];
            let mut response = Matrix::zeros(basis.columns(), 3);
            let mut from = 0;
            for &source in &arrival.sources {
                let b = self.reference_coefficients(source);
                let part = arrival.operator.columns_view(from..from + b.rows());
                multiply_add(part, b.view(), response.data_mut());
                from += b.rows();
            }
            multiply_add(basis.view(), response.view(), irradiance.data_mut());
        }
        irradiance
    }

    fn reference_coefficients(&self, Place { group, position }: Place) -> Matrix<f32> {
        let group = &self.groups[group];
        let light = group.light.columns_view(3 * position..3 * position + 3);
        multiply(group.coefficients_from_direct.view(), light)
    }

    fn compute_coefficients(&mut self) {
        for group in &mut self.groups {
            product(
                group.libraries[0],
                group.coefficients_from_direct.view(),
                group.light.view(),
                group.coefficients.data_mut(),
                Output::Replace,
            );
        }
    }

    fn compute_responses(&mut self) {
        for arrival in &self.arrivals {
            let rows = arrival.operator.columns();
            let mut from = 0;
            for &Place { group, position } in &arrival.sources {
                let b = &self.groups[group].coefficients;
                for channel in 0..3 {
                    let column = b.column(3 * position + channel);
                    let to = channel * rows + from;
                    self.gathered[to..to + column.len()].copy_from_slice(column);
                }
                from += b.rows();
            }
            let Place { group, position } = arrival.target;
            let out = &mut self.groups[group].responses[arrival.opening];
            let size = 3 * out.rows();
            product(
                arrival.library,
                arrival.operator.view(),
                MatrixView::new(rows, 3, &self.gathered[..3 * rows]),
                &mut out.data_mut()[position * size..(position + 1) * size],
                Output::Replace,
            );
        }
    }

    fn compute_irradiance(&mut self) {
        for group in &mut self.groups {
            product(
                group.libraries[1],
                group.indirect_basis.view(),
                group.coefficients.view(),
                group.irradiance.data_mut(),
                Output::Replace,
            );
            for (basis, responses) in group.response_bases.iter().zip(&group.responses) {
                product(
                    group.libraries[2],
                    basis.view(),
                    responses.view(),
                    group.irradiance.data_mut(),
                    Output::Add,
                );
            }
        }
    }
}

/// The place of each block.
fn places(groups: &[Group], blocks: usize) -> Vec<Place> {
    let mut places = vec![Place::default(); blocks];
    for (index, group) in groups.iter().enumerate() {
        for (position, &block) in group.blocks.iter().enumerate() {
            places[block] = Place {
                group: index,
                position,
            };
        }
    }
    places
}

impl Timed for Paper {
    fn run(&mut self) -> Vec<f64> {
        let stages: [fn(&mut Self); STAGES.len()] = [
            Self::compute_coefficients,
            Self::compute_responses,
            Self::compute_irradiance,
        ];
        let time = |stage: fn(&mut Self)| {
            let start = Instant::now();
            stage(self);
            start.elapsed().as_secs_f64()
        };
        stages.map(time).to_vec()
    }
}
