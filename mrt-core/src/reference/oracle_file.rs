//! Reads reference solutions (`NAME.json` beside `NAME.f32`) and turns them into what a solver
//! computes.
//!
//! The format is described beside the files (`oracle/README.md`). Both files are checked in full
//! before anything is returned: sizes against limits before they are read, every number for NaN,
//! the list of walls against the one that the cells imply.

mod folder;
mod parse;

pub use folder::{ground_truth_folder, oracle_folder};
pub use parse::read;

use crate::geometry::cube::Face;
use glam::DVec3;

use crate::reference::bounces::Bounces;
use crate::reference::error_measure::cell_hops;

/// Reflections in the last term of an `irradiance_rgb` file, named `all_bounces` there.
pub const RGB_BOUNCES: usize = 10;

/// Reflections in the last term of a `radiance_sh9` file.
pub const PROBE_BOUNCES: usize = 8;

/// What a file's numbers are.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Irradiance after exactly k reflections with albedo 1, k from 0: shape [light, bounce, wall,
    /// v, u].
    Irradiance,
    /// Indirect irradiance with coloured walls: shape [light, term, wall, v, u, channel], the first
    /// bounce and the sum of [`RGB_BOUNCES`]; not multiplied by the receiver's own albedo.
    IrradianceRgb {
        /// One colour for each wall.
        albedo: Vec<[f64; 3]>,
    },
    /// Incident indirect radiance at points, nine spherical-harmonic coefficients each: shape
    /// [light, term, point, 9].
    RadianceSh9 {
        /// The one albedo of all walls in the terms that name it.
        albedo: f64,
        /// Where; each inside a cell.
        points: Vec<DVec3>,
    },
}

/// A checked reference file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceFile {
    /// The file's name without extension.
    pub name: String,
    /// What the numbers are.
    pub kind: Kind,
    /// Smallest corners of the unit cells; cells that share a face are open to each other.
    pub cells: Vec<[i32; 3]>,
    /// (index into `cells`, face) of every wall, cell by cell in the order of [`Face::ALL`]; also
    /// given for probe files, whose numbers it does not describe.
    pub walls: Vec<(usize, Face)>,
    /// World positions of point lights; each inside a cell.
    pub lights: Vec<DVec3>,
    /// Of every light, W/sr.
    pub intensity: f64,
    /// Texels along a wall; `None` for probe files.
    pub resolution: Option<usize>,
    /// Names of the entries along the second dimension; empty for [`Kind::Irradiance`].
    pub terms: Vec<String>,
    /// Size of each dimension of `data`, slowest first.
    pub shape: Vec<usize>,
    /// All numbers.
    pub data: Vec<f32>,
}

/// Why a reference cannot be read or does not hold what was asked of it.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// A file cannot be opened or read.
    #[error("{file}: cannot be read ({source}); expected a reference file")]
    Io {
        /// Which file.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The description is no JSON of the expected form.
    #[error("{file}: not a reference description: {found}; expected JSON with its keys")]
    Json {
        /// Which file.
        file: String,
        /// What the parser met and where, shortened: it quotes the file, which may be long.
        found: String,
    },
    /// A value contradicts the format or another value.
    #[error("{file}: {what} is {found}; expected {expected}")]
    Malformed {
        /// Which file.
        file: String,
        /// Which value.
        what: String,
        /// What the format asks for.
        expected: String,
        /// What the file holds.
        found: String,
    },
    /// A size is beyond what is worth reading.
    #[error("{file}: {what} is {found}; expected at most {limit}")]
    LimitExceeded {
        /// Which file.
        file: String,
        /// Which size.
        what: String,
        /// Largest accepted.
        limit: u64,
        /// What the file holds.
        found: u64,
    },
    /// The file is sound but does not contain this.
    #[error("{file} has no {what}; it has {found}")]
    NotInFile {
        /// Name of the reference.
        file: String,
        /// What was asked for.
        what: String,
        /// What it does hold.
        found: String,
    },
}

impl ReferenceFile {
    /// One slice of the data: all texels (or points) of a light and a term, row-major; for
    /// [`Kind::Irradiance`] the term is the number of reflections.
    ///
    /// # Errors
    /// [`ReferenceError::NotInFile`] if the light or the term does not exist.
    pub fn term(&self, light: usize, term: usize) -> Result<Vec<f64>, ReferenceError> {
        let (lights, terms) = (self.shape[0], self.shape[1]);
        if light >= lights || term >= terms {
            return Err(self.lacks(
                format!("light {light}, term {term}"),
                format!("{lights} lights and {terms} terms"),
            ));
        }
        let size: usize = self.shape[2..].iter().product();
        let start = (light * terms + term) * size;
        let values = self.data[start..start + size].iter();
        Ok(values.map(|&x| f64::from(x)).collect())
    }

    /// Indirect irradiance of every texel for a uniform albedo a, W/m²: the sum over k >= 1 of a^k
    /// times bounce k.
    ///
    /// [`Bounces::All`] continues behind the last measured bounce K. In a closed level light is only
    /// spread: every bounce has the same mean, and the deviations from it shrink by a factor that
    /// settles. So bounce K + n is taken as mean + ρⁿ (bounce K - mean), with one ρ for the level,
    /// the measured ratio of the last two deviations' norms. (A ratio for each texel would amplify
    /// its noise, and exceeds 1 where light still arrives.) The continued part is about a^K of the
    /// whole. From six bounces, measured on exact terms, it leaves at most 0.06 % of error at albedo
    /// 0.5; at 0.9 below 0.12 % in compact rooms, 2 % in corridors and 5 % in the maze, most of it
    /// far from the light. [`Bounces::Count`] up to K has no such part.
    ///
    /// # Errors
    /// [`ReferenceError::NotInFile`] for coloured or probe files, lights that do not exist, more
    /// bounces than the file holds, and all bounces at an albedo that is not below 1 or with too few
    /// terms to measure ρ.
    pub fn indirect_irradiance(
        &self,
        light: usize,
        bounces: Bounces,
        albedo: f64,
    ) -> Result<Vec<f64>, ReferenceError> {
        if self.kind != Kind::Irradiance {
            return Err(self.lacks("single bounces of irradiance".into(), self.terms.join(", ")));
        }
        let last = self.shape[1] - 1;
        let count = match bounces {
            Bounces::First => 1,
            Bounces::Count(count) => count,
            Bounces::All => last,
        };
        let mut sum = vec![0.0; self.shape[2..].iter().product()];
        let mut weight = 1.0;
        for bounce in 1..=count {
            weight *= albedo;
            for (s, e) in sum.iter_mut().zip(self.term(light, bounce)?) {
                *s += weight * e;
            }
        }
        if bounces == Bounces::All {
            if last < 3 || !(0.0..1.0).contains(&albedo) {
                let what = format!("sum of all bounces at albedo {albedo}");
                return Err(self.lacks(what, format!("{last} bounces, to use below albedo 1")));
            }
            let newest = self.term(light, last)?;
            let mean = newest.iter().sum::<f64>() / newest.len() as f64;
            let shrink = deviation(&newest) / deviation(&self.term(light, last - 1)?).max(1e-30);
            // Noise can make the ratio of a nearly even level anything; it never exceeds 1.
            let shrink = shrink.min(1.0);
            let even = weight * albedo / (1.0 - albedo);
            let uneven = weight * albedo * shrink / (1.0 - albedo * shrink);
            for (s, e) in sum.iter_mut().zip(newest) {
                *s += mean * even + (e - mean) * uneven;
            }
        }
        Ok(sum)
    }

    /// Indirect irradiance of every texel of a coloured file, W/m² per channel.
    ///
    /// The file sums [`RGB_BOUNCES`] reflections, so `All` and `Count(RGB_BOUNCES)` return the same;
    /// what is missing from all of them is about a^10 of the whole for a mean albedo a.
    ///
    /// # Errors
    /// [`ReferenceError::NotInFile`] for other kinds and lights that do not exist, and for other
    /// numbers of bounces.
    pub fn indirect_irradiance_rgb(
        &self,
        light: usize,
        bounces: Bounces,
    ) -> Result<Vec<[f64; 3]>, ReferenceError> {
        let term = match bounces {
            Bounces::First | Bounces::Count(1) => 0,
            Bounces::All | Bounces::Count(RGB_BOUNCES) => 1,
            Bounces::Count(other) => {
                let what = format!("sum of {other} bounces");
                return Err(self.lacks(what, self.terms.join(", ")));
            }
        };
        if !matches!(self.kind, Kind::IrradianceRgb { .. }) {
            return Err(self.lacks("coloured irradiance".into(), self.kind_name().into()));
        }
        let values = self.term(light, term)?;
        let colours = values.chunks_exact(3);
        Ok(colours.map(|c| [c[0], c[1], c[2]]).collect())
    }

    /// Index of the cell that a light is in.
    ///
    /// # Errors
    /// [`ReferenceError::NotInFile`] if the light does not exist.
    pub fn light_cell(&self, light: usize) -> Result<usize, ReferenceError> {
        let position = self.lights.get(light).copied();
        let cell = position.and_then(|position| cell_of(&self.cells, position));
        cell.ok_or_else(|| {
            let found = format!("{} lights", self.lights.len());
            self.lacks(format!("light {light}"), found)
        })
    }

    /// For every wall the number of openings between its cell and the light's, breadth first;
    /// `u32::MAX` where no way leads.
    ///
    /// # Errors
    /// [`ReferenceError::NotInFile`] if the light does not exist.
    pub fn hops(&self, light: usize) -> Result<Vec<u32>, ReferenceError> {
        let hops = cell_hops(&self.cells, self.light_cell(light)?);
        Ok(self.walls.iter().map(|&(cell, _)| hops[cell]).collect())
    }

    fn lacks(&self, what: String, found: String) -> ReferenceError {
        ReferenceError::NotInFile {
            file: self.name.clone(),
            what,
            found,
        }
    }

    fn kind_name(&self) -> &'static str {
        match self.kind {
            Kind::Irradiance => "irradiance",
            Kind::IrradianceRgb { .. } => "irradiance_rgb",
            Kind::RadianceSh9 { .. } => "radiance_sh9",
        }
    }
}

/// Norm of the differences from the mean.
fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares = values.iter().map(|x| (x - mean) * (x - mean));
    squares.sum::<f64>().sqrt()
}

/// The first cell that contains a point, its faces included.
fn cell_of(cells: &[[i32; 3]], point: DVec3) -> Option<usize> {
    cells.iter().position(|cell| {
        let low = DVec3::from_array(cell.map(f64::from));
        point.cmpge(low).all() && point.cmple(low + DVec3::ONE).all()
    })
}
