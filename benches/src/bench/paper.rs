//! A level the paper's way, by libraries of dense products: `T_d->b` and `U_b` of each shape on all its blocks at once,
//! `T_b->r` block-sparse, and one `U_r` an opening (Loos et al. 2011, section 7.3).
//!
//! Nothing is folded, skipped or packed; a library chosen by trial computes each product. What the walls reflect is made
//! beforehand and not timed, and neither is clamping.

use super::library::{Libraries, Library, Sum, WrongProduct, difference, product};
use super::ours::{Cost, Ours, assemble_config, texel_of};
use super::reference::Receiver;
use super::setting::{ALBEDO, Setting};
use super::timing::Timed;
use mrt_core::linalg::matrix::{Matrix, MatrixView, multiply, multiply_add};
use mrt_runtime::low_level::modular::dictionary::ShapeOperators;
use mrt_runtime::low_level::modular::opening_responses::{OpeningResponses, responses_by_opening};
use mrt_runtime::{AssembleError, Coupling, Dictionary, Scene};
use std::collections::BTreeMap;
use std::time::Instant;

/// Names of the stages that are timed.
pub const STAGES: [&str; 3] = ["T_d->b", "T_b->r", "U_b, U_r"];

/// Blocks whose light is computed a second time by reference products, at most.
const CHECKED_BLOCKS: usize = 24;

/// Relative difference to these at which the answer is wrong.
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

/// A shape, and the signals of its blocks side by side, three columns a block.
struct Group {
    blocks: Vec<usize>,
    coefficients_from_direct: Matrix<f32>,
    indirect_basis: Matrix<f32>,
    /// One an opening.
    response_bases: Vec<Matrix<f32>>,
    libraries: [Library; 3],
    light: Matrix<f32>,
    coefficients: Matrix<f32>,
    /// One an opening.
    responses: Vec<Matrix<f32>>,
    irradiance: Matrix<f32>,
}

/// All responses behind one opening: `[R_1 R_2 ..]` times the sources' coefficients, one below the other.
struct Arrival {
    /// Group, opening, and position in the group of the target.
    target: (usize, usize, usize),
    /// Group and position of each source.
    sources: Vec<(usize, usize)>,
    operator: Matrix<f32>,
    library: Library,
}

/// A level the paper's way.
pub struct Paper {
    groups: Vec<Group>,
    /// Group and position of each block.
    place: Vec<(usize, usize)>,
    arrivals: Vec<Arrival>,
    gathered: Vec<f32>,
    /// Response modes kept.
    pub response_modes: usize,
}

impl Paper {
    /// Prepares all operators for the direct light of `ours`, chooses libraries and checks the answer.
    ///
    /// Transport between blocks is by lightfields, as in the paper, where the dictionary has them. As many response
    /// modes are kept as a block has modes: those that carry most in this level.
    ///
    /// # Errors
    /// [`PaperError`].
    pub fn new(
        setting: &Setting,
        dictionary: &Dictionary,
        ours: &Ours,
        libraries: &mut Libraries,
    ) -> Result<Self, PaperError> {
        let scene = &ours.scene;
        let config = assemble_config(Coupling::Lightfield);
        let all = responses_by_opening(&setting.level, scene, dictionary, &config)?;
        let bases: Vec<Vec<Matrix<f32>>> = (0..scene.shapes.len())
            .map(|shape| response_bases(scene, dictionary, shape))
            .collect();
        let kept = strongest_modes(scene, &bases, &all, dictionary.response_modes());
        let mut groups = groups(scene, dictionary, &ours.direct(), &bases, &kept);
        let mut place = vec![(0, 0); scene.level.blocks.len()];
        for (g, group) in groups.iter().enumerate() {
            for (k, &block) in group.blocks.iter().enumerate() {
                place[block] = (g, k);
            }
        }
        for group in &mut groups {
            let columns = group.light.columns();
            group.libraries = [
                libraries.fastest(group.coefficients_from_direct.view(), columns)?,
                libraries.fastest(group.indirect_basis.view(), columns)?,
                match group.response_bases.first() {
                    Some(basis) => libraries.fastest(basis.view(), columns)?,
                    None => Library::Gemm,
                },
            ];
        }
        let arrivals = arrivals(&all, &place, &kept, libraries)?;
        let longest = arrivals.iter().map(|a| 3 * a.operator.columns()).max();
        let mut paper = Self {
            groups,
            place,
            arrivals,
            gathered: vec![0.0; longest.unwrap_or(0)],
            response_modes: kept.len(),
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

    /// What each stage has to do.
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

    /// Operations of each stage, a product and a sum being two.
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

    /// Indirect irradiance of the last run.
    pub fn irradiance(&self, scene: &Scene, receivers: &[Receiver]) -> Vec<[f64; 3]> {
        let at = |receiver: &Receiver| {
            let (group, position) = self.place[receiver.block];
            let texel = texel_of(scene, receiver);
            let irradiance = &self.groups[group].irradiance;
            std::array::from_fn(|c| f64::from(irradiance[(texel, 3 * position + c)]))
        };
        receivers.iter().map(at).collect()
    }

    /// Compares some blocks with products of the reference.
    fn check(&self) -> Result<(), PaperError> {
        let step = self.place.len().div_ceil(CHECKED_BLOCKS);
        for block in (0..self.place.len()).step_by(step) {
            let (g, position) = self.place[block];
            let group = &self.groups[g];
            let own = self.reference_coefficients((g, position));
            let mut expected = multiply(group.indirect_basis.view(), own.view());
            let behind = |a: &&Arrival| (a.target.0, a.target.2) == (g, position);
            for arrival in self.arrivals.iter().filter(behind) {
                let basis = &group.response_bases[arrival.target.1];
                let mut response = Matrix::zeros(basis.columns(), 3);
                let mut from = 0;
                for &source in &arrival.sources {
                    let b = self.reference_coefficients(source);
                    let part = arrival.operator.columns_view(from..from + b.rows());
                    multiply_add(part, b.view(), response.data_mut());
                    from += b.rows();
                }
                multiply_add(basis.view(), response.view(), expected.data_mut());
            }
            let columns = 3 * position..3 * position + 3;
            let found = difference(
                group.irradiance.columns_view(columns).data(),
                expected.data(),
            );
            if found.is_nan() || found > TOLERANCE {
                return Err(PaperError::Answer { block, found });
            }
        }
        Ok(())
    }

    fn reference_coefficients(&self, (group, position): (usize, usize)) -> Matrix<f32> {
        let group = &self.groups[group];
        let light = group.light.columns_view(3 * position..3 * position + 3);
        multiply(group.coefficients_from_direct.view(), light)
    }
}

/// A shape of the scene as the dictionary has it.
fn operators<'a>(
    scene: &Scene,
    dictionary: &'a Dictionary,
    shape: usize,
) -> Option<&'a ShapeOperators> {
    let block = scene.blocks.iter().position(|b| b.shape_index == shape)?;
    dictionary
        .shape_index(scene.level.blocks[block].shape)
        .map(|k| &dictionary.shapes[k])
}

/// `U_r` of each opening of a shape of the scene, with all response modes.
fn response_bases(scene: &Scene, dictionary: &Dictionary, shape: usize) -> Vec<Matrix<f32>> {
    let Some(entry) = operators(scene, dictionary, shape) else {
        return Vec::new();
    };
    let bases = entry.openings.iter().filter_map(|opening| {
        let projection = opening.joint_from_response.first()?;
        Some(multiply(entry.joint_basis.view(), projection.view()))
    });
    bases.collect()
}

/// As many response modes as a block has modes, ascending: those that add most irradiance over all arrivals.
fn strongest_modes(
    scene: &Scene,
    bases: &[Vec<Matrix<f32>>],
    all: &[OpeningResponses],
    count: usize,
) -> Vec<usize> {
    let square = |x: &f32| f64::from(*x) * f64::from(*x);
    let mut energy = vec![0.0; count];
    for arrival in all {
        let basis = &bases[scene.blocks[arrival.target.get()].shape_index][arrival.opening];
        for (mode, energy) in energy.iter_mut().enumerate() {
            let columns = arrival.responses.columns();
            let row = (0..columns).map(|j| square(&arrival.responses[(mode, j)]));
            *energy += row.sum::<f64>() * basis.column(mode).iter().map(square).sum::<f64>();
        }
    }
    let modes = scene.blocks.iter().map(|b| b.coefficients.len()).max();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| energy[b].total_cmp(&energy[a]));
    order.truncate(modes.unwrap_or(count));
    order.sort_unstable();
    order
}

fn groups(
    scene: &Scene,
    dictionary: &Dictionary,
    direct: &[f32],
    bases: &[Vec<Matrix<f32>>],
    kept: &[usize],
) -> Vec<Group> {
    let group = |shape: usize| {
        let operators = operators(scene, dictionary, shape)?;
        let of_shape = |&block: &usize| scene.blocks[block].shape_index == shape;
        let blocks: Vec<usize> = (0..scene.level.blocks.len()).filter(of_shape).collect();
        let (modes, texels) = (
            operators.coefficients_from_direct.rows(),
            operators.coefficients_from_direct.columns(),
        );
        let columns = 3 * blocks.len();
        let light = Matrix::from_fn(texels, columns, |texel, column| {
            let range = &scene.level.blocks[blocks[column / 3]].texels;
            let channel = column % 3;
            // The benchmark's levels have one albedo.
            let albedo = ALBEDO[channel];
            albedo * direct[3 * range.start + channel * range.len() + texel]
        });
        let response_bases: Vec<Matrix<f32>> = bases[shape]
            .iter()
            .map(|basis| Matrix::from_fn(texels, kept.len(), |i, j| basis[(i, kept[j])]))
            .collect();
        Some(Group {
            coefficients_from_direct: operators.coefficients_from_direct.clone(),
            indirect_basis: operators.joint_basis.leading_columns(modes),
            libraries: [Library::Gemm; 3],
            light,
            coefficients: Matrix::zeros(modes, columns),
            responses: vec![Matrix::zeros(kept.len(), columns); response_bases.len()],
            irradiance: Matrix::zeros(texels, columns),
            response_bases,
            blocks,
        })
    };
    (0..scene.shapes.len()).filter_map(group).collect()
}

/// Responses gathered by where they arrive.
fn arrivals(
    all: &[OpeningResponses],
    place: &[(usize, usize)],
    kept: &[usize],
    libraries: &mut Libraries,
) -> Result<Vec<Arrival>, WrongProduct> {
    let mut by_opening: BTreeMap<(usize, usize), Vec<&OpeningResponses>> = BTreeMap::new();
    for arrival in all {
        let key = (arrival.target.get(), arrival.opening);
        by_opening.entry(key).or_default().push(arrival);
    }
    let mut arrivals = Vec::with_capacity(by_opening.len());
    for ((target, opening), parts) in by_opening {
        let mut columns: Vec<Vec<f32>> = Vec::new();
        for part in &parts {
            let rows = part.responses.selected_rows(kept);
            columns.extend((0..rows.columns()).map(|j| rows.column(j).to_vec()));
        }
        let operator = Matrix::from_columns(kept.len(), &columns);
        let (group, position) = place[target];
        arrivals.push(Arrival {
            target: (group, opening, position),
            sources: parts.iter().map(|part| place[part.source.get()]).collect(),
            library: libraries.fastest(operator.view(), 3)?,
            operator,
        });
    }
    Ok(arrivals)
}

impl Timed for Paper {
    fn run(&mut self) -> Vec<f64> {
        let start = Instant::now();
        for group in &mut self.groups {
            product(
                group.libraries[0],
                group.coefficients_from_direct.view(),
                group.light.view(),
                group.coefficients.data_mut(),
                Sum::New,
            );
        }
        let after_coefficients = Instant::now();
        for arrival in &self.arrivals {
            let rows = arrival.operator.columns();
            let mut from = 0;
            for &(group, position) in &arrival.sources {
                let b = &self.groups[group].coefficients;
                for channel in 0..3 {
                    let column = b.column(3 * position + channel);
                    let to = channel * rows + from;
                    self.gathered[to..to + column.len()].copy_from_slice(column);
                }
                from += b.rows();
            }
            let (group, opening, position) = arrival.target;
            let out = &mut self.groups[group].responses[opening];
            let size = 3 * out.rows();
            product(
                arrival.library,
                arrival.operator.view(),
                MatrixView::new(rows, 3, &self.gathered[..3 * rows]),
                &mut out.data_mut()[position * size..(position + 1) * size],
                Sum::New,
            );
        }
        let after_responses = Instant::now();
        for group in &mut self.groups {
            product(
                group.libraries[1],
                group.indirect_basis.view(),
                group.coefficients.view(),
                group.irradiance.data_mut(),
                Sum::New,
            );
            for (basis, responses) in group.response_bases.iter().zip(&group.responses) {
                product(
                    group.libraries[2],
                    basis.view(),
                    responses.view(),
                    group.irradiance.data_mut(),
                    Sum::Add,
                );
            }
        }
        let end = Instant::now();
        [
            after_coefficients - start,
            after_responses - after_coefficients,
            end - after_responses,
        ]
        .map(|time| time.as_secs_f64())
        .to_vec()
    }
}
