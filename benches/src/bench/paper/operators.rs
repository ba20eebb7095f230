//! Operators and signals of the paper's products.

use super::super::library::{Libraries, WrongProduct};
use super::super::lit_maze::ALBEDO;
use crate::dense_product::Library;
use mrt_core::linalg::matrix::{Matrix, multiply};
use mrt_runtime::low_level::modular::dictionary::ShapeOperators;
use mrt_runtime::low_level::modular::opening_responses::OpeningResponses;
use mrt_runtime::{Dictionary, Scene};
use std::collections::BTreeMap;

/// A shape, and the signals of its blocks side by side, three columns a block.
pub(super) struct Group {
    pub(super) blocks: Vec<usize>,
    pub(super) coefficients_from_direct: Matrix<f32>,
    pub(super) indirect_basis: Matrix<f32>,
    /// One an opening.
    pub(super) response_bases: Vec<Matrix<f32>>,
    /// For the products with the three kinds of operators above.
    pub(super) libraries: [Library; 3],
    pub(super) light: Matrix<f32>,
    pub(super) coefficients: Matrix<f32>,
    /// One an opening.
    pub(super) responses: Vec<Matrix<f32>>,
    pub(super) irradiance: Matrix<f32>,
}

/// Where a block's signals are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) group: usize,
    /// Position in the group.
    pub(super) position: usize,
}

/// All responses behind one opening: `[R_1 R_2 ..]` times the coefficients of all sources, one below the other.
pub(super) struct Arrival {
    pub(super) target: Place,
    /// Which opening of the target.
    pub(super) opening: usize,
    pub(super) sources: Vec<Place>,
    pub(super) operator: Matrix<f32>,
    pub(super) library: Library,
}

/// Operators of a scene's shapes, as far as the paper's products use them.
pub(super) struct PaperOperators<'a> {
    pub(super) scene: &'a Scene,
    pub(super) dictionary: &'a Dictionary,
    /// By shape and opening: `U_r` with all response modes.
    bases: Vec<Vec<Matrix<f32>>>,
    /// Response modes that are kept, ascending.
    pub(super) kept: Vec<usize>,
}

impl<'a> PaperOperators<'a> {
    /// Keeps as many response modes as a block has modes: those that add most irradiance over all arrivals.
    pub(super) fn new(
        scene: &'a Scene,
        dictionary: &'a Dictionary,
        responses: &[OpeningResponses],
    ) -> Self {
        let mut operators = Self {
            scene,
            dictionary,
            bases: Vec::new(),
            kept: Vec::new(),
        };
        let shapes = 0..scene.shapes.len();
        operators.bases = shapes
            .map(|shape| operators.response_bases(shape))
            .collect();
        operators.kept = operators.strongest_modes(responses);
        operators
    }

    /// A shape of the scene as the dictionary has it.
    fn of_shape(&self, shape: usize) -> Option<&'a ShapeOperators> {
        let blocks = &self.scene.blocks;
        let block = blocks.iter().position(|b| b.shape_index == shape)?;
        let index = self
            .dictionary
            .shape_index(self.scene.level.blocks[block].shape)?;
        Some(&self.dictionary.shapes[index])
    }

    /// `U_r` of each opening of a shape of the scene, with all response modes.
    fn response_bases(&self, shape: usize) -> Vec<Matrix<f32>> {
        let Some(entry) = self.of_shape(shape) else {
            return Vec::new();
        };
        let bases = entry.openings.iter().filter_map(|opening| {
            let projection = opening.joint_from_response.first()?;
            Some(multiply(entry.joint_basis.view(), projection.view()))
        });
        bases.collect()
    }

    fn strongest_modes(&self, responses: &[OpeningResponses]) -> Vec<usize> {
        let count = self.dictionary.response_modes();
        let square = |x: &f32| f64::from(*x) * f64::from(*x);
        let mut energy = vec![0.0; count];
        for arrival in responses {
            let shape = self.scene.blocks[arrival.target.get()].shape_index;
            let basis = &self.bases[shape][arrival.opening];
            for (mode, energy) in energy.iter_mut().enumerate() {
                let columns = arrival.responses.columns();
                let row = (0..columns).map(|j| square(&arrival.responses[(mode, j)]));
                *energy += row.sum::<f64>() * basis.column(mode).iter().map(square).sum::<f64>();
            }
        }
        let modes = self.scene.blocks.iter().map(|b| b.coefficients.len()).max();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| energy[b].total_cmp(&energy[a]));
        order.truncate(modes.unwrap_or(count));
        order.sort_unstable();
        order
    }

    /// The blocks of each shape, with their reflected direct light and a library for each product.
    pub(super) fn groups(
        &self,
        direct: &[f32],
        libraries: &mut Libraries,
    ) -> Result<Vec<Group>, WrongProduct> {
        let shapes = 0..self.scene.shapes.len();
        let mut groups: Vec<Group> = shapes
            .filter_map(|shape| self.group(shape, direct))
            .collect();
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
        Ok(groups)
    }

    fn group(&self, shape: usize, direct: &[f32]) -> Option<Group> {
        let operators = self.of_shape(shape)?;
        let is_of_shape = |&block: &usize| self.scene.blocks[block].shape_index == shape;
        let blocks: Vec<usize> = (0..self.scene.blocks.len()).filter(is_of_shape).collect();
        let from_direct = &operators.coefficients_from_direct;
        let (modes, texels) = (from_direct.rows(), from_direct.columns());
        let columns = 3 * blocks.len();
        let light = Matrix::from_fn(texels, columns, |texel, column| {
            let range = &self.scene.level.blocks[blocks[column / 3]].texels;
            let channel = column % 3;
            // The benchmark's levels have one albedo.
            ALBEDO[channel] * direct[3 * range.start + channel * range.len() + texel]
        });
        let kept = &self.kept;
        let bases = self.bases[shape].iter();
        let response_bases: Vec<Matrix<f32>> = bases
            .map(|basis| Matrix::from_fn(texels, kept.len(), |i, j| basis[(i, kept[j])]))
            .collect();
        Some(Group {
            coefficients_from_direct: from_direct.clone(),
            indirect_basis: operators.joint_basis.leading_columns(modes),
            libraries: [Library::Gemm; 3],
            light,
            coefficients: Matrix::zeros(modes, columns),
            responses: vec![Matrix::zeros(kept.len(), columns); response_bases.len()],
            irradiance: Matrix::zeros(texels, columns),
            response_bases,
            blocks,
        })
    }

    /// Responses gathered by where they arrive. `places` are those of the level's blocks.
    pub(super) fn arrivals(
        &self,
        responses: &[OpeningResponses],
        places: &[Place],
        libraries: &mut Libraries,
    ) -> Result<Vec<Arrival>, WrongProduct> {
        let mut by_opening: BTreeMap<(usize, usize), Vec<&OpeningResponses>> = BTreeMap::new();
        for arrival in responses {
            let key = (arrival.target.get(), arrival.opening);
            by_opening.entry(key).or_default().push(arrival);
        }
        let mut arrivals = Vec::with_capacity(by_opening.len());
        for ((target, opening), parts) in by_opening {
            let mut columns: Vec<Vec<f32>> = Vec::new();
            for part in &parts {
                let rows = part.responses.selected_rows(&self.kept);
                columns.extend((0..rows.columns()).map(|j| rows.column(j).to_vec()));
            }
            let operator = Matrix::from_columns(self.kept.len(), &columns);
            arrivals.push(Arrival {
                target: places[target],
                opening,
                sources: parts.iter().map(|part| places[part.source.get()]).collect(),
                library: libraries.fastest(operator.view(), 3)?,
                operator,
            });
        }
        Ok(arrivals)
    }
}
